"""Closed surfaces: where they pass through themselves or each other, and a hull's surface as panels for waves."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.config.shapes import normals_of
from vrx_mj.errors import VrxError
from vrx_mj.model.boats import MOST_TRIANGLES

_MOST_TRIANGLES = 20_000
"""Largest number of triangles of a mesh that is searched for crossings."""
_MOST_PAIRS = 100_000_000
"""Largest number of pairs of triangles compared, of those that overlap along one axis."""
MOST_SHOWN = 1000
"""Largest number of crossing pairs that is counted."""
_PAIR_CHUNK = 2_000_000
"""Number of pairs compared at once, by the memory that they take."""
_TOUCH_TOLERANCE = 1e-6
"""Share of the extent [m] up to which triangles touch, and do not pass through each other."""
_RAYS_PER_AXIS = 128
"""Number of vertical lines along each horizontal axis by which volumes are measured."""
_RAY_OFFSET = (0.3819660113, 0.7320508076)
"""Place of a line in its column, as shares that are irrational: lines then meet no edges of plain shapes."""
_MAX_OVERLAP = 0.005
"""Share of the volume that may count twice without a warning."""
_MAX_INVERTED = 0.02
"""Share of the volume that may be inside out without a warning."""
_REPAIR = "repair it, for example with Blender's 3D-Print Toolbox"
"""Advice on a broken mesh, in messages."""
_JOIN = "join them to one, for example with Blender's Boolean union"
"""Advice on overlapping parts, in messages."""
_SEAM = 1e-9
"""Distance [m] within which two corners are one point."""
_MOMENT_TOLERANCE = 1e-7
"""Relative difference of the moments of two surfaces up to which they are one."""
_EDGE_TOLERANCE = 1e-6
"""Relative difference of two edges up to which they are equally long."""
MIN_PANELS = 200
"""Least number of panels of a compact hull, all of about the same size."""
_MAX_PANELS = 1000
"""Largest number of panels to which halving equal edges alike may bring a hull."""
_PARTS = 8
"""Number of parts into which a slender hull is divided along its length."""


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
    if found.inverted > _MAX_INVERTED * (found.volume + found.inverted):
        raise VrxError(
            f"its surface intersects itself: {found.inverted:.3g} m3 of {found.volume + found.inverted:.3g} m3 "
            f"are inside out{'; ' + pairs if count else ''}; {_REPAIR}"
        )
    if found.twice > _MAX_OVERLAP * found.volume:
        where = _worst_pair(corners, names, starts)
        text = f"its surfaces overlap{where}: {found.twice:.3g} of {found.volume:.3g} m3 count twice and add buoyancy"
        return (f"{text}{'; ' + pairs if count else ''}; {_JOIN}",)
    if count:
        return (f"its surface intersects itself: {pairs}; {_REPAIR}",)
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
    number = _RAYS_PER_AXIS
    while True:
        grid = (flat - low) / size * number - _RAY_OFFSET
        first = np.clip(np.ceil(grid.min(axis=1)), 0, number).astype(np.int64)
        last = np.clip(np.floor(grid.max(axis=1)), -1, number - 1).astype(np.int64)
        wide = np.maximum(last - first + 1, 0)
        counts = wide[:, 0] * wide[:, 1]
        if counts.sum() <= _PAIR_CHUNK or number == 1:
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
    return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])


def crossings(corners: FloatArray) -> tuple[int, FloatArray]:
    """The number of pairs of triangles (n, 3, 3) [m] that pass through each other, and a place; at most `MOST_SHOWN`.

    Triangles that touch, share corners or lie in a plane do not count. Of more than `_MOST_TRIANGLES` it is 0.
    """
    count, place = 0, np.zeros(3)
    if len(corners) > _MOST_TRIANGLES:
        return count, place
    least = _TOUCH_TOLERANCE * float(np.ptp(corners.reshape(-1, 3), axis=0).max())
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
        end = max(int(np.searchsorted(total, base + _PAIR_CHUNK, side="right")), start + 1)
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
    real = (end - start > least) & (length > _TOUCH_TOLERANCE)
    point = spans[0][2][real]
    middle = 0.5 * (start + end)[real] - np.einsum("ij,ij->i", point, along[real])
    found: FloatArray = base[real] + point + middle[:, None] * along[real]
    return found


def _normals(triangles: FloatArray) -> FloatArray:
    """Unit normals (n, 3); 0 of triangles without area."""
    found: FloatArray = normals_of(triangles)
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


def panels_of(corners: FloatArray) -> tuple[FloatArray, IntArray]:
    """Points (n, 3) [m] and triangles (m, 3) of closed triangles (k, 3, 3), of which long ones are divided.

    An edge is halved that is a triangle's longest, longer than a part of `_PARTS`, and longer than that of `MIN_PANELS`
    equal triangles of the same area, right-angled with two equal sides. It is halved in both triangles that have it, so
    that the surface stays closed. Of a surface that is the same to port and to starboard, or ahead and astern, but
    whose triangles are not, one half is divided and mirrored, so that waves from ahead do not push it aside. Edges are
    longer where there would be more than `MOST_TRIANGLES`: long narrow ones become many.
    """
    merged = _merge_points(corners)
    area = 0.5 * float(np.linalg.norm(normals_of(corners), axis=1).sum())
    longest = max(2.0 * math.sqrt(area / MIN_PANELS), float(np.ptp(merged[0], axis=0).max()) / _PARTS)
    while len((found := _panels(corners, *merged, longest))[1]) > MOST_TRIANGLES:
        longest *= 2.0
    return found


def _panels(
    corners: FloatArray, points: FloatArray, triangles: IntArray, longest: float
) -> tuple[FloatArray, IntArray]:
    """Panels as of `panels_of`, with a longest edge [m]."""
    found, even = (_divide(points, triangles, longest, even=choice) for choice in (False, True))
    axes = [axis for axis in (1, 0) if _same_surface(*_halves(corners, axis)) and not _is_mirrored(*found, axis)]
    if not axes:
        return found
    if len(even[1]) <= _MAX_PANELS and all(_is_mirrored(*even, axis) for axis in axes):
        return even
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    part = corners - middle
    for axis in axes:
        part = _half(part, axis)
    points, triangles = _divide(*_merge_points(part), longest, even=False)
    part = points[triangles]
    for axis in axes:
        part = np.concatenate([part, _mirror(part, axis)])
    points, triangles = _merge_points(part)
    return points + middle, triangles


def _merge_points(corners: FloatArray) -> tuple[FloatArray, IntArray]:
    """Points (n, 3) and triangles (m, 3) of corners (m, 3, 3); those within `_SEAM` are one point."""
    points, named = np.unique(np.round(corners.reshape(-1, 3) / _SEAM) * _SEAM, axis=0, return_inverse=True)
    return points, named.reshape(-1, 3).astype(np.int64)


def _mirror(corners: FloatArray, axis: int) -> FloatArray:
    """Triangles (n, 3, 3) mirrored along an axis, their outside still outside."""
    sign = np.ones(3)
    sign[axis] = -1.0
    return (corners * sign)[:, ::-1]


def _halves(corners: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Triangles (n, 3, 3) of the part beyond the middle along an axis, and the part before it, mirrored."""
    ends = corners.reshape(-1, 3)
    centred = corners - 0.5 * (ends.min(axis=0) + ends.max(axis=0))
    return _half(centred, axis), _half(_mirror(centred, axis), axis)


