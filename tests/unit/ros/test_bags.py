import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import zlib
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader, AnyReaderError

import vrx_mj
from needs import ROSBAG, needs
from vrx_mj.errors import RecordError, UnknownNameError, VrxWarning
from vrx_mj.ros import cdr
from vrx_mj.ros.bags import FIRST, HEAVY_TYPES, KINDS, Bag, bag_run
from vrx_mj.ros.interface import Delivery, Output, RosInterface, Transport
from vrx_mj.ros.messages import new, stamp
from vrx_mj.ros.table.viewers import MARKERS, START

PYTHON = "/usr/bin/python3"
NAMES = ("out.bag", "out.mcap", "out_dir")
IMAGE = "/wamv/sensors/cameras/front/image_raw"
TYPES = {
    "/clock": "rosgraph_msgs/Clock",
    "/gazebo/model_states": "gazebo_msgs/ModelStates",
    "/vrx/task/info": "vrx_gazebo/Task",
    "/wamv/sensors/pingers/pinger/marker/signal": "visualization_msgs/Marker",
    "/wamv/sensors/imu/imu/data": "sensor_msgs/Imu",
    IMAGE: "sensor_msgs/Image",
}
OUTPUTS = {name: Output(name, kind, lambda: None, latched="marker" in name) for name, kind in TYPES.items()}


def message(name, time):
    head = new("std_msgs/Header", stamp=stamp(time), frame_id="wamv/imu_wamv_link", seq=7)
    made = {
        "/clock": {"clock": stamp(time)},
        "/gazebo/model_states": {
            "name": ["wamv"],
            "pose": [new("geometry_msgs/Pose", position={"x": time})],
            "twist": [new("geometry_msgs/Twist")],
        },
        "/vrx/task/info": {"name": "stationkeeping", "score": 1.5 * time, "ready_time": stamp(3.0)},
        "/wamv/sensors/pingers/pinger/marker/signal": {"header": head, "scale": {"x": 2.0}, "mesh_resource": "a"},
        "/wamv/sensors/imu/imu/data": {"header": head, "orientation": {"w": 1.0}},
        IMAGE: {"header": head, "height": 2, "width": 2, "data": np.arange(12, dtype=np.uint8)},
    }
    return new(TYPES[name], **made[name])


def batch(time):
    return [Delivery(output, message(name, time), time) for name, output in OUTPUTS.items()]


def written(path, times=(0.0, 0.5, 1.0), **options):
    bag: Transport = Bag(path, **options)
    bag.start()
    bag.offer(RosInterface(OUTPUTS))
    for time in times:
        bag.publish(batch(time))
    bag.close()
    return bag


def read(path):
    with AnyReader([path]) as reader:
        return [(c.topic, c.msgtype, time, reader.deserialize(raw, c.msgtype)) for c, time, raw in reader.messages()]


@pytest.mark.parametrize("name", NAMES)
def test_a_bag_reads_back_what_was_published_and_when(tmp_path, name):
    bag = written(tmp_path / name)
    rows = read(tmp_path / name)
    light = [topic for topic in TYPES if topic != IMAGE]
    assert sorted((topic, kind, time) for topic, kind, time, _ in rows) == sorted(
        (topic, TYPES[topic].replace("/", "/msg/"), time) for topic in light for time in (1, 500_000_000, 1_000_000_000)
    )
    last = {topic: message for topic, _, _, message in rows}
    assert last["/gazebo/model_states"].pose[0].position.x == 1.0
    assert last["/vrx/task/info"].score == 1.5
    assert last["/vrx/task/info"].ready_time.sec == 3
    imu = last["/wamv/sensors/imu/imu/data"]
    assert (imu.header.frame_id, imu.header.stamp.sec, imu.orientation.w) == ("wamv/imu_wamv_link", 1, 1.0)
    assert getattr(imu.header, "seq", None) == (7 if name == "out.bag" else None)
    marker = last["/wamv/sensors/pingers/pinger/marker/signal"]
    assert (marker.scale.x, marker.mesh_resource) == (2.0, "a")
    assert hasattr(marker, "mesh_file") == (name != "out.bag")  # a field that only ROS 2 has
    assert bag.traffic.sent > 0
    assert bag.traffic.dropped == 0


@pytest.mark.parametrize("name", NAMES)
def test_latched_topics_are_marked_so(tmp_path, name):
    written(tmp_path / name)
    with AnyReader([tmp_path / name]) as reader:
        latched = {
            one.topic
            for one in reader.connections
            if getattr(one.ext, "latching", None)
            or any(qos.durability.name == "TRANSIENT_LOCAL" for qos in getattr(one.ext, "offered_qos_profiles", ()))
        }
    assert latched == {"/wamv/sensors/pingers/pinger/marker/signal"}


