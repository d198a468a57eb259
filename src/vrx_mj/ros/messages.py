"""ROS 1's message and service types: making, writing and reading messages, and the md5 sums that peers compare.

Types are named as ROS 1 names them, `sensor_msgs/Imu`; the two halves of a service `std_srvs/Trigger` are
`std_srvs/TriggerRequest` and `std_srvs/TriggerResponse`. Codec and most definitions are those of `rosbags`; the rest
is in `definitions`.
"""

import ast
import hashlib
import math
import re
import sys
from collections.abc import Callable, Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from vrx_mj.errors import CommandError, UnknownNameError

Message = Any
"""An instance of a class of rosbags' type store: fields by name, `uint8[]` and arrays of numbers as numpy's."""
FieldDesc = tuple[Nodetype, Any]
"""rosbags' description of a field: a base type, a message, or an array or a sequence of these."""

DEFINITIONS = Path(__file__).parent / "definitions"
"""Folder of the definitions of ROS 1's types."""
PADDING = "structure_needs_at_least_one_member"
"""rosbags' only field of a message without fields; it is not sent."""
MEMBER = f"\n{'=' * 80}\nMSG: "
"""Separator between the definitions of a type and of those that it uses."""
CLASSES = "/usr/lib/python3/dist-packages"
"""Folder of Debian's classes of ROS messages; other releases of ROS set the path of Python."""
_CLASS = re.compile(r'_md5sum = "(\w+)".*?_full_text = (""".*?""")', re.DOTALL)
"""Text of such a class about its type."""
_AXES = {
    "geometry_msgs/msg/Point": "xyz",
    "geometry_msgs/msg/Vector3": "xyz",
    "geometry_msgs/msg/Quaternion": "wxyz",
}
"""Fields of messages that sequences of numbers stand for, in their order."""
_MAX_ARRAY = 1 << 26
"""Largest number of elements of an array in a message that is read."""
MOMENT, SPAN = "time", "duration"
"""ROS 1's built-in types that are messages to rosbags."""
_BUILT_IN = {"builtin_interfaces/Time": MOMENT, "builtin_interfaces/Duration": SPAN}
"""ROS 2's names of ROS 1's built-in types."""
_INTEGER_TYPES = ("byte", "char", *(f"{sign}int{bits}" for bits in (8, 16, 32, 64) for sign in ("u", "")))
"""Types of whole numbers."""


@cache
def typestore(
    base: Stores = Stores.ROS1_NOETIC, definitions: Path = DEFINITIONS, more: tuple[Path, ...] = ()
) -> Typestore:  # fmt: skip
    """All known types: those of a release of ROS, of the files in a folder, and of `more` files."""
    store = get_typestore(base)
    store.max_sequence_length = _MAX_ARRAY
    types = {}
    for file in (*definitions.glob("*/*.msg"), *definitions.glob("*/*.srv"), *more):
        halves = ("Request", "Response") if file.suffix == ".srv" else ("",)
        for half, text in zip(halves, file.read_text("utf-8").split("---\n"), strict=True):
            types.update(get_types_from_msg(text, f"{file.parent.name}/msg/{file.stem}{half}"))
    store.register(types)
    return store


@lru_cache(maxsize=1024)  # names come from peers too
def full_name(type_name: str) -> str:
    """`sensor_msgs/msg/Imu` for `sensor_msgs/Imu`, as rosbags and ROS 2 have it."""
    package, _, name = type_name.rpartition("/")
    return f"{package.removesuffix('/msg')}/msg/{name}"


_Types = Callable[[], Typestore]
"""Gives all types of a generation of ROS."""


def is_known(type_name: str, types: _Types = typestore) -> bool:
    """Whether there is such a message type."""
    return full_name(type_name) in types().types


@cache
def kind(type_name: str, types: _Types = typestore) -> type[Message]:
    """The class of a type's messages, for those that are made often; it takes all fields."""
    return types().types[full_name(type_name)]


def new(type_name: str, types: _Types = typestore, /, **fields: object) -> Message:
    """A message; fields that are not given are zero, empty or a message of such.

    A mapping may take the place of a message in it, as `position={"x": 1.0}`; x, y, z that of a point or a vector, and
    w, x, y, z that of a quaternion.
    """
    known = _fields(type_name, types)
    values = {name: _field_value(known[name], value, types) for name, value in fields.items()}
    for name, what in known.items():
        if name not in values:
            values[name] = _default(what, types)
    return kind(type_name, types)(**values)


def encode(message: Message, type_name: str) -> bytes:
    """The message as TCPROS and ROS 1's bags hold it, without its length."""
    return bytes(typestore().serialize_ros1(message, full_name(type_name)))


def decode(raw: bytes | memoryview, type_name: str) -> Message:
    """A message from its bytes.

    Raises:
        CommandError: they are no such message.
    """
    try:
        return typestore().deserialize_ros1(raw, full_name(type_name))
    except Exception as error:  # rosbags raises what numpy and struct raise
        raise CommandError(f"{len(raw)} bytes are not a {type_name}: {error}") from error


@cache
def definition(type_name: str) -> str:
    """A type's definition and those of the types that it uses, made from their fields, without comments."""
    return typestore().generate_msgdef(full_name(type_name))[0]


