"""Durations in steps."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.arguments import as_int
from vrx_mj.errors import CommandError
from vrx_mj.runtime.timing import (
    Pause,
    Schedule,
    newest_sample,
    sample_number,
    steps_to_multiple,
    steps_to_time,
    stride_of,
    whole_steps,
)


@pytest.mark.parametrize(("time", "steps"), [(0.0, 100), (0.01, 99), (0.25, 75), (0.99, 1), (1.0, 100), (12.34, 66)])
def test_a_second_ends_after_the_steps_that_are_left_of_it(time, steps):
    assert steps_to_multiple(time, 0.01, stride_of(1.0, 0.01)) == steps


def test_a_timestep_of_a_second_or_more_ends_one_in_a_step():
    assert steps_to_multiple(7.5, 1.5, stride_of(1.0, 1.5)) == 1


@pytest.mark.parametrize(("duration", "timestep", "steps"), [(0.1, 0.01, 10), (0.3, 0.1, 3), (1e5, 0.004, 25_000_000)])
def test_durations_that_are_whole_steps_but_for_rounding(duration, timestep, steps):
    assert whole_steps(duration, timestep) == steps
    assert whole_steps(duration * (1 + 1e-15), timestep) == steps


@pytest.mark.parametrize("duration", [0.104, -1.0, 1e10, "1", None])
def test_other_durations_are_refused(duration):
    with pytest.raises(CommandError):
        whole_steps(duration, 0.01)


def test_whole_numbers_of_any_kind_are_whole():
    assert as_int("steps", True) == 1
    with pytest.raises(CommandError):
        as_int("steps", 2.0)


@given(rate=st.floats(0.1, 1e4), time=st.floats(0.0, 1e5))
def test_the_kernel_and_python_count_samples_alike(rate, time):
    assert newest_sample(rate, time) == sample_number(rate, time)


def test_a_sample_is_taken_once_and_not_late_because_time_is_rounded():
    schedule, time, taken = Schedule(), 0.0, []
    for step in range(31):
        if schedule.take("a", 10.0, time):
            taken.append(step)
        time += 0.01
    assert taken == [0, 10, 20, 30]
    schedule.keep({"b"})
    assert schedule.take("a", 10.0, time)


def test_the_steps_to_a_time_are_not_one_more_because_of_rounding():
    assert steps_to_time(0.3, 0.1 + 0.1, 0.01) == 10
    assert steps_to_time(0.305, 0.2, 0.01) == 11
    assert steps_to_time(0.1, 0.2, 0.01) == 1


def test_a_pause_ends_by_its_time_or_by_hand():
    pause = Pause(0.1)
    assert pause.is_over(-1e9)
    pause.begin(1.0, 2.0)
    assert [pause.is_over(now) for now in (1.0, 2.8, 2.95, 3.0)] == [False, False, True, True]
    pause.begin(1.0, 2.0)
    pause.end()
    assert pause.is_over(1.0)


def refusal(duration, timestep=0.01):
    with pytest.raises(CommandError) as refused:
        whole_steps(duration, timestep)
    return str(refused.value)


def test_durations_are_from_a_step_to_the_longest_and_whole_steps():
    assert [whole_steps(duration, 0.01) for duration in (0.01, 0.01 * (1.0 - 0.9e-6), 1e9, 0.02 + 0.9e-6)] == [
        1, 1, 10**11, 2,
    ]  # fmt: skip
    one = "at least one timestep, 0.01 s, is needed"
    for duration in (0.0, 0.01 * (1.0 - 1.1e-6), math.inf, math.nan, -math.inf):
        assert refusal(duration) == f"invalid duration {duration:g} s: {one}"
    assert refusal(1.1e9) == "invalid duration 1.1e+09 s: at most 1e+09 s"
    needed = "a multiple of the timestep 0.01 s is needed, such as"
    assert refusal(0.02 + 1.1e-6) == f"invalid duration 0.0200011 s: {needed} 0.02 or 0.03 s"
    assert refusal(0.128) == f"invalid duration 0.128 s: {needed} 0.12 or 0.13 s"
    assert refusal("1") == "invalid duration '1': a number of seconds is needed"


def test_strides_are_whole_steps_and_one_at_least():
    assert [stride_of(rate, 0.01) for rate in (1.0, 20.0, 30.0, 99.0, 1e4)] == [100, 5, 3, 1, 1]
    assert [steps_to_multiple(0.01 * step, 0.01, 5) for step in range(7)] == [5, 4, 3, 2, 1, 5, 4]


def test_a_sample_is_due_a_millionth_of_a_second_early():
    assert [sample_number(10.0, time) for time in (0.0, 0.1 - 1.1e-6, 0.1 - 0.9e-6, 0.1999, 1.0)] == [0, 0, 1, 1, 10]
