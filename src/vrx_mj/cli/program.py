"""The program: its commands and their help pages, and errors as one line.

A command's module is imported only when that command is used or its own help is asked for.

Exit codes: 0 done, 1 a run failed or was cut short, 2 wrong input, 130 Ctrl-C and 143 SIGTERM before it began.
"""

import gc
import inspect
import math
import os
import re
import sys
import warnings
from collections.abc import Sequence
from contextvars import copy_context
from functools import cache
from itertools import groupby
from pathlib import Path
from pkgutil import resolve_name
from typing import Annotated, Any, Literal, NamedTuple, cast, get_args, get_origin

from typer import Abort, BadParameter, Context, Exit, Option, Typer, echo
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command, get_group

from vrx_mj.arguments import check_name
from vrx_mj.cli.options import with_default_port
from vrx_mj.cli.screen import show_error, warn_once
from vrx_mj.errors import ChoiceError, CommandError, DivergedError, UnknownNameError, VrxError, VrxWarning
from vrx_mj.packages import MissingPackageError
from vrx_mj.signals import ended_by_signals

_UsageError: type[Exception] = BadParameter.__mro__[1]
"""Error of typer about a command line that no command takes; it exports the subclass alone."""
_EXAMPLE = "Example: "
_HEADING = re.compile(r"^\S.*:$", re.MULTILINE)
_NUMBERS = {int: "a whole number", float: "a number"}
PANELS = {
    "Sail": "worlds and boats in motion",
    "Look": "what there is, and what has happened",
    "Check": "boats, and this machine",
    "ROS": "programs and bags of ROS 1, ROS 2 and rosbridge",
    "Learn": "controllers and policies in many worlds",
}
"""The groups of the help, and what each holds."""
FIRST = {
    "demo": "vrx-mj demo",
    "list": "vrx-mj list worlds",
    "run": "vrx-mj run example_course --fleet trio --record run.rrd",
    "replay": "vrx-mj replay run.rrd",
    "view": "vrx-mj view example_course --fleet trio",
    "new": "vrx-mj new world my_bay",
}
"""Commands that a new user needs first, with an example of each."""
_ABOUT = (
    "Simulates unmanned surface vessels on MuJoCo: the worlds, boats and conventions of VRX, without ROS and Gazebo."
)
_CTRL_C = 130
"""Exit code of what Ctrl-C ended before there was something to keep, as shells have it."""


def description(text: str | None) -> list[str]:
    """The paragraphs of a command's help, each in one line, without its example."""
    text = inspect.cleandoc(text or "")
    paragraphs = (" ".join(paragraph.split()) for paragraph in text.split("\n\n"))
    return [paragraph for paragraph in paragraphs if not paragraph.startswith(_EXAMPLE)]


def example(text: str | None) -> str | None:
    """The example in a command's help; None without one."""
    lines = (line.strip() for line in (text or "").splitlines())
    return next((line.removeprefix(_EXAMPLE) for line in lines if line.startswith(_EXAMPLE)), None)


def convert_lightly(parameter: Any) -> None:
    """Convert a parameter's words here, where this typer allows that and the type is a plain one."""
    if getattr(parameter, "_runtime_param", False) is None:
        annotation = parameter.type_descriptor.annotation
        kind = get_args(annotation)[0] if get_origin(annotation) is list else annotation
        choices = get_args(kind) if get_origin(kind) is Literal else ()
        if choices or (isinstance(kind, type) and issubclass(kind, (*_NUMBERS, str, bool, Path))):
            parameter._runtime_param = Conversion(str if choices else kind, choices)


class Conversion:
    """Makes the words that were given to one parameter into values of a type, or checks that they are among choices."""

    def __init__(self, kind: type, choices: Sequence[str]) -> None:
        self.kind, self._choices = kind, choices

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """The value or values.

        Raises:
            CommandError: a word is not of this type, or outside of the parameter's range.
            UnknownNameError: it is not among the choices.
        """
        if param.multiple or param.nargs == -1:
            return tuple(self._one(each, param) for each in value or ())
        return None if value is None else self._one(value, param)

    def _one(self, word: Any, param: Any) -> Any:
        named = param.opts[0] if param.param_type_name == "option" else param.name.upper()
        if self._choices:
            check_name(f"value of {named}", word, self._choices)
        if isinstance(word, self.kind):
            return word
        try:
            value = self.kind(word)
        except ValueError:
            raise CommandError(f"invalid {named} '{word}': {_NUMBERS[self.kind]} is needed") from None
        if param.min is not None and not param.min <= value <= (param.max or math.inf):
            bounds = f"{param.min:g} to {param.max:g}" if param.max else f"at least {param.min:g}"
            raise CommandError(f"invalid {named} '{word}': {bounds} is needed")
        return value


