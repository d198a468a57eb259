"""Rows of float64 to bytes and back, exactly, in about two thirds of the space.

A row's columns are smooth in time. Their bit patterns, read as integers that sort like the numbers, are
therefore nearly polynomials: third differences are small, and written byte plane by byte plane their upper
planes are runs of equal bytes, which the LZ4 of the file squeezes out. Integer arithmetic wraps, so nothing
is lost whatever the rows hold, NaN included.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.errors import RecordError
from vrx_mj.physics.kernel import kernel

HEADER = struct.Struct("<II")
"""Number of rows, number of columns."""
FLIP = np.int64(0x7FFF_FFFF_FFFF_FFFF)


def pack_rows(rows: FloatArray) -> bytes:
    """Bytes of (n, columns) rows."""
    count, width = rows.shape
    blob = np.empty(HEADER.size + 8 * width * count, np.uint8)
    HEADER.pack_into(blob.data, 0, count, width)
    _write_planes(np.ascontiguousarray(rows.T, dtype="<f8").view("<i8"), blob[HEADER.size :].reshape(8, -1))
    return blob.tobytes()


@kernel
def _write_planes(bits: IntArray, planes: ByteArray) -> None:
    """Write bit patterns (columns, n), column after column, as byte planes (8, columns * n) of their differences.

    A column's first number stays, the second is a first difference, the third a second one, the rest are third
    ones. Compiled, so that it runs beside the simulation and not in turn with it.
    """
    count = bits.shape[1]
    for column in range(bits.shape[0]):
        before = slope = bend = 0
        for i in range(count):
            value = bits[column, i]
            value = value ^ FLIP if value < 0 else value
            change = value - before
            turn = change - slope
            small = value if i == 0 else change if i == 1 else turn if i == 2 else turn - bend
            before, slope, bend = value, change, turn
            small = (small << 1) ^ (small >> 63)  # the sign into the lowest bit, so that small means small bytes
            for plane in range(8):
                planes[plane, column * count + i] = (small >> (8 * plane)) & 255


def row_count(blob: bytes) -> int:
    """How many rows `pack_rows` packed, as they say."""
    count, _ = HEADER.unpack_from(blob)
    return int(count)


def unpack_rows(blob: bytes | memoryview) -> FloatArray:
    """The rows that `pack_rows` packed, bit for bit.

    Raises:
        RecordError: these are not such bytes.
    """
    count, width = HEADER.unpack_from(blob) if len(blob) >= HEADER.size else (0, 0)
    if width == 0 or len(blob) != HEADER.size + 8 * width * count:
        raise RecordError(f"block: {len(blob)} bytes are not {count} rows of {width} columns")
    rows = np.empty((count, width), "<i8")
    _read_planes(np.frombuffer(blob, np.uint8, offset=HEADER.size).reshape(8, -1), rows)
    return rows.view("<f8")


@kernel
def _read_planes(planes: ByteArray, rows: IntArray) -> None:
    """Write the bit patterns (n, columns) of which `_write_planes` wrote the byte planes (8, columns * n)."""
    count = rows.shape[0]
    for column in range(rows.shape[1]):
        value = change = turn = np.int64(0)
        for i in range(count):
            small = np.int64(0)
            for plane in range(8):
                small |= np.int64(planes[plane, column * count + i]) << (8 * plane)
            small = ((small >> 1) & FLIP) ^ -(small & 1)
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
