"""Propellers of profile marine: each effect against its closed form."""

import json
import math
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest

from unit.physics.rows import hull, matrix, moving, rotation, sea, table, thruster
from vrx_mj import config
from vrx_mj.model import tables
from vrx_mj.physics.thrust import (
    advance_thrust,
    disc_share,
    measured_thrust,
    propeller_power,
    propeller_step,
    quadrant_loads,
    update_propeller,
)
from vrx_mj.spectra import irregular_sea, jonswap

WAMV = ((0.3, 9.0), (0.4, 53.0), (0.5, 85.0), (0.6, 120.0), (0.7, 157.0), (0.8, 182.0), (0.9, 219.0), (1.0, 240.0))
"""Bollard pull of a WAM-V 16: Sarda et al., Ocean Engineering 127, 2016."""
CURVE = ((-1.0, -100.0), (-0.4, -20.0), (0.0, 0.0), *WAMV)
DEEP = 10.0
NO_QUADRANTS = np.zeros(0, tables.QUADRANT)


def propeller(**changes):
    row = {
        "dead_zone": 0.0, "time_constant": 0.0, "vanishing_speed": math.inf, "diameter": 0.3, "full_ahead": 240.0,
        "full_astern": -100.0, "power": 2000.0, "point_start": 0, "point_count": 0,
    }  # fmt: skip
    return table(tables.PROPELLER, [row | changes])[0]


def points(pairs=CURVE):
    return table(tables.PROPELLER_POINT, [{"command": command, "thrust": thrust} for command, thrust in pairs])


def step(own, state, command, advance, depth, dt):
    return propeller_step(own, state, points(), NO_QUADRANTS, command, advance, depth, 1000.0, dt)


def fresh():
    return np.zeros(1, tables.PROPELLER_STATE)[0]


@pytest.mark.parametrize(("command", "thrust"), WAMV)
def test_measured_commands_give_the_measured_thrust(command, thrust):
    assert measured_thrust(propeller(), points(), command) == thrust


def test_thrust_between_measurements_is_that_of_numpy():
    commands = np.linspace(-1.2, 1.2, 241)
    found = [measured_thrust(propeller(), points(), command) for command in commands]
    assert found == pytest.approx(np.interp(commands, *zip(*CURVE, strict=True)), abs=1e-12)
    assert (np.diff(found) >= 0.0).all()


def test_the_dead_zone_gives_exactly_nothing_up_to_its_end():
    own = propeller(dead_zone=0.25)
    assert [measured_thrust(own, points(), command) for command in (-0.25, -0.1, 0.0, 0.1, 0.25)] == [0.0] * 5
    assert measured_thrust(own, points(), 0.26) == pytest.approx(9.0 * 0.26 / 0.3)


def test_no_command_gives_exactly_nothing_whatever_the_table():
    assert measured_thrust(propeller(), points(((-1.0, -90.0), (1.0, 100.0))), 0.0) == 0.0


@pytest.mark.parametrize(("thrust", "full"), [(240.0, 240.0), (60.0, 240.0), (-100.0, 100.0), (-25.0, 100.0)])
def test_thrust_falls_in_a_straight_line_to_nothing(thrust, full):
    own = propeller(vanishing_speed=6.0)
    end = math.copysign(6.0 * math.sqrt(abs(thrust) / full), thrust)
    assert advance_thrust(own, thrust, 0.0) == thrust
    assert advance_thrust(own, thrust, 0.5 * end) == pytest.approx(0.5 * thrust)
    assert advance_thrust(own, thrust, end) == pytest.approx(0.0, abs=1e-12)
    assert advance_thrust(own, thrust, 2.0 * end) == 0.0
    assert advance_thrust(own, thrust, -0.5 * end) == thrust


def test_thrust_at_speed_is_that_of_a_straight_open_water_curve():
    density, diameter, a, b = 1000.0, 0.3, 0.4, 0.5
    full_rate = math.sqrt(240.0 / (density * diameter**4 * a))  # [1/s]
    own = propeller(vanishing_speed=a * diameter * full_rate / b)
    for share, speed in ((1.0, 1.0), (0.5, 0.3), (0.2, 0.1)):
        rate = share * full_rate
        open_water = density * diameter**4 * rate**2 * (a - b * speed / (rate * diameter))
        assert advance_thrust(own, 240.0 * share**2, speed) == pytest.approx(open_water)


SERIES = json.loads((Path(config.__file__).parent / "propellers.json").read_bytes())["wageningen_b4_70"]["harmonics"]
EVEN = np.linspace(-math.pi, math.pi, 721)