class _Light:
    """Common parts of a command and a group."""

    help: str | None

    def get_params(self, ctx: object) -> list[Any]:
        """The parameters, `--help` too, with our own conversion."""
        parameters: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        for parameter in parameters:
            convert_lightly(parameter)
        return parameters

    def get_help(self, ctx: object) -> str:
        """The page, with bold headings in a terminal."""
        page = super().get_help(ctx)  # type: ignore[misc]
        plain = "NO_COLOR" in os.environ or not sys.stdout.isatty()
        return str(page) if plain else _HEADING.sub("\x1b[1m\\g<0>\x1b[0m", page)

    def parse_args(self, ctx: object, args: list[str]) -> Any:
        """Take the arguments; an error names the command in its context."""
        try:
            return super().parse_args(ctx, args)  # type: ignore[misc]
        except _UsageError as error:
            error.ctx = error.ctx or ctx  # type: ignore[attr-defined]
            raise

    def format_help_text(self, ctx: Any, formatter: Any) -> None:
        """Write what the command does, then its example, which is not wrapped: it can be copied."""
        for paragraph in description(self.help):
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(paragraph)
        shown = example(self.help)
        if shown is not None:
            with formatter.section("Example"):
                formatter.write(f"{'':{formatter.current_indent}}{shown}\n")


class Command(_Light, TyperCommand):
    """A command."""


class Group(_Light, TyperGroup):
    """A command with subcommands."""

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Take the arguments; without any, show the help."""
        if not args and self.no_args_is_help and not ctx.resilient_parsing:
            echo(ctx.get_help())
            raise Exit
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a line for each subcommand."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, description(one.help)[0]) for name, one in self.commands.items()])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the arguments begin with.

        Raises:
            UnknownNameError: unknown command.
        """
        known = self.list_commands(ctx)
        if args[0] not in known and not args[0].startswith("-"):
            of = "" if ctx.parent is None else f" of {ctx.command_path}"
            raise UnknownNameError(f"command{of}", args[0], known)
        return super().resolve_command(ctx, args)


class Entry(NamedTuple):
    """A command."""

    panel: str
    """Its group in the help: a key of `PANELS`."""
    home: str
    """`module:name` in this package: a function, or the typer application of a command with subcommands."""
    summary: str
    """The first sentence of its help."""


COMMANDS = {
    "demo": Entry("Sail", "commands:demo", "Sail three boats into a recording, and open it in the viewer."),
    "run": Entry("Sail", "commands:run", "Sail a world, and print where the boats end and how the task is scored."),
    "view": Entry("Sail", "commands:view", "Watch a world live, and drive its boats with the keyboard."),
    "new": Entry("Sail", "commands:new", "Copy a commented start file into the current folder."),
    "import": Entry("Sail", "files:import_", "Convert files of Gazebo and VRX to ours."),
    "compile": Entry("Sail", "commands:compile_", "Compile a world to MJCF that plain MuJoCo opens."),
    "list": Entry("Look", "commands:list_", "List worlds, fleets, robots, objects, docks or tasks."),
    "map": Entry("Look", "commands:map_", "Draw a world as seen from above."),
    "replay": Entry("Look", "commands:replay", "Open a recording in rerun's viewer, or draw a video of it."),
    "score": Entry("Look", "commands:score", "Score a recording again, with the task's own rules."),
    "compare": Entry("Look", "commands:compare", "Compare the motion in two recordings, bit for bit."),
    "convert": Entry("Look", "ros:convert", "Convert a recording to a bag, a table or tracks."),
    "robot": Entry("Check", "robot:app", "Build and check boats from VRX's thruster and component files."),
    "doctor": Entry("Check", "commands:doctor", "Check what is installed and what works on this machine."),
    "validate": Entry(
        "Check", "checks:validate", "Compare the physics with closed forms, other programs and tank tests."
    ),
    "trial": Entry("Check", "checks:trial", "Run a manoeuvring trial of a boat as ITTC and IMO define it."),
    "bench": Entry("Check", "commands:bench", "Measure the speed of this machine against the budgets."),
    "serve": Entry("ROS", "ros:serve", "Serve a world to ROS, with VRX's topics and services."),
    "teleop": Entry("ROS", "ros:teleop", "Drive a boat of a served world."),
    "ros": Entry("ROS", "ros:app", "Write the packages that ROS 1 programs and roslaunch need."),
    "campaign": Entry("Learn", "campaign:campaign", "Sail controllers in many worlds, and compare their scores."),
    "worlds": Entry("Learn", "files:app", "Generate series of worlds from an axes file, as VRX's generator does."),
}  # fmt: skip


def overview() -> str:
    """Output of `vrx-mj` without arguments: six commands, and where the rest is."""
    width = max(map(len, FIRST.values()))
    rows = [f"  {example:<{width}}  {COMMANDS[name].summary}" for name, example in FIRST.items()]
    return "\n".join(
        [
            "vrx-mj simulates unmanned surface vessels on MuJoCo. Start with:",
            "",
            *rows,
            "",
            f"vrx-mj --help lists all {len(COMMANDS)} commands; vrx-mj COMMAND --help explains one.",
            "",
        ]
    )


