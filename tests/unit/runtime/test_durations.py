"""Durations in steps."""

import math

import pytest

from vrx_mj.arguments import whole
from vrx_mj.errors import CommandError
from vrx_mj.runtime.durations import steps_to_second, whole_steps


@pytest.mark.parametrize(("time", "steps"), [(0.0, 100), (0.01, 99), (0.25, 75), (0.99, 1), (1.0, 100), (12.34, 66)])
def test_a_second_ends_after_the_steps_that_are_left_of_it(time, steps):
    assert steps_to_second(time, 0.01) == steps


def test_a_timestep_of_a_second_or_more_ends_one_in_a_step():
    assert steps_to_second(7.5, 1.5) == 1


@pytest.mark.parametrize(("duration", "timestep", "steps"), [(0.1, 0.01, 10), (0.3, 0.1, 3), (1e5, 0.004, 25_000_000)])
def test_durations_that_are_whole_steps_but_for_rounding(duration, timestep, steps):
    assert whole_steps(duration, timestep) == steps
    assert whole_steps(duration * (1 + 1e-15), timestep) == steps


@pytest.mark.parametrize("duration", [0.015, 0.104, 0.0, -1.0, 0.009, math.inf, math.nan, "1", None])
def test_other_durations_are_refused(duration):
    with pytest.raises(CommandError):
        whole_steps(duration, 0.01)


def test_whole_numbers_of_any_kind_are_whole():
    assert whole("steps", True) == 1
    with pytest.raises(CommandError):
        whole("steps", 2.0)
