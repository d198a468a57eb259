"""Calls of macros in a world of a VRX series, with their values."""

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from vrx_mj.config.loading import problem_at
from vrx_mj.config.tree import Items, Place, Section, key_path
from vrx_mj.config.wording import literal
from vrx_mj.errors import ConfigError, Problem
from vrx_mj.formats.series.axes import Axis, Series
from vrx_mj.formats.urdf.expand import Result, evaluate

BLOCK = "/**"
"""Beginning of the name of a parameter that holds XML."""
_BLOCK_OF_STEPS = 100
"""Steps of each axis whose expressions are worked out at once."""
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
            message = f"{literal(value)}: {result.problem}; a text needs single quotes inside the double ones"
            raise ConfigError([problem_at(series.root, (*loc, key), message)])
        values[key] = result.value
    return given.holding(values)


_EXPRESSION = object()
"""Marks a text that is an expression of `n`."""


def _literal(key: str, value: object) -> object:
    """The value of a parameter; a text in single quotes is meant literally, as XML is, any other is an expression."""
    if not isinstance(value, str):
        return value
    bare = value.strip()
    if len(bare) > 1 and bare[0] == bare[-1] == "'":
        return bare[1:-1]
    return value if key.startswith(BLOCK) and (not bare or bare.startswith("<")) else _EXPRESSION


def _results(series: Series, steps: Mapping[str, int]) -> _Results:
    """What the expressions of some steps of each axis come to, those of one world among them."""
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
