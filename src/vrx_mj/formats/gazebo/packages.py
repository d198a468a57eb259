"""Packages of ROS and VRX that need not be there: which worlds and robots of ours their files are."""

import os.path
from pathlib import Path, PurePosixPath

from vrx_mj.config.search import catalogue, is_built_in
from vrx_mj.errors import UnknownNameError, shortened
from vrx_mj.formats.gazebo.document import LIBRARIES, home_path, is_file
from vrx_mj.formats.gazebo.stock import PLACES, TABLE
from vrx_mj.formats.urdf.expand import LEFT_OUT

NAMED_PACKAGES = LIBRARIES | {*TABLE["packages"]}
"""Packages of ROS and VRX that need not be there: what they hold is known here, or not needed."""
NOWHERE = "/package:/"
"""Beginning of a path in such a package that is missing."""
_OURS = {"wamv_gazebo": "wamv", "cora_gazebo": "cora"}
"""How the names of VRX's descriptions begin, and our robots."""
_DEEPEST = 5
"""Folders above a file in which the folder of its package is looked for."""


def _is_nowhere(path: str) -> bool:
    """Whether a path leads into a package that is missing, or that `vrx-mj ros packages` wrote for roslaunch alone."""
    return path.startswith(NOWHERE) or any(map(is_built_in, list(Path(path).parents)[:_DEEPEST]))


def named_world(path: str) -> Path | str:
    """A world's file, or the name here of one of VRX's that is not at hand.

    Raises:
        UnknownNameError: it leads into a package of VRX, which has none of this name, nor a link to one.
    """
    if not _is_nowhere(path):
        return home_path(path)
    parts = PurePosixPath(path).parts
    stem = parts[-1].partition(".")[0]
    known = catalogue("worlds")
    names = (f"vrx2019/{stem}" if "vrx_2019" in parts else stem, PLACES.get(stem, stem))
    found = next((name for name in names if name in known), None) or _link_target(path) or _link_target(f"{path}.xacro")
    if found is None:
        raise UnknownNameError("world of VRX", stem, known)
    return found


def robot_named(path: str) -> str | None:
    """The name here of a description of VRX's that is not at hand; None: it is another."""
    name = PurePosixPath(path).name
    if not _is_nowhere(path) or _link_target(path):
        return None
    return next((robot for start, robot in _OURS.items() if name.startswith(start)), None)


def package_left_out(path: str) -> str:
    """The name of the package that a path of one that is missing leads into."""
    return shortened(path.removeprefix(LEFT_OUT).partition("/")[0])


def _link_target(path: str) -> Path | None:
    """The file of a user's to which a link of `vrx-mj ros packages --over` leads; None: there is no such file."""
    real = Path(os.path.realpath(path))
    return real if is_file(real) and not _is_nowhere(str(real)) else None


def object_named(path: str) -> str | None:
    """The name here of a model of VRX's that is not at hand, by the folder of its file; None: it is another."""
    file = PurePosixPath(path)
    name = file.parent.name
    return name if _is_nowhere(path) and file.name == "model.sdf" and name in catalogue("objects") else None
