"""Messages that are made of made-up readings, places and charts: what they held before, field by field."""

from types import SimpleNamespace

import numpy as np
import pytest

from fingerprints import check
from unit.ros.table.test_sensing import outputs
from vrx_mj.config.sensors import (
    AnemometerConfig,
    CameraConfig,
    EchoSounderConfig,
    GnssCompassConfig,
    GpsConfig,
    ImuConfig,
    LidarConfig,
    P3dConfig,
    PingerConfig,
)
from vrx_mj.ros import foxglove
from vrx_mj.ros.interface import Input
from vrx_mj.ros.messages import new
from vrx_mj.ros.table.sensing import TOPICS, middle_ring, sensor_topics
from vrx_mj.ros.table.viewers import layout_text
from vrx_mj.sensors.readings import (
    ApparentWind,
    Echo,
    Fix,
    Heading,
    Image,
    Inertia,
    Label,
    Labels,
    PointCloud,
    Reading,
    Scan,
    Sound,
    Truth,
)
from vrx_mj.sensors.view import intrinsics

TURN = np.array([0.9, 0.1, -0.2, 0.37])
SPREAD = tuple(0.1 * number for number in range(9))
EYE = CameraConfig(name="eye", link="mast", labels=True, width=8, height=6, rate=7.0)
SEEN = Labels((Label("buoy", "round", 4, 2, (1, 2, 3, 4), 9),), np.arange(48, dtype=np.uint16).reshape(6, 8))
RGB = np.arange(144, dtype=np.uint8).reshape(6, 8, 3)
CLOUD = PointCloud(
    np.array([[3.0, -2.0, 0.5], [4.0, 0.1, 0.0], [5.0, 2.0, -0.5]], np.float32),
    np.array([0.1, 0.2, 0.3], np.float32),
    np.array([1, 1, 2], np.uint16),
)
RAYS = {"rings": 3, "samples": 11, "azimuth": (-0.9, 0.9), "elevation": (-0.1, 0.1), "range": (0.5, 60.0)}
READINGS = {
    "camera": (EYE, Image(RGB, intrinsics(EYE), SEEN)),
    "camera without labels": (EYE, Image(RGB, intrinsics(EYE))),
    "points": (LidarConfig(name="lidar", link="mast", output="points", rate=9.0, **RAYS), CLOUD),
    "scan": (LidarConfig(name="lidar", link="mast", output="scan", **RAYS | {"rings": 1}),
             Scan(np.arange(11, dtype=np.float32), -0.9, 0.9, 0.18, 0.5, 60.0)),
    "gps": (GpsConfig(name="gps", link="mast"), Fix(21.5, -157.5, 3.5, np.array([0.1, 0.2, 0.3]), SPREAD)),
    "imu": (ImuConfig(name="imu", link="mast"),
            Inertia(TURN, np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0]), SPREAD, SPREAD, SPREAD)),
    "compass": (GnssCompassConfig(name="gnss", link="mast"), Heading(2.0, 0.3, 4e-4, 9e-4)),
    "wind": (AnemometerConfig(name="wind", link="mast"), ApparentWind(5.0, 0.7)),
    "sonar": (EchoSounderConfig(name="sonar", link="keel"), Echo(7.25, 0.5, 80.0, 0.25)),
    "truth": (P3dConfig(name="p3d", link="base_link", noise=0.1),
              Truth(np.array([1.0, 2.0, 3.0]), TURN, np.array([0.1, 0.2, 0.3]), np.array([0.4, 0.5, 0.6]))),
    "pinger": (PingerConfig(name="pinger", link="keel"), Sound(12.0, 0.7, -0.3)),
}  # fmt: skip
"""A sensor and a reading of it, by what is checked."""


@pytest.mark.parametrize("name", READINGS)
def test_readings_are_the_messages_that_they_were(name):
    config, data = READINGS[name]
    reading, found = Reading(config.name, config.type, 1.5, 3, f"a/{config.link}", data), {}
    for output in outputs(config):
        entry = [output.type, output.rate, output.latched, output.recorded, output.blind is None]
        drawn = output.type == "sensor_msgs/CompressedImage"  # its bytes are those of a version of a library
        made = None if drawn or output.sensor is None else output.make(reading)
        found[f"{' '.join(output.dialects)} {output.name}"] = [*entry, made]
    check("messages", name, **found)


def test_beacons_and_shooters_take_what_they_took():
    calls = []
    sim = SimpleNamespace(
        mounted=lambda boat: [SimpleNamespace(config=config, name=config.name, boat=boat) for config in sensors],
        set_pinger=lambda *what: calls.append(what), fire=lambda *what: calls.append(what) or True,
    )  # fmt: skip
    sensors = [PingerConfig(name="one", link="keel"), PingerConfig(name="two", link="keel", topic="other/place")]
    entries = [entry for entry in sensor_topics(SimpleNamespace(sim=sim), "a") if isinstance(entry, Input)]
    names = [(entry.name, entry.type, *entry.dialects) for entry in entries]
    for entry in entries:
        entry.take(new("geometry_msgs/Vector3", x=1.0, y=2.0, z=3.0))
    assert calls == [("a", name, (1.0, 2.0, 3.0)) for name in ("one", "one", "two", "two")]
    check("messages", "beacons", names=names, kinds=[[kind, topics.vrx3_stem] for kind, topics in TOPICS.items()])


