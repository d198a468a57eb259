"""A master of ROS 1: the graph as methods by name, each from values to code, text and value."""

import asyncio
import contextlib
import os
import socket
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any
from xmlrpc.client import Fault

from vrx_mj.errors import CommandError
from vrx_mj.ros.graph import Graph, Wire
from vrx_mj.ros.network import end_tasks
from vrx_mj.ros.parameters import MAX_NAME, is_legal, is_type, join_names, resolve, updates
from vrx_mj.ros.ros1.xmlrpc import CALL_ERRORS, LARGEST_REPLY, Proxy, address

_NODE_TIMEOUT = 5.0
"""Longest wall time that a node may take to answer [s]."""
MOST_NODES = 512
"""Largest number of nodes with calls under way; beyond that the calls to the slowest one are dropped."""

_MOST_CALLS = 2000
"""Largest number of calls to one node that wait."""
_REGISTERING = frozenset(
    f"{verb}{what}"
    for verb in ("register", "unregister", "subscribe", "unsubscribe")
    for what in ("Publisher", "Subscriber", "Service", "Param")
)
"""Methods by which a node registers itself."""
SWEEP_PERIOD = 10.0
"""About the wall time of a check of all nodes [s]."""


class Notifier:
    """Per node a list of calls; of calls of one method about one thing only the newest is made."""

    def __init__(self, unreachable: Callable[[str], None]) -> None:
        self._unreachable = unreachable
        self._waiting: dict[str, dict[tuple[str, str], tuple[Any, ...]]] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def notify(self, api: str, method: str, about: str, *values: object) -> None:
        """Arrange a call of a node's method with the caller, the thing and these values."""
        if api not in self._waiting and len(self._waiting) >= MOST_NODES:
            slowest = next(iter(self._waiting))  # others are done within no time
            del self._waiting[slowest]
            self._tasks.pop(slowest).cancel()
        calls = self._waiting.setdefault(api, {})
        if len(calls) < _MOST_CALLS or (method, about) in calls:
            calls[method, about] = (about, *values)
        if api not in self._tasks:
            self._tasks[api] = asyncio.create_task(self._work(api))

    async def close(self) -> None:
        """Stop it all."""
        await end_tasks(self._tasks.values())

    async def _work(self, api: str) -> None:
        proxy = Proxy(api, LARGEST_REPLY)
        calls = self._waiting[api]
        try:
            while calls:
                key = next(iter(calls))
                await proxy.call(key[0], "/master", *calls.pop(key), timeout=_NODE_TIMEOUT)
        except ConnectionRefusedError:
            self._unreachable(api)
        except (*CALL_ERRORS, Fault, TypeError, OverflowError):
            pass  # it does not listen: its other calls are of no use either
        finally:
            proxy.close()
            if self._waiting.get(api) is calls:  # else another task is there in its place, or none
                del self._waiting[api], self._tasks[api]


Reply = tuple[int, str, Any]


class Api:
    """Methods of ROS by name. Each takes the caller and its values, and gives code, text and value."""

    methods: Mapping[str, tuple[str, Callable[..., Reply]]]
    """Methods with their values after the caller: (n)ame, (t)ype, (a)pi, (s)ervice's api, (k)ey, any (v)alue.

    `*` stands for any number of values.
    """

    def refusal(self, method: str, caller: str, host: str) -> str:
        """Why a method is not for a caller at an address; empty if it is."""
        raise NotImplementedError

    def answer(self, method: str, values: Sequence[object], host: str) -> list[object]:
        """The answer to a call from an address; Fault for an unknown method."""
        if method == "system.listMethods":
            return [*self.methods, "system.listMethods", "system.multicall"]
        if method not in self.methods:
            raise Fault(1, f'method "{method[:100]}" is not supported')
        why = self.refusal(method, values[0], host) if values and isinstance(values[0], str) else ""
        return [-1, why, 0] if why else list(self.call(method, values))

    def call(self, method: str, values: Sequence[object]) -> Reply:
        """Code (1 done, 0 failed, -1 wrong call), text and value."""
        kinds, function = self.methods[method]
        if not values or not isinstance(values[0], str) or len(values[0]) > MAX_NAME:
            return -1, f"caller_id must be a string of at most {MAX_NAME} characters", 0
        if kinds == "*":
            return function(*values)
        if len(values) != len(kinds) + 1:
            return -1, "Error: bad call arity", 0
        try:
            checked = [_check_value(kind, value, values[0]) for kind, value in zip(kinds, values[1:], strict=True)]
            return function(values[0], *checked)
        except CommandError as error:
            return -1, str(error), 0


