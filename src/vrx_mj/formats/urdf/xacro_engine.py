"""The elements of xacro at work on a document: properties, macros, blocks, conditions and includes.

The language is that of the ROS package `xacro` 2. Expressions go to `expressions`; work and sizes have limits.
"""

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast
from xml.dom import minidom

from vrx_mj.config.search import display
from vrx_mj.config.tree import Place
from vrx_mj.formats.urdf.expression_values import (
    EVERYWHERE,
    GLOBALS,
    LONGEST_TEXT,
    MATH,
    Budget,
    DottedMapping,
    ExpressionError,
    Function,
    Module,
    dotted,
    fatal,
    python_module,
    silent,
    tokens,
)
from vrx_mj.formats.urdf.expressions import Names, Namespace, Scope, evaluate, property_name
from vrx_mj.formats.urdf.xacro_document import Child, Located, load_plain, parent_of, parse_document, place_of
from vrx_mj.formats.urdf.xacro_files import Files, Substitutions
from vrx_mj.formats.urdf.xacro_macros import Macro, check_call, defined, macro_of

DEEPEST_MACROS = 60
"""Macros that may call each other."""
DEEPEST_FILES = 20
"""Files that may include each other."""
DEEPEST_ELEMENTS = 200
"""Elements in elements, those of the macros included."""
_LONGEST_MESSAGE = 300

_PIECE = re.compile(
    r"\$(?P<plain>\$+[{(])|\$\{(?P<expression>[^}]*)\}|\$\((?P<substitution>[^)]*)\)|(?P<text>[^$]+|\$[^{($]+|\$\Z)"
)
"""A piece of a text: `$${` means `${`."""
_IN_PACKAGE = re.compile(r"\s*\$\(find (\w{1,200})\)/")
"""How the name of a file in a package begins."""


