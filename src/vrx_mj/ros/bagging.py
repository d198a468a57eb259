"""A run that is written into a bag: what a served simulation would publish, and what its controller commands."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from numbers import Real
from pathlib import Path
from typing import Any

from vrx_mj.ros.bags import Bag
from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.messages import new
from vrx_mj.ros.ros_server import CLOCK_RATE, RosServer
from vrx_mj.ros.table.boats import command_topic
from vrx_mj.runtime.observation import Observation
from vrx_mj.runtime.run import Controller
from vrx_mj.runtime.simulation import Simulation

__all__ = ["bagged"]

COMMAND = "std_msgs/Float32"
Advance = Callable[[int], None]


@contextmanager
def bagged(
    sim: Simulation, path: str | Path, controller: Controller | None = None, *, topics: Sequence[str] = ()
) -> Iterator[tuple[Advance, Controller | None]]:
    """Write all that happens inside the `with` statement into a bag; the motion stays the same to the last bit.

    Gives what advances the simulation meanwhile, and a controller that does as `controller` and is heard: its commands
    are messages too. `topics` are those of `Bag`. An exception, Ctrl-C included, completes the file and goes on.

    Raises:
        RecordError: the bag cannot be written.
        UnknownNameError: there is no topic like one that was named.
    """
    bag = Bag(path, topics=topics)
    bag.start()
    try:
        rate = min(CLOCK_RATE, 1.0 / sim.timestep)
        station = RosServer(sim, [bag], Inbox(), tell=bag.log, truth=True, clock_rate=rate)
        try:
            station.announce()
            yield station.advance, None if controller is None else heard(bag, sim, controller)
        finally:
            station.close()
    finally:
        bag.close()


def heard(bag: Bag, sim: Simulation, controller: Controller) -> Controller:
    """A controller whose commands go into a bag."""

    def command(seen: Observation, time: float) -> Mapping[str, Any] | None:
        commands = controller(seen, time)
        if isinstance(commands, Mapping):
            for boat in sim.boats:
                _write(bag, boat, sim.command_names(boat), commands.get(boat), time)
        return commands

    return command


def _write(bag: Bag, boat: str, names: Sequence[str], given: Any, time: float) -> None:
    """Write a boat's commands; whether they are right is the simulation's to say."""
    if isinstance(given, Mapping):
        for name in names:
            if isinstance(given.get(name), Real):
                bag.write(command_topic(boat, name), COMMAND, new(COMMAND, data=float(given[name])), time)
