"""Messages as rosbridge carries them: read strictly from JSON, written as JSON, PNG and CBOR."""

import base64
import io
import itertools
import json
import math
import re
import reprlib
import secrets
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple, cast

import cbor2
import numpy as np
import numpy.typing as npt
from PIL import Image

from vrx_mj.errors import CommandError, nearest
from vrx_mj.ros import messages
from vrx_mj.ros.limits import Frame, pieces
from vrx_mj.ros.messages import INTEGERS, MOMENT, SPAN, Field, Message, fields, layout
from vrx_mj.ros.parameters import join_names

_Numbers = npt.NDArray[Any]
_EFFORT = 1
"""zlib's level: a loop that serves everybody has no time for a higher one."""
MOST_INCOMING = 4 << 20
"""Largest message from a client [bytes], also after it was put together from fragments."""
_MOST_TEXT = 256
"""Longest name, type or id [characters]."""
_MOST_QUEUE = 1000
"""Longest queue that a client may ask for."""
_COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")
"""Compressions that a client may ask for."""
_NAME = re.compile(r"/?[A-Za-z][A-Za-z0-9_/]*")
"""A legal name."""
_FLOAT32_MAX = float(np.finfo(np.float32).max)
"""Largest number of type float32."""
_FLOATS = frozenset({"float32", "float64"})
"""Types of floating-point numbers."""
_TIME_FIELDS = {"secs": "sec", "nsecs": "nanosec", "sec": "sec", "nanosec": "nanosec"}
"""Names of a time's fields, in ROS 1 and in ROS 2."""
_SHOWN = 60
"""Largest number of characters of a wrong value that is shown."""
_BYTES = frozenset({"uint8", "char"})
"""Types of arrays that are sent as base64."""
_MIN_MESSAGE = 500
"""Approximate least size of a message [bytes]."""
_TYPED_ARRAYS = {
    "byte": 72,
    "int8": 72,
    "uint16": 69,
    "uint32": 70,
    "uint64": 71,
    "int16": 77,
    "int32": 78,
    "int64": 79,
    "float32": 85,
    "float64": 86,
}
"""Tag (RFC 8746) of an array of each type, little end first."""
_MOST_FRAGMENTS = 1000
"""Largest number of fragments of a message: a smaller fragment_size is raised."""
_PLACEHOLDER = secrets.token_hex(16)
"""Placeholder of bytes in JSON until they are filled in: no client can send it."""


