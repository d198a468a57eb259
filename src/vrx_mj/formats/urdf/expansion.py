"""The package `xacro` at work on one file, whose expressions are Python: a job for the sandboxed process.

The package is driven from outside: its elements know their places, it reads files and finds packages through here,
and its warnings and errors are gathered with the element, the expression and the macro calls that led to them.
"""

import io
import os.path
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any
from xml.dom import minidom

import xacro
import yaml
from xacro import substitution_args

from vrx_mj.config.search import ReadingError, display, near_names, read_limited
from vrx_mj.config.tree import File, Place
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxError, nearest
from vrx_mj.formats.urdf.expand import LEFT_OUT, OUTSIDE, Expansion, Result
from vrx_mj.formats.urdf.model import Place as Spot
from vrx_mj.formats.urdf.xml_document import MAX_BYTES, decode, markup, parse_xml, table_of

_NAME = re.compile(r"[A-Za-z_\u00c0-\ufffd][-.\w\u00b7]*(:[A-Za-z_\u00c0-\ufffd][-.\w\u00b7]*)?")
_IN_PACKAGE = re.compile(r"\s*\$\(find (\w{1,200})\)/")
"""Beginning of the name of a file in a package."""
_UNDEFINED = re.compile("name '(.*)' is not defined")
_SHOWN_CALLERS = 3
_MAX_MESSAGE = 300
"""Longest message, and longest expression in it [characters]."""


class ElementText(str):
    """Text of a file that has something to expand, with the element it is in."""

    __slots__ = ("place", "tag")

    place: Place
    tag: str

    @classmethod
    def at(cls, text: str, element: minidom.Element) -> "ElementText":
        """The text of an element's attribute, or in the element."""
        located = cls(text)
        located.place, located.tag = _place_of(element), element.tagName
        return located


def _place_of(element: minidom.Element) -> Place:
    """The place of an element, or of what it was copied from."""
    place = element.getUserData("place")
    assert isinstance(place, Place), "elements without one are made by no file"
    return place


class Copier:
    """Handler of minidom that gives a copied element its original's place."""

    def handle(self, operation: int, key: str, data: Place, src: minidom.Node, dst: minidom.Node) -> None:
        """Called by minidom."""
        dst.setUserData(key, data, self)


class _Dom:
    """A document being built, whose elements know their places, and whose texts with a '$' are `ElementText`."""

    def __init__(self, file: File, copied: object, here: Callable[[], Spot]) -> None:
        self.file, self.copied, self.here = file, copied, here
        self.document: Any = minidom.Document()
        self.node: Any = self.document
        self.make_text = self.document.createTextNode

    def start(self, tag: str, attributes: Mapping[str, str]) -> None:
        made, spot = self.document.createElement(tag), self.here()
        made.setUserData("place", Place(self.file, spot.line, spot.column), self.copied)
        for name, value in attributes.items():  # one of a prefix is another than that without
            made.setAttributeNS(
                name.rpartition(":")[0] or None, name, ElementText.at(value, made) if "$" in value else value
            )
        self.node = self.node.appendChild(made)

    def end(self, _: str) -> None:
        self.node = self.node.parentNode

    def data(self, text: str) -> None:
        self.add(self.make_text, text)

    def comment(self, text: str) -> None:
        self.add(self.document.createComment, text)

    def start_literal(self) -> None:
        self.make_text = self.document.createCDATASection

    def end_literal(self) -> None:
        self.make_text = self.document.createTextNode

    def add(self, make: Callable[[str], minidom.Text | minidom.Comment], text: str) -> None:
        self.node.appendChild(
            make(ElementText.at(text, self.node) if "$" in text and self.node is not self.document else text)
        )


class UnknownPackageError(Exception):
    """A package whose folder was not given."""


def expand(known: Sequence[str] | None, *given: Any) -> Expansion:
    """Expand a xacro file as `Expander` has it, which `given` makes.

    Without `known`, names of all packages that there are, one that is not found is no error yet. It changes the
    package `xacro`: it is for a process of its own.

    Raises:
        ConfigError: the file cannot be expanded.
    """
    return Expander(*given).result(known)


