"""rosapi: what clients ask about topics, services, types, parameters and each other."""

import json
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Mapping
from typing import Any

from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.messages import (
    INTEGERS,
    MOMENT,
    SPAN,
    Field,
    definition,
    fields,
    known_type,
    known_types,
    ros1_name,
    stamp,
    typestore,
)
from vrx_mj.ros.parameters import joined, plain
from vrx_mj.ros.rosbridge.codec import json_bytes
from vrx_mj.ros.rosbridge.protocol import absolute
from vrx_mj.ros.rosbridge.topics import Services

_EXAMPLES = dict.fromkeys(INTEGERS, "0") | {"float32": "0.0", "float64": "0.0", "bool": "False", "string": ""}
_MOMENTS = {
    "fieldnames": ["secs", "nsecs"],
    "fieldtypes": ["int32", "int32"],
    "fieldarraylen": [-1, -1],
    "examples": ["0", "0"],
    "constnames": [],
    "constvalues": [],
}


def _typedefs(type_name: str) -> list[dict[str, object]]:
    """A message type, then those that it uses; UnknownNameError: the type is unknown."""
    waiting, definitions = [known_type(type_name)], {}
    while waiting:
        name = waiting.pop(0)
        if name in definitions:
            continue
        definitions[name] = {"type": name} | (_MOMENTS if name in {MOMENT, SPAN} else _typedef(name))
        if name not in {MOMENT, SPAN}:
            waiting += [field.type for field in fields(name).values() if _is_message(field)]
    return list(definitions.values())


def _typedef(name: str) -> dict[str, object]:
    parts = fields(name).values()
    package, _, short = name.rpartition("/")
    constants = typestore().fielddefs[f"{package}/msg/{short}"][0]
    return {
        "fieldnames": [field.name for field in parts],
        "fieldtypes": [ros1_name(field.type) if "/" in field.type else field.type for field in parts],
        "fieldarraylen": [field.length for field in parts],
        "examples": ["[]" if field.length >= 0 else _EXAMPLES.get(field.type, "{}") for field in parts],
        "constnames": [key for key, _, _ in constants],
        "constvalues": [str(value) for _, _, value in constants],
    }


def _is_message(field: Field) -> bool:
    return "/" in field.type or field.type in {MOMENT, SPAN}


MOST_PARAMETERS = 1024
"""Parameters that clients may set."""
MOST_TEXT = 1 << 20
"""Characters of JSON in all of them."""
_ACTION = frozenset({"cancel", "feedback", "goal", "result", "status"})
"""Topics of an action."""

_Values = dict[str, Any]


