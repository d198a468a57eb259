"""A boat's thrusters: VRX's topics of actuators; and its description."""

import math
from collections.abc import Iterator
from functools import lru_cache

from vrx_mj.config.build import Order, boat_urdf
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.drive.pilot import Wheel, engine_commands, engines_of
from vrx_mj.errors import CommandError
from vrx_mj.mjcf.world import World
from vrx_mj.ros.messages import Message
from vrx_mj.ros.offer import Input
from vrx_mj.ros.table.host import Host

__all__ = [
    "boat_inputs",
    "command_topic",
    "description",
    "twist_commands",
]

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
            raise CommandError(
                f"invalid cmd_vel of {boat}, linear.x {ahead}, angular.z {around}: finite numbers are needed"
            )
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
    newtons = any(thruster.in_newtons for thruster in host.sim.world.parameters.thrusters_of(boat))
    for left, right in SIDES:
        if left in names and right in names and not newtons:
            return {left: ahead - around, right: ahead + around}
    return engine_commands(engines_of(host.sim.world, boat), Wheel(power=ahead, turn=around))


def description(world: World, boat: str) -> str:
    """The boat's URDF with its namespace in it, for the parameter `robot_description`.

    Raises:
        VrxError: the files that it was built of are not found from here.
    """
    own = next(own for own in world.parameters.boats if own.name == boat)
    config = BoatConfig(**{key: getattr(own, key) for key in ORDERED})
    return _urdf(boat, config.order)


@lru_cache(maxsize=256)
def _urdf(boat: str, order: Order) -> str:
    return boat_urdf(order, boat)
