"""Search for files: names along a search path, paths inside the folder of the file that names them, ROS packages.

Files are read up to a limit; those of Gazebo and ROS in the place of ours are recognised.
"""

import fnmatch
import os
import re
import stat
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import chain
from pathlib import Path, PurePosixPath

from vrx_mj.config.kinds import KINDS, function_of, kind_of, needs
from vrx_mj.errors import LONGEST_NAME, UnknownNameError, VrxError, nearest, shorten
from vrx_mj.packages import root

_NO_FILES = {"d": "a folder", "p": "a pipe", "s": "a socket", "c": "a device", "b": "a device"}
"""Kinds of paths that are no files, by their letter in a long listing."""
_WAITS_FOR_NOBODY = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
_MOST_NAMES = 1000
"""Files of a folder among which the one that is meant is looked for."""
_CLASSIC, _NEWER = "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"
_PARENTS = 4
"""How far above a file the package is looked for that it lies in."""
_SUBFOLDERS = re.compile("config|description|launch|meshes|models?|robots?|sdf|urdf|worlds|xacro")
"""Folders of a package in which robot files lie."""
SOURCES = "src"
"""Name of the folder of a workspace in which its packages are."""
DEEPEST = 4
"""Largest depth below an entry of ROS_PACKAGE_PATH at which packages are found."""
_MOST_FOLDERS = 5000
"""Folders that are looked into for packages."""
_NAME = re.compile(r"<name>\s*([\w.-]{1,200})\s*</name>")
_BYTES = 100_000
BUILT_IN = "VRX_MJ_BUILT_IN"
"""A file in the folders of packages that `vrx-mj ros packages` writes for roslaunch: what they hold is known here."""
XML_SUFFIXES = (".urdf", ".xacro")
SCHEME = "model://"
"""How the name of a model of Gazebo begins."""
TEMPLATE = "model.sdf.erb"
"""File from which VRX makes the model of a dock."""
WORLD_SUFFIXES = (".world.xacro", ".sdf.xacro", ".world", ".sdf")
"""How worlds of Gazebo end, the longest first."""
MODEL_SUFFIXES = (*WORLD_SUFFIXES, ".sdf.erb")
"""How the files that models of Gazebo are in end."""
_TERRAIN = "terrain"
"""The kind of files of shorelines."""
_PATH_SUFFIXES = (".yaml", ".yml", ".txt", *WORLD_SUFFIXES, *XML_SUFFIXES)
PACKAGE_PATH = "VRX_MJ_PACKAGE_PATH"
"""Environment variable with the folders in which `package://` and `$(find ...)` look."""
OWN_PATH = "VRX_MJ_PATH"
"""Environment variable with the folders in which names are looked for, and files may lie that other files name."""
MISSING = "VRX_MJ_MISSING"
"""Environment variable that says `ignore` where launch files and xacro may name packages that are missing."""
ALLOW = f"add its folder with --allow FOLDER or {OWN_PATH}"
"""Advice about a file in a folder that may not be read."""


class ReadingError(VrxError):
    """A file that cannot be read; the message is the reason, without its name."""


def read_limited(file: Path, most: int) -> bytes:
    """The bytes of a regular file of at most so many.

    Raises:
        ReadingError: it is not there, may not be read, is not a file, or is larger.
    """
    try:
        _check(file.stat())
        handle = os.open(file, os.O_RDONLY | _WAITS_FOR_NOBODY)
        with os.fdopen(handle, "rb") as stream:
            size = _check(os.fstat(handle))
            data = b"" if size > most else stream.read(most + 1)
    except OSError as error:
        raise ReadingError(f"cannot be read: {error.strerror}") from None
    except ValueError:
        raise ReadingError("cannot be read: its name is not valid") from None
    if size > most or len(data) > most:
        raise ReadingError(f"is larger than {most / 1e6:g} MB, the maximum")
    return data


def _check(status: os.stat_result) -> int:
    """The size of a regular file; anything else may have no end, or none that comes."""
    if other := _NO_FILES.get(stat.filemode(status.st_mode)[0]):
        raise ReadingError(f"cannot be read: it is {other}, not a file")
    return status.st_size


