"""Signals that end a process: handled like Ctrl-C, so that recordings are closed and terminals restored first.

What is ignored from the start stays ignored: SIGINT in a background job of a shell script, SIGHUP under nohup.
"""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from types import FrameType

_ENDING = ("SIGTERM", "SIGHUP")


@contextlib.contextmanager
def ended_by_signals() -> Iterator[list[int]]:
    """Let SIGTERM and SIGHUP raise KeyboardInterrupt; yields the numbers of those that have come."""
    came: list[int] = []

    def interrupt(number: int) -> None:
        came.append(number)
        raise KeyboardInterrupt

    with handle_signals(_ENDING, interrupt):
        yield came


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
