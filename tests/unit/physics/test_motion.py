"""Motion of a free joint, and wrenches about other points."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import matrix, moving, rotation
from vrx_mj.frames import in_world_axes, rotation_matrix
from vrx_mj.physics.motion import Wrench, add, carry, motion, rotate, rotated_wrench, shift, unrotate, zero_wrench

numbers = st.floats(-10, 10)
vectors = st.tuples(numbers, numbers, numbers)
angles = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)
wrenches = st.builds(Wrench, *[numbers] * 6)


def quaternion(roll, pitch, yaw):
    """(w, x, y, z) of Rz Ry Rx."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw))
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


@given(position=vectors, angle=angles, linear=vectors, angular=vectors, length=st.floats(0.5, 2))
def test_a_free_joint_s_motion(position, angle, linear, angular, length):
    qpos = np.array([9.0, *position, *(length * quaternion(*angle))])
    qvel = np.array([9.0, 9.0, *linear, *angular])
    body = motion(qpos, qvel, 1, 2)
    assert body[:3] == pytest.approx(position)
    assert matrix(body) == pytest.approx(rotation(*angle), abs=1e-14)
    assert body[12:15] == pytest.approx(rotation(*angle).T @ linear, abs=1e-13)
    assert body[15:] == pytest.approx(angular)


@given(angle=angles, vector=vectors)
def test_turning_forth_and_back_changes_nothing(angle, vector):
    body = moving(angles=angle)
    assert rotate(body, vector) == pytest.approx(matrix(body) @ vector, abs=1e-13)
    assert unrotate(body, rotate(body, vector)) == pytest.approx(vector, abs=1e-13)


@given(wrench=wrenches, lever=vectors)
def test_a_shifted_wrench_gains_the_torque_of_its_force(wrench, lever):
    moved = shift(wrench, lever)
    assert moved[:3] == wrench[:3]
    assert moved[3:] == pytest.approx(np.add(wrench[3:], np.cross(lever, wrench[:3])), abs=1e-12)


@given(wrench=wrenches, angle=angles, start=vectors, end=vectors)
def test_a_carried_wrench_comes_back(wrench, angle, start, end):
    body = moving(angles=angle)
    there = carry(wrench, body, np.array(start), np.array(end))
    assert carry(there, body, np.array(end), np.array(start)) == pytest.approx(wrench, abs=1e-11)
    lever = matrix(body) @ np.subtract(start, end)
    assert there[3:] == pytest.approx(np.add(wrench[3:], np.cross(lever, wrench[:3])), abs=1e-11)


@given(a=wrenches, b=wrenches, angle=angles)
def test_sums_turn_with_the_body(a, b, angle):
    body = moving(angles=angle)
    whole = rotated_wrench(body, add(a, b))
    assert whole == pytest.approx(add(rotated_wrench(body, a), rotated_wrench(body, b)), abs=1e-12)
    assert whole[:3] == pytest.approx(matrix(body) @ np.add(a[:3], b[:3]), abs=1e-12)


def test_no_wrench_is_zero():
    assert zero_wrench() == (0.0,) * 6


def test_vectors_in_world_axes_are_those_that_each_rotation_matrix_gives():
    random = np.random.default_rng(1)
    quaternions, vectors = random.normal(size=(2, 3, 4)), random.normal(size=(2, 3, 3))
    quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    turned = in_world_axes(quaternions, vectors)
    for at in np.ndindex(2, 3):
        assert turned[at] == pytest.approx(rotation_matrix(quaternions[at]) @ vectors[at], abs=1e-14)