def _is_mirrored(points: FloatArray, triangles: IntArray, axis: int) -> bool:
    """Whether triangles are the same on both sides of the middle along an axis."""
    corners = points[triangles] - 0.5 * (points.min(axis=0) + points.max(axis=0))
    return _same_triangles(corners, _mirror(corners, axis))


def _half(corners: FloatArray, axis: int) -> FloatArray:
    """The triangles (n, 3, 3) of what is above 0 along an axis; quadrangles have their shorter diagonal."""
    found: list[FloatArray] = []
    for triangle in np.where(np.abs(corners) < _SEAM, 0.0, corners):
        sides = triangle[:, axis]
        if sides.min() >= 0.0:
            found += [triangle] if sides.max() > 0.0 else []
        elif sides.max() > 0.0:
            outline = _above(triangle, axis)
            if len(outline) == 4 and np.linalg.norm(outline[1] - outline[3]) < np.linalg.norm(outline[0] - outline[2]):
                outline = [*outline[1:], outline[0]]
            found += [np.stack([outline[0], *outline[i : i + 2]]) for i in range(1, len(outline) - 1)]
    return np.array(found).reshape(-1, 3, 3)


def _above(triangle: FloatArray, axis: int) -> list[FloatArray]:
    """The outline of the part of a triangle (3, 3) that is above 0 along an axis."""
    outline: list[FloatArray] = []
    for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        if a[axis] >= 0.0:
            outline.append(a)
        if a[axis] * b[axis] < 0.0:
            crossing = a + a[axis] / (a[axis] - b[axis]) * (b - a)
            crossing[axis] = 0.0
            outline.append(crossing)
    return outline


