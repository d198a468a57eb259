"""The current: its profile over depth, its tide and its random part, against closed forms."""

import math

import numpy as np
import pytest

from unit.physics.rows import table
from vrx_mj.model import tables
from vrx_mj.physics.conditions import current_share, current_step, current_velocity

STILL = {
    "mean": (0.0, 0.0), "tide_major": (0.0, 0.0), "tide_minor": (0.0, 0.0), "tide_frequency": 0.0, "tide_phase": 0.0,
    "gain": 0.0, "time_constant": 60.0, "key": 7,
}  # fmt: skip
EVEN = table(tables.LAYER, [])


def stream(**changes):
    return table(tables.CURRENT, [STILL | changes]), np.zeros(1, tables.CURRENT_STATE)


def test_a_uniform_current_is_the_same_everywhere():
    assert current_velocity(*stream(mean=(0.3, -0.4)), EVEN, 12.0, 99.0) == (0.3, -0.4)


def test_without_a_current_the_water_is_still():
    nothing = table(tables.CURRENT, []), np.zeros(0, tables.CURRENT_STATE)
    current_step(*nothing, 0.01)
    assert current_velocity(*nothing, EVEN, 1.0, 2.0) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("depth", "share"), [(-1.0, 1.0), (0.0, 1.0), (1.0, 0.9), (2.0, 0.8), (5.0, 0.5), (8.0, 0.2), (90.0, 0.2)]
)
def test_shares_lie_on_straight_lines(depth, share):
    layers = table(tables.LAYER, [{"depth": d, "share": s} for d, s in ((0.0, 1.0), (2.0, 0.8), (8.0, 0.2))])
    assert current_share(layers, depth) == pytest.approx(share)


def test_a_tide_draws_an_ellipse():
    period = 44714.16
    tide = stream(tide_major=(0.0, 0.6), tide_minor=(-0.2, 0.0), tide_frequency=2.0 * math.pi / period)
    arrows = np.array([current_velocity(*tide, EVEN, 0.0, period * k / 16) for k in range(16)])
    assert np.hypot(arrows[:, 1] / 0.6, arrows[:, 0] / 0.2) == pytest.approx(np.ones(16))
    turns = np.diff(np.unwrap(np.arctan2(arrows[:, 1], arrows[:, 0])))
    assert (turns > 0.0).all()  # counter-clockwise


def test_a_tide_begins_along_its_major_axis_on_top_of_the_mean():
    tide = stream(mean=(0.1, 0.2), tide_major=(0.3, -0.6), tide_minor=(0.5, 0.7), tide_frequency=0.4)
    assert current_velocity(*tide, EVEN, 0.0, 0.0) == pytest.approx((0.4, -0.4))
    assert current_velocity(*tide, EVEN, 0.0, 0.5 * math.pi / 0.4) == pytest.approx((0.6, 0.9))


def test_the_phase_of_a_tide_is_how_far_it_has_gone_at_the_start():
    fields = {"tide_major": (0.3, 0.6), "tide_minor": (-0.2, 0.1), "tide_frequency": 0.4}
    ahead, later = stream(**fields, tide_phase=0.7), stream(**fields)
    for t in (0.0, 3.0, 11.0):
        expected = current_velocity(*later, EVEN, 0.0, t + 0.7 / 0.4)
        assert current_velocity(*ahead, EVEN, 0.0, t) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("dt", [0.01, 1.0, 30.0])
def test_the_random_part_has_its_deviation_and_time_constant_at_any_step(dt):
    flow, state = stream(gain=0.1, time_constant=20.0)
    values = []
    for _ in range(300_000 if dt < 1.0 else 60_000):
        current_step(flow, state, dt)
        values.append((state[0]["east"], state[0]["north"]))
    values = np.array(values)
    effective = len(values) * min(dt / 40.0, 1.0)
    assert values.std(axis=0) == pytest.approx([0.1, 0.1], rel=5.0 / math.sqrt(2.0 * effective))
    lag = max(round(20.0 / dt), 1)
    kept = np.mean(values[lag:] * values[:-lag], axis=0) / values.var(axis=0)
    assert kept == pytest.approx(math.exp(-lag * dt / 20.0) * np.ones(2), abs=5.0 / math.sqrt(effective))
    assert abs(np.corrcoef(values.T)[0, 1]) < 5.0 / math.sqrt(effective)
