"""Jobs of the process without rights that read recordings by rerun's own reader, which is native code."""

import importlib.util
import json
import os
import struct
import sys
import threading
from collections.abc import Collection, Iterator
from typing import Any

from vrx_mj.errors import RecordError
from vrx_mj.foreign.plain import LENGTH


def _reader() -> Any:
    """Rerun's class that reads files, by its module alone: importing all of rerun takes longer than reading a file."""
    if (found := importlib.util.find_spec("rerun")) is not None:
        sys.modules["rerun"] = importlib.util.module_from_spec(found)  # not executed: a package of modules alone
    try:
        from rerun.chunk import RrdReader
    except ImportError:
        del sys.modules["rerun"]
        from rerun.chunk import RrdReader
    return RrdReader


_READER = _reader()


def chunks(file: str, entities: Collection[str], columns: Collection[str], whole: bool) -> tuple[bytes, bool, bool]:
    """Columns of the chunks of some entities as blocks, and whether the file was completed, and opens with its views.

    A block is a header of JSON and the bytes that it counts.

    Args:
        file: its path.
        entities: their paths.
        columns: their names.
        whole: whether the chunks of all other entities are parsed too.

    Raises:
        RecordError: it cannot be parsed.
    """
    try:
        from rerun_bindings import check_for_rrd_footer

        reader = _READER(file)
        stream = reader.stream()
        found = stream if whole else stream.filter(content=[f"+ {path}" for path in entities])
        blocks = b"".join(piece for chunk in found for piece in _block(chunk, entities, columns))
        return blocks, bool(check_for_rrd_footer(file)), bool(reader.blueprints())
    except BaseException as error:  # a panic of rerun's is one
        raise RecordError(str(error)) from None


def copy(file: str, target: str, application: str, recording: str) -> bytes:
    """A file with the chunks of another, without its views, as a recording of another name.

    Where there are no paths for pipes, nor limits on what native code writes, it is written to `target`.

    Raises:
        RecordError: it cannot be parsed.
    """
    pieces: list[bytes] = []
    source, pipe = os.pipe()
    where = target if os.name == "nt" else f"/dev/fd/{pipe}"
    thread = threading.Thread(target=lambda: pieces.extend(iter(lambda: os.read(source, 1 << 20), b"")))
    thread.start()
    try:
        _READER(file).stream().write_rrd(where, application_id=application, recording_id=recording)
    except BaseException as error:  # a panic of rerun's is one
        raise RecordError(str(error)) from None
    finally:
        os.close(pipe)
        thread.join()
    return b"".join(pieces)


def _block(chunk: Any, entities: Collection[str], columns: Collection[str]) -> Iterator[bytes | memoryview]:
    """The pieces of the block of a chunk; nothing for one of another entity."""
    batch = chunk.to_record_batch()
    if chunk.entity_path not in entities:
        return
    found = {name: list(map(_cell, batch.column(name))) for name in batch.schema.names if name in columns}
    lengths = {name: [(kind, len(content)) for kind, content in cells] for name, cells in found.items()}
    text = json.dumps({"entity": chunk.entity_path, "static": chunk.is_static, "columns": lengths}).encode()
    yield from (LENGTH.pack(len(text)), text)
    yield from (content for cells in found.values() for _, content in cells)


def _cell(value: Any) -> tuple[str, bytes | memoryview]:
    """Kind and content of a value of a column: the first text or bytes of a list, or all numbers of one."""
    if not value.is_valid:
        return "none", b""
    if not hasattr(value, "values"):  # of a timeline [ns]
        return "<i8", struct.pack("<q", value.value)
    values = value.values
    first: Any = values[0] if len(values) else None
    if hasattr(first, "as_buffer"):
        buffer = first.as_buffer()
        kind = "text" if str(first.type).endswith("string") else "bytes"
        return kind, b"" if buffer is None else memoryview(buffer)
    while values.type.num_fields:  # points are lists of three, pictures lists of bytes
        values = values.flatten()
    numbers = values.to_numpy(zero_copy_only=False)
    return numbers.dtype.str, numbers.tobytes()
