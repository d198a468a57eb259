"""What threads of a graphics processor do: the functions of `runtime.rows`, one row for each thread.

Outside of VRX's profiles the lanes of `physics.lanes` are eight threads, which share a row: its mesh, waves and tables
are read and written together. What else changes in a row each thread has for itself, in a run of its own, and comes to
the same numbers.
"""

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numba_cuda
from llvmlite import ir
from numba import cuda
from numba.cuda.core import config

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.physics.kernel import FOLDER
from vrx_mj.physics.lanes import WIDTH, LanesType
from vrx_mj.physics.tables import Table
from vrx_mj.physics.vessel import VesselWork
from vrx_mj.runtime.rows import advance_free_row, command_row, observe_row

Stream = Any
"""A CUDA stream, as numba has it."""
SIMULATED = bool(config.ENABLE_CUDASIM)
"""Whether this is numba's simulator of a processor, in which arrays of the device are NumPy's."""
_FEW_WAVES, _MAX_REGISTERS = 10, 96
"""Number of waves above which a thread gets at most so many registers, so that more rows run at once: on an H100 765
million steps a second against 541 without a limit at 60 waves, but 1,330 against 1,769 at 5."""
_BLOCK_SIZE = 64
"""Threads of a block. From 32 to 256 speeds differ by 6 %."""

if not SIMULATED:
    from numba.cuda.models import PrimitiveModel, register_model

    @register_model(LanesType)
    class _LanesModel(PrimitiveModel):  # type: ignore[misc]
        """A value of lanes on the device: a thread holds one number of it."""

        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, ir.DoubleType())


def advance_vrx(
    runs: Table, time: FloatArray, going: BoolArray, done: IntArray, features: FloatArray, dt: float, steps: int,
    damping: FloatArray,
) -> None:  # fmt: skip
    """Advance every row that is `going`, of a world of VRX's profiles."""
    row = cuda.grid(1)
    if row < time.size and going[row]:
        advance_free_row(runs, row, row, time, done, features, dt, steps, damping[row], None)


def advance_marine(
    runs: Table, time: FloatArray, going: BoolArray, done: IntArray, features: FloatArray, dt: float, steps: int,
    damping: FloatArray, pressures: FloatArray, wet: Table, found: IntArray, cut: FloatArray, polynomial: FloatArray,
    columns: FloatArray,
) -> None:  # fmt: skip
    """Advance every row that is `going`, by `WIDTH` threads; each row has a part of the memory of `vessel_work`.

    `runs` and `damping` are of all rows for the first of their threads, then of all rows for the second, and so on.
    """
    row, lane = divmod(cuda.grid(1), WIDTH)
    if row < time.size and going[row]:
        work = VesselWork(pressures[row], wet[row], found[row], cut[row], polynomial[row], columns[row])
        run = lane * time.size + row
        advance_free_row(runs, run, row, time, done, features, dt, steps, damping[run], work)


def command(
    runs: Table, time: FloatArray, values: FloatArray, thrusters: IntArray, angles: IntArray, hold: float
) -> None:
    """Give every row its commands, a row of `values`."""
    row = cuda.grid(1)
    if row < time.size:
        command_row(runs, row, time[row], values[row], thrusters, angles, hold)


def observe(runs: Table, time: FloatArray, wind: FloatArray, surface: FloatArray) -> None:
    """Write wind, (n, 2), and heights of the sea at boats, (n, boats), of every row."""
    row = cuda.grid(1)
    if row < time.size:
        observe_row(runs, row, time[row], wind[row], surface[row])


def copy_rows(which: BoolArray, sources: IntArray, parts: tuple[Table, ...], wholes: tuple[Table, ...]) -> None:
    """Write a row of each of `parts`, that of its number in `sources`, into the tables of every row of `which`.

    All are words, (rows, words).
    """
    row = cuda.grid(1)
    if row < sources.size and which[row]:
        for table in range(len(parts)):
            for word in range(parts[table].shape[1]):
                wholes[table][row, word] = parts[table][sources[row], word]


def launcher(function: Callable[..., None], threads: int, waves: int, stream: Stream) -> Callable[..., None]:
    """A kernel that is launched on a stream with a number of threads, compiled for rows of a number of waves.

    Compiled code is kept beside the kernels of the CPU, in a folder named after their sources.
    """
    with warnings.catch_warnings():  # a few rows leave most of a processor idle
        warnings.simplefilter("ignore")
        registers = None if waves <= _FEW_WAVES else _MAX_REGISTERS
        kernel = cuda.jit(function) if SIMULATED else _compile(function, registers)
        launch: Callable[..., None] = kernel[(threads + _BLOCK_SIZE - 1) // _BLOCK_SIZE, _BLOCK_SIZE, stream]
    return launch


@cache
def _compile(function: Callable[..., None], registers: int | None) -> Any:
    before = config.CACHE_DIR
    if FOLDER:
        config.CACHE_DIR = str(FOLDER / f"cuda{registers or ''}-{numba_cuda.__version__}")
    try:
        return cuda.jit(function, max_registers=registers, cache=FOLDER is not None)
    finally:
        config.CACHE_DIR = before
