"""URDF text as a `Urdf`, with its meshes; all faults and all suspicious values are reported at once.

VRX's meshes, which are not ours to ship, have stand-ins.
"""

import json
import os.path
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, TypeVar
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr, unescape

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.search import ALLOW, ReadingError, display, is_inside, read_limited
from vrx_mj.config.shapes import MESH_SUFFIXES, Shape, Visual
from vrx_mj.config.tree import literal, one_of
from vrx_mj.errors import VrxError, first_names, shorten, warn
from vrx_mj.foreign import ask
from vrx_mj.formats.urdf.elements import Findings
from vrx_mj.formats.urdf.expand import ExpandedText, Files
from vrx_mj.formats.urdf.links import ShapeT
from vrx_mj.formats.urdf.model import Color, Link, LinkRow, MeshRow, Urdf, chain
from vrx_mj.formats.urdf.xml_document import WORDING
from vrx_mj.frames import Pose, Vector, inverse
from vrx_mj.packages import root

_PACKAGE = re.compile(r"(package|model)://([^/]*)/(.*)", re.DOTALL)
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_MESH = re.compile(r"""(<mesh\s[^<>]*?\bfilename\s*=\s*)("[^"<]*"|'[^'<]*')""")
_SHOWN_BASES = 12
"""Folders that a message lists."""
_QUOTES = {"&quot;": '"', "&apos;": "'"}
_MAX_BYTES = 50_000_000
"""Largest mesh file that is read."""
_FLAT = 1e-6
"""Thickness, as a share of the largest extent, below which a mesh is a plane or a line."""
_MEMORY, _MEMORY_PER_BYTE = 256 << 20, 16
"""Memory that reading a mesh may take [bytes]: this, and so much for each byte of its file."""
_SECONDS, _BYTES_PER_SECOND = 4, 2_000_000
"""Processor time of reading a mesh: this [s], and a second for so many bytes."""
_FOLDER = root() / "assets" / "robots" / "wamv"
ODD = WORDING["suspicious"]
"""Messages on what is legal but suspicious, each said once for all that have it."""


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
            where = f"no package named {literal(package[2])}: add the folder that contains it to the package paths"
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


_Found = TypeVar("_Found")


@dataclass(frozen=True)
class MeshData:
    """A mesh in its own frame [m]."""

    points: FloatArray
    """Corners of the mesh, (n, 3) [m]."""
    triangles: IntArray
    """Triangles, (m, 3) rows of `points`, counter-clockwise seen from outside."""
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
        raise VrxError(f"mesh {shorten(path.name)} {error}") from None


@lru_cache(maxsize=64)
def _cached_mesh(path: Path, size: int, _changed: int) -> MeshData:
    return _ask("mesh", path, size, MeshData)


def mesh_glb(path: Path) -> bytes:
    """The mesh of a file as glTF, whose y axis is up. The same errors as of `read_mesh`."""
    return _ask("glb", path, len(mesh_bytes(path)), bytes)


def _ask(what: str, path: Path, size: int, returns: type[_Found]) -> _Found:
    """Result of a job of the sandboxed process on a mesh file."""
    name = shorten(path.name)
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


@cache
def stand_ins() -> Mapping[str, Mapping[str, Any]]:
    """Place of each of VRX's meshes in its link, and our meshes for it with their colours, by the file's name."""
    table: Mapping[str, Mapping[str, Any]] = json.loads((_FOLDER / "stand_ins.json").read_bytes())
    return table


def _stand_in(name: str, pose: Pose, color: Color | None, scale: Vector = (1.0, 1.0, 1.0)) -> tuple[Visual, ...]:
    """Our meshes that are drawn in place of one of VRX's that a URDF names by this path; none for other meshes.

    `pose` is where the URDF draws the mesh in its link, `scale` how large; `color` is what it asks for, if it does.
    A scale that is not the same along all axes is only right for a mesh that VRX draws unturned.
    """
    own = stand_ins().get(PurePosixPath(name).name)
    if own is None:
        return ()
    x, y, z, *turn = inverse(own["pose"])
    place = chain(pose, (x * scale[0], y * scale[1], z * scale[2], *turn))  # type: ignore[arg-type]
    return tuple(
        Visual(folder=_FOLDER, type="mesh", file=f"meshes/{mesh}.obj", pose=place, scale=scale, color=color or rgba)
        for mesh, rgba in own["meshes"].items()
    )


def with_shapes(row: LinkRow, files: MeshFiles, findings: Findings) -> Link:
    """A link with its shapes, whose meshes are files; what is wrong with them is noted, not raised."""
    return replace(
        row.link,
        collisions=tuple(felt for shape in row.collisions for felt in solid_mesh(shape, files, findings)),
        visuals=tuple(seen for shape in row.visuals for seen in _seen_mesh(shape, files, findings)),
    )


