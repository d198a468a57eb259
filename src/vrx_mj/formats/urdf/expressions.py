"""Expressions in xacro files, worked out without Python's `eval`.

An expression is parsed into Python's syntax tree, and the tree is walked: whatever is not listed here is refused. Only
numbers, texts, lists and mappings exist; only listed functions are called; attributes are those of modules, of
namespaces and of mappings read from YAML, and listed methods. Work and sizes have limits (`expression_values`).
"""

import ast
import operator
import re
import threading
import unicodedata
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from functools import partial
from keyword import iskeyword
from typing import Any, NamedTuple, TypeVar

from vrx_mj.errors import UnknownNameError, nearest
from vrx_mj.formats.urdf.expression_values import (
    EVERYWHERE,
    GLOBALS,
    METHODS,
    MOST_VALUES,
    Budget,
    DottedMapping,
    ExpressionError,
    Function,
    Module,
    Room,
    check_power,
    check_repeat,
    formatted,
    kind_of,
    measure,
)

LONGEST = 5000
"""Characters of an expression."""

_BINARY: dict[type[ast.operator], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", operator.add), ast.Sub: ("-", operator.sub), ast.Mult: ("*", operator.mul),
    ast.Div: ("/", operator.truediv), ast.FloorDiv: ("//", operator.floordiv), ast.Mod: ("%", operator.mod),
    ast.Pow: ("**", operator.pow), ast.LShift: ("<<", operator.lshift), ast.RShift: (">>", operator.rshift),
    ast.BitAnd: ("&", operator.and_), ast.BitOr: ("|", operator.or_), ast.BitXor: ("^", operator.xor),
}  # fmt: skip
_UNARY: dict[type[ast.unaryop], tuple[str, Callable[[Any], Any]]] = {
    ast.USub: ("-", operator.neg), ast.UAdd: ("+", operator.pos),
    ast.Invert: ("~", operator.invert), ast.Not: ("not", operator.not_),
}  # fmt: skip
_COMPARE: dict[type[ast.cmpop], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Eq: ("==", operator.eq), ast.NotEq: ("!=", operator.ne), ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le), ast.Gt: (">", operator.gt), ast.GtE: (">=", operator.ge),
    ast.Is: ("is", operator.is_), ast.IsNot: ("is not", operator.is_not),
    ast.In: ("in", lambda item, items: item in items), ast.NotIn: ("not in", lambda item, items: item not in items),
}  # fmt: skip
_REFUSED: dict[type[ast.AST], str] = {
    ast.Lambda: "user-defined functions (lambda)",
    ast.NamedExpr: "assignments (:=)",
    ast.JoinedStr: "f-strings",
    ast.Await: "await",
    ast.Yield: "yield",
    ast.YieldFrom: "yield",
    ast.Set: "sets",
    ast.SetComp: "sets",
}
_WORDED = {
    "math domain error": "not defined for this value",
    "math range error": "the result is too large",
    "int too large to convert to float": "the number is too large",
}
_FUNCTIONS = [name for name, value in {**GLOBALS, **EVERYWHERE}.items() if isinstance(value, Function)]
_PARSING = threading.Lock()
"""One at a time: all threads share filters of warnings, and before Python 3.11.8 the depth of a parse (gh-106905)."""


Checked = TypeVar("Checked")