def _refuse_foreign(kind: str, text: str, folder: Path, known: Container[str]) -> None:
    """Raise a VrxError if a path leads to a file that is there, but in another format than its kind's.

    Args:
        kind: kind of file that is needed, as `worlds`.
        text: the path, as the user wrote it.
        folder: where a relative path starts.
        known: names of this kind.
    """
    found = kind_of(folder / text) if text else None
    if not text or (found is None and not os.path.isfile(folder / text)):  # noqa: PTH113 - as in `is_built_in`
        return
    ours = in_vrx(kind, text, known)
    name, use = found or (f"a file that does not end in {'.txt' if kind == 'docks' else '.yaml'}", "")
    advice = ours or use.replace("FILE", text if len(text) < LONGEST_NAME else "FILE") or needs(kind)
    raise VrxError(f"'{shorten(text)}' is {name}, not {'an' if kind == 'objects' else 'a'} {KINDS[kind]}: {advice}")


def of_format(kind: str, text: str, file: Path, folder: Path) -> Path:
    """The file, unless it is text where YAML is needed, XML where YAML or a drawing is, or a world of Gazebo."""
    others = (*(() if kind == "docks" else (".txt",)), *(() if kind == "robots" else XML_SUFFIXES))
    if file.name.lower().endswith((*WORLD_SUFFIXES, *others)):
        _refuse_foreign(kind, text, folder, catalogue(kind))
    return file


def near_names(file: Path) -> str:
    """A suggestion for a path that leads nowhere, as the end of a message: a file beside it; empty without one."""
    try:
        if file.is_symlink():
            return f"; it is a link to '{shorten(file.readlink())}'"
        names = [entry.name for entry in sorted(file.parent.iterdir())[:_MOST_NAMES]]
    except (OSError, ValueError):
        there = os.path.isdir(file.parent)  # noqa: PTH112 - Path.is_dir raises an OSError for a name that is too long
        return "" if there else f"; there is no folder '{display(file.parent)}'"
    close = nearest(file.name, names) or next((name for name in names if Path(name).stem == file.name), None)
    return f"; did you mean '{display(file.with_name(close))}'?" if close else ""


def in_vrx(kind: str, name: str, known: Container[str]) -> str | None:
    """The message about a world's name that is one of VRX's; None: VRX has no such name."""
    describe = function_of("names", name) if kind == "worlds" else None
    return describe(name, known) if describe else None


def is_built_in(folder: Path) -> bool:
    """Whether a folder is a package for roslaunch alone: files of ours never look into it."""
    return os.path.isfile(folder / BUILT_IN)  # noqa: PTH113 - Path.is_file raises an OSError for a name that is too long


def enclosing_packages(folder: Path) -> dict[str, Path]:
    """The package that a folder is in, by its name and its folder's, if any: that of the nearest `package.xml`."""
    place = _package_of(folder)
    name = package_name(place) if place else None
    return {place.name: place, name: place} if place and name else {}


def _package_of(folder: Path) -> Path | None:
    """The nearest folder with a `package.xml`, from a folder upwards."""
    places = [folder, *folder.parents][: _PARENTS + 1]
    return next((place for place in places if (place / "package.xml").is_file()), None)


def workspace_packages(folder: Path) -> dict[str, Path]:
    """The packages of the workspace that a folder is in, by name.

    A workspace is a folder `src` above the package of the folder, or a checkout of git; without them, the packages
    beside that package are its. It is never a user's home nor above it.
    """
    space, depth = _source_space(folder.absolute())
    try:
        return {} if space is None else _packages_below(space, depth, space.stat().st_mtime_ns)
    except OSError:
        return {}


def packages_around(folder: Path) -> dict[str, Path]:
    """The packages of the workspace that a folder is, or is in."""
    sources = folder / SOURCES
    return workspace_packages(sources if sources.is_dir() else folder)


def _source_space(folder: Path) -> tuple[Path | None, int]:
    """The folder of the packages of a workspace, and how far below it they lie."""
    package = _package_of(folder)
    start = package or folder
    above = [
        place for place in ([] if package else [folder]) + list(start.parents)[:_PARENTS] if _may_be_package(place)
    ]
    sources = (place for place in above if place.name == SOURCES and place.parent != _home())
    found = next(sources, None) or next((place for place in above if (place / ".git").exists()), None)
    if found is None and package is not None and package.parent in above:
        return package.parent, 1
    return found, DEEPEST


@lru_cache(maxsize=8)
def _packages_below(folder: Path, depth: int, _changed: int) -> dict[str, Path]:
    """The packages below a folder, until it changes; of two of one name the first."""
    found: dict[str, Path] = {}
    for package in _crawl(folder, depth, [_MOST_FOLDERS]):
        found.setdefault(package_name(package) or package.name, package)
    return found


