"""Substitutions in xacro files: `$(find pkg)`, `$(arg name)`, `$(eval ...)` and so on; the environment stays closed."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from vrx_mj.config.urdf.expression_values import GLOBALS, Budget, ExpressionError, Function
from vrx_mj.config.urdf.expressions import Names, evaluate, unknown
from vrx_mj.config.urdf.xacro_files import Files
from vrx_mj.errors import nearest

__all__ = ["Substitutions"]

_ONE_WORD = ("find", "arg", "anon", "env")


class Substitutions:
    """What `$(...)` means in one expansion."""

    def __init__(self, files: Files, arguments: dict[str, str], budget: Budget) -> None:
        self.files = files
        self.arguments = arguments
        """Those given and those that the files declared so far."""
        self.budget = budget

    def resolve(self, text: str, folder: Path) -> str:
        """The text that stands for `$(text)` in a file in `folder`."""
        command, *words = text.split() or [""]
        if command == "eval":
            return str(self._evaluated(text.strip()[len("eval") :], folder))
        if command not in _COMMANDS:
            close = nearest(command, _COMMANDS)
            hint = f"did you mean '{close}'?" if close else f"known: {', '.join(_COMMANDS)}, eval"
            raise ExpressionError(f"no substitution named '{command}'; {hint}")
        if command in _ONE_WORD and len(words) != 1:
            raise ExpressionError(f"takes one name, $({command} NAME), got {len(words)}")
        return _COMMANDS[command](self, words, folder)

    def argument(self, name: str) -> str:
        """The value of an argument."""
        if name not in self.arguments:
            beside = f"; or give it in the YAML beside the file: `arguments: {{{name}: ...}}`"
            raise ExpressionError(
                f"{unknown('argument', name, self.arguments)}{'' if nearest(name, self.arguments) else beside}"
            )
        return self.arguments[name]

    def find(self, name: str) -> str:
        """The folder of a package."""
        return str(self.files.find_package(name))

    def _evaluated(self, expression: str, folder: Path) -> Any:
        table: dict[str, Any] = {
            **{name: _typed(value) for name, value in self.arguments.items()},
            **GLOBALS,
            "true": True,
            "false": False,
            "arg": Function("arg", lambda name: _typed(self.argument(name))),
            "find": Function("find", self.find),
            "dirname": Function("dirname", lambda: str(folder)),
            "env": Function("env", _closed),
            "optenv": Function("optenv", lambda _name, default="": default),
        }
        try:
            return evaluate(expression, Names(table, lambda: self.arguments), self.budget)
        except ExpressionError as error:
            if "(" not in expression or not str(error).startswith("is not an expression"):
                raise
            hint = "$(eval) ends at the first ')'; write ${...}, with xacro.arg('NAME')"
            raise ExpressionError(f"is not an expression: {hint}") from None


def _closed(name: str) -> str:
    raise ExpressionError(
        f"robot files cannot see environment variable '{name}'; declare an argument and use $(arg {name})"
    )


def _default(words: list[str]) -> str:
    if not words:
        raise ExpressionError("takes a name and a default: $(optenv NAME DEFAULT)")
    return " ".join(words[1:])


def _typed(value: str) -> Any:
    """An argument as `$(eval)` sees it: a number, true or false, or text."""
    for read in (int, float):
        try:
            return read(value)
        except ValueError:
            continue
    return {"true": True, "false": False}.get(value.lower(), value)


_COMMANDS: dict[str, Callable[[Substitutions, list[str], Path], str]] = {
    "find": lambda here, words, _: here.find(words[0]),
    "arg": lambda here, words, _: here.argument(words[0]),
    "dirname": lambda _, __, folder: str(folder),
    "cwd": lambda *_: str(Path.cwd()),
    "env": lambda _, words, __: _closed(words[0]),
    "optenv": lambda _, words, __: _default(words),
    "anon": lambda _, words, __: f"{words[0]}_anonymous",
}
