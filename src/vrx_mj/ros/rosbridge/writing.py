"""A message as rosbridge sends it: JSON, CBOR, and CBOR around ROS 1's own bytes.

JSON has null for NaN and infinities, and base64 for `uint8[]` and `char[]`. CBOR has bytes for these, and a typed
array (RFC 8746) for other arrays of numbers, as rosbridge_server does. A message is written once for each of the three,
however many clients take it.
"""

import base64
import itertools
import json
import math
import secrets
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import cbor2
import numpy as np

from vrx_mj.ros import messages
from vrx_mj.ros.messages import Message
from vrx_mj.ros.rosbridge.kinds import MOMENT, SPAN, Field, fields
from vrx_mj.ros.rosbridge.png import png

__all__ = ["Parcel", "json_bytes", "plain", "reply_frames"]

Writer = Callable[[Any], Any]
BYTES = frozenset({"uint8", "char"})
LIGHT = 500
"""What a message has at least, about [bytes]."""
TYPED_ARRAYS = {
    "byte": (72, "int8"),
    "int8": (72, "int8"),
    "uint16": (69, "<u2"),
    "uint32": (70, "<u4"),
    "uint64": (71, "<u8"),
    "int16": (77, "<i2"),
    "int32": (78, "<i4"),
    "int64": (79, "<i8"),
    "float32": (85, "<f4"),
    "float64": (86, "<f8"),
}
"""Tag (RFC 8746) and layout of an array of each type."""
MOST_FRAGMENTS = 1000
"""Fragments of a message, at most: a smaller fragment_size is raised."""
MARK = secrets.token_hex(16)
"""Stands for bytes in JSON until they are put there: nobody can send it."""
_names = itertools.count()


class Base64:
    """Bytes in base64, which go past json: it would look at each character."""

    def __init__(self, data: Any) -> None:
        self.text = base64.b64encode(data)


class Parcel:
    """A message on its way to clients, written when the first one takes it."""

    def __init__(self, message: Message, type_name: str, time: float) -> None:
        self._message = message
        self._type = type_name
        self._time = time
        self.weight = _weight(message, type_name)
        """About how many bytes it is."""
        self._made: dict[tuple[str, str, int], list[bytes]] = {}
        self._bodies: dict[str, bytes] = {}

    def frames(self, topic: str, compression: str, fragment_size: int) -> list[bytes]:
        """What to send, for a client that calls the topic so: frames of text, but of binary for the two CBORs."""
        key = (topic, compression, fragment_size)
        if key not in self._made:
            self._made[key] = self._frames(topic, compression, fragment_size)
        return self._made[key]

    def _frames(self, topic: str, compression: str, fragment_size: int) -> list[bytes]:
        if compression in {"cbor", "cbor-raw"}:
            head = b"\xa3\x62op\x67publish\x65topic" + cbor2.dumps(topic) + b"\x63msg"  # a map of three
            return [head + self._body(compression)]
        whole = b'{"op":"publish","topic":%b,"msg":%b}' % (json_bytes(topic), self._body("json"))
        if compression == "png":
            whole = json_bytes({"op": "png", "data": png(whole)})
        return fragments(whole, fragment_size)

    def _body(self, encoding: str) -> bytes:
        if encoding not in self._bodies:
            made = {"json": self._json, "cbor": self._cbor, "cbor-raw": self._raw}[encoding]()
            self._bodies[encoding] = made
        return self._bodies[encoding]

    def _json(self) -> bytes:
        return json_bytes(plain(self._message, self._type))

    def _cbor(self) -> bytes:
        return cbor2.dumps(_writers(self._type, True)(self._message), default=_number)

    def _raw(self) -> bytes:
        nanoseconds = round(self._time * 1e9)
        secs, nsecs = divmod(nanoseconds, 1_000_000_000)
        return cbor2.dumps({"secs": secs, "nsecs": nsecs, "bytes": messages.encode(self._message, self._type)})


def reply_frames(message: Mapping[str, Any], compression: str, fragment_size: int) -> tuple[list[bytes], bool]:
    """What to send of an operation that is no topic's message, and whether it is binary."""
    if compression in {"cbor", "cbor-raw"}:
        return [cbor2.dumps(message, default=_number)], True
    whole = json_bytes(message)
    if compression == "png":
        whole = json_bytes({"op": "png", "data": png(whole)})
    return fragments(whole, fragment_size), False


