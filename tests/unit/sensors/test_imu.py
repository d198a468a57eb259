"""An inertial unit in motions that are known in closed form."""

import math

import numpy as np
import pytest

from vrx_mj.config.sensors import ErrorModel, ImuConfig
from vrx_mj.frames import conjugate, quaternion, quaternion_product, rotation, rotation_vector
from vrx_mj.sensors.instruments import Draw, errors, inertia
from vrx_mj.sensors.readings import Place

CONFIG = ImuConfig(name="imu", link="imu_link")
DRAW = Draw(1, "a", "imu", 12, 15.0)
DOWN = np.array([0.0, 0.0, -9.8])
H = 1.0 / 15.0


def at(roll=0.0, pitch=0.0, yaw=0.0, *, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)):
    turn, attitude = np.array(rotation(roll, pitch, yaw)), np.array(quaternion(roll, pitch, yaw))
    return Place(np.zeros(3), turn, attitude, np.array(velocity, float), np.array(spin, float))


@pytest.mark.parametrize("x_from_east", [0.0, 0.7, -3.0])
def test_the_orientation_is_from_east_and_all_else_as_before(x_from_east):
    config = CONFIG.model_copy(update={"heading": ErrorModel(offset=(0.0, 0.0, 0.1))})
    now, before = at(0.2, -0.1, 0.5, spin=(0.1, 0.2, 0.3)), at(0.2, -0.1, 0.4)
    found, plain = (inertia(config, now, before, H, DOWN, DRAW, turn) for turn in (x_from_east, 0.0))
    assert found.orientation == pytest.approx(np.array(quaternion(0.2, -0.1, 0.6 + x_from_east)), abs=1e-12)
    for name in ("angular_velocity", "linear_acceleration", "orientation_covariance"):
        assert np.array_equal(getattr(found, name), getattr(plain, name))


def test_over_no_time_a_unit_measures_what_it_does_at_its_first_time():
    now = at(0.2, -0.1, 0.5, velocity=(1.0, 2.0, 0.0), spin=(0.1, 0.2, 0.3))
    again, first = (inertia(CONFIG, now, before, 0.0, DOWN, DRAW) for before in (at(), None))
    assert again.angular_velocity.tolist() == first.angular_velocity.tolist()
    assert again.linear_acceleration.tolist() == first.linear_acceleration.tolist()


@pytest.mark.parametrize("before", [None, at()])
def test_at_rest_and_level_gravity_is_up(before):
    found = inertia(CONFIG, at(), before, H, DOWN, DRAW)
    assert found.linear_acceleration.tolist() == [0.0, 0.0, 9.8]
    assert found.angular_velocity.tolist() == [0.0, 0.0, 0.0]


def test_at_rest_and_heeled_gravity_leans_against_the_axes():
    """Positive roll lowers starboard: the reaction to gravity then points to port, +y, too."""
    found = inertia(CONFIG, at(roll=0.3), at(roll=0.3), H, DOWN, DRAW).linear_acceleration
    assert found == pytest.approx((0.0, 9.8 * math.sin(0.3), 9.8 * math.cos(0.3)))
    found = inertia(CONFIG, at(pitch=0.2), at(pitch=0.2), H, DOWN, DRAW).linear_acceleration
    assert found == pytest.approx((-9.8 * math.sin(0.2), 0.0, 9.8 * math.cos(0.2)))


def test_in_free_fall_there_is_no_acceleration():
    before, now = at(velocity=(1, 2, 3)), at(velocity=(1, 2, 3 - 9.8 * H))
    assert inertia(CONFIG, now, before, H, DOWN, DRAW).linear_acceleration == pytest.approx((0, 0, 0), abs=1e-12)


def test_speeding_up_is_felt_ahead_whatever_the_heading():
    along = np.array([math.cos(2.0), math.sin(2.0), 0.0])
    found = inertia(CONFIG, at(yaw=2.0, velocity=1.3 * along), at(yaw=2.0, velocity=1.2 * along), 0.1, DOWN, DRAW)
    assert found.linear_acceleration == pytest.approx((1.0, 0.0, 9.8))


def test_in_a_steady_turn_the_acceleration_is_centripetal():
    """u = 3 m/s, r = 0.4 rad/s to port: u r = 1.2 m/s2 to port, up to the mean over the interval, (r h)^2 / 6."""
    rate, speed = 0.4, 3.0
    before, now = (
        at(yaw=rate * t, velocity=(speed * math.cos(rate * t), speed * math.sin(rate * t), 0), spin=(0, 0, rate))
        for t in (2.0, 2.0 + H)
    )
    found = inertia(CONFIG, now, before, H, DOWN, DRAW)
    half = rate * H / 2.0
    chord = speed * rate * math.sin(half) / half
    assert found.linear_acceleration == pytest.approx((chord * math.sin(half), chord * math.cos(half), 9.8))
    assert found.linear_acceleration[1] == pytest.approx(1.2, rel=1e-3)
    assert found.angular_velocity == pytest.approx((0.0, 0.0, rate))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_rate_is_the_turn_between_the_two_in_the_sensors_axes(axis):
    angles = [0.0, 0.0, 0.0]
    angles[axis] = 0.05
    spin = np.zeros(3)
    spin[axis] = 0.05 / H
    assert inertia(CONFIG, at(*angles), at(), H, DOWN, DRAW).angular_velocity == pytest.approx(spin)