class Rosapi:
    """Answers in the form of rosapi's service types, by the names of their fields."""

    def __init__(self, graph: Graph, services: Services) -> None:
        self._graph, self._services = graph, services
        self._parameters = ClientParameters(graph)

    def provide(self) -> None:
        """Register all services."""
        for name, arguments in _ARGUMENTS.items():
            type_name = _TYPES.get(name) or "".join(part.capitalize() for part in name.split("_"))
            method = getattr(self, f"_on_{name}")
            answer = _named(self._at_once(method) if "param" in name else method, arguments)
            self._services.build_in(f"/rosapi/{name}", f"rosapi/{type_name}", answer)

    def _at_once(self, method: Callable[[object], Coroutine[object, None, _Values]]) -> Callable[[object], object]:
        """The method, its answer made at once where the parameters are this process's: that is time of the client."""
        return lambda asked: method(asked) if self._graph.remote_master is not None else _finished(method(asked))

    def _on_topics(self, _: object) -> _Values:
        types = self._graph.topics()
        return {"topics": list(types), "types": list(types.values())}

    def _on_topics_for_type(self, asked: object) -> _Values:
        wanted = ros1_name(_argument(asked, "type"))
        return {"topics": [name for name, kind in self._graph.topics().items() if kind == wanted]}

    def _on_topics_and_raw_types(self, _: object) -> _Values:
        types = self._graph.topics()
        texts = [definition(kind) if kind in known_types() else "" for kind in types.values()]
        return {"topics": list(types), "types": list(types.values()), "typedefs_full_text": texts}

    def _on_topic_type(self, asked: object) -> _Values:
        return {"type": self._graph.type_of(absolute(_argument(asked, "topic"))) or ""}

    def _on_services(self, _: object) -> _Values:
        return {"services": sorted(self._graph.registrations.names("service"))}

    def _on_services_for_type(self, asked: object) -> _Values:
        wanted = ros1_name(_argument(asked, "type"))
        known = sorted(self._graph.services.items())
        return {"services": [name for name, service in known if ros1_name(service.type) == wanted]}

    def _on_service_type(self, asked: object) -> _Values | Awaitable[_Values]:
        name = absolute(_argument(asked, "service"))
        service = self._graph.services.get(name)
        if service is None and self._graph.registrations.apis("service", name):
            return self._type_elsewhere(name)
        return {"type": ros1_name(service.type) if service else ""}

    async def _type_elsewhere(self, name: str) -> _Values:
        assert self._graph.remote_call is not None, "who else has registered it"
        type_name, _ = await self._graph.remote_call(name, None)
        return {"type": type_name}

    def _on_service_node(self, asked: object) -> _Values:
        return {"node": self._node(absolute(_argument(asked, "service")))}

    def _on_service_host(self, asked: object) -> _Values:
        name = absolute(_argument(asked, "service"))
        self._node(name)
        return {"host": self._services.host(name)}

    def _on_service_request_details(self, asked: object) -> _Values:
        return {"typedefs": _typedefs(f"{ros1_name(_argument(asked, 'type'))}Request")}

    def _on_service_response_details(self, asked: object) -> _Values:
        return {"typedefs": _typedefs(f"{ros1_name(_argument(asked, 'type'))}Response")}

    def _on_message_details(self, asked: object) -> _Values:
        return {"typedefs": _typedefs(_argument(asked, "type"))}

    def _on_nodes(self, _: object) -> _Values:
        nodes = self._graph.registrations.nodes
        return {"nodes": sorted(nodes, key=lambda node: (node != self._graph.node, node))}

    def _on_node_details(self, asked: object) -> _Values:
        node, known = absolute(_argument(asked, "node")), self._graph.registrations
        if node not in known.nodes:
            raise UnknownNameError("node", node, known.nodes)
        names = {"subscribing": "subscriber", "publishing": "publisher", "services": "service"}
        return {
            key: sorted(name for name in known.names(kind) if node in self._holders(kind, name))
            for key, kind in names.items()
        }

    def _on_publishers(self, asked: object) -> _Values:
        return {"publishers": self._holders("publisher", absolute(_argument(asked, "topic")))}

    def _on_subscribers(self, asked: object) -> _Values:
        return {"subscribers": self._holders("subscriber", absolute(_argument(asked, "topic")))}

    def _on_action_servers(self, _: object) -> _Values:
        parts: dict[str, set[str]] = {}
        for name in self._graph.topics():
            space, _, last = name.rpartition("/")
            parts.setdefault(space, set()).add(last)
        return {"action_servers": [space for space, names in parts.items() if names >= _ACTION]}

    def _on_get_time(self, _: object) -> _Values:
        now = stamp(self._graph.time)
        return {"time": {"secs": now.sec, "nsecs": now.nanosec}}

    async def _on_get_param_names(self, _: object) -> _Values:
        return {"names": sorted(await self._parameters.names())}

    async def _on_get_param(self, asked: object) -> _Values:
        default = _argument(asked, "default", "")
        try:
            return {"value": json_bytes(await self._parameters.get(_parameter(asked))).decode("ascii")}
        except KeyError:
            return {"value": default or "null"}
        except TypeError as error:
            raise CommandError(f"get_param: {error}") from error

    async def _on_set_param(self, asked: object) -> _Values:
        text = _argument(asked, "value")
        try:
            value = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise CommandError(f"set_param: value {text[:60]!r} is not JSON: {error}") from error
        await self._parameters.set(_parameter(asked), value)
        return {}

    async def _on_has_param(self, asked: object) -> _Values:
        return {"exists": await self._parameters.has(_parameter(asked))}

    async def _on_delete_param(self, asked: object) -> _Values:
        await self._parameters.delete(_parameter(asked))
        return {}

    async def _on_search_param(self, asked: object) -> _Values:
        return {"global_name": await self._parameters.search(_parameter(asked))}

    def _holders(self, kind: str, name: str) -> list[str]:
        nodes = {node for node, _ in self._graph.registrations.holders(kind, name)}
        return sorted(nodes, key=lambda node: (node != self._graph.node, node))

    def _node(self, service: str) -> str:
        holders = self._holders("service", service)
        if not holders:
            raise UnknownNameError("service", service, self._graph.registrations.names("service"))
        return holders[0]