def plain(message: Message, type_name: str) -> dict[str, Any]:
    """A message as what JSON knows, but for NaN and infinities."""
    made: dict[str, Any] = _writers(type_name, False)(message)
    return made


def json_bytes(value: Any) -> bytes:
    """JSON in ASCII, null for NaN and infinities."""
    found: list[bytes] = []

    def rest(part: Any) -> Any:
        if not isinstance(part, Base64):
            return _item(part)
        found.append(part.text)
        return MARK

    try:
        text = json.dumps(value, allow_nan=False, separators=(",", ":"), default=rest)
    except ValueError:
        found.clear()
        text = json.dumps(_finite(value), allow_nan=False, separators=(",", ":"), default=rest)
    pieces = text.encode("ascii").split(MARK.encode("ascii"))
    return b"".join(itertools.chain.from_iterable(zip(pieces, [*found, b""], strict=True)))


def fragments(whole: bytes, size: int) -> list[bytes]:
    """JSON cut into pieces of so many characters, if it is longer and that is not 0."""
    if size <= 0 or len(whole) <= size:
        return [whole]
    size = max(size, math.ceil(len(whole) / MOST_FRAGMENTS))
    pieces = [whole[start : start + size].decode("ascii") for start in range(0, len(whole), size)]
    name = str(next(_names))
    return [
        json_bytes({"op": "fragment", "id": name, "data": piece, "num": number, "total": len(pieces)})
        for number, piece in enumerate(pieces)
    ]


def _weight(message: Message, type_name: str) -> int:
    weight = LIGHT
    for name, kind in _varying(type_name):
        value = getattr(message, name)
        if isinstance(value, np.ndarray):
            weight += value.nbytes
        elif "/" not in kind:
            weight += len(value)
        else:
            weight += sum(_weight(part, kind) for part in (value if isinstance(value, list) else [value]))
    return weight


@cache
def _varying(type_name: str) -> list[tuple[str, str]]:
    """Name and type of the fields whose size is not always the same."""
    found = []
    for field in fields(type_name).values():
        inner = "/" in field.type and bool(_varying(field.type))
        if field.length == 0 or field.type == "string" or inner:
            found.append((field.name, field.type))
    return found


@cache
def _writers(type_name: str, cbor: bool) -> Writer:
    """What turns a message of a type into a mapping."""
    parts = [(field.name, _writer(field, cbor)) for field in fields(type_name).values()]

    def write(message: Message) -> dict[str, Any]:
        return {name: getattr(message, name) if part is None else part(getattr(message, name)) for name, part in parts}

    return write


def _writer(field: Field, cbor: bool) -> Writer | None:
    """What turns a field's value into what is written; None: it is that already."""
    if field.length < 0:
        return _single(field.type, cbor)
    if field.type in BYTES:
        return _bytes if cbor else _base64
    if cbor and field.type in TYPED_ARRAYS:
        tag, layout = TYPED_ARRAYS[field.type]
        return lambda values: cbor2.CBORTag(tag, np.asarray(values).astype(layout).tobytes())
    one = _single(field.type, cbor)
    return _list if one is None else lambda values: [one(value) for value in values]


def _single(type_name: str, cbor: bool) -> Writer | None:
    if type_name in {MOMENT, SPAN}:
        return lambda moment: {"secs": moment.sec, "nsecs": moment.nanosec}
    return _writers(type_name, cbor) if "/" in type_name else None


def _bytes(values: Any) -> bytes:
    return values.tobytes() if isinstance(values, np.ndarray) else bytes(values)


def _base64(values: Any) -> Base64:
    return Base64(np.ascontiguousarray(values).data if isinstance(values, np.ndarray) else bytes(values))


def _list(values: Any) -> list[Any]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def _item(value: Any) -> Any:
    """A number of numpy's as Python's."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} cannot be written as JSON")


def _number(encoder: cbor2.CBOREncoder, value: Any) -> None:
    encoder.encode(value.text.decode("ascii") if isinstance(value, Base64) else _item(value))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value
