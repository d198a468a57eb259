"""The limits of every wire: connections, bytes that come and wait, and shares of the time."""

import contextlib
import itertools
import threading
from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from vrx_mj.errors import CommandError
from vrx_mj.ros.network import is_loopback
from vrx_mj.unix import resource

SMALL = 1 << 16
"""Bytes that a connection may always hold, even if others hold more."""
_MOST_CONNECTIONS = 4096
"""Largest number of connections."""
_MAX_USED_SHARE = 7 / 8
"""Largest share of the places that connections in use may have."""
_SPARE_FILES = 600
"""Number of open files left for everything else, among it rosbridge's clients, where a process may have so many."""
MOST_WAITING = 64
"""Largest number of messages of a topic, and of a topic and sender, that wait for another thread."""
_MOST_KEYS = 4096
"""Largest number of topics, or pairs of topic and sender, whose messages wait."""
MOST_BYTES = 16 << 20
"""Largest size of what waits in an outbox, except for one message that is larger [bytes]."""
MOST_BYTES_OF_ALL = 128 << 20
"""Largest size of what waits in all outboxes of a wire [bytes]."""


class Place:
    """Share of one connection in everything that is bounded."""

    __slots__ = ("end", "host")

    def __init__(self, host: str, end: Callable[[], object]) -> None:
        self.host = host
        """The peer's address."""
        self.end = end
        """Closes the connection at once."""


