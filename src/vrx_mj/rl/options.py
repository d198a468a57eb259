"""Options of the environments, checked, and what episodes are drawn from: a generator for every row, and its ranges."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeGuard

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

from vrx_mj.arguments import as_number, check_name
from vrx_mj.arrays import BoolArray, IntArray
from vrx_mj.errors import quote
from vrx_mj.rl.neighbours import NeighbourView
from vrx_mj.rl.problem import Facts, RefereedRow, Rows
from vrx_mj.runtime.batch import MAX_ROWS, Batch
from vrx_mj.runtime.rows import MAX_VALUE, fixed_arguments
from vrx_mj.runtime.timing import MAX_DURATION

Device = Literal["cpu", "cuda"]
"""Where rows and their arrays are."""
PERIOD = 0.1
"""Duration of an action [s]: 10 physics steps."""
_ROUNDING = 1e-6
"""An action so near to a bound is the bound: wrappers compute actions, and round them."""
_ENDLESS = 1 << 60
"""Steps of an episode that is not truncated."""
_MAX_SIDE = 8192
"""Largest width and height of a picture [pixels]."""
_MOST_NEIGHBOURS = 10_000
"""Greatest number of neighbours that are observed."""
_LONGEST_DELAY = 3600.0
"""Longest delay of what boats observe of each other [s]."""
_FULL_TURN = (-np.pi, np.pi)
"""Any direction or phase [rad]."""
_PHASE, _PHASES = "wave_phase", "wave_phases"
"""An option, and the argument of `Batch.vary` with its values."""
_MIN_VALUES = {"wave_direction": -MAX_VALUE, "wave_phase": -MAX_VALUE, "mass": 1e-3, "wave_period": 1e-3}
"""Least values of what is varied where they are not 0."""


class ActionError(gymnasium.error.InvalidAction, AssertionError):
    """An invalid action: an AssertionError, as in PettingZoo, and an InvalidAction, as in Gymnasium."""


def episode_steps(duration: object) -> int:
    """Steps of an episode; gymnasium.error.Error: its duration [s] is invalid."""
    if is_number(duration) and PERIOD <= duration <= MAX_DURATION:
        steps = round(float(duration) / PERIOD)
        if math.isclose(steps * PERIOD, float(duration)):
            return steps
    text = f"a multiple of {PERIOD:g} s, up to {MAX_DURATION:g} s, is needed"
    raise gymnasium.error.Error(f"invalid duration {quote(duration)}: {text}")


def step_limit(duration: object, most: object, default: float) -> int:
    """Steps after which an episode is truncated.

    Args:
        duration: of an episode [s], or None.
        most: Gymnasium's `max_episode_steps`, -1 for no such number, or None.
        default: duration [s] where neither is given.

    Raises:
        gymnasium.error.Error: one of both is invalid, or the duration is longer than so many steps.
    """
    if most is None:
        return episode_steps(default if duration is None else duration)
    if not _is_whole(most) or (most < 1 and most != -1):
        text = "a whole number above 0 is needed, or -1 for no limit"
        raise gymnasium.error.Error(f"invalid max_episode_steps {quote(most)}: {text}")
    limit = _ENDLESS if most == -1 else min(int(most), _ENDLESS)
    steps = limit if duration is None else episode_steps(duration)
    if steps > limit:
        text = f"truncates an episode after {limit * PERIOD:g} s; give max_episode_steps={steps} instead"
        raise gymnasium.error.Error(f"invalid duration {quote(duration)}: max_episode_steps={limit} {text}")
    return steps


def as_count(name: str, value: object, least: int = 1, most: int = MAX_ROWS) -> int:
    """The option of that name as a number; gymnasium.error.Error: not a whole number from `least` to `most`."""
    if not _is_whole(value) or value < least:
        text = "above 0" if least else "of 0 or more"
        raise gymnasium.error.Error(f"invalid {name} {quote(value)}: a whole number {text} is needed")
    if value > most:
        raise gymnasium.error.Error(f"invalid {name} {quote(value)}: at most {most} are possible")
    return int(value)


def _is_whole(value: object) -> TypeGuard[int]:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def check_picture(mode: object, modes: Sequence[str], width: object, height: object) -> None:
    """gymnasium.error.Error: `mode` is not one of the ways to draw, or pictures have no such size [pixels]."""
    if mode is not None and not (isinstance(mode, str) and mode in modes):
        possible = ", ".join(["None", *map(repr, modes[:-1])])
        raise gymnasium.error.Error(f"invalid render_mode {quote(mode)}: {possible} or {modes[-1]!r} is needed")
    for name, size in (("width", width), ("height", height)):
        if not _is_whole(size) or not 1 <= size <= _MAX_SIDE:
            text = f"a whole number of pixels from 1 to {_MAX_SIDE} is needed"
            raise gymnasium.error.Error(f"invalid {name} {quote(size)}: {text}")


def reset_options(options: object, *known: str) -> Mapping[str, Any]:
    """Options given to `reset`, checked.

    Raises:
        gymnasium.error.Error: it is not a mapping.
        UnknownNameError: an option is unknown.
    """
    given = {} if options is None else options
    if not isinstance(given, Mapping):
        raise gymnasium.error.Error(f"invalid options {quote(options)}: a mapping is needed")
    for name in given:
        check_name("reset option", name, known)
    return given


def is_number(value: object) -> TypeGuard[float]:
    """Whether it is a finite number."""
    return isinstance(value, int | float | np.integer | np.floating) and math.isfinite(as_number(value))


def as_actions(action: object, name: str = "action") -> npt.NDArray[np.float32]:
    """Actions as an array, from -1 to 1 and beyond; ActionError: some values are not numbers."""
    try:
        with np.errstate(over="ignore"):  # an infinity is out of range like the number
            given = np.asarray(action)
            if given.dtype.kind == "c":
                raise TypeError
            given = np.asarray(given, np.float32)
    except (TypeError, ValueError, OverflowError):
        raise ActionError(f"invalid {name}: an array of numbers is needed") from None
    bounded = given.clip(-1.0, 1.0)
    return np.where(np.abs(given - bounded) <= _ROUNDING, bounded, given)


def neighbour_view(neighbours: object, reach: object, noise: object, delay: object) -> NeighbourView:
    """How boats see each other; gymnasium.error.Error: an option is invalid."""
    count = as_count("neighbours", neighbours, 0, _MOST_NEIGHBOURS)
    if not is_number(reach) or reach <= 0.0:
        raise gymnasium.error.Error(f"invalid range {quote(reach)}: a number of metres above 0 is needed")
    given = tuple(noise) if isinstance(noise, Sequence | np.ndarray) else ()
    if len(given) != 3 or not all(is_number(one) and one >= 0.0 for one in given):
        text = "three numbers of 0 or more are needed, of places [m], velocities [m/s] and headings [rad]"
        raise gymnasium.error.Error(f"invalid noise {quote(noise)}: {text}")
    if (
        not is_number(delay)
        or not 0.0 <= delay <= _LONGEST_DELAY
        or not math.isclose(delay / PERIOD, round(delay / PERIOD), abs_tol=1e-6)
    ):
        raise gymnasium.error.Error(
            f"invalid delay {quote(delay)}: a multiple of {PERIOD:g} s, up to {_LONGEST_DELAY:g} s, is needed"
        )
    return NeighbourView(
        count, float(reach), (float(given[0]), float(given[1]), float(given[2])), round(delay / PERIOD)
    )


def chance(name: str, value: object) -> float:
    """A share of boats; gymnasium.error.Error: not from 0 to 1."""
    if not is_number(value) or not 0.0 <= value <= 1.0:
        raise gymnasium.error.Error(f"invalid {name} {quote(value)}: a share from 0 to 1 is needed")
    return float(value)


def team_share(reward: object) -> float:
    """The team's share of a boat's reward, from the option `reward`; gymnasium.error.Error: it is invalid."""
    if isinstance(reward, str) and reward in {"team", "individual"}:
        return float(reward == "team")
    if not is_number(reward) or not 0.0 <= reward <= 1.0:
        text = "'team', 'individual' or the team's share, from 0 to 1, is needed"
        raise gymnasium.error.Error(f"invalid reward {quote(reward)}: {text}")
    return float(reward)


def row_mask(name: str, given: object, n: int) -> BoolArray:
    """Which rows are meant; None means all.

    Raises:
        gymnasium.error.Error: `given`, the option `name`, is not a mask of `n` rows.
    """
    mask = np.ones(n, np.bool_) if given is None else np.asarray(given)
    if mask.shape != (n,) or mask.dtype != bool:
        text = f"({n},) of bool is needed"
        raise gymnasium.error.Error(f"invalid {name} of shape {mask.shape} and type {mask.dtype}: {text}")
    return mask


Seeds = int | Sequence[int | None] | None
"""One for row 0, and the next ones for the others; one for each row, None for a row that goes on; or None for all."""
Range = float | Sequence[float] | None
"""A number, or the least and the greatest of which one is drawn evenly; None: as the world has it."""

VARIED: Mapping[str, Range] = {
    "wind_speed": None, "gusts": None, "waves": None, "wave_period": (0.8, 1.4), "wave_band": (0.5, 1.2),
    "wave_direction": _FULL_TURN, "wave_spread": (0.0, 1.5), _PHASE: _FULL_TURN, "mass": None, "thrust": None,
}  # fmt: skip
"""Quantities that can be varied, and their default ranges: factors of the period, the band and the spread of waves."""


class Generators:
    """Generators of the rows' episodes; that of row i for seed s is that of seed s + i alone."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._random: list[np.random.Generator] = []

    def check_begun(self) -> None:
        """gymnasium.error.ResetNeeded: `reset` was not called."""
        if not self._random:
            raise gymnasium.error.ResetNeeded("call reset() before step() or render()")

    def of(self, rows: IntArray) -> list[np.random.Generator]:
        """Generators of some rows."""
        return [self._random[row] for row in rows.tolist()]

    def seed(self, rows: IntArray, seed: Seeds) -> None:
        """Give rows generators of their own.

        Raises:
            gymnasium.error.Error: not as many seeds as rows, or one is invalid; then no row has another generator.
        """
        if seed is None and self._random:
            return
        seeds = _seeds_of_rows(seed, self._n)
        wanted = [row for row in rows.tolist() if seeds[row] is not None] if self._random else range(self._n)
        fresh = {row: seeding.np_random(seeds[row])[0] for row in wanted}
        self._random = [fresh[row] if row in fresh else self._random[row] for row in range(self._n)]

    def use(self, row: int, random: np.random.Generator) -> None:
        """Set the generator of a row."""
        if not self._random:
            self._random = [seeding.np_random(None)[0] for _ in range(self._n)]
        self._random[row] = random


