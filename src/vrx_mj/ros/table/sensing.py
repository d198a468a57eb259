"""Sensors in ROS: VRX's topics, types, rates and frames, and messages made of readings."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.config.sensors import LidarConfig
from vrx_mj.frames import quaternion, rotation_matrix
from vrx_mj.ros.interface import VRX, VRX3, Entry, Input, Output, Service, with_vrx3
from vrx_mj.ros.messages import Message, fields, new, stamp
from vrx_mj.ros.table.host import Host, header, odometry
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.sensors.instruments import covariance
from vrx_mj.sensors.readings import (
    ApparentWind,
    Echo,
    Heading,
    Labels,
    PointCloud,
    Reading,
    Scan,
    Sound,
    Truth,
)
from vrx_mj.sensors.view import intrinsics

_JPEG_QUALITY = 80
"""JPEG quality, image_transport's default."""
_DATATYPES = {"float32": 7, "uint16": 4}
"""Data types of sensor_msgs/PointField."""
_KNOWN_DIAGONAL = 2
"""COVARIANCE_TYPE_DIAGONAL_KNOWN of sensor_msgs/NavSatFix."""
_SCAN, _VECTOR = "sensor_msgs/LaserScan", "geometry_msgs/Vector3Stamped"
"""Types of scans and of vectors."""
_UNKNOWN_VARIANCE, _NOT_MEASURED = 1000.0, -1.0
"""Variance [rad2, rad2/s2] of an angle that is not measured, as u-blox's driver has it; element 0 of a covariance of
sensor_msgs/Imu that says that there is no such measurement."""
_MARKER_PERIOD = 10.0
"""Time between two markers of a beacon's true position [s]."""

_POINT = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring", "time"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<f4"],
        "offsets": [0, 4, 8, 12, 16, 18],
        "itemsize": 22,
    }
)
"""Layout of a point: that of velodyne's driver and of its plugin for Gazebo since 1.0.10, where `time` is 0."""
_VRX3_POINT = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2"],
        "offsets": [0, 4, 8, 16, 24],
        "itemsize": 32,
    }
)
"""Layout of a point of gz sim, whose fields begin at multiples of 8."""


@dataclass(frozen=True)
class SensorTopic:
    """A topic with messages made of readings."""

    tail: str
    """Part of the topic's name after the stem of the sensor's topics."""
    type: str
    """Type of the messages."""
    make: Callable[[Reading], Message | None] | None = None
    """Makes a reading's message; None: its fields are those of the reading's data."""
    vrx3: tuple[str, ...] | None = None
    """Parts after VRX 3's stem in the names of its topics that carry the same; None: the tail."""
    applies: Callable[[Any], bool] = lambda _config: True
    """Whether a sensor with a configuration has this topic."""


class Stems(NamedTuple):
    """How the names of a sensor's topics begin."""

    vrx: str
    vrx3: str


@dataclass(frozen=True)
class SensorTopics:
    """The topics of a type of sensor, VRX's and VRX 3's."""

    vrx3_stem: str
    """Stem of its topics in VRX 3; `{}` is the sensor's name. Without it a second sensor's stem ends in its name."""
    made: tuple[SensorTopic, ...] = ()
    """Topics made of readings."""
    more: Callable[[Host, Mounted, Stems], Iterator[Entry]] = lambda _host, _sensor, _stems: iter(())
    """Further topics; those that are subscribed to and have one name are one topic, which all of them take."""

    def of(self, config: Any) -> tuple[SensorTopic, ...]:
        """Topics made of the readings of a sensor with a configuration."""
        return tuple(topic for topic in self.made if topic.applies(config))


def sensor_topics(host: Host, boat: str) -> Iterator[Entry]:
    """The topics of a boat's sensors; a GPS has none in a world without a georeference, as in Gazebo."""
    for sensor, stems in _stems(host, boat):
        config, topics = sensor.config, TOPICS[sensor.config.type]
        if config.type == "gps" and host.sim.world.parameters.georeference is None:
            continue
        for topic in topics.of(config):
            make = topic.make or partial(_message_of, topic.type)
            output = Output(stems.vrx + topic.tail, topic.type, make, config.rate, (boat, sensor.name))
            tails = (topic.tail,) if topic.vrx3 is None else topic.vrx3
            yield from with_vrx3(output, *(stems.vrx3 + tail for tail in tails))
        yield from topics.more(host, sensor, stems)


