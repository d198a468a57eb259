"""Files of Gazebo and ROS below a folder, as a catkin workspace, a package or a folder of worlds."""

import contextlib
import os
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePath

from vrx_mj.config.search import display, is_inside
from vrx_mj.errors import VrxError
from vrx_mj.formats.urdf.xml_document import MAX_BYTES, read_bytes

_BUILT = {"build", "devel", "install", "log"}
"""Folders of a workspace that are made from the others."""
MOST_FILES = 2000
"""Files of these kinds below a folder."""
MOST_FOLDERS = 20_000
"""Folders below a folder."""
_MOST_MEGABYTES = 32
"""Size of the files together."""
DEEPEST = 50
"""Levels of folders below a folder."""


def is_folder(path: str | Path) -> bool:
    """Whether there is a folder of this path, which may be too long for any."""
    with contextlib.suppress(ValueError):
        return os.path.isdir(path)  # noqa: PTH112 - Path.is_dir raises an OSError for a name that is too long
    return False


def files_below(folder: Path, kinds: tuple[str, ...]) -> Iterator[Path]:
    """The files below a folder with one of these endings, but for those that catkin makes from others beside them.

    Links to folders are not followed, links to files not where they lead out or nowhere.

    Raises:
        VrxError: there are too many, or too much is in them.
    """
    found, size = 0, 0
    for place, names in _places(folder):
        present = set(names)
        for name in sorted(names):
            file = Path(place, name)
            made = f"{name}.xacro" in present or f"{name}.erb" in present
            if made or not name.lower().endswith(kinds) or not (os.path.exists(file) and is_inside(file, folder)):  # noqa: PTH110 - as is_folder
                continue
            length = file.stat().st_size
            found, size = found + 1, size + (length if length <= MAX_BYTES else 0)  # a longer one is not read
            if found > MOST_FILES:
                raise VrxError(f"more than {MOST_FILES} files to read in {display(folder)}: name a smaller folder")
            if size > _MOST_MEGABYTES * 10**6:
                raise VrxError(f"more than {_MOST_MEGABYTES} MB to read in {display(folder)}: name a smaller folder")
            yield file


def _places(folder: Path) -> Iterator[tuple[str, list[str]]]:
    """The folders below a folder that may hold sources, and the names of the files in each; none that are locked."""
    top = str(folder)
    try:
        os.scandir(top).close()
    except OSError as error:
        raise VrxError(f"{display(folder)}: cannot be read: {error.strerror}") from None
    for number, (place, folders, names) in enumerate(os.walk(top)):
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in _BUILT)
        if number > MOST_FOLDERS:
            raise VrxError(f"more than {MOST_FOLDERS} folders in {display(folder)}: name a smaller one")
        if folders and place[len(top) :].count(os.sep) > DEEPEST:
            raise VrxError(f"folders more than {DEEPEST} deep in {display(folder)}: name a smaller one")
        yield place, names


def has_world(file: Path) -> bool:
    """Whether a file has a world, not only models; for one that cannot be read by its name."""
    if not file.name.lower().endswith((".sdf", ".sdf.xacro")):
        return True
    with contextlib.suppress(VrxError):
        return re.search(rb"<world[\s>]", read_bytes(file)) is not None
    return not file.name.startswith("model")


def links_below(folder: Path) -> list[Path]:
    """Links to folders in a folder and in its `src`, which are not followed."""
    places = [folder, folder / "src"]
    inside = (Path(entry.path) for place in places if is_folder(place) for entry in os.scandir(place))
    return sorted(path for path in inside if path.is_symlink() and is_folder(path))


def short_names(files: Sequence[Path], folder: Path) -> list[str]:
    """The shortest end of each file's path in a folder that no other one has: its name, where that is its own."""
    parts = [PurePath(os.path.relpath(file, folder)).parts for file in files]
    ends = Counter(one[-length:] for one in parts for length in range(1, len(one) + 1))
    shortest = (next((one[-size:] for size in range(1, len(one)) if ends[one[-size:]] == 1), one) for one in parts)
    return ["/".join(one) for one in shortest]
