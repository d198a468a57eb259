"""How far long work has come: a bar with the time left in a terminal, a line every ten seconds elsewhere."""

import contextlib
import os
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from typing import ClassVar, Self, TextIO

LINE_PERIOD = 10.0
"""Wall time between two lines where the stream is not a terminal [s]."""
_DRAW_PERIOD = 0.1
"""Wall time between two drawings of the bar [s], at least."""
_WIDTH = 24
"""Width of the bar, in characters."""
_COLORS = {"yellow": 33, "red": 31}
_CLEAR = "\r\x1b[K"


class Bar:
    """Work of a known amount, which goes on below whatever is printed meanwhile; of two bars the later one is drawn.

    Work of less than ten seconds prints nothing where the stream is not a terminal.
    """

    _open: ClassVar[list["Bar"]] = []

    def __init__(self, what: str, total: float, unit: str = "", stream: TextIO | None = None) -> None:
        """Begin the work `what`, which is done when `total` of a unit are."""
        self._what, self._total, self._unit = what, total, unit
        self._stream = sys.stderr if stream is None else stream
        self.watched = self._stream.isatty()
        """Whether the stream is a terminal."""
        self._done, self._note = 0.0, ""
        self._begun = self._shown = time.monotonic()

    def __enter__(self) -> Self:
        self._open.append(self)
        if self.watched:
            self._draw()
        return self

    def __exit__(self, *_: object) -> None:
        self._open.remove(self)
        if self.watched:
            self._write(_CLEAR)

    def update(self, done: float, note: str = "", *, total: float | None = None) -> None:
        """Show that so much is done, and a note beside it; of a new total where that was not known before."""
        self._done, self._note = done, note
        self._total = self._total if total is None else total
        if self._open[-1:] != [self]:
            return
        now = time.monotonic()
        if now - self._shown >= (_DRAW_PERIOD if self.watched else LINE_PERIOD):
            self._shown = now
            self._draw()

    def print(self, line: str, color: str | None = None) -> None:
        """Print a line; in a terminal above the bar, in a color."""
        if not self.watched:
            self._write(f"{line}\n")
            return
        self._write(f"{_CLEAR}{in_color(line, color)}\n")
        self._draw()

    def _draw(self) -> None:
        total = max(self._total, self._done)
        share = self._done / total if total > 0.0 else 0.0
        how_far = f"{self._done:.0f} of {total:.0f}{self._unit and f' {self._unit}'}"
        left = self._time_left(total)
        if not self.watched:
            parts = [how_far, *([f"{left} left"] if left else []), *([self._note] if self._note else [])]
            self._write(f"{self._what}: {', '.join(parts)}\n")
            return
        filled = round(_WIDTH * share)
        text = f"{self._what} [{'#' * filled}{'.' * (_WIDTH - filled)}] {how_far}"
        text += f"  {left} left" * bool(left) + f"  {self._note}" * bool(self._note)
        self._write(f"{_CLEAR}{text[: max(20, shutil.get_terminal_size().columns - 1)]}")

    def _time_left(self, total: float) -> str:
        """The time left, as m:ss, if the rest takes as long as what is done; nothing is known at the beginning."""
        spent = time.monotonic() - self._begun
        if self._done <= 0.0 or spent < 1.0:
            return ""
        seconds = round(spent / self._done * (total - self._done))
        minutes, hours = seconds // 60, seconds // 3600
        return f"{hours}:{minutes % 60:02}:{seconds % 60:02}" if hours else f"{minutes}:{seconds % 60:02}"

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()


def in_color(text: str, color: str | None) -> str:
    """Text in a color of a terminal, `yellow` or `red`; NO_COLOR turns colors off."""
    return f"\x1b[{_COLORS[color]}m{text}\x1b[0m" if color and "NO_COLOR" not in os.environ else text


@contextlib.contextmanager
def waiting(what: str, stream: TextIO | None = None) -> Iterator[None]:
    """Show that work of unknown length goes on: its name in a terminal, elsewhere a line every ten seconds."""
    out = sys.stderr if stream is None else stream
    done, begun, watched = threading.Event(), time.monotonic(), out.isatty()

    def write_line() -> None:
        while not done.wait(LINE_PERIOD):
            out.write(f"{what}: {time.monotonic() - begun:.0f} s\n")
            out.flush()

    speaker = threading.Thread(target=write_line, daemon=True)
    if watched:
        out.write(f"{_CLEAR}{what} ...")
        out.flush()
    else:
        speaker.start()
    try:
        yield
    finally:
        done.set()
        if watched:
            out.write(_CLEAR)
            out.flush()
        else:
            speaker.join()
