"""Which sensors to record, from words: `wamv1:front_left_camera@5,lidar_wamv,wamv2`, or `all`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from vrx_mj.errors import CommandError, UnknownNameError, shown

__all__ = ["ALL", "Choice", "chosen"]

ALL = "all"
"""The word for every sensor: of a boat, or of all boats."""

Rates = Mapping[str, Mapping[str, float]]
"""By boat, its sensors with their measurements per second."""


@dataclass(frozen=True)
class Choice:
    """A sensor to record."""

    boat: str
    sensor: str
    rate: float
    """Readings per simulated second."""


def chosen(words: str | Sequence[str], rates: Rates) -> tuple[Choice, ...]:
    """The sensors that are meant, each once, in the order in which they are named; the last rate given counts.

    A word is `boat:sensor`, a boat for all of its sensors, or `all`; the sensor alone belongs to the boat named
    last, or to the only one. `@5` after any of them asks for 5 readings per second, of several sensors for at most 5.

    Raises:
        UnknownNameError: no such boat, or no such sensor on it.
        CommandError: a rate is not above 0, or above the sensor's own.
    """
    found: dict[tuple[str, str], float] = {}
    boat = next(iter(rates)) if len(rates) == 1 else None
    for word in [part for text in _list(words) for part in text.split(",")]:
        name, rate = _split(word.replace(" ", ""))
        boat, sensors = _meant(name, boat, rates)
        for one in sensors:
            found[one] = _rate(one, rate, rates, several=_is_group(name, rates))
        if name == ALL:
            boat = None if len(rates) > 1 else boat
    return tuple(Choice(*one, rate) for one, rate in found.items())


def _list(words: str | Sequence[str]) -> Sequence[str]:
    given: Any = [words] if isinstance(words, str) else words
    if not isinstance(given, Sequence) or not all(isinstance(word, str) for word in given):
        raise CommandError(
            f"invalid sensors {shown(words)}: text, or a list of it, is needed, as in wamv1:lidar_wamv@5"
        )
    return given


def _split(word: str) -> tuple[str, float | None]:
    """A word's name, and its rate if it has one."""
    name, mark, rate = word.partition("@")
    try:
        value = float(rate) if mark else None
    except ValueError:
        value = math.nan
    if value is not None and not 0.0 < value < math.inf:
        raise CommandError(
            f"invalid rate '{rate}' in '{word}': readings per second above 0 are needed, as in lidar_wamv@5"
        )
    return name, value


def _is_group(name: str, rates: Rates) -> bool:
    return name == ALL or name in rates or name.endswith(f":{ALL}")


def _meant(name: str, boat: str | None, rates: Rates) -> tuple[str | None, list[tuple[str, str]]]:
    """The boat that a word names, or else `boat`, and the sensors that it means."""
    if name == ALL:
        return boat, [one for each in rates for one in _sensors(each, ALL, rates)]
    first, colon, sensor = name.partition(":")
    if colon:
        return first, list(_sensors(first, sensor, rates))
    if name in rates or boat is None:
        return name, list(_sensors(name, ALL, rates))
    return boat, list(_sensors(boat, name, rates))


def _sensors(boat: str, sensor: str, rates: Rates) -> Iterator[tuple[str, str]]:
    if boat not in rates:
        raise UnknownNameError("boat", boat, rates)
    if sensor != ALL and sensor not in rates[boat]:
        raise UnknownNameError(f"sensor of {boat}", sensor, rates[boat])
    yield from ((boat, name) for name in rates[boat] if sensor in (ALL, name))


def _rate(one: tuple[str, str], rate: float | None, rates: Rates, *, several: bool) -> float:
    boat, sensor = one
    own = rates[boat][sensor]
    if rate is None or (several and rate > own):
        return own
    if rate > own:
        raise CommandError(f"{sensor} of {boat} measures {own:g} times a second: it cannot be recorded at {rate:g}")
    return rate
