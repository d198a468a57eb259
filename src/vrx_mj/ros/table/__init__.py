"""All that a simulation offers, whatever the network: VRX's topics and services with their types and rates."""

from collections.abc import Iterator
from itertools import chain
from typing import Any

from vrx_mj.errors import VrxError
from vrx_mj.ros.interface import RosInterface
from vrx_mj.ros.table.boats import Skeleton, boat_inputs, cmd_vel
from vrx_mj.ros.table.gazebo import gazebo_inputs, gazebo_outputs, gazebo_services
from vrx_mj.ros.table.host import Host
from vrx_mj.ros.table.sensing import sensor_inputs, sensor_outputs
from vrx_mj.ros.table.tasks import task_inputs, task_outputs, task_services
from vrx_mj.ros.table.world import CLOCK, world_inputs, world_outputs, world_services

__all__ = ["CLOCK", "make_table"]


def make_table(host: Host, *, clock_rate: float, waits: bool = False) -> RosInterface:
    """The table of a simulation with the boats that it has now; `/clock` is published at a rate [Hz].

    Where time `waits` for answers, who comes late gets the last clock.
    """
    boats = host.sim.boats
    skeletons = [Skeleton(host, boat) for boat in boats]
    outputs = chain(
        world_outputs(host, skeletons, clock_rate, waits=waits),
        gazebo_outputs(host),
        task_outputs(host),
        *(skeleton.outputs() for skeleton in skeletons),
        *(sensor_outputs(host, boat) for boat in boats),
    )
    inputs = chain(
        world_inputs(host),
        gazebo_inputs(host),
        task_inputs(host),
        *(chain(boat_inputs(host, boat), sensor_inputs(host, boat)) for boat in boats),
        [cmd_vel(host, boats[0], "/cmd_vel")] if len(boats) == 1 else [],
    )
    services = chain(world_services(host), gazebo_services(host), task_services(host))
    return RosInterface(
        {output.name: output for output in outputs},
        {entry.name: entry for entry in inputs},
        {service.name: service for service in services},
        dict(_parameters(host)),
    )


def _parameters(host: Host) -> Iterator[tuple[str, Any]]:
    yield "/use_sim_time", True
    for boat in host.sim.boats:
        try:
            yield f"/{boat}/robot_description", host.description(boat)
        except VrxError:  # made elsewhere, of files that are not here
            continue
