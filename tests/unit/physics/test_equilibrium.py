"""Where a hull floats at rest: on a calm by Archimedes' law, on a long slope of water parallel to it."""

import math

import numpy as np
import pytest

from unit.physics.rows import sea, table
from vrx_mj.model.tables import HULL, STATION, VESSEL, WAVE
from vrx_mj.physics.equilibrium import at_rest, settle
from vrx_mj.physics.hydrostatics import greatest_lift, hydrostatics, section_area

RADIUS, LENGTH, RHO, G = 0.2, 1.0, 1000.0, 9.8
CALM, SEA_ROW = sea()
PLACES = [(x, y) for x in (-1.5, -0.5, 0.5, 1.5) for y in (-0.8, 0.8)]
LIFT = len(PLACES) * LENGTH * RHO * G


def hull():
    """Eight pieces of half cylinders, with keels at the height of the origin."""
    stations = np.zeros(len(PLACES), STATION)
    stations["position"][:, :2], stations["radius"], stations["length"] = PLACES, RADIUS, LENGTH
    rows = np.zeros(1, HULL)
    rows["station_count"], rows["density"], rows["gravity"] = len(PLACES), RHO, G
    return rows[0], stations


def settled(weight, waves=CALM, com=(0.0, 0.0, 0.1), pose=(0, 0, 0, 0, 0, 0.7), t=0.0):
    found = np.array(pose, float)
    return settle(*hull(), np.zeros(0, VESSEL), None, waves, SEA_ROW, weight, np.array(com), found, t), found


@pytest.mark.parametrize("depth", [0.02, 0.1, 0.18])
def test_on_a_calm_the_displaced_water_weighs_what_the_boat_does(depth):
    floats, pose = settled(section_area(RADIUS, depth) * LIFT)
    assert floats
    np.testing.assert_allclose(pose, [0, 0, -depth, 0, 0, 0.7], atol=1e-6)


def test_more_than_all_of_its_volume_cannot_be_carried():
    assert greatest_lift(*hull()) == pytest.approx(0.5 * math.pi * RADIUS**2 * LIFT)
    assert settled(0.99 * greatest_lift(*hull()))[0]
    assert not settled(1.01 * greatest_lift(*hull()))[0]


def test_a_weight_beside_the_middle_is_carried_where_it_is():
    """The lift's torque about the centre of mass is none: an independent balance of `hydrostatics`."""
    weight, com = section_area(RADIUS, 0.08) * LIFT, np.array([0.2, -0.05, 0.1])
    floats, pose = settled(weight, com=com)
    assert floats
    assert pose[4] > 0.005  # bow down
    assert pose[3] > 0.001  # and to starboard
    lift = hydrostatics(*hull(), CALM, SEA_ROW, at_rest(*pose), 0.0)
    turn = at_rest(*pose)
    lever = np.array([turn.r00, turn.r10]) * com[0] + np.array([turn.r01, turn.r11]) * com[1]
    lever += np.array([turn.r02, turn.r12]) * com[2]
    np.testing.assert_allclose([lift.fz, lift.tx, lift.ty], [weight, lever[1] * weight, -lever[0] * weight], atol=1e-3)


def test_on_a_long_wave_a_boat_lies_along_its_slope():
    """At a quarter of a wave 400 m long and 2 m high the surface falls by k a towards east."""
    k = 2 * math.pi / 400
    wave = {"amplitude": 1.0, "wavenumber": k, "frequency": 1.0, "direction": (1.0, 0.0), "steepness": 0.0,
            "orbital": 1.0, "phase": math.pi / 2}  # fmt: skip
    weight = section_area(RADIUS, 0.1) * LIFT
    floats, pose = settled(weight, waves=table(WAVE, [wave]), com=(0, 0, 0), pose=(0, 0, -0.1, 0, 0, 0))
    assert floats
    assert pose[4] == pytest.approx(math.atan(k), rel=1e-3)  # bow down, eastwards
    assert pose[2] == pytest.approx(-0.1, abs=1e-4)
