"""Mesh files of any common format as points, triangles and a colour; what is too large or degenerate is refused."""

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vrx_mj.errors import VrxError

__all__ = ["MeshData", "check_mesh", "obj_text", "read_mesh"]

MAX_BYTES = 50_000_000
"""Largest mesh file that is read."""
MAX_TRIANGLES = 200_000
"""Most triangles of a mesh; MuJoCo's own limit for STL files."""
LARGEST = 1e5
"""Farthest point [m] that makes sense in a mesh."""
FLAT = 1e-6
"""Thickness, as a share of the largest extent, below which a mesh is a plane or a line."""

_UNIT = re.compile(rb"<unit\b[^>]*\bmeter\s*=\s*[\"']\s*([0-9.eE+-]+)\s*[\"']")


@dataclass(frozen=True)
class MeshData:
    """A mesh in its own frame [m]."""

    points: NDArray[np.float64]
    """(n, 3)"""
    triangles: NDArray[np.int64]
    """(m, 3), rows of `points`, counter-clockwise seen from outside"""
    color: tuple[float, float, float, float] | None
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
    try:
        stat = path.stat()
    except OSError as error:
        raise VrxError(f"mesh {path.name} cannot be read: {error.strerror}") from None
    if stat.st_size > MAX_BYTES:
        raise VrxError(f"mesh {path.name} has {stat.st_size / 1e6:.1f} MB; at most {MAX_BYTES / 1e6:g} MB are read")
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


@lru_cache(maxsize=64)
def _read(path: Path, _changed: int, _size: int) -> MeshData:
    content = path.read_bytes()
    suffix = path.suffix.lower().removeprefix(".")
    unit = _unit(path.name, content) if suffix == "dae" else 1.0
    scene = _scene(path.name, content, suffix)
    parts = [(geometry, matrix) for geometry, matrix in _parts(scene) if len(geometry.faces)]
    triangles = sum(len(geometry.faces) for geometry, _ in parts)
    if not parts:
        raise VrxError(f"mesh {path.name} is empty: it has no triangles")
    if triangles > MAX_TRIANGLES:
        raise VrxError(f"mesh {path.name} has {triangles:,} triangles; at most {MAX_TRIANGLES:,} are allowed: "
                       "simplify it, for example with Blender's Decimate")  # fmt: skip
    return _checked(path.name, _merged(parts, unit))


def _scene(name: str, content: bytes, suffix: str) -> Any:
    """The file as a scene of trimesh; nothing else is opened, whatever it refers to."""
    import trimesh

    if suffix == "dae":
        _check_collada(name, content)
    try:
        return trimesh.load_scene(
            io.BytesIO(content), file_type=suffix, process=False, resolver=None, skip_materials=suffix == "obj"
        )
    except Exception:  # whatever a broken file makes a reader raise
        raise VrxError(f"mesh {name} cannot be read: it is not a {suffix.upper()} file, or is damaged") from None


def _parts(scene: Any) -> list[tuple[Any, Any]]:
    """Every mesh of a scene, once for each place, with the matrix that puts it there."""
    found = []
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        if hasattr(scene.geometry[name], "faces"):
            found.append((scene.geometry[name], matrix))
        if len(found) > MAX_TRIANGLES:
            break
    return found


def _merged(parts: list[tuple[Any, Any]], unit: float) -> MeshData:
    points, triangles, areas = [], [], dict[tuple[float, float, float, float], float]()
    start = 0
    with np.errstate(all="ignore"):
        for geometry, matrix in parts:
            placed = np.asarray(geometry.vertices, dtype=float) @ matrix[:3, :3].T + matrix[:3, 3]
            faces = np.asarray(geometry.faces, dtype=np.int64)
            if np.linalg.det(matrix[:3, :3]) < 0:
                faces = faces[:, ::-1]
            points.append(placed * unit)
            triangles.append(faces + start)
            start += len(placed)
            color = _color(geometry)
            if color is not None:
                corners = placed[faces]
                across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                areas[color] = areas.get(color, 0.0) + float(np.linalg.norm(across, axis=1).sum())
    most = max(areas, key=lambda color: areas[color]) if areas else None
    return MeshData(np.concatenate(points), np.concatenate(triangles), most)


def _color(geometry: Any) -> tuple[float, float, float, float] | None:
    """The colour of a part: of its material, or the mean of its faces or points; None if it has none."""
    visual = geometry.visual
    if not getattr(visual, "defined", False):
        return None
    found = visual.material.main_color if visual.kind == "texture" else visual.main_color
    red, green, blue, alpha = (float(value) / 255 for value in np.asarray(found).ravel()[:4])
    return (red, green, blue, alpha or 1.0)


def _checked(name: str, mesh: MeshData) -> MeshData:
    """The mesh without points that no triangle uses, if it is one that MuJoCo can take."""
    if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.points):
        raise VrxError(f"mesh {name} is broken: a triangle refers to a point that the file does not have")
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
    return found[1].decode("ascii", "replace") if found else ""


def _check_collada(name: str, content: bytes) -> None:
    """Collada is XML, in which a short text can stand for a huge one."""
    if re.search(rb"<!(DOCTYPE|ENTITY)", content, re.IGNORECASE):
        raise VrxError(f"mesh {name} has a document type or entities, which are not allowed")
    instances = content.count(b"<instance_node")
    if instances > 20:
        raise VrxError(f"mesh {name} repeats nodes {instances} times; at most 20 are allowed: "
                       "export it as one mesh")  # fmt: skip
