"""Poses: rotations about fixed axes in three forms, and how they are put together."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.frames import angles, apply, compose, facing, inverse, quaternion, rotation, rotation_matrix

ANGLE, PLACE = st.floats(-3.2, 3.2), st.floats(-50.0, 50.0)
ANGLES, POSE = st.tuples(ANGLE, ANGLE, ANGLE), st.tuples(PLACE, PLACE, PLACE, ANGLE, ANGLE, ANGLE)


def turned(axis, angle):
    """Rotation about an axis: Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def homogeneous(pose):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation(*pose[3:]), pose[:3]
    return matrix


@given(ANGLES)
def test_roll_comes_first_then_pitch_then_yaw_about_axes_that_stay(found):
    roll, pitch, yaw = found
    expected = turned((0, 0, 1), yaw) @ turned((0, 1, 0), pitch) @ turned((1, 0, 0), roll)
    assert np.array(rotation(*found)) == pytest.approx(expected, abs=1e-12)


@given(ANGLES)
def test_a_quaternion_is_the_same_rotation_with_w_from_0_on(found):
    w, *axis = quaternion(*found)
    assert w >= 0.0
    sine = math.hypot(*axis)
    if sine > 1e-9:
        expected = turned(np.array(axis) / sine, 2.0 * math.atan2(sine, w))
        assert np.array(rotation(*found)) == pytest.approx(expected, abs=1e-9)
    assert math.hypot(w, sine) == pytest.approx(1.0)


@given(ANGLES)
def test_the_matrix_of_a_quaternion_is_that_of_its_angles(found):
    assert rotation_matrix(quaternion(*found)) == pytest.approx(np.array(rotation(*found)), abs=1e-12)


@given(ANGLES)
def test_angles_of_a_rotation_give_it_back(found):
    matrix = rotation(*found)
    assert np.array(rotation(*angles(matrix))) == pytest.approx(np.array(matrix), abs=1e-7)


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
@pytest.mark.parametrize(("roll", "yaw"), [(0.0, 0.0), (0.4, 0.0), (0.0, -2.0), (0.3, 1.2)])
def test_straight_up_and_down_there_is_no_roll_left(roll, pitch, yaw):
    matrix = rotation(roll, pitch, yaw)
    found = angles(matrix)
    assert found[0] == 0.0
    assert np.array(rotation(*found)) == pytest.approx(np.array(matrix), abs=1e-9)


@given(POSE, POSE)
def test_poses_are_composed_as_matrices_are_multiplied(outer, inner):
    expected = homogeneous(outer) @ homogeneous(inner)
    assert homogeneous(compose(outer, inner)) == pytest.approx(expected, abs=1e-6)


@given(POSE)
def test_a_pose_and_its_inverse_are_nothing(pose):
    assert homogeneous(compose(pose, inverse(pose))) == pytest.approx(np.eye(4), abs=1e-6)


@pytest.mark.parametrize("axis", [(0, 0, 2), (0, 0, -1), (1, 0, 0), (0, -3, 0), (1, 2, -3), (1e-9, 0, -1)])
def test_the_z_axis_is_turned_to_an_axis(axis):
    found = apply(rotation(*facing(axis)[3:]), (0.0, 0.0, 1.0))
    assert found == pytest.approx(np.array(axis) / np.linalg.norm(axis), abs=1e-6)
