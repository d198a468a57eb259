"""What callers of a batch give, checked: rows, seeds, values; and which commands there are."""

from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import CommandError, shown
from vrx_mj.runtime.loop import HUGE

Rows = npt.ArrayLike | None
"""Which rows: a mask (n,) of truths, their numbers, or None for all."""


_LARGEST = 1e6
"""Largest value of an argument of `Batch.vary`, in its unit."""
_LEAST = dict.fromkeys(("wind_direction", "wave_direction", "wind_speed"), -np.inf) | dict.fromkeys(
    ("mass", "wave_period"), float(np.nextafter(0.0, 1.0))
)
"""Least values of its arguments; of all others 0."""


def which_rows(n: int, rows: Rows) -> IntArray:
    """Return the numbers of the rows, of `n`, that are meant.

    Raises:
        CommandError: neither a mask nor numbers of rows.
    """
    if rows is None:
        return np.arange(n)
    given = _array(rows)
    if given.dtype == bool and given.shape == (n,):
        return np.flatnonzero(given)
    if given.size == 0:
        return np.zeros(0, np.int64)
    if given.ndim == 1 and np.issubdtype(given.dtype, np.integer) and (given >= 0).all() and (given < n).all():
        return given.astype(np.int64)
    raise CommandError(f"invalid rows {shown(rows)}: a mask of {n} booleans, or numbers from 0 to {n - 1}, is needed")


def _array(values: object) -> npt.NDArray[Any]:
    """The values as an array; one of no dimensions if they make none."""
    try:
        return np.asarray(values)
    except ValueError:  # lists of several lengths
        return np.array(None)


def row_seeds(which: IntArray, seed: Any) -> IntArray:
    """Return a seed for each of these rows: those given, or a number s and s + i in row i.

    Raises:
        CommandError: neither one whole number nor as many as there are rows.
    """
    one = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
    if one and 0 <= seed < 2**63 - int(which.max(initial=0)):
        return int(seed) + which
    given = _array(seed)
    if given.shape != which.shape or not np.issubdtype(given.dtype, np.integer) or (given < 0).any():
        raise CommandError(f"invalid seed {shown(seed)}: one whole number, or {len(which)} of them, is needed")
    return given.astype(np.int64)


def as_numbers(what: str, values: npt.ArrayLike) -> FloatArray:
    """Return the values as an array.

    Raises:
        CommandError: they are not numbers.
    """
    try:
        given = np.asarray(values)
        if given.dtype.kind in "biuf" or (given.dtype.kind == "O" and values is not None):
            return given.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        pass
    raise CommandError(f"invalid {what} {shown(values)}: an array of numbers is needed")


def row_vectors(what: str, values: npt.ArrayLike, count: int, size: int = 6) -> FloatArray:
    """Return `size` numbers for each of `count` rows, (count, size).

    Raises:
        CommandError: another shape, or numbers that no state may have.
    """
    given = as_numbers(what, values)
    if given.shape not in {(size,), (count, size)} or not (np.abs(given) < HUGE).all():
        text = f"{(count, size)} or {(size,)}, of numbers below {HUGE:g}, is needed"
        raise CommandError(f"invalid {what} of shape {given.shape}: {text}")
    return np.broadcast_to(given, (count, size))


def row_values(what: str, value: npt.ArrayLike, count: int, least: float, most: float = _LARGEST) -> FloatArray:
    """Return a number for each of `count` rows, (count,).

    Raises:
        CommandError: another shape, or numbers that are not finite, below `least` or above `most`.
    """
    given = as_numbers(what, value)
    if given.shape not in {(), (count,)} or not (np.isfinite(given) & (given >= least)).all():
        at_least = "" if least < 0 else " of 0 or more" if least == 0 else " above 0"
        raise CommandError(f"invalid {what} {shown(value)}: one finite number{at_least}, or {count} of them, is needed")
    if (np.abs(given) > most).any():
        raise CommandError(f"invalid {what} {shown(value)}: at most {most:g}")
    return np.broadcast_to(given, (count,)).copy()


def varied_values(count: int, **values: npt.ArrayLike | None) -> dict[str, FloatArray]:
    """Return what `Batch.vary` was given, by name, a number for each of `count` rows; what is None is left out.

    Raises:
        CommandError: another shape, or numbers that are not finite, or too small or too large.
    """
    return {name: row_values(name, value, count, _LEAST.get(name, 0.0)) for name, value in values.items()
            if value is not None}  # fmt: skip
