"""Errors that a user can cause, each naming the thing, the value and what is allowed."""

import difflib
import warnings
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Self

LONGEST_NAME = 80
"""Characters of a name in a message."""
LONGEST_LINE = 1500
"""Characters of a line of a message."""
LONGEST_VALUE = 60
"""Characters of a value in a message."""
_LONGEST_PATH = 300
"""Characters of a path or a key in a message, and of a name for which a near one is looked for."""
_MOST_LINES = 100
_SHOWN_NAMES = 12
_SHOWN_PROBLEMS = 40


def first_lines(lines: Iterable[str], most: int) -> list[str]:
    """The first of some lines, and after them how many more there are: "and 7 more"."""
    known = list(lines)
    return [*known[:most], *([f"and {len(known) - most} more"] if len(known) > most else [])]


def first_names(names: Iterable[str], most: int = 3) -> str:
    """The first of some names in a line, and how many more there are: "a, b and 7 more"."""
    known = list(names)
    return ", ".join(known[:most]) + (f" and {len(known) - most} more" if len(known) > most else "")


def shorten(text: object, most: int = LONGEST_NAME) -> str:
    """A user's text as a message shows it: on one line, without control characters, cut in the middle if long.

    Args:
        text: a name, path or value.
        most: characters that are shown.
    """
    shown = str(text)
    if len(shown) > most:
        tail = most // 3
        shown = f"{shown[: most - tail - 1]}…{shown[len(shown) - tail :]}"
    if shown.isprintable():
        return shown
    return "".join(char if char.isprintable() else repr(char)[1:-1] for char in shown)


def _cut_arguments(arguments: tuple[object, ...]) -> tuple[object, ...]:
    """Arguments of an error, with texts cut to lines of a bounded length."""
    return tuple(_cut_text(each) if isinstance(each, str) else each for each in arguments)


def _cut_text(text: str) -> str:
    if len(text) <= LONGEST_LINE:
        return text
    lines = text.split("\n", _MOST_LINES)
    return "\n".join(line if len(line) <= LONGEST_LINE else shorten(line, LONGEST_LINE) for line in lines)


class VrxError(Exception):
    """Base class of all errors that a user can cause; the message names the thing, its value and what is allowed.

    A line that is too long to read is cut in its middle.
    """

    def __init__(self, *arguments: object) -> None:
        super().__init__(*_cut_arguments(arguments))


class VrxWarning(UserWarning):
    """Warning about legal but suspicious input, with its numbers and the threshold."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*_cut_arguments(arguments))


def warn(text: str, stacklevel: int = 1) -> None:
    """Give a VrxWarning, `stacklevel` calls above the function that finds what is suspicious."""
    warnings.warn(text, VrxWarning, stacklevel=stacklevel + 1)


def ignore_warnings() -> AbstractContextManager[object]:
    """A context in which no VrxWarning is given."""
    return warnings.catch_warnings(action="ignore", category=VrxWarning)


class ChoiceError(VrxError):
    """A folder that contains several files to choose from.

    `choices` are the words of a command line for each file, with what it opens.
    """

    def __init__(self, folder: str, kind: str, choices: Mapping[str, str]) -> None:
        self.folder = folder
        self.kind = kind
        self.choices = dict(choices)
        super().__init__(self.text("run"))

    def __reduce__(self) -> tuple[type["ChoiceError"], tuple[str, str, dict[str, str]]]:
        return type(self), (self.folder, self.kind, self.choices)

    def text(self, command: str) -> str:
        """The message, with the lines to type for one of the commands of `vrx-mj`."""
        typed = [f"vrx-mj {command} {words}" for words in self.choices]
        width = min(max(map(len, typed)), LONGEST_NAME)
        rows = [
            f"{line:<{width}}  # {about}" if about else line
            for line, about in zip(typed, self.choices.values(), strict=True)
        ]
        head = f"{self.folder} has {len(rows)} {self.kind}; type one of these:"
        return "\n  ".join([head, *first_lines(rows, _SHOWN_PROBLEMS)])


def quote(value: object) -> str:
    """A value as Python writes it, in one line and shortened; a large object by its type."""
    try:
        text = repr(value)
    except Exception:  # anybody's `__repr__`; and Python writes no number of more than 4300 digits
        return f"a value of type {type(value).__name__}"
    if len(text) > LONGEST_VALUE and text.startswith("<"):
        return type(value).__name__
    return shorten(" ".join(text.split()), LONGEST_VALUE)


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that `name` most likely means, or None if none is close."""
    if len(name) > _LONGEST_PATH:
        return None
    folded = {other.casefold(): other for other in sorted(known, reverse=True) if len(other) <= _LONGEST_PATH}
    found = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.7)
    return folded[found[0]] if found else None


