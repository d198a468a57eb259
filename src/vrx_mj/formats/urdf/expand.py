"""xacro files expanded to URDF or SDF, and expressions of YAML and launch files, by `xacro`, without trusting them.

A xacro file is a program: its expressions are Python. `expansion` runs it, and this module finds its packages and
turns its errors into one `ConfigError` with the file, line and element. A file may reach files in its own folder, in
packages and in named folders.
"""

import os
import os.path
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, MutableMapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vrx_mj.config.search import (
    ALLOW,
    MISSING,
    allowed_folders,
    display,
    enclosing_packages,
    is_built_in,
    is_inside,
    near_names,
    package_above,
    package_name,
    packages_named,
    workspace_packages,
)
from vrx_mj.config.tree import Place
from vrx_mj.errors import ConfigError, UnknownNameError, VrxError, first_lines, first_names, shorten, warn
from vrx_mj.foreign import ReaderError, ask
from vrx_mj.formats.urdf.xml_document import Table, file_error, read_bytes, read_text
from vrx_mj.packages import root

OUTSIDE = f"outside the folder of the first file and of every package; {ALLOW}"
"""Reason why a file may not be read."""
_SHOWN_WARNINGS = 10
_SECONDS, _ANSWER = 3, 32 << 20
"""Limits of one expansion, or of all expressions of a file: processor time [s], and bytes of a text with places."""
_MOST_PACKAGES = 100
"""Packages that the files of one expansion may name."""
_MACRO = re.compile(r"<xacro:macro\s[^<>]{0,500}?\bname\s*=\s*[\"']([^\"'<>]{1,100})[\"']")
Arguments = Mapping[str, str]
"""Arguments of a launch file or of a xacro, by name."""
MACROS = root() / "assets" / "robots" / "wamv" / "vrx_gazebo" / "worlds" / "xacros" / "include_all_xacros.xacro"
"""The macros of VRX's worlds."""
LEFT_OUT = "/missing:/"
"""Beginning of a path in a package that is missing, where such are ignored."""
_FIND = re.compile(r"find\(\s*['\"]([\w.-]{1,200})['\"]\s*\)")
_FOUND = re.compile(r"\$\(find ([\w.-]{1,200})\)")


def own_packages() -> dict[str, Path]:
    """The packages among our robots: every folder with a `package.xml`, by the name it has there."""
    found = (file.parent for file in sorted((root() / "assets" / "robots").rglob("package.xml")))
    return {name: folder for folder in found if (name := package_name(folder))}


class Files:
    """Packages and folders that a file may reach.

    A package is first looked for in `packages` and above the file, then in `package_paths` and beside the file, then
    in the workspace of the file, at last in `spare`.
    """

    def __init__(
        self,
        file: Path,
        packages: MutableMapping[str, Path],
        package_paths: Iterable[Path],
        spare: Mapping[str, Path] | None = None,
    ) -> None:
        self.folder, self.target = file.absolute().parent, file.resolve().parent
        self.packages, self.around = packages, enclosing_packages(self.folder)
        self.order: Sequence[Mapping[str, Path]] = (self.packages, self.around)
        self.paths = [Path(path).absolute() for path in package_paths]
        self.spare = spare or {}

    @property
    def bases(self) -> list[Path]:
        """Folders below which may be read."""
        known = (folder for packages in (*self.order, self.spare) for folder in packages.values())
        return [self.folder, self.target, *known, *self.paths, *allowed_folders()]

    def near(self, name: str) -> list[Path]:
        """The package of this name that the file lies in, and that in its workspace."""
        return [
            found for found in (package_above(self.folder, name), workspace_packages(self.folder).get(name)) if found
        ]

    def package_folders(self, name: str) -> Iterator[Path]:
        """Folders that may be the package of this name."""
        return packages_named(name, self.folder, self.order, self.paths)

    def package(self, name: str) -> Path | None:
        """The folder of a package, readable from then on; None if no package has the name."""
        if not re.fullmatch(r"\w[\w.-]{0,199}", name):
            return None
        folder = next((each for each in self.package_folders(name) if each.is_dir() and not is_built_in(each)), None)
        if folder in self.near(name):
            self.packages[name] = folder
        return folder or self.spare.get(name)

    def readable_file(self, path: str) -> Path:
        """The path of a file that may be read, links followed."""
        try:
            found = Path(path).resolve()
        except (OSError, ValueError, RuntimeError):
            raise VrxError(f"'{path[:200]}' is not a path") from None
        shown = shorten(display(Path(path)))
        if not is_inside(found, *self.bases):
            raise VrxError(f"may not read '{shown}': {OUTSIDE}")
        if os.path.isfile(found):  # noqa: PTH113 - Path.is_file raises an OSError for a name that is too long
            return found
        there = os.path.lexists(path)
        raise VrxError(f"'{shown}' is not a file" if there else f"no file '{shown}'{near_names(Path(path))}")

    def known_packages(self) -> list[str]:
        """Names of packages that can be found."""
        beside = {folder.name for path in self.paths if path.is_dir() for folder in path.iterdir() if folder.is_dir()}
        return sorted({*self.packages, *self.around, *beside, *workspace_packages(self.folder), *self.spare})


