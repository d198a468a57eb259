"""Keys pressed in a terminal, without waiting for Enter, and the status in its last lines."""

from __future__ import annotations

import os
import select
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, Self, TextIO

from vrx_mj.drive.helm.keys import terminal_keys

__all__ = ["Driven", "Terminal", "status_lines"]

STATUS_PERIOD = 0.2
"""Wall time between two renewals of the status [s]."""
END_LINE, END_SCREEN = "\x1b[K", "\x1b[J"
"""Erase to the end of the line, and of the screen (ECMA-48)."""


class Driven(Protocol):
    """What is driven by the keys."""

    def status(self) -> Sequence[tuple[str, str]]:
        """What is to be shown of it: names and values."""


class Terminal:
    """The terminal of this process, in a `with` statement; where there is none, no key ever comes.

    Ctrl-C works as ever: only echo and the wait for whole lines are switched off.
    """

    def __init__(
        self, stdin: TextIO | None = None, stderr: TextIO | None = None, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._stdin = sys.stdin if stdin is None else stdin
        self._stderr = sys.stderr if stderr is None else stderr
        self._clock, self._due, self._lines = clock, 0.0, 0
        self._before: Any = None

    @property
    def reads(self) -> bool:
        """Whether keys come from here."""
        return self._before is not None

    def pressed(self) -> Iterator[str]:
        """The names of the keys pressed since the last call."""
        if not self.reads:
            return iter(())
        descriptor, sent = self._stdin.fileno(), b""
        while select.select([descriptor], [], [], 0.0)[0]:
            part = os.read(descriptor, 1024)
            if not part:  # the terminal is gone
                self._restore()
                break
            sent += part
        return terminal_keys(sent.decode("utf-8", "replace"))

    def show(self, driven: Driven) -> None:
        """Renew the status, where somebody sees it: the cursor stays on its first line."""
        now = self._clock()
        if now < self._due or not self._stderr.isatty():
            return
        lines = status_lines(driven.status(), _columns(self._stderr))
        self._due, self._lines = now + STATUS_PERIOD, len(lines)
        back = f"\x1b[{len(lines) - 1}A" if len(lines) > 1 else ""
        text = f"{END_LINE}\n".join(lines)
        self._stderr.write(f"\r{text}{END_SCREEN}{back}")
        self._stderr.flush()

    def say(self, text: str) -> None:
        """Write a line above that of the status."""
        before = f"\r{END_SCREEN}" if self._lines and self._stderr.isatty() else ""
        self._stderr.write(f"{before}{text}\n")
        self._stderr.flush()
        self._due = 0.0

    def __enter__(self) -> Self:
        if _foreground(self._stdin):
            import termios
            import tty

            self._before = termios.tcgetattr(self._stdin)
            tty.setcbreak(self._stdin, termios.TCSANOW)
        return self

    def __exit__(self, *_error: object) -> None:
        self._restore()
        self._stderr.write("\n" * self._lines)

    def _restore(self) -> None:
        if self._before is not None:
            import termios

            termios.tcsetattr(self._stdin, termios.TCSADRAIN, self._before)
            self._before = None


def status_lines(status: Sequence[tuple[str, str]], width: int) -> list[str]:
    """The status in lines that fit a terminal's width [columns]; every name stays with its value."""
    lines: list[str] = []
    for name, value in status:
        item = f"{name} {value}"[: max(0, width - 1)]
        if lines and len(lines[-1]) + 2 + len(item) < width:
            lines[-1] += f"  {item}"
        else:
            lines.append(item)
    return lines


def _columns(stream: TextIO) -> int:
    """Width of the terminal that a stream writes to."""
    try:
        return os.get_terminal_size(stream.fileno()).columns or shutil.get_terminal_size().columns
    except (OSError, ValueError):
        return shutil.get_terminal_size().columns


def _foreground(stream: TextIO | None) -> bool:
    """Whether `stream` is a terminal whose keys this process may read: a job in the background would be stopped."""
    try:
        if stream is None or not stream.isatty() or not hasattr(os, "tcgetpgrp"):
            return False
        return os.tcgetpgrp(stream.fileno()) == os.getpgrp()
    except (OSError, ValueError):  # closed, or no file at all
        return False