def test_images_and_points_are_written_only_where_they_are_named(tmp_path):
    assert {kind for kind in TYPES.values() if kind in HEAVY_TYPES} == {"sensor_msgs/Image"}
    written(tmp_path / "out.bag", topics=["/wamv/sensors/cameras/*"])
    images = [message for topic, *_, message in read(tmp_path / "out.bag") if topic == IMAGE]
    assert [image.data.tolist() for image in images] == [list(range(12))] * 3


@pytest.mark.parametrize("name", NAMES)
def test_labels_have_the_type_of_the_bags_ros(tmp_path, name):
    """Which has other fields in ROS 2, where classes have names."""
    kind = "vision_msgs/Detection2DArray"
    box = {"center": {"x": 3.0, "y": 1.0}, "size_x": 2.0, "size_y": 2.0}
    result = new("vision_msgs/ObjectHypothesisWithPose", id=6, score=1.0)
    message = new(kind, detections=[new("vision_msgs/Detection2D", results=[result], bbox=box)])
    bag = Bag(tmp_path / name)
    bag.start()
    bag.write("/labels", kind, message, 1.0)
    bag.close()
    ((_, *_, back),) = read(tmp_path / name)
    (found,) = back.detections
    if name == "out.bag":
        assert (found.results[0].id, found.bbox.center.x) == (6, 3.0)
    else:
        assert (found.results[0].hypothesis.class_id, found.bbox.center.position.x) == ("mb_marker_buoy_red", 3.0)


def test_pictures_that_are_written_raw_and_compressed_are_warned_of(tmp_path):
    table = RosInterface({name: replace(OUTPUTS[IMAGE], name=name) for name in (IMAGE, f"{IMAGE}/compressed")})
    with pytest.warns(VrxWarning) as caught:
        Bag(tmp_path / "out.bag", topics=["/wamv/sensors/cameras/*"]).offer(table)
    text = f"the bag records both raw and compressed images of {IMAGE}: raw images make it large"
    assert [str(item.message) for item in caught] == [f"{text}; name {IMAGE}/compressed to record only the others"]


def test_a_topic_that_is_not_there_is_told(tmp_path):
    bag = Bag(tmp_path / "out.bag", topics=["/wamv/cameras/front"])
    with pytest.raises(UnknownNameError) as caught:
        bag.offer(RosInterface(OUTPUTS))
    assert str(caught.value) == f"no topic named '/wamv/cameras/front'; known: {IMAGE}"


def test_what_joins_later_is_written_and_what_leaves_is_not(tmp_path):
    bag = Bag(tmp_path / "out.bag")
    bag.start()
    clock = {"/clock": OUTPUTS["/clock"]}
    for time, table in ((0.1, clock), (0.2, OUTPUTS), (0.3, clock)):
        bag.offer(RosInterface(table))
        bag.publish(batch(time))
    bag.close()
    times = {topic: [time for name, _, time, _ in read(tmp_path / "out.bag") if name == topic] for topic in TYPES}
    assert times["/clock"] == [100_000_000, 200_000_000, 300_000_000]
    assert times["/wamv/sensors/imu/imu/data"] == [200_000_000]


def test_what_people_are_told_is_on_rosout(tmp_path):
    bag = Bag(tmp_path / "out.bag")
    bag.start()
    bag.offer(RosInterface(OUTPUTS))
    bag.publish(batch(2.0))
    bag.log("WARN", "wamv is aground")
    bag.close()
    told = [message for topic, *_, message in read(tmp_path / "out.bag") if topic == "/rosout"]
    assert [(one.level, one.name, one.msg, one.header.stamp.sec) for one in told] == [
        (4, "/vrx_mj", "wamv is aground", 2)
    ]


