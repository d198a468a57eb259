import json
import math
import random
import string
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype

from needs import ROS1_MESSAGES, require
from vrx_mj.errors import CommandError
from vrx_mj.ros.messages import (
    PADDING,
    decode,
    definition,
    duration,
    encode,
    full_name,
    full_text,
    is_known,
    md5sum,
    new,
    own_text,
    service_md5sum,
    stamp,
    typestore,
)

GOLDEN = json.loads((Path(__file__).parents[2] / "golden/ros/md5.json").read_text(encoding="utf-8"))
DEBIAN = "/usr/bin/python3"
INTEGERS = {f"{sign}int{bits}": (0 if sign else -(1 << bits - 1), (1 << bits - (not sign)) - 1)
            for sign in ("", "u") for bits in (8, 16, 32, 64)}  # fmt: skip
INTEGERS |= {"byte": (0, 127), "char": (0, 255)}  # ROS 1 calls the bytes above 127 of a `byte` negative
KNOWN = sorted(name.replace("/msg/", "/") for name in typestore().types if not name.startswith("builtin_interfaces"))

THEIRS = """
import glob, importlib, json, os, sys, genpy
top = os.path.dirname(os.path.dirname(genpy.__file__))
classes, services = {}, {}
for file in sorted(glob.glob(os.path.join(top, "*", "*", "_*.py"))):
    package, kind, name = file.split(os.sep)[-3:]
    if kind not in ("msg", "srv") or name == "__init__.py":
        continue
    module = importlib.import_module(package + "." + kind + "." + name[:-3])
    for one in list(vars(module).values()):
        if isinstance(one, type) and issubclass(one, genpy.Message) and one._type.startswith(package + "/"):
            classes[one._type] = one
        elif hasattr(one, "_request_class"):
            services[one._type] = one._md5sum

def plain(value):
    if isinstance(value, genpy.rostime.TVal):
        return [value.secs, value.nsecs]
    if isinstance(value, genpy.Message):
        return [plain(getattr(value, name)) for name in value.__slots__]
    return [plain(each) for each in value] if isinstance(value, (list, tuple, bytes)) else value

def written(message):
    import io
    file = io.BytesIO()
    message.serialize(file)
    return file.getvalue().hex()

told = {name: {"md5": one._md5sum, "empty": written(one())} for name, one in classes.items()}
for name, raw in json.load(sys.stdin).items():
    if name in classes:
        message = classes[name]()
        message.deserialize(bytes.fromhex(raw))
        told[name].update(values=plain(message), raw=written(message))
json.dump({"messages": told, "services": services}, sys.stdout)
"""


def filled(name, chance):
    """A message with something in every field."""
    kinds = dict(typestore().fielddefs[full_name(name)][1])
    return new(name, **{field: value_of(kind, chance) for field, kind in kinds.items() if field != PADDING})


def value_of(kind, chance):
    node, about = kind
    if node == Nodetype.BASE:
        return number_of(about[0], chance)
    if node == Nodetype.NAME:
        if about == "builtin_interfaces/msg/Time":
            return stamp(chance.randrange(1 << 31) + 0.25)
        return duration(chance.randrange(1 << 20) + 0.5) if about.endswith("/Duration") else filled(about, chance)
    inner, count = about
    values = [value_of(inner, chance) for _ in range(count if node == Nodetype.ARRAY else chance.randrange(4))]
    if inner[0] == Nodetype.BASE and inner[1][0] != "string":
        return np.array(values, {"byte": "u1", "char": "u1"}.get(inner[1][0], inner[1][0]))
    return values


def number_of(kind, chance):
    if kind == "string":
        return "".join(chance.choices(string.printable + "船é", k=chance.randrange(9)))
    if kind == "bool":
        return chance.random() < 0.5
    if kind.startswith("float"):
        return float(np.dtype(kind).type(chance.uniform(-1e9, 1e9)))
    return chance.randint(*INTEGERS[kind])