class Engine:
    """The expansion of one file, and the place it has come to, which an error leaves as it is."""

    def __init__(
        self, files: Files, arguments: dict[str, str], budget: Budget, libraries: Collection[str] = ()
    ) -> None:
        self.files = files
        self.libraries = libraries
        """Packages that may be missing: includes from them are then left out, and calls of unknown macros stay."""
        self.budget = budget
        self.substitutions = Substitutions(files, arguments, budget)
        self.element: Any = None
        """The element being worked on."""
        self.texts: list[Located] = []
        """The texts being expanded, each in what the one before it refers to."""
        self.expression = ""
        """The innermost expression that failed."""
        self.calls: list[tuple[str, Place]] = []
        """The macros being expanded, and where each is called."""
        self.warnings: dict[str, None] = {}
        self.declared: dict[str, None] = {}
        """The arguments that the files declare."""
        self._depth = 0
        self._open: list[str] = []
        """The files being read, each included by the one before it."""
        self._yaml: dict[Path, Any] = {}
        self._gap = minidom.Document().createTextNode("\n\n")

    def expand(self, file: Path) -> minidom.Document:
        """The document of a file with everything expanded."""
        self._open = [str(file)]
        document = self._parsed(str(file))
        root: Any = document.documentElement
        self.element = root
        namespace = root.getAttribute("xacro:targetNamespace")
        if namespace:
            root.removeAttribute("xacro:targetNamespace")
            root.setAttribute("xmlns", namespace)
        self._expand(root, Scope({}), Scope(self._symbols(), self._expanded))
        return document

    def _symbols(self) -> Mapping[str, object]:
        """Names that no file defines."""
        old: dict[str, Callable[..., Any]] = {
            "load_yaml": self._load_yaml, "abs_filename": self._beside, "dotify": DottedMapping,
        }  # fmt: skip
        members = {
            **{name: Function(name, call) for name, call in old.items()},
            **{name: Function(name, silent) for name in ("message", "print_location")},
            **{name: Function(name, self._warned) for name in ("warning", "error")},
            "fatal": Function("fatal", fatal),
            "tokenize": Function("tokenize", tokens),
            "arg": Function("arg", self.substitutions.argument),
        }
        return {
            **GLOBALS,
            **{name: EVERYWHERE[name] for name in ("sorted", "range")},
            **{name: Function(name, self._deprecated(name, call)) for name, call in old.items()},
            "math": Module("math", MATH),
            "python": python_module(),
            "xacro": Module("xacro", members),
        }

    def _expanded(self, text: object, symbols: Scope) -> object:
        """A text with its expressions and substitutions worked out; a single expression keeps its type."""
        if not isinstance(text, str) or "$" not in text:
            return text
        self.budget.spend(20 + len(text) * text.count("$") // 1000)
        if len(text) > LONGEST_TEXT:
            raise ExpressionError(f"a text with '$' of more than {LONGEST_TEXT} characters is too long")
        if isinstance(text, Located):
            self.texts.append(text)
        values = list(self._pieces(text, symbols))
        if isinstance(text, Located):
            self.texts.pop()
        result = values[0] if len(values) == 1 else "".join(map(str, values))
        if isinstance(result, str):
            self.budget.spend(len(result) // 20)
        return result

    def _pieces(self, text: str, symbols: Scope) -> Iterator[object]:
        start = 0
        while start < len(text):
            piece = _PIECE.match(text, start)
            if piece is None:
                rest = text[start:]
                opened = rest.startswith(("${", "$("))
                wrong = " is never closed" if opened else ": write '$$' for a plain '$' before a bracket"
                raise ExpressionError(f"'{rest}'{wrong}"[:_LONGEST_MESSAGE])
            start = piece.end()
            if piece["expression"] is not None:
                yield self._evaluated(str(self._expanded(piece["expression"], symbols)), symbols)
            elif piece["substitution"] is not None:
                yield self._substituted(str(self._expanded(piece["substitution"], symbols)))
            else:
                yield piece["plain"] or piece["text"]

    def _evaluated(self, text: str, symbols: Scope) -> object:
        self.budget.spend(20 + 2 * len(self.calls))
        try:
            value = evaluate(text, Names(symbols, symbols.names), self.budget)
            self.budget.write(value)
        except Exception:
            self.expression = self.expression or f"${{{text}}}"
            raise
        return value

    def _substituted(self, text: str) -> str:
        try:
            found = self.substitutions.resolve(text, self._folder())
            self.budget.write(found)
        except Exception:
            self.expression = self.expression or f"$({text})"
            raise
        return found

    def _boolean(self, text: object, symbols: Scope) -> bool:
        """Whether a condition holds."""
        value = self._expanded(text, symbols)
        try:
            if not isinstance(value, str):
                return bool(value)
            return value in {"true", "True"} or (value not in {"false", "False"} and bool(int(value)))
        except ValueError:
            message = f"'{text}' gives '{value}', which is neither true nor false"
            raise ExpressionError(message[:_LONGEST_MESSAGE]) from None

    def _expand(self, node: minidom.Element, macros: Scope, symbols: Scope) -> None:
        """Expand an element's attributes and all that it holds, in place."""
        before, self.element = self.element, node
        self._depth += 1
        if self._depth > DEEPEST_ELEMENTS:
            raise ExpressionError(f"elements are nested deeper than {DEEPEST_ELEMENTS} levels")
        self.budget.spend(10 + 5 * len(node.childNodes))
        for name, value in node.attributes.items():
            if not name.startswith("xacro:"):
                node.setAttribute(name, str(self._expanded(value, symbols)))
            if name.startswith("xacro:") or name == "xmlns:xacro":
                node.removeAttribute(name)
        self._expand_children(node, macros, symbols)
        self._depth -= 1
        self.element = before

    def _expand_children(self, node: minidom.Element, macros: Scope, symbols: Scope) -> None:
        child: Any = node.firstChild
        in_comments = False
        while child:
            following = child.nextSibling
            if child.nodeType == child.ELEMENT_NODE:
                in_comments = False
                self._expand_element(child, macros, symbols)
                self.element = node
            elif child.nodeType == child.TEXT_NODE:
                child.data = str(self._expanded(child.data, symbols))
                in_comments = in_comments and not child.data.strip()
            elif child.nodeType == child.COMMENT_NODE and "xacro:eval-comments" in child.data:
                in_comments = "xacro:eval-comments:off" not in child.data
                self._replace(child, [])
            elif child.nodeType == child.COMMENT_NODE and in_comments:
                child.data = str(self._expanded(child.data, symbols))
            child = following

    def _expand_element(self, node: minidom.Element, macros: Scope, symbols: Scope) -> None:
        self.element = node
        while node.tagName == "xacro:element":
            (written,) = self._required(node, "xacro:name")
            name: Any = self._expanded(written, symbols)
            if not name:
                raise ExpressionError("its name is empty")
            node.removeAttribute("xacro:name")
            node.nodeName = node.tagName = name
        work = _ELEMENTS.get(node.tagName)
        if work is not None:
            work(self, node, macros, symbols)
        elif str(node.tagName).startswith("xacro:"):
            if self.libraries and node.tagName.removeprefix("xacro:") not in macros:
                self._expand(node, macros, symbols)
            else:
                self._call(node, macros, symbols)
        else:
            self._expand(node, macros, symbols)

    def _insert_block(self, node: minidom.Element, macros: Scope, symbols: Scope) -> None:
        name, *_ = self._attributes(node, "name")
        whole = f"**{name}" not in symbols
        if whole and f"*{name}" not in symbols:
            message = f"no block named '{name}'; a macro gets it as a parameter *{name} or **{name}"
            raise ExpressionError(message[:_LONGEST_MESSAGE])
        found: Any = symbols[f"*{name}" if whole else f"**{name}"]
        block = found.cloneNode(deep=True)
        self._expand(block, macros, symbols)
        self._replace(node, [block] if whole else list(block.childNodes))

    def _include(self, node: minidom.Element, macros: Scope, symbols: Scope) -> None:
        pattern, space, optional = self._attributes(node, "filename", optional=("ns", "optional"))
        optional = optional is not None and self._boolean(optional, symbols)
        if any(child.nodeType == child.ELEMENT_NODE for child in node.childNodes):
            self._warn("Child elements of a <xacro:include> tag are ignored")
        if self._is_missing_library(pattern):
            self._replace(node, [])
            return
        files = self._matching(str(self._expanded(pattern, symbols)))
        if space:
            space = _text(self._expanded(space, symbols))
            inner = Namespace({}), Namespace(symbols)
            self._define(macros, space, inner[0])
            self._define(symbols, space, inner[1])
            macros, symbols = inner
        depth, included = len(self._open), []
        for file in files:
            self._open.append(file)
            try:
                root: Any = self._parsed(file).documentElement
                self._expand(root, macros, symbols)
            except FileNotFoundError:
                del self._open[depth:]
                if not optional:
                    raise
                continue
            included += root.childNodes
            self._import_namespaces(parent_of(node), root)
            self._open.pop()
        self._drop_comments(node)
        self._replace(node, included)

    def _is_missing_library(self, pattern: str) -> bool:
        """Whether an include names a file of one of the packages that may be missing, and it is not there."""
        found = _IN_PACKAGE.match(pattern)
        if not found or found[1] not in self.libraries:
            return False
        rest = pattern[found.end() :].strip()
        return not self.files.has_package(found[1]) or (
            "$" not in rest and not (self.files.find_package(found[1]) / rest).is_file()
        )

    def _matching(self, name: str) -> list[str]:
        """The files that the name in an include means."""
        found = self.files.matching(str(self._folder() / name))
        if not found:
            self._warn(f"no file matches '{name}'")
        if len(self._open) > DEEPEST_FILES:
            chain = " > ".join(dict.fromkeys(Path(file).name for file in self._open))
            raise ExpressionError(f"files include each other: {chain} > {Path(name).name}")
        return found

    def _import_namespaces(self, node: minidom.Element, source: minidom.Element) -> None:
        """Give an element the XML namespaces of one whose children it gets."""
        for name, value in source.attributes.items():
            if not name.startswith("xmlns:"):
                continue
            if node.hasAttribute(name) and node.getAttribute(name) != value:
                self._warn(f"{name} is '{node.getAttribute(name)}' here and '{value}' in what is included")
            else:
                node.setAttribute(name, value)

    def _set_property(self, node: minidom.Element, _: Scope, symbols: Scope) -> None:
        if node.getAttribute("scope") == "parent" and symbols.parent is symbols.root:
            raise ExpressionError("scope 'parent' is for properties in macros")
        self._drop_comments(node)
        optional = ("value", "default", "remove", "scope", "lazy_eval")
        written, value, default, remove, scope, lazy = self._attributes(node, "name", optional=optional)
        name = property_name(self._expanded(written, symbols))
        removed = self._boolean(remove or "false", symbols)
        if (value is not None) + (default is not None) + removed > 1:
            raise ExpressionError(f"property '{name}': give one of value, default and remove"[:_LONGEST_MESSAGE])
        self._replace(node, [])
        if removed and name in symbols:
            symbols.remove(name)
            if name in symbols:
                self._warn(f"Cannot remove global symbol: {name}")
            return
        if default is not None:
            if scope is not None:
                self._warn(f"{name}: default property value can only be defined on local scope")
            if name in symbols:
                return
            value = default
        key, value = (name, value) if value is not None else (f"**{name}", node)
        lazily = self._boolean(lazy or "true", symbols) and scope not in {"global", "parent"}
        value = value if lazily else self._expanded(value, symbols)
        self._define(_target(symbols, scope), key, value, lazily=lazily)

    def _define(self, scope: Scope, name: str, value: object, *, lazily: bool = False) -> None:
        if name in scope.root:
            self._warn(f"redefining global symbol: {name}")
        scope.define(name, value, lazily=lazily)

    def _set_macro(self, node: minidom.Element, macros: Scope, _: Scope) -> None:
        self._drop_comments(node)
        written, params = self._attributes(node, "name", optional=("params",))
        name = written.removeprefix("xacro:")
        macro = defined(name, (params or "").strip(), node)
        if name != written:
            self._warn(f"macro names must not contain prefix 'xacro:': {written}")
        macros.define(name, macro)
        self._replace(node, [])

    def _call(self, node: minidom.Element, macros: Scope, symbols: Scope) -> None:
        name = node.tagName.removeprefix("xacro:")
        self.budget.spend(100 + 10 * len(self.calls))
        outer_macros, outer_symbols, macro = macro_of(name, macros, symbols)
        check_call(node, macro)
        if len(self.calls) >= DEEPEST_MACROS:
            chain = " > ".join(list(dict.fromkeys(called for called, _ in self.calls))[-5:])
            raise ExpressionError(f"macros call each other deeper than {DEEPEST_MACROS} levels: {chain} > {name}")
        self.calls.append((name, place_of(node)))
        body: Any = macro.body.cloneNode(deep=True)
        inner = Scope(outer_symbols)
        for param, value in node.attributes.items():
            self._define(inner, param, self._expanded(value, symbols))
            node.setAttribute(param, "")  # or it would be expanded again
        self._expand(node, macros, symbols)
        self._give_blocks(node, macro, inner)
        for param in macro.values:
            if not dict.__contains__(inner, param):
                self._define(inner, param, self._default(param, macro, symbols))
        self._expand(body, Scope(outer_macros), inner)
        self._drop_comments(node)
        self._import_namespaces(parent_of(node), body)
        self._replace(node, list(body.childNodes))
        self.calls.pop()

    def _call_by_name(self, node: minidom.Element, macros: Scope, symbols: Scope) -> None:
        (name,) = self._required(node, "macro")
        if not name:
            raise ExpressionError("attribute 'macro' is required, but missing")
        node.tagName = f"xacro:{self._expanded(name, symbols)}"
        node.removeAttribute("macro")
        self._call(node, macros, symbols)

    def _give_blocks(self, node: minidom.Element, macro: Macro, symbols: Scope) -> None:
        """Let a macro's body find the elements inside its call."""
        wanted = [param for param in macro.params if param.startswith("*")]
        blocks = [child for child in node.childNodes if child.nodeType == child.ELEMENT_NODE]
        if len(blocks) < len(wanted):
            raise ExpressionError("macro needs one more block: an element inside this one")
        if len(blocks) > len(wanted):
            raise ExpressionError(f"macro takes no further block: <{blocks[len(wanted)].tagName}> is one too many")
        for param, block in zip(wanted, blocks, strict=True):
            symbols.define(param, block)

    def _default(self, param: str, macro: Macro, symbols: Scope) -> object:
        forward, text = macro.defaults[param]
        if forward and param in symbols:
            return symbols[param]
        if text is None:
            raise ExpressionError(f"macro needs '{param}', or a property of that name where it is called")
        return self._expanded(text, symbols)

    def _declare(self, node: minidom.Element, _: Scope, symbols: Scope) -> None:
        name, default = self._attributes(node, "name", "default")
        self.declared[str(name)] = None
        if name not in self.substitutions.arguments:
            self.substitutions.arguments[name] = str(self._expanded(default, symbols))
        self._drop_comments(node)
        self._replace(node, [])

    def _set_attribute(self, node: minidom.Element, _: Scope, symbols: Scope) -> None:
        name, written = self._required(node, "name", "value")
        name = self._expanded(name, symbols)
        value: Any = self._expanded(written, symbols)
        if not name:
            raise ExpressionError("its name is empty")
        parent_of(node).setAttribute(_text(name), value)
        self._replace(node, [])

    def _choose(self, node: minidom.Element, macros: Scope, symbols: Scope) -> None:
        self._drop_comments(node)
        (condition,) = self._attributes(node, "value")
        if self._boolean(condition, symbols) is (node.tagName == "xacro:if"):
            self._expand(node, macros, symbols)
            self._replace(node, list(node.childNodes))
        else:
            self._replace(node, [])

    def _required(self, node: minidom.Element, *names: str) -> list[Any]:
        """The values of attributes that an element must have."""
        for name in names:
            if not node.hasAttribute(name):
                raise ExpressionError(f"attribute '{name}' is required, but missing")
        return [node.getAttribute(name) for name in names]

    def _attributes(self, node: minidom.Element, *required: str, optional: tuple[str, ...] = ()) -> list[Any]:
        """The values of an element's attributes, None for an optional one that is missing; warns of others."""
        values = self._required(node, *required)
        values += [node.getAttribute(name) if node.hasAttribute(name) else None for name in optional]
        others = [name for name in node.attributes.keys() if name not in {*required, *optional}]  # noqa: SIM118
        others = [name for name in others if not name.startswith("xmlns:")]
        if others:
            self._warn(f"{node.nodeName}: unknown attribute(s): {', '.join(others)}")
        return values

    def _replace(self, node: minidom.Element | minidom.Comment, parts: Sequence[Child]) -> None:
        """Put other nodes in the place of one."""
        parent = parent_of(node)
        self.budget.spend(10 + (1 + len(parts)) * (10 + self._depth + len(parent.childNodes) // 20))
        for part in parts:
            parent.insertBefore(part, node)
        parent.removeChild(node)

    def _drop_comments(self, node: minidom.Element) -> None:
        """Remove the comments right before an element of xacro, which are about it."""
        parent = parent_of(node)
        following: Any = node.nextSibling
        before: Any = node.previousSibling
        while before is not None:
            self.budget.spend(5 + len(parent.childNodes) // 20)
            if before.nodeType == before.TEXT_NODE and before.data.isspace() and before.data.count("\n") <= 1:
                before = before.previousSibling
            if before is None or before.nodeType != before.COMMENT_NODE:
                if following is not None and following is not self._gap:
                    parent.insertBefore(self._gap, following)  # the next element keeps the comments before it
                return
            comment, before = before, before.previousSibling
            parent.removeChild(comment)

    def _parsed(self, name: str) -> minidom.Document:
        path = self.files.allowed(name)
        return parse_document(self.files.read(str(path)), display(Path(name)), path.parent, self.budget)

    def _folder(self) -> Path:
        return Path(self._open[-1]).absolute().parent

    def _beside(self, name: str) -> str:
        """A path relative to the file being read."""
        return str(Path(self._open[-1]).parent / name)

    def _load_yaml(self, name: str) -> object:
        """The content of a YAML file, with dotted names."""
        path = self._folder() / str(name)
        try:
            real = self.files.allowed(str(path))
        except FileNotFoundError as error:
            raise ExpressionError(str(error)) from None
        if real not in self._yaml:
            data = self.files.read(str(real))
            units = Names(GLOBALS)
            number: Callable[[str], Any] = lambda text: evaluate(text, units, self.budget)  # noqa: E731
            self._yaml[real] = load_plain(data, display(path), real.parent, number, self.budget)
        return dotted(self._yaml[real])

    def _warn(self, message: str) -> None:
        place = place_of(self.element) if self.element is not None else None
        where = f"{place.file.name}:{place.line}: " if place else ""
        self.warnings.setdefault(where + message)

    def _warned(self, *words: object, **_: object) -> str:
        self._warn(" ".join(map(str, words)))
        return ""

    def _deprecated(self, name: str, call: Callable[..., object]) -> Callable[..., Any]:
        def warned(*values: object) -> object:
            self._warn(f"{name}() is now xacro.{name}()")
            return call(*values)

        return warned


_ELEMENTS: Mapping[str, Callable[[Engine, minidom.Element, Scope, Scope], None]] = {
    "xacro:arg": Engine._declare, "xacro:attribute": Engine._set_attribute, "xacro:call": Engine._call_by_name,
    "xacro:if": Engine._choose, "xacro:include": Engine._include, "xacro:insert_block": Engine._insert_block,
    "xacro:macro": Engine._set_macro, "xacro:property": Engine._set_property, "xacro:unless": Engine._choose,
}  # fmt: skip


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise ExpressionError("expected text, got a number or list")
    return value


def _target(symbols: Scope, scope: str | None) -> Scope:
    """The scope that a property is for."""
    if scope == "global":
        return symbols.outermost()
    if scope != "parent":
        return symbols
    target: Any = symbols.parent
    while isinstance(target, Namespace) and not isinstance(symbols, Namespace):  # the caller's, not the included file's
        target = target.parent
    return cast("Scope", target)