@dataclass(frozen=True)
class Result:
    """Value of a text with expressions, or the reason why it has none."""

    value: bool | int | float | str | None = None
    problem: str = ""


@dataclass(frozen=True)
class Expansion:
    """Result of expanding a file."""

    text: str = ""
    files: tuple[str, ...] = ()
    """Absolute paths of the files that its elements come from."""
    places: tuple[tuple[int, int, int], ...] = ()
    """Where each element of the text comes from, in the order of the text: number of the file, line and column."""
    table: Table = ()
    """Elements of a world, with their places."""
    declared: tuple[str, ...] = ()
    """Arguments that the files declare."""
    warnings: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    """Includes and macros of missing packages, each with its place, where such are ignored."""
    missing: str | None = None
    """A package that the files name, and whose folder is needed: there is nothing else then."""


class ExpandedText(str):
    """Expanded text of a xacro file, which knows where its elements come from."""

    __slots__ = ("made",)
    made: Expansion


def expand(
    file: Path,
    *,
    arguments: Arguments | None = None,
    needed: Collection[str] = (),
    package_paths: Sequence[Path] = (),
    libraries: Collection[str] = (),
) -> ExpandedText:
    """The URDF that a `.xacro` file (or a `.urdf`, which has little to expand) makes, as XML text.

    `arguments` are the file's `$(arg NAME)`, of which it or the files in it must declare those that are `needed`.
    `$(find NAME)` looks in `package_paths` and beside the file; our own packages come last, but first in our own
    files, also where other files include them. Where missing packages are ignored, what files include from one
    and the macros that are unknown then are left out. A file may read only what lies there or in its own folder. Our
    own macros of worlds stand for those of `libraries`, packages of VRX. Warnings of xacro come as one VrxWarning.
    Raises ConfigError, or UnknownNameError for an argument.
    """
    made = _expand(Path(file), arguments or {}, package_paths, libraries)
    _warn(Path(file), made)
    if unknown := next((name for name in needed if name not in made.declared), None):
        raise UnknownNameError("xacro argument", unknown, sorted(made.declared))
    text = ExpandedText(made.text)
    text.made = made
    return text


def declared_names(file: Path, arguments: Arguments, package_paths: Sequence[Path] = ()) -> tuple[str, ...]:
    """Names of the arguments that a `.xacro` and the files in it declare, given some of them. Raises ConfigError."""
    return _expand(Path(file), arguments, package_paths).declared


def expanded_lines(lines: Sequence[tuple[str, Place]]) -> Table:
    """Elements that lines of xacro make by our own macros of worlds; each line has a place of its own.

    Raises:
        ConfigError: it cannot be expanded.
    """
    source = lines[0][1].file
    file, text = (source.folder or Path()) / Path(source.name).name, "\n".join(line for line, _ in lines)
    try:
        return _ask([], file, {}, {}, {}, [], MACROS, text, reads=[MACROS]).table
    except ConfigError as error:
        places = (lines[(problem.line or 1) - 1][1] for problem in error.problems)
        moved = (place.problem(one.key, one.message) for one, place in zip(error.problems, places, strict=True))
        raise ConfigError(moved) from None


def check_library(file: Path) -> None:
    """Raise ConfigError where a file, which makes no links, defines macros: it is there for other files."""
    names = list(dict.fromkeys(_MACRO.findall(read_bytes(file).decode("utf-8", "replace"))))
    if names:
        listed = first_names((f"'{name}'" for name in names), 8)
        message = f"only defines macros: {listed}; name the file that uses them"
        raise file_error(file, message, "robot")


