"""Rows of float64 to bytes and back, exactly, in about three fifths of the space.

A row's columns are smooth in time: each number is predicted from those before it, and what is written is by how much
its bit pattern, read as an integer that sorts like the number, is off. These are small, and written byte plane by byte
plane their upper planes are runs of equal bytes, which the LZ4 of the file squeezes out. Integer arithmetic wraps, so
nothing is lost whatever the rows hold, NaN included.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.errors import RecordError
from vrx_mj.physics.kernel import allocating_kernel, inlined_kernel, kernel

HEADER = struct.Struct("<II")
"""Number of rows; number of columns, with the form of what follows in its upper two bits."""
DIFFERENCES, PLAIN, PREDICTED = 0, 1, 2
"""Forms: third differences of bit patterns, which only earlier versions wrote; numbers as they are; as above."""
WIDTH_BITS = 30
FLIP = np.int64(0x7FFF_FFFF_FFFF_FFFF)
ORDER = 8
"""Of the polynomial through the last numbers, which predicts the next one."""
FARTHEST = 1e300
"""Predictions beyond this are 0."""


def plain_rows(rows: FloatArray) -> bytes:
    """Bytes of (n, columns) rows as they are, for a run that must not wait."""
    header = HEADER.pack(len(rows), rows.shape[1] | PLAIN << WIDTH_BITS)
    return b"".join((header, np.ascontiguousarray(rows, dtype="<f8").data))


def pack_rows(rows: FloatArray) -> bytes:
    """Bytes of (n, columns) rows."""
    count, width = rows.shape
    blob = np.empty(HEADER.size + 8 * width * count, np.uint8)
    HEADER.pack_into(blob.data, 0, count, width | PREDICTED << WIDTH_BITS)
    _write_planes(np.ascontiguousarray(rows, dtype="<f8"), blob[HEADER.size :].reshape(8, -1))
    return blob.tobytes()


@allocating_kernel
def _write_planes(rows: FloatArray, planes: ByteArray) -> None:
    """Write by how much rows (n, columns) are off their predictions as byte planes (8, columns * n)."""
    count = rows.shape[0]
    differences = np.zeros(ORDER + 1)
    for column in range(rows.shape[1]):
        for i in range(count):
            off = _sortable(rows[i, column]) - _sortable(_predicted(differences, i))
            _follow(differences, rows[i, column])
            off = (off << 1) ^ (off >> 63)  # the sign into the lowest bit, so that small means small bytes
            for plane in range(8):
                planes[plane, column * count + i] = (off >> (8 * plane)) & 255


@inlined_kernel
def _sortable(value: float) -> int:
    """Return the bit pattern of a number as an integer that sorts like it."""
    bits: Any = np.float64(value).view(np.int64)
    sortable: int = bits ^ FLIP if bits < 0 else bits
    return sortable


@inlined_kernel
def _predicted(differences: FloatArray, known: int) -> float:
    """Return the next number of a column of which so many are known.

    Sums alone: where a product could become one operation with a sum, another processor would have other bits.
    """
    total = 0.0
    for k in range(min(known, ORDER + 1)):
        total += differences[k]
    return total if abs(total) < FARTHEST else 0.0


@inlined_kernel
def _follow(differences: FloatArray, value: float) -> None:
    """Make a column's last number and its backward differences those of the next number."""
    for k in range(ORDER + 1):
        value, differences[k] = value - differences[k], value


def row_count(blob: bytes) -> int:
    """How many rows are in such bytes, as they say."""
    count, _ = HEADER.unpack_from(blob)
    return int(count)


def unpack_rows(blob: bytes | memoryview) -> FloatArray:
    """The rows of which these are the bytes, bit for bit.

    Raises:
        RecordError: these are not such bytes.
    """
    count, width = HEADER.unpack_from(blob) if len(blob) >= HEADER.size else (0, 0)
    form, width = divmod(width, 1 << WIDTH_BITS)
    if width == 0 or form > PREDICTED or len(blob) != HEADER.size + 8 * width * count:
        raise RecordError(f"block: {len(blob)} bytes are not {count} rows of {width} columns")
    if form == PLAIN:
        return np.frombuffer(blob, "<f8", offset=HEADER.size).reshape(count, width)
    rows, planes = np.empty((count, width), "<i8"), np.frombuffer(blob, np.uint8, offset=HEADER.size).reshape(8, -1)
    (_read_planes if form == PREDICTED else _read_differences)(planes, rows)
    return rows.view("<f8")


