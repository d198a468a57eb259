"""The limits of every wire: connections, bytes that come and wait, and shares of the time."""

import asyncio
import contextlib
import itertools
import threading
from collections import Counter, OrderedDict, deque
from collections.abc import Awaitable, Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from vrx_mj.errors import CommandError
from vrx_mj.ros.access import is_loopback
from vrx_mj.ros.interface import Sent
from vrx_mj.unix import resource

SMALL = 1 << 16
"""Bytes that a connection may hold while others hold more."""


class Place:
    """What one connection takes of what is bounded."""

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
        self._held: dict[str, OrderedDict[Place, int]] = {}
        """By host, those that began to hold something first come first."""
        self._totals: Counter[str] = Counter()

    def hold(self, place: Place, size: int) -> None:
        """A connection now holds so many bytes.

        Raises:
            CommandError: all hold too much, and this one has to go.
        """
        held = self._held.setdefault(place.host, OrderedDict())
        change = size - held.get(place, 0)
        self.used += change
        self._totals[place.host] += change
        if size:
            held[place] = size
        else:
            held.pop(place, None)
            if not held:
                del self._held[place.host], self._totals[place.host]
        while self.used > self.most:
            victim = self._victim()
            self.hold(victim, 0)
            if victim is place:
                raise CommandError(f"more than {self.most} bytes of incomplete messages")
            victim.end()

    def _victim(self) -> Place:
        host = max(self._totals, key=lambda name: self._totals[name])
        held = self._held[host]
        return next((place for place, size in held.items() if size > SMALL), None) or next(iter(held))


MOST_CONNECTIONS = 4096
IN_USE = 7 / 8
"""Share of the places that connections in use may have, at most."""
SPARE_FILES = 200
"""Open files that are left to everything else."""


class ConnectionLimit:
    """How many connections there may be, in all and per host.

    Those that wait for their peers make room for new ones, the longest waiting first: a peer that connects and sends
    nothing, or sends slowly, keeps nobody out. Those in use stay, but never have all places, so that somebody new
    can always ask. Hosts other than this one share half of the places, a quarter each.
    """

    def __init__(self, most: int | None = None) -> None:
        self.most = allowed() if most is None else most
        self.inside: Counter[str] = Counter()
        """Connections by host."""
        self._waiting: dict[str, OrderedDict[Place, None]] = {}
        self._used: set[Place] = set()
        self._in_use: Counter[str] = Counter()

    def enter(self, place: Place) -> bool:
        """Let one more in, who waits for its peer, or not."""
        while (crowd := self._crowd(place.host, self.inside, 1.0)) is not None:
            if not self._make_room(crowd):
                return False
        self.inside[place.host] += 1
        self._waiting.setdefault(place.host, OrderedDict())[place] = None
        return True

    def wait(self, place: Place) -> None:
        """From now on it waits for its peer, as the last one to do so."""
        if place in self._waiting.get(place.host, ()):
            self._waiting[place.host].move_to_end(place)

    def settle(self, place: Place) -> bool:
        """From now on it is in use, if so many may be."""
        waiting = self._waiting.get(place.host, OrderedDict())
        if place not in waiting or self._crowd(place.host, self._in_use, IN_USE) is not None:
            return False
        del waiting[place]
        self._used.add(place)
        self._in_use[place.host] += 1
        return True

    def leave(self, place: Place) -> None:
        """One has gone; nothing happens where it has gone already."""
        host = place.host
        if place in self._used:
            self._used.discard(place)
            self._in_use[host] -= 1
        elif place in self._waiting.get(host, ()):
            del self._waiting[host][place]
        else:
            return
        self.inside[host] -= 1
        if not self.inside[host]:
            del self.inside[host], self._waiting[host], self._in_use[host]

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
        crowd = [host for host in hosts if self._waiting.get(host)]
        if not crowd:
            return False
        host = max(crowd, key=lambda name: self.inside[name])
        place = next(iter(self._waiting[host]))
        self.leave(place)
        place.end()
        return True


def allowed() -> int:
    """Connections that the process may have open; where it may have few files, it takes the leave that it can get."""
    if resource is None:
        return MOST_CONNECTIONS
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if 0 <= soft < MOST_CONNECTIONS + SPARE_FILES:  # 1024 as a rule: two recorders of twenty boats have more topics
        soft = MOST_CONNECTIONS + SPARE_FILES if hard < 0 else min(hard, MOST_CONNECTIONS + SPARE_FILES)
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return min(MOST_CONNECTIONS, max(soft - SPARE_FILES, 16)) if soft >= 0 else MOST_CONNECTIONS


