"""VRX 3's part of the kernels: thrust in newtons, points of buoyancy, apparent wind, water at each element.

Figures with nine digits were worked out from VRX 3's formulas by other code.
"""

import math

import numpy as np
import pytest

from unit.physics.rows import element, floating, hull, in_body_axes, matrix, moving, sea, sea_of, table, thruster
from vrx_mj.model.tables import ELEMENT_STATE, STATION, WIND, WIND_STATE, WINDAGE
from vrx_mj.physics.drag import added_bias, added_inertia, bias_on_hull, drag, drag_on_hull
from vrx_mj.physics.flotation import flotation, water_at_elements
from vrx_mj.physics.hydrostatics import hydrostatics
from vrx_mj.physics.motion import zero_wrench
from vrx_mj.physics.tables import NEWTONS, VRX, VRX3
from vrx_mj.physics.thrust import thrust_force
from vrx_mj.physics.waves import pms_components, surface_height
from vrx_mj.physics.wind import apparent_wind_load, gust_step, wind_load, wind_on_float, wind_on_hull

NINE_DIGITS = 6e-9
MOST, LEAST = 2353.53383668, -1000.0
POINTS = [(-1.4, -1.03, 0.0), (0.6, -1.03, 0.0), (-1.4, 1.03, 0.0), (0.6, 1.03, 0.0)]
WAMV = np.array([0.5, 0.5, 0.33])
COM = (-0.003514, -0.000965, 0.255206)

NONE = table(WINDAGE, [])
"""Hulls have their coefficients."""


def boat(**changes):
    """VRX 3's WAM-V."""
    row = {
        "profile": VRX3,
        "density": 997.7735,
        "gravity": 9.8,
        "drag_linear": (100.0, 100.0, 500.0, 300.0, 900.0, 800.0),
        "drag_quadratic": (150.0, 100.0, 0.0, 600.0, 900.0, 800.0),
    }
    return hull(**row | changes)


def points(places=POINTS):
    return table(STATION, [{"position": place, "radius": 0.213, "length": 2.45} for place in places])


def pms_sea(gain=0.3, period=5.0, direction=(1.0, 0.0), tau=2.0):
    waves = pms_components(3, 1.1, 0.4, 0.0, gain, period, direction)
    return sea(waves, tau=tau)


def test_vrx_3s_waves_of_its_base_world():
    waves, water = pms_sea()
    assert waves["amplitude"] == pytest.approx([0.0363502011, 0.0392276505, 0.0385703180], rel=NINE_DIGITS)
    assert waves["frequency"] == pytest.approx([1.14239733, 1.25663706, 1.38230077], rel=NINE_DIGITS)
    assert waves["wavenumber"] == pytest.approx([0.133170577, 0.161136398, 0.194975042], rel=NINE_DIGITS)
    toward = [(0.921060994, -0.389418342), (1, 0), (0.921060994, 0.389418342)]
    assert waves["direction"] == pytest.approx(np.array(toward), rel=NINE_DIGITS)
    assert 4 * math.sqrt(np.sum(waves["amplitude"] ** 2) / 2) == pytest.approx(0.1865007, rel=2e-7)
    assert surface_height(waves, water, 10.0, 20.0, 15.0) == pytest.approx(-0.00800642400, rel=NINE_DIGITS)


@pytest.mark.parametrize(
    ("command", "force"),
    [
        (0, 0),
        (200, 200),
        (-200, -200),
        (0.5, 0.5),
        (MOST, MOST),
        (2400, MOST),
        (1e9, MOST),
        (-999, -999),
        (-1e9, LEAST),
    ],
)
def test_a_command_is_the_force_within_the_limits(command, force):
    engine = thruster(mapping=NEWTONS, max_forward=MOST, max_reverse=LEAST, max_command=MOST)
    assert thrust_force(engine, float(command)) == force


def test_a_level_boat_floats_at_vrx_3s_draft():
    lift = hydrostatics(boat(), points(), *sea_of("none"), moving((0, 0, -0.102463311)), 1.0)
    assert lift.fz == pytest.approx(258 * 9.8, rel=1e-7)


@pytest.mark.parametrize("level", [0.0, 0.1])
def test_lift_is_that_of_the_points(level):
    """A second, slow implementation in waves; points may lie anywhere, and their floats differ."""
    waves, water = pms_sea(gain=0.8, period=4.0, direction=(0.5, 0.7))
    places = [*POINTS, (0.94, 0.1, 0.111301)]
    stations = points(places)
    stations["radius"][4], stations["length"][4] = 0.165, 0.7
    body = moving((3.0, -4.0, -0.1), (0.1, -0.05, 2.0))
    force, torque = np.zeros(3), np.zeros(3)
    for place, radius, length in zip(places, [0.213] * 4 + [0.165], [2.45] * 4 + [0.7], strict=True):
        lever = matrix(body) @ place
        x, y, z = np.array(body[:3]) + lever
        h = min(max(level + surface_height(waves, water, x, y, 33.0) - z, 0.0), radius)
        area = radius**2 * math.acos((radius - h) / radius) - (radius - h) * math.sqrt(2 * radius * h - h * h)
        lift = np.array([0.0, 0.0, area * length * 9.8 * 997.7735])
        force, torque = force + lift, torque + np.cross(lever, lift)
    found = hydrostatics(boat(station_count=5, level=level), stations, waves, water, body, 33.0)
    assert found == pytest.approx([*force, *torque], rel=1e-9, abs=1e-9)  # acos loses digits near the keel line
    assert found.fz > 0


