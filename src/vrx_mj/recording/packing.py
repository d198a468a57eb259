"""Rows of float64 as few bytes, exactly, and files to archives.

Columns that do not change take their first number. Each other number is predicted from those before it, the pose of a
body from its velocity too, and what is written is by how much its bit pattern, read as an integer that sorts like the
number, is off. Integer arithmetic wraps, so nothing is lost whatever the rows hold, NaN included. Predictions are sums
and products of kernels, which are never one operation: all processors have the same.

Rows of earlier versions are read: there each number was predicted from those of its column, and by how much it is off
was written byte plane by byte plane.
"""

from __future__ import annotations

import io
import math
import struct
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import RecordError
from vrx_mj.physics.kernel import allocating_kernel, inlined_kernel

_FLIP = np.int64(0x7FFF_FFFF_FFFF_FFFF)
_ORDER = 10
"""Of the polynomial through the last numbers, which predicts the next one."""
_FARTHEST = 1e300
"""Predictions beyond this are 0."""
HEAD = struct.Struct(f"<II{_ORDER + 2}d")
"""Numbers of positions and of quaternions; what a position gains from row to row by a velocity and its differences; the
physics step [s].

Then come the columns of each position and of its velocity, the first columns of each quaternion and of its angular
velocity, a bit for each column that changes, the first row, and words with the bits of the others.
"""
_MOST_STEPS = 1000
"""Physics steps between rows, at most, for which poses are predicted from velocities."""
_MEAN, _SLOWNESS = 640, 3
"""Mean length of integers at first, in sixteenths of a bit, and the power of two by which it follows slowly."""

Bodies = Sequence[tuple[int, int]]
"""Columns of each body: the first of 7 of its pose, and of 6 of its velocity, as MuJoCo has them."""


def _coded_rows(rows: FloatArray, bodies: Bodies, timestep: float) -> bytes:
    """Bytes of (n, columns) rows, n > 0, whose first column is the time where there are bodies; `timestep` [s]."""
    bits = np.ascontiguousarray(rows, dtype="<f8").view("<i8")
    changes = (bits != bits[0]).any(axis=0)
    moving = [(q + i, v + i) for q, v in bodies for i in range(3) if changes[q + i] and changes[v + i]]
    turning = [(q + 3, v + 3) for q, v in bodies if changes[q + 3 : q + 7].all() and changes[v + 3 : v + 6].all()]
    steps = (rows[1, 0] - rows[0, 0]) / timestep if moving or turning else 0.0
    gains = timestep * np.append(_gains(round(steps) if 0.0 <= steps <= _MOST_STEPS else 0), 1.0)  # NaN is not
    order, velocities, turns = _places(changes, moving, turning)
    table = np.empty((len(bits), len(order)), "<i8")
    _code(bits, order, table, velocities, turns, gains, back=False)
    words = np.empty(3 * table.size + 1, "<u8")
    words = words[: _write_bits(table.view("<u8"), words)]
    columns, changing = np.array([*moving, *turning], "<u4"), np.packbits(changes)
    return b"".join((HEAD.pack(len(moving), len(turning), *gains), *map(bytes, (columns, changing, bits[0], words))))


def _gains(steps: int) -> FloatArray:
    """What a position gains in so many steps of one unit of time by the velocity at their end and its differences.

    Each step moves by the velocity that it ends with, as in MuJoCo; those between two rows are taken from the
    polynomial through the velocities of the last rows, by Newton's backward interpolation.
    """
    ago = np.arange(steps) / max(steps, 1)
    terms = (np.prod([(k - ago) / (k + 1) for k in range(order)], axis=0) for order in range(_ORDER + 1))
    return np.array([np.sum(term * np.ones(steps)) for term in terms])


def _places(changes: BoolArray, moving: Bodies, turning: Bodies) -> tuple[IntArray, IntArray, IntArray]:
    """The columns that are coded, positions and then quaternions last, and where velocities and angular ones are there.

    Raises:
        RecordError: columns of bodies do not change, or are those of another one.
    """
    others = changes.copy()
    driven = [*(q for q, _ in moving), *(q + i for q, _ in turning for i in range(4))]
    driving = [*(v for _, v in moving), *(v + i for _, v in turning for i in range(3))]
    if max([*driven, *driving], default=0) >= len(changes):
        raise RecordError("block: columns of bodies that are not there")
    others[driven] = False
    order = np.array([*np.flatnonzero(others), *driven], np.int64)
    if len(order) != np.count_nonzero(changes) or not others[driving].all():
        raise RecordError("block: columns of bodies that are others'")
    place = np.cumsum(others) - 1
    velocities, turns = (place[np.array([v for _, v in bodies], np.int64)] for bodies in (moving, turning))
    return order, velocities, turns


