"""What rows of a batch cost: `vrx-mj bench` on `vrx_mj.Batch`.

Every row is one boat with fixed engines and nobody reading its sensors, in the sea and wind of the other measurements.
"""

import importlib.util
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np

from vrx_mj.cli.bench_worlds import SEA, fleet, resident_memory
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.batch import Batch

__all__ = [
    "boat_steps_per_second",
    "environment_steps_per_second",
    "megabytes_per_row",
    "serve",
    "two_threads_and_two_processes",
    "weigh",
]

ROWS = 512
STEPS = 10
"""Physics steps of a call: one decision at 10 Hz."""
WINDOW = 0.5
"""How long one side is timed [s]."""
ROUNDS = 7
THROTTLE = 0.1
WORKER = "from vrx_mj.cli.bench_batch import serve; serve()"
WEIGHING = "from vrx_mj.cli.bench_batch import weigh; weigh()"


def batch_of(rows: int, threads: int | None = None) -> Batch:
    """Rows under way, warmed up; `threads` as `Batch` takes it."""
    batch = Batch(compile_world(SEA, fleet=fleet(1)), rows, threads=threads)
    batch.step([[THROTTLE] * len(batch.channels)] * rows, duration=2.0)
    return batch


def boat_steps_per_second(rounds: int = ROUNDS, window: float = WINDOW) -> float:
    """Physics steps of boats per second, all cores together: the median of `rounds` windows [s]."""
    batch = batch_of(ROWS)
    return statistics.median(rate(batch, window) for _ in range(rounds))


def two_threads_and_two_processes(rounds: int = ROUNDS, window: float = WINDOW) -> tuple[float, float]:
    """Boat steps per second of a batch with two threads, and those of two processes at once with half the rows each.

    They alternate, so that what else the machine does hits both; medians of `rounds` windows [s] each.
    """
    ours, theirs = [], []
    batch = batch_of(ROWS, threads=2)
    with ExitStack() as stack:
        workers = [stack.enter_context(_worker(ROWS // 2)) for _ in range(2)]
        for _ in range(rounds):
            ours.append(rate(batch, window))
            for worker in workers:
                _send(worker, str(window))
            theirs.append(sum(float(_hear(worker)) for worker in workers))
    return statistics.median(ours), statistics.median(theirs)


def rate(batch: Batch, window: float) -> float:
    """Boat steps per second in a window [s]."""
    calls, begun = 0, time.perf_counter()
    while time.perf_counter() - begun < window:
        batch.advance(STEPS)
        calls += 1
    return calls * STEPS * batch.n * len(batch.boats) / (time.perf_counter() - begun)


def environment_steps_per_second(rounds: int = ROUNDS, window: float = WINDOW) -> float:
    """Decisions per second of Gymnasium's `VectorEnv`, each of 10 physics steps; the median of `rounds` windows [s].

    Not a number where the extra `rl` is not installed.
    """
    if importlib.util.find_spec("gymnasium") is None:
        return math.nan
    from vrx_mj.rl import VectorEnv

    rows = VectorEnv("StationKeeping", ROWS)
    rows.reset(seed=0)
    actions = np.full_like(rows.action_space.sample(), THROTTLE)
    return statistics.median(decisions(rows, actions, window) for _ in range(rounds))


def decisions(rows: Any, actions: Any, window: float) -> float:
    """Decisions per second of a `VectorEnv` in a window [s]."""
    calls, begun = 0, time.perf_counter()
    while time.perf_counter() - begun < window:
        rows.step(actions)
        calls += 1
    return calls * int(rows.num_envs) / (time.perf_counter() - begun)


def serve() -> None:
    """In a process of its own: rows on one thread; for every window [s] that is read, their rate is written."""
    batch = batch_of(int(sys.argv[1]), threads=1)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    for line in sys.stdin:
        sys.stdout.write(f"{rate(batch, float(line))}\n")
        sys.stdout.flush()


@contextmanager
def _worker(rows: int) -> Iterator["subprocess.Popen[str]"]:
    """A process that serves; it ends when its input does."""
    command = [sys.executable, "-c", WORKER, str(rows)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="ascii") as worker:
        _hear(worker)
        yield worker


def _send(worker: "subprocess.Popen[str]", line: str) -> None:
    assert worker.stdin is not None
    worker.stdin.write(f"{line}\n")
    worker.stdin.flush()


def _hear(worker: "subprocess.Popen[str]") -> str:
    assert worker.stdout is not None
    return worker.stdout.readline()


def megabytes_per_row(rows: int = 1000) -> float:
    """Memory that each of so many rows takes [MB], in a fresh process; not known but on Linux."""
    done = subprocess.run([sys.executable, "-c", WEIGHING, str(rows)], capture_output=True, check=True)
    return float(done.stdout)


def weigh() -> None:
    """In a process of its own: what so many rows more take [MB], after a few have brought in all the code."""
    few, rows = batch_of(8), int(sys.argv[1])
    before = resident_memory()
    many = batch_of(rows)
    more = resident_memory() - before
    assert (few.n, many.n) == (8, rows)  # both are alive
    sys.stdout.write(f"{more / 1e6 / rows}\n")
