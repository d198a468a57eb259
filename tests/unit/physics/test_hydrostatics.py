"""Lift on a hull's stations."""

import math
from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import (
    FORCE_ERROR,
    hull,
    hull_of,
    in_body_axes,
    lines,
    lines_of,
    matrix,
    moving,
    moving_row,
    oracle,
    sea,
    sea_of,
)
from vrx_mj.physics.drag import drag
from vrx_mj.physics.hydrostatics import hydrostatics, section_area, station_force
from vrx_mj.physics.motion import rotate
from vrx_mj.physics.waves import elevation, pms_components, ramp, surface_height

SECTIONS = [  # depth, area, force per station: VRX's formula, computed by other code
    (-0.1, 0.0, 0.0),
    (0.0, 0.0, 0.0),
    (0.02, 0.00242647170, 58.2203911),
    (0.05, 0.00937955596, 225.051632),
    (0.10, 0.0254919932, 611.650990),
    (0.15, 0.0448240710, 1075.50191),
    (0.213, 0.0712654586, 1709.93252),
    (0.5, 0.0712654586, 1709.93252),
]
NINE_DIGITS = 6e-9
POSE = ((-532.0, 162.0, -0.1), (0.02, -0.03, 1.0))


def level_lift(depth):
    return hydrostatics(hull(), lines(), *sea_of("none"), moving((0, 0, -depth)), 1.0)


@pytest.mark.parametrize(("depth", "area", "force"), SECTIONS)
def test_a_station_lifts_with_its_wet_section(depth, area, force):
    assert section_area(0.213, depth) == pytest.approx(area, rel=NINE_DIGITS)
    assert station_force(hull(), lines()[0], depth) == pytest.approx(force, rel=NINE_DIGITS)


def test_half_a_circle_is_the_most():
    assert section_area(0.3, 0.3) == pytest.approx(math.pi * 0.3**2 / 2)
    assert section_area(0.3, 0.3 * (1 - 1e-12)) == pytest.approx(section_area(0.3, 0.3))


@given(depth=st.floats(0, 0.3), sink=st.floats(0, 0.1))
def test_sinking_deeper_never_loses_lift(depth, sink):
    more, less = level_lift(depth + sink).fz, level_lift(depth).fz
    assert more >= less - 1e-9  # [N], rounding of a lift of 7e3


@pytest.mark.parametrize(
    ("mass", "draft"), [(227, 0.0935196136), (258, 0.102350633), (289, 0.110927933), (298.7847, 0.113589837)]
)
def test_a_level_boat_floats_at_vrx_s_draft(mass, draft):
    assert level_lift(draft).fz == pytest.approx(mass * 9.8, rel=1e-7)


def test_the_trim_of_a_boat_at_rest_balances_its_weight():
    """Two thrusters aft, calm water: the whole boat's centre of mass is behind and above that of its link."""
    body = moving((0, 0, -0.101863530), (0, -0.0138729080, 0))
    wrench = hydrostatics(hull(), lines(), *sea_of("none"), body, 1.0)
    lever = matrix(body) @ (np.array([0, 0, 0.12422907]) - (-0.28629927, 0, 0.14556580))
    assert wrench.fz == pytest.approx(258 * 9.8, rel=1e-6)
    assert np.array(wrench[3:]) + np.cross(lever, wrench[:3]) == pytest.approx([0, 0, 0], abs=2e-3)


def test_waves_lift_each_station_as_they_reach_it():
    water = sea(pms_components(3, 1.5, 0.4, 0.0, 0.1, 5, (1, 0)), tau=2.0)
    body = moving(*POSE)
    wrench = hydrostatics(hull(), lines(), *water, body, 20.0)
    assert wrench.fz == pytest.approx(1897.25115, rel=NINE_DIGITS)
    assert wrench[3:] == pytest.approx((-1695.08920, 373.920713, 0), rel=NINE_DIGITS)
    expected = (-600.946646, 1628.43359, -14.5355977)
    assert in_body_axes(body, wrench)[3:] == pytest.approx(expected, rel=NINE_DIGITS)


def test_a_station_in_a_trough_hangs_dry():
    waves = pms_components(3, 2.5, 0.4, 0.0, 0.7, 6, (0.4, 0.85))
    water = sea(waves, tau=2.0)
    wrench = hydrostatics(hull(), lines(), *water, moving(*POSE), 20.0)
    assert wrench.fz == pytest.approx(2963.17746, rel=NINE_DIGITS)
    assert wrench[3:] == pytest.approx((-3348.83810, 1499.12413, 0), rel=NINE_DIGITS)