def _decoded_rows(blob: memoryview, count: int, width: int) -> FloatArray | None:
    """The rows (count, width), count > 0, of which these are the bytes; None if they are not.

    Raises:
        RecordError: the columns of bodies are not those of bodies.
    """
    moving, turning, *gains = HEAD.unpack_from(blob) if len(blob) >= HEAD.size else (1 << 32, 0)
    sizes = (HEAD.size, 8 * (moving + turning), (width + 7) // 8, 8 * width)
    if sum(sizes) > len(blob) or (len(blob) - sum(sizes)) % 8:
        return None
    starts = np.cumsum(sizes)
    bodies, changing, first, words = (blob[begin:end] for begin, end in zip(starts, [*starts[1:], None], strict=True))
    pairs = [(q, v) for q, v in np.frombuffer(bodies, "<u4").reshape(-1, 2).tolist()]
    changes = np.unpackbits(np.frombuffer(changing, np.uint8), count=width) != 0
    order, velocities, turns = _places(changes, pairs[:moving], pairs[moving:])
    bits = np.empty((count, width), "<i8")
    bits[:] = np.frombuffer(first, "<i8")
    table = np.empty((count, len(order)), "<i8")
    if not _read_bits(np.append(np.frombuffer(words, "<u8"), np.uint64(0)), table.view("<u8")):
        return None
    _code(bits, order, table, velocities, turns, np.array(gains), back=True)
    return bits.view("<f8")


@allocating_kernel
def _code(
    bits: IntArray, order: IntArray, table: IntArray, velocities: IntArray, turns: IntArray, gains: FloatArray,
    back: bool,
) -> None:  # fmt: skip
    """Write by how much bit patterns are off their predictions into a table, but for the first row; or `back`.

    `order` are columns of `bits` (n, columns), of which the last are positions and then quaternions: `velocities` are
    where in the table the velocity of each position is, and `turns` where the angular velocity of a quaternion begins.
    """
    count, width = table.shape
    quaternions = width - 4 * turns.size
    positions = quaternions - velocities.size
    differences, rates = np.zeros((_ORDER + 1, width)), np.zeros((turns.size, _ORDER + 1, 4))
    predicted, values = np.empty(width), np.empty(width)
    for i in range(count):
        if i == 0 or not back:
            for j in range(width):
                table[i, j] = bits[i, order[j]]
        _extrapolate(differences, min(i, _ORDER + 1), predicted)
        for j in range(positions):
            values[j] = _coded(table, i, j, predicted[j], back)
        _follow(differences, values, 0, positions)
        if i > _ORDER:
            _move(differences, gains, velocities, differences[0, positions:], predicted[positions:])
        for j in range(positions, quaternions):
            values[j] = _coded(table, i, j, predicted[j], back)
        for b in range(turns.size):
            turning = differences[0, turns[b] : turns[b] + 3]
            last = differences[0, quaternions + 4 * b :]
            _code_turning(table, i, quaternions + 4 * b, last, rates[b], gains, turning, predicted, values, back)
        _follow(differences, values, positions, width)
        if back:
            for j in range(width):
                bits[i, order[j]] = table[i, j]


@inlined_kernel
def _code_turning(
    table: IntArray, i: int, first: int, last: FloatArray, rates: FloatArray, gains: FloatArray, turning: FloatArray,
    predicted: FloatArray, values: FloatArray, back: bool,
) -> None:  # fmt: skip
    """Code a quaternion, and make its rate and the backward differences of that the newest."""
    if i > _ORDER:
        _turn(last, rates, gains, turning, predicted[first:])
    _code_unit(table, i, first, predicted, values, back)
    w, x, y, z = _rate(values[first:], turning, gains[_ORDER + 1])
    for k in range(_ORDER + 1):
        w, rates[k, 0] = w - rates[k, 0], w
        x, rates[k, 1] = x - rates[k, 1], x
        y, rates[k, 2] = y - rates[k, 2], y
        z, rates[k, 3] = z - rates[k, 3], z


@inlined_kernel
def _move(
    differences: FloatArray, gains: FloatArray, velocities: IntArray, last: FloatArray, predicted: FloatArray
) -> None:
    """Predict positions from the `last` ones and their velocities, of which the newest are known."""
    for j in range(velocities.size):
        predicted[j] = last[j]
    for k in range(_ORDER + 1):
        for j in range(velocities.size):
            predicted[j] += gains[k] * differences[k, velocities[j]]


@inlined_kernel
def _extrapolate(differences: FloatArray, known: int, predicted: FloatArray) -> None:
    """Predict the next number of each column, of which so many are known."""
    predicted[:] = 0.0
    for k in range(known):
        for j in range(predicted.size):
            predicted[j] += differences[k, j]


@inlined_kernel
def _follow(differences: FloatArray, values: FloatArray, begin: int, end: int) -> None:
    """Make the last numbers of columns and their backward differences those of the next ones; `values` are used up."""
    for k in range(_ORDER + 1):
        for j in range(begin, end):
            change = values[j] - differences[k, j]
            differences[k, j] = values[j]
            values[j] = change


@inlined_kernel
def _turn(last: FloatArray, rates: FloatArray, gains: FloatArray, turning: FloatArray, q: FloatArray) -> None:
    """Make a predicted quaternion (4,) the one after the `last`, by rates before and the newest angular velocity."""
    for _ in range(2):  # the newest rate is that of the quaternion which is sought
        w, x, y, z = _rate(q, turning, gains[_ORDER + 1])
        a, b, c, d = last[0], last[1], last[2], last[3]
        for k in range(_ORDER + 1):
            a, w = a + gains[k] * w, w - rates[k, 0]
            b, x = b + gains[k] * x, x - rates[k, 1]
            c, y = c + gains[k] * y, y - rates[k, 2]
            d, z = d + gains[k] * z, z - rates[k, 3]
        q[0], q[1], q[2], q[3] = a, b, c, d


@inlined_kernel
def _rate(q: FloatArray, turning: FloatArray, step: float) -> tuple[float, float, float, float]:
    """Return by how much a quaternion (4,) changed in a `step` [s] that turned it at (3,) [rad/s] about its own axes.

    (q - q exp(-turning step / 2)) / step, to the third power of the angle.
    """
    squared = turning[0] ** 2 + turning[1] ** 2 + turning[2] ** 2
    half, still = 0.5 - step * step * squared / 48.0, step * squared / 8.0
    a, b, c = half * turning[0], half * turning[1], half * turning[2]
    w, x, y, z = q[0], q[1], q[2], q[3]
    return (
        still * w - (x * a + y * b + z * c),
        still * x + (w * a + y * c - z * b),
        still * y + (w * b + z * a - x * c),
        still * z + (w * c + x * b - y * a),
    )


@inlined_kernel
def _code_unit(table: IntArray, i: int, first: int, predicted: FloatArray, values: FloatArray, back: bool) -> None:
    """Code a unit quaternion: its largest number follows from the other three."""
    largest, squares = first, 1.0
    for j in range(first + 1, first + 4):
        if abs(predicted[j]) > abs(predicted[largest]):
            largest = j
    for j in range(first, first + 4):
        if j != largest:
            values[j] = _coded(table, i, j, predicted[j], back)
            squares -= values[j] * values[j]
    predicted[largest] = math.copysign(math.sqrt(max(squares, 0.0)), predicted[largest])
    values[largest] = _coded(table, i, largest, predicted[largest], back)


@inlined_kernel
def _coded(table: IntArray, i: int, j: int, predicted: float, back: bool) -> float:
    """Code a bit pattern with its sign in the lowest bit: small means few bits; or `back`. Return the number."""
    expected: Any = _sortable(predicted if abs(predicted) < _FARTHEST else 0.0)
    bits: Any = table[i, j]
    if i > 0 and back:
        bits = expected + (((bits >> 1) & _FLIP) ^ -(bits & 1))
        bits = bits ^ _FLIP if bits < 0 else bits
        table[i, j] = bits
    elif i > 0:
        off = (bits ^ _FLIP if bits < 0 else bits) - expected
        table[i, j] = (off << 1) ^ (off >> 63)
    value: float = np.int64(bits).view(np.float64)
    return value


@inlined_kernel
def _sortable(value: float) -> int:
    """Return the bit pattern of a number as an integer that sorts like it."""
    bits: Any = np.float64(value).view(np.int64)
    found: int = bits ^ _FLIP if bits < 0 else bits
    return found


@allocating_kernel
def _write_bits(table: IntArray, words: IntArray) -> int:
    """Write unsigned integers (n, columns) but for the first row; return the number of words.

    Each is its length and its bits below the highest. Of the length is written by how much it is off the mean length
    in its column: of 0, 1, -1, 2, ... as many zeros as come before it, and a one.
    """
    means, at, one = np.full(table.shape[1], _MEAN), 0, np.uint64(1)
    words[0] = 0
    for i in range(1, table.shape[0]):
        for j in range(table.shape[1]):
            value: Any = table[i, j]
            length = _length(value)
            off = length - ((means[j] + 8) >> 4)
            means[j] += ((length << 4) - means[j]) >> _SLOWNESS
            zeros = 2 * off - 1 if off > 0 else -2 * off
            for _ in range(zeros >> 5):
                at = _put(words, at, np.uint64(0), 32)
            at = _put(words, at, one << np.uint64(zeros & 31), (zeros & 31) + 1)
            if length > 1:
                at = _put(words, at, value ^ (one << np.uint64(length - 1)), length - 1)
    return (at + 63) >> 6


@inlined_kernel
def _length(value: Any) -> int:
    """Return the number of bits of an unsigned integer."""
    length, left = 0, value
    for half in (32, 16, 8, 4, 2, 1):
        if left >> np.uint64(half):
            length += half
            left >>= np.uint64(half)
    return length + int(left)


@inlined_kernel
def _put(words: IntArray, at: int, value: Any, length: int) -> int:
    """Write so many bits, 1 to 63, at bit `at`; return where the next ones go."""
    used = at & 63
    words[at >> 6] |= value << np.uint64(used)
    if used + length >= 64:
        words[(at >> 6) + 1] = value >> np.uint64(64 - used) if used else np.uint64(0)
    return at + length


@allocating_kernel
def _read_bits(words: IntArray, table: IntArray) -> bool:
    """Write the integers of which `_write_bits` wrote the words, and one more, but for the first row.

    Return whether they are such words.
    """
    means, at, end, one = np.full(table.shape[1], _MEAN), 0, 64 * (words.size - 1), np.uint64(1)
    for i in range(1, table.shape[0]):
        for j in range(table.shape[1]):
            zeros = 0
            while at < end and not words[at >> 6] >> np.uint64(at & 63) & one:
                zeros, at = zeros + 1, at + 1
            length = ((zeros + 1) >> 1 if zeros & 1 else -(zeros >> 1)) + ((means[j] + 8) >> 4)
            at += 1
            more = max(length - 1, 0)
            if length < 0 or length > 64 or at + more > end:
                return False
            means[j] += ((length << 4) - means[j]) >> _SLOWNESS
            used = at & 63
            value: Any = words[at >> 6] >> np.uint64(used)
            if used:
                value |= words[(at >> 6) + 1] << np.uint64(64 - used)
            highest = one << np.uint64(more)
            table[i, j] = highest | (value & (highest - one)) if length else np.uint64(0)
            at += more
    return end - at < 64


HEADER = struct.Struct("<II")
"""Number of rows; number of columns, with the form of what follows in its upper two bits."""
_DIFFERENCES, _PLAIN, PLANES, _CODED = range(4)
"""Forms: third differences of bit patterns, and bit patterns off their predictions, which only earlier versions wrote;
numbers as they are; as `_coded_rows` has them."""
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
    return HEADER.pack(len(rows), rows.shape[1] | _CODED << WIDTH_BITS) + _coded_rows(rows, bodies, timestep)


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
        found = _decoded_rows(memoryview(blob)[HEADER.size :], count, width)
    elif width and len(blob) == HEADER.size + 8 * width * count:
        found = np.frombuffer(blob, "<f8", offset=HEADER.size).reshape(count, width)
    if found is None:
        raise RecordError(f"block: {len(blob)} bytes are not {count} rows of {width} columns")
    return found if form in {_CODED, _PLAIN} else _off_predictions(found, form)


def _off_predictions(planes: FloatArray, form: int) -> FloatArray:
    """The rows (n, columns) that are off their predictions by what is in byte planes, which take as many bytes."""
    count, width = planes.shape
    off = np.ascontiguousarray(planes.view(np.uint8).reshape(8, -1).T).view("<i8").reshape(width, count).T
    off = (off >> 1 & _FLIP) ^ -(off & 1)
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
            predicted[~(np.abs(predicted) < _FARTHEST)] = 0.0
            row[:] = _flipped(_flipped(predicted.view("<i8")) + off[i])
            change = row.view("<f8")
            for k in range(ORDER + 1):
                change, differences[k] = change - differences[k], change
    return bits.view("<f8")


def _flipped(bits: IntArray) -> IntArray:
    """Bit patterns as integers that sort like their numbers, and back."""
    return np.where(bits < 0, bits ^ _FLIP, bits)


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
