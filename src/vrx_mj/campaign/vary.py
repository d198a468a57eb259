"""Quantities of worlds that a campaign draws for each trial: `--vary wind.mean_velocity=0..8`."""

import fnmatch
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vrx_mj.config.base import marked_numbers
from vrx_mj.config.weather import CurrentConfig, SeaConfig, WindConfig
from vrx_mj.errors import CommandError, UnknownNameError, VrxError, ignore_warnings
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.model.water import Current, Sea, Wind
from vrx_mj.physics.noise import stream_key, uniform
from vrx_mj.runtime.batch import Batch

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(rf"\s*([^=\s]+)\s*=\s*({_NUMBER})\s*\.\.\s*({_NUMBER})\s*")
_KEYS = {
    f"{own}.{key}": f"{own}.{mark.name}"
    for own, config, record in (
        ("sea", SeaConfig, Sea),
        ("current", CurrentConfig, Current),
        ("wind", WindConfig, Wind),
    )
    for key, mark in marked_numbers(config)
    if mark.record is record and mark.name != key
}
"""Numbers of a compiled world by their keys in world files, where these are others: `wind.mean_velocity`."""


@dataclass(frozen=True)
class Quantity:
    """A quantity that is drawn for every trial, uniformly between two values."""

    name: str
    """Name in `vrx_mj.parameters`, or a pattern, as `*.hull.drag_linear.surge`, all of whose numbers get one value."""
    low: float
    high: float
    unit: str = ""
    """Unit, SI."""

    def __str__(self) -> str:
        return f"{self.name}={self.low:g}..{self.high:g}"

    def value(self, seed: int) -> float:
        """Value in the trials of a seed: neither the number of trials nor other quantities change it."""
        return self.low + (self.high - self.low) * uniform(np.uint64(stream_key(seed, "vary", self.name)), 0)


def parse_vary(texts: Iterable[str]) -> tuple[Quantity, ...]:
    """Quantities from texts such as `wind.mean_velocity=0..8`.

    Raises:
        CommandError: one is not of that form, its range is empty, or it is there twice.
    """
    found: dict[str, Quantity] = {}
    for text in texts:
        match = _RANGE.fullmatch(text)
        if match is None:
            raise CommandError(f"invalid --vary '{text}': NAME=LOW..HIGH is needed, as in wind.mean_velocity=0..8")
        quantity = Quantity(match[1], float(match[2]), float(match[3]))
        if quantity.high <= quantity.low:
            raise CommandError(f"invalid --vary '{text}': the range is empty; write the smaller number first")
        if _KEYS.get(quantity.name, quantity.name) in {_KEYS.get(name, name) for name in found}:
            raise CommandError(f"--vary {quantity.name} is given twice")
        found[quantity.name] = quantity
    return tuple(found.values())


def check_vary(quantities: Iterable[Quantity], worlds: Iterable[str], fleet: str | None = None) -> tuple[Quantity, ...]:
    """The quantities with their units, once every world has them and takes both ends of their ranges.

    Raises:
        VrxError: a world has no number of a name, two quantities mean one number, a value is out of its range, or a
            boat does not float with it.
    """
    found = {quantity.name: quantity for quantity in quantities}
    for world in worlds if found else ():
        with ignore_warnings():  # in the logs of the trials
            base = compile_world(world, fleet=fleet)
            drawn: dict[str, str] = {}
            for quantity in found.values():
                names = _names(base, quantity.name)
                for name in names:
                    if name in drawn:
                        raise CommandError(f"--vary {drawn[name]} and --vary {quantity.name} both draw {name}")
                    drawn[name] = quantity.name
                found[quantity.name] = replace(quantity, unit=base.numbers[names[0]].unit)
                for end in (quantity.low, quantity.high):
                    _check_end(quantity, end, base, partial(compile_world, world, fleet=fleet))
    return tuple(found.values())


def _check_end(quantity: Quantity, end: float, base: World, compile_with: Callable[..., World]) -> None:
    """Check that the world takes a value, and that every boat floats that floats in the world without it."""
    try:
        world = compile_with(parameters=numbers_by_name(base, {quantity.name: end}))
    except VrxError as error:
        raise CommandError(f"--vary in {base.name}: {error}") from None
    if not re.search(r"\.(hull|stations)\.", quantity.name):
        return  # no boat's draft depends on it
    untasked = (replace(each, parameters=replace(each.parameters, task=None)) for each in (world, base))
    factors, usual = (Batch(each, 1).largest_masses for each in untasked)
    sunk = [boat for boat, own, before in zip(world.boats, factors, usual, strict=True) if own < 1.0 <= before]
    if sunk:
        raise CommandError(f"--vary {quantity}: with {end:g} the boat {sunk[0]} does not float in {world.name}")


def numbers_by_name(world: World, values: Mapping[str, float]) -> dict[str, float]:
    """Values of quantities by the names of the world's numbers that each means.

    Raises:
        CommandError: it has none of a name.
    """
    return {name: value for quantity, value in values.items() for name in _names(world, quantity)}


def _names(world: World, name: str) -> list[str]:
    """Names of the world's numbers that a name or a pattern means."""
    found = fnmatch.filter(world.numbers, _KEYS.get(name, name))
    if not found and name == "sea.significant_height":
        text = "is flat or a Stokes wave; give it `sea: {model: jonswap, significant_height: 0.3}`"
        raise CommandError(f"--vary {name}: the sea of {world.name} {text}")
    if not found:
        unknown = UnknownNameError("parameter", name, [*world.numbers, *_KEYS])
        raise CommandError(f"--vary {name}: world {world.name} has {unknown}; vrx_mj.parameters lists all")
    return found
