"""rosapi: what clients ask about topics, services, types, parameters and each other."""

import inspect
import json
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from functools import partial
from typing import Any

from vrx_mj.errors import CommandError, UnknownNameError
from vrx_mj.ros.graph import Graph
from vrx_mj.ros.messages import (
    INTEGERS,
    MOMENT,
    SPAN,
    definition,
    fields,
    known_type,
    known_types,
    ros1_name,
    stamp,
    typestore,
)
from vrx_mj.ros.parameters import plain
from vrx_mj.ros.rosbridge.codec import absolute, json_bytes
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
            waiting += [one.type for one in fields(name).values() if "/" in one.type or one.type in {MOMENT, SPAN}]
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


_ACTION = frozenset({"cancel", "feedback", "goal", "result", "status"})
"""Topics of an action."""

_Values = dict[str, Any]


class Rosapi:
    """Answers in the form of rosapi's service types, by the names of their fields."""

    def __init__(self, graph: Graph, services: Services) -> None:
        self._graph, self._services = graph, services

    def provide(self) -> None:
        """Register all services."""
        for method_name in vars(Rosapi):
            if method_name.startswith("_on_"):
                name = method_name.removeprefix("_on_")
                words = name.replace("action_servers", "get_action_servers").split("_")
                type_name = "".join(word.capitalize() for word in words)
                answer = partial(self._answer, getattr(self, method_name))
                self._services.build_in(f"/rosapi/{name}", f"rosapi/{type_name}", answer)

    def _answer(self, method: Callable[..., object], asked: object) -> object:
        """What a method gives, whose parameters are the request's fields; a request may also be a list of these.

        An answer about parameters of this process is made at once: that is time of the client.
        """
        parameters = inspect.signature(method).parameters.values()
        fields = {one.name.rstrip("_"): one.default for one in parameters}
        given = dict(zip(fields, asked, strict=False)) if isinstance(asked, list) else asked
        answer = method(*(_argument(given, name, default) for name, default in fields.items()))
        is_here = "param" in method.__name__ and self._graph.remote_master is None
        return _result(answer) if is_here and inspect.iscoroutine(answer) else answer

    def _on_topics(self) -> _Values:
        types = self._graph.topics()
        return {"topics": list(types), "types": list(types.values())}

    def _on_topics_for_type(self, type_: str) -> _Values:
        return {"topics": [name for name, kind in self._graph.topics().items() if kind == type_]}

    def _on_topics_and_raw_types(self) -> _Values:
        types = self._graph.topics()
        texts = [definition(kind) if kind in known_types() else "" for kind in types.values()]
        return {"topics": list(types), "types": list(types.values()), "typedefs_full_text": texts}

    def _on_topic_type(self, topic: str) -> _Values:
        return {"type": self._graph.type_of(topic) or ""}

    def _on_services(self) -> _Values:
        return {"services": sorted(self._graph.registrations.names("service"))}

    def _on_services_for_type(self, type_: str) -> _Values:
        known = sorted(self._graph.services.items())
        return {"services": [name for name, service in known if ros1_name(service.type) == type_]}

    def _on_service_type(self, service: str) -> _Values | Awaitable[_Values]:
        known = self._graph.services.get(service)
        if known is None and self._graph.registrations.apis("service", service):
            return self._type_elsewhere(service)
        return {"type": ros1_name(known.type) if known else ""}

    async def _type_elsewhere(self, name: str) -> _Values:
        assert self._graph.remote_call is not None, "who else has registered it"
        type_name, _ = await self._graph.remote_call(name, None)
        return {"type": type_name}

    def _on_service_node(self, service: str) -> _Values:
        return {"node": self._node(service)}

    def _on_service_host(self, service: str) -> _Values:
        self._node(service)
        return {"host": self._services.host(service)}

    def _on_service_request_details(self, type_: str) -> _Values:
        return {"typedefs": _typedefs(f"{type_}Request")}

    def _on_service_response_details(self, type_: str) -> _Values:
        return {"typedefs": _typedefs(f"{type_}Response")}

    def _on_message_details(self, type_: str) -> _Values:
        return {"typedefs": _typedefs(type_)}

    def _on_nodes(self) -> _Values:
        nodes = self._graph.registrations.nodes
        return {"nodes": sorted(nodes, key=lambda node: (node != self._graph.node, node))}

    def _on_node_details(self, node: str) -> _Values:
        known = self._graph.registrations
        if node not in known.nodes:
            raise UnknownNameError("node", node, known.nodes)
        names = {"subscribing": "subscriber", "publishing": "publisher", "services": "service"}
        return {
            key: sorted(name for name in known.names(kind) if node in self._holders(kind, name))
            for key, kind in names.items()
        }

    def _on_publishers(self, topic: str) -> _Values:
        return {"publishers": self._holders("publisher", topic)}

    def _on_subscribers(self, topic: str) -> _Values:
        return {"subscribers": self._holders("subscriber", topic)}

    def _on_action_servers(self) -> _Values:
        parts: dict[str, set[str]] = {}
        for name in self._graph.topics():
            space, _, last = name.rpartition("/")
            parts.setdefault(space, set()).add(last)
        return {"action_servers": [space for space, names in parts.items() if names >= _ACTION]}

    def _on_get_time(self) -> _Values:
        now = stamp(self._graph.time)
        return {"time": {"secs": now.sec, "nsecs": now.nanosec}}

    async def _on_get_param_names(self) -> _Values:
        return {"names": sorted(await self._master("getParamNames") or [])}

    async def _on_get_param(self, name: str, default: str = "") -> _Values:
        value = await self._master("getParam", name)
        try:
            return {"value": default or "null" if value is None else json_bytes(value).decode("ascii")}
        except TypeError as error:
            raise CommandError(f"get_param: {error}") from error

    async def _on_set_param(self, name: str, value: str) -> _Values:
        try:
            decoded = json.loads(value)
        except (ValueError, RecursionError) as error:
            raise CommandError(f"set_param: value {value[:60]!r} is not JSON: {error}") from error
        if await self._master("setParam", name, plain(decoded)) is None:
            raise CommandError(f"{name}: the master does not set this parameter")
        return {}

    async def _on_has_param(self, name: str) -> _Values:
        return {"exists": bool(await self._master("hasParam", name))}

    async def _on_delete_param(self, name: str) -> _Values:
        if await self._master("deleteParam", name) is None:
            raise CommandError(f"{name}: no such parameter")
        return {}

    async def _on_search_param(self, name: str) -> _Values:
        return {"global_name": str(await self._master("searchParam", name.strip("/")) or "")}

    async def _master(self, method: str, *values: Any) -> Any:
        """The value that the master answers about parameters, ours or another process's; None where it fails."""
        graph = self._graph
        if graph.remote_master is not None:
            return await graph.remote_master(method, values)
        answers: Mapping[str, Callable[..., object]] = {
            "getParamNames": graph.parameters.names,
            "getParam": graph.parameters.get,
            "hasParam": graph.parameters.has,
            "searchParam": partial(graph.parameters.search, graph.node),
        }
        changes: Mapping[str, Callable[..., None]] = {
            "setParam": partial(graph.set_parameter, setter=""),
            "deleteParam": graph.delete_parameter,
        }
        try:
            if method in answers:
                return answers[method](*values)
            changes[method](*values)
        except KeyError:
            return None
        return True

    def _holders(self, kind: str, name: str) -> list[str]:
        nodes = {node for node, _ in self._graph.registrations.holders(kind, name)}
        return sorted(nodes, key=lambda node: (node != self._graph.node, node))

    def _node(self, service: str) -> str:
        holders = self._holders("service", service)
        if not holders:
            raise UnknownNameError("service", service, self._graph.registrations.names("service"))
        return holders[0]


def _result(answer: Coroutine[object, None, _Values]) -> _Values:
    """The result of a coroutine that waits for nothing."""
    try:
        answer.send(None)
    except StopIteration as done:
        return dict(done.value)
    raise AssertionError("it waits for something")


_CONVERSIONS: Mapping[str, Callable[[str], str]] = {
    "type": ros1_name,
    "topic": absolute,
    "service": absolute,
    "node": absolute,
    "name": lambda name: "/" if name == "/" else absolute(name),
}
"""What becomes of an argument, by its name."""


def _argument(asked: object, name: str, default: object) -> str:
    value = asked.get(name, default) if isinstance(asked, Mapping) else default
    if not isinstance(value, str):
        raise CommandError(f"{name} is missing, or not a string: the request is {{'{name}': '...'}}")
    return _CONVERSIONS.get(name, str)(value)