def package_above(folder: Path, name: str) -> Path | None:
    """The folder of a name that a folder is, or in whose `urdf`, `xacro` or the like it lies, `package.xml` or not.

    It is never a user's home nor above it.
    """
    for place in [folder, *folder.parents][: _PARENTS + 1]:
        if place.name == name and (place == folder or _may_be_package(place)):
            return place
        if not _SUBFOLDERS.fullmatch(place.name):
            return None
    return None


def _may_be_package(folder: Path) -> bool:
    return not _home().is_relative_to(folder) and len(folder.parts) > 2


def _home() -> Path:
    """The user's home; `~` for one who has none."""
    return Path(os.path.expanduser("~"))  # noqa: PTH111 - Path.home raises a RuntimeError for a user without one


def packages_named(name: str, near: Path, known: Sequence[Mapping[str, Path]], paths: Iterable[Path]) -> Iterator[Path]:
    """Folders that may be the ROS package of a name, the likeliest first.

    Those that are known by this name, then what a file in the folder `near` lies in, along `paths`, beside that file,
    and in its workspace.
    """
    yield from (packages[name] for packages in known if name in packages)
    if name in {"", ".", ".."}:
        return
    if above := package_above(near, name):
        yield above
    for path in paths:
        yield path / name
        if name in {path.name, path.resolve().name} or package_name(path) == name:
            yield path
    yield near / name
    if name in (around := workspace_packages(near)):
        yield around[name]


def package_name(folder: Path) -> str | None:
    """Name of the package in a folder's `package.xml`; None if it has none."""
    try:
        text = read_limited(folder / "package.xml", _BYTES).decode("utf-8", errors="replace")
    except ReadingError:
        return None
    found = _NAME.search(text)
    return found[1] if found else None


def listed_in(variable: str) -> tuple[Path, ...]:
    """The folders that an environment variable lists."""
    return tuple(Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry)


@lru_cache(maxsize=8)
def _package_folders(entries: tuple[Path, ...]) -> tuple[Path, ...]:
    """Each entry that is absolute, and each folder below it that holds packages."""
    found: dict[Path, None] = {}
    left = [_MOST_FOLDERS]
    for entry in filter(Path.is_absolute, entries):
        for folder in _crawl(entry, DEEPEST, left):
            found[folder if folder == entry or package_name(folder) != folder.name else folder.parent] = None
    return tuple(found)


def _crawl(entry: Path, depth: int, left: list[int]) -> Iterator[Path]:
    """The packages in a folder, as ROS finds them: none in a package; `left` counts folders that may be looked into."""
    for folder, below, files in os.walk(entry):
        left[0] -= 1
        if left[0] < 0:
            return
        if "package.xml" in files:
            yield Path(folder)
        if {"package.xml", "CATKIN_IGNORE"} & {*files} or len(Path(folder).parts) - len(entry.parts) >= depth:
            below.clear()
        below[:] = sorted((name for name in below if not name.startswith(".")), reverse=True)


def package_paths() -> tuple[Path, ...]:
    """Folders in which a robot's files look for packages, besides their own: VRX_MJ_PACKAGE_PATH's, then ROS's."""
    shared = (path / "share" for path in listed_in(_NEWER) if path.is_absolute())
    return (*listed_in(PACKAGE_PATH), *_package_folders(listed_in(_CLASSIC)), *filter(Path.is_dir, shared))


def kind_name(model: str) -> str:
    """Kind of a model by the name or path that a file gives: `my_buoy` for `./my_buoy/model.sdf`."""
    path, mark, name = model.partition("#")
    file = PurePosixPath(path)
    return name if mark else file.parent.name if file.name in {"model.sdf", TEMPLATE} else file.stem


def is_path(source: str | Path) -> bool:
    """A path ends in .yaml, .yml, .txt, .world, .sdf, .urdf or .xacro; anything else is a name."""
    return str(source).lower().endswith(_PATH_SUFFIXES)


def find(kind: str, name: str, near: Path | None = None, skip: Path | None = None) -> Path:
    """The first file of this kind and name along the search path, `skip` excepted.

    The path is the current folder, `near` (the folder of the file that gives the name), the entries of
    VRX_MJ_PATH, and our own; in each DIR, DIR/NAME, DIR/KIND/NAME and DIR/assets/KIND/NAME with its suffix.
    """
    if _is_name(name):
        for folder in _folders(near):
            for file in _candidates(folder, kind, name):
                if os.path.isfile(file) and not (skip and skip.samefile(file)):  # noqa: PTH113 - a path costs ten times it
                    return Path(file)
    known = catalogue(kind, near)
    inside = near is None or is_inside(near / name, near, *allowed_folders())
    if inside:
        _refuse_foreign(kind, name, near or Path.cwd(), known)
    if name.startswith(("./", "../", "/", "~")):
        if not inside:
            raise leaves_folder(shorten(name))
        raise VrxError(f"no such file: '{shorten(name)}'{near_names((near or Path.cwd()) / name)}")
    raise UnknownNameError(KINDS[kind], name, known, in_vrx(kind, name, known))


