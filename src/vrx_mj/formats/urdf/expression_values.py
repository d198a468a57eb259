"""Values of expressions in a xacro file: how large they may grow, which functions make them, and what work is left."""

import datetime as dt
import functools
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

WORK = 3_000_000
"""Work that the expansion of one file may take: about 1 us each; a WAM-V with VRX's sensors takes 0.35 million."""
MOST_TEXT = 4_000_000
"""Characters that the expressions and substitutions of one file may make altogether."""
LONGEST_TEXT = 20_000
"""Characters of a text in an expression."""
MOST_VALUES = 20_000
"""Values in a list or mapping in an expression, those in its items included."""
MOST_DIGITS = 300
"""Width and precision of a formatted number, and digits that one is rounded to."""
LARGEST_BITS = 4096
"""Most bits of a whole number in an expression; a float holds at most 1024."""
DEEPEST = 20
"""Levels of lists in lists."""

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_PLAIN = float | dt.date | None
_KINDS: dict[type[Any] | Any, str] = {
    bool: "true or false", int: "a number", float: "a number", complex: "a complex number", str: "text",
    list: "a list", tuple: "a list", range: "a range", dict: "a mapping",
}  # fmt: skip


class ExpressionError(Exception):
    """What is wrong with an expression or the element it is in: the text is all a user needs."""


class Function:
    """A function that an expression may call."""

    def __init__(self, name: str, call: Callable[..., object]) -> None:
        self.name = name
        self._call = call

    def __call__(self, *values: object, **named: object) -> object:
        """Its value."""
        return self._call(*values, **named)

    def __str__(self) -> str:
        raise ExpressionError(f"'{self.name}' is a function; call it: {self.name}(...)")

    __repr__ = __str__


class Module:
    """Functions and constants under a name: `math.pi`, `xacro.load_yaml`."""

    def __init__(self, name: str, members: Mapping[str, object]) -> None:
        self.name = name
        self.members = members

    def __str__(self) -> str:
        raise ExpressionError(f"'{self.name}' is not a value; write {self.name}.NAME")

    __repr__ = __str__


class Budget:
    """Work that is left, about 1 us each, and text that may still be made, in characters."""

    def __init__(self, work: int = WORK, text: int = MOST_TEXT) -> None:
        self.left = work
        self.text_left = text

    def spend(self, work: int) -> None:
        """Take this much, or give up."""
        self.left -= work
        if self.left < 0:
            raise ExpressionError("takes too much work to expand; is there a loop, or a macro that repeats itself?")

    def write(self, value: object) -> None:
        """Count what is made and kept, if it is text, or give up."""
        if isinstance(value, str):
            self.text_left -= len(value)
            if self.text_left < 0:
                raise ExpressionError(f"the expressions make more than {MOST_TEXT / 1e6:g} MB of text")


class Room:
    """How many values a list in the making may still take, those in its items included."""

    def __init__(self, budget: Budget) -> None:
        self._budget = budget
        self._left = MOST_VALUES

    def take(self, value: object) -> None:
        """Count one more item; functions, which are no data, are not counted."""
        if isinstance(value, Function):
            return
        self._left -= measure(value, self._budget)
        if self._left < 0:
            raise ExpressionError(f"a list or mapping of more than {MOST_VALUES} values is too large")


def measure(value: object, budget: Budget) -> int:
    """How many values a value holds, itself included; a value that is too large or of a foreign kind is an error."""
    return _measure(value, budget, MOST_VALUES, 0)


def kind_of(value: object) -> str:
    """What a message calls a value of this type."""
    if value is None:
        return "nothing"
    return next((words for kind, words in _KINDS.items() if isinstance(value, kind)), "something else")


