"""Commands that are held: given again before they run out, until they are let go."""

from itertools import pairwise
from types import SimpleNamespace

import pytest

from trees import partial
from vrx_mj.ros.autopilot import HeldThrust

TIMEOUT = 1.0


class Sim:
    """Two boats, of which the second one's thruster needs no renewing."""

    boats = ("a", "b")
    rows = ({"hull": 0, "name": "left", "timeout": TIMEOUT}, {"hull": 1, "name": "left", "timeout": 0.0})
    world = SimpleNamespace(parameters=partial({"boats": [{"name": "a"}, {"name": "b"}], "thrusters": rows}))

    def __init__(self):
        self.time, self.given = 0.0, []

    def command_all(self, commands):
        self.given.append((self.time, commands))


@pytest.fixture
def sim():
    return Sim()


def sail(sim, held, seconds):
    for _ in range(round(seconds * 20)):
        sim.time += 0.05
        held.renew()


def test_a_command_is_given_again_before_it_runs_out(sim):
    held = HeldThrust(sim)
    held.hold("a", "left", 0.5)
    sail(sim, held, 10.0)
    times = [0.0, *(time for time, _ in sim.given)]
    assert max(later - earlier for earlier, later in pairwise(times)) < TIMEOUT
    assert len(sim.given) <= 20
    assert {str(commands) for _, commands in sim.given} == {"{'a': {'left': 0.5}}"}


def test_what_holds_for_ever_is_not_given_again(sim):
    held = HeldThrust(sim)
    held.hold("b", "left", 0.5)
    sail(sim, held, 5.0)
    assert sim.given == []


@pytest.mark.parametrize("end", [lambda one: one.let_go("a"), lambda one: one.let_go("a", "left"), HeldThrust.begin])
def test_what_is_let_go_is_not_given_again(sim, end):
    held = HeldThrust(sim)
    held.hold("a", "left", 0.5)
    end(held)
    sail(sim, held, 3.0)
    assert sim.given == []


def test_a_boat_that_left_is_commanded_no_more(sim):
    held = HeldThrust(sim)
    held.hold("a", "left", 0.5)
    sim.boats = ("b",)
    held.bind()
    sail(sim, held, 3.0)
    assert sim.given == []
