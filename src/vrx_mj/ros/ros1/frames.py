"""Cutting a stream of TCPROS into frames, each with its length before it."""

import struct

from vrx_mj.errors import CommandError
from vrx_mj.ros.intake import Intake, Place

__all__ = ["Splitter"]

_LENGTH = struct.Struct("<I")


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
