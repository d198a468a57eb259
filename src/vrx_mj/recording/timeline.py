"""The timeline of a recording, chunks of one row, and the picking of rows: at a lower rate, or where values change."""

import math
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.draw import style
from vrx_mj.physics.kernel import kernel

TIMELINE = "sim_time"
ARROW = np.array([(0.0, 0.0), (1.0, 0.0), (0.76, 0.2), (1.0, 0.0), (0.76, -0.2)])
"""An arrow as a line, along and across, in its lengths."""


def times(seconds: npt.ArrayLike) -> rr.TimeColumn:
    """The timeline, to a microsecond: readers of finer durations lose what does not fit Python's timedelta."""
    microseconds = np.round(np.asarray(seconds, np.float64) * 1e6).astype("timedelta64[us]")
    return rr.TimeColumn(TIMELINE, duration=microseconds.astype("timedelta64[ns]"))


def static(path: str, *archetypes: rr.AsComponents) -> Chunk:
    """A chunk of one row without time."""
    return chunk_at(None, path, *archetypes)


def chunk_at(begun: float | None, path: str, *archetypes: rr.AsComponents) -> Chunk:
    """A chunk of one row, of a time [s], or without time."""
    batches = chain.from_iterable(archetype.as_component_batches() for archetype in archetypes)
    columns = [batch.partition([len(batch.as_arrow_array())]) for batch in batches]
    return Chunk.from_columns(path, [] if begun is None else [times([begun])], columns)


def thin_lines(width: float, **fields: Any) -> rr.LineStrips3D:
    """Lines as wide on the screen from near and far [points], with fields of the archetype."""
    return rr.LineStrips3D.from_fields(radii=[rr.Radius.ui_points(width)], **fields)


def name_points(labels: Sequence[str] | None = None, positions: npt.ArrayLike | None = None) -> rr.Points3D:
    """Points that are names; what is None changes with time."""
    return rr.Points3D.from_fields(
        labels=labels, positions=positions, colors=[style.LABEL], radii=[0.0], show_labels=True
    )


