"""Plain data as a block of bytes: JSON, and beside it the bytes of arrays."""

import dataclasses
import json
import re
import struct
import sys
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from functools import lru_cache
from pathlib import PurePath
from typing import Any, TypedDict, TypeVar

LENGTH = struct.Struct("<Q")
"""Length of the JSON [bytes], before it."""
_ARRAY, _BYTES = "\0array", "\0bytes"
"""Keys of what stands for an array, by its type, shape and place, and for bytes."""
_NUMBERS = re.compile(r"[<|][fiub][0-9]{1,2}")
_T = TypeVar("_T")


class Limits(TypedDict):
    """Limits on a job: memory [bytes], processor time [s], bytes of the answer, and whether it may start threads."""

    memory: int
    seconds: int
    answer: int
    threads: bool


class Job(TypedDict):
    """A job: a function of a module, its arguments, or those of `each` of several calls, and its rights."""

    module: str
    function: str
    arguments: Sequence[object]
    each: Sequence[Sequence[object]] | None
    reads: Sequence[str]
    folder: str
    limits: Limits


class Answer(TypedDict, total=False):
    """Outcome of a job: a value, an error or a fault of its reader; warnings; and the files that it depends on."""

    value: object
    error: tuple[str, object]
    """Class and arguments."""
    fault: str
    warnings: list[str]
    files: Mapping[str, tuple[str, str]] | None
    """States of files by their use; None: they changed meanwhile."""


def pack(value: object) -> bytes:
    """A block of dataclasses, models, mappings, sequences, texts, numbers, paths, bytes and arrays.

    Raises:
        TypeError: there is something else in it.
    """
    blobs: list[bytes] = []
    text = json.dumps(value, default=lambda other: _plain(other, blobs)).encode()
    return b"".join([LENGTH.pack(len(text)), text, *blobs])


def _plain(value: Any, blobs: list[bytes]) -> Any:
    """A value that JSON does not know, as one that it knows."""
    if dataclasses.is_dataclass(value):
        return {field.name: getattr(value, field.name) for field in dataclasses.fields(value) if field.init}
    if hasattr(value, "model_fields_set"):
        return {name: getattr(value, name) for name in sorted(value.model_fields_set)}
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, AbstractSet):
        return list(value)
    if isinstance(value, PurePath):
        return str(value)
    return _blob(value, blobs)


def _blob(value: Any, blobs: list[bytes]) -> Any:
    """Bytes, or a number or an array of numpy's, which need not be imported."""
    numpy = sys.modules.get("numpy")
    if isinstance(value, bytes | bytearray | memoryview):
        return {_BYTES: _place(bytes(value), blobs)}
    if numpy is not None and isinstance(value, numpy.generic):
        return value.item()
    if numpy is None or not isinstance(value, numpy.ndarray):
        raise TypeError(f"a value of type {type(value).__name__} is not plain data")
    return {_ARRAY: [value.dtype.str, list(value.shape), _place(value.tobytes(), blobs)]}


def _place(blob: bytes, blobs: list[bytes]) -> int:
    """The number of a blob, after its length and those before."""
    blobs += [LENGTH.pack(len(blob)), blob]
    return len(blobs) // 2 - 1


def unpack(block: bytes) -> Any:
    """The value that `packed` was given, with dictionaries for dataclasses and lists for all sequences.

    Raises:
        ValueError: the block is damaged.
    """
    try:
        view, (length,) = memoryview(block), LENGTH.unpack_from(block)
        place, blobs = LENGTH.size + length, list[memoryview]()
        while place < len(view):
            (size,) = LENGTH.unpack_from(view, place)
            place += LENGTH.size + size
            blobs.append(view[place - size : place])
            if len(blobs) > length:  # each has a name of more than one byte
                raise ValueError("damaged: bytes that are nowhere")
        text = bytes(view[LENGTH.size : LENGTH.size + length])
        return json.loads(text, object_hook=lambda found: _restore(found, blobs))
    except (struct.error, IndexError, TypeError, RecursionError) as error:
        raise ValueError(f"damaged: {error}") from None


def _restore(found: dict[str, Any], blobs: list[memoryview]) -> Any:
    if _BYTES in found:
        return bytes(blobs[found[_BYTES]])
    if _ARRAY in found:
        import numpy as np

        kind, shape, number = found[_ARRAY]
        if not _NUMBERS.fullmatch(kind):
            raise ValueError(f"an array of type {kind}")
        return np.frombuffer(blobs[number], kind).reshape(shape).copy()
    return found


def validate(value: object, kind: type[_T]) -> _T:
    """Unpacked data as the type that it must be of.

    Raises:
        ValueError: it is not.
    """
    found: _T = _adapter((kind,)).validate_python((value,), strict=False)[0]
    return found


@lru_cache(maxsize=64)
def _adapter(kinds: tuple[Any]) -> Any:
    from pydantic import ConfigDict, TypeAdapter

    rows: Any = tuple.__class_getitem__(kinds)
    return TypeAdapter(rows, config=ConfigDict(arbitrary_types_allowed=True))
