"""The wind on sails: closed forms at fixed angles, mirror images, the apparent wind alone, and the sheet."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import moving, table, thruster
from vrx_mj.model import tables
from vrx_mj.physics.sail import boom_target, sail_curve, sail_force, wind_on_sail
from vrx_mj.physics.tables import SAIL

NO_AIR = np.zeros(0, tables.AIR)
ANGLES = st.floats(-math.pi, math.pi)
SPEEDS = st.floats(-15.0, 15.0)
AREA, DENSITY = 3.0, 1.225


def curves(rows):
    return table(tables.SAIL_CURVE, [{"angle": angle, "lift": lift, "drag": drag} for angle, lift, drag in rows])


FLAT = curves([(math.radians(a), math.sin(2 * math.radians(a)), 1 - math.cos(2 * math.radians(a)))
               for a in range(181)])  # fmt: skip
"""A plate: its force is across it, 2 sin(angle)."""
REAL = curves(sail_curve(4.0))


def sail(curve=FLAT, **changes):
    row = {
        "mapping": SAIL, "position": (0.3, 0.0, 0.5), "propeller": (-0.4, 0.0, 1.5),
        "direction": (0.0, 1.0, 0.0), "area": AREA, "density": DENSITY, "curve_count": len(curve),
        "max_angle": 1.5, "sheeted": 1,
    }  # fmt: skip
    return thruster(**row | changes)


@pytest.mark.parametrize("degrees", [1, 10, 45, 89, 90, 135, 179])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_plate_is_pushed_across_itself_to_lee(degrees, side):
    """Lift and drag of a plate are the parts of a normal force rho / 2 A V^2 2 sin(angle)."""
    meets, speed = math.radians(degrees), 7.0
    flow = (-speed * math.cos(meets), side * speed * math.sin(meets))
    along, across = sail_force(sail(), FLAT, flow, 0.0)
    normal = 0.5 * DENSITY * AREA * speed**2 * 2.0 * math.sin(meets)
    assert across == pytest.approx(side * normal, rel=1e-9)
    assert along == pytest.approx(0.0, abs=1e-9 * normal)


@given(speed=st.floats(0.1, 20.0), angle=ANGLES, meets=ANGLES)
def test_drag_is_along_the_wind_and_lift_across_it(speed, angle, meets):
    flow = (speed * math.cos(meets), speed * math.sin(meets))
    along, across = sail_force(sail(REAL), REAL, flow, angle)
    c, s = math.cos(angle), math.sin(angle)
    force = np.array([c * along - s * across, s * along + c * across])
    unit = np.array(flow) / speed
    attack = abs(math.remainder(meets - angle - math.pi, math.tau))
    lift, drag = (np.interp(attack, REAL["angle"], REAL[name]) for name in ("lift", "drag"))
    pressure = 0.5 * DENSITY * AREA * speed**2
    assert force @ unit == pytest.approx(drag * pressure, rel=1e-9, abs=1e-9)
    assert abs(unit[0] * force[1] - unit[1] * force[0]) == pytest.approx(abs(lift) * pressure, rel=1e-9, abs=1e-9)


@given(x=SPEEDS, y=SPEEDS, angle=ANGLES)
def test_the_mirror_image_of_a_sail_has_that_of_its_force(x, y, angle):
    along, across = sail_force(sail(REAL), REAL, (x, y), angle)
    assert sail_force(sail(REAL), REAL, (x, -y), -angle) == pytest.approx((along, -across), rel=1e-12, abs=1e-12)


@given(wind=st.tuples(SPEEDS, SPEEDS), drift=st.tuples(SPEEDS, SPEEDS), heading=ANGLES, angle=ANGLES)
def test_only_the_apparent_wind_counts(wind, drift, heading, angle):
    """A wind and a boat that drifts: the same as the boat at rest in the wind less the drift (Galilei)."""
    c, s = math.cos(heading), math.sin(heading)
    velocity = (c * drift[0] + s * drift[1], c * drift[1] - s * drift[0], 0.0, 0.0, 0.0, 0.0)
    adrift = moving(angles=(0.0, 0.0, heading), velocity=velocity)
    at_rest = moving(angles=(0.0, 0.0, heading))
    less = (wind[0] - drift[0], wind[1] - drift[1])
    felt = wind_on_sail(sail(), NO_AIR, wind, adrift, angle)
    assert felt == pytest.approx(wind_on_sail(sail(), NO_AIR, less, at_rest, angle), abs=1e-9)


@given(rates=st.tuples(SPEEDS, SPEEDS, SPEEDS), angle=ANGLES)
def test_the_centre_of_effort_moves_with_the_boat(rates, angle):
    row = sail()
    felt = wind_on_sail(row, NO_AIR, (0.0, 0.0), moving(velocity=(0.0, 0.0, 0.0, *rates)), angle)
    c, s = math.cos(angle), math.sin(angle)
    place = np.array(row["position"]) + np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ row["propeller"]
    assert felt == pytest.approx(-np.cross(rates, place)[:2], abs=1e-9)


def test_the_wind_is_that_of_the_centres_height():
    air = np.zeros(1, tables.AIR)
    air["height"], air["exponent"] = 10.0, 0.11
    felt = wind_on_sail(sail(), air, (8.0, 0.0), moving(), 0.0)
    assert felt == pytest.approx((8.0 * (2.0 / 10.0) ** 0.11, 0.0))


@given(meets=ANGLES, sheet=st.floats(-2.0, 2.0), speed=st.floats(0.1, 20.0))
def test_a_sheet_lets_the_boom_stream_to_lee_as_far_as_it_goes(meets, sheet, speed):
    row = sail()
    flow = (-speed * math.cos(meets), -speed * math.sin(meets))  # where a boom at the angle `meets` streams
    target = boom_target(row, flow, 0.0, sheet)
    most = min(abs(sheet), 1.5)
    assert target == pytest.approx(min(max(meets, -most), most), abs=1e-9)
    if abs(target) < most:  # it streams, and nothing but drag is left
        along, across = sail_force(row, FLAT, flow, target)
        assert math.hypot(along, across) < 1e-3 * speed**2
    else:  # the wind presses the boom, which runs along -x, against the sheet
        assert -sail_force(row, FLAT, flow, target)[1] * target >= -1e-9


def test_in_no_wind_the_boom_stays():
    assert boom_target(sail(), (0.0, 0.0), 0.4, 1.0) == 0.4


@pytest.mark.parametrize(("command", "angle"), [(0.3, 0.3), (-0.3, -0.3), (9.0, 1.5)])
def test_without_a_sheet_the_boom_goes_to_the_angle(command, angle):
    assert boom_target(sail(sheeted=0), (-5.0, 1.0), 0.0, command) == angle


@pytest.mark.parametrize("aspect_ratio", [1.0, 4.0, 8.0])
def test_coefficients_of_an_aspect_ratio(aspect_ratio):
    """Lifting line before the stall, a plate at 90 degrees, a streaming sail at both ends."""
    rows = sail_curve(aspect_ratio)
    angles, lift, drag = np.array(rows).T
    assert np.diff(angles) == pytest.approx(math.radians(5.0))
    assert (angles[0], angles[-1]) == pytest.approx((0.0, math.pi))
    assert (lift[0], lift[-1]) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert lift[2] == pytest.approx(2 * math.pi * math.sin(angles[2]) / (1 + 2 / aspect_ratio))
    assert drag[2] == pytest.approx(0.02 + lift[2] ** 2 / (math.pi * aspect_ratio))
    assert (lift[18], drag[18]) == pytest.approx((0.0, 1.11 + 0.018 * aspect_ratio), abs=1e-12)
    assert drag.min() >= 0.02
    assert (lift[:18] >= 0.0).all()
    assert (lift[19:-1] < 0.0).all()
