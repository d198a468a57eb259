"""What a simulation offers to networks, whichever they are: topics out and in, services, parameters.

A table of these is made once for the boats that there are, and again when boats come or go. Every function in it is
called by the simulation's own thread.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, Protocol

from vrx_mj.ros.messages import Message

__all__ = ["Dialect", "Input", "Output", "Sent", "Service", "Table", "Traffic", "Transport", "dialect_of"]

Dialect = Literal["vrx", "vrx3"]
"""Whose names and types of topics: VRX's on ROS 1, or VRX 3's on ROS 2."""


@dataclass(frozen=True, eq=False)
class Output:
    """A topic that the simulation publishes."""

    name: str
    """Absolute, as `/wamv/joint_states`."""
    type: str
    """As ROS 1 names it, `sensor_msgs/JointState`."""
    make: Callable[..., Message | None]
    """Gives the present message, or None where there is nothing to tell; of a sensor it takes the reading."""
    rate: float = 0.0
    """Messages per simulated second; 0: whenever there is a new one."""
    sensor: tuple[str, str] | None = None
    """Boat and sensor whose readings it carries."""
    blind: Callable[[], Message | None] | None = None
    """Gives the present message without a reading, where nothing else needs one: a camera's info needs no picture."""
    latched: bool = False
    """Whether who subscribes later gets the last message."""


@dataclass(frozen=True, eq=False)
class Input:
    """A topic that the simulation listens to."""

    name: str
    type: str
    take: Callable[[Message], None]
    """Raises a VrxError with what is wrong with a message."""
    boat: str | None = None
    """The boat that it commands."""


@dataclass(frozen=True, eq=False)
class Service:
    """A service of the simulation."""

    name: str
    type: str
    """As ROS 1 names it, `std_srvs/Empty`."""
    answer: Callable[[Message], Message]
    """From the request to the response; raises a VrxError where it fails without one."""


@dataclass(frozen=True)
class Table:
    """All that is offered, by name."""

    outputs: Mapping[str, Output] = field(default_factory=dict)
    inputs: Mapping[str, Input] = field(default_factory=dict)
    services: Mapping[str, Service] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    """Numbers, strings, lists and mappings, by absolute name."""


class Sent(NamedTuple):
    """A message on its way out."""

    output: Output
    message: Message
    time: float
    """Simulated time [s]."""


class Traffic(NamedTuple):
    """What a transport has carried since it started."""

    clients: int
    """Connected now."""
    sent: int
    """[bytes]"""
    dropped: int
    """Messages that were thrown away because a client did not keep up."""


class Transport(Protocol):
    """A network on which a table is offered. Its methods are called by the simulation's thread, and none may block it.

    What comes in goes to the inbox that it was made with.
    """

    title: str
    """For people, as `ROS 1`."""

    def start(self) -> Sequence[str]:
        """Open it; returns lines that tell people where it is. NetworkError: it cannot be opened, and why."""

    def offer(self, table: Table) -> None:
        """Offer this table from now on, and nothing else: what is new in it is announced, what is gone withdrawn."""

    @property
    def wanted(self) -> frozenset[str]:
        """Names of the outputs that somebody listens to now; only these are made."""

    def publish(self, batch: Sequence[Sent]) -> None:
        """Send messages of one moment to who listens. One that is latched is kept, and sent whoever listens."""

    def log(self, level: str, text: str) -> None:
        """Tell people on the network a line: `INFO`, `WARN` or `ERROR`."""

    @property
    def traffic(self) -> Traffic:
        """What it has carried."""

    def close(self) -> None:
        """Withdraw all, close every connection, and wait until that is done: 2 s at most."""


def dialect_of(transport: Transport) -> Dialect:
    """Of the table that is offered on a transport: what its attribute `dialect` says, else VRX's."""
    dialect: Dialect = getattr(transport, "dialect", "vrx")
    return dialect
