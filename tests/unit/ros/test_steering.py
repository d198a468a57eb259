"""`cmd_vel` as a velocity, and formations: who steers which boat, and for how long."""

from itertools import pairwise
from types import SimpleNamespace

import pytest

from trees import partial
from vrx_mj.errors import VrxError
from vrx_mj.ros import steering
from vrx_mj.ros.steering import Steering, parse_formation


class Sim:
    """Three boats; notes what they are commanded."""

    boats = ("a", "b", "c")

    def __init__(self):
        self.time, self.given = 0.0, []

    def observe(self):
        return {boat: SimpleNamespace(thrusters={}) for boat in self.boats}

    def command_all(self, commands):
        self.given += [(round(self.time, 6), boat, values) for boat, values in commands.items()]


class Keeper:
    """Commands what it is asked for."""

    def __init__(self, thrusters, craft, hold_sway):
        assert hold_sway  # cmd_vel is of the course: no guidance makes up for a sideslip

    def __call__(self, seen, t, surge, turn):
        return {"surge": surge, "turn": turn}


class Formation:
    """Commands every boat that is not its leader."""

    def __init__(self, leader="a", shape="wedge", spacing=12.0, **more):
        self.leader, self.shape, self.spacing = SimpleNamespace(name=leader), shape, spacing

    def __call__(self, obs, t):
        return {boat: {"formed": 1.0} for boat in obs if boat != self.leader.name}


@pytest.fixture
def sim(monkeypatch):
    monkeypatch.setattr(steering, "VelocityKeeper", Keeper)
    monkeypatch.setattr(steering, "Formation", Formation)
    monkeypatch.setattr(steering, "true_estimate", lambda seen: seen)
    return Sim()


def sail(sim, pilot, seconds):
    for _ in range(round(seconds * 100)):
        pilot.steer()
        sim.time += 0.01


def test_a_velocity_is_kept_for_a_second_ten_times_a_second(sim):
    pilot = Steering(sim, lambda _level, _text: None)
    sail(sim, pilot, 0.5)
    pilot.steer_boat("b", 1.5, -0.2)
    sail(sim, pilot, 3.0)
    assert [time for time, _, _ in sim.given] == pytest.approx([0.5 + 0.1 * k for k in range(10)])
    assert {(boat, str(values)) for _, boat, values in sim.given} == {("b", "{'surge': 1.5, 'turn': -0.2}")}


def test_a_boat_that_is_let_go_is_not_steered(sim):
    pilot = Steering(sim, lambda _level, _text: None)
    pilot.steer_boat("b", 1.5, 0.0)
    pilot.let_go("b", ())
    sail(sim, pilot, 1.0)
    assert sim.given == []


def test_a_formation_leaves_alone_who_has_a_velocity_to_keep(sim):
    pilot = Steering(sim, lambda _level, _text: None)
    pilot.form("wedge")
    pilot.steer_boat("b", 1.0, 0.0)
    sail(sim, pilot, 0.05)
    assert sorted((boat, *values) for _, boat, values in sim.given) == [("b", "surge", "turn"), ("c", "formed")]
    sim.given.clear()
    sail(sim, pilot, 2.0)
    assert (sim.given[-1][1], sim.given[-1][2]) == ("c", {"formed": 1.0})
    assert [boat for time, boat, values in sim.given if "formed" in values and time > 1.05].count("b") == 10


def test_a_formation_ends_with_a_word_or_with_its_leader(sim):
    pilot = Steering(sim, lambda _level, _text: None)
    pilot.form("line leader=c")
    pilot.form("off")
    sail(sim, pilot, 0.5)
    pilot.form("line leader=c")
    sim.boats = ("a", "b")
    pilot.bind()
    sail(sim, pilot, 0.5)
    assert sim.given == []


def test_formations_are_words_or_json():
    assert parse_formation("wedge spacing=9 leader=b") == {"shape": "wedge", "spacing": 9.0, "leader": "b"}
    assert parse_formation('{"shape": "line", "path": [[0, 1], [5, 2]]}')["path"] == ((0.0, 1.0), (5.0, 2.0))
    assert parse_formation(" Off ") is None


@pytest.mark.parametrize("text", ["", "star", "wedge 12", "wedge size=3", "line spacing=inf", "{]", '{"leader": 3}'])
def test_formations_that_are_none_are_refused(text):
    with pytest.raises(VrxError):
        parse_formation(text)


# Commands that are held: given again before they run out, until they are let go


TIMEOUT = 1.0


class HeldSim:
    """Two boats, of which the second one's thruster needs no renewing."""

    boats = ("a", "b")
    rows = ({"hull": 0, "name": "left", "timeout": TIMEOUT}, {"hull": 1, "name": "left", "timeout": 0.0})
    world = SimpleNamespace(parameters=partial({"boats": [{"name": "a"}, {"name": "b"}], "thrusters": rows}))

    def __init__(self):
        self.time, self.given = 0.0, []

    def command_all(self, commands):
        self.given.append((self.time, commands))


@pytest.fixture
def held_sim():
    return HeldSim()


def sail_held(held_sim, held, seconds):
    for _ in range(round(seconds * 20)):
        held_sim.time += 0.05
        held.renew()


def test_a_command_is_given_again_before_it_runs_out(held_sim):
    held = Steering(held_sim, print)
    held.hold("a", "left", 0.5)
    sail_held(held_sim, held, 10.0)
    times = [0.0, *(time for time, _ in held_sim.given)]
    assert max(later - earlier for earlier, later in pairwise(times)) < TIMEOUT
    assert len(held_sim.given) <= 20
    assert {str(commands) for _, commands in held_sim.given} == {"{'a': {'left': 0.5}}"}


def test_what_holds_for_ever_is_not_given_again(held_sim):
    held = Steering(held_sim, print)
    held.hold("b", "left", 0.5)
    sail_held(held_sim, held, 5.0)
    assert held_sim.given == []


@pytest.mark.parametrize(
    "end", [lambda one: one.steer_boat("a", 1.0, 0.0), lambda one: one.let_go("a", ["left"]), Steering.begin]
)
def test_what_is_let_go_is_not_given_again(held_sim, end):
    held = Steering(held_sim, print)
    held.hold("a", "left", 0.5)
    end(held)
    sail_held(held_sim, held, 3.0)
    assert held_sim.given == []


def test_a_boat_that_left_is_commanded_no_more(held_sim):
    held = Steering(held_sim, print)
    held.hold("a", "left", 0.5)
    held_sim.boats = ("b",)
    held.bind()
    sail_held(held_sim, held, 3.0)
    assert held_sim.given == []
