"""Rows of float64 as few bytes, exactly.

Columns that do not change take their first number. Each other number is predicted from those before it, the pose of a
body from its velocity too, and what is compressed is by how much its bit pattern, read as an integer that sorts like
the number, is off. Integer arithmetic wraps, so nothing is lost whatever the rows hold, NaN included. Predictions are
sums and products of kernels, which are never one operation: all processors have the same.
"""

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import RecordError
from vrx_mj.physics.kernel import allocating_kernel, inlined_kernel

_FLIP = np.int64(0x7FFF_FFFF_FFFF_FFFF)
"""Bits of a negative number that are inverted, so that numbers sort as integers."""
_ORDER = 10
"""Order of the polynomial through the last numbers, which predicts the next one."""
_MAX_PREDICTION = 1e300
"""Largest prediction; larger ones are 0."""
HEAD = struct.Struct(f"<II{_ORDER + 2}d")
"""Numbers of positions and of quaternions; what a position gains from row to row by a velocity and its differences; the
physics step [s].

Then come the columns of each position and of its velocity, the first columns of each quaternion and of its angular
velocity, a bit for each column that changes, the first row, and the others byte plane by byte plane, compressed.
"""
_MOST_STEPS = 1000
"""Largest number of physics steps between rows for which poses are predicted from velocities."""
_LEVEL = 1
"""Zstandard's level of compression of rows: a higher one takes four times the time for a hundredth of the bytes."""

Bodies = Sequence[tuple[int, int]]
"""Columns of each body: the first of 7 of its pose, and of 6 of its velocity, as MuJoCo has them."""
HEADER = struct.Struct("<II")
"""Number of rows; number of columns, with the form of what follows in its upper two bits."""
_PLAIN, _CODED = 1, 3
"""Forms: unchanged numbers, and those of `_coded_rows`."""
WIDTH_BITS = 30
"""Bits of the header that hold the number of columns."""


def _coded_rows(rows: FloatArray, bodies: Bodies, timestep: float) -> bytes:
    """Bytes of (n, columns) rows, n > 0, whose first column is the time where there are bodies; `timestep` [s]."""
    from pyarrow import Codec

    bits = np.ascontiguousarray(rows, dtype="<f8").view("<i8")
    changes = (bits != bits[0]).any(axis=0)
    moving = [(q + i, v + i) for q, v in bodies for i in range(3) if changes[q + i] and changes[v + i]]
    turning = [(q + 3, v + 3) for q, v in bodies if changes[q + 3 : q + 7].all() and changes[v + 3 : v + 6].all()]
    steps = (rows[1, 0] - rows[0, 0]) / timestep if moving or turning else 0.0
    gains = timestep * np.append(_gains(round(steps) if 0.0 <= steps <= _MOST_STEPS else 0), 1.0)  # NaN is not
    order, velocities, turns = _places(changes, moving, turning)
    table = np.empty((len(bits), len(order)), "<i8")
    _code(bits, order, table, velocities, turns, gains, back=False)
    planes = np.ascontiguousarray(table[1:].T).reshape(-1, 1).view(np.uint8).T.tobytes()
    packed = Codec("zstd", compression_level=_LEVEL).compress(planes)
    columns, changing = np.array([*moving, *turning], "<u4"), np.packbits(changes)
    return b"".join((HEAD.pack(len(moving), len(turning), *gains), *map(bytes, (columns, changing, bits[0])), packed))