@cache
def load_command(name: str) -> Command | Group:
    """The click command of a name, from its module."""
    entry = COMMANDS[name]
    found = resolve_name(f"vrx_mj.cli.{entry.home}")
    owner = Typer(rich_markup_mode=None)
    if isinstance(found, Typer):
        for each in found.registered_commands:
            each.cls = Command
        owner.add_typer(found, name=name, cls=Group, help=entry.summary, no_args_is_help=True)
    else:
        owner.command(name, cls=Command)(found)
    return cast(Command | Group, get_group(owner).commands[name])


class Program(Group):
    """`vrx-mj` itself: its commands are in `COMMANDS`, and none is loaded to list them."""

    def list_commands(self, _ctx: object) -> list[str]:
        """The names, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, _ctx: object, cmd_name: str) -> Command | Group | None:
        """A command; None where the name is unknown."""
        return load_command(cmd_name) if cmd_name in COMMANDS else None

    def format_commands(self, _ctx: Any, formatter: Any) -> None:
        """Write the commands in their groups."""
        width = max(map(len, COMMANDS))
        for panel, group in groupby(COMMANDS.items(), key=lambda item: item[1].panel):
            with formatter.section(f"{panel} ({PANELS[panel]})"):
                formatter.write_dl([(f"{name:{width}}", entry.summary) for name, entry in group])


def _print_version(wanted: bool) -> None:
    if not wanted:
        return
    import platform
    from importlib.metadata import PackageNotFoundError, version

    from vrx_mj import __version__

    parts = [f"Python {platform.python_version()}"]
    for name in ("numba", "mujoco"):
        try:
            parts.insert(0, f"{name} {version(name)}")
        except PackageNotFoundError:
            parts.insert(0, f"{name} not installed")
    echo(f"vrx-mj {__version__} ({', '.join(parts)})")
    raise Exit


def _program(
    ctx: Context,
    version: Annotated[
        bool,
        Option(
            "--version",
            help="Show the versions of vrx-mj and of what it runs on.",
            is_eager=True,
            callback=_print_version,
        ),
    ] = False,
) -> None:
    if ctx.invoked_subcommand is None:
        echo(overview(), nl=False)


app = Typer(
    name="vrx-mj",
    cls=Program,
    help=_ABOUT,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)
app.callback(invoke_without_command=True)(_program)


def main() -> None:
    """Run the command line; every error that a user can cause is one message, without a traceback."""
    warnings.showwarning = warn_once()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    with ended_by_signals() as came:
        code = _code(get_command(app), with_default_port(sys.argv[1:]))
    gc.freeze()  # at exit Python would search some 700,000 objects for garbage: 0.4 s
    raise SystemExit(128 + came[0] if came and code == _CTRL_C else code)


def _code(command: Any, words: list[str]) -> int:
    """Run a command line; its exit code."""
    try:
        code = copy_context().run(command.main, words, prog_name="vrx-mj", standalone_mode=False)
    except (VrxError, VrxWarning, MissingPackageError) as error:
        show_error(error.text(words[0]) if isinstance(error, ChoiceError) else f"{error}{list_hint(error)}")
        return 1 if isinstance(error, DivergedError) else 2
    except _UsageError as error:
        show_error(usage_message(error))
        return 2
    except BrokenPipeError:  # as in `| head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Python flushes at its end
        return 1
    except OSError as error:
        file = f" '{error.filename}'" if error.filename else ""
        show_error(f"a file{file} cannot be used: {error.strerror or error}")
        return 1
    except (KeyboardInterrupt, Abort):
        return _CTRL_C
    return code if isinstance(code, int) else 0


def list_hint(error: Exception) -> str:
    """The command that lists all names of a kind, if the message leaves some out."""
    if not isinstance(error, UnknownNameError) or not error.left_out:
        return ""
    if error.kind == "command":
        return "; vrx-mj --help explains them"
    from vrx_mj.config.kinds import KINDS

    kinds = {name: kind for kind, name in KINDS.items()}
    return f"; vrx-mj list {kinds[error.kind]} shows all" if error.kind in kinds else ""


def usage_message(error: Any) -> str:
    """The message about a wrong command line: one line, with an example or where to read on."""
    ctx = error.ctx
    path = ctx.command_path
    if hasattr(error, "possibilities"):  # an unknown option
        known = [name for each in ctx.command.get_params(ctx) for name in each.opts if name.startswith("--")]
        return str(UnknownNameError(f"option of {path}", error.option_name, sorted(known)))
    if hasattr(error, "param_type") and error.param is not None:  # something is missing
        shown = example(ctx.command.help)
        name = (
            error.param.opts[0]
            if error.param.param_type_name == "option"
            else error.param.metavar or error.param.name.upper()
        )
        return f"{path} needs {name}; {f'for example: {shown}' if shown else f'{path} --help explains it'}"
    message = " ".join(error.format_message().split()).rstrip(".")
    return f"{path}: {message[:1].lower()}{message[1:]}; {path} --help shows what it takes"
