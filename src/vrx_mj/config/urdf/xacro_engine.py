"""The xacro package at work on a file that is not trusted.

Every expansion loads a copy of xacro of its own, so that nothing is shared with other expansions or with who else uses
xacro, and gives it our functions in place of those that run Python, open files, look for packages or print. The other
wrappers note which element is being worked on, count the work, and check what xacro would fail on without a word.
"""

import importlib.util
import keyword
import re
import unicodedata
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.dom import minidom

from vrx_mj.config.search import display
from vrx_mj.config.tree import Place
from vrx_mj.config.urdf.expressions import evaluate
from vrx_mj.config.urdf.xacro_document import Located, parse_document, place_of
from vrx_mj.config.urdf.xacro_files import Files
from vrx_mj.config.urdf.xacro_functions import EVERYWHERE, GLOBALS, MATH, python_module
from vrx_mj.config.urdf.xacro_limits import LONGEST_TEXT, Budget, ExpressionError, Function, Module
from vrx_mj.config.urdf.xacro_names import Names, unknown
from vrx_mj.config.urdf.xacro_substitutions import Substitutions
from vrx_mj.config.urdf.xacro_yaml import load_plain

__all__ = ["Engine"]

DEEPEST_MACROS = 60
"""Macros that may call each other."""
DEEPEST_FILES = 20
"""Files that may include each other."""
DEEPEST_ELEMENTS = 200
"""Elements in elements, those of the macros included."""
MOST_PARAMETERS = 500
"""Parameters of a macro."""

_ARGUMENT = re.compile(
    r"^\s*([^\s:=]+?)\s*:?=\s*(\^\|?)?"
    r"(\$\{.*?\}|\$\(.*?\)|(?>'[^']*'|\"[^\"]*\"|[^\s'\"]+)+|)(?:\s+|$)(.*)",
    re.DOTALL,
)
"""xacro's pattern of a macro's parameter with a default, but for the time that it can take."""


