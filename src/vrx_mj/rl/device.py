"""An environment whose rows, arrays and episodes are on a graphics processor."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.cuda import Batch, arrays, check_driver
from vrx_mj.errors import CommandError
from vrx_mj.rl.environment import Actions, Environment, Floats32, Info
from vrx_mj.rl.options import PERIOD, ActionError, Seeds
from vrx_mj.rl.problem import Facts, RowArrays
from vrx_mj.runtime import batch


class DeviceEnvironment(Environment):
    """An `Environment` whose steps are those of its class, on arrays of CuPy: NumPy's functions call CuPy's for them.

    `reset` draws starts on the host: start k is the first episode of the CPU's row k. Row k begins with it, and each
    later episode of a row with the next start, after the last with the first, which the processor copies.
    """

    def __init__(self, problem: str, n: int, **options: Any) -> None:
        """Compile the world and make its rows; the arguments are those of `Environment`, whose engine is `free`.

        Raises:
            CommandError: boats could touch something, or there is no graphics processor or not enough memory.
        """
        check_driver()
        super().__init__(problem, n, **options | {"engine": "free"})
        assert isinstance(self.batch, batch.Batch), "only Score has another kind of rows"
        rows = self._device = Batch.of(self.batch)
        if not rows.open_water:
            text = f"boats may touch something in world {rows.world.name}, which only MuJoCo can step"
            raise CommandError(f'device cuda: {text}; take engine="free" and device="cpu"')
        self._drawn = self.problem, self.lost_boats, self.roster
        self.problem = self.problem.with_arrays(arrays.array)
        self.lost_boats = self.lost_boats.with_arrays(arrays.array)
        self.roster = self.roster.with_arrays(arrays.array)
        self.seen, surface = rows, rows.observe().surface
        self.lost_boats.seen, self.lost_boats.sea_height = rows, lambda _x, _y: surface
        self.actions = DeviceActions(rows.boats, rows.channels, self.batch.largest)
        self.steps, self._last, self._scales = map(arrays.array, (self.steps, self._last, self._scales))
        self._starts = arrays.zeros(n, np.int64)
        self._kept: tuple[RowArrays, ...] = ()

    def reset(self, rows: BoolArray, seed: Seeds) -> Floats32:
        """Draw starts, and begin an episode in all rows, (n,).

        Raises:
            CommandError: only some rows are meant.
            gymnasium.error.Error: the seeds are invalid.
        """
        if not rows.all():
            text = 'leave out `reset_mask`, or take device="cpu"'
            raise CommandError(f"device cuda: rows reset by themselves; {text}")
        which = np.arange(len(rows))
        self.generators.seed(which, seed)
        self.episodes.begin(which)
        self._device.keep()
        self._kept = tuple(part.with_arrays(arrays.array) for part in self._drawn)
        self._starts = arrays.arange(len(rows)) - 1
        self.begin(arrays.asarray(rows))
        return self.observe()

    def begin(self, begun: BoolArray) -> None:
        """Begin the episodes of the next starts in some rows, (n,), without waiting for the device."""
        starts = self._starts = np.where(begun, (self._starts + 1) % len(begun), self._starts)
        self._device.begin(begun, starts)
        self.steps = np.where(begun, 0, self.steps)
        self._last = np.where(begun[:, None, None], np.float32(0.0), self._last)
        for part, kept in zip((self.problem, self.lost_boats, self.roster), self._kept, strict=True):
            for name in part.row_arrays:
                values, own = getattr(kept, name), getattr(part, name)
                setattr(part, name, np.where(begun.reshape(-1, *[1] * (values.ndim - 1)), values[starts], own))

    def observe(self) -> Floats32:
        """Observations of all boats now, (n, boats, features)."""
        self._device.observe()
        return super().observe()

    def any_of(self, rows: BoolArray) -> bool:
        """Whether any of these rows may need something: the host would wait for the device to know."""
        return True

    def info(self, facts: Facts, rows: BoolArray) -> Info:
        """The facts of all rows, without masks, for which the host would wait for the device."""
        return dict(facts)

    def final_info(self, facts: Facts, observation: Floats32, ended: BoolArray) -> Info:
        """Observations, (n, features), and facts of all rows after the step: the last of those that have `ended`."""
        return {"final_obs": observation, "final_info": dict(facts)}

    def episode_info(self, rows: BoolArray) -> Info:
        """Values that the problem drew for the current episodes of all rows, and the number of each `start`, (n,)."""
        return self.problem.episode_facts() | {"start": self._starts}

    def _advance(self, going: BoolArray) -> BoolArray:
        self._device.step(self.actions.commands(self._last), duration=PERIOD, rows=going)
        self._device.observe()
        return self.seen.diverged


class DeviceActions(Actions):
    """Actions as arrays on the device."""

    def __init__(self, boats: Sequence[str], channels: Sequence[tuple[str, str]], largest: FloatArray) -> None:
        """Take what `Actions` takes."""
        super().__init__(boats, channels, largest)
        self._places, self._limits = map(arrays.asarray, (self._places, self._limits))

    def array(self, actions: npt.ArrayLike, present: BoolArray, shape: tuple[int, ...] | None = None) -> Floats32:
        """Actions (n, 1, most), clipped to [-1, 1]: the host would wait for the device to check them.

        Raises:
            ActionError: they have another shape than `shape`.
        """
        given: Floats32 = arrays.asarray(actions)
        if tuple(given.shape) != shape:
            raise ActionError(f"invalid actions of shape {tuple(given.shape)}: {shape} is needed")
        return given.astype(np.float32).clip(-1.0, 1.0).reshape(*present.shape, self.most)
