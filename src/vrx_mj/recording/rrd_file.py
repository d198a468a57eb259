"""What a rerun file holds, parsed in a process of its own: a file that ends the parser is an error, and no more.

That process may take as much memory and processor time as a recording of this size can need; where the system has such
limits, which is not on Windows and, for memory, on Linux alone. What it hands back is checked here as if it came from
the file.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter

from vrx_mj.config.kinds import wrong_kind
from vrx_mj.errors import RecordError
from vrx_mj.recording import rrd_parser
from vrx_mj.recording.parts import Lengths, Part, columns_of
from vrx_mj.recording.raw_file import is_raw, raw_parts

MAGIC = b"RRF2"
"""How a recording begins."""
LEAST, RATIO = 64 << 20, 16
"""What a recording may become in memory [bytes]: this, and so many times its size."""
SECONDS, BYTES_PER_SECOND = 5, 1 << 20
"""Processor time of the parser: this [s], and a second for so many bytes."""
CLOCK_PER_PROCESSOR_TIME = 12
"""Seconds of the clock for each of processor time, on a machine that has other work."""
THREADS = {"RAYON_NUM_THREADS": "2", "TOKIO_WORKER_THREADS": "2", "OPENBLAS_NUM_THREADS": "1", "RUST_BACKTRACE": "0"}
"""Environment of the parser: each thread's stack counts as memory."""


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


@dataclass(frozen=True)
class Ending:
    """State of a file at its end."""

    footer: bool
    views: bool


@dataclass(frozen=True)
class End:
    """The last block."""

    end: Ending


@dataclass(frozen=True)
class Failure:
    """The last block if the file cannot be parsed."""

    error: str


BLOCK: TypeAdapter[Lengths | End | Failure] = TypeAdapter(Lengths | End | Failure)


def allowance(size: int) -> int:
    """What a recording of `size` [bytes] may become in memory [bytes]."""
    return LEAST + RATIO * size


def parsed_file(file: Path, columns: Sequence[str], entities: Sequence[str], *, whole: bool = False) -> Parsed:
    """Columns of the chunks of some entities; with `whole`, all others were parsed too.

    Raises:
        RecordError: the file is missing, or cannot be parsed.
    """
    with reading(file), whole_file(file) as source:
        if is_raw(source):
            found = (part.only(columns) for part in raw_parts(source) if part.entity in entities)
            return Parsed(tuple(found), footer=False, views=False)
        arguments = ["whole" if whole else "ours", ",".join(columns), *entities]
        parsed = blocks_of(parser_output(file, source, "read", arguments), file, source)
        return Parsed(parsed.parts, parsed.footer and source == file, parsed.views and source == file)


def copy_without_views(file: Path, target: Path, application: str, recording: str) -> None:
    """Copy a file's chunks, as a recording of another name.

    Raises:
        RecordError: it cannot be parsed.
    """
    blocks_of(parser_output(file, file, "copy", [str(target), application, recording]), file, file)


