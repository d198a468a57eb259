"""Finding the master or being it, and keeping there what is registered."""

import asyncio
import contextlib
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.limits import ConnectionLimit
from vrx_mj.ros.network import (
    Names,
    Notices,
    addresses,
    announced_address,
    is_local,
    is_loopback,
    listening_addresses,
    shown_process,
    who_listens,
)
from vrx_mj.ros.ros1.connection import HttpServer
from vrx_mj.ros.ros1.master import Master
from vrx_mj.ros.ros1.xmlrpc import ANSWER_TIMEOUT, CALL_ERRORS, Proxy, address, ask

_MOST_AT_ONCE = 100
"""Largest number of calls that are sent together."""
_Request = tuple[str, Sequence[object]]
"""Method and values."""
MASTER_TIMEOUT = 3.0
"""Longest wall time that a master may take to answer [s]."""
_PARAMETERS = {"/rosdistro": "noetic\n", "/rosversion": "1.16.0\n"}
"""Parameters that roscore sets and tools read."""
_CHECK_PERIOD = 2.0
"""Wall time between two checks of what the master knows [s]."""
_MIN_CHECK_PERIOD = 0.25
"""Least wall time between two such checks [s]."""
_WITHDRAW_TIMEOUT = 1.0
"""Wall time to withdraw everything at the end [s]."""
_PORTION_TIMEOUT = 30.0
"""Wall time for a portion of the parameters [s]: roscore takes a second for some MB of a robot's description."""
PORTION = 1 << 17
"""Approximate size of the parameters that are sent together [bytes]."""
_METHODS = {"publisher": "Publisher", "subscriber": "Subscriber", "service": "Service"}
"""Ends of the names of the master's methods, by kind."""


class Link:
    """The way to a master, of this process or of another one."""

    def __init__(self, uri: str, master: Master | None = None) -> None:
        self._proxy, self._master = Proxy(uri), master
        self._takes_many = True

    async def many(self, requests: Sequence[_Request], timeout: float = ANSWER_TIMEOUT) -> list[object]:
        """The value of each call; None where it failed. OSError and so on: the master cannot be reached."""
        if self._master is not None:
            return [_value(list(self._master.call(method, values))) for method, values in requests]
        values: list[object] = []
        for start in range(0, len(requests), _MOST_AT_ONCE):
            values += await self._some(requests[start : start + _MOST_AT_ONCE], timeout)
        return values

    def close(self) -> None:
        """Close the connection."""
        self._proxy.close()

    async def _some(self, requests: Sequence[_Request], timeout: float) -> list[object]:
        if self._takes_many and len(requests) > 1:
            calls = [{"methodName": method, "params": list(values)} for method, values in requests]
            try:
                answers = await self._proxy.call("system.multicall", calls, timeout=timeout)
            except Fault:
                self._takes_many = False  # masters that are not in Python may not have it
            else:
                if not isinstance(answers, list) or len(answers) != len(requests):
                    raise CommandError("the master does not answer system.multicall as ROS does")
                return [_value(answer[0] if isinstance(answer, list) and answer else None) for answer in answers]
        return [await self._one(method, values, timeout) for method, values in requests]

    async def _one(self, method: str, values: Sequence[object], timeout: float) -> object:
        try:
            return _value(await self._proxy.call(method, *values, timeout=timeout))
        except Fault:
            return None


def _value(reply: object) -> object:
    """The value of a reply of code, text and value; None if the code is another than success."""
    return reply[2] if isinstance(reply, list) and len(reply) == 3 and reply[0] == 1 else None


@dataclass
class MasterAccess:
    """The master that we are on."""

    host: str
    link: Link
    names: Names
    """Names of this machine."""
    master: Master | None = None
    """If it is our own."""
    server: HttpServer | None = None

    async def close(self) -> None:
        """Leave it, and end it if it is our own."""
        self.link.close()
        if self.master is not None:
            await self.master.close()
        if self.server is not None:
            await self.server.close()


async def open_master(
    graph: Graph, uri: str, host: str, connection_limit: ConnectionLimit, names: Names
) -> MasterAccess:  # fmt: skip
    """Find the master at a URI, or be the master if nothing answers there and the URI is on this machine.

    Raises:
        NetworkError: no master answers and none can be started, something else answers there, or a node of our name is
            alive on it.
    """
    try:
        where, port = address(uri)
    except CommandError as error:
        raise NetworkError(f"ROS_MASTER_URI: {error}") from None
    try:
        await ask(uri, "hasParam", graph.node, "/rosdistro", timeout=MASTER_TIMEOUT)  # a node has no such method
    except ConnectionRefusedError:
        master, hosts = _own(graph, uri, where, port, host)
        server = HttpServer("master", master.answer, connection_limit, graph.notices, names)
        await _listen(server, hosts, where, port)
        master.start()
        return MasterAccess(where, Link(uri, master), names, master, server)
    except OSError as error:
        raise NetworkError(f"no ROS master at {uri}: {str(error) or 'no answer'}{_who(where, port)}") from None
    except (*CALL_ERRORS, Fault) as error:
        raise NetworkError(f"the server at {uri} is not a ROS master: {error}{_who(where, port)}") from None
    await _refuse_second(uri, graph.node)
    return MasterAccess(where, Link(uri), names)


