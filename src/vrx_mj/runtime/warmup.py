"""The first use on a machine compiles the kernels: reported on stderr, with progress."""

import contextlib
from collections.abc import Iterator
from typing import Any

from numba.core import event

from vrx_mj.bar import Bar
from vrx_mj.physics.kernel import is_cached

_ONCE = "for this machine, once"
"""When kernels are compiled that a cache folder keeps, in messages."""
_EVERY_TIME = "for this process only, since no cache folder can be used: set VRX_MJ_CACHE to one of your own"
"""When kernels are compiled that no cache folder keeps, in messages."""
_KERNEL_COUNT = 135
"""About how many kernels the loop consists of: for the progress bar only."""


@contextlib.contextmanager
def compile_notice(first_call: Any, what: str = "the physics", seconds: int = 20) -> Iterator[None]:
    """Context of the first call of a kernel: if it has to be compiled, report it, and show progress.

    `what` is compiled, which takes about so many `seconds`.
    """
    if is_cached(first_call):
        yield
        return
    kept = first_call.stats.cache_path is not None
    with Bar("compiling", _KERNEL_COUNT, "kernels") as bar:
        counter = _Counter(
            bar, f"vrx_mj: compiling {what} {_ONCE if kept else _EVERY_TIME}; it takes about {seconds} s"
        )
        event.register("numba:compile", counter)
        try:
            yield
        finally:
            event.unregister("numba:compile", counter)
            if counter.done:
                bar.print(f"vrx_mj: compiled {counter.done} kernels")


class _Counter(event.Listener):  # type: ignore[misc]
    """Counts kernels as numba finishes them; announces the first, as a call may need none of them."""

    def __init__(self, bar: Bar, announcement: str) -> None:
        self.done = 0
        self._bar, self._announcement = bar, announcement

    def on_start(self, event: object) -> None:
        """A kernel begins: it counts once it is done."""
        if self._announcement:
            self._bar.print(self._announcement)
            self._announcement = ""

    def on_end(self, event: object) -> None:
        """A kernel is done."""
        self.done += 1
        self._bar.update(self.done)