@pytest.mark.parametrize("first", [-0.9, 0.9])
@pytest.mark.parametrize("samples", [1, 2, 11])
def test_the_middle_ring_has_the_nearest_rays_of_its_points(samples, first):
    """Counter-clockwise or clockwise."""
    config = LidarConfig(name="lidar", link="mast", **RAYS | {"samples": samples, "azimuth": (first, -first)})
    points = CLOUD.points[: min(samples, 2)]  # a ring has no more points than rays
    scan = middle_ring(PointCloud(points, CLOUD.intensity[: len(points)], CLOUD.ring[: len(points)]), config)
    step = -2.0 * first / (samples - 1) if samples > 1 else 0.0
    expected = np.full(samples, np.inf)
    for x, y, z in points.astype(float):
        nearest = round((np.arctan2(y, x) - first) / step) if step else 0
        expected[nearest] = np.linalg.norm([x, y, z])
    assert np.allclose(scan.ranges, expected)
    assert (scan.angle_increment, scan.range_min, scan.range_max) == (pytest.approx(step), 0.5, 60.0)


PLACE = {"position": {"x": 1.0, "y": 2.0, "z": 3.0}, "orientation": {"x": 0.1, "y": 0.2, "z": 0.3, "w": 0.9}}
HEAD = {"stamp": {"sec": 7, "nanosec": 250_000_000}, "frame_id": "here"}


def test_foxgloves_messages_are_what_they_were():
    color, size = {"r": 0.1, "g": 0.2, "b": 0.3, "a": 0.4}, {"x": 1.5, "y": 2.5, "z": 3.5}
    markers = [
        new("visualization_msgs/Marker", ns=space, type=kind, pose=PLACE, color=color, scale=size, points=points)
        for space, kind, points in (
            ("docks", 1, []), ("docks", 2, []), ("objects", 3, []), ("", 1, []),
            ("shore", 11, [new("geometry_msgs/Point", x=float(k), y=2.0, z=3.0) for k in range(3)]),
        )
    ]  # fmt: skip
    frame = new("geometry_msgs/TransformStamped", header=HEAD, child_frame_id="there", transform={
        "translation": {"x": 1.0, "y": 2.0, "z": 3.0}, "rotation": PLACE["orientation"]})  # fmt: skip
    picture = {"header": HEAD, "data": np.arange(9, dtype=np.uint8)}
    pose = new("geometry_msgs/Pose", **PLACE)
    made = {
        "scene": new("visualization_msgs/MarkerArray", markers=markers),
        "frames": new("tf2_msgs/TFMessage", transforms=[frame]),
        "states": new("gazebo_msgs/ModelStates", name=["a"], pose=[pose]),
        "fix": new("sensor_msgs/NavSatFix", header=HEAD, latitude=1.5, longitude=2.5, altitude=3.5),
        "jpeg": new("sensor_msgs/CompressedImage", format="rgb8; jpeg compressed bgr8", **picture),
        "png": new("sensor_msgs/CompressedImage", format="16UC1; png compressed", **picture),
    }
    found = {}
    for name, message in made.items():
        kind = message.__msgtype__.replace("/msg/", "/")
        found[name] = foxglove._CONVERSIONS[kind][1](message, 7.25).encode()
    check("messages", "foxglove", **found)


def test_the_layout_of_panels_is_what_it_was():
    types = {"/a/robot_description": "std_msgs/String", "/b/robot_description": "std_msgs/String"}
    seen = {"/fix": "sensor_msgs/NavSatFix", "/eye": "sensor_msgs/CompressedImage", "/other": "std_msgs/String"}
    check("messages", "layout", boats=[*layout_text(types).split()], all=[*layout_text(types | seen).split()])


def test_a_foxglove_client_gets_what_is_latched_when_it_subscribes_and_frames_again_each_second():
    logged, server = [], foxglove.Foxglove(port=0)
    server._server = SimpleNamespace(broadcast_time=logged.append)
    server._log = lambda sent, client=None: logged.append((sent, client))
    server._channels = dict.fromkeys(["/tf_static", "/a"])
    client, frames = SimpleNamespace(id=5), SimpleNamespace(topic="/tf_static")
    latched = SimpleNamespace(output=SimpleNamespace(name="/tf_static", latched=True), time=1.0)
    plain = [SimpleNamespace(output=SimpleNamespace(name="/a", latched=False), time=t) for t in (1.5, 1.75, 2.5)]
    server.publish([latched])
    assert logged == []
    server.on_subscribe(client, frames)
    assert logged == [(latched, 5)]
    assert server.traffic == (1, 0, 0)
    logged.clear()
    for sent in plain:
        server.publish([sent])
    repeated = latched, None
    assert logged == [1_500_000_000, repeated, 1_750_000_000, 2_500_000_000, repeated]
    server.on_unsubscribe(client, frames)
    assert server.subscribed_topics == frozenset()
