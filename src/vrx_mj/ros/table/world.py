"""What belongs to the world: its clock, frames, wind, placards, and the fleet's formation."""

import math
import os
from collections.abc import Iterator, Sequence
from functools import cache

from vrx_mj.ros.messages import Message, new, stamp
from vrx_mj.ros.offer import Input, Output, Service
from vrx_mj.ros.table.chart import chart_output
from vrx_mj.ros.table.host import Host
from vrx_mj.ros.table.skeleton import Skeleton

__all__ = ["CLOCK", "world_inputs", "world_outputs", "world_services"]

CLOCK = "/clock"
TF_RATE = 50.0
"""[Hz], as robot_state_publisher's."""
WIND_RATE = 10.0


def world_outputs(host: Host, skeletons: Sequence[Skeleton], clock_rate: float, *, waits: bool) -> Iterator[Output]:
    """`/clock`, `/tf`, `/tf_static`, `/vrx_mj/world`, and VRX's wind.

    VRX_DEBUG=false in the environment silences the wind.
    """

    def clock() -> Message:
        return new("rosgraph_msgs/Clock", clock=stamp(host.sim.time))

    def moving() -> Message:
        return new("tf2_msgs/TFMessage", transforms=[frame for one in skeletons for frame in one.moving()])

    @cache
    def still() -> Message:
        return new("tf2_msgs/TFMessage", transforms=[frame for one in skeletons for frame in one.still()])

    yield Output(CLOCK, "rosgraph_msgs/Clock", clock, clock_rate, latched=waits)
    yield Output("/tf", "tf2_msgs/TFMessage", moving, TF_RATE)
    yield Output("/tf_static", "tf2_msgs/TFMessage", still, latched=True)
    yield chart_output(host)
    if os.environ.get("VRX_DEBUG") != "false":
        yield from _wind(host)


def _wind(host: Host) -> Iterator[Output]:
    """Speed [m/s], and where the wind blows to [degrees], counter-clockwise from east, from -180 to 180."""

    def speed() -> Message:
        return new("std_msgs/Float64", data=host.sim.wind.speed)

    def direction() -> Message:
        return new("std_msgs/Float64", data=math.degrees(host.sim.wind.direction))

    yield Output("/vrx/debug/wind/speed", "std_msgs/Float64", speed, WIND_RATE)
    yield Output("/vrx/debug/wind/direction", "std_msgs/Float64", direction, WIND_RATE)


def world_inputs(host: Host) -> Iterator[Input]:
    """What shuffles placards and lights, and what the fleet is told to form."""
    for name in (*host.sim.placards, *host.sim.lights):

        def shuffle(_message: Message, name: str = name) -> None:
            host.sim.shuffle(name)

        yield Input(f"/vrx/{name.rpartition('/')[2]}/shuffle", "std_msgs/Empty", shuffle)
    if len(host.sim.boats) > 1:
        yield Input("/swarm/formation", "std_msgs/String", lambda message: host.form(message.data))


def world_services(host: Host) -> Iterator[Service]:
    """`/vrx_mj/step`: advance, whether paused or not."""

    def step(request: Message) -> Message:
        host.step(request.duration)
        return new("vrx_mj_msgs/StepResponse", sim_time=host.sim.time, success=True)

    yield Service("/vrx_mj/step", "vrx_mj_msgs/Step", step)
