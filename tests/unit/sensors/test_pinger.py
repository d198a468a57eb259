"""A receiver of an acoustic beacon: geometry and noise."""

import math

import numpy as np
import pytest

from vrx_mj.config.sensors import PingerConfig
from vrx_mj.frames import quaternion, rotation
from vrx_mj.sensors.errors import Draw
from vrx_mj.sensors.places import Place
from vrx_mj.sensors.registry import sound

EXACT = PingerConfig(name="pinger", link="pinger", range_noise=0.0, bearing_noise=0.0, elevation_noise=0.0)
NOISY = PingerConfig(name="pinger", link="pinger")
DRAW = Draw(1, "a", "pinger", 3, 1.0)


def at(*position, roll=0.0, pitch=0.0, yaw=0.0):
    turn, attitude = np.array(rotation(roll, pitch, yaw)), np.array(quaternion(roll, pitch, yaw))
    return Place(np.array(position, float), turn, attitude, np.zeros(3), np.zeros(3))


def heard(config, place, beacon, draw=DRAW):
    found = sound(config, place, np.array(beacon, float), draw)
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