class Scope(dict[str, Any]):
    """Names of one scope of a file, inside another: its properties and blocks, or its macros.

    The text of a property that is not a literal is worked out by `expanded` when it is first needed.
    """

    def __init__(
        self, parent: Mapping[str, object], expanded: Callable[[str, "Scope"], object] = lambda text, _: text
    ) -> None:
        super().__init__()
        self.parent = parent
        self.root: Mapping[str, Any] = parent.root if isinstance(parent, Scope) else parent
        """Names that no file defines."""
        self.expanded: Callable[[str, Scope], object] = parent.expanded if isinstance(parent, Scope) else expanded
        self._waiting: set[str] = set()
        """Properties whose texts are not worked out yet."""
        self._open: list[str] = []
        """Properties being worked out."""

    def __getitem__(self, name: str) -> object:
        if not dict.__contains__(self, name):
            return self.parent[name]
        if name in self._waiting:
            if name in self._open:
                circle = " -> ".join([*self._open, name])
                raise ExpressionError(f"properties refer to each other in a circle: {circle}"[:300])
            self._open.append(name)
            dict.__setitem__(self, name, _literal(self.expanded(dict.__getitem__(self, name), self)))
            self._waiting.remove(name)
            self._open.remove(name)
        return dict.__getitem__(self, name)

    def __contains__(self, name: object) -> bool:
        return dict.__contains__(self, name) or name in self.parent

    def define(self, name: str, value: object, *, lazily: bool = False) -> None:
        """Give a name a value; a text, unless it is a literal, may be worked out later."""
        value = _literal(value)
        dict.__setitem__(self, name, value)
        if lazily and isinstance(value, str):
            self._waiting.add(name)
        else:
            self._waiting.discard(name)

    def remove(self, name: str) -> None:
        """Forget a name, in the scopes around this one too."""
        scope: Any = self
        while isinstance(scope, Scope):
            dict.pop(scope, name, None)
            scope = scope.parent

    def outermost(self) -> "Scope":
        """The scope of the whole file."""
        return self.parent.outermost() if isinstance(self.parent, Scope) else self

    def names(self) -> set[str]:
        """Names that the file defines; neither blocks nor what is built in."""
        around = self.parent.names() if isinstance(self.parent, Scope) else set()
        return around | {name for name in dict.keys(self) if not name.startswith("*")}


class Namespace(Scope):
    """Names of an included file, which an expression finds after the namespace's name and a dot."""


class Method(NamedTuple):
    """A method of a value, to be called with that value."""

    call: Callable[..., Any]


class Names:
    """Where the names of an expression are looked up; `own` are those that the file defines."""

    def __init__(self, table: Mapping[str, object], own: Callable[[], Iterable[str]] = tuple) -> None:
        self.table = table
        self.own = own

    def find(self, name: str, kind: str) -> object:
        """The value of a name."""
        check_name(name)
        try:
            return self.table[name]
        except KeyError:
            pass
        if name in EVERYWHERE:
            return EVERYWHERE[name]
        raise unknown(kind, name, self.own(), GLOBALS) if kind == "property" else unknown(kind, name, _FUNCTIONS)