class ClientParameters:
    """The graph's parameters, or those of another process's master, with limits on what clients set."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._set: dict[str, int] = {}
        """What clients have set, and how many characters of JSON that is."""

    async def names(self) -> list[str]:
        """Of all."""
        remote = self._graph.remote_master
        return self._graph.parameters.names() if remote is None else await remote("getParamNames", ()) or []

    async def get(self, name: str) -> object:
        """A value, or a mapping of what is in a namespace; KeyError where there is neither."""
        if self._graph.remote_master is None:
            return self._graph.parameters.get(name)
        value = await self._graph.remote_master("getParam", (name,))
        if value is None:
            raise KeyError(name)
        return value

    async def has(self, name: str) -> bool:
        """Whether there is such a parameter or namespace."""
        remote = self._graph.remote_master
        return self._graph.parameters.has(name) if remote is None else bool(await remote("hasParam", (name,)))

    async def set(self, name: str, value: object) -> None:
        """Set one; CommandError: clients have set too many or too long ones, or it cannot be set."""
        value = plain(value)
        sizes = {key: len(key) + len(json.dumps(part)) for key, part in _leaves(joined(name), value)}
        kept = {key: size for key, size in self._set.items() if not _overlap(key, joined(name))}
        if len(kept) + len(sizes) > MOST_PARAMETERS:
            count = len(kept) + len(sizes)
            raise CommandError(f"{name}: {count} parameters would be set by clients; at most {MOST_PARAMETERS}")
        text = sum(kept.values()) + sum(sizes.values())
        if text > MOST_TEXT:
            raise CommandError(f"{name}: {text} characters would be set by clients; at most {MOST_TEXT}")
        if self._graph.remote_master is None:
            self._graph.set_parameter(name, value, "")
        elif await self._graph.remote_master("setParam", (name, value)) is None:
            raise CommandError(f"{name}: the master does not set this parameter")
        self._set = kept | sizes

    async def delete(self, name: str) -> None:
        """Delete one; CommandError: it is unknown, or the simulation's."""
        try:
            if self._graph.remote_master is None:
                self._graph.delete_parameter(name)
            elif await self._graph.remote_master("deleteParam", (name,)) is None:
                raise KeyError(name)
        except KeyError:
            raise CommandError(f"{name}: no such parameter") from None
        self._set = {key: size for key, size in self._set.items() if not _overlap(key, joined(name))}

    async def search(self, name: str) -> str:
        """The absolute name of one as seen from the simulation's node; empty for an invalid one."""
        if self._graph.remote_master is None:
            return self._graph.parameters.search(self._graph.node, name.strip("/")) or ""
        return str(await self._graph.remote_master("searchParam", (name.strip("/"),)) or "")


def _finished(answer: Coroutine[object, None, _Values]) -> _Values:
    """The result of a coroutine that waits for nothing."""
    try:
        answer.send(None)
    except StopIteration as done:
        return dict(done.value)
    raise AssertionError("it waits for something")


def _leaves(name: str, value: object) -> Iterator[tuple[str, object]]:
    """Every value that is not a namespace, by its whole name."""
    if isinstance(value, dict) and value:
        for key, part in value.items():
            yield from _leaves(joined(name, key), part)
    else:
        yield name, value


def _overlap(one: str, other: str) -> bool:
    """Whether one name is in the other's namespace, or they are the same."""
    return f"{one}/".startswith(f"{other.rstrip('/')}/") or f"{other}/".startswith(f"{one}/")


_ARGUMENTS: dict[str, tuple[str, ...]] = {
    "topics": (),
    "topics_for_type": ("type",),
    "topics_and_raw_types": (),
    "topic_type": ("topic",),
    "services": (),
    "services_for_type": ("type",),
    "service_type": ("service",),
    "service_node": ("service",),
    "service_host": ("service",),
    "service_request_details": ("type",),
    "service_response_details": ("type",),
    "message_details": ("type",),
    "nodes": (),
    "node_details": ("node",),
    "publishers": ("topic",),
    "subscribers": ("topic",),
    "action_servers": (),
    "get_time": (),
    "get_param_names": (),
    "get_param": ("name", "default"),
    "set_param": ("name", "value"),
    "has_param": ("name",),
    "delete_param": ("name",),
    "search_param": ("name",),
}
"""Every service, and its request's fields in their order."""
_TYPES = {"action_servers": "GetActionServers"}
"""Those whose type is not the service's name in capitals."""


def _named(answer: Callable[[object], object], names: tuple[str, ...]) -> Callable[[object], object]:
    """An answer whose request may also be a list."""
    return lambda asked: answer(dict(zip(names, asked, strict=False)) if isinstance(asked, list) else asked)


def _argument(asked: object, name: str, default: str | None = None) -> str:
    value = asked.get(name, default) if isinstance(asked, Mapping) else default
    if not isinstance(value, str):
        raise CommandError(f"{name} is missing, or not a string: the request is {{'{name}': '...'}}")
    return value


def _parameter(asked: object) -> str:
    name = _argument(asked, "name")
    return "/" if name == "/" else absolute(name)
