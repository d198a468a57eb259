"""The file of a run that goes on: blocks with a checksum each, appended as they come, read up to the first bad one.

Nothing in it is encoded for a viewer yet; `encoding` does that when the run is over.
"""

from __future__ import annotations

import functools
import struct
import time
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from vrx_mj.errors import RecordError
from vrx_mj.recording.parts import FRAMES, STATES, Cell, Part, block_of, parts_of

MAGIC = b"VRXMJRAW"
"""How such a file begins; the version comes next."""
VERSION = 1
HEAD, FRAME = struct.Struct("<8sI"), struct.Struct("<QI")
"""Beginning of the file: mark and version. Before each block: its length [bytes] and its CRC-32."""
FLUSH = 1.0
"""Wall time between flushes [s]."""
_JOINED = (STATES, FRAMES)
"""Entities of small parts, which cost as much as their headers."""


class RawFile:
    """A file to which parts are appended."""

    def __init__(self, path: Path) -> None:
        """Begin it, in place of what is there.

        Raises:
            OSError: it cannot be written.
        """
        self._stream = path.open("wb")
        self._stream.write(HEAD.pack(MAGIC, VERSION))
        self._due = 0.0
        self._entity, self._columns = "", dict[str, list[Cell]]()

    def append(self, entity: str, columns: Mapping[str, Sequence[Cell]]) -> None:
        """Append a part; states that come one after another, and frames, are one part, written with the next flush.

        Raises:
            OSError: it cannot be written; then the file is closed.
        """
        now = time.monotonic()
        try:
            if entity != self._entity:
                self._write()
                self._entity, self._columns = entity, {}
            for name, cells in columns.items():
                self._columns.setdefault(name, []).extend(cells)
            if entity not in _JOINED or now >= self._due:
                self._write()
            if now >= self._due:
                self._due = now + FLUSH
                self._stream.flush()
        except OSError:
            with suppress(OSError):
                self._stream.close()
            raise

    def _write(self) -> None:
        if self._entity:
            pieces = block_of(self._entity, self._columns)
            self._entity = ""
            checksum = functools.reduce(lambda total, piece: zlib.crc32(piece, total), pieces, 0)
            self._stream.writelines([FRAME.pack(sum(map(len, pieces)), checksum), *pieces])

    def close(self) -> None:
        """Write what is left.

        Raises:
            OSError: it cannot be written.
        """
        with self._stream:
            self._write()


def is_raw(path: Path) -> bool:
    """Whether a file begins as these do."""
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def raw_parts(path: Path) -> Iterator[Part]:
    """The parts of a file, one after another, up to where it was cut or is damaged.

    Raises:
        RecordError: it is of another version, or nothing of it is whole.
    """
    count, left = 0, path.stat().st_size
    with path.open("rb") as stream:
        mark, version = HEAD.unpack(stream.read(HEAD.size).ljust(HEAD.size, b"\0"))
        if (mark, version) != (MAGIC, VERSION):
            found = f"version {version}; this version reads {VERSION}"
            raise RecordError(f"'{path}' is the recording of a run that was not closed, {found}")
        while len(frame := stream.read(FRAME.size)) == FRAME.size:
            length, checksum = FRAME.unpack(frame)
            if length > left or zlib.crc32(block := stream.read(length)) != checksum:
                break
            try:
                yield from parts_of(memoryview(block))
            except ValueError as error:
                raise RecordError(f"'{path}' is damaged: {str(error).splitlines()[0]}") from error
            count += 1
    if not count:
        raise RecordError(f"'{path}' is damaged: nothing of the run is in it")