class Engine:
    """One expansion: xacro with our functions, and where it stands."""

    def __init__(self, files: Files, arguments: dict[str, str], budget: Budget) -> None:
        self.files = files
        self.budget = budget
        self.xacro = _fresh_xacro()
        self.substitutions = Substitutions(files, arguments, budget)
        self.element: Any = None
        """What is being worked on."""
        self.texts: list[Located] = []
        """The texts being expanded, each in what the one before it refers to."""
        self.expression = ""
        """The innermost expression that failed."""
        self.calls: list[tuple[str, Place]] = []
        """The macros being expanded, and who calls them."""
        self.depth = 0
        self.warnings: dict[str, None] = {}
        self._yaml: dict[Path, Any] = {}
        self._theirs: dict[str, Any] = {}
        self._install()

    def expand(self, file: Path) -> minidom.Document:
        """The document of a file with everything expanded."""
        self.xacro.init_stacks(str(file))
        document: minidom.Document = self._parse(None, str(file))
        self.element = document.documentElement
        self.xacro.process_doc(document, mappings=self.substitutions.arguments, verbosity=0)
        return document

    def _install(self) -> None:
        wrapped = {
            "eval_all": self._eval_all, "eval_text": self._eval_text, "handle_macro_call": self._call,
            "grab_macro": self._grab_macro, "grab_property": self._grab_property, "check_attrs": self._check_attributes,
            "reqd_attrs": self._required, "replace_node": self._replace, "process_include": self._include,
            "remove_previous_comments": self._drop_comments,
        }  # fmt: skip
        replaced: dict[str, Any] = {
            "parse": self._parse, "safe_eval": self._evaluate, "eval_extension": self._substitute,
            "get_include_files": self._included, "is_valid_name": _is_name, "load_yaml": self._load_yaml,
            "tokenize": _tokens, "warning": self._warn, "error": self._warn, "message": _silent,
            "print_location": _silent, "re_macro_arg": _ARGUMENT, "_global_symbols": self._symbols(),
        }  # fmt: skip
        for name in wrapped:
            self._theirs[name] = getattr(self.xacro, name)
        for name, ours in {**wrapped, **replaced}.items():
            assert hasattr(self.xacro, name), f"xacro has no {name}"
            setattr(self.xacro, name, ours)

    def _symbols(self) -> dict[str, Any]:
        """What expressions can name, properties aside."""
        old = {"load_yaml": self._load_yaml, "abs_filename": self.xacro.abs_filename_spec,
               "dotify": self.xacro.YamlDictWrapper}  # fmt: skip
        said = {name: Function(name, self._said(name)) for name in ("message", "warning", "error", "print_location")}
        members = {
            **{name: Function(name, call) for name, call in old.items()},
            **said,
            "fatal": Function("fatal", _fatal),
            "tokenize": Function("tokenize", _tokens),
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

    # What xacro runs instead of its own

    def _parse(self, inp: Any, filename: str = "") -> Any:
        """A file's document; xacro knows by the cause that an optional file is missing."""
        try:
            path = self.files.allowed(filename)
        except FileNotFoundError as error:
            self.xacro.filestack.pop()
            raise self.xacro.XacroException(str(error), exc=error) from None
        return parse_document(self.files.read(str(path)), display(Path(filename)), path.parent, self.budget)

    def _evaluate(self, text: str, table: Any, _: Any = None) -> Any:
        """The value of an expression, with xacro's properties."""
        self.budget.spend(20 + 2 * len(self.calls))
        names = Names(table, lambda: _names(table), (self.xacro.NameSpace,), (self.xacro.YamlDictWrapper,))
        try:
            value = evaluate(str(text), names, self.budget)
            self.budget.write(value)
        except Exception:
            self.expression = self.expression or f"${{{text}}}"
            raise
        return value

    def _substitute(self, text: str) -> str:
        """The text that stands for a `$(...)`."""
        try:
            found = self.substitutions.resolve(text[2:-1], self._folder())
            self.budget.write(found)
        except Exception:
            self.expression = self.expression or text
            raise
        return found

    def _included(self, pattern: str, symbols: Any) -> Iterator[str]:
        """The files that an include names."""
        name = str(self.xacro.eval_text(pattern, symbols))
        found = self.files.matching(str(self._folder() / name))
        if not found:
            self._warn(f"no file matches '{name}'")
        if len(self.xacro.filestack) > DEEPEST_FILES:
            chain = " > ".join(dict.fromkeys(Path(file).name for file in self.xacro.filestack))
            raise ExpressionError(f"files include each other: {chain} > {Path(name).name}")
        yield from found

    def _load_yaml(self, name: str) -> Any:
        """What a YAML file holds, with dotted names."""
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
        return self.xacro.YamlListWrapper.wrap(self._yaml[real])

    def _warn(self, *words: Any, **_: Any) -> None:
        place = place_of(self.element) if self.element is not None else None
        where = f"{place.file.name}:{place.line}: " if place else ""
        self.warnings.setdefault(where + " ".join(str(word) for word in words))

    def _said(self, name: str) -> Callable[..., str]:
        def say(*words: Any, **_: Any) -> str:
            if name in {"warning", "error"}:
                self._warn(*words)
            return ""

        return say

    def _deprecated(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def warned(*values: Any) -> Any:
            self._warn(f"{name}() is now xacro.{name}()")
            return call(*values)

        return warned

    # What notes where xacro stands, and counts

    def _eval_all(self, node: Any, macros: Any, symbols: Any) -> None:
        before, self.element = self.element, node
        self.depth += 1
        if self.depth > DEEPEST_ELEMENTS:
            raise ExpressionError(f"elements are nested deeper than {DEEPEST_ELEMENTS} levels")
        self.budget.spend(10 + 5 * len(node.childNodes))
        self._theirs["eval_all"](node, macros, symbols)
        self.depth -= 1
        self.element = before

    def _eval_text(self, text: Any, symbols: Any) -> Any:
        if not isinstance(text, str) or "$" not in text:
            return text
        self.budget.spend(20 + len(text) * text.count("$") // 1000)
        if len(text) > LONGEST_TEXT:
            raise ExpressionError(f"a text with '$' of more than {LONGEST_TEXT} characters is too long")
        if isinstance(text, Located):
            self.texts.append(text)
        result = self._theirs["eval_text"](text, symbols)
        if isinstance(text, Located):
            self.texts.pop()
        if isinstance(result, str):
            self.budget.spend(len(result) // 20)
        return result

    def _call(self, node: Any, macros: Any, symbols: Any) -> bool:
        if not str(node.tagName).startswith("xacro:"):
            return False
        before, self.element = self.element, node
        if node.tagName == "xacro:call":
            return bool(self._theirs["handle_macro_call"](node, macros, symbols))
        name = node.tagName.removeprefix("xacro:")
        try:
            self.budget.spend(100 + 10 * len(self.calls))
            *_, macro = self.xacro.resolve_macro(name, macros, symbols)
            _check_call(node, macro)
        except (KeyError, TypeError):
            raise unknown("macro", name, _names(macros)) from None
        if len(self.calls) >= DEEPEST_MACROS:
            chain = " > ".join(list(dict.fromkeys(called for called, _ in self.calls))[-5:])
            raise ExpressionError(f"macros call each other deeper than {DEEPEST_MACROS} levels: {chain} > {name}")
        self.calls.append((name, place_of(node)))
        self._theirs["handle_macro_call"](node, macros, symbols)
        self.calls.pop()
        self.element = before
        return True

    def _grab_macro(self, node: Any, macros: Any) -> None:
        before, self.element = self.element, node
        params = node.getAttribute("params")
        if len(params) > LONGEST_TEXT:
            raise ExpressionError(f"params has more than {LONGEST_TEXT} characters")
        node.setAttribute("params", params.strip())
        name = node.getAttribute("name").removeprefix("xacro:")
        if node.hasAttribute("name") and "." not in name and not _MACRO_NAME.fullmatch(name):
            raise ExpressionError(f"'{name}' is not a valid name for a macro")
        self._theirs["grab_macro"](node, macros)
        macro = macros[name]
        if len(macro.params) > MOST_PARAMETERS:
            raise ExpressionError(f"a macro has at most {MOST_PARAMETERS} parameters, got {len(macro.params)}")
        for param in macro.params:
            if not _PARAMETER.fullmatch(param):
                raise ExpressionError(f"'{param[:60]}' in params is not a parameter; write NAME or NAME:=DEFAULT")
        for param, (forward, default) in macro.defaultmap.items():
            macro.defaultmap[param] = forward, default and Located.at(default, node)
        self.element = before

    def _grab_property(self, node: Any, table: Any) -> None:
        before, self.element = self.element, node
        if node.getAttribute("scope") == "parent" and table.parent is table.root:
            raise ExpressionError("scope 'parent' is for properties in macros")
        self._theirs["grab_property"](node, table)
        self.element = before

    def _include(self, node: Any, macros: Any, symbols: Any, each: Any) -> None:
        before, self.element = self.element, node
        self._theirs["process_include"](node, macros, symbols, each)
        self.element = before

    def _check_attributes(self, node: Any, required: list[str], optional: list[str]) -> Any:
        self.element = node
        return self._theirs["check_attrs"](node, required, optional)

    def _required(self, node: Any, names: list[str]) -> Any:
        self.element = node
        for name in names:
            if not node.hasAttribute(name):
                raise ExpressionError(f"attribute '{name}' is required, but missing")
        return self._theirs["reqd_attrs"](node, names)

    def _replace(self, node: Any, by: Any, content_only: bool = False) -> None:
        siblings = len(node.parentNode.childNodes)
        parts = by if isinstance(by, list) else [by] if by is not None else []
        moved = sum(len(part.childNodes) if content_only else 1 for part in parts)
        self.budget.spend(10 + (1 + moved) * (10 + self.depth + siblings // 20))
        self._theirs["replace_node"](node, by, content_only)

    def _drop_comments(self, node: Any) -> None:
        before = node.previousSibling
        dropped = 0
        while before is not None and (before.nodeType == before.COMMENT_NODE or _is_blank(before)):
            dropped += 1
            before = before.previousSibling
        self.budget.spend(10 + (1 + dropped) * (5 + len(node.parentNode.childNodes) // 20))
        self._theirs["remove_previous_comments"](node)

    def _folder(self) -> Path:
        return Path(self.xacro.filestack[-1]).absolute().parent


_MACRO_NAME = re.compile(r"[^\W\d][\w-]*")
_PARAMETER = re.compile(r"\*{0,2}[^\W\d][\w.-]*")


def _fresh_xacro() -> Any:
    """A copy of the xacro package that nobody else has."""
    spec = importlib.util.find_spec("xacro")
    assert spec is not None, "xacro is installed with us"
    assert spec.loader is not None, "xacro is made of files"
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _check_call(node: Any, macro: Any) -> None:
    """Refuse attributes that a macro does not take, and the lack of those that it needs."""
    names = [param for param in macro.params if not param.startswith("*")]
    takes = f"it takes {', '.join(names)}" if names else "it takes no parameters"
    for name in node.attributes.keys():  # noqa: SIM118 - not a dict
        if name not in names:
            raise ExpressionError(f"macro has no parameter '{name}'; {takes}")
    missing = [name for name in names if name not in macro.defaultmap and not node.hasAttribute(name)]
    if missing:
        listed = ", ".join(f"'{name}'" for name in missing)
        raise ExpressionError(f"macro needs {listed}; {takes}")


def _names(table: Any) -> set[str]:
    """Names that a file defines: properties or macros, blocks and what is built in left out."""
    found: set[str] = set()
    while hasattr(table, "parent"):
        found.update(name for name in dict.keys(table) if not name.startswith("*"))
        table = table.parent
    return found


def _is_name(name: Any) -> bool:
    """Whether an expression can name it; Python reads look-alike letters as one."""
    usual = isinstance(name, str) and unicodedata.normalize("NFKC", name) == name
    return usual and name.isidentifier() and not keyword.iskeyword(name)


def _is_blank(node: Any) -> bool:
    return node.nodeType == node.TEXT_NODE and not node.data.strip()


def _tokens(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    """A text split at any of some characters."""
    if not sep or set(sep) & set("[]\\^-"):
        raise ExpressionError(f"tokenize: '{sep[:20]}' cannot be a separator")
    found = re.split(f"[{sep}]", text)
    return [item for item in found if item] if skip_empty else found


def _fatal(*words: Any) -> None:
    raise ExpressionError(" ".join(map(str, words)))


def _silent(*_: Any, **__: Any) -> None:
    return None
