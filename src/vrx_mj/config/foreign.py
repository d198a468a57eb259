"""What is given in place of our files and names: files of Gazebo and ROS, and VRX's names of worlds."""

from collections.abc import Container, Iterable
from pathlib import Path

from vrx_mj.config.reading import ReadingError, read_limited
from vrx_mj.errors import shortened

__all__ = ["foreign_file", "other_kind", "vrx_world"]

FORMATS = {
    ".world.xacro": "a world of Gazebo (SDF in xacro)",
    ".world": "a world of Gazebo (SDF)",
    ".sdf": "SDF of Gazebo",
    ".launch": "a launch file of ROS",
    ".launch.py": "a launch file of ROS",
    ".launch.xml": "a launch file of ROS",
    ".urdf": "the description of a robot (URDF)",
    ".xacro": "a description in xacro",
    ".xml": "XML",
    ".dae": "a mesh",
    ".stl": "a mesh",
    ".obj": "a mesh",
    ".rrd": "a recording of rerun",
}
"""What a file is, by the end of its name, the longest first."""
ROOTS = {b"<mujoco": "MJCF of MuJoCo", b"<sdf": "SDF of Gazebo", b"<robot": "the description of a robot (URDF)"}
"""What an XML file is, by its first tag."""
MOST_BYTES = 4_000_000
"""Largest XML file that is looked into."""
NEEDS = {
    "worlds": "a world is a YAML file. VRX's own come with vrx_mj (vrx-mj list worlds); docs/vrx.md shows how to write "
    "others",
    "fleets": "a fleet is a YAML file; docs/vrx.md has its keys for the arguments of launch files",
    "objects": "an object is a YAML file. VRX's own come with vrx_mj (vrx-mj list objects); docs/formats/object.md has "
    "the keys of others",
    "docks": "the drawing of a dock is a text file, .txt",
    "robots": "a robot is a URDF or xacro, or the YAML file beside it",
}
"""What a file of a kind is instead."""

LAUNCHED = {
    "vrx": "example_course",
    "sydneyregatta": "example_course",
    "demo_thrusterconfigs": "example_course",
    "sandisland": "vrx2019/example_course",
    "station_keeping": "stationkeeping_task",
    "wayfinding": "wayfinding_task",
    "wildlife": "wildlife_task",
    "dock": "vrx2019/dock",
    "navigation_task": "vrx2019/navigation_task",
    "scan_and_dock": "vrx2019/scan_and_dock",
    "ocean_world": "ocean",
    "ocean_world_buoys": "ocean_buoys",
    "ocean_demos": "ocean_buoys",
    "wave_wamv": "ocean_wamv",
    "competition": "vrx2023/sydney_regatta",
}
"""Launch files of VRX, and the worlds that they open if nothing else is said."""
PLACES = {"sandisland": "sand_island", "sydneyregatta": "sydney_regatta", "nbpark": "vrx2023/nbpark"}
"""World files of VRX that have other names here."""
ENDINGS = (".launch.py", ".launch.xml", ".launch", ".world.xacro", ".world", ".sdf")


MARKS = {
    "worlds": {"sea", "scene", "spawn", "physics", "task", "terrain", "georeference"},
    "fleets": {"usv_count", "positions", "boats", "layout", "engines", "components"},
    "objects": {"mass", "inertia", "buoyancy", "collisions", "visuals", "static"},
    "robots": {"urdf", "hydrodynamics", "suites", "layouts", "rudders"},
}
"""Keys of files of one kind alone."""
USES = {
    "worlds": "a world, which commands take as WORLD",
    "fleets": "a fleet, which commands take with --fleet",
    "objects": "an object, which a world names in `objects` as `model`",
    "robots": "a robot, which a fleet or a world's `spawn` names as `robot`",
}
"""What a file is, and where it is named."""


def other_kind(kind: str, keys: Iterable[str]) -> str | None:
    """What a message says of the keys of a file of another kind; None: they may be of this kind."""
    given = set(keys)
    if given & MARKS.get(kind, given):
        return None
    found = next(((name, key) for name, marks in MARKS.items() for key in sorted(given & marks)), None)
    return f"the file of {USES[found[0]]}: it has the key '{found[1]}'" if found else None


def foreign_file(kind: str, text: str, folder: Path, known: Container[str]) -> str | None:
    """What a message says of a path of a file that is there, but has not the format of its kind; None: it is not there.

    Args:
        kind: kind of file that is needed, as `worlds`.
        text: the path, as the user wrote it.
        folder: where a relative path starts.
        known: names of this kind.
    """
    file = folder / text
    try:
        if not file.is_file():
            return None
    except (OSError, ValueError):
        return None
    name = file.name.lower()
    found = next((text for end, text in FORMATS.items() if name.endswith(end)), None)
    if found in {"XML", None}:
        found = _by_root(file) or found
    ending = f"a file that does not end in {'.txt' if kind == 'docks' else '.yaml'}"
    ours = vrx_world(text, known) if kind == "worlds" else None
    return f"'{shortened(text)}' is {found or ending}, which is not read: {ours or NEEDS[kind]}"


def _by_root(file: Path) -> str | None:
    """What an XML file is by its root; None: it is none, or of another kind."""
    try:
        text = read_limited(file, MOST_BYTES)
    except ReadingError:
        return None
    return next((name for tag, name in ROOTS.items() if tag in text[:4000]), None)


def vrx_world(name: str, known: Container[str]) -> str | None:
    """What a message says of a name that VRX has for a launch file or a world; None: it has no such name."""
    base = Path(name).name
    stem = next((base[: -len(end)] for end in ENDINGS if base.lower().endswith(end)), base)
    ending = base[len(stem) :]
    launched = LAUNCHED.get(stem) if not ending or ending.startswith(".launch") else None
    place = PLACES.get(stem) if not ending.startswith(".launch") else None
    if launched and place:
        return f"VRX's {stem}.launch opens '{launched}', its {stem}.world is '{place}'"
    if launched:
        return f"VRX's {stem}{ending or '.launch'} opens '{launched}'"
    if place or (ending and stem in known):
        return f"VRX's {base} is '{place or stem}'" if ending else f"VRX's {stem}.world is '{place}'"
    return None
