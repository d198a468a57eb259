"""What a file from elsewhere may cost: how much work, and how large a value in an expression may grow."""

import datetime as dt
import re
from collections.abc import Mapping
from typing import Any

__all__ = [
    "LONGEST_TEXT",
    "MOST_DIGITS",
    "MOST_VALUES",
    "Budget",
    "ExpressionError",
    "Function",
    "Module",
    "Room",
    "kind_of",
    "measure",
]

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
"""Of a whole number in an expression; any above 1024 is no float."""
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

    def __init__(self, name: str, call: Any) -> None:
        self.name = name
        self._call = call

    def __call__(self, *values: Any, **named: Any) -> Any:
        """Its value."""
        return self._call(*values, **named)

    def __str__(self) -> str:
        raise ExpressionError(f"'{self.name}' is a function; call it: {self.name}(...)")

    __repr__ = __str__


class Module:
    """Functions and constants under a name: `math.pi`, `xacro.load_yaml`."""

    def __init__(self, name: str, members: Mapping[str, Any]) -> None:
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

    def write(self, value: Any) -> None:
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

    def take(self, value: Any) -> None:
        """Count one more item; functions, which are no data, are not counted."""
        if isinstance(value, Function):
            return
        self._left -= measure(value, self._budget)
        if self._left < 0:
            raise ExpressionError(f"a list or mapping of more than {MOST_VALUES} values is too large")


def measure(value: Any, budget: Budget) -> int:
    """How many values a value holds, itself included; a value that is too large or of a foreign kind is an error."""
    return _measure(value, budget, MOST_VALUES, 0)


def kind_of(value: Any) -> str:
    """What a message calls a value of this type."""
    if value is None:
        return "nothing"
    return next((words for kind, words in _KINDS.items() if isinstance(value, kind)), "something else")


def _measure(value: Any, budget: Budget, room: int, depth: int) -> int:
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


def _items(value: Any) -> Any:
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
