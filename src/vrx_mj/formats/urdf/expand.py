"""xacro files expanded to URDF, without trusting them.

A xacro file is a program: its expressions are Python. Ours are worked out by an evaluator that knows numbers, texts and
lists (`expressions`), files are read from the robot's own folder and from packages only, and work and sizes are
limited. An error in a file is one `ConfigError` with the file, line and element.
"""

import re
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar
from xml.dom import minidom

from vrx_mj.config.search import display
from vrx_mj.config.tree import Place
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxWarning
from vrx_mj.formats.urdf.expression_values import Budget, ExpressionError
from vrx_mj.formats.urdf.xacro_document import FileError, parse_document, place_of, written
from vrx_mj.formats.urdf.xacro_engine import Engine
from vrx_mj.formats.urdf.xacro_files import Files, own_packages, read_bytes
from vrx_mj.resources import root

ResultT = TypeVar("ResultT")

_SHOWN_WARNINGS = 10
_SHOWN_CALLERS = 3
_MACRO = re.compile(r"<xacro:macro\s[^<>]{0,500}?\bname\s*=\s*[\"']([^\"'<>]{1,100})[\"']")


def expand(
    file: Path,
    *,
    arguments: Mapping[str, str] | None = None,
    needed: Collection[str] = (),
    packages: Mapping[str, Path] | None = None,
    package_paths: Sequence[Path] = (),
) -> str:
    """The URDF that a `.xacro` file (or a `.urdf`, which has little to expand) makes, as XML text.

    `arguments` are the file's `$(arg NAME)`, of which it or the files in it must declare those that are `needed`.
    `$(find NAME)` looks in `packages`, in `package_paths` and beside the file; without `packages`, our own come last,
    and for our own files first. A file may read only what lies there or in its own folder. Warnings of xacro come as
    one VrxWarning. Raises ConfigError, or UnknownNameError for an argument.
    """
    file = Path(file)
    engine = _engine(file, arguments or {}, packages, package_paths)
    text = _expanded(file, engine, written)
    if unknown := next((name for name in needed if name not in engine.declared), None):
        raise UnknownNameError("xacro argument", unknown, sorted(engine.declared))
    return text


def declared(file: Path, arguments: Mapping[str, str], package_paths: Sequence[Path] = ()) -> tuple[str, ...]:
    """Names of the arguments that a `.xacro` and the files in it declare, given some of them. Raises ConfigError."""
    engine = _engine(Path(file), arguments, None, package_paths)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)  # who builds the robot has them
        _expanded(Path(file), engine, lambda _: None)
    return tuple(engine.declared)


def expanded_document(
    file: Path,
    *,
    arguments: Mapping[str, str] | None = None,
    package_paths: Sequence[Path] = (),
    libraries: Collection[str] = (),
) -> minidom.Document:
    """The document that a `.xacro` file makes; its elements know their places (`xacro_document.place_of`).

    What the packages `libraries` define is left as it is called where they are missing. Raises ConfigError.
    """
    file = Path(file)
    engine = _engine(file, arguments or {}, None, package_paths, libraries)
    return _expanded(file, engine, lambda document: document)


def _expanded(file: Path, engine: Engine, result: Callable[[minidom.Document], ResultT]) -> ResultT:
    try:
        made = result(engine.expand(file))
    except Exception as error:
        raise ConfigError([_problem(error, engine, file)]) from None
    if engine.warnings:
        warnings.warn(_warning(file, list(engine.warnings)), VrxWarning, stacklevel=3)
    return made


def check_library(file: Path) -> None:
    """Raise ConfigError where a file, which makes no links, defines macros: it is there for other files."""
    names = list(dict.fromkeys(_MACRO.findall(read_bytes(file).decode("utf-8", "replace"))))
    if names:
        listed = ", ".join(f"'{name}'" for name in names[:8]) + (f" and {len(names) - 8} more" if names[8:] else "")
        message = f"has no links, only macros: {listed}; name the file that calls them"
        raise ConfigError([Problem(display(file), None, None, "robot", message)])


def arguments(file: Path) -> dict[str, str]:
    """The arguments that a xacro file itself declares, with their defaults as written. Raises ConfigError."""
    file = Path(file)
    try:
        document = parse_document(read_bytes(file), display(file), file.parent, Budget())
    except FileError as error:
        place = error.place
        raise ConfigError([Problem(place.file.name, place.line, place.column, error.key, str(error))]) from None
    except ExpressionError as error:
        raise ConfigError([Problem(display(file), None, None, "", str(error))]) from None
    found: dict[str, str] = {}
    for node in document.getElementsByTagName("xacro:arg"):
        found.setdefault(str(node.getAttribute("name")), str(node.getAttribute("default")))
    return found


def _engine(
    file: Path,
    arguments: Mapping[str, str],
    packages: Mapping[str, Path] | None,
    paths: Sequence[Path],
    libraries: Collection[str] = (),
) -> Engine:
    """An engine made ready for a file that exists."""
    if not file.is_file():
        raise ConfigError([Problem(display(file), None, None, "", "no such file")])
    given = {str(name): str(value) for name, value in arguments.items()}
    ours = own_packages() if packages is None else {}
    first = ours if file.resolve().is_relative_to((root() / "assets").resolve()) else packages or {}
    return Engine(Files(file, first, paths, spare=ours), given, Budget(), libraries)


def _warning(file: Path, said: list[str]) -> str:
    rest = len(said) - _SHOWN_WARNINGS
    more = [f"and {rest} more"] if rest > 0 else []
    return "\n".join([f"{display(file)}: xacro warns", *said[:_SHOWN_WARNINGS], *more])


def _problem(error: BaseException, engine: Engine, file: Path) -> Problem:
    """The problem that stopped an expansion."""
    if isinstance(error, FileError):
        return _placed(error.place, error.key, str(error))
    message = _message(error)
    if engine.expression:
        message = f"{engine.expression[:200]}: {message}"
    if engine.texts:
        place, tag = engine.texts[-1].place, engine.texts[-1].tag
    elif engine.element is not None and place_of(engine.element):
        place, tag = place_of(engine.element), engine.element.tagName
    else:
        return Problem(display(file), None, None, "", message)
    return _placed(_pointed(place, engine.expression), f"<{tag}>", message + _callers(engine))


def _placed(place: Place, key: str, message: str) -> Problem:
    return Problem(place.file.name, place.line, place.column, key, message)


def _message(error: BaseException) -> str:
    text = str(error)
    if isinstance(error, ExpressionError | FileNotFoundError):
        return text
    if isinstance(error, RecursionError | MemoryError):
        return "nested too deeply: does something refer to itself?"
    return f"cannot be expanded: {text.splitlines()[0] if text else type(error).__name__}"[:300]


def _pointed(place: Place, expression: str) -> Place:
    """The place of an expression, looked for from the element it is in."""
    start = (place.line or 1) - 1
    for number, line in enumerate(place.file.lines[start : start + 40], start + 1):
        column = line.find(expression, (place.column or 1) - 1 if number == place.line else 0)
        if expression and column >= 0:
            return Place(place.file, number, column + 1)
    return place


def _callers(engine: Engine) -> str:
    """Which macros led here, the innermost first."""
    inside: list[Any] = list(reversed(engine.calls))
    if engine.element is not None and inside and place_of(engine.element) == inside[0][1]:
        inside = inside[1:]
    calls = dict.fromkeys(f"in macro '{name}' called at {place.file.name}:{place.line}" for name, place in inside)
    return f" ({', '.join(list(calls)[:_SHOWN_CALLERS])})" if calls else ""
