"""Mesh files of a URDF: where they are, and what is read from them."""

import os.path
import re
from collections.abc import Callable, Iterable, Iterator, MutableMapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TypeVar
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr, unescape

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.search import ALLOW, ReadingError, display, is_inside, read_limited
from vrx_mj.config.shapes import MESH_SUFFIXES
from vrx_mj.config.wording import literal, one_of
from vrx_mj.errors import VrxError, first_names, shortened
from vrx_mj.foreign import ask
from vrx_mj.formats.urdf.model import Color
from vrx_mj.formats.urdf.xacro_files import Files

_PACKAGE = re.compile(r"(package|model)://([^/]*)/(.*)", re.DOTALL)
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_MESH = re.compile(r"""(<mesh\s[^<>]*?\bfilename\s*=\s*)("[^"<]*"|'[^'<]*')""")
_SHOWN_BASES = 12
"""Folders that a message lists."""
_QUOTES = {"&quot;": '"', "&apos;": "'"}


class MissingMeshError(VrxError):
    """A mesh file that is not there, or where nothing may be read."""


class MeshFiles(Files):
    """The folders in which meshes of a robot may lie: in those of ROS packages by name, or of folders that hold them.

    What the robot's file lies in comes before these.
    """

    def __init__(
        self, folder: Path, packages: MutableMapping[str, Path] | None = None, package_paths: Iterable[Path] = ()
    ) -> None:
        super().__init__(folder / "robot", {} if packages is None else packages, package_paths)
        self.order = (self.around, self.packages)

    def find(self, name: str) -> tuple[Path, str]:
        """The folder and the path inside it of a mesh, from a `filename`."""
        text = unquote(name)
        if "\\" in text or "\0" in text or PureWindowsPath(text).drive:
            raise VrxError(f"expected a path with '/' in it, got {literal(name)}")
        package, outside = _PACKAGE.fullmatch(text), False
        bases = [*(self.near(package[2]) if package else ()), *self.bases]
        for file in self._candidates(text, package):
            base = next((base for base in bases if is_inside(file, base)), None)
            if base is not None and os.path.isfile(file):  # noqa: PTH113 - Path.is_file raises an OSError for a long name
                return base, _inside(file, base)
            outside = outside or base is None
        if outside:
            where = f"outside the folders that may be read: {self._shown_bases()}"
            raise MissingMeshError(f"{literal(name)} is {where}; {ALLOW}")
        if package and not any(folder.is_dir() for folder in self.package_folders(package[2])):
            where = f"no package named {literal(package[2])}: give the folder that contains it as package path"
        else:
            where = f"looked in {self._shown_bases()}"
        raise MissingMeshError(f"no file {literal(name)}; {where}")

    def _candidates(self, text: str, package: re.Match[str] | None) -> Iterator[Path]:
        scheme = _SCHEME.match(text)
        if package:
            for folder in self.package_folders(package[2]):
                yield folder / package[3].lstrip("/")
        elif scheme and scheme[1] != "file":
            raise VrxError(f"no downloads: expected a path, package://, model:// or file://, got {literal(text)}")
        else:
            path = text.removeprefix("file://")
            for base in [self.folder] if PurePosixPath(path).is_absolute() else [self.folder, *self.paths]:
                yield base / path

    def _shown_bases(self) -> str:
        return first_names(dict.fromkeys(map(display, self.bases)), _SHOWN_BASES)


def with_file_uris(text: str, files: MeshFiles) -> str:
    """A URDF's text with the place of each mesh that is found, as `file:///...`; the others stay as they are."""
    return with_mesh_names(text, files, lambda folder, name: (folder / name).resolve().as_uri())


def with_mesh_names(text: str, files: MeshFiles, named: Callable[[Path, str], str | None]) -> str:
    """A URDF's text in which each mesh that is found is called as `named` says, by its folder and path in that.

    Those for which it gives None, and those that are not found, stay as they are.
    """

    def rename(found: re.Match[str]) -> str:
        try:
            name = named(*files.find(unescape(found[2][1:-1], _QUOTES)))
        except VrxError:
            name = None
        return found[0] if name is None else found[1] + quoteattr(name)

    return _MESH.sub(rename, text)


def _inside(file: Path, base: Path) -> str:
    """The path as it was written where that is possible, else with its links followed."""
    written = file.relative_to(base) if file.is_relative_to(base) else None
    if written is None or ".." in written.parts:
        written = file.resolve().relative_to(base.resolve())
    return written.as_posix()


_MAX_BYTES = 50_000_000
"""Largest mesh file that is read."""
_FLAT = 1e-6
"""Thickness, as a share of the largest extent, below which a mesh is a plane or a line."""

_MEMORY, _MEMORY_PER_BYTE = 256 << 20, 16
"""What reading a mesh may take [bytes]: this, and so much for each byte of its file."""
_SECONDS, _BYTES_PER_SECOND = 4, 2_000_000
"""Processor time of reading a mesh: this [s], and a second for so many bytes."""

_Found = TypeVar("_Found")


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
        return bool(extents[-1] <= _FLAT * extents[0])


def read_mesh(path: Path, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> MeshData:
    """The mesh of a file, scaled along its axes.

    Collada's unit is honoured; its up axis is not, as in Gazebo, which draws such meshes with their own axes.
    """
    mesh = _cached_mesh(path.absolute(), len(mesh_bytes(path)), path.stat().st_mtime_ns)
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
    try:
        return read_limited(path, _MAX_BYTES)
    except ReadingError as error:
        raise VrxError(f"mesh {shortened(path.name)} {error}") from None


@lru_cache(maxsize=64)
def _cached_mesh(path: Path, size: int, _changed: int) -> MeshData:
    return _ask("mesh", path, size, MeshData)


def mesh_glb(path: Path) -> bytes:
    """The mesh of a file as glTF, whose y axis is up. The same errors as of `read_mesh`."""
    return _ask("glb", path, len(mesh_bytes(path)), bytes)


def _ask(what: str, path: Path, size: int, returns: type[_Found]) -> _Found:
    """What the process without rights gives of a mesh file."""
    name = shortened(path.name)
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise VrxError(f"expected a mesh that ends in {one_of(MESH_SUFFIXES)}, got '{name}'")
    return ask(
        f"formats.urdf.mesh_file:{what}", path.absolute(), name, returns=returns, about=f"mesh {name}", reads=[path],
        memory=_MEMORY + size * _MEMORY_PER_BYTE, seconds=_SECONDS + size // _BYTES_PER_SECOND,
    )  # fmt: skip


def is_binary_stl(content: bytes) -> bool:
    """Whether an STL file is a binary one, and whole: the other kind is text."""
    head = 84
    return len(content) >= head and len(content) == head + 50 * int.from_bytes(content[head - 4 : head], "little")