MESSAGE_TIMEOUT = 10.0
"""Wall time in which a message must be whole, or have grown [s]."""
LEAST_GROWTH = 1 << 16
"""By so much at least [bytes]."""


class Stall:
    """Ends a connection on which a message that has begun does not go on."""

    def __init__(self, end: Callable[[], object]) -> None:
        self._end = end
        self._timer: asyncio.TimerHandle | None = None
        self._size = 0

    def holds(self, size: int) -> None:
        """So many bytes of an incomplete message are there; 0: none."""
        if size and self._timer is not None and 0 <= size - self._size < LEAST_GROWTH:
            return
        self.stop()
        if size:
            self._size = size
            self._timer = asyncio.get_running_loop().call_later(MESSAGE_TIMEOUT, self._end)

    def stop(self) -> None:
        """Wait for nothing."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


CALLS_SHARE = 0.25
"""Of the wall time that answers may take in the long run."""
CALLS_BURST = 0.5
"""Wall time of answers that are given at once: a launch file or a recorder calls hundreds of times [s]."""


class CallsPace:
    """Says how long to wait before the next call is taken."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._paid_until = clock()

    def wait(self, spent: float) -> float:
        """How long to wait [s], now that an answer took so long [s]."""
        now = self._clock()
        self._paid_until = max(self._paid_until, now) + spent / CALLS_SHARE
        return max(self._paid_until - now - CALLS_BURST / CALLS_SHARE, 0.0)


CLIENTS_SHARE = 0.5
"""Of the time, what the messages of all clients may take in the long run."""
CLIENT_BURST = 0.2
"""What those of one may take at once [s]."""


class ClientPace:
    """One client's part: a flood must not take the interpreter from the simulation, nor the server from other clients.

    Those that have used up their burst share the time; others are not held up.
    """

    def __init__(self, flooding: set["ClientPace"]) -> None:
        self._flooding = flooding
        self._debt = 0.0
        self._paid = 0.0

    async def spent(self, seconds: float) -> None:
        """So much was spent on a message; waits until there is time for another."""
        now = asyncio.get_running_loop().time()
        share = CLIENTS_SHARE / len(self._flooding | {self})
        self._debt = max(0.0, self._debt - share * (now - self._paid)) + seconds
        self._paid = now
        if self._debt > CLIENT_BURST:
            self._flooding.add(self)
        else:
            self._flooding.discard(self)
        await asyncio.sleep(max(0.0, (self._debt - CLIENT_BURST) / share))

    def end(self) -> None:
        """The client has gone."""
        self._flooding.discard(self)


MOST_WAITING = 64
"""Messages of a topic that wait for the network's thread, at most."""
MOST_FRAMES = 256
MOST_FRAME_BYTES = 1 << 24
"""Of one subscriber of TCPROS; a single message may be larger."""
MOST_MESSAGES = 1000
MOST_BYTES = 16 << 20
"""Of a client's messages that wait, but for one that is larger."""
MOST_BYTES_OF_ALL = 128 << 20
"""Of all that wait on a wire."""
MOST_REPLIES = 2000
MOST_REPLY_BYTES = 8 << 20

Item = TypeVar("Item")


class TopicQueue:
    """Messages on their way to another thread: of each topic the newest, in the order in which they came."""

    def __init__(self, most: int = MOST_WAITING) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._waiting: dict[str, deque[tuple[int, Sent]]] = {}
        self._numbers = itertools.count()
        self.dropped = 0

    def put(self, batch: Sequence[Sent]) -> bool:
        """Add messages; whether none waited before."""
        with self._lock:
            was_empty = not self._waiting
            for sent in batch:
                queue = self._waiting.setdefault(sent.output.name, deque(maxlen=self._most))
                self.dropped += len(queue) == self._most
                queue.append((next(self._numbers), sent))
        return was_empty and bool(batch)

    def take(self) -> list[Sent]:
        """Take all that wait."""
        with self._lock:
            waiting, self._waiting = self._waiting, {}
        return [sent for _, sent in sorted(itertools.chain.from_iterable(waiting.values()), key=lambda pair: pair[0])]


@dataclass(slots=True)
class Counts:
    """What has gone on a wire, and what is to go."""

    sent: int = 0
    """[bytes]"""
    dropped: int = 0
    """Messages thrown away because a client did not keep up."""
    waiting: int = 0
    """[bytes]"""


