"""Apparent wind at a sensor of a boat that sails, turns, rolls and heels, in closed form."""

import math

import numpy as np
import pytest

from vrx_mj.config.sensors import AnemometerConfig
from vrx_mj.frames import quaternion
from vrx_mj.sensors.instruments import Draw, apparent_wind, wind_reading
from vrx_mj.sensors.readings import Mount, place_of_mount

QUIET = AnemometerConfig(name="wind", link="mast", noise=0.0)
DRAW = Draw(1, "a", "wind", 12, 10.0)
LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
HEEL = math.radians(20.0)


def felt(blows, *, at=(0.0, 0.0, 0.0), roll=0.0, pitch=0.0, yaw=0.0, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)):
    """Speed and angle at a place of a boat with a velocity (world axes) and a spin (its own) in a wind, (3,) [m/s]."""
    pose = np.array([0.0, 0.0, 0.0, *quaternion(roll, pitch, yaw)])
    place = place_of_mount(pose, np.array([*velocity, *spin]), Mount.of(at, LEVEL))
    flow = apparent_wind(lambda _time, _height: np.array(blows, float), 0.0, 0.0, place)
    found = wind_reading(QUIET, flow, DRAW)
    return found.speed, found.angle


@pytest.mark.parametrize(
    ("blows", "angle"), [((-4, 0, 0), 0.0), ((0, -4, 0), math.pi / 2), ((0, 4, 0), -math.pi / 2), ((4, 0, 0), math.pi)]
)
def test_the_angle_is_where_the_wind_comes_from_counter_clockwise_from_the_bow(blows, angle):
    speed, found = felt(blows)
    assert speed == pytest.approx(4.0)
    assert math.remainder(found - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-12)


def test_it_is_seen_from_the_boat_whatever_its_heading():
    """A bow to the north in a wind from the east feels it to starboard."""
    assert felt((-4, 0, 0), yaw=math.pi / 2) == pytest.approx((4.0, -math.pi / 2))


def test_way_ahead_draws_the_wind_ahead():
    """Wind of 4 m/s from port at 3 m/s: 5 m/s from atan(4 / 3) to port."""
    assert felt((0, -4, 0), velocity=(3, 0, 0)) == pytest.approx((5.0, math.atan2(4.0, 3.0)))


def test_on_a_bow_that_turns_the_lever_makes_wind():
    """2 m ahead and turning to port by 0.5 rad/s the sensor goes to port by 1 m/s: wind from there."""
    assert felt((0, 0, 0), at=(2, 0, 0), spin=(0, 0, 0.5)) == pytest.approx((1.0, math.pi / 2))


def test_a_masthead_that_rolls_to_starboard_feels_wind_from_there():
    assert felt((0, 0, 0), at=(0, 0, 10), spin=(0.2, 0, 0)) == pytest.approx((2.0, -math.pi / 2))


def test_a_heeled_mast_feels_less_of_a_beam_wind_and_all_of_one_ahead():
    assert felt((0, -4, 0), roll=HEEL) == pytest.approx((4.0 * math.cos(HEEL), math.pi / 2))
    assert felt((-4, 0, 0), roll=HEEL) == pytest.approx((4.0, 0.0), abs=1e-12)
    assert felt((-4, 0, 0), pitch=HEEL) == pytest.approx((4.0 * math.cos(HEEL), 0.0), abs=1e-12)


@pytest.mark.parametrize(("up", "level", "height"), [(9.0, 0.0, 9.0), (9.0, 1.5, 7.5), (-1.0, 0.0, 0.0)])
def test_the_wind_is_that_at_the_sensors_height_above_the_water(up, level, height):
    pose = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    place = place_of_mount(pose, np.zeros(6), Mount.of((0.0, 0.0, up), LEVEL))
    flow = apparent_wind(lambda time, z: np.array([time, z, 0.0]), 7.0, level, place)
    assert flow.tolist() == [7.0, height, 0.0]


def test_noise_is_on_the_velocity_along_each_axis():
    """So in a calm any angle is as likely, and in 20 m/s the angle wanders by noise / speed."""
    noisy = AnemometerConfig(name="wind", link="mast", noise=0.3)
    draws = [Draw(1, "a", "wind", index, 10.0) for index in range(4000)]
    calm = [wind_reading(noisy, np.zeros(3), draw) for draw in draws]
    ahead, port = ([one.speed * turn(one.angle) for one in calm] for turn in (math.cos, math.sin))
    for along in (ahead, port):  # 4 standard errors
        assert np.mean(along) == pytest.approx(0.0, abs=4 * 0.3 / 4000**0.5)
        assert np.std(along) == pytest.approx(0.3, rel=4 / 8000**0.5)
    assert np.corrcoef(ahead, port)[0, 1] == pytest.approx(0.0, abs=4 / 4000**0.5)
    strong = [wind_reading(noisy, np.array([-20.0, 0.0, 0.0]), draw) for draw in draws]
    assert np.std([one.angle for one in strong]) == pytest.approx(0.3 / 20.0, rel=0.05)
