"""The parts of a recording, by entity and column, and the files that hold them: a run's own, and rerun's.

To the file of a run that goes on parts are appended, each a block of plain data with a checksum: it is read up to the
first bad one. Nothing in it is encoded for a viewer yet; `encoding` does that when the run is over.

What a rerun file holds is parsed in the sandboxed process: a file that ends the parser is an error, and no more. That
process may take as much memory and processor time as a recording of this size can need. What it hands back is checked
here as if it came from the file.
"""

from __future__ import annotations

import os
import shutil
import struct
import sys
import tempfile
import time
import uuid
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import TypeAdapter

from vrx_mj.config.kinds import wrong_kind
from vrx_mj.errors import RecordError
from vrx_mj.foreign import ReaderError, ask
from vrx_mj.foreign.plain import LENGTH, pack, unpack, validate
from vrx_mj.outputs import begins, writing
from vrx_mj.runtime.state import MAX_TIME

APPLICATION = "vrx_mj"
"""Application that rerun's files name."""
RUN, ROWS, STATES, EVENTS = "/record/run", "/record/rows", "/record/states", "/events"
FRAMES, COMPANIES = "/record/frames", "/record/companies"
"""Entities that are read, besides those of sensors."""

Cell = str | bytes | npt.NDArray[Any] | None
"""A text, bytes, or numbers; None where there is nothing."""
PartData = tuple[str, bool, dict[str, list[Cell]]]
"""The fields of a part."""
_LEVEL = 4
"""Level of compression of files: a higher one takes twice the time for a twentieth of the bytes."""
_MAX_NAMES = 4 << 20
"""Largest size of the names of files together [bytes]."""
MAGIC = b"VRXMJRAW"
"""First bytes of the file of a run that goes on; the version follows."""
VERSION = 2
"""Version of the raw file."""
HEAD, FRAME = struct.Struct("<8sI"), struct.Struct("<QI")
"""Beginning of the file: mark and version. Before each block: its length [bytes] and its CRC-32."""
FLUSH = 1.0
"""Wall time between flushes [s]."""
_JOINED_ENTITIES = (STATES, FRAMES)
"""Entities of small parts, which cost as much as their headers."""
PARSER = "foreign.rerun_file"
"""The module that parses."""
_RERUN_MAGIC = b"RRF2"
"""First bytes of a file of rerun's."""
_MIN_MEMORY, _MEMORY_RATIO = 64 << 20, 16
"""Memory that parsing a recording may take [bytes]: this, or this many times its size."""
_SECONDS, _BYTES_PER_SECOND = 5, 1 << 20
"""Processor time that the parser may take: this [s], and one second for this many bytes."""
_Found = TypeVar("_Found")
FILE_HEADER = 12
"""Bytes before the first message of an rrd file: its mark, version and options."""
MESSAGE_HEADER = struct.Struct("<QQ")
"""Kind and length of a message; kind 0 ends a file."""