def numbers(
    path: str,
    seconds: npt.ArrayLike,
    kind: Any,
    counts: npt.ArrayLike | None = None,
    beside: Iterable[rr.ComponentColumn] = (),
    **fields: npt.NDArray[Any],
) -> Chunk:
    """A chunk of fields of an archetype at times (n,) [s], from arrays of numbers, which take the types that it keeps.

    Each row has as many values of a field as any other, or `counts` of them, and its cells of the columns `beside`. It
    takes a third of the time of `kind.columns`.
    """
    index, columns = times(seconds), [*beside]
    rows = len(index.as_arrow_array())
    for name, values in fields.items():
        component, batch = _component(kind, name)
        array = _arrow(values, batch.as_arrow_array().type)
        lengths = np.broadcast_to(len(array) // max(rows, 1) if counts is None else counts, rows)
        columns.append(rr.ComponentColumn(component, type(batch)(array), lengths=lengths))
    return Chunk.from_columns(path, [index], columns)


@cache
def _component(kind: Any, name: str) -> tuple[rr.ComponentDescriptor, Any]:
    """The descriptor of an archetype's field, and its values where there are none."""
    empty = kind.from_fields(**{name: []})
    (batch,) = empty.as_component_batches()
    return batch.component_descriptor(), getattr(empty, name)


def _arrow(values: npt.NDArray[np.generic], kind: pa.DataType) -> pa.Array:
    """An Arrow array of a type: numbers, (..., k) as lists of k, which the type names, or (..., n, k) as lists of n."""
    if not pa.types.is_nested(kind):
        return pa.array(values.reshape(-1).astype(kind.to_pandas_dtype(), copy=False), kind)
    inner = _arrow(values, kind.value_type)
    if pa.types.is_fixed_size_list(kind):
        return pa.FixedSizeListArray.from_arrays(inner, type=kind)
    return pa.ListArray.from_arrays(np.arange(0, len(inner) + 1, values.shape[-2], dtype=np.int32), inner, kind)


def changes(path: str, seconds: npt.ArrayLike, kind: Any, **rows: Sequence[Sequence[Any]]) -> Chunk:
    """A chunk of what changes at times (n,) [s]: of each field of an archetype the values of every row."""
    columns: list[rr.ComponentColumn] = []
    for name, values in rows.items():
        columns += kind.columns(**{name: [*chain.from_iterable(values)]}).partition([len(row) for row in values])
    return Chunk.from_columns(path, [times(seconds)], columns)


def arrow_strips(
    origins: npt.ArrayLike, vectors: npt.ArrayLike, up: Sequence[float] | FloatArray = (0.0, 0.0, 1.0)
) -> FloatArray:
    """Arrows from places (n, 3) along vectors (n, 3) as lines (n, 5, 3), their heads at right angles to `up`.

    Tips of a viewer's own arrows are black in a browser.
    """
    along = np.asarray(vectors, np.float64)
    length = np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(up, along)
    across = np.where(np.linalg.norm(across, axis=1, keepdims=True) > 1e-3 * length, across, np.cross([1, 0, 0], along))
    across *= length / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    strips: FloatArray = np.asarray(origins)[:, None] + np.einsum("pa,anc->npc", ARROW, np.stack([along, across]))
    return strips


class Ticker:
    """Picks rows at a lower rate: the first row of each tick of its clock."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._last = -math.inf

    def __call__(self, time: FloatArray) -> BoolArray:
        """Which of the rows at `time` (n,) [s] to take."""
        tick = np.floor(time * self._rate + 1e-6)
        taken: BoolArray = np.diff(tick, prepend=self._last) != 0
        self._last = tick[-1]
        return taken


class Deadband:
    """Values as they are shown: rounded, each as it was until it is off by more than it may, in the rows where one is.

    What stays the same from row to row takes hardly any space in a file.
    """

    def __init__(self, step: npt.ArrayLike, *, keep: float = 0.5, within: npt.ArrayLike = 0.0) -> None:
        """`step`: what values (k,) or (...) are rounded to; `keep`: how far one may be off in a shown row, in steps.

        `within`: how far each may be off before a row is shown, if that is more.
        """
        self._step, self._keep, self._within = np.asarray(step, np.float64), keep, np.asarray(within, np.float64)
        self._last, self._limits = np.full(0, np.nan), list[FloatArray]()

    def __call__(self, values: FloatArray) -> tuple[BoolArray, FloatArray]:
        """Which of the rows (n, ...) are shown, and what is shown at the time of each, of the same shape."""
        count, taken = math.prod(values.shape[1:]), np.empty(len(values), np.bool_)
        shown = np.array(values, np.float64).reshape(len(values), count)
        if len(self._last) != count:
            off = (self._keep + 1e-9) * self._step
            self._limits = [np.full(count, each) for each in (self._step, off, np.maximum(self._within, off))]
            self._last = np.full(count, np.nan)
        step, keep, within = self._limits
        _hold(shown, step, keep, within, self._last, taken)
        return taken, shown.reshape(values.shape)


@kernel
def _hold(
    values: FloatArray, step: FloatArray, keep: FloatArray, within: FloatArray, last: FloatArray, taken: BoolArray
) -> None:
    """Write which rows of `values` (n, k) have one further than `within` from `last` (k,), and into each what is shown.

    Of such a row each value further than `keep` from `last` takes its place there, in whole steps.
    """
    for i in range(values.shape[0]):
        taken[i] = False
        for j in range(values.shape[1]):
            if not abs(values[i, j] - last[j]) <= within[j]:  # NaN is the first
                taken[i] = True
        for j in range(values.shape[1]):
            if taken[i] and not abs(values[i, j] - last[j]) <= keep[j]:
                last[j] = np.rint(values[i, j] / step[j]) * step[j] + 0.0  # no -0.0
            values[i, j] = last[j]