@cache
def own_text(type_name: str) -> str:
    """A type's own definition, with ROS's comments if ROS's class of it is installed here."""
    package, _, name = type_name.rpartition("/")
    for folder in (*sys.path, CLASSES):
        file = Path(folder, package, "msg", f"_{name}.py")
        found = _CLASS.search(file.read_text("utf-8", "replace")) if file.is_file() else None
        if found and found[1] == md5sum(type_name):
            return str(ast.literal_eval(found[2])).partition(MEMBER)[0]
    file = DEFINITIONS / f"{type_name}.msg"
    return file.read_text("utf-8") if file.is_file() else definition(type_name).partition(MEMBER)[0]


@cache
def full_text(type_name: str) -> str:
    """A type's definition and those of the types that it uses, for the header of a connection.

    `rosbag check` compares it, comments too, with the text of the class that it finds.
    """
    used = (part.partition("\n")[0] for part in definition(type_name).split(MEMBER)[1:])
    return MEMBER.join([own_text(type_name), *(f"{name}\n{own_text(name)}" for name in used)])


@cache
def md5sum(type_name: str) -> str:
    """The md5 sum of a message type."""
    return typestore().generate_msgdef(full_name(type_name))[1]


@cache
def service_md5sum(type_name: str) -> str:
    """The md5 sum of a service type."""
    text = _md5_text(f"{type_name}Request") + _md5_text(f"{type_name}Response")
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def stamp(time: float) -> Message:
    """A moment [s] as ROS has it."""
    nanoseconds = round(time * 1e9)
    return kind("builtin_interfaces/Time")(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def duration(seconds: float) -> Message:
    """A span of time [s] as ROS has it; both its numbers have its sign."""
    whole, part = divmod(round(abs(seconds) * 1e9), 1_000_000_000)
    sign = -1 if math.copysign(1.0, seconds) < 0.0 else 1
    return kind("builtin_interfaces/Duration")(sec=sign * whole, nanosec=sign * part)


@cache
def _fields(type_name: str, types: _Types) -> Mapping[str, FieldDesc]:
    """Fields of a type, and what rosbags knows of each."""
    return dict(types().fielddefs[full_name(type_name)][1])


def _field_value(field: FieldDesc, value: object, types: _Types) -> object:
    if isinstance(value, Mapping):
        return new(field[1], types, **value)
    if not isinstance(value, list | tuple | np.ndarray):
        return value
    if field[0] == Nodetype.NAME:
        return kind(field[1], types)(**dict(zip(_AXES[field[1]], map(float, value), strict=True)))
    return np.asarray(value, _dtype(field)).reshape(-1) if _dtype(field) else value


def _default(field: FieldDesc, types: _Types) -> object:
    """The value of a field that was not given."""
    node, about = field
    if node == Nodetype.BASE:
        return {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}.get(about[0], 0)
    if node == Nodetype.NAME:
        return new(about, types)
    inner, count = about
    if kind_of_numbers := _dtype(field):
        return np.zeros(count if node == Nodetype.ARRAY else 0, kind_of_numbers)
    return [_default(inner, types) for _ in range(count)] if node == Nodetype.ARRAY else []


def _dtype(field: FieldDesc) -> str:
    """NumPy's type of the elements of an array of numbers; empty for any other field."""
    node, about = field
    if node not in {Nodetype.ARRAY, Nodetype.SEQUENCE} or about[0][0] != Nodetype.BASE or about[0][1][0] == "string":
        return ""
    return layout(about[0][1][0])


def layout(type_name: str) -> str:
    """NumPy's name of a primitive type of numbers; bytes are unsigned, as in rosbags."""
    return "uint8" if type_name in {"byte", "char"} else type_name


def _md5_text(type_name: str) -> str:
    """The text whose md5 sum ROS compares: the definition, with the sums of other messages in place of their types."""
    own = definition(type_name).partition(MEMBER)[0]
    return "\n".join(_md5_line(line) for line in own.splitlines() if line)


def _md5_line(line: str) -> str:
    its_type, _, name = line.partition(" ")
    base = its_type.partition("[")[0]
    return f"{md5sum(base)} {name}" if "/" in base else line


INTEGERS = {name: (int(np.iinfo(layout(name)).min), int(np.iinfo(layout(name)).max)) for name in _INTEGER_TYPES}
"""Least and largest value of each integer type."""


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
    """All message types in order, in which names from clients are looked up: caches of this module keep their names."""
    return dict.fromkeys(sorted(ros1_name(name) for name in typestore().types))


def known_type(type_name: str) -> str:
    """A message type's name as ROS 1 has it.

    Raises:
        UnknownNameError: the type is unknown.
    """
    name = ros1_name(type_name)
    if name not in known_types():
        raise UnknownNameError("message type", type_name, known_types())
    return name


@cache
def fields(type_name: str) -> Mapping[str, Field]:
    """A message's fields by name, in their order."""
    return {key: _field(key, kind) for key, kind in _fields(type_name, typestore).items() if key != PADDING}


def _field(name: str, kind: FieldDesc) -> Field:
    node, about = kind
    if node in {Nodetype.ARRAY, Nodetype.SEQUENCE}:
        inner, count = about
        return Field(name, _type_name(inner), count if node == Nodetype.ARRAY else 0)
    return Field(name, _type_name(kind), -1)


def _type_name(kind: FieldDesc) -> str:
    node, about = kind
    if node == Nodetype.BASE:
        return str(about[0])
    name = ros1_name(str(about))
    return _BUILT_IN.get(name, name)
