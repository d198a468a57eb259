"""Rows of a world on a graphics processor."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import cuda
from numba.cuda.core import config

from vrx_mj.arguments import as_int
from vrx_mj.arrays import IntArray
from vrx_mj.cuda.kernels import advance_marine, advance_vrx, command, launcher
from vrx_mj.cuda.rows import DeviceArray, DeviceRows
from vrx_mj.errors import CommandError, DivergedError
from vrx_mj.mjcf.world import World
from vrx_mj.runtime import batch
from vrx_mj.runtime.rows import Rows, as_numbers, which_rows
from vrx_mj.runtime.state import rows_divergence_message
from vrx_mj.runtime.timing import MOST_STEPS

_CUDA = (2, 13)
"""Kinds of device by DLPack's numbers: the card's memory, and managed memory."""


class Batch:
    """`n` rows of one world of single free bodies on the current graphics processor, one thread for each.

    The functions that move a row are those of `vrx_mj.Batch(world, n, engine="free")`, compiled for the processor, and
    seeds, phases and starts come from the same functions: a row is the run of the row of that batch, to rounding of
    the processor's exponentials and angles. It is the same bit for bit in every run and for any number of rows.

    A row that comes within reach of anything stops there: see `near` and `check`. Arrays are on the device, have
    `__cuda_array_interface__` (`torch.as_tensor(batch.features, device="cuda")` copies nothing) and stay where they
    are. Calls are queued on `stream` and return at once, but for `reset`, `vary`, `host` and `check`.
    """

    def __init__(
        self, world: World, n: int, *, seed: int | Sequence[int] | None = None, stream: int | None = None
    ) -> None:
        """Create the rows, at the start of their runs.

        Args:
            world: as `vrx_mj.Batch` with `engine="free"` takes it.
            n: number of rows.
            seed: as in `vrx_mj.Batch.reset`.
            stream: address of a CUDA stream, as `torch.cuda.current_stream().cuda_stream`; by default the default one.

        Raises:
            CommandError: there is no graphics processor or not enough memory, or a body of the world is not free.
        """
        if not (config.ENABLE_CUDASIM or cuda.is_available()):
            raise CommandError(
                'no graphics processor: numba-cuda finds no CUDA driver (nvidia-smi); use vrx_mj.Batch(engine="free")'
            )
        self._batch = batch.Batch(world, n, seed=seed, threads=1, engine="free")
        self.world, self.n = world, self._batch.n
        self._stream = cuda.external_stream(stream) if stream else cuda.default_stream()
        rows, waves = self._batch._rows, len(self._batch._arrays.waves)
        self._rows = DeviceRows(rows, self._stream)
        advance = advance_vrx if rows.arrays.vrx_only else advance_marine
        self._advance = launcher(advance, self.n, waves, self._stream)
        self._command = launcher(command, self.n, 0, self._stream)
        self._thrusters, self._angles = map(cuda.to_device, (self._batch._thrusters, self._batch._angles))
        self._asked = 0

    @property
    def boats(self) -> tuple[str, ...]:
        """Names of the boats in every row, in the order of the second axis of `features`."""
        return self._batch.boats

    @property
    def channels(self) -> tuple[tuple[str, str], ...]:
        """Boat and name of every command, in the order that `command` takes: thrusts, then steering angles."""
        return self._batch.channels

    @property
    def timestep(self) -> float:
        """Physics step [s]."""
        return self._batch.timestep

    @property
    def features(self) -> DeviceArray:
        """State of every boat after the last `advance`, (n, boats, 13) on the device: `vrx_mj.Batch.features`."""
        return self._rows.arrays["features"]

    @property
    def qpos(self) -> DeviceArray:
        """Generalized positions of every row, (n, nq) on the device."""
        return self._rows.arrays["qpos"]

    @property
    def time(self) -> DeviceArray:
        """Simulated time of every row, (n,) on the device [s]."""
        return self._rows.arrays["time"]

    @property
    def done(self) -> DeviceArray:
        """Steps that every row has made in the last `advance`, (n,) on the device.

        Fewer than asked for where something was near; -1 where the state has diverged, until the row is reset.
        """
        return self._rows.arrays["done"]

    def command(self, values: npt.ArrayLike, *, hold: float = 0.0) -> None:
        """Set thrusts and steering angles of all rows, (n, channels), in the order of `channels`.

        Args:
            values: numbers of 64 or 32 bits on this device, or of any kind on the host. A row whose numbers are not
                finite diverges.
            hold: a thrust lasts for its thruster's timeout, and at least so long [s].

        Raises:
            CommandError: the shape is wrong, or the numbers are on another device or of another type.
        """
        given, needed = self._on_device(values), (self.n, len(self.channels))
        if tuple(given.shape) != needed or given.dtype not in (np.float64, np.float32):
            text = f"{needed}, float64 or float32, is needed"
            raise CommandError(f"invalid commands of shape {given.shape}, {given.dtype}: {text}")
        at = self._rows.arrays
        self._command(at["runs"], at["time"], given, self._thrusters, self._angles, float(hold))

    def _on_device(self, values: npt.ArrayLike) -> DeviceArray:
        """An array of the host, or of another library, as one of numba's."""
        given: DeviceArray
        if hasattr(values, "__cuda_array_interface__"):
            kind, number = values.__dlpack_device__() if hasattr(values, "__dlpack_device__") else (_CUDA[0], None)
            own = cuda.get_current_device().id
            if kind not in _CUDA or number not in {None, own}:
                raise CommandError(f"commands are on device {number}: move them to device {own}, which has the rows")
            given = cuda.as_cuda_array(values, sync=False)
        else:
            given = cuda.to_device(np.ascontiguousarray(as_numbers("commands", values)), stream=self._stream)
        return given

    def advance(self, steps: int) -> None:
        """Advance all rows by a number of physics steps, in one launch.

        Raises:
            CommandError: `steps` is not a whole number of 0 or more.
        """
        self._asked, at = as_int("number of steps", steps, 0, MOST_STEPS), self._rows.arrays
        own = at["runs"], at["time"], at["done"], at["features"], self.timestep, self._asked
        self._advance(*own, *self._rows.work)

    def near(self) -> IntArray:
        """Numbers of the rows that the last `advance` stopped because something was near; waits for the device."""
        done = self.done.copy_to_host(stream=self._stream)
        self._stream.synchronize()
        return np.flatnonzero((done >= 0) & (done < self._asked))

    def check(self) -> None:
        """Wait for the device, and name rows that have stopped.

        Raises:
            DivergedError: the state of rows is not finite or too large; they stop until they are reset.
            CommandError: something is near rows; they stop until they are reset, or moved on the host.
        """
        near, done = self.near(), self.done.copy_to_host()
        if len(diverged := np.flatnonzero(done < 0)):
            raise DivergedError(rows_divergence_message(diverged, float(self.time.copy_to_host()[diverged[0]])))
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

    def reset(self, rows: Rows = None, *, seed: int | Sequence[int] | IntArray | None = None) -> None:
        """Reset rows to their start, as `vrx_mj.Batch.reset` does; errors are its. Only these are copied."""
        self._batch.reset(rows, seed=seed)
        self._push_rows(rows, moving=True)

    def vary(self, rows: Rows = None, **values: Any) -> None:
        """Change parameters of rows from their next reset on, as `vrx_mj.Batch.vary` does; errors are its."""
        if "parameters" in values:  # tables outside of the stacks
            self.host().vary(rows, **values)
            self.push()
        else:
            self._batch.vary(rows, **values)
            self._push_rows(rows, moving=False)

    def _push_rows(self, rows: Rows, *, moving: bool) -> None:
        self._rows.push_rows(which_rows(self.n, rows), moving=moving)
        self._asked = 0
