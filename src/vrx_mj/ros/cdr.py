"""ROS 2's messages: their types, and their bytes as DDS carries them.

What the table makes are ROS 1's messages. Most have the same fields in ROS 2, but for the header's `seq`, which is not
written; the others are converted, and what only ROS 2 has is zero or empty. Types that ROS 1 has not are made by
`kind`. Types are named as in ROS 1, `sensor_msgs/Imu`.
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from rosbags.convert.converter import is_same_wireformat, migrate_message
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores
from rosbags.typesys.store import Typestore

from vrx_mj.errors import CommandError
from vrx_mj.ros import messages
from vrx_mj.ros.messages import FieldDesc, Message, full_name

DEFINITIONS = Path(__file__).parent / "definitions_ros2"
"""Folder of the definitions of ROS 2's types."""
_AS_IN_ROS_1 = tuple(
    messages.DEFINITIONS / name
    for name in (
        "geographic_msgs/GeoPoint.msg", "geographic_msgs/GeoPose.msg", "nmea_msgs/Sentence.msg",
        "robot_localization/FromLL.srv", "robot_localization/ToLL.srv", "vision_msgs/Detection2DArray.msg",
    )
)  # fmt: skip
"""Definitions that are those of ROS 1."""
_ENCODINGS = (b"\x00\x00", b"\x00\x01")
"""Big-endian and little-endian."""
_HEADER_SIZE = 4
"""Size of the header of a message [bytes]."""


@cache
def typestore() -> Typestore:
    """Every type that is known, as ROS 2 Jazzy has it."""
    return messages.typestore(Stores.ROS2_JAZZY, DEFINITIONS, _AS_IN_ROS_1)


def kind(type_name: str) -> type[Message]:
    """The class of a type's messages; it takes all fields."""
    return messages.kind(type_name, typestore)


def new(type_name: str, **fields: object) -> Message:
    """A message, as `messages.new` makes those of ROS 1."""
    return messages.new(type_name, typestore, **fields)


@cache
def fields(type_name: str) -> Sequence[tuple[str, str | None]]:
    """Names of a type's fields in their order, each with the message type that it has or is a list of."""
    return tuple((name, _message_in(what)) for name, what in typestore().fielddefs[full_name(type_name)][1])


def encode(message: Message, type_name: str) -> bytes:
    """The message in CDR, with the four bytes before it that name its encoding."""
    name = full_name(type_name)
    if _differs(name) and not isinstance(message, kind(type_name)):
        message = migrate_message(messages.typestore(), typestore(), name, name, {}, message)
    return bytes(typestore().serialize_cdr(message, name))


def decode(raw: bytes, type_name: str) -> Message:
    """A message from its bytes; some senders leave a few more after them.

    Raises:
        CommandError: they are no such message.
    """
    try:
        if raw[:2] not in _ENCODINGS or len(raw) < _HEADER_SIZE:
            raise ValueError(f"they begin with {raw[:_HEADER_SIZE].hex(' ')}, which is not plain CDR")
        read = typestore().get_msgdef(full_name(type_name))
        parse = read.deserialize_cdr_le if raw[1] else read.deserialize_cdr_be
        return parse(memoryview(raw)[_HEADER_SIZE:], 0, read.cls, typestore())[0]
    except Exception as error:  # rosbags raises what numpy and struct raise
        raise CommandError(f"{len(raw)} bytes are not a {type_name}: {error}") from error


@cache
def _differs(name: str) -> bool:
    """Whether ROS 1 has other fields in a type than ROS 2, or other names: `visualization_msgs/msg/Marker`."""
    before, now = (store.fielddefs.get(name) for store in (messages.typestore(), typestore()))
    if before is None or now is None or name.endswith("/Header"):
        return False
    alike = [field for field, _ in before[1]] == [field for field, _ in now[1]]
    return not (alike and is_same_wireformat(messages.typestore(), typestore(), name, name))


def _message_in(field: FieldDesc) -> str | None:
    node, about = field
    if node == Nodetype.NAME:
        return str(about).replace("/msg/", "/")
    return None if node == Nodetype.BASE else _message_in(about[0])
