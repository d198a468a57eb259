"""The land to look at: bands along the shore, sand below and grass above, as meshes of ours."""

import hashlib
import io
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vrx_mj.arrays import FloatArray

__all__ = ["LandMesh", "area_of", "land_meshes"]


SAND_TOP = 0.4
"""Where grass begins [m over the water]."""
SAND_COLOR = (0.72, 0.65, 0.48, 1.0)
GRASS_COLOR = (0.30, 0.42, 0.24, 1.0)
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""One triangle of a binary STL file."""


@dataclass(frozen=True)
class LandMesh:
    """One coloured mesh; its file name hashes its contents, a binary STL."""

    name: str
    file: str
    data: bytes
    color: tuple[float, float, float, float]


def area_of(rings: Sequence[Sequence[Sequence[float]] | FloatArray]) -> object:
    """The land as a shapely polygon, from the rings of its shore (n, 2) [m]; a ring inside another is a lake."""
    import shapely

    land = shapely.Polygon()
    for ring in rings:
        land = shapely.symmetric_difference(land, shapely.Polygon(ring))
    return land


def land_meshes(polygons: list[dict[str, object]], profile: Sequence[tuple[float, float]]) -> list[LandMesh]:
    """Meshes of sand and grass for polygons of land under one bank profile.

    Args:
        polygons: mappings with the ring `exterior` and the rings `holes`, each (n, 2) [m].
        profile: distance inland of the waterline and height [m], rising; the last height goes on inland.
    """
    import shapely

    land = shapely.union_all([shapely.Polygon(item["exterior"], item["holes"]) for item in polygons])
    levels = [shapely.buffer(land, -inland, join_style="mitre", mitre_limit=3.0) for inland, _ in profile]
    heights = [height for _, height in profile]
    sand: list[FloatArray] = []
    grass: list[FloatArray] = [_triangles(levels[-1], levels[-1], heights[-1], heights[-1])]
    for (outer, inner), (low, high) in zip(pairwise(levels), pairwise(heights), strict=True):
        band = _triangles(shapely.difference(outer, inner), inner, low, high)
        (sand if high <= SAND_TOP else grass).append(band)
    parts = (("sand", sand, SAND_COLOR), ("grass", grass, GRASS_COLOR))
    return [_mesh(name, np.concatenate(bands), color) for name, bands, color in parts]


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


def _mesh(name: str, triangles: FloatArray, color: tuple[float, float, float, float]) -> LandMesh:
    data = _stl(triangles.round(3))
    return LandMesh(name, f"land_{name}_{hashlib.sha256(data).hexdigest()[:12]}.stl", data, color)


def _stl(triangles: FloatArray) -> bytes:
    """Triangles as binary STL, in a fixed order, without a date."""
    order = np.lexsort(triangles.reshape(len(triangles), 9).T)
    corners = triangles[order]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt(np.sum(normal * normal, axis=1))
    keep = length > 1e-6  # slivers of no area upset MuJoCo
    facet = np.zeros(int(keep.sum()), dtype=FACET)
    facet["normal"] = normal[keep] / length[keep, None]
    facet["corners"] = corners[keep]
    out = io.BytesIO()
    out.write(b"vrx_mj land".ljust(80))
    out.write(np.uint32(len(facet)).astype("<u4").tobytes())
    out.write(facet.tobytes())
    return out.getvalue()
