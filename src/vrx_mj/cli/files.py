"""`vrx-mj list` and `vrx-mj new`."""

import fnmatch
import os
import warnings
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, get_args

from vrx_mj.config.kinds import KINDS
from vrx_mj.config.search import catalogue
from vrx_mj.errors import UnknownNameError, VrxError, VrxWarning
from vrx_mj.outputs import write_file, write_files, writing
from vrx_mj.resources import root

if TYPE_CHECKING:
    from vrx_mj.config.base import Config
    from vrx_mj.mjcf.boats import AssembledThruster, Boat

NEW_KINDS = {"world": "world.yaml", "fleet": "fleet.yaml", "dock": "dock.txt", "object": "object.yaml"}
"""Kinds of files that `new` makes, and the start file of each."""
NEW_ROBOT = ("robot.yaml", "thruster_config.yaml", "component_config.yaml")
"""The start files of a robot, which `new` puts in a folder."""


def listing(kind: str, pattern: str = "*", *, verbose: bool = False) -> Iterator[str]:
    """A line for each name of a kind, with its file where that is not one of ours.

    Names in folders come after the others, under a heading for each folder, which starts with `#`.

    Args:
        kind: worlds, fleets, robots, objects, docks or tasks.
        pattern: only names like this, in which `*` stands for anything, slashes included.
        verbose: with each file's description.

    Raises:
        UnknownNameError: unknown kind, or no name like this.
    """
    if kind == "tasks":
        yield from _tasks(verbose=verbose)
        return
    if kind not in KINDS:
        raise UnknownNameError("kind of file", kind, (*KINDS, "tasks"))
    known = catalogue(kind)
    names = sorted(fnmatch.filter(known, pattern), key=lambda name: (PurePosixPath(name).parent, name))
    if known and not names:
        raise UnknownNameError(KINDS[kind], pattern, known)
    for folder, group in groupby(names, key=lambda name: str(PurePosixPath(name).parent)):
        members = list(group)
        if folder != ".":
            yield from ("", f"# {folder}: {len(members)}")
        for name in members:
            yield _line(kind, name, known[name], verbose=verbose)
            if verbose and kind == "robots":
                yield from (f"  {line}" for line in command_lines(name))


def _line(kind: str, name: str, file: Path, *, verbose: bool) -> str:
    """A name, with its description and its file."""
    ours = file.resolve().is_relative_to(root().resolve())
    about = f": {text}" if verbose and (text := _description(kind, file)) else ""
    return f"{name}{about}" if ours else f"{name}{about}  ({file})"


def command_lines(robot: str) -> Iterator[str]:
    """Lines about the commands of a robot with its first layout, by profile; none if it cannot be built."""
    from vrx_mj.config.fleet import Order
    from vrx_mj.config.kinds import Profile
    from vrx_mj.mjcf.build import build_boat

    found: dict[str, list[str]] = {}
    for profile in get_args(Profile):
        try:
            with warnings.catch_warnings(action="ignore", category=VrxWarning):
                boat = build_boat(Order(robot, profile=profile))
        except VrxError:
            return
        shown = "; ".join((*_thrusts(boat), *_angles(boat)))
        found.setdefault(shown or "no commands", []).append(profile)
    for shown, profiles in found.items():
        yield f"{', '.join(profiles)}: {shown}"


def _thrusts(boat: "Boat") -> Iterator[str]:
    """Commands of thrusters; those that are alike share one text."""
    pushing = [thruster for thruster in boat.thrusters if thruster.blade is None]
    for text, group in groupby(pushing, key=_thrust):
        yield f"{', '.join(thruster.name for thruster in group)} {text}"


def _thrust(thruster: "AssembledThruster") -> str:
    drive = thruster.drive
    ahead, astern = drive.max_force_forward, -drive.max_force_reverse
    lasts = f"for {drive.timeout:g} s" if drive.timeout > 0 else "until the next command"
    if drive.mapping == "newtons":
        return f"{-astern:g} to {ahead:g} N, {lasts}"
    limit = drive.max_command
    return f"{-limit:g} to {limit:g} of full power, which is at most {ahead:g} N ahead and {astern:g} N astern, {lasts}"


def _angles(boat: "Boat") -> Iterator[str]:
    steered = [thruster for thruster in boat.thrusters if thruster.drive.max_angle > 0]
    for angle, group in groupby(steered, key=lambda thruster: thruster.drive.max_angle):
        names = ", ".join(f"{thruster.name}_angle" for thruster in group)
        yield f"{names} {-angle:.4g} to {angle:.4g} rad"


def _tasks(*, verbose: bool) -> Iterator[str]:
    """A line for each type of task: what its score is; verbose: with its keys."""
    from vrx_mj.config.tasks import TASKS, TaskConfig
    from vrx_mj.tasks.registry import TASK_KINDS

    for name, task in TASKS.items():
        yield f"{name}: {TASK_KINDS[name].meaning}"
        if verbose:
            yield from _keys(task, [key for key in task.model_fields if key not in TaskConfig.model_fields])
    if verbose:
        yield "all tasks"
        yield from _keys(TaskConfig, TaskConfig.model_fields)


def _keys(model: type["Config"], keys: Iterable[str]) -> Iterator[str]:
    """A line for each of these keys of a section, with its description if it has one."""
    from vrx_mj.config.base import field_docstrings

    docstrings = field_docstrings(model)
    for key in keys:
        about = " ".join(docstrings.get(key, "").split())
        yield f"  {key}: {about}" if about else f"  {key}"


def _description(kind: str, file: Path) -> str:
    """The description in a YAML file; empty where it has none or cannot be read."""
    if file.suffix not in {".yaml", ".yml"}:
        return ""
    from vrx_mj.config.loading import read_source

    try:
        text = read_source(kind, file).get("description")
    except VrxError:
        return ""
    return " ".join(text.split()) if isinstance(text, str) else ""


def copy_start_file(kind: str, name: str) -> Path:
    """Copy the start file of a kind into the current folder under a new name.

    Raises:
        UnknownNameError: unknown kind.
        VrxError: the file is there already, or cannot be written.
    """
    if kind not in NEW_KINDS:
        raise UnknownNameError("start file", kind, (*NEW_KINDS, "robot"))
    source = root() / "assets" / "start" / NEW_KINDS[kind]
    stem = Path(name.removesuffix(source.suffix))
    target = _new_path(kind, stem, source.suffix)
    write_file(target, source, "the start file")
    return target


def copy_robot_files(name: str) -> Path:
    """Copy a robot's start files into a new folder: its YAML, and a thruster and a component file as VRX names them.

    Raises:
        VrxError: the folder is there already, or cannot be written.
    """
    folder = new_folder(name)
    write_files(folder, {file: root() / "assets" / "start" / file for file in NEW_ROBOT}, "the folder")
    return folder


def new_folder(name: str) -> Path:
    """The folder of a new robot, made.

    Raises:
        VrxError: it is there already, or cannot be made.
    """
    folder = _new_path("robot", Path(name))
    with writing("the folder", folder):
        folder.mkdir()
    return folder


def _new_path(kind: str, stem: Path, suffix: str = "") -> Path:
    """The path of something new, with its suffix. VrxError: it has no name, or is there already."""
    if not stem.name:
        raise VrxError(f"the new {kind} needs a name, as in vrx-mj new {kind} my_{kind}")
    path = stem.with_name(stem.name + suffix)
    if os.path.lexists(path):
        raise VrxError(f"{path} exists: choose another name, or remove it")
    return path
