"""All that a simulation offers, whatever the network: VRX's topics and services with their types and rates."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from types import MappingProxyType
from typing import get_args

from vrx_mj.ros.interface import Dialect, Entry, Input, Output, RosInterface, Service
from vrx_mj.ros.messages import Message
from vrx_mj.ros.table.boats import BoatFrames, Localization, boat_inputs
from vrx_mj.ros.table.gazebo import gazebo_topics, gz_services
from vrx_mj.ros.table.host import Host
from vrx_mj.ros.table.sensing import sensor_services, sensor_topics
from vrx_mj.ros.table.viewers import marker_output
from vrx_mj.ros.table.world import CLOCK, elsewhere, task_topics, world_topics

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
    entries: Sequence[Entry] = [
        *world_topics(host, boat_frames, clock_rate, waits=waits),
        marker_output(host),
        *gazebo_topics(host),
        *gz_services(host),
        *task_topics(host),
        *sensor_services(host),
        *chain.from_iterable(own.outputs() for own in boat_frames),
        *chain.from_iterable(chain(boat_inputs(host, boat), sensor_topics(host, boat)) for boat in boats),
        *chain.from_iterable(one.topics() for one in localized.values()),
        *chain.from_iterable(map(host.further, boats)),
    ]
    tables: dict[Dialect, RosInterface] = {
        dialect: _table([entry for entry in entries if dialect in entry.dialects], elsewhere(host))
        for dialect in get_args(Dialect)
    }
    descriptions = {f"/{own.boat}/robot_description": own.description for own in boat_frames}
    parameters = {"/use_sim_time": True} | {name: text for name, text in descriptions.items() if text is not None}
    return tables | {"vrx": replace(tables["vrx"], parameters=parameters)}


def _table(entries: Sequence[Entry], elsewhere: Mapping[str, str]) -> RosInterface:
    """Topics and services by name: what comes on a topic that several listen to is taken by all."""
    outputs = {entry.name: entry for entry in entries if isinstance(entry, Output)}
    services = {entry.name: entry for entry in entries if isinstance(entry, Service)}
    inputs: dict[str, Input] = {}
    for entry in entries:
        if isinstance(entry, Input):
            known = inputs.get(entry.name)
            inputs[entry.name] = entry if known is None else replace(known, take=_both(known, entry))
    return RosInterface(outputs, inputs, services, elsewhere=elsewhere)


def _both(one: Input, other: Input) -> Callable[[Message], None]:
    def take(message: Message) -> None:
        one.take(message)
        other.take(message)

    return take
