"""rosapi: what clients ask about topics, services, types, parameters and each other."""

import json
from collections.abc import Callable, Mapping
from typing import Any

from vrx_mj.errors import CommandError, UnknownNameError
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
from vrx_mj.ros.rosbridge.codec import json_bytes
from vrx_mj.ros.rosbridge.parameters import Parameters
from vrx_mj.ros.rosbridge.protocol import absolute
from vrx_mj.ros.rosbridge.topics import Services, Topics

__all__ = ["SIMULATION", "Rosapi", "node_name", "typedefs"]

EXAMPLES = dict.fromkeys(INTEGERS, "0") | {"float32": "0.0", "float64": "0.0", "bool": "False", "string": ""}
MOMENTS = {
    "fieldnames": ["secs", "nsecs"],
    "fieldtypes": ["int32", "int32"],
    "fieldarraylen": [-1, -1],
    "examples": ["0", "0"],
    "constnames": [],
    "constvalues": [],
}


def typedefs(type_name: str) -> list[dict[str, Any]]:
    """A message type, then those that it uses; UnknownNameError: there is none of this name."""
    waiting, told = [known_type(type_name)], {}
    while waiting:
        name = waiting.pop(0)
        if name in told:
            continue
        told[name] = {"type": name} | (MOMENTS if name in {MOMENT, SPAN} else _typedef(name))
        if name not in {MOMENT, SPAN}:
            waiting += [field.type for field in fields(name).values() if _is_message(field)]
    return list(told.values())


def _typedef(name: str) -> dict[str, Any]:
    parts = fields(name).values()
    package, _, short = name.rpartition("/")
    constants = typestore().fielddefs[f"{package}/msg/{short}"][0]
    return {
        "fieldnames": [field.name for field in parts],
        "fieldtypes": [ros1_name(field.type) if "/" in field.type else field.type for field in parts],
        "fieldarraylen": [field.length for field in parts],
        "examples": ["[]" if field.length >= 0 else EXAMPLES.get(field.type, "{}") for field in parts],
        "constnames": [key for key, _, _ in constants],
        "constvalues": [str(value) for _, _, value in constants],
    }


def _is_message(field: Field) -> bool:
    return "/" in field.type or field.type in {MOMENT, SPAN}


SIMULATION = "/vrx_mj"
"""The node that the simulation is to clients."""
NODES = "/rosbridge/client_"
ACTION = frozenset({"cancel", "feedback", "goal", "result", "status"})
"""Topics of an action."""

Values = dict[str, Any]


