"""Jobs of the sandboxed process that read recordings by rerun's own reader, which is native code."""

import importlib.util
import os
import sys
import threading
from collections.abc import Collection
from typing import Any

import numpy as np

from vrx_mj.errors import RecordError


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


def chunks(
    file: str, entities: Collection[str], columns: Collection[str], whole: bool
) -> tuple[list[tuple[str, bool, dict[str, list[Any]]]], bool, bool]:
    """The chunks of some entities, and whether the file was completed, and opens with its views.

    A chunk is its entity, whether it is without time, and columns of cells: texts, bytes, numbers or None.

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
        parsed = ((chunk, chunk.to_record_batch()) for chunk in found)
        rows = [
            (chunk.entity_path, bool(chunk.is_static), {
                name: [*map(_cell, batch.column(name))] for name in batch.schema.names if name in columns
            })
            for chunk, batch in parsed
            if chunk.entity_path in entities
        ]  # fmt: skip
        return rows, bool(check_for_rrd_footer(file)), bool(reader.blueprints())
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


def _cell(value: Any) -> Any:
    """A value of a column: the first text or bytes of a list, or all numbers of one."""
    if not value.is_valid:
        return None
    if not hasattr(value, "values"):  # of a timeline [ns]
        return np.array([value.value], "<i8")
    values = value.values
    first: Any = values[0] if len(values) else None
    if hasattr(first, "as_buffer"):
        return first.as_py()
    while values.type.num_fields:  # points are lists of three, pictures lists of bytes
        values = values.flatten()
    return values.to_numpy(zero_copy_only=False)
