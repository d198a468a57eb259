"""Gusts and the load of the wind."""

import math

import numba
import numpy as np
import pytest

from unit.physics.rows import FORCE_ERROR, in_body_axes, moving, moving_row, oracle, table
from vrx_mj.model.tables import WIND, WIND_STATE
from vrx_mj.physics.noise import stream_key
from vrx_mj.physics.wind import gust_step, wind_load, wind_velocity

WAMV = np.array([0.5, 0.5, 0.33])
LOADS = [  # speed, direction [deg], yaw [rad], X, Y, N by hand
    (5.0, 120.0, 0.0, -3.125, 9.375, 7.14470958),
    (7.0, 265.0, 1.0, -19.2046003, -5.29539972, -13.3114677),
    (8.0, 45.0, math.radians(30), 29.8564065, 2.14359354, -10.56),
    (-2.0, 0.0, 0.5, -1.54030231, 0.459697694, 1.11074170),
]


def blowing(**values):
    row = {
        "direction": (1.0, 0.0),
        "mean": 0.0,
        "gain": 0.0,
        "time_constant": 2.0,
        "first_step": 0.0,
        "key": stream_key(1, "wind"),
    }
    return table(WIND, [row | values])[0]


def toward(degrees, speed):
    return speed * math.cos(math.radians(degrees)), speed * math.sin(math.radians(degrees))


@numba.njit
def speeds(wind, state, dt, out):
    for n in range(out.size):
        out[n] = gust_step(wind[0], state[0], dt)


def gusts(count, dt, **values):
    """`count` speeds, and the state they end in."""
    wind, state, out = np.array([blowing(**values)]), np.zeros(1, WIND_STATE), np.empty(count)
    speeds(wind, state, dt, out)
    return out, state[0]


@pytest.mark.parametrize(("speed", "direction", "yaw", "x", "y", "n"), LOADS)
def test_loads_by_hand(speed, direction, yaw, x, y, n):
    body = moving(angles=(0, 0, yaw), velocity=(1, 2, 3, 4, 5, 6))  # the boat's own velocity changes nothing
    wrench = in_body_axes(body, wind_load(WAMV, body, toward(direction, speed)))
    assert wrench == pytest.approx([x, y, 0, 0, 0, n], rel=6e-9, abs=1e-12)


def test_loads_are_vrx_s():
    for row in oracle("wind_force"):
        row |= {"x_m": 0.0, "y_m": 0.0, "z_m": 0.0}
        body = moving_row(row)
        coefficients = np.array([row["coeff_x"], row["coeff_y"], row["coeff_n"]])
        wrench = wind_load(coefficients, body, toward(row["wind_dir_deg"], row["wind_speed_m_s"]))
        expected = [row[f"{axis}_b"] for axis in ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")]
        assert in_body_axes(body, wrench) == pytest.approx(expected, rel=1e-6, abs=FORCE_ERROR), row["case"]


@pytest.mark.parametrize("row", oracle("wind_gust_stats"), ids=lambda row: row["set"])
def test_gusts_have_the_statistics_of_vrx_s(row):
    """Mean, spread and correlation of a long run, within four standard errors of ours and theirs."""
    tau, dt, gain = row["time_constant_s"], row["dt_s"], row["gain"]
    count = 4_000_000
    values, _ = gusts(
        count, dt, mean=row["mean_param_m_s"], gain=gain, time_constant=tau, key=stream_key(5, row["set"])
    )
    values = values[int(10 * tau / dt) :]
    share = tau / (values.size * dt) + tau / row["duration_s"]  # one over the number of independent gusts
    assert values.mean() == pytest.approx(row["mean_m_s"], abs=4 * gain * math.sqrt(2 * share))
    assert values.std() == pytest.approx(row["std_m_s"], rel=4 * math.sqrt(share / 2))
    swing = values - values.mean()
    for key, lag in (("acf_0p5tau", 0.5), ("acf_1tau", 1.0), ("acf_2tau", 2.0)):
        n = round(lag * tau / dt)
        correlation = np.mean(swing[n:] * swing[:-n]) / swing.var()
        assert correlation == pytest.approx(row[key], abs=4 * math.sqrt(share))


def test_a_gust_starts_from_the_mean_and_kicks_by_one_number():
    """One step from rest has the standard deviation gain sqrt(2 dt / tau)."""
    first = [gusts(1, 0.001, mean=5.0, gain=2.0, key=stream_key(n, "w"))[0][0] for n in range(4000)]
    assert np.mean(first) == pytest.approx(5.0, abs=4 * 0.0632455532 / 4000**0.5)
    assert np.std(first) == pytest.approx(0.0632455532, rel=4 / 8000**0.5)


def test_the_same_key_gives_the_same_gusts_and_another_one_others():
    again, other = (gusts(100, 0.01, gain=1.0, key=stream_key(seed, "wind"))[0] for seed in (1, 2))
    assert np.array_equal(gusts(100, 0.01, gain=1.0)[0], again)
    assert not np.any(again == other)


def test_gusts_go_on_where_the_state_left_off():
    whole, _ = gusts(100, 0.01, gain=1.0)
    _, state = gusts(40, 0.01, gain=1.0)
    assert state["counter"] == 40
    rest = np.empty(60)
    speeds(np.array([blowing(gain=1.0)]), np.array([state]), 0.01, rest)
    assert np.array_equal(rest, whole[40:])


def test_without_gain_the_wind_is_steady_and_draws_nothing():
    values, state = gusts(10, 0.01, mean=3.0)
    assert values.tolist() == [3.0] * 10
    assert state["counter"] == 0


def test_the_wind_blows_along_its_direction():
    wind, state = blowing(direction=(0.6, 0.8)), np.zeros(1, WIND_STATE)[0]
    state["speed"] = 5.0
    assert wind_velocity(wind, state) == pytest.approx((3.0, 4.0))
