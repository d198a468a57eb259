"""What rosapi tells of types: their fields, as `rosmsg show` does, in the form of rosapi/TypeDef."""

from typing import Any

from vrx_mj.ros.messages import typestore
from vrx_mj.ros.rosbridge.kinds import INTEGERS, MOMENT, SPAN, Field, fields, known_type, ros1_name

__all__ = ["typedefs"]

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
