"""The shore: rings of points become a low bank that rises from the water, to hit and to see.

The bank has one profile everywhere, a height over the distance inland of the waterline. What is hit are
convex blocks, one for each edge of the shore, mitred so that neighbours share a face; what is seen is a mesh
of the same profile.
"""

import functools
import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.search import ReadingError, find_terrain, read_limited
from vrx_mj.config.shapes import normals_of
from vrx_mj.config.values import MAX_COORDINATE
from vrx_mj.config.yaml_text import MAX_BYTES
from vrx_mj.errors import ConfigError, shorten
from vrx_mj.mjcf.pieces import Piece
from vrx_mj.model.things import Ring

_SAND_TOP = 0.4
"""Height over the water where grass begins [m]."""
_SAND_COLOR = (0.72, 0.65, 0.48, 1.0)
"""Colour of the sand."""
_GRASS_COLOR = (0.30, 0.42, 0.24, 1.0)
"""Colour of the grass."""
_Rings = list[FloatArray]
"""A polygon of land: its exterior and its holes, rings of points (n, 2) [m]."""
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""One triangle of a binary STL file."""
_MAX_POINTS = 5000
"""Largest number of points of a shoreline: each edge is compared with every other."""
_SHORTEST_EDGE = 1e-6
"""Points that are nearer to the next one [m] are left out."""
_SLOPE = 0.25
"""Rise of the bank over the distance inland: VRX's posts, tents and antenna fit such a slope within 0.3 m."""
_WIDTH = 6.0
"""Distance inland over which the bank rises [m]; it is flat beyond, 1.5 m over the water."""
_FOOT = (-1.0, -0.6)
"""Distance inland and height of the foot of the bank [m], under water."""
_BLOCK_BOTTOM = -1.6
"""Height of the blocks' underside [m]."""
_MITRE_LIMIT = 3.0
"""A corner lies at most this many times the offset away from its vertex, so that sharp ones stay short."""
_MIN_CREST = 0.6
"""Least height of a block's crest [m]: on narrow land the bank is steeper, so that no boat slips over it."""
_DEPTH_STEP = 0.75
"""Step in which a block's width is fitted to a narrow piece of land [m]."""


def area_of(rings: Sequence[Sequence[Sequence[float]] | FloatArray]) -> object:
    """The land as a shapely polygon, from the rings of its shore (n, 2) [m]; a ring inside another is a lake."""
    import shapely

    land = shapely.Polygon()
    for ring in rings:
        land = shapely.symmetric_difference(land, shapely.Polygon(ring))
    return land


def _land_meshes(polygons: Iterable[_Rings], profile: Sequence[tuple[float, float]]) -> Iterator[dict[str, Any]]:
    """Meshes of sand and grass for polygons of land under one bank profile: name, file, content and colour of each.

    The profile is distance inland of the waterline and height [m], rising; the last height goes on inland.
    """
    import shapely

    land = shapely.union_all([shapely.Polygon(exterior, holes) for exterior, *holes in polygons])
    levels = [shapely.buffer(land, -inland, join_style="mitre", mitre_limit=3.0) for inland, _ in profile]
    heights = [height for _, height in profile]
    sand: list[FloatArray] = []
    grass: list[FloatArray] = [_triangles(levels[-1], levels[-1], heights[-1], heights[-1])]
    for (outer, inner), (low, high) in zip(pairwise(levels), pairwise(heights), strict=True):
        band = _triangles(shapely.difference(outer, inner), inner, low, high)
        (sand if high <= _SAND_TOP else grass).append(band)
    for name, bands, color in (("sand", sand, _SAND_COLOR), ("grass", grass, _GRASS_COLOR)):
        content = _stl(np.concatenate(bands).round(3))
        file = f"land_{name}_{hashlib.sha256(content).hexdigest()[:12]}.stl"
        yield {"name": name, "file": file, "content": content, "color": color}


def _triangles(area: object, inner: object, low: float, high: float) -> FloatArray:
    """Upward triangles of an area, (n, 3, 3) [m]: `high` on the boundary of `inner`, `low` elsewhere."""
    import shapely

    pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(area))
    if len(pieces) == 0:
        return np.empty((0, 3, 3))
    rings = shapely.get_coordinates(shapely.orient_polygons(pieces)).reshape(-1, 4, 2)
    corners = rings[:, :3].reshape(-1, 2)
    on_inner = shapely.distance(shapely.points(corners), shapely.boundary(inner)) < 1e-6
    height = np.where(on_inner, high, low)
    return np.asarray(np.column_stack([corners, height]).reshape(-1, 3, 3))


def _stl(triangles: FloatArray) -> bytes:
    """Triangles as binary STL, in a fixed order, without a date."""
    order = np.lexsort(triangles.reshape(len(triangles), 9).T)
    corners = triangles[order]
    normal = normals_of(corners)
    length = np.sqrt(np.sum(normal * normal, axis=1))
    keep = length > 1e-6  # slivers of no area upset MuJoCo
    facet = np.zeros(int(keep.sum()), dtype=_FACET)
    facet["normal"] = normal[keep] / length[keep, None]
    facet["corners"] = corners[keep]
    return b"vrx_mj land".ljust(80) + np.array(len(facet), "<u4").tobytes() + facet.tobytes()