@allocating_kernel
def _read_planes(planes: ByteArray, rows: IntArray) -> None:
    """Write the bit patterns (n, columns) of which `_write_planes` wrote the byte planes (8, columns * n)."""
    count = rows.shape[0]
    differences = np.zeros(ORDER + 1)
    for column in range(rows.shape[1]):
        for i in range(count):
            bits = _sortable(_predicted(differences, i)) + _off(planes, column * count + i)
            rows[i, column] = bits ^ FLIP if bits < 0 else bits
            _follow(differences, np.int64(rows[i, column]).view(np.float64))


@inlined_kernel
def _off(planes: ByteArray, at: int) -> int:
    """Return the integer of which `planes` hold the bytes, its sign in the lowest bit."""
    value: Any = np.int64(0)
    for plane in range(8):
        value |= np.int64(planes[plane, at]) << (8 * plane)
    off: int = ((value >> 1) & FLIP) ^ -(value & 1)
    return off


@kernel
def _read_differences(planes: ByteArray, rows: IntArray) -> None:
    """Write the bit patterns (n, columns) whose third differences are in byte planes (8, columns * n)."""
    count = rows.shape[0]
    for column in range(rows.shape[1]):
        value = change = turn = np.int64(0)
        for i in range(count):
            small: Any = _off(planes, column * count + i)
            turn = small if i < 3 else turn + small
            change = turn if i < 2 else change + turn
            value = change if i < 1 else value + change
            rows[i, column] = value ^ FLIP if value < 0 else value


EPOCH = (2020, 1, 1, 0, 0, 0)
"""Time of the files in the archive: one world, one archive."""
FILES = 20_000
"""Files in an archive, at most."""
LEVEL = 4
"""How hard files are compressed: harder takes twice the time for a twentieth of the bytes."""
ENTRY = b"PK\x01\x02"
"""Before each file in the archive's table of contents."""
DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, ValueError, OverflowError, OSError, RuntimeError)
"""What `zipfile` raises at an archive that is damaged."""
ENCRYPTED = 0x1
"""A bit of a file's flags."""


def archive(files: Mapping[str, bytes]) -> bytes:
    """A zip archive of files, the same bytes for the same files."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as out:
        for name in sorted(files):
            out.writestr(zipfile.ZipInfo(name, EPOCH), files[name], zipfile.ZIP_DEFLATED, LEVEL)
    return buffer.getvalue()


def unpacked(blob: bytes, most: int) -> dict[str, bytes]:
    """Files of an archive, by their names, which are no paths on any disk; `most`: their bytes.

    What comes out is counted, whatever the archive's own table has.

    Raises:
        RecordError: it is damaged, or holds more, or what `archive` does not write.
    """
    if (count := blob.count(ENTRY)) > FILES:  # before an object is made for each
        raise RecordError(f"files: {count} files: at most {FILES}")
    try:
        with zipfile.ZipFile(io.BytesIO(blob)) as stored:
            files: dict[str, bytes] = {}
            left = most
            for member in stored.infolist():
                if member.compress_type != zipfile.ZIP_DEFLATED or member.flag_bits & ENCRYPTED:
                    raise RecordError("files: the archive is damaged: it is compressed in another way, or encrypted")
                if member.filename in files:
                    raise RecordError("files: two of one name")
                with stored.open(member) as content:
                    files[member.filename] = content.read(left + 1)
                left -= len(files[member.filename])
                if left < 0:
                    raise RecordError(f"files: more than {most >> 20} MiB")
            return files
    except DAMAGE as error:
        raise RecordError(f"files: the archive is damaged: {error}") from None
