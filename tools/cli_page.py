"""Write docs/cli.md, the page of all commands, from the commands themselves: python tools/cli_page.py."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from vrx_mj.cli.program import COMMANDS, FIRST, PANELS, description, example, load_command

PAGE = Path(__file__).resolve().parents[1] / "docs" / "cli.md"
HEAD = """\
# Commands

<!-- Written by tools/cli_page.py from the commands themselves: change their help, then run it again. -->

`vrx-mj` without arguments shows the six commands to start with, `vrx-mj --help` all of them, and
`vrx-mj COMMAND --help` one. `vrx-mj --version` shows the versions of vrx_mj, MuJoCo, numba and Python.

| exit code | meaning |
|---|---|
| 0 | done |
| 1 | a run failed or was cut short, or a check found a difference |
| 2 | invalid input: one message says what is wrong and what to do |
| 130, 143 | Ctrl-C, SIGTERM, before there was something to keep |

Results go to stdout, messages to stderr. Work of more than ten seconds shows a bar with the time left in a terminal,
and a line every ten seconds elsewhere. SIGTERM and SIGHUP end a command as Ctrl-C does: recordings and bags are closed
first. A background job of a shell script ignores Ctrl-C (SIGINT); end it with `kill PID`."""
TYPES = {str: "text", int: "integer", float: "number", Path: "path"}


def page() -> str:
    """The whole page."""
    blocks = [HEAD, "## Start", table(("command", ""), [(f"`{FIRST[n]}`", cell(COMMANDS[n].summary)) for n in FIRST])]
    for panel, note in PANELS.items():
        blocks += [f"## {panel}: {note}"]
        for name, entry in COMMANDS.items():
            if entry.panel == panel:
                blocks += section(f"vrx-mj {name}", load_command(name), "###")
    return "\n\n".join(blocks) + "\n"


def section(words: str, command: Any, level: str) -> Iterator[str]:
    """The section of a command, and those of its subcommands."""
    yield f"{level} {words}"
    yield from map(cell, description(command.help))
    if example(command.help) is not None:
        yield f"```bash\n{example(command.help)}\n```"
    rows = [row(parameter) for parameter in command.params if not getattr(parameter, "hidden", False)]
    if rows:
        yield table(("argument or option", "type", "default", "meaning"), rows)
    for name, child in getattr(command, "commands", {}).items():
        yield from section(f"{words} {name}", child, f"{level}#")


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A table in Markdown."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def row(parameter: Any) -> tuple[str, ...]:
    """The row of an argument or option."""
    is_option = parameter.param_type_name == "option"
    names = parameter.opts if is_option else [(parameter.metavar or parameter.name).upper()]
    names = [*names, *parameter.secondary_opts] if is_option else names
    named = ", ".join(f"`{name}`" for name in names)
    return named, cell(type_name(parameter)), cell(default(parameter)), cell(parameter.help)


def type_name(parameter: Any) -> str:
    """What is given as a value."""
    annotation = parameter.type_descriptor.annotation
    if get_origin(annotation) is list:
        return f"{TYPES[get_args(annotation)[0]]}, several"
    if annotation is bool:
        return "flag"
    if get_origin(annotation) is Literal:
        return " or ".join(get_args(annotation))
    return TYPES[annotation]


def default(parameter: Any) -> str:
    """What holds where the parameter is not given."""
    if parameter.required:
        return "required"
    value = parameter.default
    if isinstance(value, bool) or value is None:
        return "on" if value else ""
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


def cell(text: str | None) -> str:
    """Text as Markdown shows it, in a table too."""
    escaped = (text or "").replace("|", "\\|").replace("<", "&lt;")
    return escaped if "`" in escaped else escaped.replace("*", "\\*")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8", newline="\n")
    print(f"{PAGE}: written")