class Backlog(Generic[Item]):
    """What waits for one that does not keep up: bounded, the oldest thrown away first; the newest is always kept."""

    def __init__(self, counts: Counts, most_messages: int, most_bytes: int) -> None:
        self._counts, self._limits = counts, (most_messages, most_bytes)
        self._waiting: deque[tuple[Item, int, object]] = deque()
        self.bytes = self.dropped = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def push(self, item: Item, size: int, source: object = None, most: int = 0) -> None:
        """Add the newest, of so many bytes; of its `source` at most so many wait, 0: as many as there is room for."""
        if most and sum(other is source for _, _, other in self._waiting) >= most:
            self._drop(next(index for index, (_, _, other) in enumerate(self._waiting) if other is source))
        self._waiting.append((item, size, source))
        self._add(size)
        while len(self._waiting) > 1 and self._is_over():
            self._drop(0)

    def pop(self) -> Item | None:
        """Take the oldest."""
        if not self._waiting:
            return None
        item, size, _ = self._waiting.popleft()
        self._add(-size)
        return item

    def forget(self, source: object) -> None:
        """Throw away what waits of a source, uncounted: nobody is there to get it."""
        self._waiting = deque(waiting for waiting in self._waiting if waiting[2] is not source)
        self._add(sum(size for _, size, _ in self._waiting) - self.bytes)

    def _is_over(self) -> bool:
        most_messages, most_bytes = self._limits
        crowded = self.bytes > most_bytes or self._counts.waiting > MOST_BYTES_OF_ALL
        return crowded or len(self._waiting) > most_messages

    def _add(self, size: int) -> None:
        self.bytes += size
        self._counts.waiting += size

    def _drop(self, index: int) -> None:
        self._add(-self._waiting[index][1])
        del self._waiting[index]
        self.dropped += 1
        self._counts.dropped += 1


Frame = Sequence[bytes]
"""Of a websocket, in parts that others may share."""


def pieces(frame: Frame, size: int) -> Iterator[bytes]:
    """A frame in pieces of at most so many bytes."""
    return (part[start : start + size] for part in frame for start in range(0, len(part), size))


class Outgoing:
    """The queue of a client of rosbridge: replies, which are never dropped, go before messages of topics."""

    def __init__(self, counts: Counts) -> None:
        self._counts = counts
        self._replies: deque[tuple[list[Frame], bool]] = deque()
        self._messages: Backlog[tuple[Callable[[], Iterable[Frame]], bool]] = Backlog(counts, MOST_MESSAGES, MOST_BYTES)
        self._reply_bytes = 0
        self._filled = asyncio.Event()

    def reply(self, frames: list[Frame], binary: bool = False) -> bool:
        """Send an answer; False: the client takes none, and has to go."""
        size = _size(frames)
        full = len(self._replies) >= MOST_REPLIES or self._reply_bytes + size > MOST_REPLY_BYTES
        if (full or self._counts.waiting + size > MOST_BYTES_OF_ALL) and self._replies:
            return False
        self._replies.append((frames, binary))
        self._hold(size)
        self._filled.set()
        return True

    def message(
        self, source: object, make: Callable[[], Iterable[Frame]], binary: bool, size: int, most: int = 0
    ) -> None:  # fmt: skip
        """Send a topic's message of about so many bytes, whose frames are made when they can be sent.

        At most so many of its `source` wait; 0: as many as there is room for.
        """
        self._messages.push((make, binary), size, source, most)
        self._filled.set()

    def forget(self, source: object) -> None:
        """Throw away what waits of a subscription that ended."""
        self._messages.forget(source)

    def end(self) -> None:
        """Throw away the answers that wait: the client has gone."""
        self._replies.clear()
        self._hold(-self._reply_bytes)

    async def run(self, send: Callable[[Frame, bool], Awaitable[None]], trouble: Callable[[Exception], None]) -> None:
        """Send for ever: each frame, and whether it is binary; `trouble` takes errors of unwritable messages."""
        while True:
            await self._filled.wait()
            while (following := self._next()) is not None:
                make, binary = following
                try:
                    frames = make()
                except Exception as error:  # a message that is not of its type must not stop the others
                    trouble(error)
                    continue
                del following, make  # of what is being sent there is nothing else
                for frame in frames:
                    await send(frame, binary)
                    self._counts.sent += sum(map(len, frame))
            self._filled.clear()

    def _next(self) -> tuple[Callable[[], Iterable[Frame]], bool] | None:
        if self._replies:
            frames, binary = self._replies.popleft()
            self._hold(-_size(frames))
            return (lambda: frames), binary
        return self._messages.pop()

    def _hold(self, size: int) -> None:
        self._reply_bytes += size
        self._counts.waiting += size


def _size(frames: Iterable[Frame]) -> int:
    return sum(map(len, itertools.chain.from_iterable(frames)))
