"""Rows of a world on a graphics processor."""

from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from numba import cuda

from vrx_mj.arguments import as_int
from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.cuda.kernels import SIMULATED, advance_marine, advance_vrx, command, launcher, observe
from vrx_mj.cuda.rows import DeviceArray, DeviceRows, arrays
from vrx_mj.errors import CommandError, DivergedError
from vrx_mj.mjcf.world import World
from vrx_mj.runtime import batch
from vrx_mj.runtime.row_tables import Seeds, Values
from vrx_mj.runtime.rows import Rows, as_numbers, which_rows
from vrx_mj.runtime.state import rows_divergence_message
from vrx_mj.runtime.timing import MOST_STEPS, whole_steps

_DEVICES = (2, 13)
"""Kinds of device by DLPack's numbers: the card's memory, and managed memory."""


def check_driver(remedy: str = 'take vrx_mj.Batch(engine="free"), or device="cpu"') -> None:
    """CommandError: there is no graphics processor, or no compiler for it; the message ends with the `remedy`."""
    if not (SIMULATED or cuda.is_available()):
        raise CommandError(f"no graphics processor: numba-cuda finds no driver or no NVVM (numba -s); {remedy}")


class RowsObserved(NamedTuple):
    """Observations of rows for a learner: arrays on the device whose addresses do not change."""

    features: FloatArray
    """(n, boats, 13): `vrx_mj.Batch.features`."""
    wind: FloatArray
    """(n, 2): `vrx_mj.Batch.wind`."""
    surface: FloatArray
    """(n, boats): height of the sea at the boats' origins [m]."""