def plain(value):
    """Nested lists of numbers and strings, as the other side makes of its own messages."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list):
        return [plain(each) for each in value]
    if hasattr(value, "__msgtype__"):
        names = [name for name, _ in typestore().fielddefs[value.__msgtype__][1] if name != PADDING]
        return [plain(getattr(value, name)) for name in names]
    return value


@pytest.fixture(scope="module")
def theirs():
    """What Debian's classes make of a random message of every type: values, bytes, md5; and of services, md5."""
    require(ROS1_MESSAGES)
    sent = {name: filled(name, random.Random(name)) for name in KNOWN}
    raw = json.dumps({name: encode(message, name).hex() for name, message in sent.items()})
    done = subprocess.run([DEBIAN, "-c", THEIRS], input=raw, capture_output=True, encoding="utf-8", timeout=60,
                          check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    told["messages"] = {name: one for name, one in told["messages"].items() if is_known(name)}
    return told, sent


def test_md5_sums_are_those_of_ros():
    assert {name: md5sum(name) for name in GOLDEN["messages"]} == GOLDEN["messages"]
    assert {name: service_md5sum(name) for name in GOLDEN["services"]} == GOLDEN["services"]


@pytest.mark.slow
def test_md5_sums_are_those_of_debians_classes(theirs):
    told, _ = theirs
    assert len(told["messages"]) > 60
    assert {name: md5sum(name) for name in told["messages"]} == {n: one["md5"] for n, one in told["messages"].items()}


@pytest.mark.slow
def test_md5_sums_of_services_are_those_of_debians_classes(theirs):
    told, _ = theirs
    ours = {name: md5 for name, md5 in told["services"].items() if is_known(f"{name}Request")}
    assert {"std_srvs/Empty", "std_srvs/Trigger", "roscpp/GetLoggers"} <= set(ours)
    assert {name: service_md5sum(name) for name in ours} == ours


@pytest.mark.slow
def test_debians_classes_read_every_field_of_what_is_written(theirs):
    told, sent = theirs
    assert {name: one["values"] for name, one in told["messages"].items()} == {
        name: plain(sent[name]) for name in told["messages"]
    }


@pytest.mark.slow
def test_debians_classes_write_the_same_bytes_and_they_are_read(theirs):
    told, sent = theirs
    for name, one in told["messages"].items():
        raw = bytes.fromhex(one["raw"])
        assert raw == encode(sent[name], name), name
        assert plain(decode(raw, name)) == plain(sent[name]), name


@pytest.mark.slow
def test_what_is_not_given_is_as_in_debians_classes(theirs):
    told, _ = theirs
    assert {name: encode(new(name), name).hex() for name in told["messages"]} == {
        name: one["empty"] for name, one in told["messages"].items()
    }


@given(name=st.sampled_from(KNOWN), seed=st.integers(0, 1 << 32))
def test_what_is_written_reads_back(name, seed):
    message = filled(name, random.Random(seed))
    raw = encode(message, name)
    back = decode(memoryview(raw), name)
    assert plain(back) == plain(message)
    assert encode(back, name) == raw


@given(name=st.sampled_from(KNOWN), raw=st.binary(max_size=200))
def test_bytes_that_are_no_message_are_told(name, raw):
    told = None
    try:
        decode(raw, name)
    except CommandError as error:
        told = str(error)
    assert told is None or told.startswith(f"{len(raw)} bytes are not a {name}: ")


@given(st.floats(0, 4e9))
def test_a_stamp_is_the_moment_to_half_a_nanosecond(time):
    made = stamp(time)
    assert 0 <= made.nanosec < 1_000_000_000
    assert made.sec * 1_000_000_000 + made.nanosec == round(time * 1e9)


@pytest.mark.parametrize(("seconds", "parts"), [(1.25, (1, 250_000_000)), (-1.25, (-1, -250_000_000)), (0.0, (0, 0))])
def test_a_duration_has_its_sign_in_both_parts(seconds, parts):
    made = duration(seconds)
    assert (made.sec, made.nanosec) == parts


def test_a_mapping_stands_for_a_message():
    made = new("geometry_msgs/PoseStamped", pose={"position": {"x": 1.5}})
    assert made.pose.position.x == 1.5
    assert math.isclose(made.pose.orientation.w, 0.0)


def test_a_definition_has_those_of_the_types_that_it_uses():
    assert definition("usv_msgs/RangeBearing").split("\n")[:4] == [
        "std_msgs/Header header",
        "float32 range",
        "float32 bearing",
        "float32 elevation",
    ]
    assert "MSG: std_msgs/Header" in definition("usv_msgs/RangeBearing")


COMMENTED = "# Where it is.\\nfloat64 x\nfloat64 y\nfloat64 z\n"


@pytest.mark.parametrize(("text", "kept"), [(md5sum("geometry_msgs/Point"), True), ("0" * 32, False)])
def test_a_text_is_that_of_the_ros_that_is_here_if_its_type_is_the_same(tmp_path, monkeypatch, text, kept):
    (tmp_path / "geometry_msgs/msg").mkdir(parents=True)
    own = f'class Point:\n  _md5sum = "{text}"\n  _type = "geometry_msgs/Point"\n  _full_text = """{COMMENTED}"""\n'
    (tmp_path / "geometry_msgs/msg/_Point.py").write_text(own, encoding="utf-8")
    monkeypatch.setattr("sys.path", [str(tmp_path)])
    monkeypatch.setattr("vrx_mj.ros.messages.CLASSES", "")
    for found in (own_text, full_text):
        found.cache_clear()
    try:
        expected = COMMENTED.replace("\\n", "\n") if kept else "float64 x\nfloat64 y\nfloat64 z\n"
        assert own_text("geometry_msgs/Point").strip() == expected.strip()
        parts = full_text("geometry_msgs/PointStamped").split(f"\n{'=' * 80}\nMSG: ")
        assert [part.partition("\n")[0] for part in parts[1:]] == ["std_msgs/Header", "geometry_msgs/Point"]
        assert parts[2].partition("\n")[2].strip() == expected.strip()
    finally:
        for found in (own_text, full_text):
            found.cache_clear()


@pytest.mark.parametrize(
    ("time", "parts"), [(1.9999999999, (2, 0)), (2.0000000004, (2, 0)), (0.1 + 0.2, (0, 300_000_000))]
)
def test_a_stamp_is_the_nearest_nanosecond(time, parts):
    moment = stamp(time)
    assert (moment.sec, moment.nanosec) == parts


@pytest.mark.parametrize("seconds", [1.25, -1.25, 0.5, -0.5, -1e-10])
def test_a_duration_has_the_sign_of_its_seconds_in_both_parts(seconds):
    span = duration(seconds)
    assert span.sec + 1e-9 * span.nanosec == pytest.approx(seconds, abs=1e-9)
    assert span.sec * span.nanosec >= 0
