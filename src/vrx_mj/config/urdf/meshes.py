"""Mesh files of any common format as points, triangles and a colour; what is too large or degenerate is refused."""

import io
import logging
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.reading import ReadingError, read_limited
from vrx_mj.config.urdf.collada_sizes import sized_dae
from vrx_mj.config.urdf.gltf_sizes import sized_glb
from vrx_mj.config.urdf.mesh_sizes import check_counts, refuse, sized_obj, sized_ply, sized_stl
from vrx_mj.errors import VrxError, shortened

__all__ = ["MeshData", "check_mesh", "mesh_bytes", "obj_text", "read_mesh"]

MAX_BYTES = 50_000_000
"""Largest mesh file that is read."""
LARGEST = 1e5
"""Farthest point [m] that makes sense in a mesh."""
FLAT = 1e-6
"""Thickness, as a share of the largest extent, below which a mesh is a plane or a line."""

SIZED: Mapping[str, Callable[[str, bytes], bytes]] = {
    ".obj": sized_obj, ".stl": sized_stl, ".dae": sized_dae, ".ply": sized_ply, ".glb": sized_glb,
}  # fmt: skip
"""By suffix, what looks at the sizes of a file and gives what the library is to read. No other file reaches it."""

_UNIT = re.compile(rb"<unit\b[^>]{0,300}?\bmeter\s{0,9}=\s{0,9}[\"']\s{0,9}([0-9.eE+-]{1,99})\s{0,9}[\"']")

Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class MeshData:
    """A mesh in its own frame [m]."""

    points: FloatArray
    """(n, 3)"""
    triangles: IntArray
    """(m, 3), rows of `points`, counter-clockwise seen from outside"""
    color: Color | None
    """The colour of most of its area, if the file has colours."""

    @property
    def flat(self) -> bool:
        """Whether all points lie in a plane, so that nothing can collide with it."""
        centred = self.points - self.points.mean(axis=0)
        extents = np.linalg.svd(centred, compute_uv=False)
        return bool(extents[-1] <= FLAT * extents[0])


