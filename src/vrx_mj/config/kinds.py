"""What a file is, by its name and how it begins, and which command takes it: for messages about wrong files."""

import os.path
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

HEAD = 4000
"""Bytes of a file that are looked into."""


class FileKind(NamedTuple):
    """What a file is."""

    name: str
    """What a message calls it."""
    use: str = ""
    """What takes it; FILE is its path."""


_SAILED = "vrx-mj run FILE sails it, vrx-mj import FILE -o FOLDER writes it as YAML"
_ROBOT = "vrx-mj run example_course --fleet FILE sails it"
_BAG = "it is played beside vrx-mj serve, by rosbag play or ros2 bag play"
FORMATS = {
    ".world.xacro": FileKind("a world of Gazebo (SDF in xacro)", _SAILED),
    ".world": FileKind("a world of Gazebo (SDF)", _SAILED),
    ".sdf.erb": FileKind("a template of Gazebo", "vrx-mj import FILE -o FOLDER reads the layout of a dock from it"),
    ".sdf": FileKind("SDF of Gazebo", "a world in it is sailed by vrx-mj run FILE, a boat by --fleet FILE; a model is "
                     "named in a world's `objects`"),
    ".launch.py": FileKind("a launch file of ROS 2", "it is a program, which is not run: name its world and its boat, "
                           "vrx-mj run WORLD --fleet BOAT.urdf"),
    ".launch.xml": FileKind("a launch file of ROS 2", "name its world and boat, vrx-mj run WORLD --fleet BOAT.urdf"),
    ".launch": FileKind("a launch file of ROS", "vrx-mj run FILE sails it; --fleet FILE takes its boats alone"),
    ".urdf": FileKind("the description of a robot (URDF)", _ROBOT),
    ".xacro": FileKind("a description in xacro", _ROBOT),
    "package.xml": FileKind("the package.xml of a ROS package", "vrx-mj run takes the folder that it is in"),
    "model.config": FileKind("the model.config of a model of Gazebo", "a world names its folder, as model://NAME"),
    ".xml": FileKind("XML"),
    ".dae": FileKind("a mesh", "a robot or an object names it"),
    ".stl": FileKind("a mesh", "a robot or an object names it"),
    ".obj": FileKind("a mesh", "a robot or an object names it"),
    ".bag": FileKind("a bag of ROS 1", _BAG),
    ".db3": FileKind("a bag of ROS 2", _BAG),
    ".mcap": FileKind("a bag", _BAG),
    ".rrd": FileKind("a recording of rerun", "vrx-mj replay FILE opens it"),
    ".zip": FileKind("an archive", "unpack it, then vrx-mj run takes the folder"),
    ".csv": FileKind("a table of numbers", "vrx-mj validate --data FILE compares a boat with what it measures"),
    ".png": FileKind("a picture"),
    ".jpg": FileKind("a picture"),
    ".py": FileKind("a program in Python", "--control module:function takes a controller"),
    "scene.json": FileKind("a part of a saved world", "vrx_mj.Simulation.load takes its folder"),
    ".json": FileKind("JSON"),
}  # fmt: skip
"""What a file is, by the end of its name, the longest first."""
ROOTS = {
    b"<mujoco": FileKind("MJCF of MuJoCo", "python -m mujoco.viewer --mjcf=FILE shows it"),
    b"<sdf": FORMATS[".sdf"],
    b"<robot": FORMATS[".urdf"],
}
"""What an XML file is, by its first tag."""
FOLDER = FileKind("a folder", "name a file in it")

MARKS = {
    "worlds": {"sea", "scene", "spawn", "physics", "task", "terrain", "georeference"},
    "fleets": {"usv_count", "positions", "boats", "layout", "engines", "components"},
    "objects": {"mass", "inertia", "buoyancy", "collisions", "visuals", "static"},
    "robots": {"urdf", "hydrodynamics", "suites", "layouts", "rudders", "sails"},
    "thrusters": {"engine"},
    "cases": {"signals"},
    "components": {"wamv_camera", "wamv_gps", "wamv_imu", "lidar", "wamv_ball_shooter", "wamv_pinger", "wamv_p3d"},
}
"""Keys of files of one kind alone."""
AXIS = {"steps", "macros"}
"""Keys of every part of a file of axes."""
USES = {
    "worlds": "a world, which commands take as WORLD",
    "fleets": "a fleet, which commands take with --fleet",
    "objects": "an object, which a world names in `objects` as `model`",
    "robots": "a robot, which a fleet or a world's `spawn` names as `robot`",
    "thrusters": "thrusters, which a fleet names as `thrusters`, vrx-mj robot with --thrusters",
    "cases": "a case, which vrx-mj validate takes with --case",
    "components": "components, which a fleet names as `components`, vrx-mj robot with --components",
}
"""What a file is, and where it is named."""


def kind_of(file: Path) -> FileKind | None:
    """What a file is that is no YAML and no plain text; None where that is not known, or nothing is there."""
    if os.path.isdir(file):  # noqa: PTH112 - Path.is_dir raises an OSError for a name that is too long
        return FOLDER
    if not os.path.isfile(file):  # noqa: PTH113
        return None
    name = file.name.lower()
    found = next((kind for end, kind in FORMATS.items() if name.endswith(end)), None)
    if found is None or found.name == "XML":
        head = _head(file)
        found = next((kind for tag, kind in ROOTS.items() if tag in head), found)
    return found


def _head(file: Path) -> bytes:
    """How a regular file begins."""
    try:
        with file.open("rb") as stream:
            return stream.read(HEAD)
    except OSError:
        return b""


def wrong_kind(file: Path, wanted: str) -> str | None:
    """The message about a file that is no YAML and no plain text, where that is wanted; None: it may be."""
    found = kind_of(file)
    use = found.use.replace("FILE", file.name) if found else ""
    return f"{found.name}, not {wanted}{f': {use}' if use else ''}" if found else None


def other_kind(kind: str, section: Mapping[str, object]) -> str | None:
    """The message about the content of a file of another kind; None: it may be of this kind."""
    given = set(section)
    if given and all(isinstance(axis, Mapping) and set(axis) >= AXIS for axis in section.values()):
        return "axes of a series of worlds, one of which commands take as WORLD, with its number: axes.yaml#0"
    if given & MARKS.get(kind, given):
        return None
    found = next(((name, key) for name, marks in MARKS.items() for key in sorted(given & marks)), None)
    return f"the file of {USES[found[0]]}: it has the key '{found[1]}'" if found else None
