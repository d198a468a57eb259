"""The same topics as VRX 3 has them on ROS 2: its names and types, each made from one of VRX's table."""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vrx_mj.config.sensors import LidarConfig
from vrx_mj.errors import CommandError
from vrx_mj.model.tasks import Wildlife
from vrx_mj.ros.cdr import kind
from vrx_mj.ros.interface import Input, Output, RosInterface
from vrx_mj.ros.messages import Message, new
from vrx_mj.ros.table.boats import ANGLE, Skeleton
from vrx_mj.ros.table.host import Host, header, vector
from vrx_mj.ros.table.sensing import TOPICS, scan_message
from vrx_mj.ros.table.tasks import collision_name
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.sensors.readings import PointCloud, Reading, Scan

__all__ = ["PACKAGES", "make_vrx3_table", "middle_ring", "parameters", "vrx3_sensor_inputs", "vrx3_sensor_outputs"]

KINDS = {bool: (1, "bool_value"), int: (2, "integer_value"), float: (3, "double_value"), str: (4, "string_value")}
"""Of rcl_interfaces/ParameterType, and the field that has the value."""


def parameters(header: Message, values: Mapping[str, str | bool | int | float]) -> Message:
    """ros_gz_interfaces/ParamVec."""
    params = [kind("rcl_interfaces/Parameter")(name, _value(value)) for name, value in values.items()]
    return kind("ros_gz_interfaces/ParamVec")(header, params)


def _value(value: str | float) -> Message:
    number, field = KINDS[type(value)]
    empty: dict[str, Any] = {
        "bool_value": False,
        "integer_value": 0,
        "double_value": 0.0,
        "string_value": "",
        "byte_array_value": np.zeros(0, np.uint8),
        "bool_array_value": np.zeros(0, np.bool_),
        "integer_array_value": np.zeros(0, np.int64),
        "double_array_value": np.zeros(0, np.float64),
        "string_array_value": [],
    }
    return kind("rcl_interfaces/ParameterValue")(type=number, **(empty | {field: value}))


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


def vrx3_sensor_outputs(host: Host, table: RosInterface, boat: str) -> Iterator[Output]:
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


def vrx3_sensor_inputs(host: Host, table: RosInterface, boat: str) -> Iterator[Input]:
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
        stem = f"/{boat}/{TOPICS[sensor.config.type].vrx3_stem.format(sensor.name)}"
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
    values = {name: float(getattr(reading.data, name)) for name in ("range", "bearing", "elevation")}
    return parameters(header(reading.time, reading.frame), values)


PACKAGES = (
    "geometry_msgs",
    "nav_msgs",
    "rcl_interfaces",
    "ros_gz_interfaces",
    "rosgraph_msgs",
    "sensor_msgs",
    "std_msgs",
    "tf2_msgs",
)
"""Whose messages topics of this table have."""
FRAME_RATE = 50.0
CONTACT_RATE = 10.0
ANIMAL_RATE = 1.0
"""[Hz], VRX 3's default."""
COLORS = 3
COLLISION = 5
"""A kind of ros_gz_interfaces/Entity."""


class TopicMapping(NamedTuple):
    """A topic of VRX's table by another name, or with other messages."""

    of: str
    name: str
    type: str
    tell: Callable[[Message], Message | None]


def make_vrx3_table(host: Host, table: RosInterface) -> RosInterface:
    """VRX 3's topics, from the table by VRX's names; VRX 3 has no services."""
    outputs = [
        *(_mapped(table.outputs[row.of], row) for row in RETOLD if row.of in table.outputs),
        *_infos(host, table),
        *_animals(host, table),
        *_contacts(host),
        *(output for boat in host.sim.boats for output in _boat_outputs(host, table, boat)),
    ]
    inputs = [
        *(entry for name, entry in table.inputs.items() if name.endswith("/cmd_vel") or name == "/swarm/formation"),
        *(entry for boat in host.sim.boats for entry in _boat_inputs(host, table, boat)),
        *_task_inputs(table),
    ]
    return RosInterface({output.name: output for output in outputs}, {entry.name: entry for entry in inputs})


