"""An environment whose rows, arrays and episodes are on a graphics processor."""

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.cuda import SIMULATED, Batch, check_driver
from vrx_mj.errors import CommandError
from vrx_mj.packages import importing
from vrx_mj.rl.environment import Actions, Environment, Floats32, Info
from vrx_mj.rl.options import PERIOD, ActionError, Seeds

arrays: Any = np
"""The library of arrays: CuPy, or NumPy where the processor is simulated."""
if not SIMULATED:
    with importing("device='cuda'", "CuPy", "cuda"):
        import cupy

        arrays = cupy
_PARTS = ("problem", "lost_boats", "roster")
"""Parts of an environment whose arrays have a row for each world."""


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
        host = self._host = Environment(problem, n, **options | {"engine": "free"})
        vars(self).update(vars(host))
        rows = self._device = Batch.of(vars(host)["batch"])
        if not rows.open_water:
            text = f"boats may touch something in world {rows.world.name}, which only MuJoCo can step"
            raise CommandError(f'device cuda: {text}; take device="cpu"')
        own = {name: copy.copy(vars(host)[name]) for name in _PARTS}
        own["actions"] = DeviceActions(rows.boats, rows.channels, host.batch.largest)
        for thing in (self, *own.values()):
            vars(thing).update(_device_arrays(thing))
        own["batch"] = vars(own["lost_boats"])["_batch"] = DeviceRows(rows)
        vars(self).update(own)
        self._starts = arrays.zeros(n, np.int64)
        self._kept: dict[str, dict[str, Any]] = {}

    def reset(self, rows: BoolArray, seed: Seeds) -> Floats32:
        """Draw starts, and begin an episode in all rows, (n,).

        Raises:
            CommandError: only some rows are meant.
            gymnasium.error.Error: the seeds are invalid.
        """
        if not rows.all():
            text = 'leave out `reset_mask`, or take device="cpu"'
            raise CommandError(f"device cuda: rows reset by themselves; {text}")
        self._host.reset(rows, seed)
        self._device.keep()
        self._kept = {name: _device_arrays(vars(self._host)[name]) for name in _PARTS}
        self._starts = arrays.arange(len(rows)) - 1
        self.begin(arrays.asarray(rows))
        self._last = np.zeros_like(self._last)
        self._device.observe()
        return self.observe()

    def begin(self, begun: BoolArray) -> None:
        """Begin the episodes of the next starts in some rows, (n,), without waiting for the device."""
        starts = self._starts = np.where(begun, (self._starts + 1) % len(begun), self._starts)
        self._device.begin(begun, starts)
        self.steps = np.where(begun, 0, self.steps)
        for name, kept in self._kept.items():
            own = vars(vars(self)[name])
            for array, values in kept.items():
                wide = begun.reshape(-1, *[1] * (values.ndim - 1))
                own[array] = np.where(wide, values[starts], own[array])

    def info(self, facts: Mapping[str, npt.NDArray[np.generic]], rows: BoolArray) -> Info:
        """The facts of all rows, without masks, for which the host would wait for the device."""
        return dict(facts)

    def episode_info(self, rows: BoolArray) -> Info:
        """What the problem drew for the present episodes of all rows, and the number of each one's `start`, (n,)."""
        return self.problem.episode_facts() | {"start": self._starts}

    def _advance(self, going: BoolArray) -> BoolArray:
        self._device.step(self.actions.commands(self._last), duration=PERIOD, rows=going)
        self._device.observe()
        diverged: BoolArray = self.batch.diverged
        return diverged


class DeviceRows:
    """What an environment reads of rows on the device, by the names of `vrx_mj.Batch`, as of the last `observe`."""

    def __init__(self, rows: Batch) -> None:
        own = rows.done, *rows.observe()
        self._done, self.features, self.wind, self._surface = map(arrays.asarray, own)  # of the same memory

    @property
    def diverged(self) -> BoolArray:
        """Whether the state of each row is not finite or too large, (n,)."""
        diverged: BoolArray = self._done < 0
        return diverged

    def sea_height(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height [m] of the sea at the boats, (n, boats), whose x and y are given."""
        surface: FloatArray = self._surface
        return surface


class DeviceActions(Actions):
    """Actions as arrays on the device."""

    def array(self, actions: npt.ArrayLike, present: BoolArray, shape: tuple[int, ...] | None = None) -> Floats32:
        """Actions (n, 1, most), clipped to [-1, 1]: the host would wait for the device to check them.

        Raises:
            ActionError: they have another shape than `shape`.
        """
        given: Floats32 = arrays.asarray(actions)
        if tuple(given.shape) != shape:
            raise ActionError(f"invalid actions of shape {tuple(given.shape)}: {shape} is needed")
        return given.astype(np.float32).clip(-1.0, 1.0).reshape(*present.shape, self.most)


def _device_arrays(thing: object) -> dict[str, Any]:
    """Copies on the device of all arrays among a thing's attributes."""
    return {name: arrays.array(own) for name, own in vars(thing).items() if isinstance(own, np.ndarray)}