@pytest.mark.parametrize("stations", [1, 2, 3, 10])
def test_lift_is_the_sum_over_stations(stations):
    """A second, slow implementation; the hull's and the sea's levels both count."""
    boat, (waves, water) = hull(station_count=2 * stations, level=0.05), sea_of("W04")
    floats = lines(count=stations)
    water["level"] = -0.02
    body = moving((3.0, -4.0, -0.1), (0.1, -0.05, 2.0))
    total = np.zeros(6)
    for side in (-1, 1):
        for j in range(stations):
            lever = matrix(body) @ (((j + 0.5) / stations - 0.5) * 4.9, side * 1.2, 0)
            at = np.array(body[:3]) + lever
            force = station_force(boat, floats[0], 0.05 + surface_height(waves, water, at[0], at[1], 33.0) - at[2])
            total += (*(0, 0, force), *np.cross(lever, (0, 0, force)))
    assert hydrostatics(boat, floats, waves, water, body, 33.0) == pytest.approx(total, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("count", range(10))
@pytest.mark.parametrize("start", [0, 3])
def test_any_number_of_stations_is_summed_in_their_order(count, start):
    """To the bit: four of them read a wave at once."""
    (waves, water), body = sea_of("W04"), moving((3.0, -4.0, -0.1), (0.1, -0.05, 2.0))
    floats = np.concatenate([lines(count=4), lines(count=2)])
    fz, tx, ty = 0.0, 0.0, 0.0
    for station in floats[start : start + count]:
        lever = rotate(body, station["position"])
        height = ramp(water, 33.0) * elevation(waves, body.x + lever[0], body.y + lever[1], 33.0)
        force = station_force(hull(), station, water["level"] + hull()["level"] - body.z + height - lever[2])
        fz, tx, ty = fz + force, tx + lever[1] * force, ty - lever[0] * force
    boat = hull(station_start=start, station_count=min(count, len(floats) - start))
    assert hydrostatics(boat, floats, waves, water, body, 33.0) == (0.0, 0.0, fz, tx, ty, 0.0)


@pytest.mark.parametrize("name", ["wamv", "dynA", "wamv_am1"])
def test_the_wrench_on_a_hull_is_vrx_s(name):
    """Lift, drag, and VRX's lagged force of added mass, which the loop replaces by inertia."""
    boat = hull_of(name)
    for row in (row for row in oracle("dynamics_wrench") if row["dyn_set"] == name):
        body = moving_row(row)
        now = np.array(body[12:])
        before = np.array([row[f"{axis}_prev"] for axis in "uvwpqr"])
        lift = hydrostatics(boat, lines_of(name), *sea_of(row["wave_set"]), body, row["t_s"])
        hydro = in_body_axes(body, drag(boat, body)) - boat["added_mass"] * (now - before) / row["dt_s"]
        total = in_body_axes(body, lift) + hydro
        axes = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
        assert lift.fz == pytest.approx(row["buoy_Fz_w"], rel=1e-6, abs=FORCE_ERROR), row["case"]
        assert hydro == pytest.approx([row[f"hydro_{axis}_b"] for axis in axes], rel=1e-6, abs=FORCE_ERROR)
        assert total == pytest.approx([row[f"{axis}_b"] for axis in axes], rel=1e-6, abs=FORCE_ERROR), row["case"]


def test_the_lift_of_every_station_is_vrx_s():
    points = defaultdict(list)
    for point in oracle("dynamics_points"):
        points[point["case"]].append(point)
    for row in oracle("dynamics_wrench"):
        boat, (waves, water), body = hull_of(row["dyn_set"]), sea_of(row["wave_set"]), moving_row(row)
        for point in points[row["case"]]:
            at = np.array(body[:3]) + matrix(body) @ (point["px_m"], point["py_m"], point["pz_m"])
            depth = boat["level"] + surface_height(waves, water, at[0], at[1], row["t_s"]) - at[2]
            force = station_force(boat, lines_of(row["dyn_set"])[0], depth)
            assert force == pytest.approx(point["fz_N"], rel=1e-6, abs=FORCE_ERROR)
