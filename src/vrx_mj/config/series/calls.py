"""Calls of macros: which ones make a world, and the values of their parameters."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from vrx_mj.config.report import problem_at
from vrx_mj.config.series.axes import Axis, Series
from vrx_mj.config.tree import Items, Place, Section, key_path
from vrx_mj.config.urdf.expression_values import GLOBALS, MATH, Budget, ExpressionError, Module
from vrx_mj.config.urdf.expressions import Names, evaluate
from vrx_mj.config.wording import shown
from vrx_mj.errors import ConfigError, Problem

__all__ = ["BLOCK", "Call", "calls_of"]

BLOCK = "/**"
"""What the name of a parameter that holds XML begins with."""
WORK = 50_000
"""That the expressions of one world may take, about 1 us each."""


@dataclass(frozen=True)
class Call:
    """A macro called with parameters."""

    macro: str
    parameters: Section
    place: Place
    loc: tuple[str | int, ...]
    """Its path in the file."""

    def problem(self, key: str | None, message: str) -> Problem:
        """A problem with a parameter, or with the call itself."""
        entry = self.parameters.entries.get(key or "")
        place = entry.value if entry else self.place
        path = (*self.loc, key) if entry and key else self.loc
        return Problem(place.file.name, place.line, place.column, key_path(path), message)

    def fault(self, key: str | None, message: str) -> ConfigError:
        """The same as an error."""
        return ConfigError([self.problem(key, message)])


def calls_of(series: Series, number: int) -> list[Call]:
    """The calls that make one world, in the order of VRX: by macro, as each is first named; later axes add to a macro.

    Where two axes have a sequence for one macro, VRX means to do so but adds the names of macros as parameters.
    """
    steps, budget = series.coordinate(number), Budget(WORK)
    found: dict[str, list[Call]] = {}
    for axis in series.axes:
        for label, call in _of_axis(series, axis, steps[axis.name], budget):
            found.setdefault(label, []).append(call)
    return [call for calls in found.values() for call in calls]


def _of_axis(series: Series, axis: Axis, step: int, budget: Budget) -> Iterator[tuple[str, Call]]:
    literal = step in axis.sequence
    macros: Mapping[str, Any] = (axis.sequence[step] or {}) if literal else axis.macros
    above = (axis.name, "sequence", str(step)) if literal else (axis.name, "macros")
    for label, calls in macros.items():
        assert isinstance(calls, Items), "read_series has looked at the shapes"
        for index, parameters in enumerate(calls):
            loc, place = (*above, label, index), calls.places[index]
            given = parameters if isinstance(parameters, Section) else Section({}, place, {})
            values = given if literal else _worked_out(series, loc, given, step, budget)
            yield label, Call(label.strip("*"), values, place, loc)


def _worked_out(series: Series, loc: tuple[str | int, ...], given: Section, step: int, budget: Budget) -> Section:
    values = {}
    for key, value in given.items():
        try:
            values[key] = _value(key, value, step, budget)
        except ExpressionError as error:
            words = str(error).replace("robot file", "axes file").replace("no property named", "no name")
            message = f"{shown(value)}: {words}; a text needs single quotes inside the double ones"
            raise ConfigError([problem_at(series.root, (*loc, key), message)]) from None
    return Section(values, given.place, given.entries)


def _value(key: str, value: Any, step: int, budget: Budget) -> Any:
    """A text in single quotes is meant literally, as XML is; any other text is an expression of `n`."""
    if not isinstance(value, str):
        return value
    bare = value.strip()
    if len(bare) > 1 and bare[0] == bare[-1] == "'":
        return bare[1:-1]
    if key.startswith(BLOCK) and (not bare or bare.startswith("<")):
        return value
    table = {**GLOBALS, "math": Module("math", MATH), "n": step}
    return evaluate(value, Names(table, own=lambda: ("n",)), budget)
