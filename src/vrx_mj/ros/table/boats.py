"""A boat for ROS: its thrusters, its description, the frames of its links, and what robot_localization publishes."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, cached_property, lru_cache, partial
from typing import Literal, NamedTuple

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.constants import ANGLE_SUFFIX
from vrx_mj.control.navigation import Localizer, Odometry, true_odometry
from vrx_mj.drive.pilot import Wheel, engine_commands, engines_of
from vrx_mj.errors import CommandError, ConfigError, VrxError
from vrx_mj.formats.urdf.model import Urdf
from vrx_mj.formats.urdf.reader import in_namespace, read_joints
from vrx_mj.frames import matrix_quaternion, quaternion, quaternion_product, rotation
from vrx_mj.mjcf.build import boat_urdf
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Thruster
from vrx_mj.physics.tables import BLADES
from vrx_mj.ros.interface import BOTH, VRX, VRX3, Entry, Input, Output, Service
from vrx_mj.ros.messages import Message, new
from vrx_mj.ros.parameters import command_topic
from vrx_mj.ros.table.host import Host, header
from vrx_mj.ros.table.viewers import with_meshes_inside
from vrx_mj.runtime.hull import Propeller
from vrx_mj.runtime.observation import Observation

_URDF_FIELDS = ("name", "robot", "arguments", "thrusters", "components", "sensors", "pose")
"""Fields of a boat's entry that its URDF depends on."""
_SIDES = (("left", "right"), ("left_rear", "right_rear"))
"""Engines that VRX's twist2thrust drives: of layouts H and T, and of X."""
WORLD_FRAME = "map"
"""Name of the world's frame."""
BASE = "base_link"
"""Name of the frame of a boat's root link, whatever the link's own name."""
_JOINT_RATE = 100.0
"""Rate of the states of joints [Hz]: VRX's."""
_FRAME_RATE = 50.0
"""Rate of frames [Hz]: VRX 3's."""
_SAME_PLACE = 1e-6
"""Distance within which two places are one [m]."""
_ODOMETRY = "nav_msgs/Odometry"
"""Type of odometry."""
UNTURNED = np.eye(4)[0]
"""Quaternion of no rotation."""
_ODOMETRY_RATE = 30.0
"""Rate of odometry [Hz]: robot_localization's."""
_MAX_ALTITUDE = 1e5
"""Largest altitude of a place in a request [m]."""
_KNOWN, _AUGMENTED = 3, 2
"""COVARIANCE_TYPE_KNOWN of sensor_msgs/NavSatFix, and STATUS_GBAS_FIX of NavSatStatus, as robot_localization's."""


def boat_inputs(host: Host, boat: str) -> Iterator[Input]:
    """`thrusters/NAME_thrust_cmd`, `thrusters/NAME_thrust_angle`, `cmd_drive` of 2018, and `cmd_vel`.

    The last two are topics of no boat's namespace, too, where there is one boat.
    """
    stems = (f"/{boat}", "") if len(host.sim.boats) == 1 else (f"/{boat}",)
    thrusters = [*_thruster_inputs(host, boat), *(_cmd_drive(host, boat, f"{stem}/cmd_drive") for stem in stems)]
    yield from thrusters
    if host.cmd_vel != "off":
        yield from (_cmd_vel(host, boat, f"{stem}/cmd_vel", thrusters) for stem in stems)


def _thruster_inputs(host: Host, boat: str) -> Iterator[Input]:
    """VRX 3's are `thrusters/NAME/thrust` [N], which lasts until the next one, and `thrusters/NAME/pos` [rad]."""
    for name in host.sim.command_names(boat):

        def take(message: Message, name: str = name) -> None:
            host.command(boat, {name: message.data})

        def push(message: Message, name: str = name) -> None:
            host.push(boat, name, message.data)

        yield Input(command_topic(boat, name), "std_msgs/Float32", take, boat)
        stem = f"/{boat}/thrusters/{name.removesuffix(ANGLE_SUFFIX)}"
        tail, done = ("pos", take) if name.endswith(ANGLE_SUFFIX) else ("thrust", push)
        yield Input(f"{stem}/{tail}", "std_msgs/Float64", done, boat, VRX3)


