"""Errors that a user can cause, each naming the thing, the value and what is allowed."""

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = [
    "CommandError",
    "CompileError",
    "ConfigError",
    "DivergedError",
    "NetworkError",
    "Problem",
    "RecordError",
    "RenderError",
    "SensorError",
    "StateError",
    "UnknownNameError",
    "VideoError",
    "VrxError",
    "VrxWarning",
    "nearest",
    "printable",
    "shown",
]

_SHOWN_NAMES = 12
_SHOWN_PROBLEMS = 40
_LONGEST = 60
"""Characters of a value in a message."""
_LONGEST_NAME = 120
"""Characters of a name in a message."""


class VrxError(Exception):
    """Base class of all errors that a user can cause; the message names the thing, its value and what is allowed."""


class VrxWarning(UserWarning):
    """Warning about legal but suspicious input, with its numbers and the threshold."""


def shown(value: object) -> str:
    """A value as Python writes it, in one line and shortened; a large object by its type."""
    try:
        text = repr(value)
    except Exception:  # anybody's `__repr__`; and Python writes no number of more than 4300 digits
        return f"a value of type {type(value).__name__}"
    text = printable(" ".join(text.split()))
    if len(text) > _LONGEST and text.startswith("<"):
        return type(value).__name__
    return _cut(text, _LONGEST)


def printable(text: str) -> str:
    """Text without line breaks and other characters that a terminal does not print."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _cut(text: str, longest: int) -> str:
    return text if len(text) <= longest else f"{text[:longest]}..."


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that `name` most likely means, or None if none is close."""
    folded = {other.casefold(): other for other in sorted(known, reverse=True)}
    found = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.7)
    return folded[found[0]] if found else None


class UnknownNameError(VrxError):
    """An unknown name: "no thruster named 'left'; known: port, starboard"."""

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.known = tuple(known)
        text = name if isinstance(name, str) else shown(name)
        self._close = nearest(text, self.known) if len(text) <= _LONGEST_NAME else None
        super().__init__(f"no {kind} named '{printable(_cut(text, _LONGEST_NAME))}'; {self._hint()}")

    def __reduce__(self) -> tuple[type["UnknownNameError"], tuple[str, object, tuple[str, ...]]]:
        return type(self), (self.kind, self.name, self.known)

    @property
    def left_out(self) -> int:
        """How many of the known names the message does not show, for a name that resembles none of them."""
        return 0 if self._close else max(0, len(self.known) - _SHOWN_NAMES)

    def _hint(self) -> str:
        if self._close is not None:
            return f"did you mean '{self._close}'?"
        names = ", ".join(self.known[:_SHOWN_NAMES]) or "none"
        rest = len(self.known) - _SHOWN_NAMES
        return f"known: {names}" + (f" and {rest} more" if rest > 0 else "")


@dataclass(frozen=True)
class Problem:
    """One mistake in an input file. Lines and columns count from 1, and are None where they are unknown."""

    file: str
    """Path of the file, or what stands for it."""
    line: int | None
    """Line, from 1."""
    column: int | None
    """Column, from 1."""
    key: str
    """Path of the key, as `sea.gain`."""
    message: str
    """What is wrong, the value, and what is allowed."""

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        return f"{place}: {self.key}: {self.message}" if self.key else f"{place}: {self.message}"


class ConfigError(VrxError):
    """All mistakes in an input file, one per line."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        lines = [str(problem) for problem in self.problems[:_SHOWN_PROBLEMS]]
        rest = len(self.problems) - _SHOWN_PROBLEMS
        super().__init__("\n".join(lines + ([f"and {rest} more problems"] if rest > 0 else [])))

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
