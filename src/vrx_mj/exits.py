"""The exit of the interpreter while daemon threads are in MuJoCo's code: it waits for them, and they begin no more.

A thread that came back from there during the exit would end the process: Python has it unwound in the midst of C++.
"""

import atexit
import functools
import os
import threading
import time
from collections.abc import Callable
from typing import ParamSpec, TypeVar

__all__ = ["awaited", "check_exit", "wait_at_exit"]

P = ParamSpec("P")
R = TypeVar("R")

EXIT_WAIT = 30.0
"""The longest time [s] for which an exit waits for other threads' calls."""
_exiting: list[int] = []
"""The thread in which the interpreter exits; empty before."""
_inside: set[int] = set()
"""Threads that are in an `awaited` function."""
_busy: list[Callable[[int], bool]] = [lambda own: bool(_inside - {own})]


def check_exit() -> None:
    """End the thread that calls, with SystemExit, once the interpreter exits in another one."""
    if _exiting and threading.get_ident() != _exiting[0]:
        raise SystemExit


def wait_at_exit(busy: Callable[[int], bool]) -> None:
    """Have an exit wait while `busy(own)` says that threads other than `own`, the one that exits, are in a call."""
    _busy.append(busy)


def awaited(function: Callable[P, R]) -> Callable[P, R]:
    """A function that an exit waits for, and in which other threads end, with SystemExit, once it has begun."""

    @functools.wraps(function)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        own = threading.get_ident()
        is_outer = own not in _inside
        try:
            _inside.add(own)
            check_exit()  # which waits for what is inside
            return function(*args, **kwargs)
        finally:
            if is_outer:
                _inside.discard(own)

    return guarded


@atexit.register
def _end_other_threads() -> None:
    """Wait until no other thread is in a call: each ends at its next `check_exit`."""
    own = threading.get_ident()
    _exiting.append(own)
    deadline = time.monotonic() + EXIT_WAIT
    while any(busy(own) for busy in _busy) and time.monotonic() < deadline:
        time.sleep(0.001)


def _forget_others() -> None:
    """In a forked process other threads are not there."""
    _inside.intersection_update({threading.get_ident()})


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_others)