def _cmd_drive(host: Host, boat: str, name: str) -> Input:
    """Shares of full thrust of both sides."""

    def take(message: Message) -> None:
        left, right = message.left, message.right
        host.command(boat, twist_commands(host, boat, 0.5 * (left + right), 0.5 * (right - left)))

    return Input(name, "usv_gazebo_plugins/UsvDrive", take, boat)


def _cmd_vel(host: Host, boat: str, name: str, thrusters: Sequence[Input]) -> Input:
    """The topic `name` that commands a boat's motion, unless somebody publishes the boat's thrusts."""

    def take(message: Message) -> None:
        if host.is_published(thrusters, name):
            return
        ahead, around = message.linear.x, message.angular.z
        if not (math.isfinite(ahead) and math.isfinite(around)):
            raise CommandError(
                f"invalid cmd_vel of {boat}, linear.x {ahead}, angular.z {around}: finite numbers are needed"
            )
        if host.cmd_vel == "velocity":
            host.steering.steer_boat(boat, ahead, around)
        else:
            host.command(boat, twist_commands(host, boat, ahead, around))

    return Input(name, "geometry_msgs/Twist", take, boat, BOTH)


def twist_commands(host: Host, boat: str, ahead: float, around: float) -> dict[str, float]:
    """VRX's twist2thrust: left is linear.x - angular.z and right their sum, unlimited.

    Boats without VRX's engines get the same by the arms of those that they have, as `vrx-mj view` drives them.
    """
    names = host.sim.command_names(boat)
    newtons = any(thruster.in_newtons for thruster in host.sim.world.parameters.thrusters_of(boat))
    for left, right in _SIDES:
        if left in names and right in names and not newtons:
            return {left: ahead - around, right: ahead + around}
    return engine_commands(engines_of(host.sim.world, boat), Wheel(power=ahead, turn=around))


def description(world: World, boat: str) -> str:
    """The boat's URDF with its namespace in it, for the parameter `robot_description`.

    Raises:
        VrxError: the files that it was built of are not found from here.
    """
    own = next(own for own in world.parameters.boats if own.name == boat)
    if own.description:
        return in_namespace(own.description, boat)
    config = BoatConfig(**{key: getattr(own, key) for key in _URDF_FIELDS})
    return _boat_urdf(replace(config.order, profile=world.parameters.profile), boat)


_boat_urdf = lru_cache(maxsize=256)(boat_urdf)


class BoatJoint(NamedTuple):
    """A joint, and the link that it carries; frames have the boat's name before theirs, as `wamv/base_link`."""

    joint: str
    """Name of the joint in the description."""
    parent: str
    child: str
    """Frames."""
    position: FloatArray
    quaternion: FloatArray
    """Position (3,) [m] and quaternion (w, x, y, z) of the child in the parent, the joint at zero."""
    axis: FloatArray
    """Unit vector about which it turns, or along which it slides, in the child's frame, (3,)."""
    moves: bool
    place: FloatArray
    """Place of the child in the root's frame, all joints at zero, (3,) [m]."""


@lru_cache(maxsize=256)
def boat_joints(text: str, boat: str) -> tuple[BoatJoint, ...]:
    """The joints of a URDF, parents first; none for a text that is not a robot."""
    try:
        robot = read_joints(text)
    except ConfigError:
        return ()
    return tuple(_joints_of_links(robot, boat))


def _joints_of_links(robot: Urdf, boat: str) -> Iterator[BoatJoint]:
    name, base = robot.local(robot.root), f"{boat}/{BASE}"
    frames = {link: f"{boat}/{robot.local(link)}" for link in robot.links} | {robot.root: base}
    if name != BASE:
        frames[robot.root] = f"{boat}/{name}"
        yield BoatJoint("", base, frames[robot.root], np.zeros(3), UNTURNED, np.zeros(3), False, np.zeros(3))
    for link in robot.below(robot.root)[1:]:
        joint = robot.above[link]
        yield BoatJoint(
            joint.name,
            frames[joint.parent],
            frames[link],
            np.array(joint.pose[:3]),
            np.array(quaternion(*joint.pose[3:])),
            np.array(joint.axis),
            joint.type != "fixed" and not joint.is_locked,
            np.array(robot.places[link][:3]),
        )