class Master(Api, Wire):
    """The graph for ROS 1's nodes: a wire that calls those whom a change concerns.

    The nodes of this process are registered by this process alone: nobody on the network takes their names, nor takes
    back what they have registered.
    """

    def __init__(self, graph: Graph, uri: str) -> None:
        self.graph, self.uri = graph, uri
        self._sweeper: asyncio.Task[None] | None = None
        self._notifier = Notifier(self._was_refused)
        self.methods = {
            "getPid": ("", lambda _: (1, "", os.getpid())),
            "getUri": ("", lambda _: (1, "", self.uri)),
            "shutdown": ("v", lambda *_: (0, "this master ends with its simulation", 0)),
            "registerPublisher": ("nta", partial(self._register_topic, "publisher", "subscriber")),
            "registerSubscriber": ("nta", partial(self._register_topic, "subscriber", "publisher")),
            "registerService": ("nsa", self._register_service),
            "unregisterPublisher": ("na", partial(self._unregister, "publisher")),
            "unregisterSubscriber": ("na", partial(self._unregister, "subscriber")),
            "unregisterService": ("ns", partial(self._unregister, "service")),
            "lookupNode": ("n", self._lookup_node),
            "lookupService": ("n", self._lookup_service),
            "getPublishedTopics": ("v", self._published_topics),
            "getTopicTypes": (
                "",
                lambda _: (1, "current topics", [[name, kind or "*"] for name, kind in self.graph.topics().items()]),
            ),
            "getSystemState": ("", self._system_state),
            "setParam": ("kv", self._set_parameter),
            "getParam": ("k", self._get_parameter),
            "hasParam": ("k", lambda _, key: (1, key, self.graph.parameters.has(key))),
            "deleteParam": ("k", self._delete_parameter),
            "searchParam": ("v", self._search_parameter),
            "subscribeParam": ("ak", self._subscribe_parameter),
            "unsubscribeParam": ("ak", lambda node, api, key: self._unregister("parameter", node, key, api)),
            "getParamNames": ("", lambda _: (1, "Parameter names", self.graph.parameters.names())),
        }

    def refusal(self, method: str, caller: str, host: str) -> str:
        """Nobody takes the place of the simulation's nodes."""
        own = join_names(caller)
        is_taken = method in _REGISTERING and own in self.graph.local
        return f"ERROR: {own} is the simulation's own node: another name is needed" if is_taken else ""

    def start(self) -> None:
        """Follow the graph's changes, and look after nodes that die."""
        self.graph.wires.append(self)
        self._sweeper = asyncio.create_task(self._sweep())

    async def close(self) -> None:
        """Stop calling nodes."""
        if self in self.graph.wires:
            self.graph.wires.remove(self)
        if self._sweeper is not None:
            await end_tasks([self._sweeper])
        await self._notifier.close()

    def registration_changed(self, kind: str, name: str) -> None:
        """Call the subscribers of a topic whose publishers have changed."""
        if kind == "publisher":
            known = self.graph.registrations
            publishers = known.apis("publisher", name)
            for api in set(known.apis("subscriber", name)) - {self.graph.uri}:
                self._notifier.notify(api, "publisherUpdate", name, publishers)

    def node_replaced(self, node: str, uri: str) -> None:
        """Shut down the node whose name another one has taken."""
        self._notifier.notify(uri, "shutdown", f"[{node}] Reason: new node registered with same name")

    def parameter_changed(self, key: str, value: object, setter: str) -> None:
        """Call the subscribers of a parameter, except the node that has set it."""
        known = self.graph.registrations
        for update in updates(known.names("parameter"), key, value):
            for node, api in known.holders("parameter", update.subscribed).items():
                if node != setter:
                    self._notifier.notify(api, "paramUpdate", update.key, update.value)

    def _register_topic(self, role: str, others: str, node: str, topic: str, kind: str, api: str) -> Reply:
        self.graph.register_remote(role, topic, node, api, kind)
        return 1, f"Registered [{node}] as {role} of [{topic}]", self.graph.registrations.apis(others, topic)

    def _register_service(self, node: str, service: str, service_api: str, api: str) -> Reply:
        self.graph.register_remote("service", service, node, api, service_uri=service_api)
        return 1, f"Registered [{node}] as provider of [{service}]", 1

    def _unregister(self, kind: str, node: str, name: str, api: str) -> Reply:
        count = self.graph.unregister_remote(kind, name, node, api)
        done, none = f"Unregistered [{node}] as provider of [{name}]", f"[{node}] is not a known provider of [{name}]"
        return 1, done if count else none, count

    def _lookup_node(self, _: str, name: str) -> Reply:
        if name in self.graph.local and name != self.graph.node:
            return -1, f"[{name}] is a client of rosbridge, which nobody can call", ""
        api = self.graph.registrations.nodes.get(name)
        return (-1, f"unknown node [{name}]", "") if api is None else (1, "node api", api)

    def _lookup_service(self, node: str, name: str) -> Reply:
        apis = self.graph.registrations.apis("service", name)
        if not apis:
            self.graph.missed_service(name, node)
        return (1, f"rosrpc URI: [{apis[0]}]", apis[0]) if apis else (-1, "no provider", "")

    def _published_topics(self, node: str, subgraph: object) -> Reply:
        if subgraph and not is_legal(subgraph):
            return -1, "ERROR: parameter [subgraph] is not a name", []
        under = f"{resolve(str(subgraph), node)}/" if subgraph and subgraph != "/" else "/"
        names = [name for name in self.graph.registrations.names("publisher") if name.startswith(under)]
        return 1, "current topics", [[name, self.graph.type_of(name) or "*"] for name in names]

    def _system_state(self, _: str) -> Reply:
        state = [self.graph.registrations.state(kind) for kind in ("publisher", "subscriber", "service")]
        return 1, "current system state", state

    def _set_parameter(self, node: str, key: str, value: object) -> Reply:
        self.graph.set_parameter(key, value, node)
        return 1, f"parameter {key} set", 0

    def _get_parameter(self, _: str, key: str) -> Reply:
        value = self.graph.parameters.get(key)
        return (-1, f"Parameter [{key}] is not set", 0) if value is None else (1, f"Parameter [{key}]", value)

    def _delete_parameter(self, _: str, key: str) -> Reply:
        try:
            self.graph.delete_parameter(key)
        except KeyError:
            return -1, f"parameter [{key}] is not set", 0
        return 1, f"parameter {key} deleted", 0

    def _search_parameter(self, node: str, key: object) -> Reply:
        if not isinstance(key, str) or not 0 < len(key) <= MAX_NAME or key.startswith("~"):
            return -1, "ERROR: parameter [key] is not a relative or absolute name", 0
        found = self.graph.parameters.search(node, key)
        return (
            (-1, f"Cannot find parameter [{key}] in an upwards search", "")
            if found is None
            else (1, f"Found [{found}]", found)
        )

    def _subscribe_parameter(self, node: str, api: str, key: str) -> Reply:
        self.graph.register_remote("parameter", key, node, api)
        value = self.graph.parameters.get(key)
        return 1, f"Subscribed to parameter [{key}]", {} if value is None else value

    def _was_refused(self, api: str) -> None:
        """Nobody listens at a node's URI any more: it has died without a word."""
        for node in [name for name, uri in self.graph.registrations.nodes.items() if uri == api]:
            self.graph.forget(node)

    async def _sweep(self) -> None:
        """Look again and again whether nodes still listen, so that those who died are forgotten."""
        while True:
            for api in sorted(set(self.graph.registrations.nodes.values()) - {self.graph.uri}):
                await asyncio.sleep(min(SWEEP_PERIOD / len(self.graph.registrations.nodes or "-"), 1.0))
                with contextlib.suppress(*CALL_ERRORS):
                    await self._visit(api)
            await asyncio.sleep(1.0)

    async def _visit(self, api: str) -> None:
        host, port = address(api)
        try:
            async with asyncio.timeout(1.0):
                _, writer = await asyncio.open_connection(host, port, family=socket.AF_INET)
            writer.transport.abort()
        except ConnectionRefusedError:
            self._was_refused(api)


def _check_value(kind: str, value: object, node: str) -> object:
    """A value of a call, names made absolute."""
    if isinstance(value, str) and (is_legal(value) if kind == "n" else kind == "k" and 0 < len(value) <= MAX_NAME):
        return resolve(value, node)
    scheme = {"a": "http://", "s": "rosrpc://"}.get(kind)
    if kind == "v" or (kind == "t" and is_type(value)):
        return value
    if scheme and isinstance(value, str) and value.startswith(scheme) and len(value) < 300:
        return value
    what = {"n": "name", "t": "type", "k": "name of a parameter"}.get(kind, f"URI like {scheme}host:port")
    raise CommandError(f"ERROR: {str(value)[:60]!r} is not a {what}")
