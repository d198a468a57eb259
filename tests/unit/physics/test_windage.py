"""The wind's load on a boat by its areas: against Fossen's and Blendermann's formulas."""

import math

import numpy as np
import pytest

from unit.physics.rows import hull, in_body_axes, moving
from vrx_mj.model import tables
from vrx_mj.model.tables import table_of
from vrx_mj.physics.tables import MARINE
from vrx_mj.physics.wind import (
    BLENDERMANN,
    Areas,
    Superstructure,
    blendermann_curve,
    isherwood_curve,
    three_number_curve,
    wind_at_hull,
    wind_on_hull,
    windage_load,
    windage_rows,
)  # fmt: skip

AREAS = Areas(frontal=2.0, lateral=5.0, length=4.9, height=0.6)
HALF = 0.5 * 1.225


def boat(curve, **changes):
    rows = table_of(tables.WINDAGE, windage_rows(curve, AREAS))
    own = {"profile": MARINE, "windage_count": len(rows), "windage_height": AREAS.height}
    return hull(link_com=(0.0, 0.0, 0.0), **own | changes), rows


def from_angle(degrees, speed=10.0):
    """Wind that comes from an angle off the bow, counter-clockwise, of a boat that heads east."""
    angle = math.radians(degrees)
    return -speed * math.cos(angle), -speed * math.sin(angle)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 77.7, 90.0, 120.0, 180.0, -30.0, -135.0])
def test_three_numbers_are_fossen_s(degrees):
    """His y is to starboard and his z down: signs of sway and yaw change."""
    load = windage_load(*boat(three_number_curve(0.6, 0.9, 0.1)), moving(), from_angle(degrees))
    g, q = math.radians(degrees), HALF * 100.0
    expected = (
        -q * 2.0 * 0.6 * math.cos(g), -q * 5.0 * 0.9 * math.sin(g), -q * 5.0 * 4.9 * 0.1 * math.sin(2.0 * g),
    )  # fmt: skip
    assert (load.fx, load.fy, load.tz) == pytest.approx(expected, rel=1e-4, abs=0.02)


@pytest.mark.parametrize("degrees", [20.0, 90.0, 151.0])
def test_a_boat_alike_on_both_sides_has_mirrored_loads(degrees):
    own = boat(blendermann_curve(BLENDERMANN["speed_boat"], AREAS))
    port, starboard = (np.array(windage_load(*own, moving(), from_angle(s * degrees))) for s in (1.0, -1.0))
    assert starboard == pytest.approx(port * [1, -1, 1, -1, 1, -1])


def test_a_merchant_ship_is_isherwood_s():
    """His formulas by hand: 2 A_L/L^2 = .2, 2 A_F/B^2 = 1.5, L/B = 5, S/L = 1.4, C/L = .45, M = 2, A_SS/A_L = .4."""
    areas = Areas(frontal=300.0, lateral=1000.0, length=100.0, height=8.0)
    curve = isherwood_curve(Superstructure(20.0, 140.0, 400.0, 2), areas, offset=5.0)
    assert [math.degrees(row[0]) for row in curve] == pytest.approx(range(0, 190, 10))
    found = {round(math.degrees(angle)): row for angle, *row in curve}
    assert found[0] == pytest.approx([-(2.152 - 5.0 * 0.2 + 0.243 * 1.5 - 0.164 * 5.0), 0.0, 0.0])
    assert found[90] == pytest.approx([-0.0452, 0.799, 0.0341 - 0.799 * 0.05])
    assert found[130] == pytest.approx([0.227, 0.774, -0.07268 - 0.774 * 0.05])
    assert found[180][1:] == [0.0, 0.0]


def test_isherwood_s_moment_is_about_amidships():
    """A force at the lateral area's centre with the moment about it is the same as his force and moment amidships."""
    areas = Areas(frontal=300.0, lateral=1000.0, length=100.0, height=8.0)
    curve = isherwood_curve(Superstructure(20.0, 140.0, 400.0, 2), areas, offset=5.0)
    rows = windage_rows([(angle, cx, cy, 1.0, cn) for angle, cx, cy, cn in curve], areas)
    own = hull(link_com=(0.0, 0.0, 0.0), profile=MARINE, windage_count=19, windage_height=8.0, windage_offset=5.0)
    load = windage_load(own, table_of(tables.WINDAGE, rows), moving(), from_angle(90.0))
    assert load.fy == pytest.approx(-HALF * 100.0 * 1000.0 * 0.799)
    assert load.tz == pytest.approx(-HALF * 100.0 * 1000.0 * 100.0 * 0.0341)