class Rosapi:
    """Answers in the form of rosapi's service types, by the names of their fields."""

    def __init__(self, topics: Topics, services: Services, parameters: Parameters, clients: Callable[[], list[int]]):
        self._topics = topics
        self._services = services
        self._parameters = parameters
        self._clients = clients
        self.time = 0.0
        """Simulated time [s]."""

    def all(self) -> dict[str, tuple[str, Callable[[Any], Values]]]:
        """Type and answer of each service, by absolute name."""
        answers: dict[str, tuple[str, Callable[[Any], Values]]] = {}
        for name, arguments in ARGUMENTS.items():
            type_name = TYPES.get(name) or "".join(part.capitalize() for part in name.split("_"))
            answers[f"/rosapi/{name}"] = (f"rosapi/{type_name}", _named(getattr(self, f"_on_{name}"), arguments))
        return answers

    def _on_topics(self, _: Any) -> Values:
        types = self._topics.all()
        return {"topics": list(types), "types": list(types.values())}

    def _on_topics_for_type(self, asked: Any) -> Values:
        wanted = ros1_name(_argument(asked, "type"))
        return {"topics": [name for name, kind in self._topics.all().items() if kind == wanted]}

    def _on_topics_and_raw_types(self, _: Any) -> Values:
        types = self._topics.all()
        texts = [definition(kind) if kind in known_types() else "" for kind in types.values()]
        return {"topics": list(types), "types": list(types.values()), "typedefs_full_text": texts}

    def _on_topic_type(self, asked: Any) -> Values:
        return {"type": self._topics.type_of(absolute(_argument(asked, "topic"))) or ""}

    def _on_services(self, _: Any) -> Values:
        return {"services": list(self._services.all())}

    def _on_services_for_type(self, asked: Any) -> Values:
        wanted = ros1_name(_argument(asked, "type"))
        return {"services": [name for name, kind in self._services.all().items() if kind == wanted]}

    def _on_service_type(self, asked: Any) -> Values:
        return {"type": self._services.all().get(absolute(_argument(asked, "service")), "")}

    def _on_service_node(self, asked: Any) -> Values:
        return {"node": self._node(absolute(_argument(asked, "service")))}

    def _on_service_host(self, asked: Any) -> Values:
        name = absolute(_argument(asked, "service"))
        self._node(name)
        return {"host": self._services.host(name)}

    def _on_service_request_details(self, asked: Any) -> Values:
        return {"typedefs": typedefs(f"{ros1_name(_argument(asked, 'type'))}Request")}

    def _on_service_response_details(self, asked: Any) -> Values:
        return {"typedefs": typedefs(f"{ros1_name(_argument(asked, 'type'))}Response")}

    def _on_message_details(self, asked: Any) -> Values:
        return {"typedefs": typedefs(_argument(asked, "type"))}

    def _on_nodes(self, _: Any) -> Values:
        return {"nodes": [SIMULATION, *(node_name(number) for number in self._clients())]}

    def _on_node_details(self, asked: Any) -> Values:
        node = absolute(_argument(asked, "node"))
        nodes = self._on_nodes(None)["nodes"]
        if node not in nodes:
            raise UnknownNameError("node", node, nodes)
        return {
            "subscribing": [name for name in self._topics.all() if node in self._subscribers(name)],
            "publishing": [name for name in self._topics.all() if node in self._publishers(name)],
            "services": [name for name in self._services.all() if self._node(name) == node],
        }

    def _on_publishers(self, asked: Any) -> Values:
        return {"publishers": self._publishers(absolute(_argument(asked, "topic")))}

    def _on_subscribers(self, asked: Any) -> Values:
        return {"subscribers": self._subscribers(absolute(_argument(asked, "topic")))}

    def _on_action_servers(self, _: Any) -> Values:
        parts: dict[str, set[str]] = {}
        for name in self._topics.all():
            space, _, last = name.rpartition("/")
            parts.setdefault(space, set()).add(last)
        return {"action_servers": [space for space, names in parts.items() if names >= ACTION]}

    def _on_get_time(self, _: Any) -> Values:
        now = stamp(self.time)
        return {"time": {"secs": now.sec, "nsecs": now.nanosec}}

    def _on_get_param_names(self, _: Any) -> Values:
        return {"names": self._parameters.names()}

    def _on_get_param(self, asked: Any) -> Values:
        default = _argument(asked, "default", "")
        try:
            return {"value": json_bytes(self._parameters.get(_parameter(asked))).decode("ascii")}
        except KeyError:
            return {"value": default or "null"}

    def _on_set_param(self, asked: Any) -> Values:
        text = _argument(asked, "value")
        try:
            value = json.loads(text)
        except ValueError as error:
            raise CommandError(f"set_param: value {text[:60]!r} is not JSON: {error}") from error
        self._parameters.set(_parameter(asked), value)
        return {}

    def _on_has_param(self, asked: Any) -> Values:
        return {"exists": self._parameters.has(_parameter(asked))}

    def _on_delete_param(self, asked: Any) -> Values:
        self._parameters.delete(_parameter(asked))
        return {}

    def _on_search_param(self, asked: Any) -> Values:
        return {"global_name": self._parameters.search(_parameter(asked), SIMULATION) or ""}

    def _publishers(self, name: str) -> list[str]:
        own = [SIMULATION] if name in self._topics.table.outputs else []
        topic = self._topics.find(name)
        return own + [node_name(number) for number in sorted(topic.publishers if topic else ())]

    def _subscribers(self, name: str) -> list[str]:
        own = [SIMULATION] if name in self._topics.table.inputs else []
        topic = self._topics.find(name)
        return own + [node_name(number) for number in sorted(topic.listeners if topic else ())]

    def _node(self, service: str) -> str:
        known = self._services.all()
        if service not in known:
            raise UnknownNameError("service", service, known)
        offered = self._services.offered.get(service)
        return node_name(offered.client.number) if offered else SIMULATION


ARGUMENTS: dict[str, tuple[str, ...]] = {
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
TYPES = {"action_servers": "GetActionServers"}
"""Those whose type is not the service's name in capitals."""


def node_name(number: int) -> str:
    """The node that a client is to the others."""
    return f"{NODES}{number}"


def _named(answer: Callable[[Any], Values], names: tuple[str, ...]) -> Callable[[Any], Values]:
    """An answer whose request may also be a list."""
    return lambda asked: answer(dict(zip(names, asked, strict=False)) if isinstance(asked, list) else asked)


def _argument(asked: Any, name: str, default: str | None = None) -> str:
    value = asked.get(name, default) if isinstance(asked, Mapping) else default
    if not isinstance(value, str):
        raise CommandError(f"{name} is missing, or not a string: the request is {{'{name}': '...'}}")
    return value


def _parameter(asked: Any) -> str:
    name = _argument(asked, "name")
    return "/" if name == "/" else absolute(name)
