"""Arguments of public functions: checked once, where they come in, or refused in a line that names them."""

import contextlib
import errno
import itertools
import math
import numbers
import operator
import os
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

from vrx_mj.errors import CommandError, UnknownNameError, VrxError, quote

Names = tuple[str, ...]


def check_kind(taker: str, given: object, kind: type, wanted: str, error: type[VrxError] = CommandError) -> None:
    """Check that an argument is of a kind; `wanted` describes how to get one.

    Raises:
        VrxError: it is not; of the class `error`.
    """
    if not isinstance(given, kind):
        raise error(f"{taker} takes {wanted}, not {quote(given)}")


def check_name(kind: str, name: object, known: Collection[str]) -> None:
    """Check that the name is among those that are known.

    Raises:
        UnknownNameError: it is unknown, or not a string.
    """
    if not isinstance(name, str) or name not in known:
        raise UnknownNameError(kind, name, known)


def as_path(name: str, given: object, error: type[VrxError] = CommandError) -> Path:
    """The path that is given as text or as a path.

    Raises:
        VrxError: it is neither, or no file can be called so; of the class `error`.
    """
    wanted = "a path is needed"
    if isinstance(given, str | os.PathLike):
        try:
            path = Path(given)
            os.lstat(path)
        except OSError as problem:
            if problem.errno != errno.ENAMETOOLONG:
                return path
            wanted = "the name is too long"
        except (TypeError, ValueError):  # of bytes; with a null character, or one that no encoding has
            pass
        else:
            return path
    raise error(f"invalid {name} {quote(given)}: {wanted}")


def as_text(name: str, given: object) -> str:
    """The text, which UTF-8 can hold.

    Raises:
        CommandError: it is not text.
    """
    if isinstance(given, str) and given.encode(errors="replace").decode() == given:
        return given
    raise CommandError(f"invalid {name} {quote(given)}: text is needed")


def as_int(name: str, given: object, least: float = -math.inf, most: float = math.inf) -> int:
    """The value as an int.

    Raises:
        CommandError: it is not a whole number from `least` to `most`.
    """
    try:
        value = operator.index(given)  # type: ignore[arg-type]
    except TypeError:
        raise CommandError(f"invalid {name} {quote(given)}: a whole number is needed") from None
    if not least <= value <= most:
        limits = f"from {least:g} to {most:.15g}" if math.isfinite(most) else f"of {least:g} or more"
        raise CommandError(f"invalid {name} {quote(given)}: a whole number {limits} is needed")
    return value


def as_seed(given: object) -> int:
    """The value as a seed.

    Raises:
        CommandError: it is not a whole number from 0 to 2^63 - 1.
    """
    value = as_int("seed", given)
    if not 0 <= value < 2**63:
        raise CommandError(f"invalid seed {quote(given)}: a whole number from 0 to 2^63 - 1 is needed")
    return value


def as_number(given: object) -> float:
    """The value as a float; NaN if it is not a number."""
    if type(given) is float:
        return given
    value: Any = given
    text = isinstance(value, str | bytes | bytearray)
    imaginary = isinstance(value, numbers.Complex) and not isinstance(value, numbers.Real)
    array = hasattr(value, "ndim") and (value.ndim or hasattr(value, "mask"))
    if text or imaginary or array:
        return math.nan
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def as_flag(name: str, given: object) -> bool:
    """The value as a bool.

    Raises:
        CommandError: it is neither True nor False.
    """
    value = as_number(given)
    if value not in {0.0, 1.0}:
        raise CommandError(f"invalid {name} {quote(given)}: True or False is needed")
    return bool(value)


def as_numbers(name: str, given: object, count: int, most: float) -> tuple[float, ...]:
    """The values as so many floats.

    Raises:
        CommandError: they are not so many numbers below `most`.
    """
    values: tuple[float, ...] = ()
    if isinstance(given, Iterable) and not isinstance(given, str | bytes):
        with contextlib.suppress(TypeError):  # an array of no dimensions
            values = tuple(map(as_number, itertools.islice(given, count + 1)))
    if len(values) != count or not all(abs(value) < most for value in values):
        words = {3: "three", 6: "six"}[count]
        raise CommandError(f"invalid {name} {quote(given)}: {words} numbers below {most:g} are needed")
    return values


def parse_ports(option: str, text: str, needed: str, first: str = "") -> dict[str, int]:
    """Ports by boat from `BOAT:PORT,BOAT:PORT`; `first` is the boat of a port alone, if such are allowed.

    Raises:
        CommandError: the text is no such list; `needed` says what is.
    """
    pairs = [(boat or first, port) for boat, _, port in (word.rpartition(":") for word in text.split(","))]
    if not all(boat and port.isdecimal() for boat, port in pairs):
        raise CommandError(f"invalid {option} '{text}': {needed}")
    return {boat: int(port) for boat, port in pairs}
