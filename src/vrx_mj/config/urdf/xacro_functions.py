"""Functions that expressions in a xacro file may call, guarded against what would fill the memory."""

import functools
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from vrx_mj.config.urdf.xacro_limits import (
    LONGEST_TEXT,
    MOST_DIGITS,
    MOST_VALUES,
    ExpressionError,
    Function,
    Module,
)

__all__ = ["EVERYWHERE", "GLOBALS", "MATH", "METHODS", "check_power", "check_repeat", "python_module"]

_MOST_CHOICES = 500


def check_power(base: Any, exponent: Any) -> None:
    """Refuse a power that has too many digits to be computed."""
    if isinstance(base, int) and isinstance(exponent, int) and base.bit_length() * abs(exponent) > 4 * MOST_VALUES:
        raise ExpressionError(f"{base} to the power {exponent} is too large" if base < 10**9 else "power too large")


def check_repeat(value: str | list[Any] | tuple[Any, ...], times: int) -> None:
    """Refuse a text or list that is repeated too often."""
    limit = LONGEST_TEXT if isinstance(value, str) else MOST_VALUES
    if len(value) * times > limit:
        raise ExpressionError(f"repeats {'a text' if isinstance(value, str) else 'a list'} to more than {limit} items")


def _rounded(value: Any, ndigits: Any = None) -> Any:
    if isinstance(ndigits, int) and abs(ndigits) > MOST_DIGITS:
        raise ExpressionError(f"round to {ndigits} digits: at most {MOST_DIGITS}")
    return round(value, ndigits)


def _listed(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function whose result is a list at once, not an iterator."""
    return lambda *values, **named: list(function(*values, **named))


def _few(function: Callable[..., int]) -> Callable[..., int]:
    """A counting function whose result grows beyond all bounds."""

    def counted(*values: Any) -> int:
        if any(isinstance(value, int) and value > _MOST_CHOICES for value in values):
            raise ExpressionError(f"{function.__name__}: expected at most {_MOST_CHOICES}")
        return function(*values)

    return counted


def _product(values: Iterable[Any], *, start: Any = 1) -> Any:
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


def _sum(values: Iterable[Any], start: Any = 0) -> Any:
    numbers = [start, *values]
    if any(isinstance(value, list | tuple) for value in numbers):
        raise ExpressionError("sum: expected numbers, got lists")
    return sum(numbers)


def _of_numbers(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of `math`, kept from texts and from lists of lists: of those it might make long ones."""

    def computed(*values: Any, **named: Any) -> Any:
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


def _plain(kind: type[Any], names: str) -> dict[str, Callable[..., Any]]:
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