def sensor_services(host: Host) -> Iterator[Service]:
    """`/ball_shooter` of VRX's twist2thrust.py: whatever is asked, the first of all shooters fires."""
    shooters = (one for boat in host.sim.boats for one in host.sim.mounted(boat) if one.config.type == "ball_shooter")
    first = next(shooters, None)
    if first is None:
        return

    fire = partial(host.sim.fire, first.boat, first.name)
    yield Service("/ball_shooter", "vrx_gazebo/BallShooter", lambda _: {"success": fire()})


def _stems(host: Host, boat: str) -> Iterator[tuple[Mounted, Stems]]:
    """A boat's sensors, each with its own stems of topics.

    VRX gives all GPS of a boat the same: a second one has its name in it here.
    """
    taken = set[str](), set[str]()
    for sensor in host.sim.mounted(boat):
        config = sensor.config
        tails = config.topic.strip("/") or f"sensors/{sensor.name}", TOPICS[config.type].vrx3_stem.format(sensor.name)
        yield sensor, Stems(*(_own(f"/{boat}/{tail}", sensor, used) for tail, used in zip(tails, taken, strict=True)))


def _own(stem: str, sensor: Mounted, taken: set[str]) -> str:
    """The stem, which ends in the sensor's name if another sensor has it; it is taken then."""
    own = f"{stem.rpartition('/')[0]}/{sensor.name}" if stem in taken else stem
    taken.add(own)
    return own


def _head(reading: Reading) -> Message:
    return header(reading.time, reading.frame)


def _message_of(type_name: str, reading: Reading, **others: object) -> Message:
    """A message with a header, the fields that are called as in the reading's data, and others."""
    same = {name: getattr(reading.data, name) for name in fields(type_name) if hasattr(reading.data, name)}
    return new(type_name, header=_head(reading), **same, **others)


def _vector(reading: Reading, values: Sequence[float] | FloatArray) -> Message:
    return new(_VECTOR, header=_head(reading), vector=values)


def _image(reading: Reading) -> Message:
    return _pixels(reading, reading.data.rgb, "rgb8")


def _mask(reading: Reading) -> Message | None:
    """The number of the label that each pixel belongs to; 0: none. Recorded pictures have no labels."""
    labels: Labels | None = reading.data.labels
    return labels and _pixels(reading, labels.mask.astype("<u2"), "mono16")


def _pixels(reading: Reading, rows: npt.NDArray[np.generic], encoding: str) -> Message:
    height, width = rows.shape[:2]
    return new(
        "sensor_msgs/Image",
        header=_head(reading),
        height=height,
        width=width,
        encoding=encoding,
        step=rows[0].nbytes,
        data=rows.reshape(-1).view(np.uint8),
    )


def _detections(reading: Reading) -> Message | None:
    """Things that a camera sees; the number in a detection's header is that of its pixels in the mask."""
    labels, found = reading.data.labels, []
    for one in labels.objects if labels else ():
        x, y, width, height = one.box
        head = new("std_msgs/Header", seq=one.number, stamp=stamp(reading.time), frame_id=reading.frame)
        result = new("vision_msgs/ObjectHypothesisWithPose", id=one.category_id, score=1.0)
        box = {"center": {"x": x + 0.5 * width, "y": y + 0.5 * height}, "size_x": float(width), "size_y": float(height)}
        found.append(new("vision_msgs/Detection2D", header=head, results=[result], bbox=box))
    return labels and new("vision_msgs/Detection2DArray", header=_head(reading), detections=found)


def _compressed_image(reading: Reading) -> Message:
    data = np.frombuffer(reading.data.jpeg(_JPEG_QUALITY), np.uint8)
    return new("sensor_msgs/CompressedImage", header=_head(reading), format="rgb8; jpeg compressed bgr8", data=data)


