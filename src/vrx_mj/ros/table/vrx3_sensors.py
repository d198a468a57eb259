"""What sensors tell and are told, by VRX 3's names and types."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from vrx_mj.config.sensors import LidarConfig
from vrx_mj.ros.messages import Message
from vrx_mj.ros.offer import Input, Output, Table
from vrx_mj.ros.table.bodies import header
from vrx_mj.ros.table.host import Host
from vrx_mj.ros.table.parameters import parameters
from vrx_mj.ros.table.sensing import scan_message
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.sensors.readings import PointCloud, Reading, Scan

__all__ = ["middle_ring", "vrx3_sensor_inputs", "vrx3_sensor_outputs"]

STEMS = {
    "camera": "sensors/cameras/{}_sensor",
    "lidar": "sensors/lidars/{}_sensor",
    "gps": "sensors/gps/gps",
    "imu": "sensors/imu/imu",
    "p3d": "sensors/position/ground_truth_odometry",
    "pinger": "sensors/acoustics/receiver",
    "ball_shooter": "shooters/ball_shooter",
}
"""Of topics, by type of sensor; where it has no name in it, a second sensor's has its own at the end."""
TAILS: Mapping[str, tuple[tuple[str, bool], ...]] = {
    "sensor_msgs/Image": (("/image_raw", True), ("/optical/image_raw", False)),
    "sensor_msgs/CameraInfo": (("/camera_info", True), ("/optical/camera_info", False)),
    "sensor_msgs/PointCloud2": (("/points", False),),
    "sensor_msgs/LaserScan": (("/scan", False),),
    "sensor_msgs/NavSatFix": (("/fix", False),),
    "sensor_msgs/Imu": (("/data", False),),
    "nav_msgs/Odometry": (("", False),),
}
"""What follows the stem, by what VRX's topic carries, and whether the frame is the sensor's link instead."""
BEACON = "/pinger/set_pinger_position"


def vrx3_sensor_outputs(host: Host, table: Table, boat: str) -> Iterator[Output]:
    """The topics of a boat's sensors, made from those of VRX's table."""
    for sensor, stem in _stems(host, boat):
        key = (boat, sensor.name)
        for output in [output for output in table.outputs.values() if output.sensor == key]:
            for tail, in_link in TAILS.get(output.type, ()):
                yield _in_link(output, sensor, stem + tail) if in_link else replace(output, name=stem + tail)
            if output.type == "sensor_msgs/PointCloud2":
                yield _scan(output, sensor, f"{stem}/scan")
            elif output.type == "usv_msgs/RangeBearing":
                yield replace(output, name=f"{stem}/range_bearing", type="ros_gz_interfaces/ParamVec", make=_heard)


def vrx3_sensor_inputs(host: Host, table: Table, boat: str) -> Iterator[Input]:
    """What fires a boat's shooters, and `/pinger/set_pinger_position`, which places the beacons of all boats."""
    fires = [entry for name, entry in table.inputs.items() if entry.boat == boat and name.endswith("/fire")]
    stems = [stem for sensor, stem in _stems(host, boat) if sensor.config.type == "ball_shooter"]
    for stem, fire in zip(stems, fires, strict=True):

        def shoot(message: Message, fire: Input = fire) -> None:
            if message.data:
                fire.take(message)

        yield replace(fire, name=f"{stem}/fire", type="std_msgs/Bool", take=shoot)
    places = [entry for name, entry in table.inputs.items() if name.endswith("/set_pinger_position")]
    if places:

        def place(message: Message) -> None:
            for entry in places:
                entry.take(message)

        yield Input(BEACON, "geometry_msgs/Vector3", place)


def middle_ring(cloud: PointCloud, config: LidarConfig) -> Scan:
    """The ring halfway up as a planar scan, which Gazebo's bridge makes of a lidar of several rings."""
    first, last = config.azimuth
    step = (last - first) / (config.samples - 1) if config.samples > 1 else 0.0
    points = cloud.points[cloud.ring == config.rings // 2].astype(np.float64)
    turned = np.mod(np.arctan2(points[:, 1], points[:, 0]) - first + 0.5 * step, 2.0 * np.pi)
    index = np.minimum((turned / step).astype(np.int64) if step > 0.0 else 0, config.samples - 1)
    ranges = np.full(config.samples, np.inf, np.float32)
    ranges[index] = np.linalg.norm(points, axis=1)
    return Scan(ranges, first, last, step, *config.range)


def _stems(host: Host, boat: str) -> Iterator[tuple[Mounted, str]]:
    taken: set[str] = set()
    for sensor in host.sim.mounted(boat):
        stem = f"/{boat}/{STEMS[sensor.config.type].format(sensor.name)}"
        if stem in taken:
            stem = f"{stem.rpartition('/')[0]}/{sensor.name}"
        taken.add(stem)
        yield sensor, stem


def _in_link(output: Output, sensor: Mounted, name: str) -> Output:
    """The same with the frame of the camera's link; that of VRX's topic is the optical one."""
    frame = f"{sensor.boat}/{sensor.config.link}"

    def framed(make: Callable[..., Message | None]) -> Callable[..., Message | None]:
        def made(*reading: Reading) -> Message | None:
            message = make(*reading)
            if message is not None:
                message.header.frame_id = frame
            return message

        return made

    return replace(output, name=name, make=framed(output.make), blind=framed(output.blind) if output.blind else None)


def _scan(output: Output, sensor: Mounted, name: str) -> Output:
    def make(reading: Reading) -> Message:
        return scan_message(replace(reading, data=middle_ring(reading.data, sensor.config)))

    return replace(output, name=name, type="sensor_msgs/LaserScan", make=make)


def _heard(reading: Reading) -> Message:
    told = {name: float(getattr(reading.data, name)) for name in ("range", "bearing", "elevation")}
    return parameters(header(reading.time, reading.frame), told)