def evaluate(text: str, names: Names, budget: Budget) -> object:
    """The value of an expression: a number, text, list or mapping."""
    budget.spend(20 + len(text) // 10)
    if len(text) > LONGEST:
        raise ExpressionError(f"an expression of more than {LONGEST} characters is too long")
    try:
        result = _Walk(names, budget).value(_parsed(text.strip()))
    except RecursionError:
        raise ExpressionError("nested too deeply: does something refer to itself?") from None
    if isinstance(result, Namespace):
        raise ExpressionError("is the name of an include, not a value; write NAME.PROPERTY")
    measure(result, budget)
    return result


def _parsed(text: str) -> ast.expr:
    try:
        with _PARSING:
            if "\\" not in text and not re.search(r"\d[a-zA-Z]", text):
                return ast.parse(text, mode="eval").body
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise ExpressionError(_unparsed(text, error.msg)) from None
    except (ValueError, RecursionError, MemoryError):
        raise ExpressionError("is not an expression, or nested too deeply") from None


def _unparsed(text: str, said: str) -> str:
    """The message about a text that is not an expression."""
    hint = "; an expression ends at the first '}'" if "{" in text else ""
    brackets = re.match(r".*(never closed|unmatched|does not match|unterminated)[^(]*", said)
    reason = f": {brackets[0].strip()}" if brackets else ""
    return f"is not an expression{reason}{hint}" if text else "is empty"


def _failed(error: Exception, values: list[object]) -> str:
    """Why a function gives nothing for some values."""
    said = str(error)
    if isinstance(error, TypeError | AttributeError) and "argument" not in said.replace("argument must be", ""):
        return f"does not work with {' and '.join(map(described, values)) or 'nothing'}"
    said = re.sub(r"could not convert string to float: (.*)", r"\1 is not a number", said)
    said = re.sub(r"invalid literal for int\(\) with base 10: (.*)", r"\1 is not a whole number", said)
    return _WORDED.get(said, said.replace("keyword argument", "name"))


class _Walk:
    """One expression's evaluation, with the names of the comprehensions it is in."""

    def __init__(self, names: Names, budget: Budget) -> None:
        self.names = names
        self.budget = budget
        self.inner: dict[str, Any] = {}

    def value(self, node: ast.AST) -> object:
        """The value of a part of the syntax tree."""
        self.budget.spend(2)
        visit = _VISITS.get(type(node))
        if visit is None:
            words = _REFUSED.get(type(node), f"'{ast.unparse(node)[:40]}'")
            raise ExpressionError(f"{words}: not allowed in a robot file")
        return visit(self, node)

    def constant(self, node: ast.Constant) -> object:
        if isinstance(node.value, bytes | complex) or node.value is Ellipsis:
            raise ExpressionError(f"{ast.unparse(node)[:40]}: not allowed in a robot file")
        return node.value

    def name(self, node: ast.Name, kind: str = "property") -> object:
        return self.inner[node.id] if node.id in self.inner else self.names.find(node.id, kind)

    def unary(self, node: ast.UnaryOp) -> object:
        sign, apply = _UNARY[type(node.op)]
        return self.applied(sign, apply, self.data(node.operand))

    def binary(self, node: ast.BinOp) -> object:
        left, right = self.data(node.left), self.data(node.right)
        if type(node.op) not in _BINARY:
            raise ExpressionError("'@': not allowed in a robot file")
        sign, apply = _BINARY[type(node.op)]
        _check_size(sign, left, right)
        if sign == "%" and isinstance(left, str):
            apply = partial(formatted, budget=self.budget)
        result = self.applied(sign, apply, left, right)
        measure(result, self.budget)
        return result

    def compare(self, node: ast.Compare) -> object:
        left = self.data(node.left)
        result: object = True
        for op, other in zip(node.ops, node.comparators, strict=True):
            right = self.data(other)
            sign, apply = _COMPARE[type(op)]
            result = self.applied(sign, apply, left, right)
            if not result:
                break
            left = right
        return result

    def boolean(self, node: ast.BoolOp) -> object:
        wanted = isinstance(node.op, ast.Or)
        for part in node.values:
            result = self.value(part)
            if bool(result) is wanted:
                break
        return result

    def choice(self, node: ast.IfExp) -> object:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def items(self, nodes: Iterable[ast.expr]) -> list[object]:
        """Values of several expressions, starred ones spread."""
        found: list[Any] = []
        room = Room(self.budget)
        for node in nodes:
            more = self.iterated(node.value) if isinstance(node, ast.Starred) else [self.value(node)]
            for item in more:
                room.take(item)
                found.append(item)
        return found

    def sequence(self, node: ast.List | ast.Tuple) -> object:
        found = self.checked(self.items(node.elts))
        return found if isinstance(node, ast.List) else tuple(found)

    def mapping(self, node: ast.Dict) -> dict[object, object]:
        if None in node.keys:
            raise ExpressionError("'**': not allowed in a robot file")
        pairs = zip((self.value(key) for key in node.keys if key), map(self.value, node.values), strict=True)
        return _keyed(self.checked(list(pairs)))

    def subscript(self, node: ast.Subscript) -> object:
        owner: Any = self.value(node.value)
        if isinstance(owner, Function | Module | int | float | None):
            raise ExpressionError(f"'{ast.unparse(node)[:40]}': takes an item of {described(owner)}")
        index = self.value(node.slice)
        try:
            return self.checked(owner[index]) if isinstance(index, slice) else owner[index]
        except (IndexError, KeyError, AttributeError):
            raise ExpressionError(absent(owner, index)) from None
        except (TypeError, ValueError):
            raise ExpressionError(f"'{ast.unparse(node)[:40]}': {kind_of(index)} cannot be an index here") from None

    def slice(self, node: ast.Slice) -> slice:
        return slice(*(self.value(part) if part else None for part in (node.lower, node.upper, node.step)))

    def attribute(self, node: ast.Attribute) -> object:
        owner: Any = self.value(node.value)
        found = member(owner, node.attr)
        if not isinstance(found, Method):
            return found
        return Function(node.attr, partial(self.method, found.call, owner))

    def method(self, call: Callable[..., object], owner: Sized, *values: object, **named: object) -> object:
        self.budget.spend(1 + len(owner) // 50)
        return call(owner, *values, **named)

    def call(self, node: ast.Call) -> object:
        function = self.name(node.func, "function") if isinstance(node.func, ast.Name) else self.value(node.func)
        if not isinstance(function, Function):
            raise ExpressionError(f"'{ast.unparse(node.func)[:40]}' is not a function")
        values = self.items(node.args)
        named = {}
        for keyword in node.keywords:
            if keyword.arg is None:
                raise ExpressionError("'**': not allowed in a robot file")
            check_name(keyword.arg)
            named[keyword.arg] = self.value(keyword.value)
        for value in named.values():
            if not isinstance(value, Function):
                measure(value, self.budget)
        return self.called(function, values, named)

    def metered(self, value: object) -> object:
        """A function that another one calls, whose results count altogether; anything else as it is."""
        if not isinstance(value, Function):
            return value
        room = Room(self.budget)

        def call(*values: object, **named: object) -> object:
            result = value(*values, **named)
            room.take(result)
            return result

        return Function(value.name, call)

    def called(self, function: Function, values: list[object], named: dict[str, object]) -> object:
        self.budget.spend(5)
        try:
            result = function(*map(self.metered, values), **{key: self.metered(each) for key, each in named.items()})
        except (TypeError, ValueError, ArithmeticError, LookupError, AttributeError, RecursionError) as error:
            raise ExpressionError(f"{function.name}: {_failed(error, [*values, *named.values()])}") from None
        return self.checked(result)

    def comprehension(self, node: ast.ListComp | ast.GeneratorExp) -> object:
        return self.checked(self.gathered(node.generators, lambda: self.value(node.elt)))

    def mapping_comprehension(self, node: ast.DictComp) -> dict[object, object]:
        pairs = self.gathered(node.generators, lambda: (self.value(node.key), self.value(node.value)))
        return _keyed(self.checked(pairs))

    def gathered(self, generators: list[ast.comprehension], make: Callable[[], Checked]) -> list[Checked]:
        """What a comprehension's loops give."""
        found: list[Checked] = []
        room = Room(self.budget)
        outer = self.inner
        for _ in self.loops(generators):
            found.append(make())
            room.take(found[-1])
        self.inner = outer
        return found

    def loops(self, generators: list[ast.comprehension]) -> Iterator[None]:
        if not generators:
            yield
            return
        first, *rest = generators
        if first.is_async:
            raise ExpressionError("async: not allowed in a robot file")
        for item in self.iterated(first.iter):
            self.budget.spend(2)
            self.inner = {**self.inner, **_bound(first.target, item)}
            if all(self.value(condition) for condition in first.ifs):
                yield from self.loops(rest)

    def iterated(self, node: ast.expr) -> Iterable[object]:
        value = self.data(node)
        if not isinstance(value, str | list | tuple | dict | range):
            raise ExpressionError(f"'{ast.unparse(node)[:40]}' is {kind_of(value)}, not a list")
        return value

    def data(self, node: ast.expr) -> object:
        """A value that is measured, so that working on it has a known cost."""
        return self.checked(self.value(node))

    def checked(self, value: Checked) -> Checked:
        measure(value, self.budget)
        return value

    def applied(self, sign: str, apply: Callable[..., object], *values: object) -> object:
        try:
            return apply(*values)
        except ZeroDivisionError:
            raise ExpressionError("division by zero") from None
        except OverflowError:
            raise ExpressionError(f"'{sign}': the result is too large") from None
        except (TypeError, ValueError, LookupError):
            kinds = " and ".join(map(kind_of, values))
            raise ExpressionError(f"'{sign}' does not work with {kinds}") from None


_VISITS: dict[type[ast.AST], Callable[[_Walk, Any], Any]] = {
    ast.Constant: _Walk.constant, ast.Name: _Walk.name, ast.UnaryOp: _Walk.unary, ast.BinOp: _Walk.binary,
    ast.Compare: _Walk.compare, ast.BoolOp: _Walk.boolean, ast.IfExp: _Walk.choice, ast.List: _Walk.sequence,
    ast.Tuple: _Walk.sequence, ast.Dict: _Walk.mapping, ast.Subscript: _Walk.subscript, ast.Slice: _Walk.slice,
    ast.Attribute: _Walk.attribute, ast.Call: _Walk.call, ast.ListComp: _Walk.comprehension,
    ast.GeneratorExp: _Walk.comprehension, ast.DictComp: _Walk.mapping_comprehension,
}  # fmt: skip


def _check_size(sign: str, left: object, right: object) -> None:
    """Refuse what would be too large before it is computed."""
    if sign == "**":
        check_power(left, right)
    elif sign == "<<" and isinstance(right, int) and right > MOST_VALUES:
        raise ExpressionError(f"'<<' by {right}: too large")
    elif sign == "*":
        for value, times in ((left, right), (right, left)):
            if isinstance(value, str | list | tuple) and isinstance(times, int):
                check_repeat(value, times)


def _keyed(pairs: Iterable[tuple[object, object]]) -> dict[object, object]:
    try:
        return dict(pairs)
    except TypeError:
        raise ExpressionError("a list or mapping cannot be a key") from None


def _bound(target: ast.expr, value: object) -> dict[str, object]:
    """The names of a loop's target with their values."""
    if isinstance(target, ast.Name):
        check_name(target.id)
        return {target.id: value}
    if not isinstance(target, ast.Tuple | ast.List):
        raise ExpressionError(f"'{ast.unparse(target)[:40]}' cannot be a loop's variable")
    values = list(value) if isinstance(value, str | list | tuple) else [value]
    if len(values) != len(target.elts):
        raise ExpressionError(f"expected {len(target.elts)} values for '{ast.unparse(target)[:40]}', got {len(values)}")
    return {
        name: item for part, each in zip(target.elts, values, strict=True) for name, item in _bound(part, each).items()
    }


def _literal(value: object) -> object:
    """The value of a property: a text in quotes loses them; else it may be a number, or true or false."""
    if not isinstance(value, str):
        return value
    if len(value) >= 2 and value[0] == value[-1] == "'":
        return value[1:-1]
    if "_" in value:  # Python reads 1_000 as a number
        return value
    for read in (int, float):
        try:
            return read(value)
        except ValueError:
            continue
    return {"true": True, "True": True, "false": False, "False": False}.get(value, value)


def unknown(kind: str, name: str, own: Iterable[str], more: Iterable[str] = ()) -> ExpressionError:
    """The error for a name that nothing has; `more` may be meant, but is not listed."""
    names = sorted(own)
    close = nearest(name, [*names, *more])
    return ExpressionError(str(UnknownNameError(kind, name, [close] if close else names)))


def check_name(name: str) -> None:
    """Refuse the names by which Python reaches inside of things."""
    if name.startswith("__"):
        raise ExpressionError(f"names that begin with '__' are not allowed: {name}")


def property_name(name: object) -> str:
    """A name that an expression can use; Python reads look-alike letters as one."""
    usual = isinstance(name, str) and unicodedata.normalize("NFKC", name) == name and name.isidentifier()
    if not isinstance(name, str) or not usual or iskeyword(name):
        message = f"'{name}' is not a valid name for a property: letters, digits, _"
        raise ExpressionError(message[:300])
    if name.startswith("__"):
        raise ExpressionError(f"'{name}': names that begin with '__' are not allowed"[:300])
    return name


def member(owner: object, name: str) -> object:
    """What a name after a dot means: a value, or a Method."""
    check_name(name)
    if isinstance(owner, Module):
        if name not in owner.members:
            raise unknown(f"member of {owner.name}", name, owner.members)
        return owner.members[name]
    if isinstance(owner, Namespace):
        return _in_space(owner, name)
    methods = next((found for kind, found in METHODS.items() if isinstance(owner, kind)), {})
    if name in methods:
        return Method(methods[name])
    if isinstance(owner, DottedMapping):
        if dict.__contains__(owner, name) and not hasattr(dict, name):
            return owner[name]
        raise ExpressionError(absent(owner, name))
    raise ExpressionError(f"'.{name}': {described(owner)} has no such member in a robot file")


def _in_space(space: Namespace, name: str) -> object:
    try:
        return space[name]
    except KeyError:
        raise unknown("property", name, (key for key in dict.keys(space) if key.isidentifier())) from None


def absent(owner: Sized, index: object) -> str:
    """The message for an item that is not there."""
    if isinstance(owner, dict):
        return str(UnknownNameError("key", str(index), [str(key) for key in dict.keys(owner)]))
    return f"item {index} of {len(owner)}: {kind_of(owner)} counts from 0"


def described(value: object) -> str:
    """What a message calls a value."""
    return f"'{value.name}'" if isinstance(value, Function | Module) else kind_of(value)
