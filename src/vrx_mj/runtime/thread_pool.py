"""Threads of our own that share out rows among the cores.

numba's parallel regions kill a child that was forked after one, and its simplest layer aborts under two threads.
Kernels that hold no lock of Python's need neither: plain threads call them. After a fork the child starts its own.
"""

import os
import queue
import threading
import weakref
from collections import deque
from collections.abc import Callable

__all__ = ["ThreadPool"]

PIECES = 4
"""Pieces for each thread: rows do not all take the same time, and whoever is done takes the next."""
SMALLEST = 8
"""Rows of a piece, at least: to begin one takes some 50 microseconds."""

Work = Callable[[int, int], None]


class ThreadPool:
    """`threads` threads, the caller's own among them."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._engage()

    def share(self, rows: int, work: Work) -> None:
        """Call `work(first, last)` for pieces that make up all rows, and wait until all are done, Ctrl-C or not."""
        if self._process != os.getpid():
            self._engage()  # threads do not live on in a forked process
        size = max(SMALLEST, -(-rows // (PIECES * self.threads)))
        pieces = deque((first, min(first + size, rows)) for first in range(0, rows, size))
        helpers = min(self.threads, len(pieces)) - 1
        for _ in range(helpers):
            self._calls.put((pieces, work))
        try:
            _work_off(pieces, work)
        finally:
            _work_off(pieces, work)  # of an interrupted call
            failures = [failure for failure in (self._ends.get() for _ in range(helpers)) if failure is not None]
        if failures:
            raise failures[0]

    def _engage(self) -> None:
        """Start the helpers; they go when the crew does."""
        self._process = os.getpid()
        self._calls: queue.SimpleQueue[tuple[deque[tuple[int, int]], Work] | None] = queue.SimpleQueue()
        self._ends: queue.SimpleQueue[BaseException | None] = queue.SimpleQueue()
        for number in range(1, self.threads):
            name = f"vrx_mj rows {number}"
            threading.Thread(target=_help, args=(self._calls, self._ends), name=name, daemon=True).start()
        weakref.finalize(self, _dismiss, self._calls, self.threads - 1, self._process)


def _work_off(pieces: "deque[tuple[int, int]]", work: Work) -> None:
    while True:
        try:
            first, last = pieces.popleft()
        except IndexError:
            return
        work(first, last)


def _help(
    calls: "queue.SimpleQueue[tuple[deque[tuple[int, int]], Work] | None]",
    ends: "queue.SimpleQueue[BaseException | None]",
) -> None:
    while (call := calls.get()) is not None:
        failure = None
        try:
            _work_off(*call)
        except BaseException as error:
            failure = error
        del call  # whoever made the call may go
        ends.put(failure)


def _dismiss(calls: "queue.SimpleQueue[tuple[deque[tuple[int, int]], Work] | None]", count: int, process: int) -> None:
    if process == os.getpid():
        for _ in range(count):
            calls.put(None)
