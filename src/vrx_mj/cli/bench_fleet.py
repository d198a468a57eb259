"""Cost of fleets: `vrx-mj bench --fleet-table`, each fleet in a fresh process, on one core.

Beside it are the figures that a published guide to fleets in VRX gives for Gazebo and ROS.
"""

import math
import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

from typer import echo

from vrx_mj.cli.bench import DT, SEA, fleet, fresh_process, sailing
from vrx_mj.cli.screen import print_table
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.limits import process_memory

FLEETS = (1, 2, 3, 10, 100, 1000, 3000)
IN_ONE_WORLD = 100
"""Boats that one world holds here; larger fleets are several such worlds, advanced by one thread."""
MISSING = (
    f"* More than {IN_ONE_WORLD} boats are worlds of {IN_ONE_WORLD}, rows of one vrx_mj.Batch on one thread: boats of "
    "two worlds never meet. One world of 1000 boats without sensors takes some seconds to compile and load."
)
_GUIDE = {1: (0.35, 1200.0), 2: (0.55, 1800.0), 3: (0.75, 2400.0)}
"""Share of the CPU and memory [MB] of the old stack, by boats, as the guide has them."""
_PACED = 6.0
"""How long a fleet sails at the pace of real time [s]."""
_FREE = 3.0
"""How long it sails as fast as it can [s]."""
_CALL = 0.1
"""Simulated time of a call [s]: decisions at 10 Hz."""

_Row = dict[str, Any]
_Advance = Callable[[int], None]


def fleet_table(fleets: Sequence[int] = FLEETS, *, paced: float = _PACED, free: float = _FREE) -> list[_Row]:
    """A row for each number of boats: `fleet_row`'s, with the guide's figures where it has some."""
    rows = []
    for boats in fleets:
        with fresh_process() as process:
            row = process.submit(fleet_row, boats, paced=paced, free=free).result()
        cpu, memory = _GUIDE.get(boats, (None, None))
        rows.append(row | {"guide_cpu_share": cpu, "guide_memory_mb": memory})
    return rows


def in_worlds_of(boats: int) -> tuple[int, int]:
    """Number of worlds that hold a fleet, and the boats of each."""
    return (1, boats) if boats <= IN_ONE_WORLD else (-(-boats // IN_ONE_WORLD), IN_ONE_WORLD)


def fleet_row(boats: int, *, paced: float = _PACED, free: float = _FREE) -> _Row:
    """Cost of a fleet: processor time at the pace of real time, memory, and how much faster it could go.

    Args:
        boats: how many; beyond 100 a multiple of 100.
        paced: how long it is held to real time [s].
        free: how long it is not [s].
    """
    begun = time.perf_counter()
    worlds, each = in_worlds_of(boats)
    advance = _fleet_advance(worlds, each)
    loaded = time.perf_counter() - begun
    pace, memory = real_time_factor(advance, free), process_memory() / 1e6
    return {
        "boats": worlds * each,
        "worlds": worlds,
        "load_s": loaded,
        "cpu_share": processor_share(advance, paced),
        "memory_mb": None if math.isnan(memory) else memory,
        "real_time_factor": pace,
    }


def _fleet_advance(worlds: int, each: int) -> _Advance:
    """The call that advances worlds of `each` boats under way, by physics steps, on one thread."""
    if worlds == 1:
        return sailing(each).advance
    batch = Batch(compile_world(SEA, fleet=fleet(each)), worlds, threads=1)
    batch.step([[0.1] * len(batch.channels)] * worlds, duration=2.0)
    return batch.advance


def real_time_factor(advance: _Advance, seconds: float) -> float:
    """Simulated time over the processor time of it: of the median call in so many seconds."""
    call, begun = round(_CALL / DT), time.perf_counter()
    spent: list[float] = []
    while not sum(spent) or time.perf_counter() - begun < seconds:
        before = time.process_time()
        advance(call)
        spent.append(time.process_time() - before)
    return _CALL / (statistics.median(spent) or statistics.mean(spent))  # under `ulimit -t` the clock steps by 4 ms


def processor_share(advance: _Advance, seconds: float) -> float:
    """Processor time over the time that passes while calls are held to real time; beyond 1 none is held any more."""
    call, begun, spent = round(_CALL / DT), time.perf_counter(), time.process_time()
    calls = round(seconds / _CALL)
    for number in range(calls):
        advance(call)
        time.sleep(max(0.0, begun + (number + 1) * _CALL - time.perf_counter()))
    return (time.process_time() - spent) / (calls * _CALL)


def print_fleet_table(rows: Sequence[_Row]) -> None:
    """The rows as a table, and what is missing where a fleet is several worlds."""
    heads = ("boats", "CPU", "memory", "real time", "guide: CPU", "guide: memory")
    texts = [
        (f"{row['boats']:,}" + ("*" if row["worlds"] > 1 else ""), _share(row["cpu_share"]),
         _megabytes(row["memory_mb"]), f"{row['real_time_factor']:.3g} x", _share(row["guide_cpu_share"]),
         _megabytes(row["guide_memory_mb"]))
        for row in rows
    ]  # fmt: skip
    print_table("vrx-mj bench --fleet-table: one core, steps of 10 ms, sea and wind", (), heads, texts)
    for line in remarks(rows):
        echo(line)


def remarks(rows: Sequence[_Row]) -> list[str]:
    """Remarks on the figures: which fleets are several worlds, and which are too many for one core, and why."""
    slow = [row for row in rows if row["real_time_factor"] < 1.0]
    return [MISSING] * any(row["worlds"] > 1 for row in rows) + [
        f"{row['boats']:,} boats are too many for this core: a step of one takes "
        f"{1e6 * DT / row['boats'] / row['real_time_factor']:.2f} microseconds here, and may take "
        f"{1e6 * DT / row['boats']:.2f}."
        for row in slow
    ]


def _share(share: float | None) -> str:
    return "" if share is None else f"{100.0 * share:.1f} %"


def _megabytes(memory: float | None) -> str:
    return "" if memory is None else f"{memory:,.0f} MB"