def evaluate(texts: Sequence[tuple[str, Mapping[str, float]]]) -> tuple[Result, ...]:
    """Values of texts with `${...}`, each with names of its own; others are those of `math` and functions of Python."""
    package: Any = xacro
    package.warning = package.error = package.message = package.print_location = _nothing
    symbols = _symbols()
    return tuple(_result(text, {**symbols["python"], **symbols, **names}) for text, names in texts)


def _result(text: str, names: Mapping[str, object]) -> Result:
    try:
        value = xacro.eval_text(text, xacro.Table(dict(names)))
    except Exception as error:
        return Result(problem=_message(_cause(error), _Trail(error)))
    if value is None or isinstance(value, bool | int | float | str):
        return Result(value)
    return Result(problem=f"evaluates to a {type(value).__name__}, not a number or text")


def evaluate_argument(expression: str, arguments: Mapping[str, str], packages: Mapping[str, str], folder: str) -> str:
    """Value of `$(eval ...)` in a launch file in a folder. Raises VrxError."""
    inner: Any = substitution_args
    inner._eval_dict["find"] = lambda name: _package_folder(name, packages)
    try:
        return str(inner._eval(expression, {"arg": _Arguments(arguments), "filename": f"{folder}/"}))
    except Exception as error:
        raise VrxError(_message(error, _Trail(error))) from None


def _package_folder(name: str, packages: Mapping[str, str]) -> str:
    if name not in packages:
        raise UnknownNameError("package", name, packages)
    return packages[name]


class _Arguments(dict[str, str]):
    """Arguments by name; the package looks for a name in them where a file declares it."""

    def __init__(self, given: Mapping[str, str]) -> None:
        super().__init__(given)
        self.declared: dict[str, None] = {}

    def __contains__(self, name: object) -> bool:
        self.declared[str(name)] = None
        return super().__contains__(name)

    def __missing__(self, name: str) -> str:
        raise UnknownArgumentError(name, list(self))


class UnknownArgumentError(KeyError):
    """An argument by a name, and the names that there are."""


