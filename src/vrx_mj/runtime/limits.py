"""What this process may use of its machine: the system's figures, and the container's limits where there are any."""

import os
import platform
import queue
import threading
import weakref
from collections import deque
from collections.abc import Callable
from pathlib import Path

import psutil

_CGROUP_ROOT = Path("/")
"""Folder of `sys/fs/cgroup`; Linux has it."""
_PIECES_PER_THREAD = 4
"""Number of pieces per thread: rows take different times, and a thread that is done takes the next piece."""
_MIN_PIECE_ROWS, _MIN_PIECE_TIME = 8, 1e-3
"""Least number of rows of a piece, or least time [s]: each piece costs some 50 microseconds."""
_MAX_TURNS = 8
"""Largest number of turns in which few rows are taken: three rows use two threads so."""


def process_memory() -> float:
    """Resident memory of this process [bytes]."""
    return float(psutil.Process().memory_info().rss)


def processor() -> str:
    """The processor's name."""
    try:
        with Path("/proc/cpuinfo").open(encoding="utf-8") as file:
            names = (line.partition(":")[2].strip() for line in file if line.startswith("model name"))
            return next(names, "") or platform.processor()
    except OSError:
        return platform.processor()


def free_memory(root: Path = _CGROUP_ROOT) -> float:
    """Memory [bytes] that is free for this process."""
    group = root / "sys/fs/cgroup"
    known = [float(psutil.virtual_memory().available)]
    for limit, used in (
        (group / "memory.max", group / "memory.current"),
        (group / "memory/memory.limit_in_bytes", group / "memory/memory.usage_in_bytes"),
    ):
        most, now = _first(limit), _first(used)
        known += [most - now] if most is not None and now is not None else []
    return min(known)


def total_memory(root: Path = _CGROUP_ROOT) -> float:
    """Memory [bytes] that this process may take at most, free or not."""
    group = root / "sys/fs/cgroup"
    known = (_first(group / name) for name in ("memory.max", "memory/memory.limit_in_bytes"))
    return min([float(psutil.virtual_memory().total), *(most for most in known if most is not None)])


def core_share(root: Path = _CGROUP_ROOT) -> tuple[int, float]:
    """Cores that this process may run on, and how many of them the container lets it use at a time."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    group = root / "sys/fs/cgroup"
    quota, period = _first(group / "cpu.max"), _first(group / "cpu.max", 1)
    if quota is None:
        quota, period = _first(group / "cpu/cpu.cfs_quota_us"), _first(group / "cpu/cpu.cfs_period_us")
    if quota is None or not period or quota <= 0:
        return count, float(count)
    return count, min(float(count), quota / period)


def thread_count() -> int:
    """How many threads to compute with: OMP_NUM_THREADS, or SLURM_CPUS_PER_TASK, or else the share of cores.

    Never more than the share; the first number of a list such as `4,2` counts; other text is ignored.
    """
    share = max(1, int(core_share()[1]))
    for name in ("OMP_NUM_THREADS", "SLURM_CPUS_PER_TASK"):
        first = os.environ.get(name, "").partition(",")[0].strip()
        if first.isdecimal() and int(first) > 0:
            return min(share, int(first))
    return share


def _first(file: Path, index: int = 0) -> float | None:
    """A number of a file of blank-separated ones; None without one, as for "max"."""
    try:
        return float(file.read_text(encoding="ascii").split()[index])
    except (OSError, ValueError, IndexError):
        return None


_Work = Callable[[int, int], None]
_Piece = tuple[int, int, int]
"""First row, the one after the last, and how many turns are left."""
_Calls = queue.SimpleQueue[tuple[deque[_Piece], _Work] | None]
"""Pieces and their work, for any thread of the pool; None ends a thread."""


class ThreadPool:
    """`threads` threads, the caller's own among them."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._start_threads()

    def turns(self, rows: int, seconds: float) -> int:
        """Turns that rows take best, each of `seconds` of work: several where there are few of them for the threads."""
        few = self.threads > 1 and rows < _PIECES_PER_THREAD * self.threads
        return min(max(int(seconds / _MIN_PIECE_TIME), 1), _MAX_TURNS) if few else 1

    def share(self, rows: int, work: _Work, seconds: float = 0.0, turns: int = 1) -> None:
        """Call `work(first, last)` for pieces that make up all rows, and wait until all are done, Ctrl-C or not.

        Every piece has `turns` calls, one after the other, on any thread; in each a row takes about `seconds`.
        """
        if self._process != os.getpid():
            self._start_threads()  # threads do not live on in a forked process
        smallest = min(_MIN_PIECE_ROWS, int(_MIN_PIECE_TIME / seconds) + 1) if seconds else _MIN_PIECE_ROWS
        size = max(smallest, -(-rows // (_PIECES_PER_THREAD * self.threads)))
        pieces = deque((first, min(first + size, rows), turns) for first in range(0, rows, size))
        helpers = min(self.threads, len(pieces)) - 1
        for _ in range(helpers):
            self._calls.put((pieces, work))
        try:
            _run_pieces(pieces, work)
        finally:
            _run_pieces(pieces, work)  # of an interrupted call
            failures = [failure for failure in (self._ends.get() for _ in range(helpers)) if failure is not None]
        if failures:
            raise failures[0]

    def _start_threads(self) -> None:
        """Start the helpers; they end with the pool."""
        self._process = os.getpid()
        self._calls: _Calls = queue.SimpleQueue()
        self._ends: queue.SimpleQueue[BaseException | None] = queue.SimpleQueue()
        for number in range(1, self.threads):
            name = f"vrx_mj rows {number}"
            threading.Thread(target=_run_calls, args=(self._calls, self._ends), name=name, daemon=True).start()
        end = weakref.finalize(self, _end_threads, self._calls, self.threads - 1, self._process)
        end.atexit = False  # a function at exit may still advance


def _run_pieces(pieces: "deque[_Piece]", work: _Work) -> None:
    while True:
        try:
            first, last, turns = pieces.popleft()
        except IndexError:
            return
        try:
            work(first, last)
        finally:
            if turns > 1:
                pieces.append((first, last, turns - 1))


def _run_calls(
    calls: _Calls,
    ends: "queue.SimpleQueue[BaseException | None]",
) -> None:
    while (call := calls.get()) is not None:
        failure = None
        try:
            _run_pieces(*call)
        except BaseException as error:
            failure = error
        del call  # its caller may go
        ends.put(failure)


def _end_threads(calls: _Calls, count: int, process: int) -> None:
    if process == os.getpid():
        for _ in range(count):
            calls.put(None)