def _frames_and_infos(host: Host, sensor: Mounted, stems: Stems) -> Iterator[Output]:
    """A camera's pictures in the frame of its link, as VRX 3 has them too, and its intrinsics in both frames."""
    link, rate, key = f"{sensor.boat}/{sensor.config.link}", sensor.config.rate, (sensor.boat, sensor.name)
    info = asdict(intrinsics(sensor.config))

    def in_link(reading: Reading) -> Message:
        return _image(replace(reading, frame=link))

    yield Output(f"{stems.vrx3}/image_raw", "sensor_msgs/Image", in_link, rate, key, dialects=VRX3)
    for name, frame, dialects in (
        (f"{stems.vrx}/camera_info", sensor.frame, VRX),
        (f"{stems.vrx3}/camera_info", link, VRX3),
        (f"{stems.vrx3}/optical/camera_info", sensor.frame, VRX3),
    ):

        def camera_info(reading: Reading | None = None, frame: str = frame) -> Message:
            time = host.sim.time if reading is None else reading.time
            return new("sensor_msgs/CameraInfo", header=header(time, frame), **info)

        yield Output(name, "sensor_msgs/CameraInfo", camera_info, rate, key, camera_info, dialects=dialects)


def _points(reading: Reading) -> Message:
    return _cloud_message(reading, _rows(_POINT, reading.data)[np.newaxis])


def _rows(layout: np.dtype[np.void], cloud: PointCloud) -> npt.NDArray[np.void]:
    rows = np.zeros(len(cloud.points), layout)
    for axis, name in enumerate("xyz"):
        rows[name] = cloud.points[:, axis]
    rows["intensity"], rows["ring"] = cloud.intensity, cloud.ring
    return rows


def _cloud_message(reading: Reading, rows: npt.NDArray[np.void]) -> Message:
    """Points in rows (height, width), of a layout."""
    columns = [
        new("sensor_msgs/PointField", name=name, offset=column[1], datatype=_DATATYPES[column[0].name], count=1)
        for name, column in (rows.dtype.fields or {}).items()
    ]
    return new(
        "sensor_msgs/PointCloud2",
        header=_head(reading),
        height=rows.shape[0],
        width=rows.shape[1],
        fields=columns,
        point_step=rows.itemsize,
        row_step=rows.itemsize * rows.shape[1],
        data=rows.reshape(-1).view(np.uint8),
        is_dense=bool(np.isfinite(rows["x"]).all()),
    )


def _vrx3_lidar(_host: Host, sensor: Mounted, stems: Stems) -> Iterator[Output]:
    """Outputs of gz sim for a lidar that measures points: a row for each ring, and a planar scan of one of them."""
    config, key = sensor.config, (sensor.boat, sensor.name)

    def points(reading: Reading) -> Message:
        return _cloud_message(reading, _organize(reading.data, config))

    def scan(reading: Reading) -> Message:
        return _scan(replace(reading, data=middle_ring(reading.data, config)))

    if config.output == "points":
        yield Output(f"{stems.vrx3}/points", "sensor_msgs/PointCloud2", points, config.rate, key, dialects=VRX3)
        yield Output(f"{stems.vrx3}/scan", _SCAN, scan, config.rate, key, dialects=VRX3)


def _organize(cloud: PointCloud, config: LidarConfig) -> npt.NDArray[np.void]:
    """Points (rings, samples) of every ray; infinite without a return."""
    rows = np.zeros((config.rings, config.samples), _VRX3_POINT)
    for name in "xyz":
        rows[name] = np.inf
    rows["ring"] = np.arange(config.rings)[:, np.newaxis]
    rows[cloud.ring, _samples(cloud, config)] = _rows(_VRX3_POINT, cloud)
    return rows


def middle_ring(cloud: PointCloud, config: LidarConfig) -> Scan:
    """The ring halfway up as a planar scan, which Gazebo's bridge makes of a lidar of several rings."""
    first, last = config.azimuth
    there = cloud.ring == config.rings // 2
    ranges = np.full(config.samples, np.inf, np.float32)
    ranges[_samples(cloud, config)[there]] = np.linalg.norm(cloud.points[there].astype(np.float64), axis=1)
    return Scan(ranges, first, last, _step(config), *config.range)