def _seeds_of_rows(seed: object, n: int) -> list[int | None]:
    """The seed of each row; errors name no row where there is only one."""
    text = "a whole number of 0 or more is needed"
    if seed is None or isinstance(seed, int | np.integer):
        given: list[Any] = [None if seed is None else int(seed) + row for row in range(n)]
    elif isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str | bytes) and np.ndim(seed[:0]) == 1:
        given = list(seed)
    else:
        each = f", or one for each of {n} rows" if n > 1 else ""
        raise gymnasium.error.Error(f"invalid seed {quote(seed)}: {text}{each}")
    if len(given) != n:
        needed = f"for {n} rows: one seed, or one for each row, is needed" if n > 1 else "given: one is needed"
        raise gymnasium.error.Error(f"{len(given)} seeds {needed}")
    for row, own in enumerate(given):
        if own is not None and (not isinstance(own, int | np.integer) or own < 0):
            where = f" of row {row}" if n > 1 else ""
            raise gymnasium.error.Error(f"invalid seed {quote(own)}{where}: {text}")
    return [None if own is None else int(own) for own in given]


class Variety:
    """Domain randomisation: wind, sea, mass and thrust, drawn anew for every episode."""

    def __init__(self, rows: Rows, problem: str, given: Mapping[str, Range]) -> None:
        """Take the ranges that differ from `VARIED`; a world with a referee is as it is.

        Raises:
            gymnasium.error.Error: a name or a range is invalid, or a boat with so much mass does not float upright.
        """
        unknown = [name for name in given if name not in VARIED]
        if unknown:
            raise gymnasium.error.Error(f"{problem} has no option {unknown[0]}")
        if isinstance(rows, RefereedRow) and given:
            raise gymnasium.error.Error(f"{problem} has no option {next(iter(given))}: its world cannot be varied")
        ranges = {**VARIED, **given} if isinstance(rows, Batch) else {}
        fixed = fixed_arguments(rows.world.parameters.sea) if isinstance(rows, Batch) else ()
        ranges |= dict.fromkeys({_PHASE if name == _PHASES else name for name in fixed} - given.keys())
        self._ranges = {name: _range(name, value) for name, value in ranges.items() if value is not None}
        if isinstance(rows, Batch) and "mass" in self._ranges:
            _check_mass(rows, ranges["mass"], self._ranges["mass"][1])
        if "wind_speed" in self._ranges:
            self._ranges["wind_direction"] = _FULL_TURN
        self._rows, self._waves = rows, len(rows.waves(0))
        self._drawn = {name: np.zeros((rows.n, *self._shape(name))) for name in self._ranges}

    def _shape(self, name: str) -> tuple[int, ...]:
        return (self._waves,) if name == _PHASE else ()

    def draw(self, rows: IntArray, random: Sequence[np.random.Generator]) -> None:
        """Draw for these rows, whose generators are given, before they are reset."""
        changed: dict[str, Any] = {}
        for name, (low, high) in self._ranges.items():
            shape = self._shape(name)
            drawn = np.array([own.uniform(low, high, shape or None) for own in random]).reshape(len(random), *shape)
            changed[_PHASES if shape else name] = drawn
            self._drawn[name][rows] = drawn
        if isinstance(self._rows, Batch):
            self._rows.vary(rows, **changed)

    def facts(self) -> Facts:
        """Values drawn last by the names of the options, (n,), or (n, waves) for phases."""
        return dict(self._drawn)


def _range(name: str, value: object) -> tuple[float, float]:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    pair = tuple(value) if isinstance(value, Sequence) else (value, value)
    least = _MIN_VALUES.get(name, 0.0)
    if len(pair) != 2 or not all(map(is_number, pair)) or not least <= pair[0] <= pair[1] <= MAX_VALUE:
        number = f"a number from {least:g} to {MAX_VALUE:g}"
        raise gymnasium.error.Error(f"invalid {name} {quote(value)}: {number}, or a pair (low, high), is needed")
    return float(pair[0]), float(pair[1])


def _check_mass(batch: Batch, given: Range, most: float) -> None:
    """gymnasium.error.Error: with `most` times its mass an end of a boat is under calm water."""
    limits = batch.largest_masses
    boat = int(np.argmin(limits))
    if most > limits[boat]:
        text = f"at most {limits[boat]:.3g} is allowed; with more, an end of {batch.boats[boat]} is under water"
        raise gymnasium.error.Error(f"invalid mass {quote(given)}: {text}")
