"""What is shown of long work, in a terminal and elsewhere."""

import io
import re

import pytest

from vrx_mj import bar as module
from vrx_mj.bar import Bar, waiting


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 100.0

    monkeypatch.setattr(module.time, "monotonic", lambda: Clock.now)
    return Clock


def shown(stream):
    """What a terminal shows at the end: the last line after its last clearing."""
    return stream.getvalue().rpartition("\x1b[K")[2]


def test_elsewhere_a_line_is_printed_every_ten_seconds_with_the_time_left(clock):
    stream = io.StringIO()
    with Bar("sailing", 60.0, "s", stream) as bar:
        for second in range(1, 31):
            clock.now += 1.0
            bar.update(float(second), "running")
    assert stream.getvalue().splitlines() == [
        "sailing: 10 of 60 s, 0:50 left, running",
        "sailing: 20 of 60 s, 0:40 left, running",
        "sailing: 30 of 60 s, 0:30 left, running",
    ]


def test_short_work_prints_nothing_elsewhere(clock):
    stream = io.StringIO()
    with Bar("sailing", 60.0, "s", stream) as bar:
        clock.now += 9.9
        bar.update(60.0)
    assert stream.getvalue() == ""


def test_a_bar_of_nothing_is_empty():
    stream = Terminal()
    with Bar("sailing", 0, "trials", stream):
        assert shown(stream) == f"sailing [{'.' * 24}] 0 of 0 trials"


def test_in_a_terminal_a_bar_grows_and_goes(clock):
    stream = Terminal()
    with Bar("compiling", 130, "kernels", stream) as bar:
        assert shown(stream) == f"compiling [{'.' * 24}] 0 of 130 kernels"
        clock.now += 3700.0
        bar.update(65)
        assert shown(stream) == f"compiling [{'#' * 12}{'.' * 12}] 65 of 130 kernels  1:01:40 left"
    assert shown(stream) == ""


def test_a_terminal_is_drawn_ten_times_a_second_at_most(clock):
    stream = Terminal()
    with Bar("sailing", 60.0, stream=stream) as bar:
        for step in range(1000):
            clock.now += 0.001
            bar.update(step * 0.06)
    assert 8 <= stream.getvalue().count("sailing") <= 12


def test_a_line_fits_the_terminal(clock, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    stream = Terminal()
    with Bar("sailing", 60.0, "s", stream) as bar:
        clock.now += 1.0
        bar.update(1.0, "a note that is much too long")
        assert len(shown(stream)) == 39


def test_what_is_printed_meanwhile_stands_above_the_bar(clock):
    stream = Terminal()
    with Bar("sailing", 60.0, "s", stream) as bar:
        bar.print("gate 1 passed", "yellow")
        assert "\x1b[33mgate 1 passed\x1b[0m\n" in stream.getvalue()
        assert shown(stream).startswith("sailing [")
    plain = io.StringIO()
    with Bar("sailing", 60.0, "s", plain) as bar:
        bar.print("gate 1 passed", "yellow")
    assert plain.getvalue() == "gate 1 passed\n"


def test_without_colors_lines_are_plain(clock, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    stream = Terminal()
    with Bar("sailing", 60.0, "s", stream) as bar:
        bar.print("gate 1 passed", "yellow")
    assert "\x1b[Kgate 1 passed\n" in stream.getvalue()


def test_of_two_bars_the_later_one_is_drawn(clock):
    stream = Terminal()
    with Bar("sailing", 60.0, "s", stream) as outer:
        with Bar("compiling", 8.0, stream=stream) as inner:
            clock.now += 1.0
            inner.update(2.0)
            outer.update(30.0)
            assert shown(stream).startswith("compiling [######")
        clock.now += 1.0
        outer.update(31.0)
        assert re.match(r"sailing \[#+\.+\] 31 of 60 s", shown(stream))


def test_more_than_the_total_is_the_total(clock):
    stream = io.StringIO()
    with Bar("compiling", 130, "kernels", stream) as bar:
        clock.now += 10.0
        bar.update(131)
    assert stream.getvalue() == "compiling: 131 of 131 kernels, 0:00 left\n"


def test_waiting_is_shown_in_a_terminal_and_goes(clock):
    stream = Terminal()
    with waiting("closing the recording", stream):
        assert shown(stream) == "closing the recording ..."
    assert shown(stream) == ""


def test_elsewhere_waiting_prints_a_line_now_and_then(monkeypatch, clock):
    monkeypatch.setattr(module, "LINE_PERIOD", 0.01)
    stream = io.StringIO()
    with waiting("closing the recording", stream):
        for line in ("closing the recording: 0 s\n", "closing the recording: 7 s\n"):
            while line not in stream.getvalue():
                pass
            clock.now += 7.0
    assert stream.getvalue().startswith("closing the recording: 0 s\nclosing the recording: ")


def test_short_waiting_prints_nothing_elsewhere():
    stream = io.StringIO()
    with waiting("closing the recording", stream):
        pass
    assert stream.getvalue() == ""