def parser_output(file: Path, source: Path, command: Literal["read", "copy"], arguments: Sequence[str]) -> bytes:
    """The parser's output for `source`, which messages call `file`.

    Raises:
        RecordError: it does not begin as rerun's files do, or the parser did not finish.
    """
    if not _begins_as_recording(source):
        raise RecordError(_unreadable(file, source))
    size = source.stat().st_size
    memory, seconds = allowance(size), SECONDS + size // BYTES_PER_SECOND
    limits = [str(2 * memory), str(seconds)]
    program = [sys.executable, "-P", rrd_parser.__file__, command, str(source), *limits, *arguments]
    environment = {**os.environ, **THREADS, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with subprocess.Popen(
        program, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
    ) as process:
        clock = threading.Timer(CLOCK_PER_PROCESSOR_TIME * seconds, process.kill)
        clock.start()
        try:
            output = received(process, memory)
        finally:
            clock.cancel()
            process.kill()
    if len(output) > memory:
        raise RecordError(f"'{file}' is damaged: it holds more than {memory >> 20} MiB")
    if process.returncode != 0:
        raise RecordError(f"'{file}' is damaged: {ending(process.returncode)}")
    return output


def received(process: subprocess.Popen[bytes], most: int) -> bytes:
    """All that a process writes until it ends; little more than `most` [bytes] where it writes more."""
    assert process.stdout is not None, "its output is a pipe"
    output = bytearray()
    while len(output) <= most and (piece := os.read(process.stdout.fileno(), 1 << 20)):
        output += piece
    if len(output) <= most:
        process.wait()
    return bytes(output)


def ending(code: int) -> str:
    """How rerun's reader ended."""
    if code < 0:
        with contextlib.suppress(ValueError):
            return f"rerun's reader was ended by {signal.Signals(-code).name}"
    return f"rerun's reader ended with exit code {code}"


def _begins_as_recording(source: Path) -> bool:
    with source.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def _unreadable(file: Path, source: Path) -> str:
    """The message about a file that rerun cannot read."""
    begins = _begins_as_recording(source)
    if not begins and file.suffix.lower() != ".rrd" and (wrong := wrong_kind(source, "a recording")):
        return f"'{file}' is {wrong}"
    what = "it is damaged, or rerun has not finished it" if begins else "it does not begin as rerun's files do"
    return f"'{file}' is not a recording of vrx_mj: {what}"


def blocks_of(output: bytes, file: Path, source: Path) -> Parsed:
    """The parts in the blocks of the parser of `source`, which messages call `file`.

    Raises:
        RecordError: the last block is an error, or missing.
    """
    view, place, parts = memoryview(output), 0, list[Part]()
    try:
        while place < len(view):
            (length,) = rrd_parser.LENGTH.unpack_from(view, place)
            place += rrd_parser.LENGTH.size
            block = BLOCK.validate_json(bytes(view[place : place + length]))
            place += length
            if isinstance(block, Failure):
                raise RecordError(_unreadable(file, source))
            if isinstance(block, End):
                return Parsed(tuple(parts), block.end.footer, block.end.views)
            size = sum(size for cells in block.columns.values() for _, size in cells)
            parts.append(Part(block.entity, block.static, columns_of(block, view[place : place + size])))
            place += size
    except (ValueError, struct.error) as error:
        raise RecordError(f"'{file}' is damaged: {str(error).splitlines()[0]}") from error
    raise RecordError(f"'{file}' is damaged: rerun's reader came to no end")


@contextlib.contextmanager
def reading(file: Path) -> Iterator[None]:
    """Around the reading of a file: an error is one line."""
    try:
        yield
    except OSError as error:
        raise RecordError(f"cannot read the recording '{file}': {error.strerror or error}") from error


def no_recording(file: Path) -> str:
    """The message about a path where there is no file."""
    wrong = wrong_kind(file, "a recording")
    return f"'{file}' is {wrong}" if wrong else f"no recording '{file}'"


@contextlib.contextmanager
def whole_file(file: Path) -> Iterator[Path]:
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


FILE_HEADER = 12
"""Bytes before the first message of an rrd file: its mark, version and options."""
MESSAGE_HEADER = struct.Struct("<QQ")
"""Kind and length of a message; kind 0 ends a file."""


def whole_bytes(file: Path) -> int:
    """Length of `file` up to the end of its last whole message; all of it if complete or no rrd file."""
    size = file.stat().st_size
    with file.open("rb") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            return size
        end = FILE_HEADER
        while end < size:
            stream.seek(end)
            header = stream.read(MESSAGE_HEADER.size)
            if len(header) < MESSAGE_HEADER.size:
                return end
            kind, length = MESSAGE_HEADER.unpack(header)
            if end + MESSAGE_HEADER.size + length > size:
                return end
            if kind == 0:
                return size
            end += MESSAGE_HEADER.size + length
    return size
