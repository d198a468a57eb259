"""Reading component and thruster files; broken ones are in `tests/broken/components` and `tests/broken/thrusters`."""

import math
import warnings
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.errors import ConfigError, VrxWarning
from vrx_mj.formats.parts.read import PartsFile, load_parts, name_of, place_of
from vrx_mj.packages import root

BROKEN = Path(__file__).parents[3] / "broken"
CASES = [(kind, file.name) for kind in ("components", "thrusters") for file in sorted((BROKEN / kind).glob("*.yaml"))]
START = root() / "assets" / "start"
FOREVER = [pytest.mark.slow, pytest.mark.nightly]
"""By day a bomb of xacro is stopped by the limit of processor time (test_xacro_bombs.py)."""


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        pytest.param(kind, name, id=f"{kind}-{Path(name).stem}", marks=FOREVER * (name == "expression_power.yaml"))
        for kind, name in CASES
    ],
)
def test_a_broken_file_says_what_and_where(kind, name, monkeypatch):
    monkeypatch.chdir(BROKEN / kind)
    expected = Path(name).with_suffix(".expected").read_text(encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_parts(name, kind)
    assert str(caught.value) == expected.rstrip("\n")


def test_there_are_enough_broken_files():
    assert len(CASES) >= 50


def test_types_and_instances_keep_the_order_of_the_file(parts):
    file = parts("wamv_gps: [{name: a}]\nlidar: [{name: b}, {name: c}]\nwamv_camera: [{name: d, y: 0, x: 1}]\n")
    assert [(part.type, part.index, name_of(part)) for part in file.instances] == [
        ("wamv_gps", 0, "a"),
        ("lidar", 0, "b"),
        ("lidar", 1, "c"),
        ("wamv_camera", 0, "d"),
    ]
    assert list(file.instances[3].parameters) == ["name", "y", "x"]
    assert (file.path, file.kind, file.stops) == (Path("components.yaml"), "components", ())


def test_a_part_knows_where_it_stands(parts):
    (part,) = parts("# mine\nwamv_gps:\n    - x: 0.4\n      name: gps\n").instances
    assert (part.place.file.name, part.place.line, part.place.column) == ("components.yaml", 3, 7)


@pytest.mark.parametrize(
    "text", ["", "\n\n", "# nothing\n", "---\n", "---\n# nothing\n...\n", "{}\n", "wamv_gps: []\n"]
)
@pytest.mark.parametrize("kind", ["components", "thrusters"])
def test_an_empty_file_has_no_parts(parts, text, kind):
    text = text if kind == "components" else text.replace("wamv_gps", "engine")
    assert parts(text, kind) == PartsFile(Path(f"{kind}.yaml"), kind, ())


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("0.3", 0.3),
        ("1", 1.0),
        ('"0.3"', 0.3),
        ("' 0.3 '", 0.3),
        ("1e-3", 1e-3),
        ("'.5'", 0.5),
        ("${radians(15)}", math.radians(15)),
        ("-${pi/2}", -math.pi / 2),
        ("'${ 0.1 + 0.2 }'", 0.1 + 0.2),
        ("${math.sqrt(2)}", math.sqrt(2)),
        ("${cos(0.5)}", math.cos(0.5)),
    ],
)
def test_a_number_may_be_in_quotes_or_an_expression(parts, written, meant):
    (part,) = (
        parts(f"wamv_gps: [{{P: {written}}}]\n").instances
        if "{" not in written
        else parts(f"wamv_gps:\n    - P: {written}\n").instances
    )
    assert part.parameters["P"] == meant
    assert isinstance(part.parameters["P"], float)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("1.0 0 -1.0", "1 0 -1"),
        ("'-2.373776 1.027135  0.318237'", "-2.373776 1.027135 0.318237"),
        ("[1, 0.5, '-1']", "1 0.5 -1"),
        ("0 0 ${radians(90)}", f"0 0 {math.pi / 2!r}"),
        ("['${1 + 1}', 0, 0]", "2 0 0"),
    ],
)
def test_a_position_is_a_text_of_three_numbers(parts, written, meant):
    (part,) = parts(f"wamv_pinger:\n    - position: {written}\n").instances
    assert part.parameters == {"position": meant}


