"""The exit of the interpreter while daemon threads are in MuJoCo's code: it waits for them, and they begin no more.

A thread that came back from there during the exit would end the process: Python has it unwound in the midst of C++.
"""

import atexit
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_EXIT_WAIT = 30.0
"""The longest time [s] for which an exit waits for other threads' calls."""
_exiting: list[int] = []
"""The thread in which the interpreter exits; empty before."""
_inside: set[int] = set()
"""Threads that are in a `delays_exit` function."""
BUSY: list[Callable[[int], bool]] = [lambda own: any(one.ident in _inside - {own} for one in threading.enumerate())]
"""Each says whether threads other than this one are in a call for which an exit waits."""


def check_exit() -> None:
    """End the thread that calls, with SystemExit, once the interpreter exits in another one."""
    if _exiting and threading.get_ident() != _exiting[0]:
        raise SystemExit


@contextmanager
def delays_exit() -> Iterator[None]:
    """Make an exit wait for what runs inside; once it has begun, other threads that enter end with SystemExit."""
    own = threading.get_ident()
    is_outer = own not in _inside
    try:
        _inside.add(own)
        check_exit()  # which waits for what is inside
        yield
    finally:
        if is_outer:
            _inside.discard(own)


@atexit.register
def _end_other_threads() -> None:
    """Wait until no other thread is in a call: each ends at its next `check_exit`."""
    own = threading.get_ident()
    _exiting.append(own)
    deadline = time.monotonic() + _EXIT_WAIT
    while any(busy(own) for busy in BUSY) and time.monotonic() < deadline:
        time.sleep(0.001)
