"""Where files are found: names along a search path, paths inside the folder of the file that names them."""

import os
from collections.abc import Container, Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath

from vrx_mj.config.foreign import foreign_file, vrx_world
from vrx_mj.config.ros_packages import ros_package_paths
from vrx_mj.errors import UnknownNameError, VrxError, shortened
from vrx_mj.resources import root

__all__ = [
    "KINDS",
    "PACKAGE_PATH",
    "XML_SUFFIXES",
    "catalogue",
    "contained",
    "display",
    "find",
    "find_terrain",
    "is_path",
    "package_paths",
    "refuse_foreign",
]

KINDS = {
    "worlds": "world",
    "fleets": "fleet",
    "docks": "dock layout",
    "objects": "object model",
    "robots": "robot",
}
"""Kinds of files that have names, and what a message calls one of them."""

XML_SUFFIXES = (".urdf", ".xacro")
PATH_SUFFIXES = (".yaml", ".yml", ".txt", *XML_SUFFIXES)
PACKAGE_PATH = "VRX_MJ_PACKAGE_PATH"
"""Environment variable with the folders in which `package://` and `$(find ...)` look."""


def package_paths() -> tuple[Path, ...]:
    """Folders in which a robot's files look for packages, besides their own: VRX_MJ_PACKAGE_PATH's, then ROS's."""
    own = tuple(Path(entry) for entry in os.environ.get(PACKAGE_PATH, "").split(os.pathsep) if entry)
    return (*own, *ros_package_paths())


def is_path(source: str | Path) -> bool:
    """A path ends in .yaml, .yml, .txt, .urdf or .xacro; anything else is a name."""
    return str(source).lower().endswith(PATH_SUFFIXES)


def find(kind: str, name: str, near: Path | None = None, skip: Path | None = None) -> Path:
    """The first file of this kind and name along the search path, `skip` excepted.

    The path is the current folder, `near` (the folder of the file that says the name), the entries of
    VRX_MJ_PATH, and our own; in each DIR, DIR/NAME, DIR/KIND/NAME and DIR/assets/KIND/NAME with its suffix.
    """
    if _is_name(name):
        for folder in _folders(near):
            for file in _candidates(folder, kind, name):
                if file.is_file() and not (skip and file.samefile(skip)):
                    return file
    known = catalogue(kind, near)
    refuse_foreign(kind, name, near or Path.cwd(), known)
    raise UnknownNameError(KINDS[kind], name, known, vrx_world(name, known) if kind == "worlds" else None)


def refuse_foreign(kind: str, text: str, folder: Path, known: Container[str] = ()) -> None:
    """Raise a VrxError if a path leads to a file that is not of the format of this kind."""
    said = foreign_file(kind, text, folder, known)
    if said is not None:
        raise VrxError(said)


def catalogue(kind: str, near: Path | None = None) -> dict[str, Path]:
    """Every name of this kind along the search path, sorted, with its file.

    A file straight in the current folder can be named too, but nobody can tell its kind: it is not listed.
    """
    if kind not in KINDS:
        raise UnknownNameError("kind of file", kind, KINDS)
    found: dict[str, Path] = {}
    for folder in _folders(near):
        for place in (folder / kind, folder / "assets" / kind):
            for name, file in _listed(kind, place):
                found.setdefault(name, file)
    return dict(sorted(found.items()))


def find_terrain(name: str, near: Path | None = None) -> Path:
    """The file of a terrain, which is of any type, in `assets/terrain` along the search path."""
    known: dict[str, Path] = {}
    for folder in _folders(near):
        for place in (folder / "terrain", folder / "assets" / "terrain"):
            for file in sorted(place.glob("*.*")):
                known.setdefault(file.stem, file)
    if name not in known:
        raise UnknownNameError("terrain", name, sorted(known))
    return known[name]


def contained(text: str, folder: Path | None) -> Path:
    """The file at a relative path, which may not lead out of `folder`, not even through a link."""
    if "\\" in text:
        raise VrxError(f"path '{text}' has a backslash; type '/'")
    if PurePosixPath(text).is_absolute() or PureWindowsPath(text).drive:
        raise VrxError(f"path '{text}' is absolute; give one relative to this file's folder")
    base = (folder or Path.cwd()).resolve()
    try:
        file = (base / text).resolve()
        if not file.is_relative_to(base):
            raise VrxError(f"path '{text}' leaves the folder of the file that names it")
        if not file.is_file():
            raise VrxError(f"no file '{shortened(text)}' in {display(base)}")
    except (OSError, ValueError, RuntimeError):
        raise VrxError(f"no file '{shortened(text)}' in {display(base)}") from None
    return (folder or Path.cwd()) / text


def display(path: Path) -> str:
    """A path as messages show it: relative to the current folder where it lies inside."""
    try:
        inside = path.absolute().relative_to(Path.cwd()).as_posix()
    except ValueError:
        return path.as_posix()
    return "the current folder" if inside == "." else inside


def _folders(near: Path | None) -> Iterator[Path]:
    yield Path.cwd()
    if near is not None:
        yield near
    yield from (Path(entry) for entry in os.environ.get("VRX_MJ_PATH", "").split(os.pathsep) if entry)
    yield root()


def _candidates(folder: Path, kind: str, name: str) -> Iterator[Path]:
    for place in (folder, folder / kind, folder / "assets" / kind):
        for suffix in _suffixes(kind):
            yield place / f"{name}{suffix}"
        if kind == "robots":
            yield place / name / "robot.yaml"


def _suffixes(kind: str) -> tuple[str, ...]:
    return (".txt",) if kind == "docks" else (".yaml", ".yml")


def _listed(kind: str, place: Path) -> Iterator[tuple[str, Path]]:
    """Names and files below a folder; a robot's may be a folder with a `robot.yaml`."""
    for file in sorted(place.rglob("*")):
        if file.suffix not in _suffixes(kind) or not file.is_file():
            continue
        inside = file.relative_to(place)
        if kind != "robots" or len(inside.parts) == 1:
            yield inside.with_suffix("").as_posix(), file
        elif file.name == "robot.yaml":
            yield inside.parent.as_posix(), file


def _is_name(name: str) -> bool:
    """A name may have slashes, for subfolders, but leads neither up nor to a drive."""
    odd = set('\\:*?"<>|\0\n') & set(name)
    return not odd and len(name) < 200 and all(part.strip(" .") for part in name.split("/"))
