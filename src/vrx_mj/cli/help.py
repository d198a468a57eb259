"""Commands as typer makes them, with plain help pages, which need no rich, and with our conversion of words."""

import inspect
import os
import re
import sys
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from vrx_mj.cli.arguments import convert_lightly
from vrx_mj.errors import UnknownNameError

__all__ = ["Command", "Group", "UsageError", "description", "example"]

UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""What typer raises for a command line that no command takes; it exports the subclass alone."""
EXAMPLE = "Example: "
HEADING = re.compile(r"^\S.*:$", re.MULTILINE)


def description(command: Any) -> list[str]:
    """The paragraphs of a command's help, each in one line, without its example."""
    text = inspect.cleandoc(command.help or "")
    paragraphs = (" ".join(paragraph.split()) for paragraph in text.split("\n\n"))
    return [paragraph for paragraph in paragraphs if not paragraph.startswith(EXAMPLE)]


def example(command: Any) -> str | None:
    """The example in a command's help; None without one."""
    lines = (line.strip() for line in (command.help or "").splitlines())
    return next((line.removeprefix(EXAMPLE) for line in lines if line.startswith(EXAMPLE)), None)


class _Light:
    """What a command and a group have in common."""

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
        return str(page) if plain else HEADING.sub("\x1b[1m\\g<0>\x1b[0m", page)

    def parse_args(self, ctx: object, args: list[str]) -> Any:
        """Take the arguments; an error names the command in its context."""
        try:
            return super().parse_args(ctx, args)  # type: ignore[misc]
        except UsageError as error:
            error.ctx = error.ctx or ctx  # type: ignore[attr-defined]
            raise

    def format_help_text(self, ctx: Any, formatter: Any) -> None:
        """Write what the command does, then its example, which is not wrapped: it can be copied."""
        for paragraph in description(self):
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(paragraph)
        shown = example(self)
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
            typer.echo(ctx.get_help())
            raise typer.Exit
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a line for each subcommand."""
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, description(self.get_command(ctx, name))[0]) for name in self.list_commands(ctx)]
            )

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
