"""The header that opens a connection of TCPROS: fields `name=value`, each with its length before it."""

import struct
from collections.abc import Mapping

from vrx_mj.errors import CommandError

__all__ = ["LARGEST_HEADER", "decode_header", "encode_header", "framed"]

LARGEST_HEADER = 1 << 18
"""Bytes of a header, at most: definitions of messages have up to some 10,000."""
MOST_FIELDS = 64
_LENGTH = struct.Struct("<I")


def framed(body: bytes) -> bytes:
    """With its length before it, as all is sent."""
    return _LENGTH.pack(len(body)) + body


def encode_header(fields: Mapping[str, str]) -> bytes:
    """The header with its length before it."""
    return framed(b"".join(framed(f"{name}={value}".encode()) for name, value in fields.items()))


def decode_header(raw: bytes) -> dict[str, str]:
    """Fields of a header that comes without its length; of a field that comes twice the last.

    Raises:
        CommandError: it is invalid.
    """
    fields: dict[str, str] = {}
    at = 0
    while at < len(raw):
        if len(raw) - at < _LENGTH.size:
            raise CommandError(f"truncated header: it ends inside the length of a field, at byte {at}")
        (size,) = _LENGTH.unpack_from(raw, at)
        at += _LENGTH.size
        if size > len(raw) - at:
            raise CommandError(f"a header's field has {size} bytes where {len(raw) - at} are left")
        name, equals, value = raw[at : at + size].decode("utf-8", "replace").partition("=")
        if not equals or len(fields) >= MOST_FIELDS:
            raise CommandError(
                "a header's field has no '='" if not equals else f"more than {MOST_FIELDS} fields in a header"
            )
        fields[name] = value
        at += size
    return fields