def solid_mesh(shape: Shape | MeshRow, files: MeshFiles, findings: Findings) -> Iterator[Shape]:
    """A shape that collides: a mesh must be there, and have a volume."""
    if isinstance(shape, Shape):
        yield shape
        return
    try:
        yield _mesh_shape(shape, files, Shape, collides=True)
    except VrxError as error:
        findings.problems.append(shape.place.problem(shape.key, str(error)))


def _seen_mesh(shape: Visual | MeshRow, files: MeshFiles, findings: Findings) -> Iterator[Visual]:
    """The visible shape; a missing mesh is replaced by ours for it, if there are any.

    A visual mesh that cannot be read is left out, as it is no reason to refuse a robot.
    """
    if isinstance(shape, Visual):
        yield shape
        return
    try:
        yield _mesh_shape(shape, files, Visual)
    except MissingMeshError:
        instead = _stand_in(shape.file, shape.pose, shape.color, shape.scale)
        if not instead:
            findings.note("mesh", shape.file)
        yield from instead
    except VrxError as error:
        findings.note("unread", str(error))


def _mesh_shape(mesh: MeshRow, files: MeshFiles, kind: type[ShapeT], *, collides: bool = False) -> ShapeT:
    """The shape of a mesh that was found and read, in its own colour unless one is given. Ours are known to be sound.

    Raises:
        VrxError: it cannot be found or read.
    """
    folder, path = files.find(mesh.file)
    values = {"folder": folder, "type": "mesh", "file": path, "pose": mesh.pose, "scale": mesh.scale}
    values |= {"name": mesh.name} if mesh.name else {}
    own = path.endswith(".obj") and (folder / path).resolve().is_relative_to(root() / "assets")
    read = None if own else check_mesh(folder / path, mesh.scale, collides=collides)
    color = mesh.color or (read and read.color)
    return kind.model_validate(values | ({"color": color} if color and kind is Visual else {}))


def read_urdf(text: str, file: Path, files: MeshFiles | None = None, *, label: str = "") -> Urdf:
    """The robot that a URDF's text describes; xacro is expanded before.

    Args:
        text: The URDF; messages name the files and lines that expanded text comes from.
        file: Where it is from; messages name it, and relative paths of meshes start in its folder.
        files: Where its meshes may be; by default in the folder of `file` and in packages around it.
        label: What messages call the text, where its lines are not those of the file.

    Raises:
        ConfigError: With everything that is wrong, each with its line and element.

    Warns:
        VrxWarning: Once for each kind of thing that is legal but suspicious.
    """
    label = label or display(file)
    source = (
        (list(map(display, map(Path, text.made.files))), text.made.places) if isinstance(text, ExpandedText) else ()
    )
    robot, rows, findings = ask(
        "formats.urdf.kinematics:reading", text, file, label, *source,
        returns=tuple[Urdf, tuple[LinkRow, ...], Findings], about=label,
    )  # fmt: skip
    files = files or MeshFiles(file.absolute().parent)
    links = {row.link.name: with_shapes(row, files, findings) for row in rows}
    findings.settle()
    warn_of_oddities(findings)
    return replace(robot, links=links)


def read_joints(text: str) -> Urdf:
    """The tree of a URDF alone: the names of the links, and its joints.

    Raises:
        ConfigError: The text is no URDF, or its joints are wrong.
    """
    return ask("formats.urdf.kinematics:tree", text, "robot_description", returns=Urdf, about="robot_description")


@lru_cache(maxsize=64)
def in_namespace(text: str, namespace: str) -> str:
    """A URDF's text with its names in another namespace, as VRX's argument `namespace` has it.

    Links, joints, frames and topics begin with the namespace; so does what refers to them. Text whose root link has no
    namespace, and text that is no robot, stays as it is.
    """
    own = namespace_of(text)
    if own in {"", namespace}:
        return text
    name = re.escape(own)
    beginning = re.compile(rf"""(filename\s*=\s*(?:"[^"]*"|'[^']*'))|(=\s*["']\s*/?|>\s*/?){name}/""")
    alone = re.compile(rf"(<(robotNamespace|namespace)>\s*/?){name}(/?\s*</\2>)")
    text = beginning.sub(lambda found: found[1] or f"{found[2]}{namespace}/", text)
    return alone.sub(lambda found: f"{found[1]}{namespace}{found[3]}", text)


def namespace_of(text: str) -> str:
    """The namespace of a URDF's root link; empty if it has none, and for text that is not a robot."""
    try:
        return read_joints(text).namespace
    except VrxError:
        return ""


def warn_of_oddities(findings: Findings) -> None:
    """Warn of what is suspicious, once for each kind of it."""
    for kind, things in findings.odd.items():
        warn(f"{findings.file}: {ODD[kind]}: {first_names(things, 8)}", 4)
