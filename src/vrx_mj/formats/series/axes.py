"""Axes files: what VRX's generator of worlds reads (vrx_gazebo/src/vrx_gazebo/generate_worlds.py, gazebo_classic).

A file is a mapping of axes. An axis has so many steps; at a step it calls macros, each with sets of parameters. There
is a world for each combination of steps: its number has the steps as digits, that of the first axis least significant.
"""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from vrx_mj.config.loading import problem_at
from vrx_mj.config.search import catalogue, display
from vrx_mj.config.tree import File, Items, Loc, Section
from vrx_mj.config.wording import shown, unknown_key
from vrx_mj.config.yaml_text import Repeat, parse_loosely, read_lines
from vrx_mj.errors import ConfigError, Problem, VrxWarning

MOST_WORLDS = 10_000
"""Worlds of one file."""
_KEYS = ("steps", "macros", "sequence", "yamls")
"""Keys of an axis."""
_Level = tuple[Any, str]
"""Of nested content the type of what is at one level, and words for it."""
_STEPS: _Level = Section, "steps, as in `0:`"
_CALLS: Sequence[_Level] = (
    (Section, "macros, each with a list of calls"),
    (Items, "a list of calls, where '-' alone is a call with the defaults"),
    (Section, "parameters"),
)
_PATCHED = "begins with '+', as in a patch file; remove the '+'"


@dataclass(frozen=True)
class Axis:
    """One dimension of a series."""

    name: str
    steps: int
    macros: Section
    """Macros and their calls, whose values are expressions of the step `n`."""
    sequence: Mapping[int, Section]
    """Macros and their calls at single steps, instead of `macros`; their values are meant literally."""
    sides: Mapping[int, Any]
    """What is written to a file beside the world at single steps."""


@dataclass(frozen=True)
class Series:
    """An axes file."""

    file: File
    stem: str
    """What the names of its worlds begin with, before their number."""
    root: Section
    """The content of the file, with places."""
    axes: tuple[Axis, ...]
    results: dict[Any, dict[tuple[str, int], Any]] = field(default_factory=dict, compare=False, repr=False)
    """What its expressions come to, as far as they were worked out."""
    made: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)
    """What its calls make, as far as they were expanded."""

    @cached_property
    def objects(self) -> Mapping[str, Path]:
        """Objects that its worlds may name, which are looked for once."""
        return catalogue("objects")

    @property
    def count(self) -> int:
        """How many worlds there are."""
        return math.prod(axis.steps for axis in self.axes)

    def coordinate(self, number: int) -> dict[str, int]:
        """The step of each axis in the world of this number."""
        steps = {}
        for axis in self.axes:
            number, steps[axis.name] = divmod(number, axis.steps)
        return steps


def read_series(path: Path) -> Series:
    """The axes file at a path.

    Raises:
        ConfigError: it is not one; the error lists every problem with its place.
    """
    file = File(display(path), path.absolute().parent, read_lines(path))
    root, repeats = parse_loosely(file)
    problems = list(_odd_shapes(root))
    if problems:
        raise ConfigError(problems)
    series = Series(file, path.stem, root, tuple(_axis(name, content) for name, content in root.items()))
    if series.count > MOST_WORLDS:
        counts = " x ".join(shown(axis.steps) for axis in series.axes)
        message = f"{counts} steps make {shown(series.count)} worlds; a file may have {MOST_WORLDS}"
        raise ConfigError([Problem(file.name, 1, None, "", message)])
    remarks = [*_repeat_notes(repeats), *_never_reached(series)]
    if remarks:
        warnings.warn(f"{file.name}: {'; '.join(remarks)}", VrxWarning, stacklevel=2)
    return series


def _axis(name: str, content: Section) -> Axis:
    sequence, sides = (content.get(key) or {} for key in ("sequence", "yamls"))
    return Axis(
        name,
        content["steps"],
        content.get("macros") or Section({}, content.place, {}),
        {int(step): calls for step, calls in sequence.items()},
        {int(step): tree for step, tree in sides.items()},
    )


def _odd_shapes(root: Section) -> Iterator[Problem]:
    """Everything that makes a file no axes file."""
    if not root:
        yield problem_at(root, (), "no axes; an axis has `steps` and `macros`")
    for name, axis in root.items():
        if name.startswith("+"):
            yield problem_at(root, (name,), _PATCHED)
        elif not isinstance(axis, Section):
            yield problem_at(root, (name,), f"an axis has `steps` and `macros`, got {shown(axis)}")
        elif "steps" not in axis:
            yield problem_at(root, (name, "steps"), "required, but missing; an axes file has nothing but axes")
        else:
            yield from _odd_axis(root, name, axis)


def _odd_axis(root: Section, name: str, axis: Section) -> Iterator[Problem]:
    for key in axis.keys() - set(_KEYS):
        message = _PATCHED if key.startswith("+") else unknown_key(key, _KEYS)
        yield problem_at(root, (name, key), message)
    steps = axis["steps"]
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        yield problem_at(root, (name, "steps"), f"expected a whole number of at least 1, got {shown(steps)}")
    for key, levels in (("macros", _CALLS), ("sequence", (_STEPS, *_CALLS)), ("yamls", (_STEPS,))):
        yield from _odd_levels(root, (name, key), axis.get(key), levels)
        steps = axis.get(key) if _STEPS in levels else None
        for step in steps if isinstance(steps, Section) else ():
            if not (step.isascii() and step.isdigit() and len(step) < 10):
                text = f"expected a whole number of 0 or more as step, got '{step}'"
                yield problem_at(root, (name, key, step), text)


def _odd_levels(root: Section, loc: Loc, content: Any, levels: Sequence[_Level]) -> Iterator[Problem]:
    """What is wrong with nested content; a mapping may be left empty."""
    (kind, words), *below = levels
    if isinstance(content, kind):
        for key, value in (content.items() if isinstance(content, Section) else enumerate(content)) if below else ():
            yield from _odd_levels(root, (*loc, key), value, below)
    elif content is not None or kind is Items:
        yield problem_at(root, loc, f"expected {words}, got {shown(content)}")


def _repeat_notes(repeats: Sequence[Repeat]) -> Iterator[str]:
    if repeats:
        keys = ", ".join(f"{key} (lines {first} and {last})" for key, first, last in repeats)
        yield f"given twice; the later one counts, as in VRX: {keys}"


def _never_reached(series: Series) -> Iterator[str]:
    for axis in series.axes:
        beyond = sorted({step for step in (*axis.sequence, *axis.sides) if step >= axis.steps})
        if beyond:
            steps = ", ".join(map(str, beyond))
            has = "1 step" if axis.steps == 1 else f"steps 0 to {axis.steps - 1}"
            yield f"step {steps} of {axis.name} does not exist: it has {has}"