class Batch:
    """`n` rows of one world of single free bodies on the current graphics processor.

    A thread moves each row, in profile `marine` eight together.

    The functions that move a row are those of `vrx_mj.Batch(world, n, engine="free")`, compiled for the processor, and
    seeds, phases and starts come from the same functions: a row is the run of the row of that batch, to rounding of
    the processor's exponentials and angles. It is the same bit for bit in every run and for any number of rows.

    A row that comes within reach of anything stops there: see `near` and `check`. Arrays are CuPy's, on the device,
    with DLPack and `__cuda_array_interface__` (`torch.from_dlpack(batch.features)` copies nothing), and stay where they
    are. Calls are queued on `stream` and return at once, but for `reset`, `vary`, `host` and `check`.
    """

    def __init__(self, world: World, n: int, *, seed: Seeds = None, stream: int | None = None) -> None:
        """Create the rows, at the start of their runs.

        Args:
            world: as `vrx_mj.Batch` with `engine="free"` takes it.
            n: number of rows.
            seed: as in `vrx_mj.Batch.reset`.
            stream: address of a CUDA stream, as `torch.cuda.current_stream().cuda_stream`; by default the default one.

        Raises:
            CommandError: there is no graphics processor or not enough memory, the world has no boat, or a body of it
                is not free.
        """
        check_driver()
        self._start(batch.Batch(world, n, seed=seed, threads=1, engine="free"), stream)

    @classmethod
    def of(cls, host: batch.Batch, *, stream: int | None = None) -> Self:
        """The rows of a batch on the host with `engine="free"`, which `host` returns, in its state."""
        check_driver()
        made = cls.__new__(cls)
        made._start(host, stream)
        return made

    def _start(self, host: batch.Batch, stream: int | None) -> None:
        if not host.boats:
            raise CommandError(f'world {host.world.name} has no boat: take vrx_mj.Batch(engine="free")')
        self._batch, self.world, self.n = host, host.world, host.n
        self._stream = cuda.external_stream(stream) if stream else cuda.default_stream()
        rows, waves = self._batch._rows, len(self._batch._arrays.waves)
        self._rows = DeviceRows(rows, self._stream)
        advance = advance_vrx if rows.arrays.vrx_only else advance_marine
        self._advance = launcher(advance, self.n * self._rows.threads, waves, self._stream)
        self._command, self._observe = (launcher(each, self.n, 0, self._stream) for each in (command, observe))
        self._thrusters, self._angles = map(cuda.to_device, (self._batch._thrusters, self._batch._angles))
        at = self._rows.arrays
        self._asked, self._going = 0, at["going"]
        self.boats, self.channels, self.timestep = host.boats, host.channels, host.timestep
        """Names of boats and of channels, and the timestep [s], as `vrx_mj.Batch` has them."""
        self.open_water = len(host._arrays.movers) == 1 and not len(host._arrays.obstacles)
        """Whether a row has nothing that its boat could touch; then no row ever stops for it."""
        self.qpos: FloatArray = arrays.asarray(at["qpos"][: self.n])
        """Generalized positions of every row, (n, nq)."""
        self.time: FloatArray = arrays.asarray(at["time"])
        """Simulated time of every row, (n,) [s]."""
        self.done: IntArray = arrays.asarray(at["done"])
        """Steps that every row has made in the last `advance`, (n,).

        Fewer than asked for where something was near; -1 where the state has diverged, until the row is reset.
        """
        seen = at["features"], at["wind_velocity"], at["surface"]
        self._observed = RowsObserved(*map(arrays.asarray, seen))
        self.features, self.wind, _ = self._observed
        """Features of boats after the last `advance` and wind at the last `observe`, as in `vrx_mj.Batch`."""

    @property
    def diverged(self) -> BoolArray:
        """Rows whose state is not finite or too large, (n,); they stop until they are reset."""
        return self.done < 0

    def command(self, values: npt.ArrayLike, *, hold: float = 0.0) -> None:
        """Set thrusts and steering angles of all rows, (n, channels), in the order of `channels`.

        Args:
            values: numbers of 64 or 32 bits on this device, or of any kind on the host. A row whose numbers are not
                finite diverges.
            hold: a thrust lasts for its thruster's timeout, and at least so long [s].

        Raises:
            CommandError: the shape is wrong, or the numbers are on another device or of another type.
        """
        given = self._on_device("commands", values, (self.n, len(self.channels)), np.float64, np.float32)
        at = self._rows.arrays
        self._command(at["runs"], at["time"], given, self._thrusters, self._angles, float(hold))

    def _on_device(self, what: str, values: npt.ArrayLike, shape: tuple[int, ...], *types: type) -> DeviceArray:
        """An array of the host, or of another library, as one of numba's; errors are those of `command`."""
        given: DeviceArray
        if hasattr(values, "__cuda_array_interface__"):
            kind, number = values.__dlpack_device__() if hasattr(values, "__dlpack_device__") else (_DEVICES[0], None)
            own = cuda.get_current_device().id
            if kind not in _DEVICES or number not in {None, own}:
                raise CommandError(f"{what} are on device {number}: move them to device {own}, which has the rows")
            given = cuda.as_cuda_array(values, sync=False)
        else:
            given = cuda.to_device(np.ascontiguousarray(as_numbers(what, values), types[0]), stream=self._stream)
        if tuple(given.shape) != shape or given.dtype not in types:
            text = f"{shape}, {' or '.join(each.__name__ for each in types)}, is needed"
            raise CommandError(f"invalid {what} of shape {given.shape}, {given.dtype}: {text}")
        return given

    def advance(self, steps: int, rows: Values = None) -> None:
        """Advance rows by a number of physics steps, in one launch.

        Args:
            steps: number of steps.
            rows: mask (n,) of bool on this device of the rows; by default all. `done` of the others stays.

        Raises:
            CommandError: `steps` is not a whole number of 0 or more, or `rows` no such mask.
        """
        self._asked, at = as_int("number of steps", steps, 0, MOST_STEPS), self._rows.arrays
        self._going = at["going"] if rows is None else self._on_device("rows", rows, (self.n,), np.bool_)
        own = at["runs"], at["time"], self._going, at["done"], at["features"], self.timestep, self._asked
        self._rows.share()
        self._advance(*own, *self._rows.work)

    def step(self, values: Values = None, *, duration: float, rows: Values = None) -> None:
        """Advance rows by simulated time [s], a multiple of the timestep, under commands of all rows, (n, channels).

        A command holds for the whole duration. Errors are those of `command` and `advance`.
        """
        steps = whole_steps(duration, self.timestep)
        if values is not None:
            self.command(values, hold=(steps + 0.5) * self.timestep)
        self.advance(steps, rows)

    def observe(self) -> RowsObserved:
        """State of every boat, the wind and the height of the sea at every boat now."""
        at = self._rows.arrays
        self._observe(at["runs"], at["time"], at["wind_velocity"], at["surface"])
        return self._observed

    def near(self) -> IntArray:
        """Numbers of the rows that the last `advance` stopped because something was near; waits for the device."""
        done, going = (each.copy_to_host(stream=self._stream) for each in (self._rows.arrays["done"], self._going))
        self._stream.synchronize()
        return np.flatnonzero((done >= 0) & (done < self._asked) & (going != 0))

    def check(self) -> None:
        """Wait for the device, and name rows that have stopped.

        Raises:
            DivergedError: the state of rows is not finite or too large; they stop until they are reset.
            CommandError: something is near rows; they stop until they are reset, or moved on the host.
        """
        near, diverged = self.near(), np.flatnonzero(self._rows.arrays["done"].copy_to_host() < 0)
        if len(diverged):
            raise DivergedError(rows_divergence_message(diverged, float(self.time[int(diverged[0])])))
        if len(near):
            named = ", ".join(map(str, near[:10]))
            text = "they stop until they are reset, or moved by host().advance(steps, rows), with MuJoCo, and push()"
            raise CommandError(f"something is near rows {named} ({len(near)} in all): {text}")

    def host(self) -> batch.Batch:
        """The batch on the host, with the device's state copied to it; what is done with it counts after `push`."""
        self._rows.pull()
        return self._batch

    def push(self) -> None:
        """Take the state of the batch on the host, and its parameters."""
        self._batch._rows.start_free(np.arange(self.n))
        self._rows.push()
        self._asked = 0

    def reset(self, rows: Rows = None, *, seed: Seeds = None) -> None:
        """Reset rows to their start, as `vrx_mj.Batch.reset` does; errors are its. Only these are copied."""
        self._batch.reset(rows, seed=seed)
        self._push_rows(rows, moving=True)

    def keep(self) -> None:
        """Take the state of the batch on the host, as `push` does, and keep it as starts, for `begin`."""
        self._rows.keep()
        self._asked = 0

    def begin(self, rows: npt.ArrayLike, starts: npt.ArrayLike) -> None:
        """Let rows go on from kept starts, without a copy from the host.

        Args:
            rows: mask (n,) of bool on this device of the rows.
            starts: (n,), int64, on this device: the number of the row whose start each takes.

        Raises:
            CommandError: these are no such arrays, or no starts are kept, or `vary` has changed the size of a table.
        """
        begun = self._on_device("rows", rows, (self.n,), np.bool_)
        self._rows.begin(begun, self._on_device("starts", starts, (self.n,), np.int64))

    def vary(self, rows: Rows = None, **values: Any) -> None:
        """Change parameters of rows, which are to be reset then, as `vrx_mj.Batch.vary` does; errors are its."""
        if "parameters" in values:  # tables outside of the stacks
            self.host().vary(rows, **values)
            self.push()
        else:
            self._batch.vary(rows, **values)
            self._push_rows(rows, moving=False)

    def _push_rows(self, rows: Rows, *, moving: bool) -> None:
        self._rows.push_rows(which_rows(self.n, rows), moving=moving)
        self._asked = 0
