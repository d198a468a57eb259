"""Folders of ROS packages: the one that a file lies in, and those that ROS's environment variables lead to."""

import os
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from vrx_mj.config.reading import ReadingError, read_limited

__all__ = ["enclosing_packages", "package_above", "package_name", "ros_package_paths"]

CLASSIC, NEWER = "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"
PARENTS = 4
"""How far above a file the package is looked for that it lies in."""
SUBFOLDERS = frozenset(
    {
        "config",
        "description",
        "launch",
        "meshes",
        "model",
        "models",
        "robot",
        "robots",
        "sdf",
        "urdf",
        "worlds",
        "xacro",
    }
)
"""Folders of a package in which robot files lie."""
DEEPEST = 4
"""Folders below an entry of ROS_PACKAGE_PATH in which packages are looked for."""
MOST_FOLDERS = 5000
"""Folders that are looked into for packages."""
_NAME = re.compile(r"<name>\s*([\w.-]{1,200})\s*</name>")
_BYTES = 100_000


def enclosing_packages(folder: Path) -> dict[str, Path]:
    """The package that a folder is in, by its name and its folder's, if any: that of the nearest `package.xml`."""
    for place in [folder, *folder.parents][: PARENTS + 1]:
        if (place / "package.xml").is_file():
            name = package_name(place)
            return {place.name: place, name: place} if name else {}
    return {}


def package_above(folder: Path, name: str) -> Path | None:
    """The folder of a name that a folder is, or in whose `urdf`, `xacro` or the like it lies, `package.xml` or not.

    It is never a user's home nor above it.
    """
    for place in [folder, *folder.parents][: PARENTS + 1]:
        if place.name == name and (place == folder or _may_be_package(place)):
            return place
        if place.name not in SUBFOLDERS:
            return None
    return None


def _may_be_package(folder: Path) -> bool:
    try:
        return not Path.home().is_relative_to(folder) and len(folder.parts) > 2
    except RuntimeError:
        return False


def package_name(folder: Path) -> str | None:
    """What a folder's `package.xml` calls the package; None if it has none."""
    try:
        text = read_limited(folder / "package.xml", _BYTES).decode("utf-8", errors="replace")
    except ReadingError:
        return None
    found = _NAME.search(text)
    return found[1] if found else None


def ros_package_paths() -> tuple[Path, ...]:
    """Folders that are ROS packages or hold them, as ROS_PACKAGE_PATH and AMENT_PREFIX_PATH say."""
    return (*_crawled(os.environ.get(CLASSIC, "")), *_shared(os.environ.get(NEWER, "")))


def _entries(value: str) -> Iterator[Path]:
    return (Path(entry) for entry in value.split(os.pathsep) if entry and Path(entry).is_absolute())


def _shared(value: str) -> tuple[Path, ...]:
    """Where ROS 2 installs packages below each prefix."""
    return tuple(path / "share" for path in _entries(value) if (path / "share").is_dir())


@lru_cache(maxsize=8)
def _crawled(value: str) -> tuple[Path, ...]:
    """Each entry, and each folder below it that holds packages, as ROS finds them: none in a package."""
    found: dict[Path, None] = {}
    left = MOST_FOLDERS
    for entry in _entries(value):
        waiting = [(entry, 0)]
        while waiting and left > 0:
            folder, depth = waiting.pop()
            left -= 1
            if (folder / "package.xml").is_file():
                found[folder if folder == entry or package_name(folder) != folder.name else folder.parent] = None
            elif depth < DEEPEST and not (folder / "CATKIN_IGNORE").exists():
                waiting += [(below, depth + 1) for below in _folders(folder)]
    return tuple(found)


def _folders(folder: Path) -> list[Path]:
    """Folders in a folder; links are not followed."""
    try:
        with os.scandir(folder) as entries:
            return sorted(Path(entry.path) for entry in entries
                          if entry.is_dir(follow_symlinks=False) and not entry.name.startswith("."))  # fmt: skip
    except OSError:
        return []
