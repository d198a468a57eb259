"""Commands on files: `vrx-mj list`, `vrx-mj new`, `vrx-mj import` (Gazebo and VRX to ours) and `vrx-mj worlds`."""

import fnmatch
import os
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Annotated, get_args

from typer import Argument, Typer, echo

from vrx_mj.arguments import check_name
from vrx_mj.bar import Bar
from vrx_mj.cli.options import Arguments, Folder, Strict, named_values, reads_files
from vrx_mj.cli.screen import show
from vrx_mj.config.kinds import KINDS
from vrx_mj.config.search import catalogue
from vrx_mj.errors import CommandError, UnknownNameError, VrxError, ignore_warnings, shorten
from vrx_mj.outputs import Content, begins, write_file, write_files, writing
from vrx_mj.packages import root

if TYPE_CHECKING:
    from vrx_mj.config.base import Config
    from vrx_mj.formats.gazebo.importing import ImportResult
    from vrx_mj.formats.series.worlds import SeriesWorld
    from vrx_mj.mjcf.boats import AssembledThruster, Boat

NEW_KINDS = {"world": "world.yaml", "fleet": "fleet.yaml", "dock": "dock.txt", "object": "object.yaml"}
"""Kinds of files that `new` makes, and the start file of each."""
NEW_ROBOT = ("robot.yaml", "thruster_config.yaml", "component_config.yaml")
"""The start files of a robot, which `new` puts in a folder."""
_SIDES = "config"
"""The folder inside of the output for the files beside worlds."""


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
    check_name("kind of file", kind, (*KINDS, "tasks"))
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
            with ignore_warnings():
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
    from vrx_mj.tasks import TASK_KINDS

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


@reads_files
def import_(
    source: Annotated[Path, Argument(help="A world, launch file, boat or model, or a folder of them.")],
    output: Folder,
    arguments: Arguments = None,
    strict: Strict = False,
) -> None:
    """Convert files of Gazebo and VRX to ours. The file import.md lists what became of each part.

    It reads .world, .world.xacro, .sdf, .launch, .urdf, .xacro, model folders and the docks' .sdf.erb, and runs none of
    them. Other commands take Gazebo's worlds without conversion: vrx-mj run my_course.world

    Example: vrx-mj import my_course.world.xacro -o my_course
    """
    from vrx_mj.formats.gazebo.importing import FATES, TABLE, import_files

    made = import_files(source, named_values(arguments))
    _write(made, output)
    counts = ", ".join(f"{made.count(fate)} {fate}" for fate in FATES)
    echo(f"{counts}: {output / TABLE}")
    for message in made.failed:
        show(f"not read: {message}")
    for world, fleet in made.sails[:3]:
        paths = [str(output / name if name in made.texts else name) for name in (world, fleet) if name]
        words = [f'"{path}"' if " " in path else path for path in paths]  # in any shell
        echo(f"to sail: vrx-mj run {' --fleet '.join(words)}")
    if strict and (made.failed or made.count("not read")):
        raise CommandError("--strict: some parts are not read")


def _write(made: "ImportResult", folder: Path) -> None:
    """Write everything, over the files of an earlier import but over no others."""
    from vrx_mj.formats.gazebo.importing import HEAD, TABLE, TITLE

    def is_ours(name: str) -> bool:
        if name.endswith(".yaml"):
            return begins(folder / name, HEAD)
        return (folder / TABLE).is_file() and begins(folder / TABLE, TITLE)

    files: dict[str, Content] = {**made.texts, TABLE: made.table(), **made.copies}
    write_files(folder, files, "the import", replaces=is_ours, kind="of an import")


app = Typer(rich_markup_mode=None)


@app.command()
def generate(
    file: Annotated[str, Argument(help="Path of an axes file (YAML).")],
    output: Folder,
) -> None:
    """Write the worlds of an axes file, and print the steps of each. If one is invalid, none is written.

    run, map and campaign also take FILE#k: world k of the series, counted from 0, without writing it.

    Example: vrx-mj worlds generate wind_and_waves.yaml -o my_worlds
    """
    from vrx_mj.config.kinds import wrong_kind
    from vrx_mj.config.loading import file_of
    from vrx_mj.config.world import load_world
    from vrx_mj.formats.series.axes import read_series
    from vrx_mj.formats.series.worlds import HEAD, series_world, side_text, world_text

    if other := wrong_kind(Path(file), "an axes file"):
        raise VrxError(f"'{shorten(file)}' is {other}")
    series = read_series(file_of("worlds", file))
    made = [series_world(series, number) for number in range(series.count)]
    texts: dict[str, str] = {}
    with Bar("checking", len(made), "worlds") as bar:
        for number, world in enumerate(made, 1):
            load_world(world.section)
            texts[f"{world.name}.yaml"] = world_text(series, world)
            if world.side is not None:
                texts[f"{_SIDES}/{world.name}.yaml"] = side_text(series, world)
            bar.update(number)
    write_files(
        output, texts, "the world", replaces=lambda name: begins(output / name, HEAD), kind="a world of a series"
    )
    for line in table(made):
        echo(line)
    first = output / f"{made[0].name}.yaml"
    echo(f"{len(made)} world{'s' * (len(made) > 1)} in {output}; to sail the first: vrx-mj run {first}")


def table(made: Sequence["SeriesWorld"]) -> Iterator[str]:
    """A line for each world: its name and the step of each axis."""
    rows = [("world", *made[0].coordinate)]
    rows += [(world.name, *map(str, world.coordinate.values())) for world in made]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for name, *steps in rows:
        cells = (step.rjust(width) for step, width in zip(steps, widths[1:], strict=True))
        yield "  ".join([name.ljust(widths[0]), *cells])
