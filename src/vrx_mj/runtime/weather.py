"""The sea and the wind as users ask for them: the same functions that make the forces."""

import math
import threading
from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError, quote
from vrx_mj.physics.kinematics import orbital_motions, pressures, surface_slopes
from vrx_mj.physics.waves import surface_heights
from vrx_mj.physics.wind import wind_series, wind_share
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.rows import as_numbers

_MAX_FORECAST = 1e5
"""Time up to which gusts can be asked for at any time [s]: each is drawn after the one before."""


def _broadcast(arrays: Mapping[str, FloatArray]) -> tuple[FloatArray, ...]:
    """Arrays of one shape; CommandError if they cannot be broadcast."""
    try:
        return np.broadcast_arrays(*arrays.values())
    except ValueError:
        shapes = ", ".join(str(array.shape) for array in arrays.values())
        *first, last = arrays
        text = f"invalid {', '.join(first)} and {last} of shapes {shapes}: they cannot be broadcast"
        raise CommandError(text) from None


class Sea:
    """The surface of the sea."""

    def __init__(self, arrays: LoopArrays) -> None:
        self.bind(arrays)

    def bind(self, arrays: LoopArrays) -> None:
        """Continue with new arrays of the loop, after boats have joined or left."""
        self._arrays = arrays

    def height(self, x: npt.ArrayLike, y: npt.ArrayLike, t: npt.ArrayLike) -> FloatArray:
        """Height [m] of the surface over z = 0 at (x, y) [m, ENU] and simulated time t [s].

        Vectorised: the arguments are broadcast against each other, and the result has their shape.

        Raises:
            CommandError: they are not numbers, or cannot be broadcast.
        """
        return self._at(surface_heights, (), x=x, y=y, t=t)

    def slope(self, x: npt.ArrayLike, y: npt.ArrayLike, t: npt.ArrayLike) -> FloatArray:
        """Slope of the surface toward x and y at (x, y) [m, ENU] and time t [s]: shape + (2,).

        Errors are those of `height`.
        """
        return self._at(surface_slopes, (2,), x=x, y=y, t=t)

    def velocity(self, x: npt.ArrayLike, y: npt.ArrayLike, z: npt.ArrayLike, t: npt.ArrayLike) -> FloatArray:
        """Velocity [m/s, ENU] of the water in the waves at (x, y, z) [m, ENU] and time t [s]: shape + (3,).

        Linear theory: it decays with depth, and is continued by reflection above the mean level.

        Errors are those of `height`.
        """
        return self._at(orbital_motions, (6,), x=x, y=y, z=z, t=t)[..., :3]

    def acceleration(self, x: npt.ArrayLike, y: npt.ArrayLike, z: npt.ArrayLike, t: npt.ArrayLike) -> FloatArray:
        """Acceleration [m/s2, ENU] of the water at a fixed place (x, y, z) [m, ENU] and time t [s]: shape + (3,).

        Otherwise it is like `velocity`.
        """
        return self._at(orbital_motions, (6,), x=x, y=y, z=z, t=t)[..., 3:]

    def pressure(self, x: npt.ArrayLike, y: npt.ArrayLike, z: npt.ArrayLike, t: npt.ArrayLike) -> FloatArray:
        """Pressure [Pa] over the air's at (x, y, z) [m, ENU] and time t [s]: 0 at the surface and above.

        Linear theory, stretched to the surface (Wheeler). Errors are those of `height`.
        """
        return self._at(pressures, (), x=x, y=y, z=z, t=t)

    def _at(self, kernel: Callable[..., None], each: tuple[int, ...], **given: npt.ArrayLike) -> FloatArray:
        """Values that a kernel writes at each point, of shape `each`."""
        grid = _broadcast({name: as_numbers(name, value) for name, value in given.items()})
        flat = [np.array(values).reshape(-1) for values in grid]
        out = np.empty((*flat[0].shape, *each))
        kernel(self._arrays.waves, self._arrays.sea[0], *flat, out)
        return out.reshape((*grid[0].shape, *each))


class Wind:
    """The wind, gusts included."""

    def __init__(self, arrays: LoopArrays) -> None:
        self.bind(arrays)
        self._lock = threading.Lock()
        self.forget()

    def bind(self, arrays: LoopArrays) -> None:
        """Continue with new arrays of the loop, after boats have joined or left."""
        self._arrays = arrays

    @property
    def speed(self) -> float:
        """Speed [m/s] now, gusts included; below 0 it blows against its direction."""
        begun = self._arrays.data.time > 0.0
        return float(self._arrays.wind_state["speed"][0] if begun else self._arrays.wind["mean"][0])

    @property
    def direction(self) -> float:
        """Direction it blows toward now [rad], counter-clockwise from x."""
        east, north = self._arrays.wind["direction"][0]
        toward = math.atan2(north, east)
        for angle in self._arrays.air_state["angle"].tolist():
            toward = math.remainder(toward + angle, 2.0 * math.pi)
        return toward

    def velocity(self, t: npt.ArrayLike, z: npt.ArrayLike | None = None) -> FloatArray:
        """Velocity [m/s, ENU] of the air at simulated time t [s]: an array of t's shape + (3,).

        Gusts come from a numbered stream, so t may be any time, past or future. Between
        steps the gust of the last one holds, and at t = 0 there is no gust yet. `z` is the height above the
        water [m], broadcast against t, for winds with a profile; by default the wind's reference height.

        Raises:
            CommandError: a time or a height is not a number, they cannot be broadcast, or a time is more than 1e5 s
                and twice the simulated time so far.
        """
        times = as_numbers("t", t)
        latest = max(_MAX_FORECAST, 2.0 * float(self._arrays.data.time))
        if not (np.abs(times) <= latest).all():
            raise CommandError(f"invalid t {quote(t)}: times up to {latest:g} s are needed")
        own = np.ones(()) if z is None else self._shares(as_numbers("z", z))
        _, shares = _broadcast({"t": times, "z": own})
        steps = np.floor(times / self._arrays.timestep + 1e-6).astype(np.int64)
        with self._lock:
            self._replay_to(int(steps.max(initial=0)))
            found = self._replayed[np.maximum(steps, 0)]
        out = np.zeros((*shares.shape, 3))
        out[..., 0], out[..., 1] = shares * found[..., 0], shares * found[..., 1]
        return out

    def forget(self) -> None:
        """Start the replay again: the noise stream has changed."""
        wind, kinds = self._arrays.wind, (self._arrays.wind_state, self._arrays.air_state)
        with self._lock:
            self._replay, self._turned = (np.zeros(len(table), table.dtype) for table in kinds)
            self._replayed = wind["mean"][:, None] * wind["direction"]

    def _shares(self, heights: FloatArray) -> FloatArray:
        """Speeds at heights over that at the wind's own."""
        if not np.isfinite(heights).all():
            raise CommandError(f"invalid z {quote(heights.tolist())}: finite numbers are needed")
        found = [wind_share(self._arrays.air, height) for height in heights.reshape(-1).tolist()]
        return np.array(found, np.float64).reshape(heights.shape)

    def _replay_to(self, steps: int) -> None:
        """Extend the replayed velocities to those after each of so many steps, (steps + 1, 2) or more."""
        missing = steps + 1 - len(self._replayed)
        if missing <= 0:
            return
        missing = max(missing, len(self._replayed) // 8)  # so that what is asked step by step is not copied each time
        arrays, more = self._arrays, np.empty((missing, 2))
        wind_series(arrays.wind[0], self._replay[0], arrays.gust_bands, arrays.air, self._turned, arrays.timestep, more)
        self._replayed = np.concatenate((self._replayed, more))