@pytest.mark.slow
@needs(ROSBAG)
def test_debians_rosbag_reads_a_bag_of_several_chunks(tmp_path):
    path = tmp_path / "out.bag"
    rng = np.random.default_rng(1)
    bag = Bag(path, topics=[IMAGE])
    bag.start()
    bag.offer(RosInterface(OUTPUTS))
    image = new("sensor_msgs/Image", height=700, width=1000, data=rng.integers(0, 9, 700_000, np.uint8))
    for k in range(5):
        bag.publish([*batch(k), Delivery(OUTPUTS[IMAGE], image, float(k))])
    bag.close()
    script = (
        "import json, rosbag, sys, zlib\nbag = rosbag.Bag(sys.argv[1])\n"
        "rows = [(topic, t.to_nsec(), zlib.crc32(m.data) if topic == sys.argv[2] else 0) for topic, m, t in bag]\n"
        "print(json.dumps([rows, bag.get_compression_info()[0], len(bag._chunks)]))"
    )
    rows, compression, chunks = json.loads(debian([PYTHON, "-c", script, str(path), IMAGE]))
    assert compression == "lz4"
    assert chunks >= 3
    assert len(rows) == 5 * (len(TYPES) + 1)
    assert [crc for *_, crc in rows].count(zlib.crc32(image.data.tobytes())) == 5
    info = debian(["/usr/bin/rosbag", "info", str(path)])
    assert "vrx_gazebo/Task" in info
    assert f"messages:     {len(rows)}\n" in info


def debian(command):
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ROS_"))}
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=60, check=False, env=inherited)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_mcaps_own_reader_reads_the_messages(tmp_path):
    from mcap import reader

    written(tmp_path / "out.mcap")
    with (tmp_path / "out.mcap").open("rb") as file:
        found = [(schema.name, channel.topic, message.log_time) for schema, channel, message in
                 reader.make_reader(file, validate_crcs=True).iter_messages()]  # fmt: skip
    assert len(found) == 15
    assert ("sensor_msgs/msg/Imu", "/wamv/sensors/imu/imu/data", 500_000_000) in found


def panels(layout):
    """Names of the panels in a layout of a window."""
    return (
        [layout] if isinstance(layout, str) else [name for side in ("first", "second") for name in panels(layout[side])]
    )


def test_an_mcap_opens_with_boats_and_world_and_has_a_layout_beside_it(bay, tmp_path):
    from mcap import reader

    with bag_run(vrx_mj.Simulation(bay), tmp_path / "out.mcap") as (advance, _):
        advance(20)
    with (tmp_path / "out.mcap").open("rb") as file:
        rows = [(schema.name, channel.topic, row) for schema, channel, row in reader.make_reader(file).iter_messages()]
    first = {
        topic: cdr.typestore().deserialize_cdr(row.data, kind)
        for kind, topic, row in rows
        if kind != "gazebo_msgs/msg/PerformanceMetrics" and row.log_time == FIRST
    }
    assert len(first[MARKERS].markers) > 10
    assert START in {one.child_frame_id for one in first["/tf_static"].transforms}
    boats = [f"/{boat}/robot_description" for boat in bay.boats]
    assert all("data:model/gltf-binary" in first[topic].data for topic in boats)
    layout = json.loads((tmp_path / "out.layout.json").read_text(encoding="utf-8"))
    assert layout.keys() == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}  # all are needed
    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])
    world, chart = layout["configById"]["3D!world"], layout["configById"]["map!fixes"]
    assert world["followTf"] == START
    assert world["topics"].keys() == {MARKERS}
    assert [one["topic"] for one in world["layers"].values() if "topic" in one] == boats
    assert chart["followTopic"] in {topic for _, topic, _ in rows}


