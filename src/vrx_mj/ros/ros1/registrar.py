"""What is to be registered with the master, and making it so again whenever the master has lost it."""

import asyncio
import contextlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from vrx_mj.ros.ros1.http import BROKEN
from vrx_mj.ros.ros1.link import Link, Request
from vrx_mj.ros.ros1.notices import Notices
from vrx_mj.ros.ros1.xmlrpc import Fault

__all__ = ["Registrar", "State"]

PERIOD = 2.0
"""Wall time between two looks at what the master knows [s]."""
SOONEST = 0.25
"""And at least, however often the master changes."""
CLOSING = 1.0
"""Wall time to take all back at the end [s]."""
SLOW = 30.0
"""Wall time for a portion of the parameters: roscore takes a second for some MB of a robot's description [s]."""
PORTION = 1 << 17
"""Bytes of parameters that are sent together, about."""
METHODS = {"publisher": "Publisher", "subscriber": "Subscriber", "service": "Service"}
State = list[dict[str, list[str]]]
"""Nodes by name: of publishers, of subscribers, of services."""
Key = tuple[str, str]


class Registrar:
    """Keeps the master's knowledge equal to `wished` and `parameters`."""

    def __init__(self, node: str, uri: str, link: Link, notices: Notices) -> None:
        self.node, self.uri = node, uri
        self.link, self.notices = link, notices
        self.wished: dict[Key, list[str]] = {}
        """Kind and name: the values of the call that registers it, after the node's name and its own."""
        self.parameters: dict[str, Any] = {}
        self.wake = asyncio.Event()
        self.settled = asyncio.Event()
        """Set when all is as wished."""
        self.publishers: Callable[[str, Sequence[str]], None] = lambda topic, uris: None
        """Takes a topic that we listen to, and its publishers' URIs."""
        self.seen: Callable[[State], None] = lambda state: None
        """Takes what the master knows now and again."""
        self.api = ""
        """The node's own URI."""
        self.replaced: Callable[[str], None] = lambda reason: None
        """Called when another node of the same name has registered."""
        self._done: dict[Key, list[str]] = {}
        self._set: dict[str, Any] = {}
        self._is_lost = False

    async def run(self) -> None:
        """Do it until another node of the same name has taken over."""
        loop = asyncio.get_running_loop()
        looked = -SOONEST
        while True:
            self.wake.clear()
            pause = PERIOD
            try:
                await self._settle()
                if loop.time() - looked >= SOONEST:
                    looked = loop.time()
                    self._look(await self._state())
                    if await self._is_replaced():
                        return
                else:
                    pause = SOONEST
                self._found()
            except (*BROKEN, Fault) as error:
                self._missed(error)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(pause):
                    await self.wake.wait()

    async def withdraw(self) -> None:
        """Take all back, as far as the master answers in time."""
        calls = [self._call("unregister", key, values) for key, values in self._done.items()]
        calls += [("deleteParam", (self.node, name)) for name in self._set]
        self.wished, self._done, self.parameters, self._set = {}, {}, {}, {}
        try:
            async with asyncio.timeout(CLOSING):
                await self.link.many(calls)
        except (*BROKEN, Fault):
            pass  # it is gone, and has forgotten us with all else
        self.link.close()

    async def _settle(self) -> None:
        while self._done != self.wished or self._set != self.parameters:
            self.settled.clear()
            wished, parameters = dict(self.wished), dict(self.parameters)
            gone = [key for key, values in self._done.items() if wished.get(key) != values]
            lost = [name for name in self._set if name not in parameters]
            await self.link.many(
                [self._call("unregister", key, self._done[key]) for key in gone]
                + [("deleteParam", (self.node, name)) for name in lost]
            )
            self._set = {name: value for name, value in self._set.items() if name in parameters}
            for some in _portions({n: value for n, value in parameters.items() if self._set.get(n, self) != value}):
                await self.link.many([("setParam", (self.node, *pair)) for pair in some.items()], SLOW)
                self._set |= some
            keys = [key for key, values in wished.items() if self._done.get(key) != values]
            replies = await self.link.many([self._call("register", key, wished[key]) for key in keys])
            self._done = wished
            for (kind, name), reply in zip(keys, replies, strict=True):
                self._registered(kind, name, reply)
        self.settled.set()

    def _registered(self, kind: str, name: str, reply: Any) -> None:
        if reply is None:
            self.notices.tell("ERROR", "register", name, f"the master at {self.uri} does not register {kind} {name}")
        elif kind == "subscriber" and isinstance(reply, list):
            self.publishers(name, [uri for uri in reply if isinstance(uri, str)])

    def _call(self, verb: str, key: Key, values: list[str]) -> Request:
        kind, name = key
        if verb == "unregister":
            values = values[:1] if kind == "service" else values[-1:]
        return f"{verb}{METHODS[kind]}", (self.node, name, *values)

    async def _state(self) -> State:
        (raw,) = await self.link.many([("getSystemState", (self.node,))])
        try:
            return [{str(name): [str(node) for node in nodes] for name, nodes in part} for part in raw]
        except (TypeError, ValueError):
            raise ConnectionError("the master does not report its state") from None

    def _look(self, state: State) -> None:
        """What of ours the master does not know any more has to be registered again."""
        known = dict(zip(METHODS, state, strict=False))
        missing = [key for key in self._done if self.node not in known.get(key[0], {}).get(key[1], [])]
        for key in missing:
            del self._done[key]
        if missing:
            self._set = {}  # a master that was started anew has no parameters either
            self.wake.set()
        self.seen(state)

    async def _is_replaced(self) -> bool:
        """Whether the master has another node of our name: what is missing is then not to be registered again."""
        if self._done == self.wished:
            return False
        (api,) = await self.link.many([("lookupNode", (self.node, self.node))])
        if api is None or api == self.api:
            return False
        self._done, self._set = {}, {}
        self.replaced(f"another node {self.node}, at {str(api)[:100]}, has taken its place")
        return True

    def forget(self, topic: str) -> None:
        """Ask for the publishers of a topic again."""
        if self._done.pop(("subscriber", topic), None) is not None:
            self.wake.set()

    def _missed(self, error: Exception) -> None:
        if not self._is_lost:
            self.notices.forget("found", self.uri)
            text = f"the master at {self.uri} does not answer ({str(error) or type(error).__name__}): trying again"
            self.notices.tell("ERROR", "lost", self.uri, text)
        self._is_lost = True

    def _found(self) -> None:
        if self._is_lost:
            self.notices.forget("lost", self.uri)
            self.notices.tell("INFO", "found", self.uri, f"the master at {self.uri} answers again")
        self._is_lost = False


def _portions(parameters: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The parameters in portions of a size that a master can take in time."""
    portion: dict[str, Any] = {}
    size = 0
    for name, value in parameters.items():
        size += len(repr(value))
        if portion and size > PORTION:
            yield portion
            portion, size = {}, len(repr(value))
        portion[name] = value
    if portion:
        yield portion