def _gains(steps: int) -> FloatArray:
    """Gains of a position in so many steps of one unit of time by the velocity at their end and its differences.

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
        raise RecordError("block: columns of unknown bodies")
    others[driven] = False
    order = np.array([*np.flatnonzero(others), *driven], np.int64)
    if len(order) != np.count_nonzero(changes) or not others[driving].all():
        raise RecordError("block: columns of other bodies")
    place = np.cumsum(others) - 1
    velocities, turns = (place[np.array([v for _, v in bodies], np.int64)] for bodies in (moving, turning))
    return order, velocities, turns


def _decoded_rows(blob: memoryview, count: int, width: int) -> FloatArray | None:
    """The rows (count, width), count > 0, of which these are the bytes; None if they are not.

    Raises:
        RecordError: the columns of bodies are not those of bodies.
    """
    from pyarrow import decompress

    moving, turning, *gains = HEAD.unpack_from(blob) if len(blob) >= HEAD.size else (1 << 32, 0)
    starts = np.cumsum([HEAD.size, 8 * (moving + turning), (width + 7) // 8, 8 * width])
    if starts[-1] > len(blob):
        return None
    bodies, changing, first, planes = (blob[begin:end] for begin, end in zip(starts, [*starts[1:], None], strict=True))
    pairs = [(q, v) for q, v in np.frombuffer(bodies, "<u4").reshape(-1, 2).tolist()]
    changes = np.unpackbits(np.frombuffer(changing, np.uint8), count=width) != 0
    order, velocities, turns = _places(changes, pairs[:moving], pairs[moving:])
    try:
        content = decompress(planes, 8 * (count - 1) * len(order), "zstd")
    except OSError:  # also where these become more bytes, or fewer
        return None
    bits, table = np.empty((count, width), "<i8"), np.empty((count, len(order)), "<i8")
    bits[:] = np.frombuffer(first, "<i8")
    table[1:] = np.frombuffer(content, np.uint8).reshape(8, -1).T.copy().view("<i8").reshape(len(order), count - 1).T
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
    predicted, values, rate = np.empty(width), np.empty(width), np.empty(4)
    for i in range(count):
        if i == 0 or not back:
            for j in range(width):
                table[i, j] = bits[i, order[j]]
        _extrapolate(differences, min(i, _ORDER + 1), predicted)
        for j in range(positions):
            values[j] = _code_number(table, i, j, predicted[j], back)
        _follow(differences, values, 0, positions)
        if i > _ORDER:
            _move(differences, gains, velocities, differences[0, positions:], predicted[positions:])
        for j in range(positions, quaternions):
            values[j] = _code_number(table, i, j, predicted[j], back)
        for b in range(turns.size):
            turning = differences[0, turns[b] : turns[b] + 3]
            first = quaternions + 4 * b
            _turn(i, differences[0, first:], rates[b], gains, turning, predicted[first:], rate)
            _code_unit(table, i, first, predicted, values, back)
            _find_rate(values[first:], turning, gains[_ORDER + 1], rate)
            _follow(rates[b], rate, 0, 4)
        _follow(differences, values, positions, width)
        if back:
            for j in range(width):
                bits[i, order[j]] = table[i, j]


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
def _turn(
    i: int, last: FloatArray, rates: FloatArray, gains: FloatArray, turning: FloatArray, q: FloatArray, rate: FloatArray
) -> None:
    """Make a predicted quaternion (4,) of row `i` the one after the `last`, by rates and the newest angular velocity.

    Without enough rows before it stays; `rate` (4,) is room for one.
    """
    for _ in range(2 if i > _ORDER else 0):  # the newest rate is that of the quaternion which is sought
        _find_rate(q, turning, gains[_ORDER + 1], rate)
        for j in range(4):
            q[j] = last[j]
        for k in range(_ORDER + 1):
            for j in range(4):
                q[j] += gains[k] * rate[j]
                rate[j] -= rates[k, j]


@inlined_kernel
def _find_rate(q: FloatArray, turning: FloatArray, step: float, rate: FloatArray) -> None:
    """Write by how much a quaternion (4,) changed in a `step` [s] that turned it at (3,) [rad/s] about its own axes.

    (q - q exp(-turning step / 2)) / step, to the third power of the angle.
    """
    squared = turning[0] ** 2 + turning[1] ** 2 + turning[2] ** 2
    half, still = 0.5 - step * step * squared / 48.0, step * squared / 8.0
    a, b, c = half * turning[0], half * turning[1], half * turning[2]
    w, x, y, z = q[0], q[1], q[2], q[3]
    rate[0] = still * w - (x * a + y * b + z * c)
    rate[1] = still * x + (w * a + y * c - z * b)
    rate[2] = still * y + (w * b + z * a - x * c)
    rate[3] = still * z + (w * c + x * b - y * a)


@inlined_kernel
def _code_unit(table: IntArray, i: int, first: int, predicted: FloatArray, values: FloatArray, back: bool) -> None:
    """Code a unit quaternion: its largest number follows from the other three."""
    largest, squares = first, 1.0
    for j in range(first + 1, first + 4):
        if abs(predicted[j]) > abs(predicted[largest]):
            largest = j
    for j in range(first, first + 4):
        if j != largest:
            values[j] = _code_number(table, i, j, predicted[j], back)
            squares -= values[j] * values[j]
    predicted[largest] = math.copysign(math.sqrt(max(squares, 0.0)), predicted[largest])
    values[largest] = _code_number(table, i, largest, predicted[largest], back)


@inlined_kernel
def _code_number(table: IntArray, i: int, j: int, predicted: float, back: bool) -> float:
    """Code a bit pattern with its sign in the lowest bit: small means few bits; or `back`. Return the number."""
    expected: Any = _sortable(predicted if abs(predicted) < _MAX_PREDICTION else 0.0)
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


def unpack_rows(blob: bytes | memoryview) -> FloatArray:
    """The rows of which these are the bytes, bit for bit.

    Raises:
        RecordError: these are not such bytes.
    """
    count, width = shape_of(blob)
    form, found = blob[HEADER.size - 1] >> (WIDTH_BITS - 24) if width else 0, None
    if form == _CODED and count:
        found = _decoded_rows(memoryview(blob)[HEADER.size :], count, width)
    elif form == _PLAIN and len(blob) == HEADER.size + 8 * width * count:
        found = np.frombuffer(blob, "<f8", offset=HEADER.size).reshape(count, width)
    if found is None:
        raise RecordError(f"block: {len(blob)} bytes are not {count} rows of {width} columns")
    return found
