"""Axes files, which VRX's generator of worlds reads (vrx_gazebo/src/vrx_gazebo/generate_worlds.py, gazebo_classic).

A file is a mapping of axes. An axis has a number of steps; at each step it calls macros, with sets of parameters.
There is a world for each combination of steps: the steps are the digits of its number, the first axis the least
significant.
"""

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from vrx_mj.config.base import Config, Faults
from vrx_mj.config.loading import problem_at, problems_of
from vrx_mj.config.search import catalogue, display
from vrx_mj.config.tree import File, Items, Place, Section, key_path, literal
from vrx_mj.config.yaml_text import Repeat, parse_loosely, read_lines
from vrx_mj.errors import ConfigError, Problem, warn
from vrx_mj.formats.urdf.expand import Result, evaluate

MOST_WORLDS = 10_000
"""Worlds of one file."""
_Calls = dict[str, tuple[dict[str, Any] | None, ...]]
"""Macros, each with the parameters of its calls; a call without any has the defaults."""
BLOCK = "/**"
"""Beginning of the name of a parameter that holds XML."""
_BLOCK_OF_STEPS = 100
"""Steps of each axis whose expressions are worked out at once."""
_EXPRESSION = object()
"""Marks a text that is an expression of `n`."""


class _AxisConfig(Config):
    """An axis as the file writes it."""

    steps: Annotated[int, Field(ge=1)]
    macros: _Calls | None = None
    sequence: dict[str, _Calls | None] | None = None
    yamls: dict[str, Any] | None = None

    def _faults(self) -> Faults:
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
        raise ConfigError(problems or [problem_at(root, (), "expected axes, each with `steps` and `macros`")])
    series = Series(file, path.stem, root, tuple(Axis.of(name, content) for name, content in root.items()))
    if series.count > MOST_WORLDS:
        counts = " x ".join(literal(axis.steps) for axis in series.axes)
        message = f"{counts} steps make {literal(series.count)} worlds; at most {MOST_WORLDS} are allowed"
        raise ConfigError.of(file.name, message, line=1)
    if remarks := [*_remarks(series, repeats)]:
        warn(f"{file.name}: {'; '.join(remarks)}", 2)
    return series


def _remarks(series: Series, repeats: Sequence[Repeat]) -> Iterator[str]:
    """Suspicious parts of a file: keys that are given twice, and steps that are never reached."""
    if repeats:
        keys = ", ".join(f"{key} (lines {first} and {last})" for key, first, last in repeats)
        yield f"given twice; the last one is used, as in VRX: {keys}"
    for axis in series.axes:
        beyond = sorted({step for step in (*axis.sequence, *axis.sides) if step >= axis.steps})
        if beyond:
            steps = ", ".join(map(str, beyond))
            has = "1 step" if axis.steps == 1 else f"steps 0 to {axis.steps - 1}"
            yield f"step {steps} of {axis.name} does not exist: it has {has}"


_Results = Mapping[tuple[str, int], Result]
"""Results of expressions by their text and the step."""


@dataclass(frozen=True)
class Call:
    """A macro called with parameters."""

    macro: str
    parameters: Section
    place: Place
    loc: tuple[str | int, ...]
    """Path of the call in the file."""
    step: int
    """Step of its axis."""

    def place_of(self, key: str | None) -> Place:
        """The place of a parameter; that of the call where it is not given."""
        entry = self.parameters.entries.get(key or "")
        return entry.value if entry else self.place

    def problem(self, key: str | None, message: str) -> Problem:
        """A problem with a parameter, or with the call itself."""
        path = (*self.loc, key) if key and key in self.parameters.entries else self.loc
        return self.place_of(key).problem(key_path(path), message)

    def fault(self, key: str | None, message: str) -> ConfigError:
        """An error with that problem."""
        return ConfigError([self.problem(key, message)])


def calls_of(series: Series, number: int) -> list[Call]:
    """The calls that make one world, in the order of VRX: by macro, as each is first named; later axes add to a macro.

    Where two axes have a sequence for one macro, VRX means to do so but adds the names of macros as parameters.
    """
    steps = series.coordinate(number)
    results = _results(series, steps)
    found: dict[str, list[Call]] = {}
    for axis in series.axes:
        for label, call in _of_axis(series, axis, steps[axis.name], results):
            found.setdefault(label, []).append(call)
    return [call for calls in found.values() for call in calls]


def calls_around(series: Series, number: int) -> Iterator[Call]:
    """The calls at the steps whose expressions are worked out together with those of a world, if they are right."""
    steps = series.coordinate(number)
    results = _results(series, steps)
    for axis in series.axes:
        for step in _block(axis, steps[axis.name]):
            with contextlib.suppress(ConfigError):
                yield from (call for _, call in _of_axis(series, axis, step, results))


def _block(axis: Axis, step: int) -> range:
    """The steps of a block."""
    first = step // _BLOCK_OF_STEPS * _BLOCK_OF_STEPS
    return range(first, min(axis.steps, first + _BLOCK_OF_STEPS))


def _of_axis(series: Series, axis: Axis, step: int, results: _Results) -> Iterator[tuple[str, Call]]:
    literal = step in axis.sequence
    macros: Mapping[str, Any] = (axis.sequence[step] or {}) if literal else axis.macros
    above = (axis.name, "sequence", str(step)) if literal else (axis.name, "macros")
    for label, calls in macros.items():
        assert isinstance(calls, Items), "read_series has looked at the shapes"
        for index, parameters in enumerate(calls):
            loc, place = (*above, label, index), calls.places[index]
            given = parameters if isinstance(parameters, Section) else Section({}, place, {})
            values = given if literal else _worked_out(series, loc, given, step, results)
            yield label, Call(label.strip("*"), values, place, loc, step)


def _worked_out(series: Series, loc: tuple[str | int, ...], given: Section, step: int, results: _Results) -> Section:
    values = {}
    for key, value in given.items():
        values[key] = _literal(key, value)
        if values[key] is not _EXPRESSION:
            continue
        result = results[value, step]
        if result.problem:
            message = f"{literal(value)}: {result.problem}; text needs single quotes inside the double quotes"
            raise ConfigError([problem_at(series.root, (*loc, key), message)])
        values[key] = result.value
    return given.holding(values)


def _literal(key: str, value: object) -> object:
    """The value of a parameter; a text in single quotes is meant literally, as XML is, any other is an expression."""
    if not isinstance(value, str):
        return value
    bare = value.strip()
    if len(bare) > 1 and bare[0] == bare[-1] == "'":
        return bare[1:-1]
    return value if key.startswith(BLOCK) and (not bare or bare.startswith("<")) else _EXPRESSION


def _results(series: Series, steps: Mapping[str, int]) -> _Results:
    """Values of the expressions of some steps of each axis, those of one world among them."""
    key = tuple(step // _BLOCK_OF_STEPS for step in steps.values())
    if key not in series.results:
        texts = [
            (text, step)
            for axis in series.axes
            for text in dict.fromkeys(_expressions(axis))
            for step in _block(axis, steps[axis.name])
        ]
        found = evaluate(series.file.name, [(f"${{{text}}}", {"n": step}) for text, step in texts])
        series.results[key] = dict(zip(texts, found, strict=True))
    return series.results[key]


def _expressions(axis: Axis) -> Iterator[str]:
    for calls in axis.macros.values():
        for call in calls:
            for key, value in call.items() if isinstance(call, Section) else ():
                if _literal(key, value) is _EXPRESSION:
                    yield value