def _step(config: LidarConfig) -> float:
    """Angle between two rays of a ring [rad]."""
    first, last = config.azimuth
    return (last - first) / (config.samples - 1) if config.samples > 1 else 0.0


def _samples(cloud: PointCloud, config: LidarConfig) -> npt.NDArray[np.int64]:
    """Numbers of the points' rays in their rings; of a full turn the last ray is another than the first."""
    step, points, turn = _step(config), cloud.points.astype(np.float64), 2.0 * math.pi
    width = abs(step) or turn
    angles = math.copysign(1.0, step) * (np.arctan2(points[:, 1], points[:, 0]) - config.azimuth[0])
    angles -= turn * np.floor((angles + 0.5 * width) / (turn + width))
    return np.minimum(((angles + 0.5 * width) / width).astype(np.int64), config.samples - 1)


def _scan(reading: Reading) -> Message:
    return _message_of(_SCAN, reading, intensities=np.zeros(len(reading.data.ranges), np.float32))


def _fix(reading: Reading) -> Message:
    return _message_of("sensor_msgs/NavSatFix", reading, position_covariance_type=_KNOWN_DIAGONAL)


def _apparent_wind(reading: Reading) -> Message:
    """Velocity of the air past the sensor, in its frame."""
    wind: ApparentWind = reading.data
    flow = (-wind.speed * math.cos(wind.angle), -wind.speed * math.sin(wind.angle), 0.0)
    return _vector(reading, flow)


def _compass(reading: Reading) -> Message:
    """sensor_msgs/Imu as drivers of dual-antenna receivers publish it: yaw only, no accelerations."""
    data: Heading = reading.data
    unknown = _UNKNOWN_VARIANCE
    return new(
        "sensor_msgs/Imu",
        header=_head(reading),
        orientation=quaternion(0.0, 0.0, data.heading),
        orientation_covariance=covariance(unknown, unknown, data.heading_variance),
        angular_velocity=(0.0, 0.0, data.rate_of_turn),
        angular_velocity_covariance=covariance(unknown, unknown, data.rate_of_turn_variance),
        linear_acceleration_covariance=(_NOT_MEASURED, *[0.0] * 8),
    )


def _range(reading: Reading) -> Message:
    """sensor_msgs/Range, whose `radiation_type` 0 is ultrasound."""
    echo: Echo = reading.data
    return _message_of("sensor_msgs/Range", reading, min_range=echo.range_min, max_range=echo.range_max)


def _odometries(_host: Host, sensor: Mounted, stems: Stems) -> Iterator[Output]:
    """Ground truth; its twist is in the axes of the world as VRX's P3D has it, or in the boat's as gz sim has it."""
    config = sensor.config
    for stem, own_axes, dialects in ((stems.vrx, False, VRX), (stems.vrx3, True, VRX3)):
        make = partial(_odometry, f"{sensor.boat}/{config.link}", config.noise**2, own_axes)
        yield Output(stem, "nav_msgs/Odometry", make, config.rate, (sensor.boat, sensor.name), dialects=dialects)


def _odometry(child: str, variance: float, own_axes: bool, reading: Reading) -> Message:
    """The pose and twist of the frame `child` in `map`, with noise of a `variance` on the twist [m2/s2, rad2/s2]."""
    truth: Truth = reading.data
    turn = rotation_matrix(truth.orientation).T if own_axes else np.eye(3)
    twist = turn @ truth.velocity, turn @ truth.angular_velocity
    return odometry(reading.time, child, truth.position, truth.orientation, *twist, variance)


def _signal(reading: Reading) -> Message:
    """VRX's blue arrow from the boat toward where the beacon sounds from."""
    sound: Sound = reading.data
    turn = quaternion(0.0, -sound.elevation, sound.bearing)
    return new(
        "visualization_msgs/Marker",
        header=_head(reading),
        ns="pinger",
        pose={"orientation": turn},
        scale={"x": max(sound.range, 0.1), "y": 0.5, "z": 0.5},
        color={"b": 1.0, "a": 1.0},
    )


