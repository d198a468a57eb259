"""Keys pressed in a terminal, without waiting for Enter, and the status in its last lines."""

from __future__ import annotations

import errno
import os
import re
import select
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Self, TextIO

from vrx_mj.drive.pilot import Driver
from vrx_mj.runtime.timing import Pause
from vrx_mj.unix import termios, tty

_STATUS_PERIOD = 0.2
"""Wall time between two renewals of the status [s]."""
_END_LINE, _END_SCREEN = "\x1b[K", "\x1b[J"
"""Erase to the end of the line, and of the screen (ECMA-48)."""


class Terminal:
    """The terminal of this process, in a `with` statement; without a terminal, no key ever comes.

    Ctrl-C works as ever: only echo and the wait for whole lines are switched off.
    """

    def __init__(
        self, stdin: TextIO | None = None, stderr: TextIO | None = None, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._stdin = sys.stdin if stdin is None else stdin
        self._stderr = sys.stderr if stderr is None else stderr
        self._clock, self._pause, self._lines = clock, Pause(), 0
        self._before: Any = None

    @property
    def reads(self) -> bool:
        """Whether keys come from here."""
        return self._before is not None

    def pressed_keys(self) -> Iterator[str]:
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

    def show(self, driver: Driver) -> None:
        """Renew the status, where somebody sees it: the cursor stays on its first line."""
        now = self._clock()
        if not self._pause.is_over(now) or not self._stderr.isatty():
            return
        lines = status_lines(driver.status(), _columns(self._stderr))
        self._lines = len(lines)
        self._pause.begin(now, _STATUS_PERIOD)
        back = f"\x1b[{len(lines) - 1}A" if len(lines) > 1 else ""
        text = f"{_END_LINE}\n".join(lines)
        self._stderr.write(f"\r{text}{_END_SCREEN}{back}")
        self._stderr.flush()

    def write_line(self, text: str) -> None:
        """Write a line above that of the status."""
        before = f"\r{_END_SCREEN}" if self._lines and self._stderr.isatty() else ""
        self._stderr.write(f"{before}{text}\n")
        self._stderr.flush()
        self._pause.end()

    def __enter__(self) -> Self:
        if _foreground(self._stdin):
            self._before = termios.tcgetattr(self._stdin)
            tty.setcbreak(self._stdin, termios.TCSANOW)
        return self

    def __exit__(self, *_error: object) -> None:
        self._restore()
        self._stderr.write("\n" * self._lines)

    def _restore(self) -> None:
        if self._before is not None:
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
    """Whether `stream` is a terminal whose keys this process may read: a job in the background would be stopped.

    roslaunch starts its nodes in sessions of their own, with its terminal: none of them is stopped.
    """
    try:
        if stream is None or not stream.isatty() or not hasattr(os, "tcgetpgrp"):
            return False
        return os.tcgetpgrp(stream.fileno()) == os.getpgrp()
    except ValueError:  # closed, or no file at all
        return False
    except OSError as error:
        return error.errno == errno.ENOTTY  # the terminal of another session


HELP = (
    ("drive", "arrow keys: more or less power, turn left or right; space or k: stop"),
    ("as in VRX", "i j l , u o m .  power and turn at once; h ;  engine angle"),
    ("steps", "q z  power and turn, w x  power, e c  turn, r v  angle: 10 % more, 10 % less"),
    ("boat", "1 ... 9: that boat, n (in a terminal also Tab): the next boat"),
    ("time", "p: pause, + -: twice or half the pace, backspace: reset"),
)
"""Help about the keys."""

OURS = frozenset("ijl,uom.kh;qzwxecrvnp+=-0123456789") | {"up", "down", "left", "right", "space", "backspace", "tab"}
"""Keys that do something here."""

_WINDOW = {
    32: "space", 258: "tab", 259: "backspace", 262: "right", 263: "left", 264: "down", 265: "up", 333: "-", 334: "+",
}  # fmt: skip
"""GLFW's numbers of keys that give no character; the others are numbered by ASCII, letters by capitals."""
_DIGIT_PAD = 320
"""GLFW's number of the zero of the number pad."""

_TERMINAL = {
    "\x1b[A": "up", "\x1b[B": "down", "\x1b[C": "right", "\x1b[D": "left",
    "\x1bOA": "up", "\x1bOB": "down", "\x1bOC": "right", "\x1bOD": "left",
    " ": "space", "\t": "tab", "\x7f": "backspace", "\b": "backspace",
}  # fmt: skip
"""Names of keys by the characters that terminals send (ECMA-48, and VT100's application mode)."""
_SENT = re.compile(r"\x1b\[[0-?]*[ -/]*[@-~]|\x1bO.|.", re.DOTALL)


def window_key(code: int) -> str | None:
    """The name of a key of MuJoCo's window by GLFW's number; None for keys without one."""
    if code in _WINDOW:
        return _WINDOW[code]
    if _DIGIT_PAD <= code < _DIGIT_PAD + 10:
        return str(code - _DIGIT_PAD)
    return chr(code).lower() if ord("!") <= code <= ord("~") else None


def terminal_keys(sent: str) -> Iterator[str]:
    """The names of the keys in what a terminal sent; sequences without a name are left out."""
    for match in _SENT.finditer(sent):
        key = match.group()
        name = _TERMINAL.get(key, key.lower())
        if name in OURS:
            yield name
