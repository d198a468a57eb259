"""A client's subscription of a topic: how often it takes a message, and in which form."""

import asyncio
import functools
from collections import deque

from vrx_mj.errors import CommandError
from vrx_mj.ros.rosbridge.outgoing import Outgoing
from vrx_mj.ros.rosbridge.protocol import Options
from vrx_mj.ros.rosbridge.writing import Parcel

__all__ = ["Subscription"]

MOST_IDS = 256
"""Subscriptions of one topic by one client, at most."""


class Subscription:
    """All of a client's subscriptions of one topic: it gets every message once, as rosbridge_server has it.

    Where they differ, the shortest throttle, queue and fragment count, and png before cbor-raw, cbor and none.
    A throttle without a queue drops what comes too early; with a queue that waits, and the oldest is dropped.
    """

    def __init__(self, topic: str, outgoing: Outgoing) -> None:
        self.topic = topic
        """As the client writes it, which is how it gets its messages."""
        self._outgoing = outgoing
        self._wishes: dict[str, Options] = {}
        self._options = Options()
        self._waiting: deque[Parcel] = deque(maxlen=0)
        self._last = -float("inf")
        self._timer: asyncio.TimerHandle | None = None

    @property
    def used(self) -> bool:
        """Whether any is left."""
        return bool(self._wishes)

    def add(self, identity: str, options: Options) -> None:
        """One more, or other options for one; CommandError: there are too many."""
        if identity not in self._wishes and len(self._wishes) >= MOST_IDS:
            raise CommandError(
                f"subscribe: {self.topic} has {MOST_IDS} subscriptions of this client; no more are accepted"
            )
        self._wishes[identity] = options
        self._choose()

    def remove(self, identity: str | None) -> None:
        """End one, or all."""
        if identity is None:
            self._wishes.clear()
        else:
            self._wishes.pop(identity, None)
        if self._wishes:
            self._choose()
        else:
            self.end()

    def end(self) -> None:
        """Send nothing more."""
        self._waiting.clear()
        self._outgoing.forget(self)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def take(self, parcel: Parcel) -> None:
        """A message was published."""
        now = asyncio.get_running_loop().time()
        if self._timer is None and now - self._last >= self._options.throttle:
            self.send(parcel, now)
        elif self._options.queue:
            self._waiting.append(parcel)
            if self._timer is None:
                self._wait()

    def send(self, parcel: Parcel, now: float) -> None:
        """Send a message whatever the throttle."""
        self._last = now
        chosen = self._options
        make = functools.partial(parcel.frames, self.topic, chosen.compression, chosen.fragment_size)
        self._outgoing.message(self, make, chosen.compression.startswith("cbor"), parcel.weight, chosen.queue)

    def _wait(self) -> None:
        self._timer = asyncio.get_running_loop().call_at(self._last + self._options.throttle, self._due)

    def _due(self) -> None:
        self._timer = None
        if self._waiting:
            self.send(self._waiting.popleft(), asyncio.get_running_loop().time())
        if self._waiting:
            self._wait()

    def _choose(self) -> None:
        wishes = self._wishes.values()
        sizes = [wish.fragment_size for wish in wishes if wish.fragment_size]
        compressions = {wish.compression for wish in wishes}
        self._options = Options(
            throttle=min(wish.throttle for wish in wishes),
            queue=min(wish.queue for wish in wishes),
            fragment_size=min(sizes, default=0),
            compression=next(name for name in ("png", "cbor-raw", "cbor", "none") if name in compressions),
        )
        self._waiting = deque(self._waiting, maxlen=self._options.queue)
