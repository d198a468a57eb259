"""Parses a rerun file, in a process of its own: run by its path, it imports rerun, and of ours `unix` alone.

rerun's reader is native code, which a damaged file can end. What it found goes to standard output as blocks: a header
of JSON, and the bytes that it counts. `vrx_mj.recording.rrd_file` starts this and reads them.

    rrd_parser.py read FILE MEMORY SECONDS WHOLE COLUMNS ENTITY...
    rrd_parser.py copy FILE MEMORY SECONDS COPY APPLICATION ID

COLUMNS are names with commas between them. If WHOLE is `whole`, the chunks of all other entities are parsed too.
"""

import contextlib
import importlib.util
import json
import os
import struct
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

from vrx_mj.unix import resource

LENGTH = struct.Struct("<Q")
"""Length of a block's header [bytes], written before it."""
NUMBERS = ("<f8", "<f4", "<i8", "<i4", "<u8", "<u4", "<u2", "|u1")
"""Kinds of numbers in a cell, as numpy names them; other cells are `text`, `bytes` or `none`."""


def main(arguments: Sequence[str]) -> None:
    """Run the command of the arguments; an error is the last block."""
    command, file, memory, seconds, *rest = arguments
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever else is printed stays out of the blocks
    try:
        reader_of = rerun_reader()  # before the limits: they are on what a file makes of it
        limit(int(memory), int(seconds))
        warnings.simplefilter("ignore")  # a file without its table of contents is what a killed run leaves
        reader = reader_of(file)
        if command == "copy":
            copy, application, recording = rest
            reader.stream().write_rrd(copy, application_id=application, recording_id=recording)
        else:
            whole, columns, *entities = rest
            write_chunks(output, reader, columns.split(","), entities, whole=whole == "whole")
        from rerun_bindings import check_for_rrd_footer

        write_block(output, {"end": {"footer": bool(check_for_rrd_footer(file)), "views": bool(reader.blueprints())}})
    except BaseException as error:  # a panic of rerun's is one
        write_block(output, {"error": (str(error).strip().splitlines() or [type(error).__name__])[0]})
    output.close()
    os._exit(0)  # no thread of rerun's is waited for


def rerun_reader() -> Any:
    """Rerun's class that reads files, by its module alone: importing all of rerun takes longer than reading a file."""
    if (found := importlib.util.find_spec("rerun")) is not None:
        sys.modules["rerun"] = importlib.util.module_from_spec(found)  # not executed: a package of modules alone
    try:
        from rerun.chunk import RrdReader
    except ImportError:
        del sys.modules["rerun"]
        from rerun.chunk import RrdReader
    return RrdReader


def limit(memory: int, seconds: int) -> None:
    """Let this process take at most so many bytes and seconds of processor time more; only where the system can."""
    if resource is None:
        return
    spent = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    limits = {resource.RLIMIT_CORE: 0, resource.RLIMIT_CPU: int(spent) + seconds}
    with contextlib.suppress(OSError):
        status = Path("/proc/self/status").read_text(encoding="ascii")
        held = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmData"))
        limits[resource.RLIMIT_DATA] = 1024 * held + memory
    for kind, most in limits.items():
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def write_chunks(
    output: BinaryIO, reader: Any, columns: Sequence[str], entities: Sequence[str], *, whole: bool
) -> None:
    """Write columns of the chunks of some entities; `whole`: parse those of all others too."""
    stream = reader.stream()
    for chunk in stream if whole else stream.filter(content=[f"+ {path}" for path in entities]):
        batch = chunk.to_record_batch()
        if chunk.entity_path in entities:
            found = {name: list(map(cell, batch.column(name))) for name in batch.schema.names if name in columns}
            lengths = {name: [(kind, len(content)) for kind, content in cells] for name, cells in found.items()}
            write_block(output, {"entity": chunk.entity_path, "static": chunk.is_static, "columns": lengths})
            output.writelines(content for cells in found.values() for _, content in cells)


def write_block(output: BinaryIO, header: object) -> None:
    """Write a header; what it counts comes after it."""
    text = json.dumps(header).encode()
    output.write(LENGTH.pack(len(text)) + text)


def cell(value: Any) -> tuple[str, bytes | memoryview]:
    """Kind and content of a value of a column: the first text or bytes of a list, or all numbers of one."""
    if not value.is_valid:
        return "none", b""
    if not hasattr(value, "values"):  # of a timeline [ns]
        return "<i8", struct.pack("<q", value.value)
    values = value.values
    first = values[0] if len(values) else None
    if hasattr(first, "as_buffer"):
        return as_bytes(first)
    while values.type.num_fields:  # points are lists of three, pictures lists of bytes
        values = values.flatten()
    numbers = values.to_numpy(zero_copy_only=False)
    if numbers.dtype.str not in NUMBERS:
        raise ValueError(f"numbers of type {numbers.dtype}")
    return numbers.dtype.str, numbers.tobytes()


def as_bytes(value: Any) -> tuple[str, bytes | memoryview]:
    """Kind and content of a text, or of bytes."""
    buffer = value.as_buffer()
    kind = "text" if str(value.type).endswith("string") else "bytes"
    return kind, b"" if buffer is None else memoryview(buffer)


if __name__ == "__main__":
    main(sys.argv[1:])
