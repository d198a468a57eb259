"""Signals that end a process: handled like Ctrl-C, so that recordings are closed and terminals restored first.

What is ignored from the start stays ignored: SIGINT in a background job of a shell script, SIGHUP under nohup.
"""

import contextlib
import signal
import threading
from collections.abc import Iterator
from typing import Any

__all__ = ["ended_by_signals"]

ENDING = ("SIGTERM", "SIGHUP")


@contextlib.contextmanager
def ended_by_signals() -> Iterator[list[int]]:
    """Let SIGTERM and SIGHUP raise KeyboardInterrupt; yields the numbers of those that have come."""
    came: list[int] = []

    def interrupt(number: int, _frame: Any) -> None:
        came.append(number)
        raise KeyboardInterrupt

    numbers = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        numbers = []
    before = {number: signal.getsignal(number) for number in numbers}
    heeded = [number for number, handler in before.items() if handler != signal.SIG_IGN]
    for number in heeded:
        signal.signal(number, interrupt)
    try:
        yield came
    finally:
        for number in heeded:
            signal.signal(number, before[number])
