"""The status in the last lines of a terminal: whole at 80 columns, and the words above it stay."""

import os
import re
import struct
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from vrx_mj.drive.pilot import Terminal, status_lines, window_key

needs_terminal = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
STATUS = (  # as `vrx-mj teleop` has it: 117 columns in one line
    ("boat", "wamv1"),
    ("power", "+0.50"),
    ("turn", "+0.00"),
    ("angle", "+0 deg"),
    ("speed", "1.23 m/s"),
    ("heading", "-123 deg"),
    ("wind", "5.0 m/s to 270 deg"),
    ("time", "1234.5 s, paused"),
)
FIRST = "boat wamv1  power +0.50  turn +0.00  angle +0 deg  speed 1.23 m/s"
SECOND = "heading -123 deg  wind 5.0 m/s to 270 deg  time 1234.5 s, paused"


def test_what_does_not_fit_goes_to_the_next_line():
    assert status_lines(STATUS, 80) == [FIRST, SECOND]
    assert status_lines(STATUS, 200) == [f"{FIRST}  {SECOND}"]


def test_no_line_is_wider_than_the_terminal_and_nothing_is_lost():
    for width in range(1, 130):
        lines = status_lines(STATUS, width)
        assert all(len(line) < width for line in lines), width
        if width > 24:  # the widest item
            assert "  ".join(lines) == f"{FIRST}  {SECOND}", width


class Screen:
    """A terminal of so many columns and rows, as far as the status needs one (ECMA-48)."""

    def __init__(self, columns, rows=24):
        self.columns, self.rows = columns, rows
        self.cells, self.row, self.column = [""] * rows, 0, 0

    def feed(self, text):
        for part in re.findall(r"\x1b\[\d*[A-Za-z]|.", text, re.DOTALL):
            if part == "\r":
                self.column = 0
            elif part == "\n":
                self.row += 1
                if self.row == self.rows:
                    self.cells, self.row = [*self.cells[1:], ""], self.rows - 1
            elif part.endswith("A") and len(part) > 1:
                self.row = max(0, self.row - int(part[2:-1] or 1))
            elif part in {"\x1b[K", "\x1b[J"}:
                self.cells[self.row] = self.cells[self.row][: self.column]
                if part == "\x1b[J":
                    self.cells[self.row + 1 :] = [""] * (self.rows - self.row - 1)
            else:
                assert len(part) == 1, part
                assert self.column < self.columns, "the terminal would wrap"
                line = self.cells[self.row].ljust(self.column)
                self.cells[self.row] = line[: self.column] + part + line[self.column + 1 :]
                self.column += 1

    @property
    def lines(self):
        return [line.rstrip() for line in self.cells if line.strip()]


@contextmanager
def shown(columns):
    """A pseudo-terminal of so many columns, what writes to it, and what is on it after each call of `look`."""
    import fcntl
    import termios

    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    os.set_blocking(ours, False)
    screen = Screen(columns)

    def look():
        try:
            while True:
                screen.feed(os.read(ours, 65536).decode())
        except BlockingIOError:
            return screen.lines

    with open(theirs, "w", encoding="utf-8") as stderr:  # noqa: PTH123
        yield stderr, look
    os.close(ours)


def driven(*status):
    return SimpleNamespace(status=lambda: status or STATUS)


@needs_terminal
def test_a_terminal_of_80_columns_has_wind_and_time():
    clock = iter(range(100))
    with shown(80) as (stderr, look):
        with Terminal(None, stderr, lambda: next(clock)) as terminal:
            terminal.write_line("connected")
            terminal.show(driven())
            assert look() == ["connected", FIRST, SECOND]
            terminal.show(driven(*STATUS[:3]))
            assert look() == ["connected", "boat wamv1  power +0.50  turn +0.00"]
            terminal.show(driven())
            terminal.write_line("the simulation is reset")
            assert look() == ["connected", "the simulation is reset"]
            terminal.show(driven())
            terminal.show(driven())
        stderr.write("$ ")
        stderr.flush()
        assert look() == ["connected", "the simulation is reset", FIRST, SECOND, "$"]


@needs_terminal
def test_at_the_bottom_of_the_screen_the_status_stays_below():
    clock = iter(range(100))
    with shown(80) as (stderr, look), Terminal(None, stderr, lambda: next(clock)) as terminal:
        for number in range(40):
            terminal.write_line(f"line {number}")
            terminal.show(driven())
        assert look()[-3:] == ["line 39", FIRST, SECOND]
        assert len(look()) == 24


# Keys of MuJoCo's window: the number pad has all ten digits


def test_the_number_pad_gives_the_digits():
    assert [window_key(320 + digit) for digit in range(10)] == list("0123456789")
    assert window_key(319) is None
    assert window_key(330) is None