def test_drag_by_hand_at_the_links_origin():
    body = moving(velocity=(1.5, -0.4, 0.1, 0.05, -0.02, 0.3))
    expected = np.array([-487.5, 56, -50, -16.5, 18.36, -312])
    assert in_body_axes(body, drag(boat(), body)) == pytest.approx(expected, rel=1e-12)
    about_com = drag_on_hull(boat(link_com=COM), body)
    expected[3:] += np.cross(-np.array(COM), expected[:3])
    assert in_body_axes(body, about_com) == pytest.approx(expected, rel=1e-12)


def test_drag_takes_power_whatever_the_motion():
    turn = np.random.default_rng(4)
    for _ in range(200):
        body = moving(angles=turn.uniform(-1, 1, 3), velocity=turn.uniform(-3, 3, 6))
        assert in_body_axes(body, drag(boat(), body)) @ np.array(body[12:]) < 0


def test_the_surge_at_which_full_thrust_meets_drag():
    """(100 + 150 u) u = 2 T."""
    speed = (-100 + math.sqrt(100**2 + 4 * 150 * 2 * MOST)) / 300
    assert speed == pytest.approx(5.27840100, rel=NINE_DIGITS)
    assert drag(boat(), moving(velocity=(speed, 0, 0, 0, 0, 0))).fx == pytest.approx(-2 * MOST, rel=1e-12)


def test_added_mass_has_no_term_of_the_rotating_frame():
    body = moving(angles=(0.1, 0.2, 0.3), velocity=(1, 2, 3, 0.4, 0.5, 0.6))
    heavy = boat(added_mass=(10.0, 60.0, 40.0, 1.0, 2.0, 3.0))
    assert any(added_bias(heavy, body))
    assert bias_on_hull(heavy, body) == zero_wrench()
    heavy["profile"] = VRX
    assert bias_on_hull(heavy, body) == added_bias(heavy, body)
    out = np.zeros((6, 6))
    added_inertia(heavy, body, out)
    turn = matrix(body)
    np.testing.assert_allclose(out[:3, :3], turn @ np.diag([10, 60, 40]) @ turn.T, atol=1e-12)
    np.testing.assert_allclose(out[3:, 3:], np.diag([1, 2, 3]))


def test_the_wind_on_a_moving_link_by_hand():
    """5 m/s toward 120 degrees on a link that moves at (1, 0.5) m/s over ground."""
    air = (5 * math.cos(math.radians(120)), 5 * math.sin(math.radians(120)))
    still = moving(velocity=(1.0, 0.5, 0, 0, 0, 0))
    expected = (-6.125, 7.33493649, 0, 0, 0, 8.84759341)
    assert apparent_wind_load(WAMV, still, air) == pytest.approx(expected, rel=NINE_DIGITS)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0])
def test_the_wrench_of_the_wind_does_not_turn_with_the_link(yaw):
    turned = moving(angles=(0, 0, yaw))
    vx, vy = 1.0, 0.5
    along = matrix(turned).T @ (vx, vy, 0)
    sailing = moving((3, 4, 5), (0, 0, yaw), (*along, 0.1, 0.2, 0.3))
    rx, ry = 6.0 - vx, -2.0 - vy
    expected = (0.5 * rx * abs(rx), 0.5 * ry * abs(ry), 0, 0, 0, -2 * 0.33 * rx * ry)
    assert apparent_wind_load(WAMV, sailing, (6.0, -2.0)) == pytest.approx(expected, rel=1e-12)


def test_wind_damps_a_link_that_moves_with_no_air_moving():
    wrench = apparent_wind_load(WAMV, moving(velocity=(3, -1, 0, 0, 0, 0)), (0.0, 0.0))
    assert (wrench.fx, wrench.fy) == (-4.5, 0.5)


def test_wind_pushes_at_the_links_origin():
    """Of a hull and of an object; VRX classic's pushes at the centre of mass."""
    body, air = moving(angles=(0.1, 0.2, 0.7), velocity=(1, 0.5, 0, 0, 0, 0.2)), (6.0, -2.0)
    item, _ = floating([element("sphere", (0.3, 0, 0))], com=(0.1, 0.2, -2.0), wind=WAMV, profile=VRX3)
    for found, com in (
        (wind_on_hull(boat(link_com=COM), NONE, body, air), COM),
        (wind_on_float(item, body, air), item["com"]),
    ):
        plain = apparent_wind_load(WAMV, body, air)
        torque = np.array(plain[3:]) + np.cross(matrix(body) @ -np.array(com), plain[:3])
        assert found == pytest.approx([*plain[:3], *torque], rel=1e-12)
    classic = hull(wind=WAMV)
    assert wind_on_hull(classic, NONE, body, air) == wind_load(WAMV, body, air)