class Intake:
    """Bytes that have come and are not done with, of all connections together.

    Only what came counts, whatever was announced. Where it is too much, the host that holds most has to give: of its
    connections that which holds more than a little for longest.
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self.used = 0
        self._held: dict[Place, int] = {}
        """Bytes held by each connection; those that began to hold something first come first."""

    def hold(self, place: Place, size: int) -> None:
        """A connection now holds so many bytes.

        Raises:
            CommandError: all hold too much, and this one has to go.
        """
        self.used += size - self._held.get(place, 0)
        if size:
            self._held[place] = size
        else:
            self._held.pop(place, None)
        while self.used > self.most:
            victim = self._victim()
            self.hold(victim, 0)
            if victim is place:
                raise CommandError(f"more than {self.most} bytes of incomplete messages")
            victim.end()

    def _victim(self) -> Place:
        totals: Counter[str] = Counter()
        for place, size in self._held.items():
            totals[place.host] += size
        ((host, _),) = totals.most_common(1)
        held = {place: size for place, size in self._held.items() if place.host == host}
        return next((place for place, size in held.items() if size > SMALL), next(iter(held)))


class ConnectionLimit:
    """How many connections there may be, in all and per host.

    Those that wait for their peers make room for new ones, the longest waiting first: a peer that connects and sends
    nothing, or sends slowly, keeps nobody out. Those in use stay, but never have all places, so that somebody new
    can always ask. Hosts other than this one share half of the places, a quarter each.
    """

    def __init__(self, most: int | None = None) -> None:
        self.most = _most_connections() if most is None else most
        self.inside: Counter[str] = Counter()
        """Connections by host."""
        self._in_use: Counter[str] = Counter()
        self._places: dict[Place, bool] = {}
        """Whether each is in use; of the others the longest waiting one comes first."""

    def enter(self, place: Place) -> bool:
        """Admit a connection, which waits for its peer; return whether there was room."""
        while (crowd := self._crowd(place.host, self.inside, 1.0)) is not None:
            if not self._make_room(crowd):
                return False
        self.inside[place.host] += 1
        self._places[place] = False
        return True

    def wait(self, place: Place) -> None:
        """Mark a connection as the last that began to wait for its peer."""
        if self._places.get(place) is False:
            self._places[place] = self._places.pop(place)

    def settle(self, place: Place) -> bool:
        """Mark a connection as in use; False: too many are."""
        if self._places.get(place) is not False or not self.has_room(place):
            return False
        self._places[place] = True
        self._in_use[place.host] += 1
        return True

    def has_room(self, place: Place) -> bool:
        """Whether one more may be in use."""
        return self._crowd(place.host, self._in_use, _MAX_USED_SHARE) is None

    def leave(self, place: Place) -> None:
        """Free the place of a connection that has gone; nothing happens if it is free already."""
        if place not in self._places:
            return
        self._in_use[place.host] -= self._places.pop(place)
        self.inside[place.host] -= 1
        if not self.inside[place.host]:
            del self.inside[place.host], self._in_use[place.host]

    def _crowd(self, host: str, counts: Mapping[str, int], share: float) -> list[str] | None:
        """Hosts that have all that they may of a share of the places, where one more of `host` would be too much."""
        most = share * self.most
        others = [name for name in counts if not is_loopback(name)]
        if not is_loopback(host) and counts.get(host, 0) >= most // 4:
            return [host]
        if not is_loopback(host) and sum(counts[name] for name in others) >= most // 2:
            return others
        return list(counts) if sum(counts.values()) >= int(most) else None

    def _make_room(self, hosts: Sequence[str]) -> bool:
        """End the connection that waits for longest, of the host that has most; False: none waits."""
        waiting = [place for place, in_use in self._places.items() if not in_use and place.host in hosts]
        if not waiting:
            return False
        place = max(waiting, key=lambda place: self.inside[place.host])
        self.leave(place)
        place.end()
        return True


def _most_connections() -> int:
    """Connections that the process may have open; where it may have few files, it takes the leave that it can get."""
    if resource is None:
        return _MOST_CONNECTIONS
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= soft < _MOST_CONNECTIONS + _SPARE_FILES:  # 1024 as a rule: two recorders of twenty boats have more topics
        soft = _MOST_CONNECTIONS + _SPARE_FILES if hard < 0 else min(hard, _MOST_CONNECTIONS + _SPARE_FILES)
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return min(_MOST_CONNECTIONS, max(soft - _SPARE_FILES, soft // 2)) if soft >= 0 else _MOST_CONNECTIONS


class Pace:
    """Says how long to wait before the next message or call is taken, so that others get their share of the time.

    A burst goes at once. Those that have used up theirs share what all of them may take; others are not held up.
    """

    def __init__(self, share: float, burst: float, flooding: set["Pace"] | None = None) -> None:
        """`share`: of the time, in the long run; `burst`: seconds at once; `flooding`: who shares that with it."""
        self._share, self._burst = share, burst
        self._flooding = set() if flooding is None else flooding
        self._debt = self._paid = 0.0

    def wait(self, spent: float, now: float) -> float:
        """How long to wait [s] at a moment, now that a message took so long [s]."""
        share = self._share / len(self._flooding | {self})
        self._debt = max(0.0, self._debt - share * (now - self._paid)) + spent
        self._paid = now
        if self._debt > self._burst:
            self._flooding.add(self)
        else:
            self._flooding.discard(self)
        return max(0.0, (self._debt - self._burst) / share)

    def end(self) -> None:
        """Forget what has gone: others get its share."""
        self._flooding.discard(self)


_Item = TypeVar("_Item")


class Mailbox(Generic[_Item]):
    """Items on their way to another thread: of each key the newest, in the order in which they came."""

    def __init__(self, key: Callable[[_Item], Hashable]) -> None:
        """`key`: gives what of so many items wait at most, as the topic of a message."""
        self._key = key
        self._lock = threading.Lock()
        self._waiting: dict[Hashable, deque[tuple[int, _Item]]] = {}
        self._numbers = itertools.count()
        self.dropped = 0
        """Items thrown away because more came than were taken."""

    def put(self, items: Iterable[_Item]) -> bool:
        """Add items; whether none waited before."""
        with self._lock:
            was_empty = not self._waiting
            for item in items:
                key = self._key(item)
                if key not in self._waiting and len(self._waiting) >= _MOST_KEYS:
                    self.dropped += 1
                    continue
                queue = self._waiting.setdefault(key, deque(maxlen=MOST_WAITING))
                self.dropped += len(queue) == MOST_WAITING
                queue.append((next(self._numbers), item))
            return was_empty and bool(self._waiting)

    def take(self) -> list[_Item]:
        """Take all that wait."""
        with self._lock:
            waiting, self._waiting = self._waiting, {}
        return [item for _, item in sorted(itertools.chain.from_iterable(waiting.values()), key=lambda pair: pair[0])]


@dataclass(slots=True)
class Counts:
    """Bytes sent and waiting on a wire, and messages dropped."""

    sent: int = 0
    """Bytes sent."""
    dropped: int = 0
    """Messages thrown away because a client did not keep up."""
    waiting: int = 0
    """Bytes that wait."""


class Outbox(Generic[_Item]):
    """Bounded queue for a slow receiver: the oldest is dropped first, and the newest is always kept."""

    def __init__(self, counts: Counts, most: int, filled: Callable[[], object]) -> None:
        """`most`: messages that wait, at most; `filled`: called when there is one more."""
        self._counts, self._most, self._filled = counts, most, filled
        self._waiting: deque[tuple[_Item, int, object]] = deque()
        self.bytes = self.dropped = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def has_room(self, size: int) -> bool:
        """Whether an item of so many bytes can be added, and nothing thrown away for it."""
        return not self._waiting or not self._is_over(1, size)

    def push(self, item: _Item, size: int, source: object = None, most: int = 0) -> None:
        """Add the newest, of so many bytes; of its `source` at most so many wait, 0: as many as there is room for."""
        if most and sum(other is source for _, _, other in self._waiting) >= most:
            self._drop(next(index for index, (_, _, other) in enumerate(self._waiting) if other is source))
        self._waiting.append((item, size, source))
        self._add(size)
        while len(self._waiting) > 1 and self._is_over():
            self._drop(0)
        self._filled()

    def pop(self) -> _Item | None:
        """Take the oldest."""
        if not self._waiting:
            return None
        item, size, _ = self._waiting.popleft()
        self._add(-size)
        return item

    def forget(self, source: object = None) -> None:
        """Throw away what waits of a source, uncounted: nobody is there to get it."""
        self._waiting = deque(waiting for waiting in self._waiting if waiting[2] is not source)
        self._add(sum(size for _, size, _ in self._waiting) - self.bytes)

    def _is_over(self, count: int = 0, size: int = 0) -> bool:
        """Whether there is too much, with so many items and bytes more."""
        crowded = self.bytes + size > MOST_BYTES or self._counts.waiting + size > MOST_BYTES_OF_ALL
        return crowded or len(self._waiting) + count > self._most

    def _add(self, size: int) -> None:
        self.bytes += size
        self._counts.waiting += size

    def _drop(self, index: int) -> None:
        self._add(-self._waiting[index][1])
        del self._waiting[index]
        self.dropped += 1
        self._counts.dropped += 1


Frame = Sequence[bytes]
"""A frame of a websocket, in parts that other frames may share."""


def pieces(frame: Frame, size: int) -> Iterator[bytes]:
    """A frame in pieces of at most so many bytes."""
    return (part[start : start + size] for part in frame for start in range(0, len(part), size))
