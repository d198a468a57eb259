"""Frames carried by bodies: second implementations by MuJoCo and by matrices."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.config.sensors import P3dConfig, PingerConfig
from vrx_mj.frames import conjugate, quaternion, quaternion_product, rotation, rotation_vector
from vrx_mj.sensors import sense_sound, truth
from vrx_mj.sensors.instruments import Draw
from vrx_mj.sensors.readings import Mount, Place, place_of_mount

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
    place = place_of_mount(data.qpos, data.qvel, Mount.of((0.3, -0.2, 1.3), turn.reshape(3, 3)))
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


# A receiver of an acoustic beacon: geometry and noise


EXACT = PingerConfig(name="pinger", link="pinger", range_noise=0.0, bearing_noise=0.0, elevation_noise=0.0)
NOISY = PingerConfig(name="pinger", link="pinger")
DRAW = Draw(1, "a", "pinger", 3, 1.0)


def at(*position, roll=0.0, pitch=0.0, yaw=0.0):
    turn, attitude = np.array(rotation(roll, pitch, yaw)), np.array(quaternion(roll, pitch, yaw))
    return Place(np.array(position, float), turn, attitude, np.zeros(3), np.zeros(3))


def heard(config, place, beacon, draw=DRAW):
    found = sense_sound(config, place, np.array(beacon, float), draw)
    return found.range, found.bearing, found.elevation


@pytest.mark.parametrize(
    ("beacon", "expected"),
    [
        ((10, 0, 0), (10.0, 0.0, 0.0)),
        ((0, 10, 0), (10.0, math.pi / 2, 0.0)),
        ((-10, -10, 0), (10.0 * math.sqrt(2.0), -3 * math.pi / 4, 0.0)),
        ((3, 4, -5), (5.0 * math.sqrt(2.0), math.atan2(4, 3), -math.pi / 4)),
        ((0, 0, 2), (2.0, 0.0, math.pi / 2)),
        ((0, 0, 0), (0.0, 0.0, 0.0)),
    ],
)
def test_a_beacon_is_heard_where_it_is(beacon, expected):
    assert heard(EXACT, at(0, 0, 0), beacon) == pytest.approx(expected)


def test_bearings_are_from_the_bow():
    """A boat that heads north has a beacon in the east at its starboard beam."""
    assert heard(EXACT, at(5.0, 5.0, 0.0, yaw=math.pi / 2), (25.0, 5.0, 0.0)) == pytest.approx((20, -math.pi / 2, 0))


def test_elevations_are_from_the_deck():
    """With the bow down by 0.2 rad, what is level ahead is above the axis."""
    assert heard(EXACT, at(0, 0, 0, pitch=0.2), (10.0, 0.0, 0.0)) == pytest.approx((10.0, 0.0, 0.2))


def test_noise_has_vrxs_standard_deviations():
    true = np.array([50.0, 0.0, 0.0])
    values = np.array([heard(NOISY, at(0, 0, 0), true, Draw(1, "a", "pinger", k, 1.0)) for k in range(4000)]) - true
    spread = 4.5 / math.sqrt(4000)
    assert values.std(axis=0) == pytest.approx((3.0, 0.01, 0.01), rel=spread)
    assert np.abs(values.mean(axis=0) / (3.0, 0.01, 0.01)).max() < spread
    assert np.corrcoef(values.T) == pytest.approx(np.eye(3), abs=spread)


def test_ranges_near_the_beacon_may_be_negative_as_in_vrx():
    assert min(heard(NOISY, at(0, 0, 0), (0.5, 0, 0), Draw(1, "a", "p", k, 1.0))[0] for k in range(100)) < 0.0


# The truth, and the noise that one may add to it


PLACE = Place(
    np.array([1.0, 2.0, 3.0]), np.eye(3), np.array([1.0, 0, 0, 0]), np.array([4.0, 5.0, 6.0]), np.array([0.1, 0.2, 0.3])
)


def test_without_noise_it_is_the_truth_in_world_axes():
    found = truth(P3dConfig(name="p3d", link="base_link"), PLACE, Draw(1, "a", "p3d", 0, 10.0))
    assert found.position.tolist() == [1.0, 2.0, 3.0]
    assert found.velocity.tolist() == [4.0, 5.0, 6.0]
    assert found.angular_velocity.tolist() == [0.1, 0.2, 0.3]


def test_noise_is_on_the_twist_alone():
    config = P3dConfig(name="p3d", link="base_link", noise=0.5)
    found = [truth(config, PLACE, Draw(1, "a", "p3d", k, 10.0)) for k in range(3000)]
    assert {tuple(one.position) for one in found} == {(1.0, 2.0, 3.0)}
    assert {tuple(one.orientation) for one in found} == {(1.0, 0.0, 0.0, 0.0)}
    twists = np.array([(*one.velocity, *one.angular_velocity) for one in found])
    assert twists.std(axis=0) == pytest.approx([0.5] * 6, rel=0.07)
    assert np.corrcoef(twists.T) == pytest.approx(np.eye(6), abs=0.09)
