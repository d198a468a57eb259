import math
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.control.acoustics import (
    _BEACON_ACCELERATION,
    ANGLE_NOISE,
    RANGE_NOISE,
    MovingBeacon,
    StillBeacon,
    sound_bearing,
)
from vrx_mj.control.navigation import Estimate


def estimate(x, y, heading=0.0, z=0.0):
    c, s = math.cos(heading), math.sin(heading)
    return Estimate(x, y, z, heading, 0.0, 0.0, 0.0, np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def sound_of(place, seen, rng=None):
    """What VRX's receiver says of a beacon at a place (3,)."""
    away = seen.rotation.T @ (np.array(place) - (seen.x, seen.y, seen.z))
    noise = rng.normal(size=3) * (RANGE_NOISE, ANGLE_NOISE, ANGLE_NOISE) if rng else np.zeros(3)
    return SimpleNamespace(
        range=float(np.linalg.norm(away)) + noise[0],
        bearing=math.atan2(away[1], away[0]) + noise[1],
        elevation=math.atan2(away[2], math.hypot(away[0], away[1])) + noise[2],
    )


def test_a_sound_without_noise_is_where_the_beacon_is():
    seen = estimate(3.0, 4.0, heading=2.0, z=0.1)
    found = sound_bearing(sound_of((20.0, -10.0, -2.0), seen), seen, 0.0)
    assert found.position + found.range * found.direction == pytest.approx((20.0, -10.0, -2.0))


def test_a_late_sound_was_heard_where_the_boat_was():
    moving = Estimate(10.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, np.eye(3))
    assert sound_bearing(sound_of((50.0, 0.0, 0.0), moving), moving, 0.1).position == pytest.approx((9.8, 0.0, 0.0))


def test_a_still_beacon_without_noise_is_found_at_once():
    beacon, seen = StillBeacon(), estimate(0.0, 0.0)
    beacon.update(sound_bearing(sound_of((30.0, 40.0, -2.0), seen), seen, 0.0))
    assert beacon.place == pytest.approx((30.0, 40.0), abs=0.2)  # what is known of its depth pulls a little


def test_a_still_beacon_is_where_the_least_squares_are():
    """Of three sounds, each of 3 m along its direction and 1 % of the distance across it, and of 1 m +- 1.5 m deep."""
    beacon, rng, rows, sides = StillBeacon(), np.random.default_rng(3), [np.eye(3)[2:] / 1.5], [[-1.0 / 1.5]]
    for x, y in ((0.0, 0.0), (8.0, -3.0), (15.0, 2.0)):
        seen = estimate(x, y, heading=0.3)
        sound = sound_bearing(sound_of((30.0, 20.0, -4.0), seen, rng), seen, 0.0)
        distance = math.hypot(*(beacon.place - sound.position[:2])) if beacon.place else sound.range
        axes = np.linalg.svd(sound.direction[None])[2] / np.array([[3.0], [0.01 * distance], [0.01 * distance]])
        rows.append(axes)
        sides.append(axes @ (sound.position + sound.range * sound.direction))
        beacon.update(sound)
        best = np.linalg.lstsq(np.concatenate(rows), np.concatenate(sides), rcond=None)[0]
        assert beacon.place == pytest.approx(best[:2], abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_a_way_to_a_still_beacon_sharpens_its_place(seed):
    rng, beacon, place = np.random.default_rng(seed), StillBeacon(), (40.0, 20.0, -2.0)
    for step in range(30):
        seen = estimate(step * 1.1, 0.0, heading=0.1 * step)
        beacon.update(sound_bearing(sound_of(place, seen, rng), seen, 0.0))
    assert math.dist(beacon.place, place[:2]) < 0.7  # five times the 0.13 m of 30 crossing bearings of 1 % of 25 m


@pytest.mark.parametrize("height", [2.0, -2.0])
def test_near_by_the_elevation_tells_the_distance(height):
    beacon, seen = MovingBeacon(), estimate(0.0, 0.0)
    sound = sound_of((8.0, 0.0, height), seen)
    sound.range += 5.0  # of no weight beside the angle
    beacon.update(sound_bearing(sound, seen, 0.0), 0.0)
    assert beacon.at(0.0)[0] == pytest.approx(8.0, abs=0.15)


@pytest.mark.parametrize("seed", range(5))
def test_a_moving_beacon_is_followed_with_its_velocity(seed):
    rng, beacon, found = np.random.default_rng(seed), MovingBeacon(), []
    for t in range(60):
        place = (0.6 * t, 10.0 - 0.3 * t, 2.0)
        seen = estimate(place[0] - 6.0, place[1] + 3.0, heading=0.05 * t)
        beacon.update(sound_bearing(sound_of(place, seen, rng), seen, 0.0), float(t))
        found.append(np.array(beacon.at(float(t))) - (*place[:2], 0.6, -0.3))
    off = np.array(found[20:])
    assert np.hypot(off[:, 0], off[:, 1]).mean() < 0.6  # a sound alone: 0.3 m by its elevation, and outliers
    assert np.abs(off[:, 2:].mean(axis=0)).max() < 0.2  # single ones are off by up to SWERVE


def test_nothing_is_known_before_the_first_sound():
    assert StillBeacon().place is None
    assert MovingBeacon().at(3.0) is None


def test_a_late_sound_was_heard_astern_of_the_boat_whatever_its_course():
    moving = Estimate(10.0, 5.0, 0.0, 0.0, 2.0, -3.0, 0.0, np.eye(3))
    assert sound_bearing(sound_of((50.0, 0.0, 0.0), moving), moving, 0.1).position == pytest.approx((9.8, 5.3, 0.0))


def test_a_sound_weighs_by_its_noise_along_and_across():
    """Information is one over the variance: of ranges ahead, of angles times the distance aside."""
    beacon, seen = StillBeacon(), estimate(0.0, 0.0)
    beacon.update(sound_bearing(sound_of((100.0, 0.0, 0.0), seen), seen, 0.0))
    assert beacon._information[0, 0] == pytest.approx(RANGE_NOISE**-2)
    assert beacon._information[1, 1] == pytest.approx((100.0 * ANGLE_NOISE) ** -2)


def test_a_moving_beacon_blurs_as_by_white_acceleration():
    """Closed form of what is integrated once and twice, and as much in parts as at once."""

    def blurred(*intervals):
        beacon = MovingBeacon()
        beacon._covariance = np.zeros((4, 4))
        for interval in intervals:
            beacon._carry_on(np.zeros(4), interval)
        return beacon._covariance

    place, both, velocity = (_BEACON_ACCELERATION**2 * part for part in (1.5**3 / 3.0, 1.5**2 / 2.0, 1.5))
    assert blurred(1.5) == pytest.approx(np.kron([[place, both], [both, velocity]], np.eye(2)))
    assert blurred(0.3, 1.2) == pytest.approx(blurred(1.5))
