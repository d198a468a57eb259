"""Options and arguments that several commands share, and values that may be left out."""

import inspect
import os
import re
import warnings
from collections.abc import Callable, Sequence
from functools import update_wrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from typer import Argument, CallbackParam, Option

from vrx_mj.config.search import MISSING, OWN_PATH, PACKAGE_PATH
from vrx_mj.errors import CommandError, VrxError, VrxWarning

if TYPE_CHECKING:
    from vrx_mj.mjcf.world import World as CompiledWorld

World = Annotated[
    str,
    Argument(
        help="Name of a world (see vrx-mj list worlds), or path of its YAML, of a world or launch file, or of a "
        "folder with one, such as a catkin workspace."
    ),
]
Arguments = Annotated[
    list[str] | None,
    Argument(
        metavar="[FILE] [NAME:=VALUE]...",
        help="As with roslaunch: a file in that folder or package, and arguments of a launch file or xacro.",
    ),
]
Fleet = Annotated[
    str | None,
    Option(help="Name of a fleet or path of its YAML, URDF or launch file; default: one boat."),
]
Nudge = Annotated[bool, Option("--nudge", help="Move boats that start on land, docks or each other to free water.")]
Seed = Annotated[int | None, Option(help="Seed of waves, gusts and noise; default: the world's.")]
_Packages = Annotated[
    list[Path] | None,
    Option(metavar="<folder>", help="A ROS package with a robot's files, or a folder of packages; may be repeated."),
]
_Allowed = Annotated[
    list[Path] | None,
    Option(
        metavar="<folder>",
        help="Let files refer to files in this folder, like an entry of VRX_MJ_PATH; may be repeated.",
    ),
]
_Ignored = Annotated[
    Literal["error", "ignore"] | None,
    Option(
        help="Missing packages of a launch file or xacro: error (the default), or ignore, which leaves out what they "
        "contain."
    ),
]


MAX_NUMBER = 1e9
"""Largest magnitude of a number."""
DEFAULT_PORT = "9090"
"""Port of rosbridge."""
_DEFAULT_WEB_PORT = "8090"
"""Port of teleop's page."""
_FILE_ENDINGS = (".launch", ".launch.py", ".world", ".xacro", ".sdf", ".yaml", ".yml")
"""Endings of the files of a folder that a command line may name."""
_LEFT_OUT = {
    "--rosbridge": (DEFAULT_PORT, r"\d+"),
    "--web": (_DEFAULT_WEB_PORT, r"\d+"),
    "--foxglove": ("8765", r"\d+"),
    "--localization": ("navigator", "navigator|truth"),
    "--ardupilot": ("9002", r"\d+|[^-]\S*:\d+"),
    "--nmea": ("10110", r"\d+|[^-]\S*:\d+"),
}
"""Options whose value may be left out, with that which they then have, and the form of their values."""
_LEFT_OUT_BY_CAMPAIGN = {"--ray": ("", r"auto|local|[^-]\S*:\d+")}
"""Short options left out of `vrx-mj campaign`, where others of these options are flags."""
_T = TypeVar("_T")


def above_zero(most: float = MAX_NUMBER) -> Callable[[CallbackParam, float | None], float | None]:
    """A check that an option's number, if given, is above 0 and at most `most`. CommandError: it is not."""

    def check(param: CallbackParam, value: float | None) -> float | None:
        if value is not None and not 0.0 < value <= most:
            limit = f", at most {most:g}," if value > 0.0 else ""
            raise CommandError(f"invalid {param.opts[0]} '{value:g}': a number above 0{limit} is needed")
        return value

    return check


Scale = Annotated[float, Option(help="Scale factor of the mesh, such as 0.001 for mm.", callback=above_zero())]


def _be_strict(strict: bool) -> bool:
    if strict:
        from vrx_mj.formats.gazebo.document import STRICT

        STRICT.set(True)
        warnings.simplefilter("error", VrxWarning)
    return strict


Strict = Annotated[
    bool,
    Option("--strict", help="Treat warnings and unread parts as errors.", callback=_be_strict),
]
Output = Annotated[Path, Option("--output", "-o", help="The file or folder to write.")]
Folder = Annotated[Path, Option("--output", "-o", help="The folder to write.")]
Record = Annotated[Path | None, Option(help="Write a recording for rerun (.rrd).")]
Recording = Annotated[Path, Argument(help="A recording (.rrd).")]
Json = Annotated[Path | None, Option("--json", help="Write the table as JSON.")]


def put_first(folders: Sequence[Path], variable: str, option: str) -> None:
    """Put the folders of an option before those of an environment variable.

    Raises:
        VrxError: one of them is not a folder.
    """
    for folder in folders:
        if not folder.is_dir():
            raise VrxError(f"invalid {option} '{folder}': not a folder")
    if folders:
        os.environ[variable] = os.pathsep.join(filter(None, (*map(str, folders), os.environ.get(variable))))


def reads_files(command: Callable[..., _T]) -> Callable[..., _T]:
    """A command with the options of all that read users' files; they act before it, and it does not see them."""

    def reads(
        *arguments: Any,
        package_path: _Packages = None,
        allow: _Allowed = None,
        missing: _Ignored = None,
        **options: Any,
    ) -> _T:
        put_first(package_path or (), PACKAGE_PATH, "--package-path")
        put_first(allow or (), OWN_PATH, "--allow")
        if missing:
            os.environ[MISSING] = missing
        return command(*arguments, **options)

    added = [one for one in inspect.signature(reads).parameters.values() if one.kind is one.KEYWORD_ONLY]
    own = inspect.signature(command, eval_str=True)
    reads.__signature__ = own.replace(parameters=[*own.parameters.values(), *added])  # type: ignore[attr-defined]
    return update_wrapper(reads, command)


def compile_source(
    world: str,
    words: Sequence[str] | None,
    *,
    fleet: str | None = None,
    seed: int | None = None,
    nudge: bool = False,
) -> "CompiledWorld":
    """Compile the world of a command line as roslaunch has it: `FOLDER FILE NAME:=VALUE`.

    Raises:
        CommandError: a word is not of this form.
        UnknownNameError: the folder has no such file.
    """
    from vrx_mj.mjcf.compile import compile_world

    first, *rest = words or ("",)
    if ":=" not in first and first.lower().endswith(_FILE_ENDINGS):
        from vrx_mj.formats.gazebo.opening import file_in

        world, words = file_in(world, first), rest
    return compile_world(world, fleet=fleet, seed=seed, nudge=nudge, arguments=named_values(words))


def named_values(words: Sequence[str] | None) -> dict[str, str]:
    """Arguments as roslaunch takes them, NAME:=VALUE, by name.

    Raises:
        CommandError: a word is not of this form.
    """
    for word in words or ():
        if not word.partition(":=")[0].isidentifier() or ":=" not in word:
            raise CommandError(f"invalid argument '{word}': NAME:=VALUE is needed, as in x:=-520")
    return dict(word.split(":=", 1) for word in words or ())


def with_default_port(arguments: Sequence[str]) -> list[str]:
    """The words of a command line, with the values that may be left out."""
    left_out = _LEFT_OUT_BY_CAMPAIGN if "campaign" in arguments[:1] else _LEFT_OUT
    words = []
    for index, word in enumerate(arguments):
        default, form = left_out.get(word, ("", ".*"))
        after = "".join(arguments[index + 1 : index + 2])
        words.append(word if re.fullmatch(form, after, re.DOTALL) else f"{word}={default}")
    return words