@pytest.mark.parametrize("vessel", BLENDERMANN)
def test_types_of_vessels_are_blendermann_s(vessel):
    """CX, CY, CK and CN by a second hand, at whole degrees, where the straight lines have their ends."""
    side, bow, stern, delta, kappa = BLENDERMANN[vessel]
    own = boat(blendermann_curve(BLENDERMANN[vessel], AREAS))
    for degrees in (0, 15, 45, 90, 91, 135, 180):
        g, q = math.radians(degrees), HALF * 100.0
        axial = np.where(degrees <= 90, bow, stern)
        d = 1.0 - 0.5 * delta * (1.0 - axial * 2.0 / 5.0 / side) * np.sin(2.0 * g) ** 2
        cx, cy = -axial * np.cos(g) / d, side * np.sin(g) / d
        load = windage_load(*own, moving(), from_angle(degrees))
        assert load.fx == pytest.approx(q * 2.0 * cx, abs=1e-9)
        assert load.fy == pytest.approx(-q * 5.0 * cy, abs=1e-9)
        assert load.tx == pytest.approx(kappa * 0.6 * q * 5.0 * cy, abs=1e-9)  # the mast goes to lee
        assert load.ty == pytest.approx(0.6 * load.fx, abs=1e-9)
        assert load.tz == pytest.approx(q * 5.0 * 4.9 * 0.18 * (g - 0.5 * math.pi) * cy, abs=1e-9)


def test_their_numbers_are_those_of_fossen_s_table():
    """The sums of its columns, CD_t to kappa (Fossen 2021, table 10.1)."""
    assert np.sum([*BLENDERMANN.values()], axis=0) == pytest.approx([14.65, 10.35, 10.525, 9.0, 24.8])


def test_a_curve_has_straight_lines():
    curve = [(0.0, -0.5, 0.0, 1.0, 0.0), (math.pi / 2, 0.1, 0.8, 1.0, 0.0), (math.pi, 0.6, 0.0, 1.0, 0.0)]
    load = windage_load(*boat(curve), moving(), from_angle(45.0))
    assert (load.fx, load.fy) == pytest.approx((HALF * 100.0 * 2.0 * -0.2, -HALF * 100.0 * 5.0 * 0.4))


def test_the_wind_acts_at_the_centre_of_the_area_on_a_turned_boat():
    own = boat(three_number_curve(0.6, 0.9, 0.0), windage_offset=0.5)
    body = moving(angles=(0.0, 0.0, 0.7))
    load = in_body_axes(body, windage_load(*own, body, (-10.0 * math.sin(0.7), 10.0 * math.cos(0.7))))
    force = HALF * 100.0 * 5.0 * 0.9
    assert load == pytest.approx([0, force, 0, -0.6 * force, 0, 0.5 * force], rel=1e-6, abs=1e-9)


def test_it_is_the_apparent_wind_at_that_centre():
    own = boat(three_number_curve(0.6, 0.9, 0.1))
    assert windage_load(*own, moving(velocity=(3, 4, 0, 0, 0, 0)), (3.0, 4.0)) == (0.0,) * 6
    rolling = windage_load(*own, moving(velocity=(0, 0, 0, 2.0, 0, 0)), (0.0, 0.0))
    assert rolling.fy == pytest.approx(HALF * 5.0 * 0.9 * 1.2**2)  # the centre goes to starboard
    assert rolling.tx < 0.0
    own = boat(three_number_curve(0.6, 0.9, 0.1), windage_offset=1.0)
    yawing = windage_load(*own, moving(velocity=(0, 0, 0, 0, 0, 1)), (0.0, 0.0))
    assert yawing.tz < 0.0


def test_hulls_take_the_wind_of_their_height():
    air = np.ones(1, tables.AIR)
    air["height"], air["exponent"], air["roughness"] = 10.0, 0.11, 0.0
    own, rows = boat(three_number_curve(0.6, 0.9, 0.1))
    here = wind_at_hull(own, air, (10.0, 0.0))
    assert here == pytest.approx((10.0 * 0.06**0.11, 0.0))
    assert wind_on_hull(own, rows, moving(), here) == windage_load(own, rows, moving(), here)
    assert wind_at_hull(hull(), air, (10.0, 0.0)) == (10.0, 0.0)
