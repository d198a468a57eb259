"""A master of ROS 1: registrations, and methods by name, each from values to code, text and value."""

import asyncio
import contextlib
import os
import re
import socket
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple
from xmlrpc.client import Binary

from vrx_mj.errors import CommandError
from vrx_mj.ros.ros1.xmlrpc import BROKEN, LARGEST_REPLY, Fault, Proxy, address, plain

__all__ = [
    "KINDS",
    "LONGEST",
    "Master",
    "Notifier",
    "Parameters",
    "Registrations",
    "Reply",
    "Update",
    "is_legal",
    "is_type",
    "joined",
    "resolve",
    "updates",
    "value_size",
]

LONGEST = 1024
"""Characters of a name, at most."""
_LEGAL = re.compile(r"[~/A-Za-z][A-Za-z0-9_/]*\Z")
_TYPE = re.compile(r"(\*|[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*)\Z")


def is_legal(name: object) -> bool:
    """Whether something can name a topic, a service or a node."""
    return isinstance(name, str) and 0 < len(name) <= LONGEST and _LEGAL.match(name) is not None


def is_type(name: object) -> bool:
    """Whether something can name a type; `*` stands for any."""
    return isinstance(name, str) and len(name) <= LONGEST and _TYPE.match(name) is not None


def joined(*parts: str) -> str:
    """An absolute name without doubled or trailing slashes."""
    return "/" + "/".join(part for name in parts for part in name.split("/") if part)


def namespace(node: str) -> str:
    """That in which a node's relative names are."""
    return joined(node.rpartition("/")[0])


def resolve(name: str, node: str) -> str:
    """The absolute name that a node means by a name."""
    if name.startswith("/"):
        return joined(name)
    if name.startswith("~"):
        return joined(node, name[1:])
    return joined(namespace(node), name)


MOST_BYTES = 1 << 26
"""Of all names and values, about."""
DEEPEST = 32
"""Names within each other in a key."""


class Update(NamedTuple):
    """What one who has subscribed to a parameter is told."""

    subscribed: str
    """Absolute name of the parameter or namespace."""
    key: str
    """Which one has changed; it ends with a slash, as ROS's master has it."""
    value: Any
    """An empty dictionary if it is gone."""


class Parameters:
    """Parameters by absolute name; a namespace is a dictionary."""

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {}
        self._bytes = value_size(self.tree)

    def get(self, key: str) -> Any:
        """The value, or the tree under a namespace; KeyError if there is none."""
        value: Any = self.tree
        for part in _parts(key):
            if not isinstance(value, dict):
                raise KeyError(key)
            value = value[part]
        return value

    def has(self, key: str) -> bool:
        """Whether there is such a parameter or namespace."""
        try:
            self.get(key)
        except KeyError:
            return False
        return True

    def set(self, key: str, value: Any) -> None:
        """Set it; what was under this name is gone.

        Raises:
            CommandError: the root gets something else than a dictionary, the name is too deep, all is too much.
        """
        parts = _parts(key)
        if len(parts) > DEEPEST or (not parts and not isinstance(value, dict)):
            raise CommandError(
                f"cannot set {key[:100]}: the root is a dictionary, and names are {DEEPEST} deep at most"
            )
        if self._bytes + value_size(value) > MOST_BYTES:
            raise CommandError(f"more than {MOST_BYTES} bytes of parameters")
        if not parts:
            self.tree, self._bytes = value, value_size(value)
            return
        place = self.tree
        for part in parts[:-1]:
            if not isinstance(place.get(part), dict):
                self._put(place, part, {})
            place = place[part]
        self._put(place, parts[-1], value)

    def delete(self, key: str) -> None:
        """Take it away; KeyError if there is none, or it is the root."""
        parts = _parts(key)
        if not parts:
            raise KeyError(key)
        place = self.get("/".join(parts[:-1]))
        if not isinstance(place, dict):
            raise KeyError(key)
        self._bytes -= len(parts[-1]) + value_size(place.pop(parts[-1]))

    def search(self, place: str, key: str) -> str | None:
        """Full name of a key as seen from a namespace: the nearest one upwards that has its first part."""
        if key.startswith("/"):
            return joined(key) if self.has(key) else None
        parts, spaces = _parts(key), _parts(place)
        if not parts:
            return None
        for depth in range(len(spaces), -1, -1):
            if self.has(joined(*spaces[:depth], parts[0])):
                return joined(*spaces[:depth], *parts)
        return None

    def names(self) -> list[str]:
        """Absolute names of all that are no namespaces."""
        return [name for name, value in _walk("", self.tree) if not isinstance(value, dict)]

    def _put(self, place: dict[str, Any], name: str, value: Any) -> None:
        if name in place:
            self._bytes -= len(name) + value_size(place[name])
        self._bytes += len(name) + value_size(value)
        place[name] = value


