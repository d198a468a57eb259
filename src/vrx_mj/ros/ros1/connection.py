"""The bytes of a connection of TCPROS: its header and its frames, each with its length before it."""

import struct
from collections.abc import Mapping

from vrx_mj.errors import CommandError
from vrx_mj.ros.limits import Intake, Place

LARGEST_HEADER = 1 << 18
"""Bytes of a header, at most: definitions of messages have up to some 10,000."""
LARGEST_CALL = 1 << 24
"""Bytes of a request to a service, or of its response, at most: a robot's description has up to some MB."""
_LENGTH = struct.Struct("<I")


def with_length(body: bytes) -> bytes:
    """The bytes of a frame: the length, then the body."""
    return _LENGTH.pack(len(body)) + body


def encode_header(fields: Mapping[str, str]) -> bytes:
    """The header with its length before it."""
    return with_length(b"".join(with_length(f"{name}={value}".encode()) for name, value in fields.items()))


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
        if not equals:
            raise CommandError("a header's field has no '='")
        fields[name] = value
        at += size
    return fields


class Splitter:
    """Takes pieces of a stream, gives frames. `intake` bounds what all that share it hold."""

    def __init__(self, largest: int, intake: Intake, place: Place) -> None:
        self.largest = largest
        """Bytes of a frame, at most."""
        self._intake, self._place = intake, place
        self._buffer = bytearray()
        self._at = 0

    def __len__(self) -> int:
        """Bytes that wait."""
        return len(self._buffer) - self._at

    def feed(self, data: bytes) -> None:
        """Add a piece.

        Raises:
            CommandError: all together hold too much.
        """
        if self._at:
            del self._buffer[: self._at]
            self._at = 0
        self._buffer += data
        self._intake.hold(self._place, len(self))

    def take(self) -> bytes | None:
        """The next frame, without its length; None if it has not come yet.

        Raises:
            CommandError: it would be too large.
        """
        if len(self) < _LENGTH.size:
            return None
        (size,) = _LENGTH.unpack_from(self._buffer, self._at)
        if size > self.largest:
            raise CommandError(f"a frame of {size} bytes, where at most {self.largest} are allowed")
        if len(self) < _LENGTH.size + size:
            return None
        start = self._at + _LENGTH.size
        self._at = start + size
        self._intake.hold(self._place, len(self))
        return bytes(memoryview(self._buffer)[start : self._at])

    def rest(self) -> bytes:
        """Take all that waits, whatever it is."""
        rest = bytes(self._buffer[self._at :])
        self._intake.hold(self._place, 0)
        self._buffer.clear()
        self._at = 0
        return rest
