"""Signals that end a process, and the exit of the interpreter while threads are in MuJoCo.

Signals are handled like Ctrl-C, so that recordings are closed and terminals restored first. A signal that was ignored
from the start stays ignored: SIGINT in a background job of a shell script, SIGHUP under nohup.

At its exit the interpreter waits for daemon threads in MuJoCo's code, and they begin no more. A thread that came back
from there during the exit would end the process, because Python unwinds it in the midst of C++.
"""

import atexit
import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

_ENDING = ("SIGINT", "SIGTERM", "SIGHUP")
_came: list[list[int]] = []
"""Signals that have come, for each `ended_by_signals` that goes on."""
_EXIT_WAIT = 30.0
"""The longest time [s] for which an exit waits for other threads' calls."""


@contextlib.contextmanager
def ended_by_signals() -> Iterator[list[int]]:
    """Raise KeyboardInterrupt at SIGINT, SIGTERM and SIGHUP; yields the numbers of those that have come."""
    came: list[int] = []

    def interrupt(number: int) -> None:
        came.append(number)
        raise KeyboardInterrupt

    _came.append(came)
    try:
        with handle_signals(_ENDING, interrupt):
            yield came
    finally:
        _came.pop()


def check_interrupts() -> None:
    """Raise KeyboardInterrupt if a signal has come and did not end the work, as packages that load may catch it."""
    if any(_came):
        raise KeyboardInterrupt


@contextlib.contextmanager
def handle_signals(names: Sequence[str], handle: Callable[[int], None]) -> Iterator[None]:
    """Call `handle(number)` for signals of these names, if this is the main thread.

    Signals that are ignored, that this system lacks, or whose handler Python does not know are left alone.
    """

    def call(number: int, _frame: FrameType | None) -> None:
        handle(number)

    main = threading.current_thread() is threading.main_thread()
    numbers = [getattr(signal, name) for name in names if main and hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers}
    heeded = [number for number, handler in before.items() if handler not in {signal.SIG_IGN, None}]
    for number in heeded:
        signal.signal(number, call)
    try:
        yield
    finally:
        for number in heeded:
            signal.signal(number, before[number])


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
