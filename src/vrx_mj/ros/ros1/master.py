"""A master of ROS 1 with its parameter server: methods by name, each from values to code, text and value."""

import asyncio
import contextlib
import os
import socket
from collections.abc import Callable, Sequence
from typing import Any

from vrx_mj.errors import CommandError
from vrx_mj.ros.ros1.http import BROKEN, address
from vrx_mj.ros.ros1.names import LONGEST, is_legal, is_type, joined, resolve
from vrx_mj.ros.ros1.notifier import Notifier
from vrx_mj.ros.ros1.parameters import Parameters, updates
from vrx_mj.ros.ros1.registrations import Registrations
from vrx_mj.ros.ros1.xmlrpc import Fault, plain

__all__ = ["Master", "Reply"]

Reply = tuple[int, str, Any]
MOST_TYPES = 100_000
REGISTERING = frozenset(
    f"{verb}{what}"
    for verb in ("register", "unregister", "subscribe", "unsubscribe")
    for what in ("Publisher", "Subscriber", "Service", "Param")
)
"""Methods by which a node says what it has, and where it is."""
SWEEP = 10.0
"""Wall time for a look at all nodes, about [s]."""


class Master:
    """All that the master knows. It lives in the loop's thread.

    The node of this process is registered by this process alone: nobody on the network takes its name, which would end
    it, nor takes back what it has registered.
    """

    def __init__(self, uri: str, own: str = "") -> None:
        """`own`: the name of this process's node."""
        self.uri, self._own = uri, own
        self.parameters = Parameters()
        self.known = Registrations(self._was_replaced)
        self.types: dict[str, str] = {}
        self.changed = asyncio.Event()
        """Set whenever somebody has registered or gone."""
        self._sweeper: asyncio.Task[None] | None = None
        self._notifier = Notifier(self._was_refused)
        self._methods: dict[str, tuple[str, Callable[..., Reply]]] = {
            "getPid": ("", lambda _: (1, "", os.getpid())),
            "getUri": ("", lambda _: (1, "", self.uri)),
            "shutdown": ("v", lambda *_: (0, "this master ends with its simulation", 0)),
            "registerPublisher": ("nta", self._register_publisher),
            "registerSubscriber": ("nta", self._register_subscriber),
            "registerService": ("nsa", self._register_service),
            "unregisterPublisher": ("na", self._unregister_publisher),
            "unregisterSubscriber": ("na", self._unregister_subscriber),
            "unregisterService": ("ns", self._unregister_service),
            "lookupNode": ("n", self._lookup_node),
            "lookupService": ("n", self._lookup_service),
            "getPublishedTopics": ("v", self._published_topics),
            "getTopicTypes": ("", lambda _: (1, "current system state", [list(pair) for pair in self.types.items()])),
            "getSystemState": ("", self._system_state),
            "setParam": ("kv", self._set_parameter),
            "getParam": ("k", self._get_parameter),
            "hasParam": ("k", lambda _, key: (1, key, self.parameters.has(key))),
            "deleteParam": ("k", self._delete_parameter),
            "searchParam": ("v", self._search_parameter),
            "subscribeParam": ("ak", self._subscribe_parameter),
            "unsubscribeParam": ("ak", self._unsubscribe_parameter),
            "getParamNames": ("", lambda _: (1, "Parameter names", self.parameters.names())),
        }
        """Methods with their values after the caller: (n)ame, (t)ype, (a)pi, (s)ervice's api, (k)ey, any (v)alue."""

    async def answer(self, method: str, values: Sequence[Any], _host: str) -> Any:
        """What a call gives; Fault if there is no such method."""
        if method == "system.listMethods":
            return [*self._methods, "system.listMethods", "system.multicall"]
        if method not in self._methods:
            raise Fault(1, f'method "{method[:100]}" is not supported')
        if method in REGISTERING and values and isinstance(values[0], str) and joined(values[0]) == self._own:
            return [-1, f"ERROR: {self._own} is the simulation's own node: another name is needed", 0]
        return list(self.call(method, values))

    def call(self, method: str, values: Sequence[Any]) -> Reply:
        """Code (1 done, 0 failed, -1 wrong call), text and value."""
        kinds, function = self._methods[method]
        if not values or not isinstance(values[0], str) or len(values[0]) > LONGEST:
            return -1, f"caller_id must be a string of at most {LONGEST} characters", 0
        if len(values) != len(kinds) + 1:
            return -1, "Error: bad call arity", 0
        try:
            checked = [_checked(kind, value, values[0]) for kind, value in zip(kinds, values[1:], strict=True)]
            reply = function(values[0], *checked)
            if "register" in method.lower():
                self.changed.set()
            return reply
        except CommandError as error:
            return -1, str(error), 0

    def start(self) -> None:
        """Begin to look after nodes that died."""
        self._sweeper = asyncio.get_running_loop().create_task(self._sweep())

    async def close(self) -> None:
        """Stop telling nodes of changes."""
        if self._sweeper is not None:
            self._sweeper.cancel()
            await asyncio.gather(self._sweeper, return_exceptions=True)
        await self._notifier.close()

    def _register_publisher(self, node: str, topic: str, kind: str, api: str) -> Reply:
        self.known.add("publisher", topic, node, api)
        if (kind != "*" or topic not in self.types) and len(self.types) < MOST_TYPES:
            self.types[topic] = kind
        self._tell_subscribers(topic)
        return 1, f"Registered [{node}] as publisher of [{topic}]", self.known.apis("subscriber", topic)

    def _register_subscriber(self, node: str, topic: str, kind: str, api: str) -> Reply:
        self.known.add("subscriber", topic, node, api)
        if kind != "*" and len(self.types) < MOST_TYPES:
            self.types.setdefault(topic, kind)
        return 1, f"Subscribed to [{topic}]", self.known.apis("publisher", topic)

    def _register_service(self, node: str, service: str, service_api: str, api: str) -> Reply:
        self.known.add("service", service, node, api, service_api)
        return 1, f"Registered [{node}] as provider of [{service}]", 1

    def _unregister_publisher(self, node: str, topic: str, api: str) -> Reply:
        count = self.known.remove("publisher", topic, node, api)
        if count:
            self._tell_subscribers(topic)
        return _removed(node, topic, count)

    def _unregister_subscriber(self, node: str, topic: str, api: str) -> Reply:
        return _removed(node, topic, self.known.remove("subscriber", topic, node, api))

    def _unregister_service(self, node: str, service: str, service_api: str) -> Reply:
        return _removed(node, service, self.known.remove("service", service, node, service_api))

    def _lookup_node(self, _: str, name: str) -> Reply:
        api = self.known.nodes.get(name)
        return (-1, f"unknown node [{name}]", "") if api is None else (1, "node api", api)

    def _lookup_service(self, _: str, name: str) -> Reply:
        apis = self.known.apis("service", name)
        return (1, f"rosrpc URI: [{apis[0]}]", apis[0]) if apis else (-1, "no provider", "")

    def _published_topics(self, node: str, subgraph: Any) -> Reply:
        if subgraph and not is_legal(subgraph):
            return -1, "ERROR: parameter [subgraph] is not a name", []
        under = f"{resolve(subgraph, node)}/" if subgraph and subgraph != "/" else "/"
        names = [name for name in self.known.names("publisher") if name.startswith(under)]
        return 1, "current topics", [[name, self.types.get(name, "*")] for name in names]

    def _system_state(self, _: str) -> Reply:
        state = [self.known.state(kind) for kind in ("publisher", "subscriber", "service")]
        return 1, "current system state", state

    def _set_parameter(self, node: str, key: str, value: Any) -> Reply:
        self.parameters.set(key, plain(value))
        self._tell_of_parameter(key, value, node)
        return 1, f"parameter {key} set", 0

    def _get_parameter(self, _: str, key: str) -> Reply:
        try:
            return 1, f"Parameter [{key}]", self.parameters.get(key)
        except KeyError:
            return -1, f"Parameter [{key}] is not set", 0

    def _delete_parameter(self, _: str, key: str) -> Reply:
        try:
            self.parameters.delete(key)
        except KeyError:
            return -1, f"parameter [{key}] is not set", 0
        self._tell_of_parameter(key, {}, "")
        return 1, f"parameter {key} deleted", 0

    def _search_parameter(self, node: str, key: Any) -> Reply:
        if not isinstance(key, str) or not 0 < len(key) <= LONGEST or key.startswith("~"):
            return -1, "ERROR: parameter [key] is not a relative or absolute name", 0
        found = self.parameters.search(node, key)
        return (
            (-1, f"Cannot find parameter [{key}] in an upwards search", "")
            if found is None
            else (1, f"Found [{found}]", found)
        )

    def _subscribe_parameter(self, node: str, api: str, key: str) -> Reply:
        self.known.add("parameter", key, node, api)
        value = self.parameters.get(key) if self.parameters.has(key) else {}
        return 1, f"Subscribed to parameter [{key}]", value

    def _unsubscribe_parameter(self, node: str, api: str, key: str) -> Reply:
        return 1, f"Unsubscribe to parameter [{key}]", self.known.remove("parameter", key, node, api)

    def _tell_subscribers(self, topic: str) -> None:
        publishers = self.known.apis("publisher", topic)
        for api in set(self.known.apis("subscriber", topic)):
            self._notifier.tell(api, "publisherUpdate", topic, publishers)

    def _tell_of_parameter(self, key: str, value: Any, setter: str) -> None:
        for update in updates(self.known.names("parameter"), key, value):
            for node, api in self.known.holders("parameter", update.subscribed):
                if node != setter:
                    self._notifier.tell(api, "paramUpdate", update.key, update.value)

    def _was_replaced(self, node: str, api: str, gone: list[tuple[str, str]]) -> None:
        self._notifier.tell(api, "shutdown", f"[{node}] Reason: new node registered with same name")
        self._tell_of_gone(gone)

    def _was_refused(self, api: str) -> None:
        """Nobody listens at a node's URI any more: it has died without a word."""
        for node in [name for name, uri in self.known.nodes.items() if uri == api]:
            self._tell_of_gone(self.known.forget(node))

    def _tell_of_gone(self, gone: list[tuple[str, str]]) -> None:
        for kind, key in gone:
            if kind == "publisher":
                self._tell_subscribers(key)
        self.changed.set()

    async def _sweep(self) -> None:
        """Look again and again whether nodes still listen, so that those who died are forgotten."""
        while True:
            for api in sorted(set(self.known.nodes.values())):
                await asyncio.sleep(min(SWEEP / len(self.known.nodes or "-"), 1.0))
                with contextlib.suppress(*BROKEN):
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


def _checked(kind: str, value: Any, node: str) -> Any:
    """A value of a call, names made absolute."""
    if kind == "k" and isinstance(value, str) and 0 < len(value) <= LONGEST:
        return resolve(value, node)
    if kind == "n" and is_legal(value):
        return resolve(value, node)
    scheme = {"a": "http://", "s": "rosrpc://"}.get(kind)
    if kind == "v" or (kind == "t" and is_type(value)):
        return value
    if scheme and isinstance(value, str) and value.startswith(scheme) and len(value) < 300:
        return value
    what = {"n": "name", "t": "type", "k": "name of a parameter"}.get(kind, f"URI like {scheme}host:port")
    raise CommandError(f"ERROR: {str(value)[:60]!r} is not a {what}")


def _removed(node: str, key: str, count: int) -> Reply:
    text = f"Unregistered [{node}] as provider of [{key}]" if count else f"[{node}] is not a known provider of [{key}]"
    return 1, text, count
