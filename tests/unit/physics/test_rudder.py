"""Rudders: the MMG normal force, and the race of a propeller."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import moving, thruster
from vrx_mj.physics.tables import RUDDER
from vrx_mj.physics.thrust import normal_slope, race_speed, rudder_force

AREA, SLOPE, DENSITY, DISC = 0.02, normal_slope(2.0), 1000.0, 0.03
CENTER = (-1.0, 0.0, -0.1)


def rudder(**changes):
    """A blade 1 m behind the origin, its force at the hinge."""
    row = {"mapping": RUDDER, "position": CENTER, "propeller": (0.0, 0.0, 0.0), "direction": (0.0, 1.0, 0.0),
           "area": AREA, "slope": SLOPE, "density": DENSITY, "race_area": DISC}  # fmt: skip
    return thruster(**row | changes)


def force(speed, angle, thrust=0.0, **changes):
    return rudder_force(rudder(**changes), moving(velocity=speed), angle, thrust)


def test_fujii_s_slope_is_that_of_the_mmg_paper():
    assert normal_slope(1.827) == pytest.approx(2.747, abs=1e-3)  # KVLCC2: Yasukawa and Yoshimura, table 3


@pytest.mark.parametrize(("speed", "angle"), [(2.0, 0.2), (2.0, -0.5), (0.7, 0.61), (-1.0, 0.3)])
def test_the_normal_force_is_that_of_the_mmg_method(speed, angle):
    attack = angle if speed > 0 else angle - math.pi
    expected = 0.5 * DENSITY * AREA * speed**2 * SLOPE * math.sin(attack)
    assert force((speed, 0, 0, 0, 0, 0), angle) == pytest.approx(expected, rel=1e-12)


def test_a_blade_along_the_flow_feels_nothing():
    drift = math.atan2(0.3, 1.5)
    assert force((1.5, 0.3, 0, 0, 0, 0), drift) == pytest.approx(0.0, abs=1e-12)


def test_turning_moves_the_blade_through_the_water():
    rate = 0.4  # to port: 1 m behind the origin the water comes from port
    assert force((2.0, 0, 0, 0, 0, rate), 0.0) == pytest.approx(force((2.0, -rate, 0, 0, 0, 0), 0.0))
    assert force((2.0, 0, 0, 0, 0, rate), 0.0) > 0  # and pushes the stern to port: turning is damped


@given(speed=st.floats(-3, 3), sway=st.floats(-2, 2), angle=st.floats(-0.7, 0.7))
def test_water_takes_energy_and_gives_none(speed, sway, angle):
    normal = np.array([-math.sin(angle), math.cos(angle)])
    push = force((speed, sway, 0, 0, 0, 0), angle) * normal
    assert push @ (speed, sway) <= 1e-9


@given(speed=st.floats(0, 3), angle=st.floats(-0.7, 0.7))
def test_port_and_starboard_are_mirror_images(speed, angle):
    assert force((speed, 0, 0, 0, 0, 0), angle) == -force((speed, 0, 0, 0, 0, 0), -angle)


def test_the_race_obeys_momentum_theory():
    thrust, inflow = 60.0, 1.2
    race = race_speed(inflow, thrust, DENSITY, DISC)
    mean = 0.5 * (inflow + race)  # through the disc: Froude
    assert DENSITY * DISC * mean * (race - inflow) == pytest.approx(thrust)
    assert race_speed(0.0, thrust, DENSITY, DISC) == pytest.approx(math.sqrt(2 * thrust / (DENSITY * DISC)))


@pytest.mark.parametrize(("inflow", "thrust"), [(1.0, 0.0), (1.0, -20.0), (-0.5, 30.0)])
def test_no_race_where_the_propeller_leaves_none(inflow, thrust):
    assert race_speed(inflow, thrust, DENSITY, DISC) == inflow


def test_a_boat_at_rest_steers_in_its_race():
    still = (0.0,) * 6
    assert force(still, 0.3, 60.0) == 0.0
    full = force(still, 0.3, 60.0, race=0, race_share=1.0)
    assert full == pytest.approx(0.5 * DENSITY * AREA * SLOPE * (2 * 60.0 / (DENSITY * DISC)) * math.sin(0.3))
    assert force(still, 0.3, 60.0, race=0, race_share=0.4) == pytest.approx(0.4 * full)