def catalogue(kind: str, near: Path | None = None) -> dict[str, Path]:
    """Every name of this kind along the search path, sorted, with its file.

    A file straight in the current folder can be named too, but it may be of any kind: it is not listed.
    """
    if kind not in {*KINDS, _TERRAIN}:
        raise UnknownNameError("kind of file", kind, KINDS)
    found: dict[str, Path] = {}
    for folder in _folders(near):
        for place in (folder / kind, folder / "assets" / kind):
            for name, file in _names_and_files(kind, place):
                found.setdefault(name, file)
    return dict(sorted(found.items()))


def find_terrain(name: str, near: Path | None = None) -> Path:
    """The file of a terrain, which is of any type, in `assets/terrain` along the search path."""
    known = catalogue(_TERRAIN, near)
    if name not in known:
        raise UnknownNameError(_TERRAIN, name, known)
    return known[name]


def contained_file(text: str, folder: Path | None) -> Path:
    """The file at a path, which may not lead out of `folder` and the allowed ones, not even through a link.

    Without a folder it is what the caller wrote in Python: any path, from the current folder on.
    """
    if folder and "\\" in text:
        raise VrxError(f"path '{text}' has a backslash; use '/'")
    base = (folder or Path.cwd()).resolve()
    missing = f"no file '{shorten(text)}'{'' if Path(text).is_absolute() else f' in {display(base)}'}"
    try:
        file = (base / text).resolve()
        if folder and not (file.is_relative_to(base) or is_inside(file, *allowed_folders())):
            raise leaves_folder(text)
        if not file.is_file():
            raise VrxError(missing)
    except (OSError, ValueError, RuntimeError):
        raise VrxError(missing) from None
    return (folder or Path.cwd()) / text


def leaves_folder(text: str) -> VrxError:
    """The error about a path in a file that leads to where nothing may be read."""
    return VrxError(f"path '{text}' leaves the folder of the file that names it; {ALLOW}")


def allowed_folders() -> tuple[Path, ...]:
    """The folders of VRX_MJ_PATH."""
    return listed_in(OWN_PATH)


def is_inside(path: Path, *folders: Path) -> bool:
    """Whether a path leads into one of some folders, links followed."""
    try:
        real = path.resolve()
        return any(real.is_relative_to(folder.resolve()) for folder in folders)
    except (OSError, ValueError, RuntimeError):
        return False


def display(path: Path) -> str:
    """A path as messages show it: relative to the current folder where it lies inside."""
    try:
        inside = path.absolute().relative_to(Path.cwd()).as_posix()
    except ValueError:
        return path.as_posix()
    return "the current folder" if inside == "." else inside


def _folders(near: Path | None) -> tuple[Path, ...]:
    return (Path.cwd(), *([near] if near else []), *allowed_folders(), root())


def _candidates(folder: Path, kind: str, name: str) -> Iterator[str]:
    for place in ("", f"{kind}/", f"assets/{kind}/"):
        for suffix in _suffixes(kind):
            yield f"{folder}/{place}{name}{suffix}"
        if kind == "robots":
            yield f"{folder}/{place}{name}/robot.yaml"


def _suffixes(kind: str) -> tuple[str, ...]:
    return {"docks": (".txt",), _TERRAIN: (".*",)}.get(kind, (".yaml", ".yml"))


def _names_and_files(kind: str, place: Path) -> Iterator[tuple[str, Path]]:
    """Names and files below a folder; a robot's may be a folder with a `robot.yaml`."""
    for folder, _, names in os.walk(place):
        inside = Path(folder).relative_to(place).as_posix()
        for name in chain.from_iterable(fnmatch.filter(names, f"?*{suffix}") for suffix in _suffixes(kind)):
            known = f"{inside}/{name.rpartition('.')[0]}".removeprefix("./")
            if kind == "robots" and inside != ".":
                known = inside if name == "robot.yaml" else ""
            if known and (file := Path(folder, name)).is_file():
                yield known, file


def _is_name(name: str) -> bool:
    """A name may have slashes, for subfolders, but leads neither up nor to a drive."""
    odd = set('\\:*?"<>|\0\n') & set(name)
    return not odd and len(name) < 200 and all(part.strip(" .") for part in name.split("/"))