@dataclass(frozen=True, eq=False)
class Part:
    """A chunk of an entity."""

    entity: str
    static: bool
    """Whether it is without time."""
    columns: Mapping[str, Sequence[Cell]]
    """Columns by name, with a cell for every row."""

    @property
    def size(self) -> int:
        """Bytes of its cells, about."""
        cells = [cell for column in self.columns.values() for cell in column if cell is not None]
        return sum(cell.nbytes if isinstance(cell, np.ndarray) else len(cell) for cell in cells)

    def only(self, columns: Sequence[str]) -> Part:
        """The part with some of its columns."""
        return Part(self.entity, self.static, {name: self.columns[name] for name in columns if name in self.columns})

    def texts(self, name: str) -> list[str]:
        """A column of texts.

        Raises:
            RecordError: it is missing, or of another kind.
        """
        return self._cells(name, str, "a text")

    def blobs(self, name: str) -> list[bytes]:
        """A column of bytes.

        Raises:
            RecordError: it is missing, or of another kind.
        """
        return self._cells(name, bytes, "a block of bytes")

    def numbers(self, name: str, kind: str = "f") -> list[Any]:
        """A column of finite numbers, one in a row, of numpy's kind `f` or `i`.

        Raises:
            RecordError: it is missing, or of another kind.
        """
        found = self._cells(name, np.ndarray, "a number")
        if not all(one.shape == (1,) and one.dtype.kind == kind and np.isfinite(one[0]) for one in found):
            raise RecordError(f"{self.entity}: {name}: expected one {'whole ' * (kind == 'i')}number")
        return [one[0].item() for one in found]

    def times(self, name: str) -> list[float]:
        """A column of simulated times [s].

        Raises:
            RecordError: it is missing, or of another kind.
        """
        found = self.numbers(name)
        if not all(0.0 <= time <= MAX_TIME for time in found):
            raise RecordError(f"{self.entity}: {name}: a time from 0 to {MAX_TIME:g} s is needed")
        return found

    def arrays(self, name: str, kind: str) -> list[npt.NDArray[Any]]:
        """A column of arrays (n,) of numpy's kind, in which bytes are `|u1`; an empty cell is an empty array.

        Raises:
            RecordError: it is missing, or of another kind.
        """
        wanted, expected = np.dtype(kind), f"numbers of type {np.dtype(kind).name}"
        cells = self._cells(name, (np.ndarray, bytes), expected)
        found = [np.frombuffer(cell, np.uint8) if isinstance(cell, bytes) else cell.ravel() for cell in cells]
        if any(len(one) and one.dtype != wanted for one in found):
            raise RecordError(f"{self.entity}: {name}: expected {expected}")
        return [one if len(one) else np.zeros(0, wanted) for one in found]

    def _cells(self, name: str, kind: type | tuple[type, ...], wanted: str) -> list[Any]:
        """A column of cells of a kind, which is called `wanted`."""
        if name not in self.columns:
            raise RecordError(f"{self.entity}: {name}: missing")
        if not all(isinstance(cell, kind) for cell in self.columns[name]):
            raise RecordError(f"{self.entity}: {name}: expected {wanted}")
        return list(self.columns[name])


@cache
def validator(kind: Any) -> TypeAdapter[Any]:
    """Validator of JSON of a kind, made at its first use, as writing a recording needs none."""
    return TypeAdapter(kind)


def pack_files(files: Mapping[str, bytes]) -> bytes:
    """Compressed bytes of files, the same for the same files."""
    return zlib.compress(pack(dict(sorted(files.items()))), _LEVEL)


def unpack_files(blob: bytes, most: int) -> dict[str, bytes]:
    """Files by their names, which are no paths on any disk; `most`: their bytes, of which no more are unpacked.

    Raises:
        RecordError: they are damaged, or more.
    """
    stream = zlib.decompressobj()
    try:
        content = stream.decompress(blob, most + 1)
        if len(content) > most or LENGTH.unpack_from(content)[0] > _MAX_NAMES:
            raise RecordError(f"files: more than {most >> 20} MiB, or too many names")
        return validate(unpack(content), dict[str, bytes])
    except (zlib.error, struct.error, ValueError) as error:
        raise RecordError(f"files: damaged: {str(error).splitlines()[0].removeprefix('damaged: ')}") from None


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
            if entity not in _JOINED_ENTITIES or now >= self._due:
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
            block = pack((self._entity, False, self._columns))
            self._entity = ""
            self._stream.writelines([FRAME.pack(len(block), zlib.crc32(block)), block])

    def close(self) -> None:
        """Write what is left.

        Raises:
            OSError: it cannot be written.
        """
        with self._stream:
            self._write()


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
                yield from (Part(*data) for data in validate([unpack(block)], list[PartData]))
            except ValueError as error:
                reason = str(error).splitlines()[0].removeprefix("damaged: ")
                raise RecordError(f"'{path}' is damaged: {reason}") from error
            count += 1
    if not count:
        raise RecordError(f"'{path}' is damaged: it contains nothing of the run")


@dataclass(frozen=True, eq=False)
class ParsedFile:
    """Content of a file that was asked for."""

    parts: tuple[Part, ...]
    """Chunks in the order of the file."""
    footer: bool
    """Whether the file was completed."""
    views: bool
    """Whether it opens with its views."""

    def of(self, entity: str) -> list[Part]:
        """The chunks of an entity."""
        return [part for part in self.parts if part.entity == entity]


def allowance(size: int) -> int:
    """Memory [bytes] that a recording of `size` [bytes] may take."""
    return _MIN_MEMORY + _MEMORY_RATIO * size


