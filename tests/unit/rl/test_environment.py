"""Actions of teams: whose channel is which command, and which numbers are refused."""

import numpy as np
import pytest

from vrx_mj.rl.environment import Actions
from vrx_mj.rl.options import ActionError

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
