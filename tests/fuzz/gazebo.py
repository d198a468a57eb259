"""Files of Gazebo and ROS: worlds, models, launch files, templates of docks, and catkin workspaces of them."""

import functools
import random
from pathlib import Path

import gazebo_files
import workspaces
from fuzz import junk, markup, raw
from fuzz.kind import Files, Kind
from vrx_mj.formats.gazebo.importing import import_files
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.simulation import Simulation

WORLDS = ("example_course", "stationkeeping_task", "wayfinding_task", "gymkhana", "wildlife_task", "ocean_buoys")
TEMPLATE = b"<sdf version='1.6'><model name='dock'>\n<%\nlayout = ['X  X',\n          'XXXX']\n%>\n</model></sdf>\n"
XML = (".launch", ".sdf", ".config", ".xacro", ".xml")
STEP = 0.1
"""Simulated time that an input sails [s]."""


@functools.cache
def worlds() -> list[bytes]:
    """Worlds of VRX in the form of Gazebo, of both generations."""
    classic = [gazebo_files.classic_text(name) for name in WORLDS]
    newer = [gazebo_files.newer_text(f"vrx2023/{name}") for name in ("stationkeeping_task", "wayfinding_task")]
    return [text.encode() for text in (*classic, *newer)]


@functools.cache
def workspace() -> dict[str, bytes]:
    """The files of a catkin workspace."""
    return {
        f"ws/src/{package}/{name}": text.encode()
        for package, files in workspaces.PACKAGES.items()
        for name, text in {"package.xml": f"<package><name>{package}</name></package>", **files}.items()
    }


def changed(text: bytes, chance: random.Random) -> bytes:
    """A document with changes; one that is no XML has its bytes changed."""
    try:
        return markup.mutated(text, chance)
    except (ValueError, SyntaxError):
        return raw.mutated(text, chance)


def mutated_world(chance: random.Random) -> Files:
    """A world alone, or a model or a template of a dock that a world has."""
    draw = chance.random()
    if draw < 0.7:
        return {"bay.world": changed(chance.choice(worlds()), chance)}
    include = "<include><uri>model://%s</uri><pose>0 0 0 0 0 0</pose></include>"
    name, file, seed = ("team_buoy", "model.sdf", workspaces.BUOY.encode()) if draw < 0.9 else (
        "dock", "model.sdf.erb", TEMPLATE)  # fmt: skip
    world = f'<sdf version="1.6"><world name="bay">{include % name}</world></sdf>'
    content = changed(seed, chance) if draw < 0.9 else raw.mutated(seed, chance)
    return {f"models/{name}/{file}": content, "bay.world": world.encode()}


def mutated_workspace(chance: random.Random) -> Files:
    """A workspace in which one to three files are changed, renamed or missing."""
    files = dict(workspace())
    names = [name for name in files if name.endswith(XML)]
    picked = chance.sample(names, raw.few(chance, 3))
    for name in picked:
        draw = chance.random()
        if draw < 0.85:
            files[name] = changed(files[name], chance)
        elif draw < 0.95 and len(picked) > 1:
            del files[name]
        else:
            files[name] = str(junk.value(chance)).encode("utf-8", "replace")
    first = next((name for name in picked if name in files), names[0])
    return {first: files.pop(first, b""), **files}


def sail_world(folder: Path) -> None:
    """Compile the world and sail it, then import it."""
    sail(Path("bay.world"))
    import_files(Path("bay.world"))


def sail_workspace(folder: Path) -> None:
    """Compile what its launch files start, and sail it; then import all of it."""
    for name in (workspaces.PRACTICE, workspaces.TWO_BOATS):
        file = Path("ws/src/team_gazebo/launch") / name
        if file.is_file():
            sail(file)
    import_files(Path("ws"))


def sail(source: Path) -> None:
    """Compile a world or what a launch file starts, and sail for a moment."""
    sim = Simulation(compile_world(str(source)))
    sim.reset(seed=1)
    sim.step({}, duration=STEP)


def warm() -> None:
    """Read all that is mutated."""
    worlds()
    workspace()


KINDS = (
    Kind("gazebo world", mutated_world, sail_world, warm=warm),
    Kind("workspace", mutated_workspace, sail_workspace, warm=warm),
)
