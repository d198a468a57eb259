"""What all clients share."""

import itertools
import logging
from typing import Protocol

from vrx_mj.ros.inbox import Inbox
from vrx_mj.ros.limits import ClientPace, Counts, Intake
from vrx_mj.ros.network import Network
from vrx_mj.ros.offer import Table
from vrx_mj.ros.rosbridge.parameters import Parameters
from vrx_mj.ros.rosbridge.rosapi import Rosapi
from vrx_mj.ros.rosbridge.topics import Services, Topics

__all__ = ["Hub"]

MOST_TOLD = 512
MOST_FRAGMENTS = 1 << 25
"""Characters of all clients' fragments that wait for the rest of their messages, at most."""

_logger = logging.getLogger(__name__)


class Ending(Protocol):
    """A client, as far as the hub is concerned."""

    host: str
    """The peer's address."""
    is_silent: bool
    """Whether it has said nothing yet."""

    def abort(self) -> None:
        """End its connection at once."""


class Hub:
    """Topics, services and parameters, and who is there."""

    def __init__(self, network: Network, inbox: Inbox) -> None:
        self.inbox = inbox
        self.counts = Counts()
        self.flooding: set[ClientPace] = set()
        self.fragments = Intake(MOST_FRAGMENTS)
        self.topics = Topics()
        self.services = Services(network, inbox)
        self.parameters = Parameters()
        self.clients: dict[int, Ending] = {}
        self._told: set[tuple[str, str]] = set()
        self.numbers = itertools.count(1)
        self.rosapi = Rosapi(self.topics, self.services, self.parameters, lambda: sorted(self.clients))
        self.services.built_in = self.rosapi.all()

    @property
    def now(self) -> float:
        """Simulated time [s]."""
        return self.rosapi.time

    @now.setter
    def now(self, time: float) -> None:
        self.rosapi.time = time

    def offer(self, table: Table) -> None:
        """Have this table in place of the one before."""
        self.topics.offer(table)
        self.services.table = table
        self.parameters.offer(table.parameters)

    def tell_once(self, peer: str, kind: str, text: str) -> None:
        """Warn in the log, once for a peer and kind of mistake."""
        if (peer, kind) not in self._told and len(self._told) < MOST_TOLD:
            self._told.add((peer, kind))
            _logger.warning("rosbridge: %s: %s", peer, text)
