"""Mesh files of a URDF: where they are, and what is read from them."""

import io
import logging
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, NamedTuple
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr, unescape

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.search import (
    ReadingError,
    display,
    enclosing_packages,
    package_above,
    package_name,
    read_limited,
    workspace_packages,
)
from vrx_mj.config.wording import shown
from vrx_mj.errors import VrxError, shortened
from vrx_mj.formats.urdf.mesh_sizes import check_counts, refuse, sized_dae, sized_glb, sized_obj, sized_ply, sized_stl

_PACKAGE = re.compile(r"(package|model)://([^/]*)/(.*)", re.DOTALL)
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_MESH = re.compile(r"""(<mesh\s[^<>]*?\bfilename\s*=\s*)("[^"<]*"|'[^'<]*')""")
SHOWN_BASES = 12
"""Folders that a message lists."""
_QUOTES = {"&quot;": '"', "&apos;": "'"}


class MissingMeshError(VrxError):
    """A mesh file that is not there, or where nothing may be read."""


@dataclass(frozen=True)
class MeshFiles:
    """The folders in which meshes may lie."""

    folder: Path
    """Folder of the URDF."""
    packages: Mapping[str, Path] = field(default_factory=dict)
    """Folders of ROS packages, by name."""
    package_paths: Sequence[Path] = ()
    """Folders that are packages, or hold them."""

    @cached_property
    def _around(self) -> dict[str, Path]:
        """The package that the URDF lies in."""
        return enclosing_packages(self.folder.absolute())

    def find(self, name: str) -> tuple[Path, str]:
        """The folder and the path inside it of a mesh, from a `filename`."""
        text = unquote(name)
        if "\\" in text or "\0" in text or PureWindowsPath(text).drive:
            raise VrxError(f"expected a path with '/' in it, got {shown(name)}")
        outside, bases = False, self._bases(text)
        for file in self._candidates(text):
            base = next((base for base in bases if _contains(base, file)), None)
            if base is not None and _is_file(file):
                return base, _inside(file, base)
            outside = outside or base is None
        if outside:
            raise MissingMeshError(f"{shown(name)} is outside the folders that may be read: {self._shown_bases()}")
        raise MissingMeshError(f"no file {shown(name)}; {self._advice(text)}")

    def _candidates(self, text: str) -> Iterator[Path]:
        package, scheme = _PACKAGE.fullmatch(text), _SCHEME.match(text)
        if package:
            for folder in self._package(package[2]):
                yield folder / package[3].lstrip("/")
        elif scheme and scheme[1] != "file":
            raise VrxError(f"no downloads: expected a path, package://, model:// or file://, got {shown(text)}")
        else:
            path = text.removeprefix("file://")
            for base in [self.folder] if PurePosixPath(path).is_absolute() else [self.folder, *self.package_paths]:
                yield base / path

    def _package(self, name: str) -> Iterator[Path]:
        """The folders that may be the package of this name."""
        if name in self._around:
            yield self._around[name]
        if name in self.packages:
            yield self.packages[name]
        if name in {"", ".", ".."}:
            return
        above = package_above(self.folder.absolute(), name)
        if above is not None:
            yield above
        for path in (*self.package_paths, self.folder):
            yield path / name
            if path.resolve().name == name or package_name(path) == name:
                yield path
        yield from self._in_workspace(name)

    def _in_workspace(self, name: str) -> list[Path]:
        """The package of a name in the workspace of the URDF, if it has one."""
        found = workspace_packages(self.folder.absolute()).get(name)
        return [found] if found else []

    def _bases(self, text: str = "") -> list[Path]:
        """The folders that may be read for a `filename`."""
        package = _PACKAGE.fullmatch(text)
        above = package_above(self.folder.absolute(), package[2]) if package else None
        return [
            *([above] if above else []),
            self.folder,
            *self.packages.values(),
            *self._around.values(),
            *self.package_paths,
            *(self._in_workspace(package[2]) if package else ()),
        ]

    def _advice(self, text: str) -> str:
        package = _PACKAGE.fullmatch(text)
        if package and not any(folder.is_dir() for folder in self._package(package[2])):
            return f"no package named {shown(package[2])}: give the folder that contains it as package path"
        return f"looked in {self._shown_bases()}"

    def _shown_bases(self) -> str:
        names = list(dict.fromkeys(display(base) for base in self._bases()))
        more = f" and {len(names) - SHOWN_BASES} more" if len(names) > SHOWN_BASES else ""
        return ", ".join(names[:SHOWN_BASES]) + more


def with_file_uris(text: str, files: MeshFiles) -> str:
    """A URDF's text with the place of each mesh that is found, as `file:///...`; the others stay as they are."""
    return with_mesh_names(text, files, lambda folder, name: (folder / name).resolve().as_uri())


def with_mesh_names(text: str, files: MeshFiles, named: Callable[[Path, str], str | None]) -> str:
    """A URDF's text in which each mesh that is found is called as `named` says, by its folder and path in that.

    Those for which it gives None, and those that are not found, stay as they are.
    """

    def renamed(found: re.Match[str]) -> str:
        try:
            name = named(*files.find(unescape(found[2][1:-1], _QUOTES)))
        except VrxError:
            name = None
        return found[0] if name is None else found[1] + quoteattr(name)

    return _MESH.sub(renamed, text)


def _contains(base: Path, file: Path) -> bool:
    try:
        return file.resolve().is_relative_to(base.resolve())
    except (OSError, ValueError, RuntimeError):
        return False


def _is_file(file: Path) -> bool:
    try:
        return file.is_file()
    except (OSError, ValueError):
        return False


def _inside(file: Path, base: Path) -> str:
    """The path as it was written where that is possible, else with its links followed."""
    try:
        relative = file.relative_to(base)
    except ValueError:
        relative = None
    if relative is None or ".." in relative.parts:
        relative = file.resolve().relative_to(base.resolve())
    return relative.as_posix()


MAX_BYTES = 50_000_000
"""Largest mesh file that is read."""
LARGEST = 1e5
"""Farthest point [m] that makes sense in a mesh."""
FLAT = 1e-6
"""Thickness, as a share of the largest extent, below which a mesh is a plane or a line."""

SIZED: Mapping[str, Callable[[str, bytes], bytes]] = {
    ".obj": sized_obj, ".stl": sized_stl, ".dae": sized_dae, ".ply": sized_ply, ".glb": sized_glb,
}  # fmt: skip
"""Checks of the sizes of a file, by suffix; each gives the content that the library reads. No other file reaches it."""

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
