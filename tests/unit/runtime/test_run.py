"""Runs: how long they last, and what their summary counts."""

import pytest

from integration.sailing import AFLOAT, CALM, boats, simulation
from vrx_mj.runtime.run import run


@pytest.fixture(scope="module")
def sim():
    return simulation(boats((0.0, 0.0, 0.0)), sea=CALM, wind=None)


@pytest.fixture(autouse=True)
def _at_the_start(sim):
    sim.reset()


@pytest.mark.parametrize("rate", [10.0, 3.0, 100.0, 1000.0])
def test_a_run_ends_at_its_duration_whenever_the_controller_is_called(sim, rate):
    times = []
    summary = run(sim, 0.25, controller=lambda _obs, t: times.append(t), control_rate=rate)
    assert (summary.steps, summary.sim_time) == (25, 0.25)
    assert sim.time == pytest.approx(0.25)
    calls = {10.0: [0.0, 0.1, 0.2], 3.0: [0.0]}.get(rate, [0.01 * step for step in range(25)])
    assert times == pytest.approx(calls)


def test_the_way_is_over_ground(sim):
    """A boat that falls from 2 m heaves by more than that, and goes a few centimetres."""
    sim.set_boat("a", pose=(0.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    assert run(sim, 1.0).boats["a"].distance < 0.2


def test_the_way_adds_up_along_a_circle(sim):
    """1 m/s held for 1 s is 1 m of way, wherever it leads."""
    sim.set_boat("a", pose=(0.0, 0.0, AFLOAT, 0.0, 0.0, 0.0))

    def held(obs, t):
        turn = 1.2 * t
        sim.set_boat("a", pose=(*obs["a"].position[:2], AFLOAT, 0.0, 0.0, turn), velocity=(1.0, 0, 0, 0, 0, 1.2))

    assert run(sim, 1.0, controller=held, control_rate=100.0).boats["a"].distance == pytest.approx(1.0, rel=0.02)