def _mapped(output: Output, row: TopicMapping, rate: float | None = None) -> Output:
    def make() -> Message | None:
        message = output.make()
        return None if message is None else row.tell(message)

    return replace(output, name=row.name, type=row.type, make=make, rate=output.rate if rate is None else rate)


def _boat_outputs(host: Host, table: RosInterface, boat: str) -> Iterator[Output]:
    skeleton = Skeleton(host, boat)

    def moving() -> Message:
        return new("tf2_msgs/TFMessage", transforms=skeleton.moving())

    def still() -> Message:
        return new("tf2_msgs/TFMessage", transforms=skeleton.still())

    yield table.outputs[f"/{boat}/joint_states"]
    yield Output(f"/{boat}/pose", "tf2_msgs/TFMessage", moving, FRAME_RATE)
    yield Output(f"/{boat}/pose_static", "tf2_msgs/TFMessage", still, latched=True)
    text = table.parameters.get(f"/{boat}/robot_description")
    if text is not None:
        told = new("std_msgs/String", data=text)
        yield Output(f"/{boat}/robot_description", "std_msgs/String", lambda: told, latched=True)
    yield from vrx3_sensor_outputs(host, table, boat)


def _boat_inputs(host: Host, table: RosInterface, boat: str) -> Iterator[Input]:
    """Of each thruster `thrust` [N], which stays until the next one, and `pos` [rad]."""
    for name in host.sim.command_names(boat):
        stem = f"/{boat}/thrusters/{name.removesuffix(ANGLE)}"
        if name.endswith(ANGLE):
            yield replace(table.inputs[f"{stem}_thrust_angle"], name=f"{stem}/pos", type="std_msgs/Float64")
            continue

        def push(message: Message, name: str = name) -> None:
            host.push(boat, name, message.data)

        yield Input(f"{stem}/thrust", "std_msgs/Float64", push, boat)
    yield from vrx3_sensor_inputs(host, table, boat)


def _infos(host: Host, table: RosInterface) -> Iterator[Output]:
    info = table.outputs.get("/vrx/task/info")
    if info is not None:
        row = TopicMapping(info.name, info.name, "ros_gz_interfaces/ParamVec", lambda told: _info(host.sim.time, told))
        yield _mapped(info, row)


def _animals(host: Host, table: RosInterface) -> Iterator[Output]:
    """A topic for each animal."""
    poses = table.outputs.get("/vrx/wildlife/animals/poses")
    task = host.sim.world.parameters.task
    if poses is None or not isinstance(task, Wildlife):
        return
    for index in range(len(task.animals)):

        def one(path: Message, index: int = index) -> Message | None:
            return _pose_stamped(path.poses[index])

        row = TopicMapping(poses.name, f"/vrx/wildlife/animal{index}/pose", "geometry_msgs/PoseStamped", one)
        yield _mapped(poses, row, ANIMAL_RATE)


def _contacts(host: Host) -> Iterator[Output]:
    if os.environ.get("VRX_DEBUG") != "false":
        yield Output("/vrx/contacts", "ros_gz_interfaces/Contacts", lambda: _touching(host), CONTACT_RATE)


def _touching(host: Host) -> Message:
    """All contacts of boats: who, where, along which normal, and how deep [m]."""
    boats, found = host.sim.boats, []
    for contact in host.sim.data.contact:
        pair = [(int(geom), collision_name(host.sim.model, int(geom), boats)) for geom in contact.geom]
        if contact.dist < 0.0 and any(name.partition("::")[0] in boats for _, name in pair):
            sides = [kind("ros_gz_interfaces/Entity")(geom, name, COLLISION) for geom, name in pair]
            where, normal = (new("geometry_msgs/Vector3", **vector(xyz)) for xyz in (contact.pos, contact.frame[:3]))
            found.append(kind("ros_gz_interfaces/Contact")(*sides, [where], [normal], np.array([-contact.dist]), []))
    return kind("ros_gz_interfaces/Contacts")(header(host.sim.time), found)


