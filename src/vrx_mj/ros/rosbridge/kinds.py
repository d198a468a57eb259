"""What rosbridge needs to know of message types: their names as ROS 1 writes them, and their fields."""

from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

from rosbags.interfaces import Nodetype

from vrx_mj.errors import UnknownNameError
from vrx_mj.ros.messages import PADDING, typestore

__all__ = ["INTEGERS", "MOMENT", "SPAN", "Field", "fields", "known_type", "known_types", "ros1_name"]

MOMENT, SPAN = "time", "duration"
"""ROS 1's built-in types that are messages to rosbags."""
BUILT_IN = {"builtin_interfaces/Time": MOMENT, "builtin_interfaces/Duration": SPAN}
INTEGERS = {
    "byte": (0, 255),  # as rosbags has it
    "char": (0, 255),
    "uint8": (0, 255),
    "int8": (-128, 127),
    "uint16": (0, 65_535),
    "int16": (-32_768, 32_767),
    "uint32": (0, 4_294_967_295),
    "int32": (-2_147_483_648, 2_147_483_647),
    "uint64": (0, 18_446_744_073_709_551_615),
    "int64": (-9_223_372_036_854_775_808, 9_223_372_036_854_775_807),
}
"""Smallest and largest value of each integer type."""


class Field(NamedTuple):
    """A field of a message."""

    name: str
    type: str
    """A primitive's name, `time`, `duration` or `package/Type`; of an array, that of an element."""
    length: int
    """-1: no array; 0: an array of any length; else an array of so many."""


def ros1_name(type_name: str) -> str:
    """`std_msgs/Float32` for it and for ROS 2's `std_msgs/msg/Float32`; the same for services."""
    package, _, name = type_name.rpartition("/")
    return f"{package.removesuffix('/msg').removesuffix('/srv')}/{name}"


@cache
def known_types() -> Mapping[str, None]:
    """Every message type, in order. What clients ask for is looked up here: `messages` keeps each name it is asked."""
    return dict.fromkeys(sorted(ros1_name(name) for name in typestore().types))


def known_type(type_name: str) -> str:
    """A message type's name as ROS 1 has it.

    Raises:
        UnknownNameError: there is none of this name.
    """
    name = ros1_name(type_name)
    if name not in known_types():
        raise UnknownNameError("message type", type_name, known_types())
    return name


@cache
def fields(type_name: str) -> Mapping[str, Field]:
    """A message's fields by name, in their order."""
    package, _, name = type_name.rpartition("/")
    described = typestore().fielddefs[f"{package}/msg/{name}"][1]
    return {key: _field(key, kind) for key, kind in described if key != PADDING}


def _field(name: str, kind: Any) -> Field:
    node, about = kind
    if node in {Nodetype.ARRAY, Nodetype.SEQUENCE}:
        inner, count = about
        return Field(name, _type(inner), count if node == Nodetype.ARRAY else 0)
    return Field(name, _type(kind), -1)


def _type(kind: Any) -> str:
    node, about = kind
    if node == Nodetype.BASE:
        return str(about[0])
    name = ros1_name(str(about))
    return BUILT_IN.get(name, name)