def _measure(value: object, budget: Budget, room: int, depth: int) -> int:
    budget.spend(2)
    if isinstance(value, str):
        return _measured_text(value, budget)
    if isinstance(value, int):
        return _measured_number(value, budget)
    if isinstance(value, _PLAIN):
        return 1
    if depth > DEEPEST:
        raise ExpressionError(f"lists are nested deeper than {DEEPEST} levels")
    total = 1
    for item in _items(value):
        total += _measure(item, budget, room - total, depth + 1)
        if total > room:
            raise ExpressionError(f"a list or mapping of more than {MOST_VALUES} values is too large")
    return total


def _items(value: object) -> Iterable[object]:
    """What a list or mapping holds; a range counts as its numbers would."""
    if isinstance(value, range):
        if value[MOST_VALUES : MOST_VALUES + 1]:
            raise ExpressionError(f"a list or mapping of more than {MOST_VALUES} values is too large")
        return value
    if isinstance(value, dict):
        return [part for item in dict.items(value) for part in item]
    if isinstance(value, list | tuple):
        return list.__iter__(value) if isinstance(value, list) else value
    if isinstance(value, Function | Module):
        str(value)
    raise ExpressionError(f"gives {kind_of(value)}, which a robot file cannot hold")


def _measured_number(number: int, budget: Budget) -> int:
    if number.bit_length() > LARGEST_BITS:
        raise ExpressionError(f"a whole number of more than {LARGEST_BITS} bits is too large")
    budget.spend(number.bit_length() // 64)
    return 1


def _measured_text(text: str, budget: Budget) -> int:
    if len(text) > LONGEST_TEXT:
        raise ExpressionError(f"a text of more than {LONGEST_TEXT} characters is too long")
    odd = _NOT_XML.search(text)
    if odd:
        raise ExpressionError(f"text has character U+{ord(odd[0]):04X}, which a robot file cannot hold")
    budget.spend(len(text) // 100)
    return 1 + len(text) // 8


class DottedList(list[Any]):
    """A list from YAML, whose mappings have dotted names."""

    def __getitem__(self, index: Any) -> Any:
        return dotted(super().__getitem__(index))

    def __iter__(self) -> Iterator[object]:
        return map(dotted, super().__iter__())


class DottedMapping(dict[Any, Any]):
    """A mapping from YAML, whose keys may be written after a dot."""

    def __getitem__(self, key: object) -> object:
        return dotted(super().__getitem__(key))


def dotted(value: object) -> object:
    """A value from YAML with dotted names."""
    if isinstance(value, dict):
        return DottedMapping(value)
    return DottedList(value) if isinstance(value, list) else value


_MOST_CHOICES = 500


def check_power(base: object, exponent: object) -> None:
    """Refuse a power that has too many digits to be computed."""
    if isinstance(base, int) and isinstance(exponent, int) and base.bit_length() * abs(exponent) > 4 * MOST_VALUES:
        raise ExpressionError(f"{base} to the power {exponent} is too large" if base < 10**9 else "power too large")


def check_repeat(value: str | list[object] | tuple[object, ...], times: int) -> None:
    """Refuse a text or list that is repeated too often."""
    limit = LONGEST_TEXT if isinstance(value, str) else MOST_VALUES
    if len(value) * times > limit:
        raise ExpressionError(f"repeats {'a text' if isinstance(value, str) else 'a list'} to more than {limit} items")


def _rounded(value: float, ndigits: int | None = None) -> float:
    if isinstance(ndigits, int) and abs(ndigits) > MOST_DIGITS:
        raise ExpressionError(f"round to {ndigits} digits: at most {MOST_DIGITS}")
    return round(value, ndigits)


def _listed(function: Callable[..., Iterable[object]]) -> Callable[..., list[object]]:
    """A function whose result is a list at once, not an iterator."""
    return lambda *values, **named: list(function(*values, **named))


def _few(function: Callable[..., int]) -> Callable[..., int]:
    """A counting function whose result grows beyond all bounds."""

    def counted(*values: object) -> int:
        if any(isinstance(value, int) and value > _MOST_CHOICES for value in values):
            raise ExpressionError(f"{function.__name__}: expected at most {_MOST_CHOICES}")
        return function(*values)

    return counted


def _product(values: Iterable[object], *, start: object = 1) -> object:
    result: Any = 1
    for value in (start, *values):
        if isinstance(value, int | float):
            result *= value
        if not isinstance(value, int | float) or (isinstance(result, int) and result.bit_length() > LONGEST_TEXT):
            raise ExpressionError("prod: the product is not a number, or too large")
    return result


def _multiple(*values: int) -> int:
    def step(one: int, other: int) -> int:
        if one.bit_length() > LONGEST_TEXT:
            raise ExpressionError("lcm: the result is too large")
        return math.lcm(one, other)

    return functools.reduce(step, values, 1)


def _sum(values: Iterable[float], start: float = 0) -> float:
    numbers = [start, *values]
    if any(isinstance(value, list | tuple) for value in numbers):
        raise ExpressionError("sum: expected numbers, got lists")
    return sum(numbers)


def _of_numbers(function: Callable[..., object]) -> Callable[..., object]:
    """A function of `math`, kept from texts and from lists of lists: of those it might make long ones."""

    def computed(*values: object, **named: object) -> object:
        for value in values:
            items = value if isinstance(value, list | tuple) else [value]
            if not all(isinstance(item, int | float) for item in items):
                raise TypeError
        return function(*values, **named)

    return computed


def _replace(text: str, old: str, new: str, count: int = -1) -> str:
    check_repeat(new, text.count(old))
    return text.replace(old, new, count)


def _join(separator: str, items: Iterable[str]) -> str:
    parts = list(items)
    check_repeat(separator, len(parts))
    return separator.join(parts)


def _wide(method: Callable[..., str]) -> Callable[..., str]:
    def widened(text: str, width: int, *fill: str) -> str:
        if isinstance(width, int):
            check_repeat(" ", width)
        return method(text, width, *fill)

    return widened


def _plain(kind: type[object], names: str) -> dict[str, Callable[..., object]]:
    return {name: getattr(kind, name) for name in names.split()}


METHODS: Mapping[type[Any], Mapping[str, Callable[..., Any]]] = {
    str: {
        **_plain(
            str,
            "capitalize casefold count endswith find index isalnum isalpha isdecimal isdigit islower isnumeric "
            "isspace isupper lower lstrip partition removeprefix removesuffix rfind rindex rpartition rsplit rstrip "
            "split splitlines startswith strip swapcase title upper",
        ),
        "replace": _replace,
        "join": _join,
        "center": _wide(str.center),
        "ljust": _wide(str.ljust),
        "rjust": _wide(str.rjust),
        "zfill": _wide(str.zfill),
    },
    dict: {"get": dict.get, **{name: _listed(getattr(dict, name)) for name in ("items", "keys", "values")}},
    list: _plain(list, "count index"),
    tuple: _plain(tuple, "count index"),
    range: _plain(range, "count index"),
}
"""Methods of texts, mappings and lists that change nothing, and neither format nor reach inside."""

MATH: Mapping[str, Any] = {
    **{name: value for name, value in vars(math).items() if not name.startswith("_") and not callable(value)},
    **{
        name: Function(name, _of_numbers(value))
        for name, value in vars(math).items()
        if not name.startswith("_") and callable(value)
    },
    **{name: Function(name, _few(getattr(math, name))) for name in ("comb", "factorial", "perm")},
    "lcm": Function("lcm", _multiple),
    "prod": Function("prod", _product),
}
"""Python's `math`, guarded."""

_BUILTIN: Mapping[str, Callable[..., Any]] = {
    "list": list, "dict": dict, "map": _listed(map), "len": len, "str": str, "float": float, "int": int,
    "bool": bool, "min": min, "max": max, "round": _rounded,
}  # fmt: skip
_MORE: Mapping[str, Callable[..., Any]] = {
    "abs": abs, "all": all, "any": any, "divmod": divmod, "enumerate": _listed(enumerate), "filter": _listed(filter),
    "ord": ord, "repr": repr, "reversed": _listed(reversed), "sum": _sum, "tuple": tuple, "zip": _listed(zip),
    "sorted": sorted, "range": range,
}  # fmt: skip

GLOBALS: Mapping[str, Any] = {
    **{name: Function(name, call) for name, call in _BUILTIN.items()},
    **MATH,
    "True": True,
    "False": False,
}
"""Names that xacro knows everywhere."""
EVERYWHERE: Mapping[str, Any] = {name: Function(name, call) for name, call in _MORE.items()}
"""Names that xacro knows as `python.NAME` only; without it they are understood too."""


def python_module() -> Module:
    """What xacro knows as `python`."""
    return Module("python", {name: value for name, value in {**GLOBALS, **EVERYWHERE}.items() if name not in MATH})


_PIECE = re.compile(
    r"[^%]+|%%|%(?P<key>\([^()]*\))?(?P<flags>[-#0 +]*)(?P<width>\*|[0-9]*)(?:\.(?P<precision>\*|[0-9]*))?"
    r"[hlL]?(?P<kind>[diouxXeEfFgGcrsa])"
)
"""Plain text, a '%' or a conversion of Python's, in full."""


def formatted(pattern: str, values: object, budget: Budget) -> str:
    """What `pattern % values` is.

    Raises:
        ExpressionError: a width or precision is above the limit, or the text becomes too long.
        TypeError, ValueError, LookupError: as Python does, for values that do not fit the pattern.
    """
    rest: Iterator[Any] = iter(values if isinstance(values, tuple) else (values,))
    parts: list[str] = []
    place = length = 0
    while place < len(pattern):
        piece = _PIECE.match(pattern, place)
        if piece is None:
            raise ValueError("unsupported format")
        parts.append(_written(piece, values, rest, budget))
        place, length = piece.end(), length + len(parts[-1])
        if length > LONGEST_TEXT:
            raise ExpressionError(f"a text of more than {LONGEST_TEXT} characters is too long")
    if not isinstance(values, list | dict | range) and next(rest, rest) is not rest:
        raise TypeError("not all values are used")
    return "".join(parts)


def _written(piece: re.Match[str], values: object, rest: Iterator[object], budget: Budget) -> str:
    if piece["kind"] is None:
        return piece[0].replace("%%", "%")
    for digits in (piece["width"], piece["precision"] or ""):
        if digits == "*" or len(digits.lstrip("0")) > len(str(MOST_DIGITS)) or int(digits or 0) > MOST_DIGITS:
            raise ExpressionError(f"'{piece[0][:20]}': a width is at most {MOST_DIGITS}")
    value = _taken(piece["key"], values, rest)
    budget.spend(5 * measure(value, budget))
    precision = "" if piece["precision"] is None else f".{piece['precision']}"
    return f"%{piece['flags']}{piece['width']}{precision}{piece['kind']}" % (value,)


def _taken(key: str | None, values: object, rest: Iterator[object]) -> object:
    """The value that a conversion is for: that of its key, or the next one."""
    if key is None:
        try:
            return next(rest)
        except StopIteration:
            raise TypeError("not enough values") from None
    if not isinstance(values, dict):
        raise TypeError("a key needs a mapping")
    return values[key[1:-1]]


def tokens(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    """A text split at any of some characters."""
    if not sep or set(sep) & set("[]\\^-"):
        raise ExpressionError(f"tokenize: '{sep[:20]}' cannot be a separator")
    found = re.split(f"[{sep}]", text)
    return [item for item in found if item] if skip_empty else found


def fatal(*words: object) -> None:
    """Stop the expansion with a message."""
    raise ExpressionError(" ".join(map(str, words)))


def silent(*_: object, **__: object) -> str:
    """An empty text, for a message that is not shown."""
    return ""
