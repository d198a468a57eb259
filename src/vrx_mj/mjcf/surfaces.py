"""Closed surfaces that pass through themselves or each other: where, and how much volume that falsifies."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import VrxError

_MOST_TRIANGLES = 20_000
"""Triangles among which crossings are looked for."""
_MOST_PAIRS = 100_000_000
"""Pairs of triangles that are looked at, of those that overlap along one axis."""
MOST_SHOWN = 1000
"""Pairs that cross up to which they are counted."""
_AT_ONCE = 2_000_000
"""Pairs for which memory is made at once."""
_NEAR = 1e-6
"""Share of the extent [m] up to which triangles touch, and do not pass through each other."""
_COLUMNS = 128
"""Vertical lines along each horizontal axis along which volumes are measured."""
_OFF = (0.3819660113, 0.7320508076)
"""Place of a line in its column, as shares that are irrational: lines then meet no edges of plain shapes."""
_LITTLE = 0.005
"""Share of the volume up to which what counts twice is not worth a remark."""
_MOST_INVERTED = 0.02
"""Share of the volume up to which parts may be inside out."""
_REPAIR = "repair it, for example with Blender's 3D-Print Toolbox"
_JOIN = "join them to one, for example with Blender's Boolean union"


@dataclass(frozen=True)
class Overlap:
    """Volumes [m3] in closed surfaces, by how often these enclose a place."""

    volume: float
    """Volume that the surfaces hold, each place counted once."""
    twice: float
    """Volume that counts once too often, or more."""
    inverted: float
    """Volume that parts which are inside out hold."""


def checked_surface(corners: FloatArray, names: Sequence[str] = (), starts: Sequence[int] = ()) -> tuple[str, ...]:
    """Remarks about closed triangles (n, 3, 3) of a hull that cross, or hold a place twice.

    `names` of its parts and the triangle at which each starts name those that overlap.

    Raises:
        VrxError: a part of the surface is inside out, so that water would suck there.
    """
    if not len(corners):
        return ()
    found, (count, place) = overlap(corners), crossings(corners)
    spot = f", the first at ({', '.join(f'{value:.3g}' for value in place)}) m" if count else ""
    number = f"{count:,} or more" if count == MOST_SHOWN else f"{count:,}"
    pairs = f"{number} {'pair of triangles crosses' if count == 1 else 'pairs of triangles cross'}{spot}"
    if found.inverted > _MOST_INVERTED * (found.volume + found.inverted):
        raise VrxError(
            f"its surface passes through itself: {found.inverted:.3g} m3 of {found.volume + found.inverted:.3g} m3 "
            f"are inside out{'; ' + pairs if count else ''}; {_REPAIR}"
        )
    if found.twice > _LITTLE * found.volume:
        where = _worst_pair(corners, names, starts)
        text = f"its surfaces overlap{where}: {found.twice:.3g} of {found.volume:.3g} m3 count twice and lift too much"
        return (f"{text}{'; ' + pairs if count else ''}; {_JOIN}",)
    if count:
        return (f"its surface passes through itself: {pairs}; {_REPAIR}",)
    return ()


def _worst_pair(corners: FloatArray, names: Sequence[str], starts: Sequence[int]) -> str:
    """The two parts that overlap most, in words."""
    if len(names) < 2:
        return ""
    ends = [*starts[1:], len(corners)]
    parts = [corners[a:b] for a, b in zip(starts, ends, strict=True)]
    boxes = [(part.reshape(-1, 3).min(axis=0), part.reshape(-1, 3).max(axis=0)) for part in parts]
    worst, words = 0.0, ""
    for i, (low, high) in enumerate(boxes):
        for j in range(i):
            if (low < boxes[j][1]).all() and (boxes[j][0] < high).all():
                twice = overlap(np.concatenate([parts[i], parts[j]])).twice
                if twice > worst:
                    worst, words = twice, f", most of all {names[j]} and {names[i]}"
    return words


def overlap(corners: FloatArray) -> Overlap:
    """How often closed triangles (n, 3, 3) [m] enclose each place, along vertical lines."""
    column, z, down, area = _passages(corners)
    order = np.lexsort((z, column))
    column, z, down = column[order], z[order], down[order]
    total = np.bincount(column, weights=down, minlength=1)
    even = (total == 0.0)[column]  # a line that meets an edge is left out
    column, z, down = column[even], z[even], down[even]
    depth = np.cumsum(down)[:-1]
    length = np.where(column[1:] == column[:-1], np.diff(z), 0.0) * area
    return Overlap(
        volume=float(length[depth > 0.0].sum()),
        twice=float((np.maximum(depth - 1.0, 0.0) * length).sum()),
        inverted=float((np.maximum(-depth, 0.0) * length).sum()),
    )


def _passages(corners: FloatArray) -> tuple[IntArray, FloatArray, FloatArray, float]:
    """Where vertical lines pass triangles: line, height [m], 1 on the way in and -1 on the way out; area of a line."""
    flat = corners[:, :, :2]
    low, size = flat.min(axis=(0, 1)), np.maximum(np.ptp(flat, axis=(0, 1)), 1e-300)
    number = _COLUMNS
    while True:
        grid = (flat - low) / size * number - _OFF
        first = np.clip(np.ceil(grid.min(axis=1)), 0, number).astype(np.int64)
        last = np.clip(np.floor(grid.max(axis=1)), -1, number - 1).astype(np.int64)
        wide = np.maximum(last - first + 1, 0)
        counts = wide[:, 0] * wide[:, 1]
        if counts.sum() <= _AT_ONCE or number == 1:
            break
        number //= 2
    rows = np.repeat(np.arange(len(corners)), counts)
    place = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    x, y = first[rows, 0] + place // wide[rows, 1], first[rows, 1] + place % wide[rows, 1]
    a, b, c = np.moveaxis(grid[rows], 1, 0)
    point = np.stack([x, y], axis=1)
    shares = np.stack([_turn(b, c, point), _turn(c, a, point), _turn(a, b, point)], axis=1)
    whole = shares.sum(axis=1)
    inside = (whole != 0.0) & (shares * np.sign(whole)[:, None] > 0.0).all(axis=1)
    rows, shares, whole = rows[inside], shares[inside], whole[inside]
    height = (shares * corners[rows, :, 2]).sum(axis=1) / whole
    return (x * number + y)[inside], height, -np.sign(whole), float(size[0] * size[1]) / number**2


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Twice the area of flat triangles (n, 2), above 0 counter-clockwise."""
    found: FloatArray = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return found