@pytest.mark.parametrize(
    ("written", "meant"),
    [("True", True), ("false", False), ("yes", True), ("'Off'", False), ("1", True), ("${1 > 2}", False)],
)
def test_a_switch_takes_the_words_that_yaml_ever_had(parts, written, meant):
    (part,) = parts(f"wamv_camera:\n    - name: front\n      visualize: {written}\n").instances
    assert part.parameters["visualize"] is meant


STOPS = {
    "wamv_gps:\nwamv_imu: [{name: imu}]\n": ("components.yaml:1:1: wamv_gps: a type without instances",),
    "wamv_gps: {name: gps}\n": ("components.yaml:1:11: wamv_gps: one instance that is not in a list",),
    "lidar: [{name: a}]\nlidar*: [{name: b}]\n": ("components.yaml:2:1: lidar*: a key with '*'",),
    "wamv_gps: [{x: '${0.1 + 0.3}'}]\n": ("components.yaml:1:16: wamv_gps[0].x: an expression for a coordinate",),
    "wamv_pinger: [{position: [1, 0, -1]}]\n": (
        "components.yaml:1:26: wamv_pinger[0].position: a list instead of a text",
    ),
    "wamv_gps: [{P: '${radians(5)}', x: '0.4'}]\n": (),
}


@pytest.mark.parametrize("text", STOPS)
def test_what_vrx_stops_at_is_read_and_noted(parts, text):
    file = parts(text)
    assert file.stops == STOPS[text]
    assert len(file.instances) == (2 if "lidar" in text else 1)


def test_an_engine_s_position_is_a_coordinate_too(parts):
    file = parts("engine: [{prefix: left, position: '-2.4 ${0.5 * 2} 0', orientation: '0 0 ${pi}'}]\n", "thrusters")
    assert file.stops == ("thrusters.yaml:1:35: engine[0].position: an expression for a coordinate",)
    assert place_of(file.instances[0]) == (-2.4, 1.0, 0.0)


def test_stars_repeat_a_type_and_its_instances_are_counted_on(parts):
    file = parts("lidar: [{name: a}]\nlidar*: [{name: b}]\n'*lidar*': [{name: c}]\n")
    assert [(part.type, part.index, name_of(part)) for part in file.instances] == [
        ("lidar", 0, "a"),
        ("lidar", 1, "b"),
        ("lidar", 2, "c"),
    ]


def test_what_is_left_out_is_the_macro_s_default(parts):
    file = parts("wamv_gps: [{}]\nwamv_imu: [{}]\nwamv_ball_shooter: [{}]\nwamv_p3d: [{}]\nwamv_pinger: [{}]\n")
    assert [(name_of(part), place_of(part)) for part in file.instances] == [
        ("gps", (0.3, 0.0, 1.3)),
        ("imu", (0.3, 0.5, 1.3)),
        ("ball_shooter", (0.55, 0.35, 1.4)),
        ("ground_truth_odometry", None),
        ("pinger", None),
    ]
    assert [dict(part.parameters) for part in file.instances] == [{}] * 5


def test_a_pinger_of_jazzy_is_a_pinger(parts):
    with pytest.warns(VrxWarning):
        (part,) = parts("wamv_pinger: [{sensor_name: receiver, position: 1.0 0 -1.0}]\n").instances
    assert (part.type, name_of(part), part.parameters["position"]) == ("wamv_pinger", "receiver", "1 0 -1")
    (other,) = parts("wamv_pinger: [{pinger_name: beacon}]\n").instances
    assert name_of(other) == "receiver"