def test_a_heeled_sensor_that_turns_about_the_vertical_feels_it_in_its_own_axes():
    """A yaw rate r at a roll of 0.3 rad is r sin 0.3 about the sensor's y and r cos 0.3 about its z."""
    found = inertia(CONFIG, at(roll=0.3, yaw=1.05), at(roll=0.3, yaw=1.0), H, DOWN, DRAW).angular_velocity
    assert found == pytest.approx((0.0, 0.05 / H * math.sin(0.3), 0.05 / H * math.cos(0.3)))


def test_the_rate_is_right_across_the_seam_of_quaternions():
    before, now = at(yaw=math.pi - 0.01), at(yaw=-math.pi + 0.01)
    assert inertia(CONFIG, now, before, H, DOWN, DRAW).angular_velocity == pytest.approx((0, 0, 0.02 / H))


def test_the_first_measurement_has_the_rate_of_the_moment():
    found = inertia(CONFIG, at(yaw=1.0, spin=(1.0, 0.0, 0.5)), None, 0.0, DOWN, DRAW)
    assert found.angular_velocity == pytest.approx((math.cos(1.0), -math.sin(1.0), 0.5))
    assert found.linear_acceleration == pytest.approx((0.0, 0.0, 9.8))


def test_the_orientation_is_absolute():
    assert inertia(CONFIG, at(0.1, 0.2, 0.3), None, 0.0, DOWN, DRAW).orientation == pytest.approx(
        quaternion(0.1, 0.2, 0.3)
    )


def test_errors_add_to_rate_acceleration_and_heading():
    models = {
        "acceleration": ErrorModel(offset=(0.1, 0.2, 0.3), noise=(0.1, 0.1, 0.1)),
        "angular_velocity": ErrorModel(offset=(0.01, 0.02, 0.03), noise=(0.1, 0.1, 0.1)),
        "heading": ErrorModel(offset=(9.0, 9.0, 0.25)),
    }
    config = CONFIG.model_copy(update=models)
    found = inertia(config, at(yaw=0.5), None, 0.0, DOWN, DRAW)
    assert found.linear_acceleration == pytest.approx(errors(models["acceleration"], DRAW, 0) - DOWN)
    assert found.angular_velocity == pytest.approx(errors(models["angular_velocity"], DRAW, 3))
    assert found.orientation == pytest.approx(quaternion(0.0, 0.0, 0.75))


def test_roll_and_pitch_have_errors_about_the_sensors_own_axes():
    config = CONFIG.model_copy(update={"tilt": ErrorModel(offset=(0.02, 0.03, 9.0))})
    found = inertia(config, at(yaw=2.0), None, 0.0, DOWN, DRAW)
    assert found.orientation == pytest.approx(
        quaternion_product(quaternion_product(quaternion_of(yaw=2.0), about(0, 0.02)), about(1, 0.03))
    )
    assert found.linear_acceleration == pytest.approx((0.0, 0.0, 9.8))


def quaternion_of(**angles):
    return np.array(quaternion(*(angles.get(name, 0.0) for name in ("roll", "pitch", "yaw"))))


def about(axis, angle):
    angles = [0.0, 0.0, 0.0]
    angles[axis] = angle
    return np.array(quaternion(*angles))


WANDERING = CONFIG.model_copy(
    update={
        "acceleration": ErrorModel(noise=(0.1, 0.2, 0.3), drift=(0.2, 0.0, 0.1), drift_frequency=(5.0, 5.0, 5.0)),
        "angular_velocity": ErrorModel(noise=(0.01, 0.02, 0.03)),
        "heading": ErrorModel(noise=(9.0, 9.0, 0.03), drift=(9.0, 9.0, 0.04), drift_frequency=(5.0, 5.0, 5.0)),
        "tilt": ErrorModel(noise=(0.01, 0.02, 9.0)),
    }
)


def test_covariances_are_those_of_the_readings():
    """Over 4000 readings of a level unit; a variance is then known within 2.2 % (one standard deviation)."""
    place = at(yaw=0.5)
    found = [inertia(WANDERING, place, None, 0.0, DOWN, Draw(1, "a", "imu", k, 15.0)) for k in range(4000)]
    turns = [rotation_vector(quaternion_product(conjugate(place.orientation), one.orientation)) for one in found]
    stated = found[0]
    for covariance, wrong in (
        (stated.orientation_covariance, turns),
        (stated.angular_velocity_covariance, [one.angular_velocity for one in found]),
        (stated.linear_acceleration_covariance, [one.linear_acceleration for one in found]),
    ):
        size = np.sqrt(np.diag(np.reshape(covariance, (3, 3))))
        assert np.cov(np.transpose(wrong)) / np.outer(size, size) == pytest.approx(np.eye(3), abs=0.1)


def test_a_unit_without_errors_has_covariances_of_zero():
    found = inertia(CONFIG, at(), None, 0.0, DOWN, DRAW)
    assert found.orientation_covariance == (0.0,) * 9
    assert found.angular_velocity_covariance == found.linear_acceleration_covariance == (0.0,) * 9