def crossings(corners: FloatArray) -> tuple[int, FloatArray]:
    """The number of pairs of triangles (n, 3, 3) [m] that pass through each other, and a place; at most `MOST_SHOWN`.

    Triangles that touch, share corners or lie in a plane do not count. Of more than `_MOST_TRIANGLES` it is 0.
    """
    count, place = 0, np.zeros(3)
    if len(corners) > _MOST_TRIANGLES:
        return count, place
    least = _NEAR * float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    for one, other in _neighbours(corners):
        places = _crossing_middles(corners[one], corners[other], least)
        if len(places) and not count:
            place = places[0]
        count = min(count + len(places), MOST_SHOWN)
        if count == MOST_SHOWN:
            break
    return count, place


def _neighbours(corners: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Pairs of triangles whose boxes overlap, some at a time: those that overlap along one axis, then along all."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    counts, order = np.zeros(0, np.int64), np.zeros(0, np.int64)
    for axis in range(3):
        along = np.argsort(low[:, axis], kind="stable")
        ends = np.searchsorted(low[along, axis], high[along, axis], side="right")
        after = ends - np.arange(len(along)) - 1
        if not len(counts) or after.sum() < counts.sum():
            counts, order = after, along
    total = np.cumsum(counts)
    start = 0
    while start < len(order) and total[start] <= _MOST_PAIRS:
        base = int(total[start - 1]) if start else 0
        end = max(int(np.searchsorted(total, base + _AT_ONCE, side="right")), start + 1)
        own = counts[start:end]
        first = np.repeat(np.arange(start, end), own)
        second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(own) - own, own)
        one, other = order[first], order[second]
        near: BoolArray = ((low[one] <= high[other]) & (low[other] <= high[one])).all(axis=1)
        yield one[near], other[near]
        start = end


def _crossing_middles(one: FloatArray, other: FloatArray, least: float) -> FloatArray:
    """Middles (m, 3) of the lines along which pairs of triangles (n, 3, 3) pass through each other.

    Each has corners on both sides of the other's plane, and on the line in which the planes meet they overlap (Moeller,
    1997).
    """
    normals = [_normals(one), _normals(other)]
    heights = [np.einsum("nij,nj->ni", one - other[:, :1], normals[1]),
               np.einsum("nij,nj->ni", other - one[:, :1], normals[0])]  # fmt: skip
    rows = np.flatnonzero(np.logical_and.reduce([(h.min(axis=1) < -least) & (h.max(axis=1) > least) for h in heights]))
    along = np.cross(normals[0][rows], normals[1][rows])
    length = np.linalg.norm(along, axis=1)
    along /= np.where(length > 0.0, length, 1.0)[:, None]
    base = one[rows, 0]
    spans = [
        _span(triangles[rows] - base[:, None], h[rows], along)
        for triangles, h in zip((one, other), heights, strict=True)
    ]
    start, end = np.maximum(spans[0][0], spans[1][0]), np.minimum(spans[0][1], spans[1][1])
    real = (end - start > least) & (length > _NEAR)
    point = spans[0][2][real]
    middle = 0.5 * (start + end)[real] - np.einsum("ij,ij->i", point, along[real])
    found: FloatArray = base[real] + point + middle[:, None] * along[real]
    return found


def _normals(triangles: FloatArray) -> FloatArray:
    """Unit normals (n, 3); 0 of triangles without area."""
    found: FloatArray = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(found, axis=1)
    found /= np.where(length > 0.0, length, 1.0)[:, None]
    return found


def _span(triangles: FloatArray, heights: FloatArray, along: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where triangles over and under a plane meet it, from and to along a unit vector [m], and a point (n, 3) there."""
    rows, above = np.arange(len(triangles)), heights >= 0.0
    single = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), above.argmin(axis=1))  # the corner on its own side
    a, ha = triangles[rows, single], heights[rows, single]
    points = []
    for turn in (1, 2):
        b, hb = triangles[rows, (single + turn) % 3], heights[rows, (single + turn) % 3]
        points.append(a + (ha / (ha - hb))[:, None] * (b - a))
    s, t = (np.einsum("ij,ij->i", point, along) for point in points)
    return np.minimum(s, t), np.maximum(s, t), points[0]
