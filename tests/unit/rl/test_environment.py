"""Actions of teams: whose channel is which command, and which numbers are refused."""

import math
from types import SimpleNamespace

import gymnasium
import numpy as np
import pytest

from vrx_mj.frames import quaternion
from vrx_mj.rl.environment import Actions
from vrx_mj.rl.options import ActionError, step_limit
from vrx_mj.rl.picture import Picture
from vrx_mj.rl.problems import PROBLEMS

CHANNELS = (("a", "left"), ("b", "only"), ("a", "right"))
LARGEST = np.array([[-100.0, 250.0], [-1.0, 1.0], [-1.0, 1.0]])
HERE = np.array([[True, True]])


@pytest.fixture
def actions():
    return Actions(("a", "b"), CHANNELS, LARGEST)


def test_each_command_is_that_of_its_boat_and_channel(actions):
    assert actions.most == 2
    assert actions.names == {"a": ("left", "right"), "b": ("only",)}
    given = np.array([[[0.5, 0.25], [-0.75, 9.0]]], np.float32)
    assert actions.commands(given).tolist() == [[125.0, -0.75, 0.25]]
    assert actions.commands(-given).tolist() == [[-50.0, 0.75, -0.25]]


def test_numbers_of_channels_that_a_boat_lacks_are_left_out(actions):
    given = [[[0.5, 0.25], [-0.75, np.nan]]]
    assert actions.array(given, HERE).tolist() == [[[0.5, 0.25], [-0.75, 0.0]]]


def test_numbers_of_a_boat_that_is_not_there_are_left_out(actions):
    given = [[[0.5, 0.25], [np.nan, 7.0]]]
    assert actions.array(given, np.array([[True, False]])).tolist() == [[[0.5, 0.25], [0.0, 0.0]]]
    with pytest.raises(ActionError, match="invalid action nan for only of b"):
        actions.array(given, HERE)


@pytest.mark.parametrize("value", [1.001, -1.001, np.inf, np.nan])
def test_a_number_beyond_one_is_refused(actions, value):
    with pytest.raises(ActionError, match="right of a"):
        actions.array([[[0.5, value], [0.0, 0.0]]], HERE)


def test_other_shapes_are_refused(actions):
    for given in (np.zeros((1, 2)), np.zeros((2, 2, 2)), "left"):
        with pytest.raises(ActionError):
            actions.array(given, HERE)


def test_the_eye_behind_a_boat_has_its_heading_however_the_boat_lies(monkeypatch):
    seen = []
    picture = Picture(None, 64, 48)
    monkeypatch.setattr(picture, "_image", lambda _rows, _row, place, turned: seen.append((place, turned)))
    boat = [5.0, -3.0, 0.2, *quaternion(0.3, -0.2, 2.0)]
    picture.from_behind(SimpleNamespace(features=np.array([[boat]])), 0)
    [((x, y, _), (_, _, heading))] = seen
    assert heading == pytest.approx(2.0)
    assert math.atan2(-3.0 - y, 5.0 - x) == pytest.approx(2.0)


@pytest.mark.parametrize("most", [0, -2, True, 1.5, np.nan, "x"])
def test_a_limit_of_steps_that_is_none_is_refused(most):
    with pytest.raises(gymnasium.error.Error, match="invalid max_episode_steps"):
        step_limit(None, most, 60.0)


def test_an_episode_ends_after_its_duration_or_so_many_steps():
    given = [(None, None), (None, 7), (30.0, None), (30.0, 300), (30.0, -1), (None, np.int64(7))]
    assert [step_limit(*each, 60.0) for each in given] == [600, 7, 300, 300, 300, 7]
    with pytest.raises(gymnasium.error.Error, match=r"truncates an episode after 29\.9 s"):
        step_limit(30.0, 299, 60.0)


@pytest.mark.parametrize("problem", [name for name, kind in PROBLEMS.items() if kind.boats == 1 and kind.fixed
                                     and "docks" not in kind.world])  # fmt: skip
def test_problems_in_open_water_name_all_arrays_of_rows(problem):
    """Those are copied to a graphics processor, and begin anew there."""
    made = PROBLEMS[problem](SimpleNamespace(n=7, boats=("a",)))
    arrays = {name for name, value in vars(made).items() if isinstance(value, np.ndarray)}
    assert arrays == set(made.row_arrays)
    twice = made.with_arrays(lambda array: np.concatenate((array, array)))
    assert {len(getattr(twice, name)) for name in arrays} == {14}
    assert {len(getattr(made, name)) for name in arrays} == {7}