def coefficients(angle):
    """C_T* and C_Q* of B4-70 by the sums of their series, at angles of advance [rad]."""
    turns = np.multiply.outer(angle, np.arange(31))
    a, b, c, d = np.array(SERIES).T
    return np.cos(turns) @ a + np.sin(turns) @ b, np.cos(turns) @ c + np.sin(turns) @ d


B4_70 = np.array(list(zip(*coefficients(EVEN), strict=True)), tables.QUADRANT)


@pytest.mark.parametrize("advance", [-3.0, -1.0, -0.2, 0.0, 0.3, 1.5, 4.0])
@pytest.mark.parametrize("rate", [-20.0, -3.0, 0.1, 8.0, 25.0])
def test_thrust_and_power_in_four_quadrants_are_sums_of_the_series(rate, advance):
    """The shaft turns at `rate` [1/s]: thrust at rest, then thrust and 2 pi n Q at speed."""
    density, diameter = 1025.0, 0.25
    disc, turning = math.pi * diameter**2 / 4.0, 0.7 * math.pi * rate * diameter
    own = propeller(diameter=diameter, quadrant_count=721)

    def loads(speed):
        thrust, torque = coefficients(math.atan2(speed, turning))
        head = 0.5 * density * (speed**2 + turning**2) * disc
        return thrust * head, 2.0 * math.pi * rate * torque * head * diameter

    (rest, power), (thrust, load) = loads(0.0), loads(advance)
    found, share = quadrant_loads(own, B4_70, density, rest, advance)
    most = 0.5 * density * (advance**2 + turning**2) * disc
    assert found == pytest.approx(thrust, abs=2e-3 * most)  # straight lines between half degrees
    assert share * power == pytest.approx(load, abs=2e-3 * most * abs(rate) * diameter)
    assert quadrant_loads(own, B4_70, density, rest, 0.0) == pytest.approx((rest, 1.0), rel=1e-12)


def test_a_held_propeller_has_drag_both_ways_and_draws_nothing():
    own, state = propeller(quadrant_count=721), fresh()
    (ahead, share), (astern, _) = (quadrant_loads(own, B4_70, 1025.0, 0.0, speed) for speed in (2.0, -2.0))
    head = 0.5 * 1025.0 * 4.0 * math.pi * 0.3**2 / 4.0
    assert (ahead / head, astern / head) == pytest.approx((-0.772, 0.695), abs=1e-3)
    assert share == 0.0
    assert propeller_step(own, state, points(), B4_70, 0.0, 2.0, DEEP, 1025.0, 0.1) == ahead
    assert state["energy"] == 0.0


def test_a_propeller_that_the_water_drives_draws_nothing():
    own, state = propeller(quadrant_count=721), fresh()
    _, share = quadrant_loads(own, B4_70, 1025.0, 9.0, 6.0)
    propeller_step(own, state, points(), B4_70, 0.3, 6.0, DEEP, 1025.0, 0.1)
    assert share < 0.0 == state["energy"]


def test_without_a_vanishing_speed_thrust_stays():
    assert advance_thrust(propeller(), 60.0, 20.0) == 60.0


@pytest.mark.parametrize("depth", [-0.3, -0.15, -0.1, -0.02, 0.0, 0.05, 0.14, 0.15, 2.0])
def test_the_share_under_water_is_that_of_a_sum_over_the_disc(depth):
    middles = (np.arange(200_000) + 0.5) / 200_000 * 0.3 - 0.15  # heights over the centre
    widths = 2.0 * np.sqrt(0.15**2 - middles**2)
    assert disc_share(0.15, depth) == pytest.approx(widths[middles < depth].sum() / widths.sum(), abs=2e-5)


def test_the_share_of_a_disc_is_all_half_and_nothing():
    assert [disc_share(0.2, depth) for depth in (0.2, 0.0, -0.2)] == pytest.approx([1.0, 0.5, 0.0], abs=1e-15)
    assert disc_share(0.2, -5.0) == 0.0


def test_power_goes_with_thrust_to_one_and_a_half():
    own = propeller()
    assert propeller_power(own, 240.0, 1.0) == pytest.approx(2000.0)
    assert propeller_power(own, 60.0, 1.0) == pytest.approx(2000.0 / 8.0)
    assert propeller_power(own, -25.0, 0.5) == pytest.approx(2000.0 / 16.0)
    assert propeller_power(own, 0.0, 1.0) == 0.0


@pytest.mark.parametrize("dt", [0.01, 0.25, 1.0])
def test_the_lag_is_exact_at_any_step(dt):
    own, state = propeller(time_constant=0.4), fresh()
    for _ in range(round(1.0 / dt)):
        thrust = step(own, state, 1.0, 0.0, DEEP, dt)
    assert thrust == pytest.approx(240.0 * (1.0 - math.exp(-1.0 / 0.4)))