def png(text: bytes) -> str:
    """The text as RGB pixels filled up with newlines, in base64."""
    width = max(1, math.isqrt(len(text) // 3))
    height = max(1, math.ceil(len(text) / (3 * width)))
    image = Image.frombytes("RGB", (width, height), text.ljust(3 * width * height, b"\n"))
    file = io.BytesIO()
    image.save(file, "png", compress_level=_EFFORT)
    return base64.b64encode(file.getvalue()).decode("ascii")


def from_png(data: str, largest: int) -> str:
    """The text in a PNG of at most so many bytes of pixels.

    Raises:
        CommandError: the data are not such a PNG.
    """
    try:
        raw = base64.b64decode(data, validate=True)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with Image.open(io.BytesIO(raw), formats=("png",)) as image:
                if 3 * image.width * image.height > largest:
                    raise CommandError(f"a png of {image.width} x {image.height}: at most {largest // 3} pixels")
                return image.convert("RGB").tobytes().decode("utf-8").strip("\n")
    except CommandError:
        raise
    except Exception as error:  # Pillow raises what each of its parts does
        raise CommandError("data is not a base64 PNG that holds text") from error


Operation = Mapping[str, Any]
"""A client's message."""


class Options(NamedTuple):
    """How a client wants messages."""

    throttle: float = 0.0
    """Wall time between two, at least [s]."""
    queue: int = 0
    """How many may wait, at most; 0: as many as the client's queue holds."""
    fragment_size: int = 0
    """Characters; 0: whole."""
    compression: str = "none"

    @property
    def is_binary(self) -> bool:
        """Whether frames are bytes, not text."""
        return self.compression.startswith("cbor")


def operation(data: str | bytes) -> Operation:
    """A message from its text.

    Raises:
        CommandError: it is not a JSON object with an operation.
    """
    try:
        made = json.loads(data)
    except (ValueError, RecursionError) as error:
        start = reprlib.repr(data if isinstance(data, str) else bytes(data))
        raise CommandError(f"a message is not JSON: {error}; it starts with {start}") from error
    if not isinstance(made, dict) or not isinstance(made.get("op"), str):
        raise CommandError(f"a message must be a JSON object with a string 'op', got {reprlib.repr(made)}")
    return made


def text(message: Operation, key: str, default: str | None = None) -> str:
    """A string of an operation; without a default it has to be there."""
    value = message.get(key, default)
    if value is None:
        value = default
    if not isinstance(value, str):
        missing = "is missing" if key not in message else f"{reprlib.repr(value)} is not a string"
        raise CommandError(f"{message['op']}: {key} {missing}")
    if len(value) > _MOST_TEXT:
        raise CommandError(f"{message['op']}: {key} has {len(value)} characters; at most {_MOST_TEXT}")
    return value


def number(message: Operation, key: str, largest: float) -> float:
    """A number of an operation from 0 on; 0 by default."""
    value = message.get(key)
    if value is None:
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= largest:
        raise CommandError(
            f"{message['op']}: invalid {key} {reprlib.repr(value)}; allowed: a number from 0 to {largest:g}"
        )
    return float(value)


def flag(message: Operation, key: str, default: bool) -> bool:
    """A truth value of an operation."""
    value = message.get(key)
    if not isinstance(value, bool | None):
        raise CommandError(f"{message['op']}: invalid {key} {reprlib.repr(value)}; allowed: true, false")
    return default if value is None else value


def options(message: Operation) -> Options:
    """How a subscription or a call wants to be answered."""
    compression = text(message, "compression", "none")
    if compression not in _COMPRESSIONS:
        known = ", ".join(_COMPRESSIONS)
        raise CommandError(f"{message['op']}: invalid compression {compression!r}; allowed: {known}")
    return Options(
        throttle=number(message, "throttle_rate", 1e9) / 1000.0,
        queue=min(int(number(message, "queue_length", 1e9)), _MOST_QUEUE),
        fragment_size=int(number(message, "fragment_size", 1e9)),
        compression=compression,
    )


def absolute(name: str) -> str:
    """A topic's, service's or parameter's name with its slash; CommandError: it is invalid."""
    if _NAME.fullmatch(name) is None or len(name) > _MOST_TEXT:
        raise CommandError(
            f"{name[:_MOST_TEXT]!r} is not a name: at most {_MOST_TEXT} letters, digits, '_' and '/', a letter first"
        )
    return join_names(name)


_short = reprlib.Repr()
_short.maxstring = _short.maxlong = _short.maxother = _SHOWN


def message_of(value: object, type_name: str, now: float, place: str) -> Message:
    """The message that a JSON object describes, at a moment [s]; errors name its `place`.

    Raises:
        CommandError: a field is unknown or has a wrong value; it names the field, the value and what is allowed.
    """
    if not isinstance(value, Mapping):
        raise _wrong(place, value, f"an object with the fields of {type_name}")
    known = fields(type_name)
    for name in value:
        if name not in known:
            raise CommandError(f"{place}: {type_name} has no field {_value_text(name)}; {_known_names(name, known)}")
    given = {name: _field(value[name], known[name], now, f"{place}.{name}") for name in value}
    for name, field in known.items():
        if name not in given and field.type == "std_msgs/Header" and field.length < 0:
            given[name] = message_of({}, field.type, now, place)
    if type_name == "std_msgs/Header":
        given.setdefault("stamp", messages.stamp(now))
    return messages.new(type_name, **given)


def request(arguments: object, type_name: str, now: float, place: str) -> Message:
    """A service's request, from an object, or from a list of its fields' values in their order.

    Raises:
        CommandError: as `message_of` does, and where the list is too long.
    """
    if isinstance(arguments, list):
        names = list(fields(type_name))
        if len(arguments) > len(names):
            raise CommandError(f"{place}: {len(arguments)} arguments; {type_name} has {len(names)} fields")
        arguments = dict(zip(names, arguments, strict=False))
    return message_of({} if arguments is None else arguments, type_name, now, place)


def _field(value: object, field: Field, now: float, place: str) -> object:
    if field.length < 0:
        return _single(value, field.type, now, place)
    if field.type in _BYTES and isinstance(value, str):
        value = _decode_base64(value, place)
    elif not isinstance(value, list):
        raise _wrong(place, value, f"a list of {field.type}")
    if field.length and len(value) != field.length:
        raise CommandError(f"{place}: {len(value)} values; {field.type}[{field.length}] has {field.length}")
    return _array(value, field.type, now, place)


def _array(values: bytes | list[object], type_name: str, now: float, place: str) -> object:
    if isinstance(values, bytes):
        return np.frombuffer(values, np.uint8)
    if type_name == "string" or type_name in {MOMENT, SPAN} or "/" in type_name:
        return _each(values, type_name, now, place)
    made = _numbers(values, type_name)
    return np.array(_each(values, type_name, now, place), layout(type_name)) if made is None else made


def _numbers(values: list[object], type_name: str) -> _Numbers | None:
    """An array of a list that is right as it is, which is quick for long ones; None where it holds null or worse."""
    kinds = set(map(type, values))
    if type_name in INTEGERS and kinds == {int}:
        low, high = INTEGERS[type_name]
        integers = cast("list[int]", values)
        return np.array(integers, layout(type_name)) if low <= min(integers) and max(integers) <= high else None
    if type_name not in _FLOATS or not kinds <= {int, float}:
        return None
    try:
        made = np.array(values, np.float64)
    except OverflowError:
        return None
    finite = made[np.isfinite(made)]
    too_large = type_name == "float32" and bool((np.abs(finite) > _FLOAT32_MAX).any())
    return None if too_large else made.astype(layout(type_name))


def _each(values: list[object], type_name: str, now: float, place: str) -> list[object]:
    made: list[object] = []
    for index, value in enumerate(values):
        try:
            made.append(_single(value, type_name, now, place))
        except CommandError:
            _single(value, type_name, now, f"{place}[{index}]")  # again, as to write the place for each would take long
            raise
    return made


def _single(value: object, type_name: str, now: float, place: str) -> object:
    if type_name in {MOMENT, SPAN}:
        return _moment(value, type_name, now, place)
    if "/" in type_name:
        return message_of(value, type_name, now, place)
    if type_name == "string":
        return _text(value, place)
    if type_name == "bool":
        if not isinstance(value, bool):
            raise _wrong(place, value, "true or false")
        return value
    return _integer(value, type_name, place) if type_name in INTEGERS else _float(value, type_name, place)


def _text(value: object, place: str) -> str:
    if not isinstance(value, str):
        raise _wrong(place, value, "a string")
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise _wrong(place, ascii(value), "a string of whole characters") from error
    return value


def _integer(value: object, type_name: str, place: str) -> int:
    low, high = INTEGERS[type_name]
    whole = isinstance(value, int) or (isinstance(value, float) and value.is_integer())
    if not isinstance(value, int | float) or isinstance(value, bool) or not whole or not low <= value <= high:
        raise _wrong(place, value, f"{type_name}, a whole number from {low} to {high}")
    return int(value)


def _float(value: object, type_name: str, place: str) -> float:
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(place, value, f"{type_name}, a number")
    try:
        number = float(value)
    except OverflowError as error:
        raise _wrong(place, value, f"{type_name}, a number") from error
    if type_name == "float32" and math.isfinite(number) and abs(number) > _FLOAT32_MAX:
        raise _wrong(place, value, f"{type_name}, a number of at most {_FLOAT32_MAX:.7g}")
    return number


def _moment(value: object, type_name: str, now: float, place: str) -> Message:
    if value == "now" and type_name == MOMENT:
        return messages.stamp(now)
    if not isinstance(value, Mapping):
        raise _wrong(place, value, f"a {type_name}, {{secs, nsecs}}")
    moment = messages.stamp(0.0) if type_name == MOMENT else messages.duration(0.0)
    for name, number in value.items():
        if name not in _TIME_FIELDS:
            raise CommandError(f"{place}: a {type_name} has no field {_value_text(name)}; known: secs, nsecs")
        whole = _integer(number, "int32", f"{place}.{name}")
        if type_name == MOMENT and whole < 0:
            raise _wrong(f"{place}.{name}", number, "a time of 0 or more")
        setattr(moment, _TIME_FIELDS[name], whole)
    return moment


def _decode_base64(text: str, place: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except ValueError as error:
        raise _wrong(place, text, f"base64 or a list of numbers ({error})") from error


def _wrong(place: str, value: object, allowed: str) -> CommandError:
    return CommandError(f"{place}: invalid value {_value_text(value)}; allowed: {allowed}")


def _value_text(value: object) -> str:
    """A value as far as it fits into a line."""
    text = _short.repr(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


def _known_names(name: str, known: Mapping[str, Field]) -> str:
    close = nearest(name, known) if len(name) <= _SHOWN else None
    return f"did you mean '{close}'?" if close else f"known: {', '.join(known) or 'none'}"


_Writer = Callable[[Any], Any]
_names = itertools.count()


class Base64:
    """Bytes in base64, which go past json: it would look at each character."""

    def __init__(self, data: bytes | memoryview) -> None:
        self.text = base64.b64encode(data)


class Parcel:
    """A message on its way to clients, written when the first one takes it."""

    def __init__(self, message: Message, type_name: str, time: float) -> None:
        self._message = message
        self._type = type_name
        self._time = time
        self.weight = _weight(message, type_name)
        """About how many bytes it is."""
        self._png: tuple[str, bytes] = ("", b"")
        """The topic's name and the picture of it, as a client wished it last: another one takes long to make."""
        self._bodies: dict[str, bytes] = {}

    def frames(self, topic: str, wish: Options) -> Iterable[Frame]:
        """Frames to send to a client that calls the topic so: of text, but of binary for the two CBORs."""
        if wish.is_binary:
            head = b"\xa3\x62op\x67publish\x65topic" + cbor2.dumps(topic) + b"\x63msg"  # a map of three
            return [(head, self._body(wish.compression))]
        parts: Frame = (b'{"op":"publish","topic":%b,"msg":' % json_bytes(topic), self._body("json"), b"}")
        if wish.compression == "png":
            if self._png[0] != topic:
                self._png = topic, json_bytes({"op": "png", "data": png(b"".join(parts))})
            parts = (self._png[1],)
        return _fragments(parts, wish.fragment_size)

    def _body(self, encoding: str) -> bytes:
        if encoding in self._bodies:
            return self._bodies[encoding]
        if encoding == "json":
            made = json_bytes(plain(self._message, self._type))
        elif encoding == "cbor":
            made = cbor2.dumps(_writers(self._type, True)(self._message), default=_cbor_number)
        else:
            secs, nsecs = divmod(round(self._time * 1e9), 1_000_000_000)
            made = cbor2.dumps({"secs": secs, "nsecs": nsecs, "bytes": messages.encode(self._message, self._type)})
        self._bodies[encoding] = made
        return made


def reply_frames(message: Mapping[str, object], wish: Options) -> list[Frame]:
    """Frames to send for an operation other than a topic's message."""
    if wish.is_binary:
        return [(cbor2.dumps(message, default=_cbor_number),)]
    whole = json_bytes(message)
    if wish.compression == "png":
        whole = json_bytes({"op": "png", "data": png(whole)})
    return list(_fragments((whole,), wish.fragment_size))


def plain(message: Message, type_name: str) -> dict[str, object]:
    """A message as what JSON knows, but for NaN and infinities."""
    made: dict[str, object] = _writers(type_name, False)(message)
    return made


def json_bytes(value: object) -> bytes:
    """JSON in ASCII, null for NaN and infinities."""
    found: list[bytes] = []

    def rest(part: object) -> object:
        if not isinstance(part, Base64):
            return _item(part)
        found.append(part.text)
        return _PLACEHOLDER

    try:
        text = json.dumps(value, allow_nan=False, separators=(",", ":"), default=rest)
    except ValueError:
        found.clear()
        text = json.dumps(_finite(value), allow_nan=False, separators=(",", ":"), default=rest)
    pieces = text.encode("ascii").split(_PLACEHOLDER.encode("ascii"))
    return b"".join(itertools.chain.from_iterable(zip(pieces, [*found, b""], strict=True)))


def _fragments(parts: Frame, size: int) -> Iterator[Frame]:
    """JSON cut into pieces of so many characters, if it is longer and that is not 0; each is made at its turn."""
    length = sum(map(len, parts))
    if size <= 0 or length <= size:
        yield parts
        return
    size = max(size, math.ceil(length / _MOST_FRAGMENTS))
    name, total = str(next(_names)), sum(math.ceil(len(part) / size) for part in parts)
    for number, piece in enumerate(pieces(parts, size)):
        data = {"op": "fragment", "id": name, "data": piece.decode("ascii"), "num": number, "total": total}
        yield (json_bytes(data),)


def _weight(message: Message, type_name: str) -> int:
    weight = _MIN_MESSAGE
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
def _writers(type_name: str, cbor: bool) -> _Writer:
    """Functions that turn a message of a type into a mapping."""
    parts = [(field.name, _writer(field, cbor)) for field in fields(type_name).values()]

    def write(message: Message) -> dict[str, object]:
        return {name: getattr(message, name) if part is None else part(getattr(message, name)) for name, part in parts}

    return write


def _writer(field: Field, cbor: bool) -> _Writer | None:
    """Function that turns a field's value into JSON's; None if it is that already."""
    if field.length < 0:
        return _single_writer(field.type, cbor)
    if field.type in _BYTES:
        if cbor:
            return lambda values: np.asarray(values, np.uint8).tobytes()
        return lambda values: Base64(np.ascontiguousarray(values, np.uint8).data)
    if cbor and field.type in _TYPED_ARRAYS:
        tag, little = _TYPED_ARRAYS[field.type], np.dtype(layout(field.type)).newbyteorder("<")
        return lambda values: cbor2.CBORTag(tag, np.asarray(values).astype(little).tobytes())
    one = _single_writer(field.type, cbor)
    if one is None:
        return lambda values: values.tolist() if isinstance(values, np.ndarray) else list(values)
    return lambda values: [one(value) for value in values]


def _single_writer(type_name: str, cbor: bool) -> _Writer | None:
    if type_name in {MOMENT, SPAN}:
        return lambda moment: {"secs": moment.sec, "nsecs": moment.nanosec}
    return _writers(type_name, cbor) if "/" in type_name else None


def _item(value: object) -> object:
    """A number of numpy's as Python's."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} cannot be written as JSON")


def _cbor_number(encoder: cbor2.CBOREncoder, value: object) -> None:
    encoder.encode(value.text.decode("ascii") if isinstance(value, Base64) else _item(value))


def _finite(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value
