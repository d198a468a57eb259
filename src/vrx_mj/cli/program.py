"""The program: finds the command of a command line, and puts what went wrong into one line.

Exit codes: 0 done, 1 a run failed or was cut short, 2 wrong input, 130 Ctrl-C and 143 SIGTERM before it began.
"""

import os
import sys
import warnings
from collections.abc import Iterator, MutableMapping
from importlib import import_module
from itertools import groupby
from typing import Annotated, Any

import typer

from vrx_mj.cli.arguments import with_default_port
from vrx_mj.cli.help import Command, Group, UsageError, example
from vrx_mj.cli.index import COMMANDS, PANELS, overview
from vrx_mj.cli.screen import show_error, warn_once
from vrx_mj.errors import DivergedError, UnknownNameError, VrxError
from vrx_mj.signals import ended_by_signals

__all__ = ["app", "main"]

ABOUT = (
    "Simulates unmanned surface vessels on MuJoCo: the worlds, boats and conventions of VRX, without ROS and Gazebo."
)
CTRL_C = 130
"""Exit code of what Ctrl-C ended before there was something to keep, as shells have it."""


class Commands(MutableMapping[str, Any]):
    """The commands by name, each loaded when it is asked for."""

    def __init__(self) -> None:
        self._loaded: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            self._loaded[name] = loaded(name)
        return self._loaded[name]

    def __setitem__(self, name: str, command: object) -> None:
        self._loaded[name] = command

    def __delitem__(self, name: str) -> None:
        del self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)

    def __contains__(self, name: object) -> bool:
        return name in COMMANDS


def loaded(name: str) -> Any:
    """The click command of a name, from its module."""
    module, _, attribute = COMMANDS[name].home.partition(":")
    found = getattr(import_module(f"vrx_mj.cli.{module}"), attribute)
    if isinstance(found, typer.Typer):
        found.info.cls = Group
        for each in found.registered_commands:
            each.cls = Command
        return typer.main.get_command(found)
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    alone.command(name, cls=Command)(found)
    return typer.main.get_command(alone)


class Program(Group):
    """`vrx-mj` itself: its commands are in `COMMANDS`, and none is loaded to list them."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{**options, "commands": {}})
        self.commands: MutableMapping[str, Any] = Commands()

    def list_commands(self, _ctx: object) -> list[str]:
        """The names, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, _ctx: object, cmd_name: str) -> Any:
        """A command; None where the name is unknown."""
        return self.commands[cmd_name] if cmd_name in COMMANDS else None

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

    from vrx_mj import __version__

    parts = (f"{name} {_installed(name)}" for name in ("mujoco", "numba"))
    typer.echo(f"vrx-mj {__version__} ({', '.join(parts)}, Python {platform.python_version()})")
    raise typer.Exit


def _installed(package: str) -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _program(
    ctx: typer.Context,
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            help="Show the versions of vrx-mj and of what it runs on.",
            is_eager=True,
            callback=_print_version,
        ),
    ] = False,
) -> None:
    if ctx.invoked_subcommand is None:
        typer.echo(overview(), nl=False)


app = typer.Typer(
    name="vrx-mj",
    cls=Program,
    help=ABOUT,
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
        code = _code(typer.main.get_command(app), with_default_port(sys.argv[1:]))
    raise SystemExit(128 + came[0] if came and code == CTRL_C else code)


def _code(command: Any, words: list[str]) -> int:
    """Run a command line; its exit code."""
    try:
        code = command.main(words, prog_name="vrx-mj", standalone_mode=False)
    except VrxError as error:
        show_error(f"{error}{list_hint(error)}")
        return 1 if isinstance(error, DivergedError) else 2
    except UsageError as error:
        show_error(usage_message(error))
        return 2
    except BrokenPipeError:  # as in `| head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Python flushes at its end
        return 1
    except OSError as error:
        file = f" '{error.filename}'" if error.filename else ""
        show_error(f"a file{file} cannot be used: {error.strerror or error}")
        return 1
    except (KeyboardInterrupt, typer.Abort):
        return CTRL_C
    return code if isinstance(code, int) else 0


def list_hint(error: VrxError) -> str:
    """Where all names of a kind are listed, if the message leaves some out."""
    if not isinstance(error, UnknownNameError) or not error.left_out:
        return ""
    if error.kind == "command":
        return "; vrx-mj --help explains them"
    from vrx_mj.config.search import KINDS

    kinds = {name: kind for kind, name in KINDS.items()}
    return f"; vrx-mj list {kinds[error.kind]} shows all" if error.kind in kinds else ""


def usage_message(error: Any) -> str:
    """What is wrong with a command line, in one line, with an example or where to read on."""
    ctx = error.ctx
    path = ctx.command_path
    if hasattr(error, "possibilities"):  # an unknown option
        known = [name for each in ctx.command.get_params(ctx) for name in each.opts if name.startswith("--")]
        return str(UnknownNameError(f"option of {path}", error.option_name, sorted(known)))
    if hasattr(error, "param_type") and error.param is not None:  # something is missing
        shown = example(ctx.command)
        name = (
            error.param.opts[0]
            if error.param.param_type_name == "option"
            else error.param.metavar or error.param.name.upper()
        )
        return f"{path} needs {name}; {f'for example: {shown}' if shown else f'{path} --help explains it'}"
    message = " ".join(error.format_message().split()).rstrip(".")
    return f"{path}: {message[:1].lower()}{message[1:]}; {path} --help shows what it takes"