def arguments(file: Path) -> dict[str, str]:
    """The arguments that a xacro file itself declares, with their defaults as written. Raises ConfigError."""
    name = display(Path(file))
    job = "formats.urdf.xml_document:table"
    table = ask(job, read_text(Path(file)), name, returns=Table, about=f"xacro {name}")
    found: dict[str, str] = {}
    for *_, tag, attributes, _ in table:
        if tag == "xacro:arg":
            found.setdefault(attributes.get("name", ""), attributes.get("default", ""))
    return found


def _expand(file: Path, arguments: Arguments, paths: Sequence[Path], libraries: Collection[str] = ()) -> Expansion:
    """Expand a file; a package that it names in another file, or by an expression, takes one more attempt."""
    if not file.is_file():
        raise file_error(file, "no such file")
    given = {str(name): str(value) for name, value in arguments.items()}
    ours = own_packages()
    of_ours = file.resolve().is_relative_to((root() / "assets").resolve()) or any(
        map(is_built_in, file.resolve().parents)
    )
    files = Files(file, dict(ours) if of_ours else {}, paths, spare=ours)
    names = _FOUND.findall(read_bytes(file).decode("utf-8", errors="replace"))
    found = {name: str(folder) for name in names[:_MOST_PACKAGES] if (folder := files.package(name)) is not None}
    macros, own = [MACROS] if libraries else [], {name: str(folder) for name, folder in files.spare.items()}

    def made_with(known: Sequence[str] | None) -> Expansion:
        arguments = (given, found, own, sorted(libraries), *macros)
        return _ask(known, file.absolute(), *arguments, reads=[*files.bases, *macros])

    for _ in range(_MOST_PACKAGES):
        made = made_with(None)
        name = made.missing
        folder = files.package(name) if name else None
        if name is None:
            return made
        if folder is None and os.environ.get(MISSING) != "ignore":
            break
        found[name] = str(folder or f"{LEFT_OUT}{name}")
    return made_with(files.known_packages())


def _ask(known: Sequence[str] | None, file: Path, *arguments: object, reads: Sequence[Path]) -> Expansion:
    job, about = "formats.urdf.expansion:expand", f"xacro {display(file)}"
    try:
        return ask(
            job, known, file, *arguments, returns=Expansion, about=about, reads=reads, seconds=_SECONDS, answer=_ANSWER
        )
    except ReaderError as error:
        raise file_error(file, error.reason) from None


def _warn(file: Path, made: Expansion) -> None:
    """One warning of all that xacro warns of, and one of what is left out."""
    for what, lines in (("xacro warns", made.warnings), ("not read, because packages are missing", made.left_out)):
        if lines:
            text = "\n".join([f"{display(file)}: {what}", *first_lines(lines, _SHOWN_WARNINGS)])
            warn(text, 3)


def evaluate(file: str, texts: Sequence[tuple[str, Mapping[str, float]]]) -> tuple[Result, ...]:
    """Evaluate texts with `${...}` of a file, each with names of its own.

    Expressions are Python's, with the functions of `math`, `radians` among them. Those of one file are worked out at
    once; if that takes too much, one by one up to the first that does, which is the problem of all that follow.
    """
    job, found = "formats.urdf.expansion:evaluate", list[Result]()
    try:
        return ask(job, texts, returns=tuple[Result, ...], about=file, seconds=_SECONDS) if texts else ()
    except ReaderError as error:
        if len(texts) == 1:
            return (Result(problem=error.reason),)
        failed = Result(problem=error.reason)
    while len(found) < len(texts) and failed not in found:
        found += evaluate(file, [texts[len(found)]])
    return (*found, *[failed] * (len(texts) - len(found)))


def evaluate_argument(expression: str, arguments: Arguments, find: Callable[[str], str], folder: Path) -> str:
    """Return what `$(eval ...)` of a launch file in a folder comes to; `find` gives folders of packages.

    Raises:
        VrxError: the expression is wrong.
    """
    job, packages = "formats.urdf.expansion:evaluate_argument", {name: find(name) for name in _FIND.findall(expression)}
    given = expression, arguments, packages, folder
    return ask(job, *given, returns=str, about="the expression", seconds=_SECONDS)