def terrain_piece(name: str, near: Path | None = None) -> Piece:
    """A terrain: static geoms of the world body, no moving body.

    Collision geoms are in group 3, visual ones in group 2. `near` is the folder of the file that names the
    terrain.

    Raises:
        UnknownNameError: no terrain has that name.
        ConfigError: its file does not hold rings of points.
    """
    path = _find(name, near)
    return _build(path, _version(path))


@functools.lru_cache(maxsize=4)
def _build(path: Path, _version: tuple[int, int]) -> Piece:
    import shapely

    polygons = _read_polygons(path)
    try:
        meshes = list(_land_meshes(polygons, [_FOOT, *((d, _SLOPE * d) for d in (0.0, 1.5, 3.0, 4.5, _WIDTH))]))
    except (shapely.errors.GEOSException, ValueError) as error:
        raise _invalid(path, f"its rings bound no land: {error}") from error
    blocks = bank_blocks(_rings(polygons)).round(2)
    files = {mesh["file"]: mesh["content"] for mesh in meshes}
    return Piece.from_template("terrain.xml.j2", files, blocks=blocks.tolist(), meshes=meshes)


def shoreline(name: str, near: Path | None = None) -> tuple[Ring, ...]:
    """The waterline as rings of points (x, y) (m, world frame, not closed), the land always on the left.

    A ring that runs counter-clockwise bounds an island, a clockwise one a lake.
    """
    path = _find(name, near)
    return _shore(path, _version(path))


@functools.lru_cache(maxsize=4)
def _shore(path: Path, _version: tuple[int, int]) -> tuple[Ring, ...]:
    return tuple(tuple((x, y) for x, y in ring.tolist()) for ring in _rings(_read_polygons(path)))


def on_land(name: str, x: float, y: float, near: Path | None = None) -> bool:
    """Whether the point is on the dry side of the waterline."""
    import shapely

    return bool(shapely.contains_xy(land_area(name, near), x, y))


def land_distance(name: str, x: float, y: float, near: Path | None = None) -> float:
    """Distance [m] of a point from the land; 0 on it."""
    import shapely

    return float(shapely.distance(land_area(name, near), shapely.Point(x, y)))


def land_area(name: str, near: Path | None = None) -> object:
    """The land as a prepared polygon of shapely [m]."""
    path = _find(name, near)
    return _prepared_area(path, _version(path))


@functools.lru_cache(maxsize=4)
def _prepared_area(path: Path, _version: tuple[int, int]) -> object:
    import shapely

    area = area_of(_rings(_read_polygons(path)))
    shapely.prepare(area)
    return area


def bank_blocks(rings: list[FloatArray]) -> FloatArray:
    """The corners of one convex block for each edge of the shore, (edges, 10, 3) [m].

    Across the shore a block is the polygon toe, waterline, crest, underside. A block reaches inland as far as
    the land is nearer to its own edge than to any other, at most `_WIDTH`: blocks from both sides of a spit
    meet in a ridge.
    """
    start = np.concatenate(rings)
    end = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    inland = _moves(rings, inland=True)
    seaward = _moves(rings, inland=False)
    depth = _depths(start, end, *inland)
    crest = np.maximum(_SLOPE * depth, _MIN_CREST)
    level = np.ones_like(depth)
    lines = [
        (seaward, _FOOT[0] * level, _BLOCK_BOTTOM * level),
        (seaward, _FOOT[0] * level, _FOOT[1] * level),
        (inland, 0.0 * level, 0.0 * level),
        (inland, depth, crest),
        (inland, depth, _BLOCK_BOTTOM * level),
    ]
    corners = [
        np.column_stack([vertex + move * distance[:, None], height])
        for moves, distance, height in lines
        for vertex, move in zip((start, end), moves, strict=True)
    ]
    return np.stack(corners, axis=1)


def _moves(rings: list[FloatArray], *, inland: bool) -> tuple[FloatArray, FloatArray]:
    """Vectors by which both ends of each edge move when the edges move 1 m inland, twice (n, 2).

    Where the offsets towards that side spread, inland of a bay and seaward of a cape, the vector is short.
    """
    mitres = [_mitres(ring, inland=inland) for ring in rings]
    return np.concatenate(mitres), np.concatenate([np.roll(mitre, -1, axis=0) for mitre in mitres])


def _mitres(ring: FloatArray, *, inland: bool) -> FloatArray:
    along = np.roll(ring, -1, axis=0) - ring
    along /= np.hypot(*along.T)[:, None]
    after = np.column_stack([-along[:, 1], along[:, 0]])
    before = np.roll(after, 1, axis=0)
    mitre = (before + after) / np.maximum(1.0 + np.sum(before * after, axis=1), 1e-3)[:, None]
    cape = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] > 0.0
    length = np.hypot(*mitre.T)
    short = np.where(cape == inland, 1.0, np.maximum(1.0, length / _MITRE_LIMIT))
    return np.asarray(mitre / short[:, None])