def test_energy_is_power_times_time():
    own, state = propeller(), fresh()
    for _ in range(500):
        step(own, state, 1.0, 0.0, DEEP, 0.01)
    assert state["energy"] == pytest.approx(2000.0 * 5.0)


def test_a_propeller_half_out_of_the_water_pushes_and_draws_half():
    own, state = propeller(), fresh()
    assert step(own, state, 1.0, 0.0, 0.0, 0.1) == pytest.approx(120.0)
    assert state["energy"] == pytest.approx(100.0)


def test_speed_takes_thrust_but_no_state():
    own, state = propeller(vanishing_speed=5.0), fresh()
    assert step(own, state, 1.0, 1.0, DEEP, 0.01) == pytest.approx(0.8 * 240.0)
    assert state["thrust"] == 240.0


def test_at_rest_without_a_command_it_does_exactly_nothing():
    own, state = propeller(time_constant=0.4, vanishing_speed=5.0), fresh()
    assert [step(own, state, 0.0, 2.0, depth, 0.01) for depth in (DEEP, 0.0)] == [0.0, 0.0]
    assert state.tolist() == (0.0, 0.0)


SEA = irregular_sea(jonswap(1.3), 0.8, (0.4, 6.0), (1.0, 1.0), 20, 8.0)
WAVES, WATER = sea([wave._asdict() | {"steepness": 0.0, "phase": 0.4 * i} for i, wave in enumerate(SEA)], level=0.2)
Run = namedtuple("Run", "propellers propeller_points quadrants propeller_state sea current current_state layers")  # noqa: PYI024
NO_ROWS = [table(kind, []) for kind in (tables.CURRENT, tables.CURRENT_STATE, tables.LAYER)]
TILTED = rotation(0.1, -0.2, 2.5)


def slow_thrust(own, engine, body, angle, time, level):
    """Force of full thrust of a propeller [N], by vectors."""
    turn, attitude = engine["rotation"] @ rotation(0.0, 0.0, angle), matrix(body)
    arm = engine["position"] + turn @ engine["propeller"]
    place, axis = np.array(body[:3]) + attitude @ arm, attitude @ turn @ engine["direction"]
    speed = attitude @ (np.array(body[12:15]) + np.cross(body[15:18], arm))
    theta = [w.wavenumber * np.dot(w.direction, place[:2]) - w.frequency * time + 0.4 * i for i, w in enumerate(SEA)]
    decay = [w.amplitude * w.frequency * math.exp(w.wavenumber * min(place[2] - 0.2, 0.0)) for w in SEA]
    level_flow = sum(np.array(w.direction) * d * math.cos(a) for w, d, a in zip(SEA, decay, theta, strict=True))
    water = np.array([*level_flow, sum(d * math.sin(a) for d, a in zip(decay, theta, strict=True))])
    surface = 0.2 + level + sum(w.amplitude * math.cos(a) for w, a in zip(SEA, theta, strict=True))
    left = np.clip(1.0 - axis @ (speed - water) / own["vanishing_speed"], 0.0, 1.0)
    return 240.0 * left * disc_share(0.5 * own["diameter"], surface - place[2])


@pytest.mark.parametrize("time", [0.0, 3.7, 11.2, 25.9])
@pytest.mark.parametrize("angle", [0.0, -1.1])
def test_a_propeller_at_sea_is_that_of_a_second_implementation(time, angle):
    """Where it is, how it moves through the water along its axis, and how deep it is."""
    own = propeller(vanishing_speed=6.0, diameter=0.5, point_count=len(CURVE))
    engine = thruster(measured=0, rotation=TILTED, max_command=2.0)
    boat = moving((3.0, -7.0, 0.2), (0.3, -0.2, 1.9), (1.5, -0.4, 0.2, 0.3, -0.5, 0.7))
    state = np.zeros(1, tables.THRUSTER_STATE)[0]
    state["command"], state["expires"], state["angle"] = 2.0, math.inf, angle
    propellers, states = np.array([own]), np.zeros(1, tables.PROPELLER_STATE)
    run = Run(propellers, points(), NO_QUADRANTS, states, np.array([WATER]), *NO_ROWS)
    update_propeller(hull(level=0.05), engine, state, run, WAVES, boat, time, 0.01)
    expected = slow_thrust(own, engine, boat, angle, time, 0.05)
    assert state["thrust"] == pytest.approx(expected, rel=1e-9)
    assert (state["applied"], state["fresh"]) == (2.0, 1)
    assert states["thrust"][0] == 240.0
