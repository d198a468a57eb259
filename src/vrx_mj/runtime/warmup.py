"""The first use on a machine compiles the kernels: said on stderr, with progress."""

import contextlib
import sys
from collections.abc import Iterator
from typing import Any

from numba.core import event

from vrx_mj.physics.kernel import cached

ONCE = "for this machine, once"
EVERY_TIME = "for this process only, since no cache folder is writable: set VRX_MJ_CACHE to one"
KERNELS = 130
"""About how many kernels the loop is made of: for the progress only."""


@contextlib.contextmanager
def announced(first_call: Any, what: str = "the physics", seconds: int = 30) -> Iterator[None]:
    """Around the first call of a kernel: if it is not in the cache, tell that and how compiling goes on.

    `what` is compiled, which takes about so many `seconds`.
    """
    if cached(first_call):
        yield
        return
    counter = _Counter()
    kept = first_call.stats.cache_path is not None
    sys.stderr.write(f"vrx_mj: compiling {what} {ONCE if kept else EVERY_TIME}; it takes about {seconds} s\n")
    sys.stderr.flush()
    event.register("numba:compile", counter)
    try:
        yield
    finally:
        event.unregister("numba:compile", counter)
        counter.end()


class _Counter(event.Listener):  # type: ignore[misc]
    """Counts kernels as numba finishes them; draws a line only where somebody watches."""

    def __init__(self) -> None:
        self.done = 0
        self.watched = sys.stderr.isatty()

    def on_start(self, event: Any) -> None:
        """A kernel begins; nothing to tell yet."""

    def on_end(self, event: Any) -> None:
        """A kernel is done."""
        self.done += 1
        if self.watched:
            share = min(1.0, self.done / KERNELS)
            sys.stderr.write(f"\r  [{'#' * round(30 * share):<30}] {self.done} kernels")
            sys.stderr.flush()

    def end(self) -> None:
        """All are done."""
        sys.stderr.write(f"{chr(13) if self.watched else ''}vrx_mj: compiled {self.done} kernels{' ' * 30}\n")
        sys.stderr.flush()