def is_ours(host: str, listening: Sequence[str]) -> bool:
    """Whether a host, as others resolve it, leads to where we listen."""
    targets = addresses(host)
    return not targets or listening == ["0.0.0.0"] or any(target in listening for target in targets)


def _own(graph: Graph, uri: str, where: str, port: int, host: str) -> tuple[Master, list[str]]:
    """A master of our own, and the addresses at which it is to listen."""
    if not is_local(where):
        raise NetworkError(
            f"no ROS master answers at {uri}, and {where} is another machine: start roscore there, or unset "
            "ROS_MASTER_URI to start a master here"
        )
    hosts = listening_addresses(host)
    if hosts != ["0.0.0.0"]:  # a machine's own name is 127.0.1.1 where Debian has put it into /etc/hosts
        hosts += [one for one in addresses(where) if is_loopback(one) and one not in hosts]
    if not is_ours(where, hosts):
        raise NetworkError(
            f"no ROS master answers at {uri}, and this server listens at {', '.join(hosts)} only: "
            f"give --host {where} or --host 0.0.0.0"
        )
    known = announced_address(host, where) if is_loopback(where) else where
    for name, value in {**_PARAMETERS, "/run_id": str(uuid.uuid4())}.items():
        graph.set_parameter(name, value, graph.node)
    return Master(graph, f"http://{known}:{port}/"), hosts


async def _listen(server: HttpServer, hosts: Sequence[str], where: str, port: int) -> None:
    try:
        await server.start(hosts, port)
    except OSError as error:
        await server.close()
        raise NetworkError(f"ROS 1: cannot open port {port} for the master: {error}{_who(where, port)}") from None


async def _refuse_second(uri: str, node: str) -> None:
    """A node of our name that is alive is not to be taken over."""
    try:
        api = str(await ask(uri, "lookupNode", node, node, timeout=MASTER_TIMEOUT))
        pid = await ask(api, "getPid", node, timeout=MASTER_TIMEOUT)
        where, _ = address(api)
    except (*CALL_ERRORS, Fault):
        return  # no node of our name, or it has died, and its registration has stayed
    about = shown_process(pid) if is_local(where) and isinstance(pid, int) else f"pid {pid} on {where}"
    raise NetworkError(f"a simulation is already served there: node {node}, {about}, or with: rosnode kill {node}")


def _who(where: str, port: int) -> str:
    """Which process holds the port, as far as it can be found."""
    holder = who_listens(port) if is_local(where) else None
    return "" if holder is None else f"; port {port} is held by {holder}"


SystemState = list[dict[str, list[str]]]
"""Nodes by name: of publishers, of subscribers, of services."""
_Key = tuple[str, str, str]


