"""Rows of float64 to bytes and back, exactly, and files to archives.

Rows are coded by `row_coding`. Those of earlier versions are read: there each number was predicted from those of its
column, and by how much it is off was written byte plane by byte plane.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.errors import RecordError
from vrx_mj.physics.kernel import allocating_kernel, inlined_kernel, kernel
from vrx_mj.recording.row_coding import FARTHEST, FLIP, Bodies, coded_rows, decoded_rows, sortable

HEADER = struct.Struct("<II")
"""Number of rows; number of columns, with the form of what follows in its upper two bits."""
DIFFERENCES, PLAIN, PLANES, CODED = range(4)
"""Forms: third differences of bit patterns, and bit patterns off their predictions, which only earlier versions wrote;
numbers as they are; as `coded_rows` has them."""
WIDTH_BITS = 30
ORDER = 8
"""Of the polynomial through the last numbers, which predicts the next one in `PLANES`."""


def plain_rows(rows: FloatArray) -> bytes:
    """Bytes of (n, columns) rows as they are, for a run that must not wait."""
    header = HEADER.pack(len(rows), rows.shape[1] | PLAIN << WIDTH_BITS)
    return b"".join((header, np.ascontiguousarray(rows, dtype="<f8").data))


def pack_rows(rows: FloatArray, bodies: Bodies = (), timestep: float = 1.0) -> bytes:
    """Bytes of (n, columns) rows; of `bodies` poses are predicted from velocities, `timestep` [s] by timestep."""
    if not len(rows):
        return plain_rows(rows)
    return HEADER.pack(len(rows), rows.shape[1] | CODED << WIDTH_BITS) + coded_rows(rows, bodies, timestep)


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


def shape_of(blob: bytes | memoryview) -> tuple[int, int]:
    """How many rows and columns are in such bytes, as they say."""
    count, width = HEADER.unpack_from(blob) if len(blob) >= HEADER.size else (0, 0)
    return count, width & ((1 << WIDTH_BITS) - 1)


def unpack_all(blobs: Sequence[bytes], most: int) -> list[FloatArray]:
    """The rows of several such bytes; `most`: bytes of all of them.

    Raises:
        RecordError: these are not such bytes, or there are more rows.
    """
    if (needed := sum(8 * count * width for count, width in map(shape_of, blobs))) > most:
        raise RecordError(f"block: {needed >> 20} MiB of rows: at most {most >> 20}")
    return [unpack_rows(blob) for blob in blobs]


def unpack_rows(blob: bytes | memoryview) -> FloatArray:
    """The rows of which these are the bytes, bit for bit.

    Raises:
        RecordError: these are not such bytes.
    """
    count, width = shape_of(blob)
    form = blob[HEADER.size - 1] >> (WIDTH_BITS - 24) if width else PLAIN
    found = None
    if form == CODED:
        found = decoded_rows(memoryview(blob)[HEADER.size :], count, width)
    elif width and len(blob) == HEADER.size + 8 * width * count:
        found = np.frombuffer(blob, "<f8", offset=HEADER.size).reshape(count, width)
    if found is None:
        raise RecordError(f"block: {len(blob)} bytes are not {count} rows of {width} columns")
    return found if form in {CODED, PLAIN} else _off_predictions(found, form)


def _off_predictions(planes: FloatArray, form: int) -> FloatArray:
    """The rows (n, columns) that are off their predictions by what is in byte planes, which take as many bytes."""
    bits = np.empty(planes.shape, "<i8")
    (_read_planes if form == PLANES else _read_differences)(planes.view(np.uint8).reshape(8, -1), bits)
    return bits.view("<f8")


@allocating_kernel
def _read_planes(planes: ByteArray, rows: IntArray) -> None:
    """Write the bit patterns (n, columns) that are off their predictions by what is in byte planes (8, columns * n)."""
    count = rows.shape[0]
    differences = np.zeros(ORDER + 1)
    for column in range(rows.shape[1]):
        for i in range(count):
            bits = sortable(_predicted(differences, i)) + _off(planes, column * count + i)
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
