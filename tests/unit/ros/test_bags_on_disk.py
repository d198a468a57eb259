"""What is in a bag before it is complete, on a clock that is set by hand: bags of the three kinds."""

from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag2 import Reader as Reader2

from vrx_mj.errors import RecordError
from vrx_mj.ros import bags
from vrx_mj.ros.bags import Bag
from vrx_mj.ros.interface import Delivery, Output, RosInterface
from vrx_mj.ros.messages import decode, new

NUMBER, TEXT = (
    Output(name, kind, lambda: None, latched=latched)
    for name, kind, latched in (("/number", "std_msgs/Float64", False), ("/text", "std_msgs/String", True))
)
NAMES = ("out.bag", "out.mcap", "out")


@pytest.fixture
def clock(monkeypatch):
    one = SimpleNamespace(now=50.0, monotonic=lambda: one.now)
    monkeypatch.setattr(bags, "time", one)
    return one


def opened(path):
    bag = Bag(path)
    assert bag.start() == [f"bag: {path}"]
    bag.offer(RosInterface({one.name: one for one in (NUMBER, TEXT)}))
    return bag


def size(path):
    files = [path] if path.is_file() else [file for file in path.iterdir() if file.suffix == ".db3"]
    return sum(file.stat().st_size for file in files)


@pytest.mark.parametrize("name", NAMES)
def test_what_was_published_is_on_the_disk_after_a_second(tmp_path, clock, name):
    path, flushed = tmp_path / name, []
    bag = opened(path)
    bag._file.flush = lambda write=bag._file.flush: flushed.append(clock.now) or write()
    for moment in (50.0, 50.9, 51.0, 51.1, 52.0, 52.2):
        clock.now = moment
        bag.publish([Delivery(NUMBER, new("std_msgs/Float64", data=moment), moment - 50.0)])
    assert flushed == [51.1, 52.2]
    assert bag.traffic.sent == 6 * (8 if name == "out.bag" else 12)
    before = size(path)
    bag.publish([Delivery(TEXT, new("std_msgs/String", data="x" * 400_000), 3.0)])
    bag._file.flush()
    bag._file.flush()  # with nothing to write
    assert size(path) > before + (0 if name != "out" else 200_000)
    bag.close()
    bag.close()
    assert (bag.subscribed_topics, sorted(file.name for file in tmp_path.iterdir())) == (
        frozenset(), sorted([name, *(["out.layout.json"] if name == "out.mcap" else [])]),
    )  # fmt: skip
    for use in (bag.publish, lambda batch: bag.write("/number", "std_msgs/Float64", batch, 0.0)):
        with pytest.raises(RecordError) as caught:
            use([])
        assert str(caught.value) == f"the bag '{path}' is closed"
    bag.log("INFO", "nobody reads this")


@pytest.mark.parametrize("name", NAMES)
def test_messages_and_lines_come_back_with_their_moments_and_levels(tmp_path, name):
    bag = opened(tmp_path / name)
    bag.log("WARN", "at the start")
    bag.publish(
        [
            Delivery(NUMBER, new("std_msgs/Float64", data=0.5), 0.0),
            Delivery(TEXT, new("std_msgs/String", data="x"), 2.5),
        ]
    )
    for level in ("INFO", "ERROR", "odd"):
        bag.log(level, level)
    bag.close()
    with (Reader1 if name == "out.bag" else Reader2)(tmp_path / name) as reader:
        found = [(one.topic, time, bytes(raw)) for one, time, raw in reader.messages()]
    plain = [(topic, time) for topic, time, _ in found if topic != "/rosout"]
    assert plain == [("/number", 1), ("/text", 2_500_000_000)]
    lines = [(time, decode(raw, "rosgraph_msgs/Log")) for topic, time, raw in found if topic == "/rosout"]
    told = [(time, one.level, one.msg, one.name, one.header.stamp.sec) for time, one in lines]
    assert told == ([] if name != "out.bag" else [
        (1, 4, "at the start", "/vrx_mj", 0), (2_500_000_000, 2, "INFO", "/vrx_mj", 2),
        (2_500_000_000, 8, "ERROR", "/vrx_mj", 2), (2_500_000_000, 2, "odd", "/vrx_mj", 2),
    ])  # fmt: skip


def test_a_bag_of_ros_1_begins_a_chunk_after_a_megabyte(tmp_path):
    bag = opened(tmp_path / "out.bag")
    chunks = []
    for _ in range(6):
        bag.publish([Delivery(TEXT, new("std_msgs/String", data="x" * 400_000), 1.0)])
        chunks.append(len(bag._file._writer.chunks))
    assert chunks == [1, 1, 2, 2, 2, 3]
    bag.close()
    with Reader1(tmp_path / "out.bag") as reader:
        assert len(list(reader.messages())) == 6


def test_a_file_in_the_place_of_a_folder_is_kept(tmp_path):
    (tmp_path / "out").write_text("mine", encoding="utf-8")
    with pytest.raises(RecordError) as caught:
        Bag(tmp_path / "out").start()
    what = f"'{tmp_path / 'out'}' already exists and is not a folder: choose another name, or remove it"
    assert str(caught.value).endswith(what)
    assert (tmp_path / "out").read_text(encoding="utf-8") == "mine"


def test_only_commands_that_are_numbers_are_written(tmp_path):
    written = []
    bag = SimpleNamespace(write=lambda *what: written.append((what[0], what[2].data, what[3])))
    given = {"left": 0.5, "right": np.float64(0.25), "left_angle": "x", "other": 1.0}
    bags._write_commands(bag, "a", ("left", "right", "left_angle"), given, 1.5)
    bags._write_commands(bag, "a", ("left",), None, 1.5)
    assert written == [("/a/thrusters/left_thrust_cmd", 0.5, 1.5), ("/a/thrusters/right_thrust_cmd", 0.25, 1.5)]