class Registrar:
    """Keeps the master's knowledge equal to what is wished: nothing of our own master, which shows the graph itself."""

    def __init__(self, node: str, uri: str, link: Link, notices: Notices) -> None:
        self.node, self.uri = node, uri
        self.link, self.notices = link, notices
        self.wished: Callable[[], dict[_Key, list[str]]] = dict
        """Gives by node, kind and name the values of the call that registers it, after the node's name and its own."""
        self.parameters: Callable[[], Mapping[str, Any]] = dict
        """Gives what is to be set, by absolute name."""
        self.wake = asyncio.Event()
        self.settled = asyncio.Event()
        """Set when all is as wished."""
        self.publishers: Callable[[str, Sequence[str]], None] = lambda topic, uris: None
        """Takes a topic that we listen to, and its publishers' URIs."""
        self.seen: Callable[[SystemState, Mapping[str, str]], None] = lambda state, types: None
        """Takes what the master knows now and again, and the types of topics."""
        self.api = ""
        """The node's own URI."""
        self.replaced: Callable[[str], None] = lambda reason: None
        """Called when another node of the same name has registered."""
        self._done: dict[_Key, list[str]] = {}
        self._set: dict[str, Any] = {}
        self._is_lost = False

    async def run(self) -> None:
        """Keep the registrations until another node of the same name has taken over."""
        loop = asyncio.get_running_loop()
        looked = -_MIN_CHECK_PERIOD
        while True:
            self.wake.clear()
            pause = _CHECK_PERIOD
            try:
                await self._settle()
                if loop.time() - looked >= _MIN_CHECK_PERIOD:
                    looked = loop.time()
                    self._look(*await self._state())
                    if await self._is_replaced():
                        return
                else:
                    pause = _MIN_CHECK_PERIOD
                if self._is_lost:
                    self.notices.forget("lost", self.uri)
                    self.notices.write("INFO", "found", self.uri, f"the master at {self.uri} answers again")
                self._is_lost = False
            except (*CALL_ERRORS, Fault) as error:
                self._note_loss(error)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(pause):
                    await self.wake.wait()

    async def withdraw(self) -> None:
        """Take all back, as far as the master answers in time."""
        calls = [self._call("unregister", key, values) for key, values in self._done.items()]
        calls += [("deleteParam", (self.node, name)) for name in self._set]
        self.wished, self._done, self.parameters, self._set = dict, {}, dict, {}
        try:
            async with asyncio.timeout(_WITHDRAW_TIMEOUT):
                await self.link.many(calls)
        except (*CALL_ERRORS, Fault):
            pass  # it is gone, and has forgotten us with all else
        self.link.close()

    async def _settle(self) -> None:
        while True:
            wished, parameters = self.wished(), dict(self.parameters())
            if (wished, parameters) == (self._done, self._set):
                self.settled.set()
                return
            self.settled.clear()
            gone = [key for key, values in self._done.items() if wished.get(key) != values]
            lost = [name for name in self._set if name not in parameters]
            await self.link.many(
                [self._call("unregister", key, self._done[key]) for key in gone]
                + [("deleteParam", (self.node, name)) for name in lost]
            )
            self._set = {name: value for name, value in self._set.items() if name in parameters}
            for some in _portions({n: value for n, value in parameters.items() if self._set.get(n, self) != value}):
                await self.link.many([("setParam", (self.node, *pair)) for pair in some.items()], _PORTION_TIMEOUT)
                self._set |= some
            keys = [key for key, values in wished.items() if self._done.get(key) != values]
            replies = await self.link.many([self._call("register", key, wished[key]) for key in keys])
            self._done = wished
            for (_, kind, name), reply in zip(keys, replies, strict=True):
                self._take_reply(kind, name, reply)

    def _take_reply(self, kind: str, name: str, reply: object) -> None:
        if reply is None:
            self.notices.write("ERROR", "register", name, f"the master at {self.uri} does not register {kind} {name}")
        elif kind == "subscriber" and isinstance(reply, list):
            self.publishers(name, [uri for uri in reply if isinstance(uri, str)])

    def _call(self, verb: str, key: _Key, values: list[str]) -> _Request:
        node, kind, name = key
        if verb == "unregister":
            values = values[:1] if kind == "service" else values[-1:]
        return f"{verb}{_METHODS[kind]}", (node, name, *values)

    async def _state(self) -> tuple[SystemState, dict[str, str]]:
        raw: Any
        pairs: Any
        raw, pairs = await self.link.many([("getSystemState", (self.node,)), ("getTopicTypes", (self.node,))])
        try:
            state = [{str(name): [str(node) for node in nodes] for name, nodes in part} for part in raw]
            return state, {str(name): str(kind) for name, kind in pairs or ()}
        except (TypeError, ValueError):
            raise ConnectionError("the master does not report its state") from None

    def _look(self, state: SystemState, types: Mapping[str, str]) -> None:
        """Register again whatever of ours the master does not know any more."""
        known = dict(zip(_METHODS, state, strict=False))
        missing = [key for key in self._done if key[0] not in known.get(key[1], {}).get(key[2], [])]
        for key in missing:
            del self._done[key]
        if missing:
            self._set = {}  # a master that was started anew has no parameters either
            self.wake.set()
        self.seen(state, types)

    async def _is_replaced(self) -> bool:
        """Whether the master has another node of our name: what is missing is then not to be registered again."""
        if self._done == self.wished():
            return False
        (api,) = await self.link.many([("lookupNode", (self.node, self.node))])
        if api is None or api == self.api:
            return False
        self._done, self._set = {}, {}
        self.replaced(f"another node {self.node}, at {str(api)[:100]}, has taken its place")
        return True

    def forget(self, topic: str) -> None:
        """Ask for the publishers of a topic again."""
        for key in [key for key in self._done if key[1:] == ("subscriber", topic)]:
            del self._done[key]
            self.wake.set()

    def _note_loss(self, error: Exception) -> None:
        if not self._is_lost:
            self.notices.forget("found", self.uri)
            text = f"the master at {self.uri} does not answer ({str(error) or type(error).__name__}): trying again"
            self.notices.write("ERROR", "lost", self.uri, text)
        self._is_lost = True


def _portions(parameters: dict[str, object]) -> Iterator[dict[str, object]]:
    """The parameters in portions of a size that a master can take in time."""
    portion: dict[str, object] = {}
    size = 0
    for name, value in parameters.items():
        size += len(repr(value))
        if portion and size > PORTION:
            yield portion
            portion, size = {}, len(repr(value))
        portion[name] = value
    if portion:
        yield portion
