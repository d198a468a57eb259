"""XML-RPC's calls and answers as bytes: read with bounds, without DTDs and entities, and written."""

import asyncio
import xmlrpc.client
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn
from xmlrpc.client import Binary, DateTime, Fault

import numpy as np

from vrx_mj.errors import CommandError

__all__ = ["Fault", "answer_bytes", "call_bytes", "fault_bytes", "plain", "read"]

DEEPEST = 128
"""Elements within each other: some forty levels of lists or structures."""
MOST_ELEMENTS = 400_000
BITE = 1 << 15
"""Bytes that are read before others get their turn."""
DEEPEST_VALUE = 32
INTEGERS = range(-(2**31), 2**31)


class _Unmarshaller(xmlrpc.client.Unmarshaller):
    """Python's, with bounds."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = self._elements = 0

    def start(self, tag: str, attrs: Mapping[str, str]) -> None:
        self._depth += 1
        self._elements += 1
        if self._depth > DEEPEST or self._elements > MOST_ELEMENTS:
            raise CommandError(f"more than {DEEPEST} elements within each other, or {MOST_ELEMENTS} in all")
        super().start(tag, dict(attrs))

    def end(self, tag: str) -> None:
        self._depth -= 1
        super().end(tag)


async def read(body: bytes | bytearray) -> tuple[tuple[Any, ...], str | None]:
    """Values and method of a call; of an answer its value and None.

    Raises:
        CommandError: it is no XML-RPC, or beyond the bounds.
        Fault: it is an answer that says so.
    """
    target = _Unmarshaller()
    parser: Any = xmlrpc.client.ExpatParser(target)
    parser._parser.StartDoctypeDeclHandler = _refuse
    try:
        for at in range(0, len(body), BITE):
            parser.feed(body[at : at + BITE])
            if at:
                await asyncio.sleep(0)
        parser.close()
        return target.close(), target.getmethodname()
    except (CommandError, Fault):
        raise
    except Exception as error:  # Python's raises whatever its conversions raise
        raise CommandError(f"not XML-RPC: {type(error).__name__} {error}"[:200]) from None


def call_bytes(method: str, values: Sequence[Any]) -> bytes:
    """A call."""
    return xmlrpc.client.dumps(tuple(values), method).encode("utf-8", "xmlcharrefreplace")


def answer_bytes(value: Any) -> bytes:
    """An answer; one that cannot be written is a fault."""
    try:
        return xmlrpc.client.dumps((value,), methodresponse=True).encode("utf-8", "xmlcharrefreplace")
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        return fault_bytes(f"the answer cannot be written: {error}")


def fault_bytes(text: str) -> bytes:
    """An answer that tells of a failure."""
    return xmlrpc.client.dumps(Fault(1, text)).encode("utf-8", "xmlcharrefreplace")


def plain(value: Any, depth: int = 0) -> Any:
    """A value as XML-RPC can carry it: whole numbers that are too large become floats.

    Raises:
        CommandError: it cannot.
    """
    if depth > DEEPEST_VALUE:
        raise CommandError(f"a value is nested more than {DEEPEST_VALUE} deep")
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(name): plain(part, depth + 1) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part, depth + 1) for part in value]
    if isinstance(value, int) and value not in INTEGERS:
        return float(value)
    if not isinstance(value, str | int | float | Binary | DateTime):
        raise CommandError(f"a {type(value).__name__} is not a value of a parameter")
    return value


def _refuse(*_: object) -> NoReturn:
    raise CommandError("a document type is not allowed in XML-RPC")
