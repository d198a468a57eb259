"""Expressions in YAML and launch files, worked out by the package `xacro` in the process without rights."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vrx_mj.foreign import ReaderError, ask

_SECONDS = 3
"""Processor time that the expressions of one file may take [s]."""
_FIND = re.compile(r"find\(\s*['\"]([\w.-]{1,200})['\"]\s*\)")


@dataclass(frozen=True)
class Result:
    """What a text comes to: a value, or why it has none."""

    value: bool | int | float | str | None = None
    problem: str = ""


def evaluated(file: str, texts: Sequence[tuple[str, Mapping[str, float]]]) -> tuple[Result, ...]:
    """What the texts with `${...}` of a file come to, each with names of its own.

    Expressions are Python's, with the functions of `math`, `radians` among them. Those of one file are worked out at
    once; if that takes too much, one by one up to the first that does, which is the problem of all that follow.
    """
    job, found = "formats.urdf.expansion:evaluated", list[Result]()
    try:
        return ask(job, texts, returns=tuple[Result, ...], about=file, seconds=_SECONDS) if texts else ()
    except ReaderError as error:
        if len(texts) == 1:
            return (Result(problem=error.reason),)
        failed = Result(problem=error.reason)
    while len(found) < len(texts) and failed not in found:
        found += evaluated(file, [texts[len(found)]])
    return (*found, *[failed] * (len(texts) - len(found)))


def packages_in(expression: str) -> list[str]:
    """The packages that an expression of `$(eval ...)` finds."""
    return _FIND.findall(expression)


def evaluated_argument(
    expression: str, arguments: Mapping[str, str], packages: Mapping[str, str], folder: Path, about: str
) -> str:
    """What `$(eval ...)` of a launch file in a folder comes to. Raises VrxError."""
    job = "formats.urdf.expansion:evaluated_argument"
    return ask(job, expression, arguments, packages, folder, returns=str, about=about, seconds=_SECONDS)