class Spin(NamedTuple):
    """How a propeller turns."""

    angle: float = 0.0
    """Angle [rad], within +-pi."""
    rate: float = 0.0
    """Rate [rad/s]."""
    torque: float = 0.0
    """Torque [N m]."""

    def after(self, time: float, command: float) -> "Spin":
        """The spin after some time [s] under a share of full power.

        VRX drives the shaft by 2 N m at full power, beyond a tenth of it; its joint has a damping of 0.05 N m s, a
        friction of 0.05 N m and at most 100 rad/s, and the propeller 0.008545 kg m2. Nothing is pushed by that.
        """
        torque = 2.0 * command if abs(command) > 0.1 else 0.0
        inertia = 0.008545 + 0.05 * time  # with the damping of the whole time: an implicit step
        rate = (0.008545 * self.rate + torque * time) / inertia
        rate = math.copysign(min(max(abs(rate) - 0.05 * time / inertia, 0.0), 100.0), rate)
        return Spin(math.remainder(self.angle + rate * time, math.tau), rate, torque)


class BoatFrames:
    """The frames of a boat; a boat whose description is not here has those of its sensors and engines."""

    def __init__(self, host: Host, boat: str, located: Callable[[], list[Message]] = list) -> None:
        """`located` gives the frames in which the boat is by its localization, if there is one."""
        self._host, self.boat, self._located = host, boat, located
        self._spins: dict[str, Spin] = {}
        self._time = host.sim.time

    def outputs(self) -> Iterator[Output]:
        """`joint_states`: of each thruster the joint that steers it and its propeller's.

        VRX 3 has the boat's frames in topics of the boat, too. The description there names files, as RViz 2 needs it;
        that of bags and rosbridge has its meshes inside.
        """
        stem = f"/{self.boat}"
        joint_states = partial(Output, f"{stem}/joint_states", "sensor_msgs/JointState", self.joints, _JOINT_RATE)
        yield joint_states(dialects=BOTH, recorded="rows")
        for name, frames, rate in (("pose", self.moving, _FRAME_RATE), ("pose_static", self.still, 0.0)):

            def make(frames: Callable[[], list[Message]] = frames) -> Message:
                return new("tf2_msgs/TFMessage", transforms=frames())

            yield Output(f"{stem}/{name}", "tf2_msgs/TFMessage", make, rate, latched=rate == 0.0, dialects=VRX3)
        if self.description is not None:
            for dialects, whole in ((VRX3, False), (VRX, True)):
                text = cache(partial(self._description_message, whole))
                yield Output(f"{stem}/robot_description", "std_msgs/String", text, latched=True, dialects=dialects)

    def _description_message(self, whole: bool) -> Message:
        text = self.description or ""
        return new("std_msgs/String", data=with_meshes_inside(text, self._host.sim.world.assets) if whole else text)

    @cached_property
    def description(self) -> str | None:
        """The boat's URDF; None where the files that it was made of are not here."""
        try:
            return self._host.description(self.boat)
        except VrxError:
            return None

    def joints(self) -> Message:
        """Message sensor_msgs/JointState of the boat."""
        rows = self._turned_joints()
        return new(
            "sensor_msgs/JointState",
            header=header(self._host.sim.time),
            name=[joint.joint for joint, _ in rows],
            position=[spin.angle for _, spin in rows],
            velocity=[spin.rate for _, spin in rows],
            effort=[spin.torque for _, spin in rows],
        )

    def still(self) -> list[Message]:
        """geometry_msgs/TransformStamped of what does not move in the boat: its sensors and the links of its URDF."""
        boat, frames = self.boat, dict[str, Message]()
        for sensor in self._host.sim.mounted(boat):
            link, mount = f"{boat}/{sensor.config.link}", sensor.mount
            if sensor.config.link != BASE:
                frames[link] = transform(0.0, f"{boat}/{BASE}", link, mount.position, mount.orientation)
            if sensor.frame not in {link, WORLD_FRAME}:  # a ground truth is in the world's
                turn = np.array((0.5, -0.5, 0.5, -0.5)) if sensor.config.type == "camera" else UNTURNED
                position = np.zeros(3)
                if sensor.config.link == BASE:  # the frame of any other link is the sensor's
                    position, turn = mount.position, quaternion_product(mount.orientation, turn)
                frames[sensor.frame] = transform(0.0, link, sensor.frame, position, turn)
        for joint in self._joints:
            if joint.child not in frames and joint.child not in self._moving:
                frames[joint.child] = transform(0.0, joint.parent, joint.child, joint.position, joint.quaternion)
        return list(frames.values())

    def prefixed_frames(self) -> list[Message]:
        """Names of VRX 3 for all its frames: `wamv/wamv/base_link` is where `wamv/base_link` is."""
        names = [f"{self.boat}/{BASE}", *(frame.child_frame_id for frame in self.still()), *self._moving]
        return [transform(0.0, name, f"{self.boat}/{name}", np.zeros(3), UNTURNED) for name in names]

    def moving(self) -> list[Message]:
        """Transforms of engines as steered and of propellers; and of the boat in `map`, if that is published."""
        host, time, frames = self._host, self._host.sim.time, self._located()
        frames += [_joint_frame(time, joint, spin.angle) for joint, spin in self._turned_joints()]
        if host.truth:
            placed = host.bodies.model(self.boat)
            frames.append(transform(time, WORLD_FRAME, f"{self.boat}/{BASE}", placed.position, placed.quaternion))
        return frames

    # Inside

    @cached_property
    def _rows(self) -> Sequence[Thruster]:
        return self._host.sim.world.parameters.thrusters_of(self.boat)

    @cached_property
    def _joints(self) -> Sequence[BoatJoint]:
        described = boat_joints(self.description, self.boat) if self.description is not None else ()
        return described or [joint for row in self._rows for joint in _engine_joints(row, self.boat)]

    @cached_property
    def _thruster_joints(self) -> Sequence[tuple[BoatJoint, str, bool]]:
        """The joints where the thrusters are: whose, and whether it steers, or turns the propeller."""
        moving = [joint for joint in self._joints if joint.moves]
        return [joint for row in self._rows for joint in _joints_of(row, moving)]

    @cached_property
    def _moving(self) -> Sequence[str]:
        """Frames of engines and propellers."""
        return [joint.child for joint, _, _ in self._thruster_joints]

    @cached_property
    def _drives(self) -> Mapping[str, Propeller]:
        return self._host.sim.observe()[self.boat].thrusters

    def _turned_joints(self) -> list[tuple[BoatJoint, Spin]]:
        """Joints of engines as they are steered, and of propellers as they turn."""
        spins, angles = self._propeller_spins(), self._host.sim.steering(self.boat)
        return [(joint, Spin(angles[name]) if steers else spins[name]) for joint, name, steers in self._thruster_joints]

    def _propeller_spins(self) -> Mapping[str, Spin]:
        """Angle and speed of each propeller now."""
        time = self._host.sim.time
        passed, self._time = time - self._time, time
        if passed < 0.0:  # time began anew
            self._spins = {}
        thrust = self._host.sim.thrust(self.boat)
        for name, drive in self._drives.items():
            share = drive.command(thrust[name]) / drive.max_command
            self._spins[name] = self._spins.get(name, Spin()).after(max(passed, 0.0), share)
        return self._spins


