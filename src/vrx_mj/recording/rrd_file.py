"""What a rerun file holds, parsed in the sandboxed process: a file that ends the parser is an error, and no more.

That process may take as much memory and processor time as a recording of this size can need. What it hands back is
checked here as if it came from the file.
"""

import contextlib
import os
import shutil
import struct
import sys
import tempfile
import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from vrx_mj.config.kinds import wrong_kind
from vrx_mj.errors import RecordError
from vrx_mj.foreign import ReaderError, ask
from vrx_mj.outputs import begins, writing
from vrx_mj.recording.parts import APPLICATION, MAGIC, Part, PartData, raw_parts

PARSER = "foreign.rerun_file"
"""The module that parses."""
_MAGIC = b"RRF2"
"""First bytes of a recording."""
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
class Parsed:
    """What was asked for of a file."""

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
    """What a recording of `size` [bytes] may become in memory [bytes]."""
    return _MIN_MEMORY + _MEMORY_RATIO * size


def parsed_file(file: Path, columns: Sequence[str], entities: Sequence[str], *, whole: bool = False) -> Parsed:
    """Columns of the chunks of some entities; with `whole`, all others were parsed too.

    Raises:
        RecordError: the file is missing, or cannot be parsed.
    """
    try:
        with _whole_file(file) as source:
            if begins(source, MAGIC):
                found = (part.only(columns) for part in raw_parts(source) if part.entity in entities)
                return Parsed(tuple(found), footer=False, views=False)
            wanted, answer = (entities, columns, whole), tuple[list[PartData], bool, bool]
            chunks, footer, views = _found_in(file, source, "chunks", *wanted, returns=answer)
            return Parsed(tuple(Part(*chunk) for chunk in chunks), footer and source == file, views and source == file)
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
    """What the parser finds in `source`, which messages call `file`.

    Raises:
        RecordError: it does not begin as rerun's files do, or the parser did not finish.
    """
    if not begins(source, _MAGIC):
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
    ours = begins(source, _MAGIC)
    if not ours and file.suffix.lower() != ".rrd" and (wrong := wrong_kind(source, "a recording")):
        return f"'{file}' is {wrong}"
    what = "it is damaged, or rerun has not finished it" if ours else "it does not begin as rerun's files do"
    return f"'{file}' is not a recording of vrx_mj: {what}"


def no_recording(file: Path) -> str:
    """The message about a path where there is no file."""
    wrong = wrong_kind(file, "a recording")
    return f"'{file}' is {wrong}" if wrong else f"no recording '{file}'"


@contextlib.contextmanager
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
    if not begins(file, _MAGIC):
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