def updates(subscribed: Iterable[str], key: str, value: Any) -> list[Update]:
    """Whom it concerns that a parameter was set; of one that was deleted the value is an empty dictionary."""
    changed = _slashed(key)
    below = {_slashed(joined(key) + name): part for name, part in _walk("", value)} if isinstance(value, dict) else {}
    found = []
    for name in subscribed:
        full = _slashed(name)
        if changed.startswith(full):
            found.append(Update(name, changed, value))
        elif full in below:
            found.append(Update(name, full, below[full]))
        elif full.startswith(changed):
            found.append(Update(name, full, {}))
    return found


def _parts(key: str) -> list[str]:
    return [part for part in key.split("/") if part]


def _slashed(name: str) -> str:
    clean = joined(name)
    return clean if clean == "/" else f"{clean}/"


def _walk(place: str, tree: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """All names in a tree, namespaces included, and what they have."""
    for name, value in tree.items():
        full = f"{place}/{name}"
        yield full, value
        if isinstance(value, dict):
            yield from _walk(full, value)


def value_size(value: Any) -> int:
    """Bytes that a value of XML-RPC takes, about."""
    if isinstance(value, dict):
        return 64 + sum(len(name) + value_size(part) for name, part in value.items())
    if isinstance(value, list | tuple):
        return 64 + sum(map(value_size, value))
    if isinstance(value, Binary):
        return 64 + len(value.data)
    return 64 + len(value) if isinstance(value, str) else 64


KINDS = ("publisher", "subscriber", "service", "parameter")
MOST_REGISTRATIONS = 100_000
"""Registrations, at most."""


class _Entry(NamedTuple):
    node: str
    api: str
    """Of a service its own, of all else that of the node."""


class Registrations:
    """Nodes by name, and what each has registered."""

    def __init__(self, replaced: Callable[[str, str, list[tuple[str, str]]], None]) -> None:
        self.nodes: dict[str, str] = {}
        """URI by node's name."""
        self._replaced = replaced
        self._entries: dict[str, dict[str, list[_Entry]]] = {kind: {} for kind in KINDS}
        self._held: Counter[str] = Counter()

    def add(self, kind: str, key: str, node: str, node_api: str, api: str = "") -> None:
        """Register. A node that had another URI is forgotten first.

        `replaced` is then called with its name, its old URI, and the kinds and names of what it had registered.

        Raises:
            CommandError: there are too many.
        """
        if self._held.total() >= MOST_REGISTRATIONS:
            raise CommandError(f"more than {MOST_REGISTRATIONS} registrations")
        old = self.nodes.get(node)
        if old is not None and old != node_api:
            self._replaced(node, old, self.forget(node))
        self.nodes[node] = node_api
        entries = self._entries[kind].setdefault(key, [])
        entry = _Entry(node, api or node_api)
        if kind == "service":
            for other in [other for other in entries if other != entry]:  # the last one to register it has it
                self.remove(kind, key, other.node, other.api)
            entries = self._entries[kind].setdefault(key, [])
        if entry not in entries:
            entries.append(entry)
            self._held[node] += 1

    def remove(self, kind: str, key: str, node: str, api: str) -> int:
        """Take back; returns how many that were."""
        entries = self._entries[kind].get(key, [])
        if _Entry(node, api) not in entries:
            return 0
        entries.remove(_Entry(node, api))
        self._held[node] -= 1
        if not entries:
            del self._entries[kind][key]
        if not self._held[node]:
            del self._held[node]
            self.nodes.pop(node, None)
        return 1

    def forget(self, node: str) -> list[tuple[str, str]]:
        """Take back all that a node has registered; returns kinds and names."""
        gone = [(kind, key, entry) for (kind, key), entry in self._all() if entry.node == node]
        for kind, key, entry in gone:
            entries = self._entries[kind][key]
            entries.remove(entry)
            if not entries:
                del self._entries[kind][key]
        del self._held[node]
        self.nodes.pop(node, None)
        return [(kind, key) for kind, key, _ in gone]

    def apis(self, kind: str, key: str) -> list[str]:
        """URIs that are registered under a name."""
        return [entry.api for entry in self._entries[kind].get(key, [])]

    def names(self, kind: str) -> list[str]:
        """All names of a kind."""
        return list(self._entries[kind])

    def holders(self, kind: str, key: str) -> list[tuple[str, str]]:
        """Nodes and URIs that are registered under a name."""
        return [(entry.node, entry.api) for entry in self._entries[kind].get(key, [])]

    def state(self, kind: str) -> list[list[object]]:
        """Names with their nodes, as `getSystemState` has it."""
        return [[key, [entry.node for entry in entries]] for key, entries in self._entries[kind].items()]

    def _all(self) -> Iterator[tuple[tuple[str, str], _Entry]]:
        for kind, keys in self._entries.items():
            for key, entries in keys.items():
                for entry in entries:
                    yield (kind, key), entry


NODE_TIMEOUT = 5.0
"""Wall time that a node may take for an answer [s]."""
MOST_NODES = 512
"""Nodes that are being told something, at most; beyond that the one that takes longest is told no more."""

MOST_CALLS = 2000
"""Of one node that wait, at most."""


class Notifier:
    """Per node a list of calls; of calls of one method about one thing only the newest is made."""

    def __init__(self, unreachable: Callable[[str], None]) -> None:
        self._unreachable = unreachable
        self._waiting: dict[str, dict[tuple[str, str], tuple[Any, ...]]] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def tell(self, api: str, method: str, about: str, *values: Any) -> None:
        """Have a node's method called with the caller, the thing and these values."""
        if api not in self._waiting and len(self._waiting) >= MOST_NODES:
            slowest = next(iter(self._waiting))  # others are done within no time
            del self._waiting[slowest]
            self._tasks.pop(slowest).cancel()
        calls = self._waiting.setdefault(api, {})
        if len(calls) < MOST_CALLS or (method, about) in calls:
            calls[method, about] = (about, *values)
        if api not in self._tasks:
            self._tasks[api] = asyncio.get_running_loop().create_task(self._work(api))

    async def close(self) -> None:
        """Stop it all."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _work(self, api: str) -> None:
        proxy = Proxy(api, LARGEST_REPLY)
        calls = self._waiting[api]
        try:
            while calls:
                key = next(iter(calls))
                await proxy.call(key[0], "/master", *calls.pop(key), patience=NODE_TIMEOUT)
        except ConnectionRefusedError:
            self._unreachable(api)
        except (*BROKEN, Fault, TypeError, OverflowError):
            pass  # it does not listen; what else it was to be told is of no use either
        finally:
            proxy.close()
            if self._waiting.get(api) is calls:  # else another task is there in its place, or none
                del self._waiting[api], self._tasks[api]


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
