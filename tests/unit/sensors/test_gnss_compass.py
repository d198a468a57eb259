"""Headings and rates of turn of two antennas, in closed form and by differences in time."""

import math

import numpy as np
import pytest

from vrx_mj.config.sensors import GnssCompassConfig
from vrx_mj.frames import compass, matrix_quaternion, quaternion_product, rotation
from vrx_mj.sensors.instruments import Draw, heading
from vrx_mj.sensors.readings import Place

QUIET = GnssCompassConfig(name="compass", link="mast", heading_noise=0.0, turn_noise=0.0)
DRAW = Draw(1, "a", "compass", 12, 10.0)


def at(turn, spin=(0.0, 0.0, 0.0)):
    turned = np.array(turn)
    return Place(np.zeros(3), turned, matrix_quaternion(turned), np.zeros(3), np.array(spin, float))


def read(turn, spin=(0.0, 0.0, 0.0), x_from_east=0.0):
    return heading(QUIET, at(turn, spin), x_from_east, DRAW)


@pytest.mark.parametrize(("yaw", "bearing"), [(0.0, 90.0), (90.0, 0.0), (180.0, 270.0), (-90.0, 180.0), (60.0, 30.0)])
def test_a_heading_is_from_east_and_a_bearing_from_north(yaw, bearing):
    found = read(rotation(0.0, 0.0, math.radians(yaw))).heading
    assert math.remainder(found - math.radians(yaw), 2 * math.pi) == pytest.approx(0.0, abs=1e-12)
    assert compass(found) == pytest.approx(bearing)


@pytest.mark.parametrize(("roll", "pitch"), [(0.4, 0.0), (0.0, 0.5), (-0.3, -0.6)])
def test_heel_and_trim_leave_the_heading_as_it_is(roll, pitch):
    assert read(rotation(roll, pitch, 2.0)).heading == pytest.approx(2.0)


def test_antennas_athwartships_have_the_heading_of_their_own_line():
    across = np.array(rotation(0.2, 0.0, 1.0)) @ rotation(0.0, 0.0, math.pi / 2)
    assert read(across).heading == pytest.approx(1.0 + math.pi / 2)


def test_in_a_turned_world_north_is_that_of_the_earth():
    assert read(rotation(0.0, 0.0, 3.0), x_from_east=0.7).heading == pytest.approx(3.7 - 2 * math.pi)


def test_a_level_boat_turns_as_it_spins_to_port():
    assert read(rotation(0.0, 0.0, 1.0), (0.3, -0.2, 0.5)).rate_of_turn == pytest.approx(0.5)


@pytest.mark.parametrize("attitude", [(0.4, 0.0, 0.3), (0.1, -0.5, -2.0), (-0.7, 0.6, 1.1)])
def test_the_rate_of_turn_is_the_rate_of_the_heading(attitude):
    """Central differences over 2e-4 s; the spin is (3,) in world axes, and turns the line of the antennas."""
    spin, h = np.array([0.4, -0.3, 0.6]), 1e-4
    found = []
    for t in (-h, h):
        size = 0.5 * t * np.linalg.norm(spin)
        turn = np.array([math.cos(size), *(math.sin(size) * spin / np.linalg.norm(spin))])
        whole = quaternion_product(turn, matrix_quaternion(np.array(rotation(*attitude))))
        w, x, y, z = whole
        line = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z)])
        found.append(math.atan2(line[1], line[0]))
    assert read(rotation(*attitude), spin).rate_of_turn == pytest.approx((found[1] - found[0]) / (2 * h), abs=1e-7)


def test_a_line_that_points_straight_up_has_a_rate_all_the_same():
    assert math.isfinite(read(((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)), (1.0, 1.0, 1.0)).rate_of_turn)


def test_noise_has_the_variances_that_are_stated():
    config = GnssCompassConfig(name="compass", link="mast", heading_noise=0.01, turn_noise=0.02)
    readings = [heading(config, at(np.eye(3)), 0.0, Draw(1, "a", "compass", index, 10.0)) for index in range(4000)]
    assert (readings[0].heading_variance, readings[0].rate_of_turn_variance) == pytest.approx((1e-4, 4e-4))
    assert np.std([one.heading for one in readings]) == pytest.approx(0.01, rel=4 / 8000**0.5)  # 4 standard errors
    assert np.std([one.rate_of_turn for one in readings]) == pytest.approx(0.02, rel=4 / 8000**0.5)
