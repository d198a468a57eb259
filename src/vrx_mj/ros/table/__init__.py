"""All that a simulation offers, whatever the network: VRX's topics and services with their types and rates."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import chain
from types import MappingProxyType
from typing import get_args

from vrx_mj.ros.interface import Dialect, Input, RosInterface
from vrx_mj.ros.messages import Message
from vrx_mj.ros.table.boats import BoatFrames, Localization, boat_inputs
from vrx_mj.ros.table.gazebo import gazebo_inputs, gazebo_outputs, gazebo_services, gz_services
from vrx_mj.ros.table.host import Host
from vrx_mj.ros.table.sensing import sensor_inputs, sensor_outputs, sensor_services
from vrx_mj.ros.table.viewers import marker_output
from vrx_mj.ros.table.world import (
    CLOCK,
    elsewhere,
    task_inputs,
    task_outputs,
    task_services,
    world_inputs,
    world_outputs,
    world_services,
)

__all__ = ["CLOCK", "make_tables"]

NO_LOCALIZATION: Mapping[str, Localization] = MappingProxyType({})
"""Localization of no boat."""


def make_tables(
    host: Host, *, clock_rate: float, waits: bool = False, localized: Mapping[str, Localization] = NO_LOCALIZATION
) -> Mapping[Dialect, RosInterface]:
    """The tables of a simulation with the boats that it has now; `/clock` is published at a rate [Hz].

    Where time `waits` for answers, who comes late gets the last clock. `localized` has boats that say where they are.
    VRX 3 has no parameters.
    """
    boats = host.sim.boats
    located = {boat: one.frames for boat, one in localized.items()}
    boat_frames = [BoatFrames(host, boat, located.get(boat, list)) for boat in boats]
    outputs = [
        *world_outputs(host, boat_frames, clock_rate, waits=waits),
        marker_output(host),
        *gazebo_outputs(host),
        *task_outputs(host),
        *chain.from_iterable(own.outputs() for own in boat_frames),
        *chain.from_iterable(sensor_outputs(host, boat) for boat in boats),
        *chain.from_iterable(one.outputs() for one in localized.values()),
        *chain.from_iterable(map(host.further, boats)),
    ]
    inputs = [
        *world_inputs(host),
        *gazebo_inputs(host),
        *task_inputs(host),
        *chain.from_iterable(chain(boat_inputs(host, boat), sensor_inputs(host, boat)) for boat in boats),
    ]
    services = [
        *chain(world_services(host), gazebo_services(host), gz_services(host)),
        *chain(task_services(host), sensor_services(host), *(one.services() for one in localized.values())),
    ]
    tables: dict[Dialect, RosInterface] = {
        dialect: RosInterface(
            {output.name: output for output in outputs if dialect in output.dialects},
            _by_name(entry for entry in inputs if dialect in entry.dialects),
            {service.name: service for service in services if dialect in service.dialects},
            elsewhere=elsewhere(host),
        )
        for dialect in get_args(Dialect)
    }
    descriptions = {f"/{own.boat}/robot_description": own.description for own in boat_frames}
    parameters = {"/use_sim_time": True} | {name: text for name, text in descriptions.items() if text is not None}
    return tables | {"vrx": replace(tables["vrx"], parameters=parameters)}


def _by_name(inputs: Iterable[Input]) -> dict[str, Input]:
    """Topics by name: what comes on one that several listen to is taken by all."""
    found: dict[str, Input] = {}
    for entry in inputs:
        known = found.get(entry.name)
        found[entry.name] = entry if known is None else replace(known, take=_both(known, entry))
    return found


def _both(one: Input, other: Input) -> Callable[[Message], None]:
    def take(message: Message) -> None:
        one.take(message)
        other.take(message)

    return take