def _pinger_topics(host: Host, sensor: Mounted, stems: Stems) -> Iterator[Entry]:
    """VRX's arrow, its red ball where the beacon really is, and what places it: VRX 3 has one topic for all boats."""

    def ball() -> Message:
        return new(
            "visualization_msgs/Marker",
            header=header(host.sim.time, "/map"),
            ns="pinger",
            type=2,
            pose={"position": host.sim.pinger(sensor.boat, sensor.name), "orientation": {"w": 1.0}},
            scale={"x": 1.0, "y": 1.0, "z": 1.0},
            color={"r": 1.0, "a": 1.0},
        )

    def place(message: Message) -> None:
        host.sim.set_pinger(sensor.boat, sensor.name, (message.x, message.y, message.z))

    marker, key = "visualization_msgs/Marker", (sensor.boat, sensor.name)
    yield Output(f"{stems.vrx}/marker/signal", marker, _signal, sensor.config.rate, key)
    yield Output(f"{stems.vrx}/marker/ground_truth", marker, ball, 1.0 / _MARKER_PERIOD, latched=True)
    yield Input(f"{stems.vrx}/set_pinger_position", "geometry_msgs/Vector3", place, sensor.boat)
    yield Input("/pinger/set_pinger_position", "geometry_msgs/Vector3", place, dialects=VRX3)


def _shooter_inputs(host: Host, sensor: Mounted, stems: Stems) -> Iterator[Input]:
    """VRX's fires at any message, VRX 3's at one that is true."""

    def shoot(_message: Message) -> None:
        host.sim.fire(sensor.boat, sensor.name)

    def shoot_if_true(message: Message) -> None:
        if message.data:
            shoot(message)

    yield Input(f"{stems.vrx}/fire", "std_msgs/Empty", shoot, sensor.boat)
    yield Input(f"{stems.vrx3}/fire", "std_msgs/Bool", shoot_if_true, sensor.boat, VRX3)


TOPICS: Mapping[str, SensorTopics] = {
    "camera": SensorTopics(
        "sensors/cameras/{}_sensor",
        (
            SensorTopic("/image_raw", "sensor_msgs/Image", _image, ("/optical/image_raw",)),
            SensorTopic("/image_raw/compressed", "sensor_msgs/CompressedImage", _compressed_image, ()),
            SensorTopic("/labels", "vision_msgs/Detection2DArray", _detections, applies=lambda c: c.labels),
            SensorTopic("/labels/mask", "sensor_msgs/Image", _mask, applies=lambda c: c.labels),
        ),
        _frames_and_infos,
    ),
    "lidar": SensorTopics(
        "sensors/lidars/{}_sensor",
        (
            SensorTopic("/points", "sensor_msgs/PointCloud2", _points, (), applies=lambda c: c.output == "points"),
            SensorTopic("/scan", _SCAN, _scan, applies=lambda c: c.output == "scan"),
        ),
        _vrx3_lidar,
    ),
    "gps": SensorTopics(
        "sensors/gps/gps",
        (
            SensorTopic("/fix", "sensor_msgs/NavSatFix", _fix),
            SensorTopic("/fix_velocity", _VECTOR, lambda reading: _vector(reading, reading.data.velocity), ()),
        ),
    ),
    "imu": SensorTopics("sensors/imu/imu", (SensorTopic("/data", "sensor_msgs/Imu"),)),
    "p3d": SensorTopics("sensors/position/ground_truth_odometry", more=_odometries),
    "pinger": SensorTopics(
        "sensors/acoustics/receiver",
        (SensorTopic("/range_bearing", "usv_msgs/RangeBearing"),),
        _pinger_topics,
    ),
    "ball_shooter": SensorTopics("shooters/ball_shooter", more=_shooter_inputs),
    "anemometer": SensorTopics(
        "sensors/{}",
        (SensorTopic("/apparent_wind", _VECTOR, _apparent_wind),),
    ),
    "gnss_compass": SensorTopics("sensors/{}", (SensorTopic("/heading", "sensor_msgs/Imu", _compass),)),
    "echo_sounder": SensorTopics("sensors/{}", (SensorTopic("/range", "sensor_msgs/Range", _range),)),
}
"""Topics of sensors by their type."""