def read_mesh(path: Path, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> MeshData:
    """The mesh of a file, scaled along its axes.

    Collada's unit is honoured; its up axis is not, as in Gazebo, which draws such meshes with their own axes.
    """
    stat = _stat(path)
    mesh = _read(path.absolute(), stat.st_mtime_ns, stat.st_size)
    if tuple(scale) == (1.0, 1.0, 1.0):
        return mesh
    mirrored = np.prod(scale) < 0
    return MeshData(
        mesh.points * np.asarray(scale), mesh.triangles[:, ::-1] if mirrored else mesh.triangles, mesh.color
    )


def check_mesh(path: Path, scale: Sequence[float] = (1.0, 1.0, 1.0), *, collides: bool = False) -> MeshData:
    """The mesh of a file, which must have a volume if it is to collide."""
    mesh = read_mesh(path, scale)
    if collides and mesh.flat:
        raise VrxError(f"mesh {path.name} is flat: all its {len(mesh.points)} points lie in one plane, so nothing "
                       "can touch it; give it a thickness, or use a box")  # fmt: skip
    return mesh


def obj_text(mesh: MeshData) -> str:
    """The mesh as Wavefront OBJ, with single-precision digits."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.points.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (mesh.triangles + 1).tolist()]
    return "\n".join(lines) + "\n"


def mesh_bytes(path: Path) -> bytes:
    """The content of a mesh file as it is. The same errors as of `read_mesh`, but it is not looked into."""
    _stat(path)
    try:
        return read_limited(path, MAX_BYTES)
    except ReadingError as error:
        raise VrxError(f"mesh {shortened(path.name)} {error}") from None


def _stat(path: Path) -> os.stat_result:
    """Of a mesh file that is small enough."""
    try:
        stat = path.stat()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "its name is not valid"
        raise VrxError(f"mesh {shortened(path.name)} cannot be read: {reason}") from None
    if stat.st_size > MAX_BYTES:
        size = f"{stat.st_size / 1e6:.1f} MB"
        raise VrxError(f"mesh {shortened(path.name)} has {size}; at most {MAX_BYTES / 1e6:g} MB are read")
    return stat


@lru_cache(maxsize=64)
def _read(path: Path, _changed: int, _size: int) -> MeshData:
    name, suffix = shortened(path.name), path.suffix.lower()
    if suffix not in SIZED:
        raise VrxError(f"expected a mesh that ends in {', '.join(SIZED)}, got '{name}'")
    content = mesh_bytes(path)
    sized = SIZED[suffix](name, content)
    unit = _unit(name, sized) if suffix == ".dae" else 1.0
    parts = _parts(name, sized, suffix.removeprefix("."))
    if not parts:
        refuse(name, "is empty: it has no triangles")
    check_counts(name, triangles=sum(len(part.faces) for part in parts))
    if any(part.faces.min() < 0 or part.faces.max() >= len(part.points) for part in parts):
        refuse(name, "is broken: a triangle refers to a point that the file does not have")
    return _checked(name, _merged(parts, unit))


class _Part(NamedTuple):
    """A mesh of a file, at one of its places."""

    points: FloatArray
    """(n, 3), in its own frame"""
    faces: IntArray
    """(m, 3), rows of `points`"""
    matrix: FloatArray
    """(4, 4), puts it there"""
    color: Color | None


def _parts(name: str, content: bytes, suffix: str) -> list[_Part]:
    """Every mesh of the file that has triangles, once for each place; nothing else is opened, whatever it refers to."""
    trimesh = _quiet_trimesh()
    given = {"process": False, "resolver": None, "skip_materials": suffix == "obj"}
    try:
        with np.errstate(all="ignore"):
            scene = trimesh.load_scene(io.BytesIO(content), file_type=suffix, **given)
            placed = [(scene.geometry[key], matrix) for matrix, key in map(scene.graph.get, scene.graph.nodes_geometry)]
            return [_part(geometry, matrix) for geometry, matrix in placed if len(getattr(geometry, "faces", ()))]
    except Exception:  # whatever a broken file makes a reader raise
        raise VrxError(f"mesh {name} cannot be read: it is not a {suffix.upper()} file, or is damaged") from None


@cache
def _quiet_trimesh() -> Any:
    """The library, which would write tracebacks to the terminal about what it can do without."""
    import trimesh

    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    return trimesh


def _part(geometry: Any, matrix: Any) -> _Part:
    points, faces = np.asarray(geometry.vertices, dtype=float), np.asarray(geometry.faces, dtype=np.int64)
    return _Part(points.reshape(-1, 3), faces.reshape(-1, 3), np.asarray(matrix, dtype=float), _color(geometry))


def _merged(parts: Sequence[_Part], unit: float) -> MeshData:
    points, triangles, areas = [], [], dict[Color, float]()
    start = 0
    with np.errstate(all="ignore"):
        for part in parts:
            placed = part.points @ part.matrix[:3, :3].T + part.matrix[:3, 3]
            faces = part.faces[:, ::-1] if np.linalg.det(part.matrix[:3, :3]) < 0 else part.faces
            points.append(placed * unit)
            triangles.append(faces + start)
            start += len(placed)
            if part.color is not None:
                corners = placed[faces]
                across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                areas[part.color] = areas.get(part.color, 0.0) + float(np.linalg.norm(across, axis=1).sum())
    most = max(areas, key=lambda color: areas[color]) if areas else None
    return MeshData(np.concatenate(points), np.concatenate(triangles), most)


def _color(geometry: Any) -> Color | None:
    """The colour of a part: of its material, or the mean of its faces or points; None if it has none."""
    visual = geometry.visual
    if not getattr(visual, "defined", False):
        return None
    found = visual.material.main_color if visual.kind == "texture" else visual.main_color
    red, green, blue, alpha = (float(value) / 255 for value in np.asarray(found).ravel()[:4])
    return (red, green, blue, alpha or 1.0)


def _checked(name: str, mesh: MeshData) -> MeshData:
    """The mesh without points that no triangle uses, if it is one that MuJoCo can take."""
    used, places = np.unique(mesh.triangles, return_inverse=True)
    points = mesh.points[used]
    if not np.isfinite(points).all():
        raise VrxError(f"mesh {name} is broken: the coordinates of a point are not finite")
    largest = float(np.abs(points).max())
    if largest > LARGEST:
        raise VrxError(f"mesh {name} reaches {largest:.3g} m from its origin; at most {LARGEST:g} m: check its unit")
    distinct = len(np.unique(points, axis=0))
    if distinct < 4:
        raise VrxError(f"mesh {name} has {distinct} different points; a shape needs at least 4")
    return MeshData(points, places.reshape(-1, 3).astype(np.int64), mesh.color)


def _unit(name: str, content: bytes) -> float:
    """Metres per unit of a Collada file."""
    found = _UNIT.search(content)
    try:
        unit = float(found[1]) if found else 1.0
    except ValueError:
        unit = 0.0
    if not 0 < unit < 1e6:
        raise VrxError(f"mesh {name}: expected a number of metres above 0 as its unit, got '{_shown(found)}'")
    return unit


def _shown(found: re.Match[bytes] | None) -> str:
    return found[1].decode("ascii", "replace")[:60] if found else ""