class UnknownNameError(VrxError):
    """An unknown name: "no thruster named 'left'; known: port, starboard".

    `advice`, if there is any, takes the place of the known names.
    """

    def __init__(self, kind: str, name: object, known: Iterable[str], advice: str | None = None) -> None:
        self.kind = kind
        self.name = name
        self.known = tuple(known)
        self.advice = advice
        text = name if isinstance(name, str) else quote(name)
        self._close = nearest(text, self.known)
        super().__init__(f"no {kind} named '{shorten(text)}'; {self._hint()}")

    def __reduce__(self) -> tuple[type["UnknownNameError"], tuple[str, object, tuple[str, ...], str | None]]:
        return type(self), (self.kind, self.name, self.known, self.advice)

    @property
    def left_out(self) -> int:
        """Number of known names that the message does not show, for a name that resembles none of them."""
        return 0 if self._close or self.advice else max(0, len(self.known) - _SHOWN_NAMES)

    def _hint(self) -> str:
        if self.advice is not None:
            return self.advice
        if self._close is not None:
            return f"did you mean '{shorten(self._close)}'?"
        return f"known: {first_names(map(shorten, self.known), _SHOWN_NAMES) or 'none'}"


@dataclass(frozen=True)
class Problem:
    """One mistake in an input file. Lines and columns count from 1, and are None where they are unknown."""

    file: str
    """Path of the file, or a name in its place."""
    line: int | None
    """Line, from 1."""
    column: int | None
    """Column, from 1."""
    key: str
    """Path of the key, as `sea.gain`."""
    message: str
    """What is wrong, the value, and what is allowed."""

    def __str__(self) -> str:
        parts = (shorten(self.file, _LONGEST_PATH), self.line, self.column)
        place = ":".join(str(part) for part in parts if part is not None)
        key = f"{shorten(self.key, _LONGEST_PATH)}: " if self.key else ""
        return f"{place}: {key}{self.message}"


class ConfigError(VrxError):
    """All mistakes in an input file, one per line."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        lines = [str(problem) for problem in self.problems[:_SHOWN_PROBLEMS]]
        rest = len(self.problems) - _SHOWN_PROBLEMS
        super().__init__("\n".join(lines + ([f"and {rest} more problems"] if rest > 0 else [])))

    @classmethod
    def of(cls, file: str, message: str, *, key: str = "", line: int | None = None, column: int | None = None) -> Self:
        """The error about one mistake, of a whole file unless a key or a place is given.

        Args:
            file: path of the file, or a name in its place.
            message: what is wrong, the value, and what is allowed.
            key: path of the key.
            line: line, from 1.
            column: column, from 1.
        """
        return cls([Problem(file, line, column, key, message)])

    def __reduce__(self) -> tuple[type["ConfigError"], tuple[tuple[Problem, ...]]]:
        return type(self), (self.problems,)


class CompileError(VrxError):
    """A valid world that cannot be compiled to MJCF."""


class StateError(VrxError):
    """A state or a saved world that is damaged, of another version, or does not belong to this simulation."""


class CommandError(VrxError):
    """A command that a boat cannot take: an unknown thruster, a wrong shape, a value that is not finite."""


class DivergedError(VrxError):
    """A state that became NaN or too large; the message names the step, the time and the body."""


class NetworkError(VrxError):
    """A network address that cannot be opened or reached; the message names what occupies it."""


class RecordError(VrxError):
    """A recording that cannot be written or read."""


class SensorError(VrxError):
    """A sensor that cannot measure in this world, or cannot carry out a request."""


class RenderError(VrxError):
    """Pictures that cannot be drawn on this machine; the message names what to install."""


class VideoError(VrxError):
    """A video that cannot be made: an unknown kind of file, an invalid size, an encoder that is not installed."""