def parsed_file(file: Path, columns: Sequence[str], entities: Sequence[str], *, whole: bool = False) -> ParsedFile:
    """Columns of the chunks of some entities; with `whole`, all others were parsed too.

    Raises:
        RecordError: the file is missing, or cannot be parsed.
    """
    try:
        with _whole_file(file) as source:
            if begins(source, MAGIC):
                found = (part.only(columns) for part in raw_parts(source) if part.entity in entities)
                return ParsedFile(tuple(found), footer=False, views=False)
            wanted, answer, is_whole = (entities, columns, whole), tuple[list[PartData], bool, bool], source == file
            chunks, footer, views = _found_in(file, source, "chunks", *wanted, returns=answer)
            return ParsedFile(tuple(Part(*chunk) for chunk in chunks), footer and is_whole, views and is_whole)
    except OSError as error:
        raise RecordError(f"cannot read the recording '{file}': {error.strerror or error}") from error


def copy_without_views(file: Path, target: Path) -> None:
    """Copy a file's chunks, as a recording of another name.

    Raises:
        RecordError: it cannot be parsed, or the copy cannot be written.
    """
    copy = _found_in(file, file, "copy", target.absolute(), APPLICATION, str(uuid.uuid4()), returns=bytes)
    if copy:
        with writing("the recording", target, RecordError):
            target.write_bytes(copy)


def _found_in(file: Path, source: Path, function: str, *arguments: object, returns: type[_Found]) -> _Found:
    """Result of a function of the parser for `source`, which messages call `file`.

    Raises:
        RecordError: it does not begin as rerun's files do, or the parser did not finish.
    """
    if not begins(source, _RERUN_MAGIC):
        raise RecordError(_unreadable(file, source))
    size = source.stat().st_size
    memory, path = allowance(size), source.absolute()
    try:
        return ask(
            f"{PARSER}:{function}", path, *arguments, returns=returns, about=f"'{file}'", reads=[path],
            memory=2 * memory, seconds=_SECONDS + size // _BYTES_PER_SECOND, answer=memory, threads=True, cached=False,
        )  # fmt: skip
    except ReaderError as error:
        raise RecordError(f"'{file}' is damaged: {error.reason}") from None
    except RecordError:
        raise RecordError(_unreadable(file, source)) from None


def _unreadable(file: Path, source: Path) -> str:
    """The message about a file that rerun cannot read."""
    ours = begins(source, _RERUN_MAGIC)
    if not ours and file.suffix.lower() != ".rrd" and (wrong := wrong_kind(source, "a recording")):
        return f"'{file}' is {wrong}"
    what = "it is damaged, or rerun has not finished it" if ours else "it does not begin as rerun's files do"
    return f"'{file}' is not a recording of vrx_mj: {what}"


def no_recording(file: Path) -> str:
    """The message about a path where there is no file."""
    wrong = wrong_kind(file, "a recording")
    return f"'{file}' is {wrong}" if wrong else f"no recording '{file}'"


@contextmanager
def _whole_file(file: Path) -> Iterator[Path]:
    """`file`, or a copy without its last message where that was cut in the middle."""
    if not file.is_file():
        raise RecordError(no_recording(file))
    whole, size = whole_bytes(file), file.stat().st_size
    if whole == size:
        yield file
        return
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "whole.rrd"
        shutil.copyfile(file, copy)
        os.truncate(copy, whole)
        yield copy


def whole_bytes(file: Path) -> int:
    """Length of `file` up to the end of its last whole message; all of it if complete or no rrd file."""
    size, kind = file.stat().st_size, -1
    if not begins(file, _RERUN_MAGIC):
        return size
    with file.open("rb") as stream:
        end = stream.seek(FILE_HEADER)
        while kind != 0 and len(header := stream.read(MESSAGE_HEADER.size)) == MESSAGE_HEADER.size:
            kind, length = MESSAGE_HEADER.unpack(header)
            if length > size - end - MESSAGE_HEADER.size:
                return end
            end = stream.seek(length, os.SEEK_CUR)
    return size if kind == 0 else min(end, size)


def viewer_binary() -> Path:
    """The executable inside the installed rerun package: the script beside Python only wraps it."""
    import rerun

    name = "rerun.exe" if sys.platform == "win32" else "rerun"
    path = Path(rerun.__file__).parent.parent / "rerun_cli" / name
    if not path.is_file():
        raise RecordError(f"no rerun viewer at '{path}': install rerun-sdk for this platform")
    return path


def viewer_environment() -> dict[str, str]:
    """Environment variables in which rerun's program sends no usage statistics, nor writes settings of them."""
    return {**os.environ, "CI": "true"}  # rerun has no variable of its own for it
