"""Where the mesh files of a URDF are: beside it, or in the packages that the user points at.

No file is read outside these folders, not even through a link.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath, PureWindowsPath
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr, unescape

from vrx_mj.config.ros_packages import enclosing_packages, package_above, package_name
from vrx_mj.config.search import display
from vrx_mj.config.wording import shown
from vrx_mj.errors import VrxError

__all__ = ["MeshFiles", "MissingMeshError", "with_file_uris"]

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
    """Of the URDF."""
    packages: Mapping[str, Path] = field(default_factory=dict)
    """Folders of ROS packages, by name."""
    package_paths: Sequence[Path] = ()
    """Folders that are packages, or hold them."""

    @cached_property
    def _around(self) -> dict[str, Path]:
        """The package that the URDF lies in."""
        return enclosing_packages(self.folder.absolute())

    def find(self, name: str) -> tuple[Path, str]:
        """The folder and the path inside it of a mesh, from what a `filename` says."""
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

    def _bases(self, text: str = "") -> list[Path]:
        """The folders that may be read for what a `filename` says."""
        package = _PACKAGE.fullmatch(text)
        above = package_above(self.folder.absolute(), package[2]) if package else None
        return [
            *([above] if above else []),
            self.folder,
            *self.packages.values(),
            *self._around.values(),
            *self.package_paths,
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
    """A URDF's text that says of each mesh that is found where it is, as `file:///...`; the others stay as they are."""

    def told(found: re.Match[str]) -> str:
        try:
            folder, name = files.find(unescape(found[2][1:-1], _QUOTES))
        except VrxError:
            return found[0]
        return found[1] + quoteattr((folder / name).resolve().as_uri())

    return _MESH.sub(told, text)


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