def test_the_first_gust_is_one_of_a_millisecond():
    def blown(first_step, dt):
        row = {"direction": (1, 0), "mean": 0, "gain": 2, "time_constant": 2, "first_step": first_step, "key": 7}
        wind, state = table(WIND, [row])[0], np.zeros(1, WIND_STATE)[0]
        return [gust_step(wind, state, dt) for _ in range(2)]

    vrx3, millisecond, four = blown(0.001, 0.004), blown(0.0, 0.001), blown(0.0, 0.004)
    assert vrx3[0] == millisecond[0] != four[0]
    kick = four[1] - four[0] * (1 - 0.004 / 2)
    assert vrx3[1] == pytest.approx(vrx3[0] * (1 - 0.004 / 2) + kick, rel=1e-12)


LIGHT_BUOY = [
    element("box", (1.5, 1.5, 0.4), (0.3, -0.2, -0.1)),
    element("cylinder", (0.2, 0.15, 0.0), (-0.4, 0.5, 0.2)),
]
ROW = {
    "mass": 67.15, "com": (0, 0, -0.2), "inertia": (13.486, 13.486, 25.1813, 0, 0, 0),
    "linear_drag": 10.0, "angular_drag": 3.0, "profile": VRX3, "density": 997.0,
}  # fmt: skip


def test_each_element_feels_the_water_above_itself():
    body, elements = floating(LIGHT_BUOY, **ROW)
    waves, water = pms_sea(gain=2.0, period=2.0)
    moved = moving((3.0, 4.0, -0.2), (0.2, -0.1, 0.8))
    state = np.zeros(2, ELEMENT_STATE)
    state["height"] = 0.01, -0.02
    water_at_elements(body, elements, state, moved, waves, water, 20.0, 0.004)
    for number, before in enumerate((0.01, -0.02)):
        x, y, _ = np.array(moved[:3]) + matrix(moved) @ elements["position"][number]
        height = surface_height(waves, water, x, y, 20.0)
        assert state["height"][number] == pytest.approx(height, abs=1e-15)
        assert state["rise"][number] == pytest.approx((height - before) / 0.004, rel=1e-12)
    assert abs(state["height"][0] - state["height"][1]) > 0.01


@pytest.mark.parametrize("rises", [(0.0, 0.0), (0.8, -0.5), (-0.6, 0.9), (30.0, -30.0)])
def test_buoyancy_and_drag_are_the_sum_over_elements(rises):
    """VRX 3's force of each element at its own water, one by one; the last water throws an element into the air."""
    body, elements = floating(LIGHT_BUOY, **ROW)
    moved = moving((3.0, 4.0, -0.2), (0.2, -0.1, 0.8), (0.4, -0.3, 0.2, 0.3, -0.2, 0.1))
    heights = (0.12, -0.05)
    total = np.zeros(6)
    for number, (height, rise) in enumerate(zip(heights, rises, strict=True)):
        alone, one = floating([LIGHT_BUOY[number]], **ROW)
        total += flotation(alone, one, None, moved, height, rise, 0.0, zero_wrench()).wrench
    water = np.zeros(2, ELEMENT_STATE)
    water["height"], water["rise"] = heights, rises
    found = flotation(body, elements, water, moved, 0.0, 0.0, 0.0, zero_wrench()).wrench
    assert found == pytest.approx(total, rel=1e-12, abs=1e-9)
    assert found.fz >= 0.0


def test_the_implicit_step_ends_at_the_drag_of_its_end():
    """The wrench at dt is VRX's explicit one at the velocities that Newton's and Euler's equations then give."""
    body, elements = floating(LIGHT_BUOY, **ROW)
    water = np.zeros(2, ELEMENT_STATE)
    water["height"], water["rise"] = (0.12, -0.05), (0.3, -0.2)
    moved = moving((3.0, 4.0, -0.2), (0.2, -0.1, 0.8), (0.4, -0.3, 0.2, 0.3, -0.2, 0.1))
    dt = 0.004
    wrench = np.array(flotation(body, elements, water, moved, 0.0, 0.0, dt, zero_wrench()).wrench)
    turn = matrix(moved)
    inertia = turn @ np.diag(body["inertia"][:3]) @ turn.T
    spin, lever = turn @ np.array(moved[15:]), turn @ body["com"]
    alpha = np.linalg.solve(inertia, wrench[3:] - np.cross(spin, inertia @ spin))
    com = wrench[:3] / body["mass"] - (0, 0, 9.8)
    origin = com - np.cross(alpha, lever) - np.cross(spin, np.cross(spin, lever))
    later = moving(
        moved[:3], (0.2, -0.1, 0.8), (*np.array(moved[12:15]) + dt * turn.T @ origin, *turn.T @ (spin + dt * alpha))
    )
    assert wrench == pytest.approx(
        flotation(body, elements, water, later, 0.0, 0.0, 0.0, zero_wrench()).wrench, rel=1e-9
    )
