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

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import RecordError
from vrx_mj.recording.row_coding import FARTHEST, FLIP, Bodies, coded_rows, decoded_rows

HEADER = struct.Struct("<II")
"""Number of rows; number of columns, with the form of what follows in its upper two bits."""
_DIFFERENCES, _PLAIN, PLANES, _CODED = range(4)
"""Forms: third differences of bit patterns, and bit patterns off their predictions, which only earlier versions wrote;
numbers as they are; as `coded_rows` has them."""
WIDTH_BITS = 30
ORDER = 8
"""Of the polynomial through the last numbers, which predicts the next one in `PLANES`."""


def plain_rows(rows: FloatArray) -> bytes:
    """Bytes of (n, columns) rows as they are, for a run that must not wait."""
    header = HEADER.pack(len(rows), rows.shape[1] | _PLAIN << WIDTH_BITS)
    return b"".join((header, np.ascontiguousarray(rows, dtype="<f8").data))


def pack_rows(rows: FloatArray, bodies: Bodies = (), timestep: float = 1.0) -> bytes:
    """Bytes of (n, columns) rows; of `bodies` poses are predicted from velocities, `timestep` [s] by timestep."""
    if not len(rows):
        return plain_rows(rows)
    return HEADER.pack(len(rows), rows.shape[1] | _CODED << WIDTH_BITS) + coded_rows(rows, bodies, timestep)


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
    form = blob[HEADER.size - 1] >> (WIDTH_BITS - 24) if width else _PLAIN
    found = None
    if form == _CODED:
        found = decoded_rows(memoryview(blob)[HEADER.size :], count, width)
    elif width and len(blob) == HEADER.size + 8 * width * count:
        found = np.frombuffer(blob, "<f8", offset=HEADER.size).reshape(count, width)
    if found is None:
        raise RecordError(f"block: {len(blob)} bytes are not {count} rows of {width} columns")
    return found if form in {_CODED, _PLAIN} else _off_predictions(found, form)


def _off_predictions(planes: FloatArray, form: int) -> FloatArray:
    """The rows (n, columns) that are off their predictions by what is in byte planes, which take as many bytes."""
    count, width = planes.shape
    off = np.ascontiguousarray(planes.view(np.uint8).reshape(8, -1).T).view("<i8").reshape(width, count).T
    off = (off >> 1 & FLIP) ^ -(off & 1)
    if form == _DIFFERENCES:
        for order in (2, 1, 0):
            off[order:] = np.cumsum(off[order:], axis=0)
        return _flipped(off).view("<f8")
    bits, differences = np.empty((count, width), "<i8"), np.zeros((ORDER + 1, width))
    with np.errstate(all="ignore"):
        for i, row in enumerate(bits):
            predicted = np.zeros(width)
            for difference in differences[:i]:
                predicted += difference
            predicted[~(np.abs(predicted) < FARTHEST)] = 0.0
            row[:] = _flipped(_flipped(predicted.view("<i8")) + off[i])
            change = row.view("<f8")
            for k in range(ORDER + 1):
                change, differences[k] = change - differences[k], change
    return bits.view("<f8")


def _flipped(bits: IntArray) -> IntArray:
    """Bit patterns as integers that sort like their numbers, and back."""
    return np.where(bits < 0, bits ^ FLIP, bits)


_EPOCH = (2020, 1, 1, 0, 0, 0)
"""Time of the files in the archive: one world, one archive."""
FILES = 20_000
"""Files in an archive, at most."""
_LEVEL = 4
"""How hard files are compressed: harder takes twice the time for a twentieth of the bytes."""
_ENTRY = b"PK\x01\x02"
"""Before each file in the archive's table of contents."""
_DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, ValueError, OverflowError, OSError, RuntimeError)
"""What `zipfile` raises at an archive that is damaged."""
_ENCRYPTED = 0x1
"""A bit of a file's flags."""


def archive(files: Mapping[str, bytes]) -> bytes:
    """A zip archive of files, the same bytes for the same files."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as out:
        for name in sorted(files):
            out.writestr(zipfile.ZipInfo(name, _EPOCH), files[name], zipfile.ZIP_DEFLATED, _LEVEL)
    return buffer.getvalue()


def unpacked(blob: bytes, most: int) -> dict[str, bytes]:
    """Files of an archive, by their names, which are no paths on any disk; `most`: their bytes.

    What comes out is counted, whatever the archive's own table has.

    Raises:
        RecordError: it is damaged, or holds more, or what `archive` does not write.
    """
    if (count := blob.count(_ENTRY)) > FILES:  # before an object is made for each
        raise RecordError(f"files: {count} files: at most {FILES}")
    try:
        with zipfile.ZipFile(io.BytesIO(blob)) as stored:
            files: dict[str, bytes] = {}
            left = most
            for member in stored.infolist():
                if member.compress_type != zipfile.ZIP_DEFLATED or member.flag_bits & _ENCRYPTED:
                    raise RecordError("files: the archive is damaged: it is compressed in another way, or encrypted")
                if member.filename in files:
                    raise RecordError("files: two of one name")
                with stored.open(member) as content:
                    files[member.filename] = content.read(left + 1)
                left -= len(files[member.filename])
                if left < 0:
                    raise RecordError(f"files: more than {most >> 20} MiB")
            return files
    except _DAMAGE as error:
        raise RecordError(f"files: the archive is damaged: {error}") from None