@dataclass
class Expander:
    """Expander of one file, which puts itself in the place of what the package reads, finds and prints with."""

    file: str
    """Absolute path."""
    given: Mapping[str, str]
    """Arguments by name."""
    packages: Mapping[str, str]
    """Folders of packages by name."""
    own: Mapping[str, str] = field(default_factory=dict)
    """Packages that are found first in a file in one of their folders."""
    libraries: Sequence[str] = ()
    """Packages whose macros those of `macros` stand for; their files may be missing."""
    macros: str = ""
    """Path of a file: what its macros, and those of `own` packages, make in other files has the place of its call."""
    text: str = ""
    """Content of `file`, where that is not to be read."""
    calls: list[Place] = field(default_factory=list)
    """Where the macros being expanded are called."""
    warnings: dict[str, None] = field(default_factory=dict)
    left_out: dict[str, None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.arguments = _Arguments(self.given)
        self.include, self.call = xacro.process_include, xacro.handle_macro_call
        package: Any = xacro
        package.parse, package.open = self._parse, self._open
        package.warning = package.error = self._warn
        package.message = package.print_location = _nothing
        package.root_dir = str(Path(self.file).parent)
        package.substitution_args_context = {"filename": ""}
        package._global_symbols = _symbols()
        package.handle_macro_call = self._call
        if self.macros:
            package.process_include = self._include
        package.init_stacks(self.file)
        inner: Any = substitution_args
        inner._eval_dirname = lambda _: str(Path(xacro.filestack[-1]).parent)
        inner._eval_find = inner._eval_dict["find"] = self._find

    def result(self, known: Sequence[str] | None) -> Expansion:
        """Result of expanding the file. Raises ConfigError."""
        try:
            document = self._parse(None, self.file)
            if self.macros:
                self._preload(document)
            xacro.process_doc(document, mappings=self.arguments)
            for element in document.getElementsByTagName("*"):
                _check_names(element)
            text = document.toprettyxml(indent="  ")
            rows = table_of(markup(text, self.file)) if self.macros else ()
        except Exception as error:
            cause = _cause(error)
            if known is None and isinstance(cause, UnknownPackageError):
                return Expansion(missing=str(cause))
            raise ConfigError([_problem(error, cause, self, known)]) from None
        places = [_place_of(element) for element in document.getElementsByTagName("*")]
        files = {file: number for number, file in enumerate(dict.fromkeys(place.file for place in places))}
        spots = tuple((files[place.file], place.line or 1, place.column or 1) for place in places)
        paths = tuple(str((file.folder or Path()) / Path(file.name).name) for file in files)
        table = tuple((row[0], *spot, *row[4:]) for row, spot in zip(rows, spots, strict=True)) if rows else ()
        return Expansion(
            text, paths, spots, table, tuple(self.arguments.declared), tuple(self.warnings), tuple(self.left_out)
        )

    def _parse(self, _: object, filename: str) -> Any:
        if filename.startswith(LEFT_OUT):
            self.left_out.setdefault(
                f"{_where()}no package named '{filename.removeprefix(LEFT_OUT).partition('/')[0]}'"
            )
            return parse_xml("<robot/>", filename, partial(_Dom, File(filename, None), Copier()), strict=True).document
        try:
            given = self.text.encode() if filename == self.file else b""
            data = given or read_limited(Path(filename), MAX_BYTES)
        except ReadingError as error:
            xacro.filestack.pop()
            raise xacro.XacroException(exc=FileNotFoundError(_unread(filename, error))) from None
        name = display(Path(filename))
        text = decode(data, name)
        file = File(name, Path(filename).parent, tuple(text.split("\n")))
        copied = self if self._is_ours(filename) else Copier()
        return parse_xml(text, name, partial(_Dom, file, copied), strict=True).document

    def _is_ours(self, filename: str) -> bool:
        """Whether a file is one of macros of ours, which another calls: what they make has the place of its call."""
        ours = [
            any(Path(one).resolve().is_relative_to(root) for root in self.own.values()) for one in (filename, self.file)
        ]
        return filename == self.macros or ours == [True, False]

    def _preload(self, document: Any) -> None:
        """Include the macros before the first element."""
        root = document.documentElement
        include = document.createElement("xacro:include")
        include.setAttribute("filename", self.macros)
        include.setUserData("place", _place_of(root), None)
        root.insertBefore(include, root.firstChild)

    def handle(self, operation: int, key: str, data: Place, src: minidom.Node, dst: minidom.Node) -> None:
        """Give what a macro of ours makes the place of its call; called by minidom."""
        dst.setUserData(key, self.calls[-1] if self.calls else data, Copier())

    def _open(self, filename: str) -> io.StringIO:
        try:
            stream = io.StringIO(read_limited(Path(filename), MAX_BYTES).decode("utf-8-sig", errors="replace"))
        except ReadingError as error:
            raise FileNotFoundError(_unread(filename, error)) from None
        stream.name = display(Path(filename))
        return stream

    def _find(self, name: str) -> str:
        here = Path(xacro.filestack[-1]).resolve()
        if name in self.own and any(here.is_relative_to(folder) for folder in self.own.values()):
            return self.own[name]
        if name not in self.packages:
            raise UnknownPackageError(name)
        return self.packages[name]

    def _include(self, node: minidom.Element, *rest: object) -> None:
        found = _IN_PACKAGE.match(node.getAttribute("filename"))
        if found and found[1] in self.libraries:
            name = node.getAttribute("filename")[found.end() :].strip()
            folder = self.packages.get(found[1])
            if folder is None or ("$" not in name and not (Path(folder) / name).is_file()):
                xacro.replace_node(node, by=None)
                return
        self.include(node, *rest)

    def _call(self, node: minidom.Element, *rest: object) -> bool:
        self.calls.append(_place_of(node))
        try:
            return bool(self.call(node, *rest))
        except xacro.XacroException as error:
            if not self.left_out or str(error) != f"unknown macro name: {node.tagName}":
                raise
            self.left_out.setdefault(f"{_where()}no macro named '{node.tagName.removeprefix('xacro:')}'")
            xacro.replace_node(node, by=None)
            return True
        finally:
            self.calls.pop()

    def _warn(self, *words: object, **_: object) -> None:
        self.warnings.setdefault(_where() + " ".join(map(str, words)))


def _where() -> str:
    """File and line of the element that the package is at."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        if (element := _element(frame)) is not None:
            return f"{_place_of(element).file.name}:{_place_of(element).line}: "
        frame = frame.f_back
    return ""


def _symbols() -> Any:
    """The names that no file defines, made anew: files can change them."""
    names = {"warning": xacro.warning, "error": xacro.error, "message": _nothing, "print_location": _nothing}
    symbols = xacro.create_global_symbols()
    for name, work in names.items():
        symbols["xacro"][name] = lambda *words, work=work, **_: work(*words) or ""
    return symbols


def _nothing(*_: object, **__: object) -> None:
    """Drop a text that is printed for people at a terminal."""


def _unread(filename: str, error: ReadingError) -> str:
    """Reason why a file cannot be read, with the name that may be meant."""
    path = Path(filename)
    try:
        os.scandir(path.parent).close()
    except PermissionError:
        return f"may not read '{display(path)}': {OUTSIDE}"
    except OSError:
        pass  # there is none
    there = os.path.lexists(path)
    return f"'{display(path)}' {error}" if there else f"no file '{display(path)}'{near_names(path)}"


def _check_names(element: minidom.Element) -> None:
    """Refuse names that are not those of XML, which expressions may give, and write numbers as texts."""
    names: tuple[object, ...] = (element.tagName, *element.attributes.keys())
    for name in names:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            message = f"'{name}' is not a valid name for an element or attribute"
            raise ConfigError([_place_of(element).problem(f"<{element.tagName}>", message)])
    for attribute in element.attributes.values():
        attribute.value = str(attribute.value)


def _problem(error: Exception, cause: BaseException, made: Expander, known: Sequence[str] | None) -> Problem:
    """Problem that stopped an expansion: the innermost error, at the place in the files that raised it."""
    if isinstance(cause, ConfigError):
        return cause.problems[0]
    mark = cause.problem_mark or cause.context_mark if isinstance(cause, yaml.MarkedYAMLError) else None
    if mark is not None and isinstance(cause, yaml.MarkedYAMLError):
        return Problem(mark.name, mark.line + 1, mark.column + 1, "", str(cause.problem or cause.context))
    trail = _Trail(error, display(Path(made.macros)))
    if isinstance(cause, UnknownPackageError):
        words = UnknownNameError("package", str(cause), known or ())
        message = f"{words} (or add its folder to the package paths, or --missing ignore)"
    else:
        message = "; not read: ".join([_message(cause, trail) + _beside(cause), *made.left_out])
    if trail.expression:
        message = f"{trail.expression[:_MAX_MESSAGE]}: {message}"
    if trail.place is None:
        return Problem(display(Path(made.file)), None, None, "", message)
    place = _expression_place(trail.place, trail.expression)
    return place.problem(f"<{trail.tag}>", message + trail.callers())


def _cause(error: BaseException) -> BaseException:
    """The error that the package wraps, each in the next."""
    while isinstance(error, xacro.XacroException) and error.exc is not None:
        error = error.exc
    return error


def _unknown_argument(cause: BaseException) -> UnknownArgumentError | None:
    found = cause.__context__ if isinstance(cause, substitution_args.ArgException) else cause
    return found if isinstance(found, UnknownArgumentError) else None


def _beside(cause: BaseException) -> str:
    """Where an argument can be given that no file declares."""
    unknown = _unknown_argument(cause)
    if unknown is None or nearest(*unknown.args):
        return ""
    return f"; or give it in the YAML beside the file: `arguments: {{{unknown.args[0]}: ...}}`"


def _message(cause: BaseException, trail: "_Trail") -> str:
    """Message about an error, in the words of Python or xacro."""
    if (unknown := _unknown_argument(cause)) is not None:
        return str(UnknownNameError("argument", *unknown.args))
    if isinstance(cause, MemoryError):
        return "takes too much memory"
    if isinstance(cause, RecursionError):
        return "nested too deeply; does something refer to itself?"
    if isinstance(cause, SyntaxError):
        return str(cause.msg)
    if isinstance(cause, OSError) and cause.strerror:
        return f"{cause.strerror}: {cause.filename}"
    text = ". ".join(line.strip() for line in str(cause).splitlines()) or type(cause).__name__
    if isinstance(cause, AttributeError | TypeError) and not trail.expression:
        text = f"cannot be expanded: {text}"  # the package did not expect such a value
    if isinstance(cause, KeyError):
        text = f"no key {text}"
    undefined = _UNDEFINED.match(text)
    close = nearest(undefined[1], trail.names) if undefined else None
    if isinstance(cause, xacro.XacroException) and cause.macros:
        text += f"; the macro takes: {' '.join(cause.macros[0].params) or 'no parameters'}"
    if text.startswith("unknown macro name: "):
        close = nearest(text.rpartition(":")[2], trail.macros)
    return f"{text}{f'; did you mean {close!r}?' if close else ''}"[:_MAX_MESSAGE]


class _Trail:
    """Where in the files an error came, by the frames of the package's functions."""

    def __init__(self, error: BaseException, macros: str = "") -> None:
        self.library = macros
        self.place: Place | None = None
        self.tag = ""
        self.expression = ""
        self.calls: list[tuple[str, Place]] = []
        self.names: list[str] = []
        self.macros: list[str] = []
        for frame in _frames(error):
            self._follow(frame.f_code.co_name, frame.f_locals, _element(frame))

    def _follow(self, function: str, local: Mapping[str, Any], element: minidom.Element | None) -> None:
        if element is not None:
            self._at(element)
            self.expression = ""
        if function == "handle_macro_call" and element is not None:
            self.calls.append((str(element.tagName).removeprefix("xacro:"), _place_of(element)))
            self.macros = [str(name) for name in _names(local["macros"])]
        elif function == "eval_default_arg" and local["default"] is not None:
            self._at(local["macro"].body)
        elif function == "eval_text":
            self.names = [str(name) for name in _names(local["symbols"])]
            text = local["text"]
            if isinstance(text, ElementText) and text.place.file.name != self.library:
                self.place, self.tag = text.place, text.tag
        elif function in {"handle_expr", "handle_extension"}:
            self.expression = f"${{{local['s']}}}" if function == "handle_expr" else f"$({local['s']})"

    def callers(self) -> str:
        """Macros that led here, the innermost first."""
        calls = [(name, place) for name, place in reversed(self.calls) if place != self.place]
        said = dict.fromkeys(f"in macro '{name}' called at {place.file.name}:{place.line}" for name, place in calls)
        return f" ({', '.join(list(said)[:_SHOWN_CALLERS])})" if said else ""

    def _at(self, element: minidom.Element) -> None:
        if _place_of(element).file.name != self.library:
            self.place, self.tag = _place_of(element), element.tagName


def _names(table: object) -> list[object]:
    """The names of a scope and of those around it."""
    found: list[object] = []
    while isinstance(table, dict) and len(found) < 1000:
        found += dict.keys(table)
        table = getattr(table, "parent", None)
    return found


def _frames(error: BaseException | None) -> Iterator[FrameType]:
    """The frames of the package that an error came through, then those of the error that it replaced, and so on."""
    while error is not None:
        trace = error.__traceback__
        while trace is not None:
            if trace.tb_frame.f_globals is vars(xacro):
                yield trace.tb_frame
            trace = trace.tb_next
        error = error.__context__


def _element(frame: FrameType) -> minidom.Element | None:
    """The element that a function of the package works on."""
    if frame.f_globals is not vars(xacro):
        return None
    for name in ("node", "elt", "tag"):
        node = frame.f_locals.get(name)
        if isinstance(node, minidom.Text | minidom.Comment):
            node = node.parentNode
        if isinstance(node, minidom.Element) and node.getUserData("place") is not None:
            return node
    return None


def _expression_place(place: Place, expression: str) -> Place:
    """The place of an expression, looked for from the element it is in."""
    assert place.line
    assert place.column
    for number, line in enumerate(place.file.lines[place.line - 1 : place.line + 39], place.line):
        column = line.find(expression, place.column - 1 if number == place.line else 0)
        if expression and column >= 0:
            return Place(place.file, number, column + 1)
    return place