def _joints_of(row: Thruster, moving: Sequence[BoatJoint]) -> Iterator[tuple[BoatJoint, str, bool]]:
    shaft = None if row.mapping in BLADES else _at(_propeller(row), moving[::-1])  # the outermost that is there
    engine = _at(np.array(row.position), [joint for joint in moving if joint is not shaft])
    return ((joint, row.name, joint is engine) for joint in (engine, shaft) if joint)


def _at(place: FloatArray, moving: Sequence[BoatJoint]) -> BoatJoint | None:
    return next((joint for joint in moving if np.abs(joint.place - place).max() < _SAME_PLACE), None)


def _propeller(row: Thruster) -> FloatArray:
    """Place where a thruster pushes at zero steering, (3,) [m], in the boat's frame."""
    hinge, turn, propeller = (np.array(part, np.float64) for part in (row.position, row.rotation, row.propeller))
    return hinge + turn @ propeller


def _engine_joints(row: Thruster, boat: str) -> Iterator[BoatJoint]:
    """The joints that a thruster has in VRX, for a boat whose description is not here."""
    stem, hinge, turn = f"{boat}/{row.name}", np.array(row.position), np.empty(4)
    mujoco.mju_mat2Quat(turn, np.array(row.rotation, np.float64).reshape(9))
    yield BoatJoint(
        f"{stem}_chasis_engine_joint", f"{boat}/{BASE}", f"{stem}_engine_link", hinge, turn,
        np.array([0.0, 0.0, 1.0]), True, hinge,
    )  # fmt: skip
    yield BoatJoint(
        f"{stem}_engine_propeller_joint", f"{stem}_engine_link", f"{stem}_propeller_link", np.array(row.propeller),
        UNTURNED, np.array(row.direction), True, _propeller(row),
    )  # fmt: skip


