"""Frames carried by bodies: second implementations by MuJoCo and by matrices."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.frames import conjugate, quaternion_product, rotation, rotation_vector
from vrx_mj.sensors.places import Mount, carried

angle = st.floats(-3.1, 3.1)
BODY = """<mujoco><worldbody><body name="hull"><freejoint/><geom size="0.1"/>
<site name="spot" pos="0.3 -0.2 1.3" euler="0.3 -0.5 2.0"/></body></worldbody></mujoco>"""


def test_a_place_is_that_of_mujocos_site():
    model = mujoco.MjModel.from_xml_string(BODY.replace("<worldbody>", '<compiler angle="radian"/><worldbody>'))
    data = mujoco.MjData(model)
    data.qpos[:] = (1.0, 2.0, 3.0, *np.array([0.5, -0.1, 0.7, 0.2]) / np.linalg.norm([0.5, -0.1, 0.7, 0.2]))
    data.qvel[:] = (0.5, -1.0, 0.3, 0.2, 0.4, -0.9)
    mujoco.mj_forward(model, data)
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.site_quat[0])
    place = carried(data.qpos, data.qvel, Mount.of((0.3, -0.2, 1.3), turn.reshape(3, 3)))
    speed = np.empty(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, 0, speed, 0)
    assert place.position == pytest.approx(data.site_xpos[0], abs=1e-14)
    assert place.rotation == pytest.approx(data.site_xmat[0].reshape(3, 3), abs=1e-14)
    assert place.velocity == pytest.approx(speed[3:], abs=1e-14)
    assert place.spin == pytest.approx(speed[:3], abs=1e-14)
    mujoco.mju_quat2Mat(turn, place.orientation)
    assert turn.reshape(3, 3) == pytest.approx(place.rotation, abs=1e-14)


@given(angle, st.floats(-1.5, 1.5), angle)
def test_a_mounts_quaternion_is_its_rotation(roll, pitch, yaw):
    matrix = np.array(rotation(roll, pitch, yaw))
    found, back = Mount.of((0, 0, 0), matrix).orientation, np.empty(9)
    mujoco.mju_quat2Mat(back, found)
    assert found[0] >= 0.0
    assert back.reshape(3, 3) == pytest.approx(matrix, abs=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_mount_may_be_turned_round(axis):
    """Where w is 0, and the formula by the trace would divide by it."""
    matrix = -np.eye(3)
    matrix[axis, axis] = 1.0
    found = Mount.of((0, 0, 0), matrix).orientation
    assert np.abs(found) == pytest.approx(np.eye(4)[axis + 1])


def test_products_of_quaternions_are_those_of_mujoco():
    rng = np.random.default_rng(2)
    for one, other in rng.normal(size=(20, 2, 4)):
        expected = np.empty(4)
        mujoco.mju_mulQuat(expected, one, other)
        assert quaternion_product(one, other) == pytest.approx(expected, abs=1e-14)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_a_rotation_vector_is_axis_times_angle(size, tilt):
    axis = np.array([math.cos(tilt), math.sin(tilt) * 0.6, math.sin(tilt) * 0.8])
    turn = np.concatenate(([math.cos(size / 2)], math.sin(size / 2) * axis))
    assert rotation_vector(turn) == pytest.approx(size * axis, abs=1e-9)
    assert rotation_vector(-turn) == pytest.approx(size * axis, abs=1e-9)
    assert rotation_vector(quaternion_product(conjugate(turn), turn)) == pytest.approx((0, 0, 0), abs=1e-12)


def test_a_mount_at_the_base_keeps_its_axes():
    mount = Mount.of((1.0, 2.0, 3.0), rotation(0.1, 0.2, 0.3))
    assert mount.at_base().position.tolist() == [0.0, 0.0, 0.0]
    assert mount.at_base().rotation is mount.rotation
