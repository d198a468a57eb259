"""What a xacro file may reach: files in its own folder, in packages and in named folders; and substitutions.

Substitutions are `$(find pkg)`, `$(arg name)`, `$(eval ...)` and so on; the environment stays closed.
"""

import os.path
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from vrx_mj.config.search import (
    display,
    enclosing_packages,
    is_built_in,
    package_above,
    package_name,
    workspace_packages,
)
from vrx_mj.errors import UnknownNameError, nearest, shortened
from vrx_mj.formats.urdf.expression_values import GLOBALS, Budget, ExpressionError, Function
from vrx_mj.formats.urdf.expressions import Names, evaluate, unknown
from vrx_mj.resources import root


def own_packages() -> dict[str, Path]:
    """The packages among our robots: every folder with a `package.xml`, by the name it has there."""
    found = (file.parent for file in sorted((root() / "assets" / "robots").rglob("package.xml")))
    return {name: folder for folder in found if (name := package_name(folder))}


class Files:
    """What one expansion may read.

    A package is first looked for in `packages` and above the file, then in `package_paths` and beside the file, then
    in the workspace of the file, at last in `spare`.
    """

    def __init__(
        self,
        file: Path,
        packages: Mapping[str, Path],
        package_paths: Sequence[Path],
        spare: Mapping[str, Path] | None = None,
    ) -> None:
        self.folder = file.absolute().parent
        self.paths = [Path(path).absolute() for path in package_paths]
        self.packages = {
            **enclosing_packages(self.folder),
            **{name: Path(folder).absolute() for name, folder in packages.items()},
        }
        self.spare = {name: Path(folder).absolute() for name, folder in (spare or {}).items()}
        folders = (self.folder, file.resolve().parent, *self.packages.values(), *self.paths, *self.spare.values())
        self.roots = [folder.resolve() for folder in folders]

    def has_package(self, name: str) -> bool:
        """Whether the folder of a package is known."""
        return self.package(name) is not None

    def package(self, name: str) -> Path | None:
        """The folder of a package, which may be read from then on; None: there is none of this name."""
        found = self.packages.get(name) if _is_name(name) else None
        if found is None and _is_name(name):
            candidates = (folder for folder in self._candidates(name) if folder.is_dir() and not is_built_in(folder))
            found = next(candidates, None) or self._above(name) or self._in_workspace(name)
        return self.spare.get(name) if found is None or is_built_in(found) else found

    def allowed(self, path: str) -> Path:
        """The path of a file that may be read, links followed."""
        try:
            found = Path(path).resolve()
        except (OSError, ValueError, RuntimeError):
            raise ExpressionError(f"'{path[:200]}' is not a path") from None
        if not any(found.is_relative_to(folder) for folder in self.roots):
            raise ExpressionError(
                f"may not read '{_shown(path)}': it is neither in the folder of the first file nor in a package; "
                "add its folder to the package paths"
            )
        if not os.path.isfile(found):  # noqa: PTH113 - Path.is_file raises an OSError for a name that is too long
            raise FileNotFoundError(_missing(path))
        return found

    def _candidates(self, name: str) -> Iterator[Path]:
        for path in self.paths:
            yield path / name
            if path.name == name or package_name(path) == name:
                yield path
        yield self.folder / name

    def _above(self, name: str) -> Path | None:
        """The folder of that name in which the file lies, which may be read from then on."""
        found = package_above(self.folder, name)
        if found is not None:
            self.roots.append(found.resolve())
        return found

    def _in_workspace(self, name: str) -> Path | None:
        """The package of that name in the workspace of the file, which may be read from then on."""
        found = workspace_packages(self.folder).get(name)
        if found is not None:
            self.packages[name] = found
            self.roots.append(found.resolve())
        return found

    def known(self) -> list[str]:
        """Names of packages that can be found."""
        beside = {folder.name for path in self.paths if path.is_dir() for folder in path.iterdir() if folder.is_dir()}
        return sorted({*self.packages, *beside, *workspace_packages(self.folder), *self.spare})


def _is_name(name: str) -> bool:
    return re.fullmatch(r"\w[\w.-]{0,199}", name) is not None


def _missing(path: str) -> str:
    if os.path.lexists(path):
        return f"'{_shown(path)}' is not a file"
    folder = Path(path).parent
    try:
        names = [entry.name for entry in folder.iterdir()][:1000]
    except (OSError, ValueError):
        return f"no file '{_shown(path)}': no such folder {display(folder)}"
    close = nearest(Path(path).name, names)
    return f"no file '{shortened(Path(path).name)}' in {display(folder)}" + (
        f"; did you mean '{close}'?" if close else ""
    )


def _shown(path: str) -> str:
    return display(Path(path))[:200]


_ONE_WORD = ("find", "arg", "anon", "env")


class Substitutions:
    """What `$(...)` means in one expansion."""

    def __init__(self, files: Files, arguments: dict[str, str], budget: Budget) -> None:
        self.files = files
        self.arguments = arguments
        """Those given and those that the files declared so far."""
        self.budget = budget

    def resolve(self, text: str, folder: Path) -> str:
        """The value of `$(text)` in a file in `folder`."""
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
        found = self.files.package(name)
        if found is None:
            words = str(UnknownNameError("package", name, self.files.known()))
            raise ExpressionError(f"{words} (or add its folder to the package paths)")
        return str(found)

    def _evaluated(self, expression: str, folder: Path) -> object:
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
    raise ExpressionError(f"files cannot see environment variable '{name}'; declare an argument and use $(arg {name})")


def _default(words: list[str]) -> str:
    if not words:
        raise ExpressionError("takes a name and a default: $(optenv NAME DEFAULT)")
    return " ".join(words[1:])


def _typed(value: str) -> float | str:
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