def _joint_frame(time: float, joint: BoatJoint, angle: float) -> Message:
    """The frame of a joint at an angle [rad]."""
    turn, result = np.empty(4), np.empty(4)
    mujoco.mju_axisAngle2Quat(turn, joint.axis, angle)
    mujoco.mju_mulQuat(result, joint.quaternion, turn)
    return transform(time, joint.parent, joint.child, joint.position, result)


def transform(
    time: float, parent: str, child: str, position: Sequence[float] | FloatArray, turn: Sequence[float] | FloatArray
) -> Message:
    """geometry_msgs/TransformStamped of a moment [s]: a position [m], and a quaternion (w, x, y, z)."""
    return new(
        "geometry_msgs/TransformStamped",
        header=header(time, parent),
        child_frame_id=child,
        transform={"translation": position, "rotation": turn},
    )


Source = Literal["truth", "navigator"]
"""Source of a boat's place: the truth, or its GPS and inertial unit."""


class Localization:
    """Localization of a boat. `BOAT/odom` is east-north-up at the world's origin, until it is given another datum."""

    def __init__(self, host: Host, boat: str, source: Source) -> None:
        """CommandError: the boat has no GPS or no inertial unit, and is to be found by these."""
        parameters, self._stem = host.sim.world.parameters, f"/{boat}/robot_localization"
        self._host, self._boat, self._earth = host, boat, parameters.georeference
        self._east, self._sent = parameters.x_from_east, -math.inf
        self._origin, self._axes = np.zeros(3), np.array(rotation(0.0, 0.0, -self._east))
        """Position of the frame in `map` [m], and rotation matrix, frame to `map`."""
        self._located: tuple[Observation, Odometry] | None = None
        self._localizer: Localizer | None = None
        if source == "navigator":
            first = {one.config.type: one for one in reversed(host.sim.mounted(boat))}
            missing = [f"{boat} has no {name.upper()}" for name in ("gps", "imu") if name not in first]
            if missing or self._earth is None:
                why = (*missing, "the world has no georeference")[0]
                raise CommandError(f"{why}: {boat} is not localized by its sensors; use --localization truth")
            antenna = np.zeros(3) if "gps" in parameters.at_base_link else first["gps"].mount.position
            self._localizer = Localizer(first["gps"], first["imu"], self._earth, antenna)

    @property
    def now(self) -> Odometry:
        """Where the boat is at the present moment, in the world's axes."""
        seen = self._host.observation
        if self._located is None or self._located[0] is not seen:
            by_sensors = self._localizer and self._localizer(seen[self._boat], self._host.sim.time)
            self._located = seen, by_sensors or true_odometry(seen[self._boat])
        return self._located[1]

    def frames(self) -> list[Message]:
        """geometry_msgs/TransformStamped of `BOAT/odom` in `map`, and of the boat in that."""
        time, odom, located = self._host.sim.time, f"{self._boat}/odom", self.now
        place, turn = self._in_odom(located.position), matrix_quaternion(self._axes.T @ located.rotation)
        return [
            transform(time, WORLD_FRAME, odom, self._origin, matrix_quaternion(self._axes)),
            transform(time, odom, f"{self._boat}/{BASE}", place, turn),
        ]

    def topics(self) -> Iterator[Entry]:
        """Where it is, by all and by the fix alone, the first as a fix, and `fromLL`, `toLL` and `datum`.

        The services are without a namespace, too, where there is one boat.
        """
        output = partial(Output, rate=_ODOMETRY_RATE, dialects=BOTH, recorded="nowhere")
        yield output(f"{self._stem}/odometry/filtered", _ODOMETRY, self._filtered_odometry)
        if self._earth is None:
            return
        yield output(f"{self._stem}/odometry/gps", _ODOMETRY, self._by_gps)
        yield output(f"{self._stem}/gps/filtered", "sensor_msgs/NavSatFix", self._as_fix)
        service = partial(Service, dialects=BOTH)
        for stem in (self._stem, "")[: 2 if len(self._host.sim.boats) == 1 else 1]:
            yield service(
                f"{stem}/fromLL",
                "robot_localization/FromLL",
                lambda asked: {"map_point": self._in_odom(self._place(asked.ll_point))},
            )
            yield service(f"{stem}/toLL", "robot_localization/ToLL", self._to_geodetic)
            yield service(f"{stem}/datum", "robot_localization/SetDatum", self._set_datum)

    def _filtered_odometry(self) -> Message:
        located = self.now
        turn = matrix_quaternion(self._axes.T @ located.rotation)
        twist = {"linear": located.velocity, "angular": located.spin}
        return new(
            _ODOMETRY,
            header=header(self._host.sim.time, f"{self._boat}/odom"),
            child_frame_id=f"{self._boat}/{BASE}",
            pose=self._pose(located.position, located.pose_covariance, turn),
            twist={"twist": twist, "covariance": located.twist_covariance},
        )

    def _by_gps(self) -> Message | None:
        """Odometry of a new fix, without orientation."""
        located = self.now
        time, place, covariance = self._host.sim.time, located.position, located.pose_covariance
        if self._localizer is not None:
            time, place, covariance = self._localizer.fixed
        if time == self._sent:
            return None
        self._sent = time
        return new(_ODOMETRY, header=header(time, f"{self._boat}/odom"), pose=self._pose(place, covariance))

    def _pose(self, place: FloatArray, covariance: FloatArray, turn: FloatArray = UNTURNED) -> dict[str, object]:
        """geometry_msgs/PoseWithCovariance in the boat's frame; position and covariance are in the world's axes."""
        axes = np.kron(np.eye(2), self._axes)
        pose = {"position": self._in_odom(place), "orientation": turn}
        return {"pose": pose, "covariance": axes.T @ covariance @ axes}

    def _as_fix(self) -> Message:
        located, turn = self.now, np.array(rotation(0.0, 0.0, self._east))
        return new(
            "sensor_msgs/NavSatFix",
            header=header(self._host.sim.time, f"{self._boat}/{BASE}"),
            status={"status": _AUGMENTED},
            position_covariance=turn @ located.pose_covariance[:3, :3] @ turn.T,
            position_covariance_type=_KNOWN,
            **self._geodetic(located.position),
        )

    def _to_geodetic(self, request: Message) -> dict[str, object]:
        point = np.array([request.map_point.x, request.map_point.y, request.map_point.z])
        if not np.isfinite(point).all():
            raise CommandError(f"invalid point {point.tolist()}: finite numbers are needed")
        return {"ll_point": self._geodetic(self._origin + self._axes @ point)}

    def _set_datum(self, request: Message) -> None:
        """Move the frame's origin, and turn its x axis to a heading from east."""
        place, turn = self._place(request.geo_pose.position), request.geo_pose.orientation
        if not math.isfinite(turn.x + turn.y + turn.z + turn.w):
            raise CommandError(f"invalid orientation of the datum of {self._boat}: finite numbers are needed")
        self._axes = np.array(rotation(0.0, 0.0, 2.0 * math.atan2(turn.z, turn.w) - self._east))
        apart, self._origin = math.dist(self._origin, place), place
        if apart > 0.0:
            what = f"{self._boat}/odom moves by {apart:.4g} m in map, to the given datum"
            self._host.diagnosis.once(f"datum of {self._boat}", f"{what}: everything in this frame jumps")

    def _place(self, point: Message) -> FloatArray:
        """Place of a geographic_msgs/GeoPoint in `map`, (3,) [m]."""
        latitude, longitude = point.latitude, point.longitude
        altitude = None if math.isnan(point.altitude) else point.altitude  # geographic_msgs: it is not specified
        if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0 and abs(altitude or 0.0) <= _MAX_ALTITUDE):
            allowed = f"latitudes to 90 degrees, longitudes to 180 degrees, altitudes to {_MAX_ALTITUDE:g} m"
            raise CommandError(f"invalid place {latitude}, {longitude}, {altitude}; allowed: {allowed}, either way")
        assert self._earth is not None, "services are offered where there is one"
        return np.array(self._earth.to_enu(latitude, longitude, altitude))

    def _geodetic(self, position: FloatArray) -> dict[str, float]:
        """The fields of a place in `map` [m]."""
        assert self._earth is not None, "as there"
        return dict(zip(("latitude", "longitude", "altitude"), self._earth.to_geodetic(*position), strict=True))

    def _in_odom(self, position: FloatArray) -> FloatArray:
        place: FloatArray = self._axes.T @ (position - self._origin)
        return place