ODD = {
    "wamv_camera: [{name: front, z: 1.3}]\n": "components.yaml:1:32: wamv_camera[0].z: at 1.3 m its post is "
    "-0.0235 m long, and its mass negative; at least 1.3235 m is needed",
    "lidar: [{name: top, z: 1.3}]\n": "components.yaml:1:24: lidar[0].z: at 1.3 m its post is -0.0465 m long, "
    "and its mass negative; at least 1.3465 m is needed",
    "wamv_camera: [{name: front, post_z_from: 1.6}]\n": "components.yaml:1:15: wamv_camera[0].z: at 1.5 m its "
    "post is -0.127 m long, and its mass negative; at least 1.627 m is needed",
    "lidar: [{name: top, type: 64_beam}]\n": "components.yaml:1:27: lidar[0].type: VRX has no lidar type "
    "'64_beam'; known: 16_beam, 32_beam",
    "wamv_gps: [{P: 15}]\n": "components.yaml:1:16: wamv_gps[0].P: 15 exceeds a full turn, 6.2832; angles are in "
    "radians: ${radians(15)}",
    "wamv_pinger: [{orientation: 0 0 90}]\n": "components.yaml:1:29: wamv_pinger[0].orientation: 90 exceeds a full "
    "turn, 6.2832; angles are in radians: ${radians(90)}",
    "wamv_pinger: [{sensor_name: receiver, position: 1 0 -1}]\n": "components.yaml:1:49: "
    "wamv_pinger[0].position: VRX jazzy reads it as the beacon's position in the world; the receiver is at "
    "base_link's origin",
}


@pytest.mark.parametrize("text", ODD)
def test_what_nobody_means_is_warned_about_once(parts, text):
    with pytest.warns(VrxWarning) as caught:
        file = parts(text)
    assert [str(warning.message) for warning in caught] == [ODD[text]]
    assert len(file.instances) == 1


@pytest.mark.parametrize(
    "text",
    [
        "wamv_camera: [{name: front, z: 1.3235}]\n",
        "lidar: [{name: top, z: 1.3465, type: 32_beam}]\n",
        "wamv_camera: [{name: front, z: 1.3, post_z_from: 1.2}]\n",
        "wamv_gps: [{P: 6.28}]\n",
        "wamv_pinger: [{sensor_name: receiver}]\n",
    ],
)
def test_what_is_just_right_is_not_warned_about(parts, text):
    assert len(parts(text).instances) == 1


def test_a_file_that_is_not_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError) as caught:
        load_parts("no.yaml", "components")
    assert str(caught.value) == "no.yaml: cannot be read: No such file or directory"


def test_a_path_that_no_file_can_have():
    with pytest.raises(ConfigError) as caught:
        load_parts("a\0b.yaml", "components")
    assert str(caught.value).endswith(": cannot be read: its name is not valid")


TEXTS = {kind: (START / f"{kind[:-1]}_config.yaml").read_text(encoding="utf-8") for kind in ("components", "thrusters")}
PIECES = [
    "",
    ":",
    "- ",
    "\n",
    "  ",
    "{",
    "}",
    "[",
    "${",
    "*",
    "&a ",
    "*a",
    "null",
    "'",
    '"',
    "1e999",
    "name: ",
    "é",
    "\t",
]


@given(kind=st.sampled_from(sorted(TEXTS)), data=st.data())
def test_any_file_ends_in_parts_or_in_a_message(kind, data, tmp_path_factory):
    text = TEXTS[kind]
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        piece = data.draw(st.sampled_from(PIECES))
        text = text[:start] + piece + text[start + data.draw(st.integers(0, 12)) :]
    file = tmp_path_factory.mktemp("any") / "any.yaml"
    file.write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        try:
            found = load_parts(file, kind)
        except ConfigError as error:
            assert str(error)  # noqa: PT017
        else:
            assert all(name_of(part) for part in found.instances)
