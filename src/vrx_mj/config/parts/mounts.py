"""What a part is called and where it is mounted: as its file says, or its macro's default."""

from vrx_mj.config.parts.boxes import Point
from vrx_mj.config.parts.catalogue import JAZZY_NAMES, TYPES
from vrx_mj.config.parts.files import Instance
from vrx_mj.config.parts.values import triple_of

__all__ = ["name_key", "name_of", "place_of"]


def name_key(instance: Instance) -> str:
    """The parameter that names a part."""
    if TYPES[instance.type].kind == "thrusters":
        return "prefix"
    return "sensor_name" if JAZZY_NAMES & instance.parameters.keys() else "name"


def name_of(instance: Instance) -> str:
    """What a part is called; empty where its file owes it a name."""
    key = name_key(instance)
    return str(instance.parameters.get(key) or TYPES[instance.type].default(key) or "")


def place_of(instance: Instance) -> Point | None:
    """Where a part is in base_link [m]; None for a type without coordinates, which no box limits."""
    part, given = TYPES[instance.type], instance.parameters
    if part.kind == "thrusters":
        return triple_of(str(given["position"]))
    if part.parameter("z") is None:
        return None
    x, y, z = (float(given.get(axis, part.default(axis) or 0.0)) for axis in "xyz")
    return x, y, z
