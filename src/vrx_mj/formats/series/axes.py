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
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from vrx_mj.config.base import Config, Fault
from vrx_mj.config.loading import problem_at, problems_of
from vrx_mj.config.search import catalogue, display
from vrx_mj.config.tree import File, Section
from vrx_mj.config.wording import literal
from vrx_mj.config.yaml_text import Repeat, parse_loosely, read_lines
from vrx_mj.errors import ConfigError, Problem, VrxWarning

MOST_WORLDS = 10_000
"""Worlds of one file."""
_Calls = dict[str, tuple[dict[str, Any] | None, ...]]
"""Macros, each with the parameters of its calls; a call without any has the defaults."""


class _AxisConfig(Config):
    """An axis as the file writes it."""

    steps: Annotated[int, Field(ge=1)]
    macros: _Calls | None = None
    sequence: dict[str, _Calls | None] | None = None
    yamls: dict[str, Any] | None = None

    def _faults(self) -> Iterator[Fault]:
        for key, steps in (("sequence", self.sequence), ("yamls", self.yamls)):
            for step in steps or ():
                if not (step.isascii() and step.isdigit() and len(step) < 10):
                    yield (key, step), f"expected a whole number of 0 or more as step, got '{step}'"


_AXES = TypeAdapter(dict[str, _AxisConfig])


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
    """Content of a file beside the world at single steps."""

    @classmethod
    def of(cls, name: str, content: Section) -> "Axis":
        """The axis that a file's section describes."""
        parts = (content.get(key) or {} for key in ("sequence", "yamls"))
        sequence, sides = ({int(step): said for step, said in part.items()} for part in parts)
        return cls(name, content["steps"], content.get("macros") or Section({}, content.place), sequence, sides)


@dataclass(frozen=True)
class Series:
    """An axes file."""

    file: File
    stem: str
    """Beginning of the names of its worlds, before their number."""
    root: Section
    """The content of the file, with places."""
    axes: tuple[Axis, ...]
    results: dict[Any, dict[tuple[str, int], Any]] = field(default_factory=dict, compare=False, repr=False)
    """Results of its expressions, as far as they were evaluated."""
    made: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)
    """Elements that its calls make, as far as they were expanded."""

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
    try:
        _AXES.validate_python(root)
    except ValidationError as error:
        raise ConfigError(problems_of(error, root)) from None
    patched = "begins with '+', as in a patch file; remove the '+'"
    problems = [problem_at(root, (name,), patched) for name in root if name.startswith("+")]
    if problems or not root:
        raise ConfigError(problems or [problem_at(root, (), "no axes; an axis has `steps` and `macros`")])
    series = Series(file, path.stem, root, tuple(Axis.of(name, content) for name, content in root.items()))
    if series.count > MOST_WORLDS:
        counts = " x ".join(literal(axis.steps) for axis in series.axes)
        message = f"{counts} steps make {literal(series.count)} worlds; a file may have {MOST_WORLDS}"
        raise ConfigError([Problem(file.name, 1, None, "", message)])
    if remarks := [*_remarks(series, repeats)]:
        warnings.warn(f"{file.name}: {'; '.join(remarks)}", VrxWarning, stacklevel=2)
    return series


def _remarks(series: Series, repeats: Sequence[Repeat]) -> Iterator[str]:
    """Suspicious parts of a file: keys that are given twice, and steps that are never reached."""
    if repeats:
        keys = ", ".join(f"{key} (lines {first} and {last})" for key, first, last in repeats)
        yield f"given twice; the later one counts, as in VRX: {keys}"
    for axis in series.axes:
        beyond = sorted({step for step in (*axis.sequence, *axis.sides) if step >= axis.steps})
        if beyond:
            steps = ", ".join(map(str, beyond))
            has = "1 step" if axis.steps == 1 else f"steps 0 to {axis.steps - 1}"
            yield f"step {steps} of {axis.name} does not exist: it has {has}"