BROKEN = {"out.bag": "not indexed", "out.mcap": "magic|footer|end", "out_dir": r"metadata file '.*' does not exist"}
KILLED = """
import os, sys
sys.path[:0] = sys.argv[2:]
import vrx_mj.ros.bags as bags
import test_bags
made = [bags.Bag(os.path.join(sys.argv[1], name)) for name in test_bags.NAMES]
for bag in made:
    bag.start()
    bag.offer(test_bags.RosInterface(test_bags.OUTPUTS))
for k in range(101):
    bags.FLUSH_PERIOD = 0.0 if k < 100 else 1e9  # what came last was not yet due
    for bag in made:
        bag.publish(test_bags.batch(0.1 * k))
os.kill(os.getpid(), 9)
"""


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A folder of bags whose process was killed after 100 moments, and one more that had not reached the disk."""
    folder, here = tmp_path_factory.mktemp("killed"), Path(__file__)
    paths = map(str, (folder, here.parent, here.parents[2]))
    done = subprocess.run([sys.executable, "-c", KILLED, *paths], check=False, timeout=60)
    assert done.returncode == -signal.SIGKILL
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_killed_process_leaves_a_bag_that_is_clearly_broken(killed, name):
    with pytest.raises((AnyReaderError, FileNotFoundError), match=BROKEN[name]):
        read(killed / name)


@pytest.mark.slow
@needs(ROSBAG)
def test_rosbag_mends_what_a_killed_process_leaves(killed, tmp_path):
    shutil.copy(killed / "out.bag", tmp_path)
    debian(["/usr/bin/rosbag", "reindex", "-q", str(tmp_path / "out.bag")])
    assert len(read(tmp_path / "out.bag")) == 100 * (len(TYPES) - 1)


@pytest.mark.parametrize("is_whole", [pytest.param(True, marks=pytest.mark.slow), False])
def test_the_first_record_of_a_bag_of_ros_1_is_as_long_as_rosbags_and_others_fill_the_bag(killed, tmp_path, is_whole):
    """4096 bytes of fields and padding, over which `rosbag reindex` writes."""
    if is_whole:
        written(tmp_path / "out.bag")
    content = ((tmp_path if is_whole else killed) / "out.bag").read_bytes()
    at, records = len("#ROSBAG V2.0\n"), []
    while at < len(content):
        lengths = []
        for _ in ("fields", "data"):
            lengths.append(int.from_bytes(content[at : at + 4], "little"))
            at += 4 + lengths[-1]
        records.append(sum(lengths))
    assert records[0] == 4096
    assert at == len(content)


def test_the_database_of_a_killed_process_is_whole(killed):
    with closing(sqlite3.connect(killed / "out_dir/out_dir.db3")) as database:
        assert database.execute("SELECT count(*) FROM messages").fetchone() == (100 * (len(TYPES) - 1),)


def test_the_chunks_of_a_killed_mcap_are_whole(killed):
    from mcap import exceptions
    from mcap import stream_reader as stream

    found = 0
    with (killed / "out.mcap").open("rb") as file, suppress(exceptions.EndOfFile):
        for record in stream.StreamReader(file).records:
            found += type(record).__name__ == "Message"
    assert found == 100 * (len(TYPES) - 1)


@pytest.mark.parametrize("name", NAMES)
def test_an_earlier_bag_is_replaced(tmp_path, name):
    written(tmp_path / name)
    written(tmp_path / name, times=[4.0])
    assert {time for _, _, time, _ in read(tmp_path / name)} == {4_000_000_000}
    beside = {"out.layout.json"} if name == "out.mcap" else set()
    assert {entry.name for entry in tmp_path.iterdir()} == {name} | beside


@pytest.mark.parametrize("name", ["out.bag", "out.mcap"])
def test_a_file_that_is_no_bag_is_kept(tmp_path, name):
    (tmp_path / name).write_text("a diary", encoding="utf-8")
    with pytest.raises(RecordError) as caught:
        Bag(tmp_path / name).start()
    path = tmp_path / name
    assert str(caught.value) == f"'{path}' already exists and is not a bag: choose another name, or remove it"
    assert path.read_text(encoding="utf-8") == "a diary"


def test_a_folder_with_other_files_is_kept(tmp_path):
    written(tmp_path / "out")
    (tmp_path / "out/diary.txt").touch()
    with pytest.raises(RecordError) as caught:
        Bag(tmp_path / "out").start()
    assert str(caught.value) == (
        f"'{tmp_path / 'out/diary.txt'}' already exists and is not part of a bag: choose another folder, or remove it"
    )
    assert len(read(tmp_path / "out")) == 15


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("out.txt", f"invalid bag name '{{}}'; allowed: {KINDS}"),
        ("nowhere/out.bag", "cannot write the bag '{}': No such file or directory"),
        ("nowhere/out.mcap", "cannot write the bag '{}': No such file or directory"),
        ("file/out", "cannot write the bag '{}': Not a directory"),
    ],
)  # fmt: skip
def test_a_bag_that_cannot_be_written_is_told_at_once(tmp_path, path, reason):
    (tmp_path / "file").touch()
    with pytest.raises(RecordError) as caught:
        Bag(tmp_path / path).start()
    assert str(caught.value) == reason.format(tmp_path / path)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk_is_told_and_ends_the_bag(tmp_path, monkeypatch):
    bag = Bag(tmp_path / "out.bag")
    bag.start()
    bag.offer(RosInterface(OUTPUTS))
    bag._file._writer.bio.close()
    bag._file._writer.bio = Path("/dev/full").open("wb")  # noqa: SIM115
    monkeypatch.setattr("vrx_mj.ros.bags.FLUSH_PERIOD", 0.0)
    with pytest.raises(RecordError) as caught:
        bag.publish(batch(0.0))
    assert str(caught.value) == f"cannot write the bag '{tmp_path / 'out.bag'}': No space left on device"
    bag.close()
    with pytest.raises(RecordError, match=r"^the bag '.*out\.bag' is closed$"):
        bag.publish(batch(0.0))
