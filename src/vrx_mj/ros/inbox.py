"""What networks bring for the simulation: it is put here by their threads, and taken between two steps."""

import threading
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from vrx_mj.ros.messages import Message
from vrx_mj.ros.offer import Dialect

__all__ = ["Answer", "Call", "Command", "Inbox", "UnknownTopicPublisher"]

LONGEST = 64
"""Messages of one topic and sender that wait, at most: the oldest go first."""
MOST_CALLS = 256
"""Calls of services that wait, at most; more are refused."""
MOST_TOPICS = 4096
"""Pairs of topic and sender of which messages wait, at most."""
MOST_UNKNOWN_PUBLISHERS = 256

Answer = Callable[[Message | None, str], None]
"""Takes the response, or None and why there is none. It is called by the simulation's thread."""


class Command(NamedTuple):
    """A message on one of the table's inputs."""

    topic: str
    message: Message
    sender: str
    """Who sent it, for people: a node's name, or an address."""
    dialect: Dialect = "vrx"
    """Of the table that has the topic."""


class Call(NamedTuple):
    """A call of one of the table's services."""

    service: str
    request: Message
    caller: str
    answer: Answer


class UnknownTopicPublisher(NamedTuple):
    """Somebody publishes on a topic that is none of the table's inputs."""

    topic: str
    type: str
    sender: str
    dialect: Dialect = "vrx"


class Inbox:
    """Bounded, and safe for any number of threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._commands: dict[tuple[str, str], deque[Command]] = {}
        self._calls: deque[Call] = deque()
        self._unknown_publishers: dict[tuple[str, str], UnknownTopicPublisher] = {}
        self.dropped = 0
        """Messages that were thrown away, as they came faster than the simulation takes them."""

    def message(self, topic: str, message: Message, sender: str, dialect: Dialect = "vrx") -> None:
        """A message has come."""
        key = (topic, sender)
        with self._lock:
            if key not in self._commands and len(self._commands) >= MOST_TOPICS:
                self.dropped += 1
                return
            waiting = self._commands.setdefault(key, deque(maxlen=LONGEST))
            self.dropped += len(waiting) == LONGEST
            waiting.append(Command(topic, message, sender, dialect))
        self._arrived.set()

    def call(self, service: str, request: Message, caller: str, answer: Answer) -> None:
        """A service was called; `answer` is called once, now if too many calls wait."""
        with self._lock:
            full = len(self._calls) >= MOST_CALLS
            if not full:
                self._calls.append(Call(service, request, caller, answer))
        if full:
            answer(None, f"{service}: {MOST_CALLS} calls are already waiting")
        self._arrived.set()

    def unknown_publisher(self, topic: str, type_name: str, sender: str, dialect: Dialect = "vrx") -> None:
        """Somebody publishes, or tries to, on a topic that nobody here listens to."""
        with self._lock:
            if len(self._unknown_publishers) < MOST_UNKNOWN_PUBLISHERS:
                self._unknown_publishers[topic, sender] = UnknownTopicPublisher(topic, type_name, sender, dialect)

    def wait(self, seconds: float) -> bool:
        """Wait until something came, or so long [s]; whether something came."""
        return self._arrived.wait(seconds)

    @property
    def pending(self) -> bool:
        """Whether something waits."""
        return self._arrived.is_set()

    def drain(self) -> tuple[list[Command], list[Call], list[UnknownTopicPublisher]]:
        """Take all that came: of every topic and sender in the order in which it did."""
        with self._lock:
            self._arrived.clear()
            commands = [command for waiting in self._commands.values() for command in waiting]
            calls, unknown_publishers = list(self._calls), list(self._unknown_publishers.values())
            self._commands.clear()
            self._calls.clear()
            self._unknown_publishers.clear()
        return commands, calls, unknown_publishers
