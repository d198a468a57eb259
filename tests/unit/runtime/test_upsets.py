"""Boats that capsize or spin are said, once each."""

import math

import pytest

from vrx_mj import Simulation, VrxWarning, compile_world
from vrx_mj.runtime.run import MotionWarnings, run

UPSIDE_DOWN = (0, 0, 0.5, math.pi, 0, 0)


@pytest.fixture
def sim():
    world = {"name": "calm", "sea": {"model": "none"}}
    return Simulation(compile_world(world, fleet={"boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]}))


def test_a_boat_that_floats_upright_is_nothing_to_say(sim):
    sim.set_boat("a", pose=(0, 0, 0, 1.5, 0, 0), velocity=(0, 0, 0, 0, 0, 11.9))
    assert MotionWarnings().look(sim.observe(), 0.0) == []


def test_a_run_says_once_that_a_boat_has_capsized(sim):
    sim.set_boat("a", pose=UPSIDE_DOWN)
    with pytest.warns(VrxWarning) as said:
        summary = run(sim, 0.5)
    (text,) = [str(item.message) for item in said]
    assert text == "a has capsized at t = 0.1 s: it is 180 degrees from upright"
    assert summary.warnings == (text,)


def test_a_boat_that_spins_is_said_with_its_rate(sim):
    upsets = MotionWarnings()
    sim.set_boat("a", velocity=(0, 0, 0, 0, 5, 12))
    assert upsets.look(sim.observe(), 2.0) == [
        "a spins at 13 rad/s at t = 2.0 s, more than 12: check masses, inertias and floats of its robot"
    ]
    assert upsets.look(sim.observe(), 3.0) == []
