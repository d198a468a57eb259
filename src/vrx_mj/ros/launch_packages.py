"""Packages for roslaunch: VRX's launch files by their names, with VRX's arguments, whose nodes are commands of ours."""

import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from shlex import quote

from vrx_mj.config.search import BUILT_IN, is_built_in, packages_around
from vrx_mj.errors import VrxError
from vrx_mj.formats.gazebo.launch import SERVING
from vrx_mj.formats.gazebo.stock import PACKAGES, stock_launches
from vrx_mj.resources import root
from vrx_mj.ros.messages import DEFINITIONS
from vrx_mj.ros.packages import catkin_files, files_below, hide_twins, listed_files, put_files

PACKAGE_LIST = "vrx_mj_packages.json"
"""File that lists what was written to the folder, each file with its sha256."""
NODES = {
    "vrx_gazebo": {
        name: f"scripts/{name}"
        for name in (
            SERVING,
            "generate_wamv.py",
            "generate_worlds.py",
            "keydrive",
            "joydrive",
            "playback",
            "missing",
            "key2thrust_angle.py",
            "pinger_visualization.py",
            "spawn_wamv.bash",
        )
    },
    "gazebo_ros": {name: f"scripts/{name}" for name in ("gzserver", "spawn_model")},
    "teleop_twist_keyboard": {"teleop_twist_keyboard.py": "scripts/teleop_twist_keyboard.py"},
    "xacro": {"xacro": "xacro", "xacro.py": "xacro.py"},
}
"""Programs of each package, by the type of a node, and where they are."""
PACKAGE_NAMES = (*PACKAGES, "wamv_gazebo", "wamv_description", "gazebo_ros", "teleop_twist_keyboard", "xacro")


def write_launch_packages(folder: str | Path, over: Path | None = None) -> tuple[str, ...]:
    """Write the packages into a folder, one folder each, and return their names.

    What an earlier call wrote there is replaced. What packages of these names in a workspace, `over`, have besides is
    there by links; nothing is written into the workspace.

    Raises:
        VrxError: a file is in the way, or cannot be written; or the workspace has no such package.
    """
    top = Path(folder).absolute()
    if ":" in str(top):
        raise VrxError(f"invalid folder of packages '{top}': ':' in a path separates entries of a list")
    made = launch_packages()
    links = _links(over, made) if over else {}
    put_files(made, top, listed_files(top / PACKAGE_LIST, PACKAGE_NAMES), PACKAGE_LIST, links)
    hide_twins(top)
    return PACKAGE_NAMES


def _links(over: Path, made: Mapping[str, bytes]) -> dict[str, Path]:
    """Where files and folders are that packages of ours lack, in those of the same names in a workspace."""
    found = {name: place for name, place in packages_around(over).items() if not is_built_in(place)}
    named = {name: found[name].resolve() for name in PACKAGE_NAMES if name in found}
    if not named:
        raise VrxError(f"no package {', '.join(PACKAGE_NAMES)} in workspace '{over}'")
    return dict(link for name, place in named.items() for link in _lacking(place, name, made))


def _lacking(folder: Path, name: str, made: Mapping[str, bytes]) -> Iterator[tuple[str, Path]]:
    """What is in a folder of a package and not in ours, but for programs of which ours has one of the name."""
    programs = NODES.get(name.partition("/")[0], {})
    for entry in sorted(folder.iterdir()):
        own = f"{name}/{entry.name}"
        if own in made or entry.name.startswith(".") or entry.name in programs:
            continue
        inside = entry.rglob("*") if entry.is_dir() and not entry.is_symlink() else ()
        if any(each.startswith(f"{own}/") for each in made) or any(each.name in programs for each in inside):
            yield from _lacking(entry, own, made)
        else:
            yield own, entry


def launch_packages() -> dict[str, bytes]:
    """The files of all packages, by their paths."""
    own = root() / "assets"
    texts: dict[str, str] = {}
    for name in PACKAGE_NAMES:
        what = f"The launch files of {name} for vrx_mj, written by `vrx-mj ros packages`."
        definitions = [*files_below(DEFINITIONS / name)]
        texts |= {f"{name}/{file}": text for file, text in catkin_files(name, what, definitions).items()}
        texts |= {f"{name}/{file.suffix[1:]}/{file.name}": file.read_text("utf-8") for file in definitions}
        texts[f"{name}/{BUILT_IN}"] = "Files of vrx_mj never look in here: its own are used.\n"
        for node, script in NODES.get(name, {}).items():
            # the Python that wrote it runs it: a shell's variables have no say
            python = shutil.which(sys.executable) or sys.executable
            texts[f"{name}/{script}"] = f"""#!/bin/sh
exec {quote(python)} -E -P -m vrx_mj.cli.nodes {node} "$@"
"""
    for package in PACKAGES:
        texts |= {f"{package}/launch/{one.name}": one.file.read_text("utf-8") for one in stock_launches(package)}
    files = {name: text.encode() for name, text in texts.items()}
    for name, place in (
        *((name, own / "ros" / name) for name in ("vrx_gazebo", "wamv_gazebo", "gazebo_ros", "xacro")),
        *((f"{name}/urdf", own / "robots/wamv" / name / "urdf") for name in ("wamv_gazebo", "wamv_description")),
    ):
        files |= {f"{name}/{file.relative_to(place).as_posix()}": file.read_bytes() for file in files_below(place)}
    for kind in ("thruster", "component"):
        file = own / f"robots/wamv/config/{kind}_config.yaml"
        files[f"vrx_gazebo/config/wamv_config/example_{kind}_config.yaml"] = file.read_bytes()
    return files
