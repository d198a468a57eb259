"""Lights and placards: what they show when, from their marks alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trees import partial
from vrx_mj.config.docks import LIGHT_PATTERNS, SYMBOLS
from vrx_mj.errors import StateError
from vrx_mj.sensors.displays import (
    check_display_marks,
    display_marks,
    displays_of,
    new_pattern,
    next_pattern,
    next_symbol,
    symbol_mark,
)

SHAPES = ("circle", "cross", "triangle", "rectangle")
LIGHTS = [
    {"name": "one", "body": "one/link", "geoms": ["one/a", "one/b"], "pattern": ["off", "off", "off"]},
    {"name": "two", "body": "two/link", "geoms": ["two/a"], "pattern": ["red", "green", "blue"]},
]
PLACARDS = [{"name": "board", "body": "board/link", "symbol": "blue_circle",
             "geoms": {shape: [f"board/{shape}"] for shape in SHAPES}}]  # fmt: skip


@pytest.fixture
def scene():
    displays = displays_of(partial({"lights": LIGHTS, "placards": PLACARDS}))
    return {display.name: display for display in displays}, np.array(display_marks(displays))


def shown(display, marks, times):
    return [display.shows(marks, time) for time in times]


def test_a_world_without_displays_has_none():
    assert displays_of(partial({})) == ()


def test_a_light_is_dark_until_told_and_one_with_a_pattern_shows_it(scene):
    displays, marks = scene
    assert shown(displays["one"], marks, range(10)) == ["off"] * 10
    assert shown(displays["two"], marks, (0.0, 0.99, 1.0, 2.5, 3.0, 4.99, 5.0)) == [
        "red", "red", "green", "blue", "off", "off", "red",
    ]  # fmt: skip


def test_marks_that_nothing_shows_are_refused(scene):
    displays, marks = scene
    check_display_marks(displays.values(), marks[None])
    for display in displays.values():
        own = range(display.marks.start, display.marks.stop)
        wrong = [(own[0], value) for value in (-1.0, 0.5, 99.0)] + [(column, np.nan) for column in own]
        for column, value in wrong:
            spoiled = marks.copy()
            spoiled[column] = value
            text = f"^invalid state of the {display.kind} '{display.name}': (it shows an unknown|a time is not finite)"
            with pytest.raises(StateError, match=text):
                check_display_marks(displays.values(), spoiled[None])


def test_a_new_pattern_begins_a_second_later_and_keeps_the_old_colour_until_then(scene):
    displays, marks = scene
    two = displays["two"]
    new_pattern(marks[two.marks], ("yellow", "blue", "yellow"), 1.3)
    times = (1.3, 2.29, 2.3, 3.29, 3.3, 4.3, 5.3, 6.3, 7.3)
    assert shown(two, marks, times) == [
        "green", "green", "yellow", "yellow", "blue", "yellow", "off", "off", "yellow",
    ]  # fmt: skip


def test_a_pattern_given_twice_waits_from_the_second_time(scene):
    displays, marks = scene
    for time in (1.3, 1.8):
        new_pattern(marks[displays["one"].marks], ("red", "green", "red"), time)
    assert shown(displays["one"], marks, (2.3, 2.79, 2.8)) == ["off", "off", "red"]


def test_shuffling_a_light_goes_through_the_patterns_without_a_new_beginning(scene):
    displays, marks = scene
    two = displays["two"]
    next_pattern(marks[two.marks], 1.5)  # red, green, red
    assert shown(two, marks, (1.5, 1.99, 2.0, 3.0, 5.0, 6.0)) == ["green", "green", "red", "off", "red", "green"]
    for number in range(1, 40):
        next_pattern(marks[two.marks], 5.0 * number)
        later = 5.0 * number + 5.0
        assert shown(two, marks, (later, later + 1.0, later + 2.0)) == list(LIGHT_PATTERNS[number % 36])


def test_shuffles_keep_what_a_light_shows_until_its_beat_ends(scene):
    """Second implementation, in whole steps of 10 ms: a beat shows the pattern that was given before it began."""
    displays, marks = scene
    two, first, times = displays["two"], 237, np.cumsum(np.full(5000, 0.01)) - 0.01
    shuffled = sorted({*range(first, 5000, 300), *range(first + 120, 5000, 470), *range(first + 130, 5000, 940)})
    new_pattern(marks[two.marks], ("blue", "red", "yellow"), float(times[first - 100]))
    patterns, found, expected = [("blue", "red", "yellow"), *LIGHT_PATTERNS], [], []
    for step in range(first, 5000):
        if step in shuffled:
            next_pattern(marks[two.marks], float(times[step]))
        found.append(two.shows(marks, float(times[step])))
        beat, into = divmod(step - first, 100)
        pattern = patterns[sum(earlier < step - into for earlier in shuffled)]
        expected.append((*pattern, "off", "off")[beat % 5])
    assert found == expected


def test_a_shuffle_while_a_pattern_waits_changes_it(scene):
    displays, marks = scene
    one = displays["one"]
    new_pattern(marks[one.marks], ("blue", "yellow", "blue"), 2.0)
    next_pattern(marks[one.marks], 2.5)
    assert shown(one, marks, (2.99, 3.0, 4.0, 5.0)) == ["off", "red", "green", "red"]


@given(start=st.integers(0, 50_000), later=st.integers(0, 2000))
def test_colours_change_at_whole_seconds_though_time_is_a_sum_of_steps(start, later):
    """Second implementation, in whole steps of 10 ms."""
    displays = displays_of(partial({"lights": LIGHTS}))
    marks = np.array(display_marks(displays))
    time, now = np.cumsum(np.full(start + later + 1, 0.01))[[start, start + later]] - 0.01
    new_pattern(marks[displays[0].marks], ("red", "green", "blue"), float(time))
    beat = (later - 100) // 100 % 5
    expected = "off" if later < 100 else ("red", "green", "blue", "off", "off")[beat]
    assert displays[0].shows(marks, float(now)) == expected


def test_a_placard_starts_with_a_blue_circle_and_shuffles_through_all_symbols(scene):
    displays, marks = scene
    board = displays["board"]
    seen = []
    for _ in range(17):
        seen.append(board.shows(marks, 0.0))
        next_symbol(marks[board.marks])
    assert seen == [*SYMBOLS, "blue_circle"]


def test_one_shape_is_seen_in_its_colour(scene):
    displays, marks = scene
    board = displays["board"]
    marks[board.marks] = symbol_mark("yellow_triangle")
    colors = board.colors(int(board.codes(marks[None], np.zeros(1))[0]))
    assert {shape: color[3] for shape, color in colors.items()} == {
        "circle": 0.0, "cross": 0.0, "triangle": 1.0, "rectangle": 0.0,
    }  # fmt: skip
    assert colors["triangle"] == (1.0, 1.0, 0.0, 1.0)


def test_rows_of_marks_give_the_same_as_one_by_one(scene):
    displays, marks = scene
    rows, times = [], np.arange(0.0, 30.0, 0.35)
    for time in times:
        if 9.8 < time < 10.2:
            new_pattern(marks[displays["two"].marks], ("yellow", "red", "yellow"), time)
        rows.append(marks.copy())
    codes = displays["two"].codes(np.array(rows), times)
    alone = [displays["two"].shows(row, time) for row, time in zip(rows, times, strict=True)]
    assert [("red", "green", "blue", "yellow", "off")[code] for code in codes] == alone