def _same_triangles(one: FloatArray, other: FloatArray) -> bool:
    """Whether two lists of triangles are the same but for their order and that of their corners."""
    found = []
    for corners in (one, other):
        grid = np.round(corners / (10.0 * _SEAM)).astype(np.int64)
        found.append(sorted(sorted(triangle) for triangle in grid.tolist()))
    return found[0] == found[1]


def _same_surface(one: FloatArray, other: FloatArray) -> bool:
    """Whether two surfaces have the same area, normals and moments up to the second order, however they are divided."""
    if not len(one) or not len(other):
        return False
    size = float(np.abs(one).max())
    first, second = _moments(one / size), _moments(other / size)
    return bool(np.abs(first - second).max() < _MOMENT_TOLERANCE * first[0])


def _moments(corners: FloatArray) -> FloatArray:
    """Integrals (13,) over triangles of 1, the place, its products and the normal."""
    across = 0.5 * normals_of(corners)
    area = np.linalg.norm(across, axis=1)
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))  # at which a sum of second order is exact
    square = np.einsum("n,nij,nik->jk", area, middles, middles) / 3.0
    place = area @ middles.mean(axis=1)
    return np.array([area.sum(), *place, *square[np.triu_indices(3)], *across.sum(axis=0)])


def _divide(points: FloatArray, triangles: IntArray, longest: float, *, even: bool) -> tuple[FloatArray, IntArray]:
    """Points and triangles of which no longest edge is longer than that; `even`: equal edges are halved alike."""
    while True:
        edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
        names, places = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        lengths = np.linalg.norm(points[names[:, 0]] - points[names[:, 1]], axis=1)
        own = places.reshape(-1, 3)
        long = np.zeros(len(names), dtype=np.bool_)
        _mark(long, own, lengths[own], longest, even=even)
        if not long.any():
            return points, triangles
        middles = np.full(len(names), -1, dtype=np.int64)
        middles[long] = len(points) + np.arange(int(long.sum()))
        points = np.concatenate([points, 0.5 * (points[names[long, 0]] + points[names[long, 1]])])
        halves = middles[own].tolist()
        divided = [
            part for row, own in zip(triangles.tolist(), halves, strict=True) for part in _parts(row, own, points)
        ]
        triangles = np.array(divided, dtype=np.int64)


def _mark(long: BoolArray, edges: IntArray, lengths: FloatArray, longest: float, *, even: bool) -> None:
    """Mark the edges that are halved, of triangles (m, 3) with edges of lengths (m, 3).

    `even`: of a triangle whose longest edges are equal all these are, and of one of which two equal edges are halved
    the third is, too: it is the same on both sides, and so are its parts.
    """
    most = lengths.max(axis=1, keepdims=True)
    if not even:
        worst = edges[np.arange(len(edges)), lengths.argmax(axis=1)]
        long[worst[most[:, 0] > longest * (1.0 + _SEAM)]] = True
        return
    long[edges[(lengths > most * (1.0 - _EDGE_TOLERANCE)) & (most > longest * (1.0 + _SEAM))]] = True
    while True:
        cut = long[edges]
        least, greatest = np.where(cut, lengths, np.inf).min(axis=1), np.where(cut, lengths, 0.0).max(axis=1)
        both = (cut.sum(axis=1) == 2) & (least > greatest * (1.0 - _EDGE_TOLERANCE))
        if not both.any():
            return
        long[edges[both]] = True


def _parts(corners: list[int], middles: list[int], points: FloatArray) -> list[tuple[int, int, int]]:
    """The parts of a triangle some edges of which have middles, those from each corner to the next; -1: none."""
    count = sum(middle >= 0 for middle in middles)
    if count == 0:
        a, b, c = corners
        return [(a, b, c)]
    turn = next(i for i in range(3) if middles[i] >= 0 and (count != 2 or middles[i - 1] < 0))
    a, b, c = (corners[(turn + i) % 3] for i in range(3))
    ab, bc, ca = (middles[(turn + i) % 3] for i in range(3))
    if count == 1:
        return [(a, ab, c), (ab, b, c)]
    if count == 3:
        return [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    if np.linalg.norm(points[a] - points[bc]) < np.linalg.norm(points[ab] - points[c]):
        return [(ab, b, bc), (a, ab, bc), (a, bc, c)]
    return [(ab, b, bc), (a, ab, c), (ab, bc, c)]