def _depths(start: FloatArray, end: FloatArray, here: FloatArray, there: FloatArray) -> FloatArray:
    """Distances inland that blocks may reach before another edge of the shore is nearer, (n,) [m]."""
    share = np.linspace(0.0, 1.0, 5)[None, :, None]
    along = end - start
    length = np.hypot(*along.T)
    shrink = -np.sum((there - here) * along, axis=1) / length  # of the crest, per metre inland
    vanish = np.where(shrink > 0.0, length / np.where(shrink > 0.0, shrink, 1.0), np.inf)
    depth = np.zeros(len(start))
    growing = np.ones(len(start), dtype=bool)
    for reach in np.arange(_DEPTH_STEP, _WIDTH + 1e-9, _DEPTH_STEP):
        crest_a, crest_b = start + reach * here, end + reach * there
        points = crest_a[:, None, :] * (1.0 - share) + crest_b[:, None, :] * share
        growing &= vanish > reach
        growing[growing] = _clearance(points[growing], start, along) >= 0.9 * reach
        depth[growing] = reach
    return np.maximum(depth, 0.3)


def _clearance(points: FloatArray, start: FloatArray, along: FloatArray) -> FloatArray:
    """The least distance of each row of points (n, k, 2) to any of the segments, (n,) [m]."""
    (x, y), (dx, dy) = start.T.copy(), along.T.copy()
    square = dx * dx + dy * dy
    nearest = np.empty(len(points))
    for row, group in enumerate(points):
        east, north = group[:, :1] - x, group[:, 1:] - y
        share = np.clip((east * dx + north * dy) / square, 0.0, 1.0)
        nearest[row] = np.sqrt(np.min((east - share * dx) ** 2 + (north - share * dy) ** 2))
    return nearest


def _rings(polygons: Iterable[_Rings]) -> list[FloatArray]:
    """All rings of the land, each with the land on its left."""
    import shapely

    rings = []
    for polygon in polygons:
        for index, ring in enumerate(polygon):
            is_counterclockwise = bool(shapely.is_ccw(shapely.linearrings(ring)))
            rings.append(ring if is_counterclockwise is (index == 0) else ring[::-1])
    return rings


def _find(name: str, near: Path | None) -> Path:
    """The terrain's file: in the folder `terrain` beside the file that names it, or along the search path."""
    beside = near / "terrain" / f"{name}.json" if near and Path(name).name == name else None
    return beside if beside and beside.is_file() else find_terrain(name)


def _version(path: Path) -> tuple[int, int]:
    """Time of the last change [ns] and size of a file: what was made of it is kept until these change."""
    status = path.stat()
    return status.st_mtime_ns, status.st_size


def _read_polygons(path: Path) -> list[_Rings]:
    """The polygons of land in a file."""
    import shapely

    try:
        land = json.loads(read_limited(path, MAX_BYTES).decode("utf-8-sig"))["land"]
        polygons = [[_ring(ring) for ring in (item["exterior"], *item.get("holes", []))] for item in land]
    except ReadingError as error:
        raise ConfigError.of(str(path), str(error)) from None
    except RecursionError:
        raise _invalid(path, "nested too deeply") from None
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise _invalid(path, str(error)) from error
    points = sum(len(ring) for polygon in polygons for ring in polygon)
    if not 0 < points <= _MAX_POINTS:
        raise _invalid(path, f"{points} points; 3 to {_MAX_POINTS} are allowed")
    for index, (exterior, *holes) in enumerate(polygons):
        polygon = shapely.Polygon(exterior, holes)
        if not polygon.is_valid:  # a ring crosses or touches itself or another
            raise _invalid(path, f"land[{index}] is not a polygon: {shapely.is_valid_reason(polygon)}")
    return polygons


def _invalid(path: Path, reason: str) -> ConfigError:
    wanted = "expected {land: [{exterior: [[x, y], ...], holes: [...]}]}"
    message = f"invalid shoreline: {shorten(reason, 200)}; {wanted}"
    return ConfigError.of(str(path), message, key="land")


def _ring(points: object) -> FloatArray:
    ring = np.asarray(points, dtype=np.float64)
    if ring.ndim != 2 or ring.shape[1] != 2 or not np.isfinite(ring).all():
        raise ValueError("a ring must be a list of points [x, y] in m")
    if np.abs(ring).max() > MAX_COORDINATE:
        raise ValueError(f"a coordinate of {np.abs(ring).max():g} m; at most {MAX_COORDINATE:g} m is allowed")
    keep = np.abs(ring - np.roll(ring, -1, axis=0)).max(axis=1) > _SHORTEST_EDGE  # in its file a ring may be closed
    if np.count_nonzero(keep) < 3:
        raise ValueError("a ring must have at least three points")
    return np.asarray(ring[keep])
