"""A boat's thrusters, joints and frames: VRX's topics of actuators, and what a robot_state_publisher would tell."""

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.adapters.helm.engines import Wheel, engine_commands, engines_of
from vrx_mj.adapters.ros.messages import Message, new
from vrx_mj.adapters.ros.offer import Input, Output
from vrx_mj.adapters.ros.table.bodies import header, turned, vector
from vrx_mj.adapters.ros.table.host import Host
from vrx_mj.compiler.world import World
from vrx_mj.config.build import Order, boat_urdf
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.errors import CommandError

__all__ = [
    "boat_inputs",
    "boat_outputs",
    "command_topic",
    "description",
    "moving_frames",
    "still_frames",
    "twist_commands",
]

FloatArray = npt.NDArray[np.float64]
JOINT_RATE = 100.0
"""[Hz], as VRX's."""
JOINTS = ("_chasis_engine_joint", "_engine_propeller_joint")
"""VRX's joints of a thruster, after its name; the spelling is VRX's."""
ORDERED = ("name", "robot", "thrusters", "components", "sensors", "pose")
"""What of a boat's entry its URDF depends on."""
ANGLE = "_angle"
SIDES = (("left", "right"), ("left_rear", "right_rear"))
"""Engines that VRX's twist2thrust drives: of layouts H and T, and of X."""


def boat_inputs(host: Host, boat: str) -> Iterator[Input]:
    """`thrusters/NAME_thrust_cmd`, `thrusters/NAME_thrust_angle` and `cmd_vel`."""
    for name in host.sim.command_names(boat):

        def take(message: Message, name: str = name) -> None:
            host.command(boat, {name: message.data})

        yield Input(command_topic(boat, name), "std_msgs/Float32", take, boat)
    yield cmd_vel(host, boat, f"/{boat}/cmd_vel")


def command_topic(boat: str, name: str) -> str:
    """VRX's topic of a command, `/wamv/thrusters/left_thrust_cmd` for `left`."""
    stem = name.removesuffix(ANGLE)
    return f"/{boat}/thrusters/{stem}{'_thrust_cmd' if stem == name else '_thrust_angle'}"


def cmd_vel(host: Host, boat: str, name: str) -> Input:
    """The topic `name` that commands a boat's motion."""

    def take(message: Message) -> None:
        ahead, around = message.linear.x, message.angular.z
        if not (math.isfinite(ahead) and math.isfinite(around)):
            raise CommandError(f"cmd_vel of {boat} is linear.x {ahead}, angular.z {around}: finite numbers are needed")
        if host.cmd_vel == "velocity":
            host.steer(boat, ahead, around)
        else:
            host.command(boat, twist_commands(host, boat, ahead, around))

    return Input(name, "geometry_msgs/Twist", take, boat)


def twist_commands(host: Host, boat: str, ahead: float, around: float) -> dict[str, float]:
    """VRX's twist2thrust: left is linear.x - angular.z and right their sum, unlimited.

    Boats without VRX's engines get the same by the arms of those that they have, as `vrx-mj view` drives them.
    """
    names = host.sim.command_names(boat)
    newtons = host.sim.world.parameters["profile"] == "vrx3"
    for left, right in SIDES:
        if left in names and right in names and not newtons:
            return {left: ahead - around, right: ahead + around}
    return engine_commands(engines_of(host.sim.world, boat), Wheel(power=ahead, turn=around))


def boat_outputs(host: Host, boat: str) -> Iterator[Output]:
    """`joint_states`: of each thruster its engine's joint and its propeller's, which does not turn here."""
    names = [f"{boat}/{name}{joint}" for name in host.sim.steering(boat) for joint in JOINTS]

    def make() -> Message:
        angles = np.zeros(len(names))
        angles[:: len(JOINTS)] = list(host.sim.steering(boat).values())
        return new(
            "sensor_msgs/JointState",
            header=header(host.sim.time),
            name=names,
            position=angles,
            velocity=np.zeros(len(names)),
            effort=np.zeros(len(names)),
        )

    yield Output(f"/{boat}/joint_states", "sensor_msgs/JointState", make, JOINT_RATE)


def still_frames(host: Host, boat: str) -> list[Message]:
    """geometry_msgs/TransformStamped of a boat's sensors in its `base_link`."""
    frames = []
    for sensor in host.sim.mounted(boat):
        link, mount = f"{boat}/{sensor.config.link}", sensor.mount
        frames.append(_transform(0.0, f"{boat}/base_link", link, mount.position, mount.orientation))
        if sensor.frame != link:
            optical = (0.5, -0.5, 0.5, -0.5) if sensor.config.type == "camera" else (1.0, 0.0, 0.0, 0.0)
            frames.append(_transform(0.0, link, sensor.frame, (0.0, 0.0, 0.0), optical))
    return frames


def moving_frames(host: Host, boat: str) -> list[Message]:
    """Of its engines, as they are steered; and of the boat itself in `map`, if the truth is told."""
    time, angles = host.sim.time, host.sim.steering(boat)
    hull = host.sim.boats.index(boat)
    frames = []
    for row in (row for row in host.sim.world.parameters["thrusters"] if row["hull"] == hull):
        steered = turned_by(row["rotation"], angles[row["name"]])
        child = f"{boat}/{row['name']}_engine_link"
        frames.append(_transform(time, f"{boat}/base_link", child, row["position"], steered))
    if host.truth:
        placed = host.bodies.model(boat)
        frames.append(_transform(time, "map", f"{boat}/base_link", placed.position, placed.quaternion))
    return frames


def _transform(time: float, parent: str, child: str, position: Sequence[float] | Any, turn: Any) -> Message:
    return new(
        "geometry_msgs/TransformStamped",
        header=header(time, parent),
        child_frame_id=child,
        transform={"translation": vector(position), "rotation": turned(turn)},
    )


def turned_by(rotation: Sequence[Sequence[float]], angle: float) -> FloatArray:
    """(4,): an engine's mounting, as a matrix, turned about its own z by an angle [rad], as (w, x, y, z)."""
    mounted, turn, result = np.empty(4), np.array([math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)]), np.empty(4)
    mujoco.mju_mat2Quat(mounted, np.array(rotation, np.float64).reshape(9))
    mujoco.mju_mulQuat(result, mounted, turn)
    return result


def description(world: World, boat: str) -> str:
    """The boat's URDF with its namespace in it, for the parameter `robot_description`.

    Raises:
        VrxError: the files that it was built of are not found from here.
    """
    row = next(row for row in world.parameters["boats"] if row["name"] == boat)
    config = BoatConfig(**{key: row[key] for key in ORDERED})
    return _urdf(boat, config.order)


@lru_cache(maxsize=256)
def _urdf(boat: str, order: Order) -> str:
    return boat_urdf(order, boat)