def _task_inputs(table: RosInterface) -> Iterator[Input]:
    landmark = table.inputs.get("/vrx/perception/landmark")
    if landmark is not None:
        report = landmark.take

        def place(message: Message) -> None:
            """Latitude and longitude [degrees] are its x and y."""
            where = message.pose.position
            position = {"latitude": where.x, "longitude": where.y, "altitude": where.z}
            header = new("std_msgs/Header", stamp=message.header.stamp, frame_id=message.header.frame_id)
            report(new("geographic_msgs/GeoPoseStamped", header=header, pose={"position": position}))

        yield replace(landmark, type="geometry_msgs/PoseStamped", take=place)
    service = table.services.get("/vrx/scan_dock_deliver/color_sequence")
    if service is not None:
        answer = service.answer

        def colors(message: Message) -> None:
            said = list(message.data)
            if len(said) != COLORS:
                raise CommandError(f"{len(said)} colours: {COLORS} are needed, as in ['red', 'green', 'blue']")
            given = {f"color{number}": color for number, color in enumerate(said, 1)}
            if not answer(new("vrx_gazebo/ColorSequenceRequest", **given)).success:
                raise CommandError("no sequence of colours is accepted now: only one, while the task runs")

        yield Input(service.name, "ros_gz_interfaces/StringVec", colors)


def _same(message: Message) -> Message:
    return message


def _single(message: Message) -> Message:
    return new("std_msgs/Float32", data=float(np.float32(message.data)))


def _pose(message: Message) -> Message:
    """geometry_msgs/Pose with latitude and longitude [degrees] for x and y, as VRX 3's."""
    where = message.pose.position
    position = {"x": where.latitude, "y": where.longitude, "z": where.altitude}
    return new("geometry_msgs/Pose", position=position, orientation=message.pose.orientation)


def _pose_stamped(message: Message) -> Message:
    return new("geometry_msgs/PoseStamped", header=message.header, pose=_pose(message))


def _pose_array(message: Message) -> Message:
    return new("geometry_msgs/PoseArray", header=message.header, poses=[_pose(pose) for pose in message.poses])


def _singles(message: Message) -> Message:
    return kind("ros_gz_interfaces/Float32Array")(np.asarray(message.data, np.float32))


def _info(time: float, message: Message) -> Message:
    told: Mapping[str, str | bool | int | float] = {
        "name": message.name,
        "state": message.state,
        "ready_time": _seconds(message.ready_time),
        "running_time": _seconds(message.running_time),
        "elapsed_time": _seconds(message.elapsed_time),
        "remaining_time": _seconds(message.remaining_time),
        "timed_out": message.timed_out,
        "num_collisions": message.num_collisions,
        "score": message.score,
    }
    return parameters(header(time), told)


def _seconds(time: Message) -> float:
    return float(time.sec + 1e-9 * time.nanosec)


RETOLD = (
    TopicMapping("/clock", "/clock", "rosgraph_msgs/Clock", _same),
    TopicMapping("/tf", "/tf", "tf2_msgs/TFMessage", _same),
    TopicMapping("/tf_static", "/tf_static", "tf2_msgs/TFMessage", _same),
    *(
        TopicMapping(f"/vrx/debug/wind/{name}", f"/vrx/debug/wind/{name}", "std_msgs/Float32", _single)
        for name in ("speed", "direction")
    ),
    *(
        TopicMapping(f"{old}/{name}", f"{then}/{name}", kind, tell)
        for old, then in (
            ("/vrx/station_keeping", "/vrx/stationkeeping"),
            ("/vrx/gymkhana_blackbox", "/vrx/gymkhana_blackbox"),
            ("/vrx/acoustic_tracking", "/vrx/acoustic_tracking"),
        )
        for name, kind, tell in (
            ("goal", "geometry_msgs/PoseStamped", _pose_stamped),
            ("pose_error", "std_msgs/Float32", _single),
            ("mean_pose_error", "std_msgs/Float32", _single),
        )
    ),
    TopicMapping("/vrx/wayfinding/waypoints", "/vrx/wayfinding/waypoints", "geometry_msgs/PoseArray", _pose_array),
    TopicMapping(
        "/vrx/wayfinding/min_errors", "/vrx/wayfinding/min_errors", "ros_gz_interfaces/Float32Array", _singles
    ),
    TopicMapping("/vrx/wayfinding/mean_error", "/vrx/wayfinding/mean_error", "std_msgs/Float32", _single),
)
