"""Runs: how long they last, and what their summary counts."""

import math
import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from integration.sailing import AFLOAT, CALM, boats, simulation
from trees import partial
from vrx_mj import Simulation, VrxWarning, compile_world
from vrx_mj.errors import CommandError, VrxError
from vrx_mj.runtime import run as module
from vrx_mj.runtime.run import (
    MotionWarnings,
    _by_pair,
    fleet_controller,
    harmless_speeds,
    is_unusual,
    names_controllers,
    obey,
    run,
    steady,
)
from vrx_mj.runtime.subscriptions import Touch


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


def test_the_wall_time_is_that_of_the_run_and_the_factor_is_of_both(sim, monkeypatch):
    moments = iter((1000.0, 1000.5))
    monkeypatch.setattr(module, "clock", SimpleNamespace(perf_counter=lambda: next(moments)))
    summary = run(sim, 0.25)
    assert (summary.wall_time, summary.real_time_factor) == (0.5, 0.5)


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


# The controllers that a fleet names, as one


MODULE = """
calls = []

def all_ahead(obs, t):
    calls.append(t)
    return {**{boat: {"left": 1.0} for boat in obs}, "task": {"ping": 1}}

class Turner:
    def reset(self, seed):
        self.seed = seed

    def __call__(self, obs, t):
        return {boat: {"right": self.seed} for boat in obs}

def silent(obs, t):
    return None

def nonsense(obs, t):
    return 0.5
"""


@pytest.fixture
def crew(tmp_path, monkeypatch):
    (tmp_path / "some_crew.py").write_text(MODULE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)


def steered(*names, task=None):
    """What the fleet's controller commands four boats, the first of which have these controllers."""
    boats = [{"name": f"wamv{i + 1}", "controller": name} for i, name in enumerate(names)]
    world = SimpleNamespace(parameters=partial({"boats": boats, "task": task}))
    controller = fleet_controller(SimpleNamespace(world=world, seed=5))
    return controller(dict.fromkeys(["wamv1", "wamv2", "wamv3", "wamv4"]), 2.0)


@pytest.mark.usefixtures("crew")
def test_each_controller_commands_its_own_boats_and_is_called_once():
    commands = steered("some_crew:all_ahead", "some_crew:Turner", "some_crew:all_ahead", None)
    assert commands == {"wamv1": {"left": 1.0}, "wamv3": {"left": 1.0}, "wamv2": {"right": 5}}
    import some_crew

    assert some_crew.calls == [2.0]


@pytest.mark.usefixtures("crew")
@pytest.mark.parametrize(("scored", "told"), [("wamv1", True), ("wamv2", False)])
def test_messages_to_the_task_come_from_the_controller_of_the_scored_boat(scored, told):
    commands = steered("some_crew:all_ahead", "some_crew:silent", task={"boat": scored})
    assert ("task" in commands) == told


def test_a_fleet_that_names_no_controller_has_none():
    sim = SimpleNamespace(world=SimpleNamespace(parameters=partial({"boats": [{"name": "old"}], "task": None})), seed=0)
    assert fleet_controller(sim) is None
    assert not names_controllers(sim)


@pytest.mark.usefixtures("crew")
def test_what_cannot_be_used_is_told_with_its_boats():
    with pytest.raises(VrxError) as caught:
        steered(*["some_crew:nobody"] * 5)
    assert str(caught.value) == (
        "controller of wamv1, wamv2, wamv3 and 2 more: no controller in the module some_crew named 'nobody'; "
        "known: Turner, all_ahead, nonsense, silent"
    )
    with pytest.raises(CommandError) as caught:
        steered("some_crew:nonsense")
    assert str(caught.value) == (
        "the controller some_crew:nonsense returned 0.5: a mapping by boat, or None, is needed"
    )


@pytest.mark.parametrize(("thrust", "texts"), [
    ({"left": 5.0}, ["left of a is 5, outside -1 to 1: the force is clamped to 250 N ahead, 100 N astern"]),
    ({"left": 5.0, "right": -1.5}, [
        "left of a is 5, outside -1 to 1: the force is clamped to 250 N ahead, 100 N astern; and 1 more"
    ]),
    ({"left": 1.0, "right": -1.0}, []),
])  # fmt: skip
def test_steady_commands_beyond_what_thrusters_do_are_warned_of(sim, thrust, texts):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        steady(sim, thrust)
    assert [str(item.message) for item in caught] == texts


# Boats that capsize or spin are said, once each


UPSIDE_DOWN = (0, 0, 0.5, math.pi, 0, 0)


@pytest.fixture
def calm_sim():
    world = {"name": "calm", "sea": {"model": "none"}}
    return Simulation(compile_world(world, fleet={"boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]}))


def test_a_boat_that_floats_upright_is_nothing_to_say(calm_sim):
    calm_sim.set_boat("a", pose=(0, 0, 0, 1.5, 0, 0), velocity=(0, 0, 0, 0, 0, 11.9))
    upsets = MotionWarnings(calm_sim.world.parameters)
    upsets.warn(calm_sim.observe(), 0.0)
    assert upsets.lines == []
    assert not is_unusual(calm_sim.features[None], np.inf)
    calm_sim.set_boat("a", pose=(0, 0, 0, 1.6, 0, 0))
    assert is_unusual(calm_sim.features[None], np.inf)


def test_a_run_says_once_that_a_boat_has_capsized(calm_sim):
    calm_sim.set_boat("a", pose=UPSIDE_DOWN)
    with pytest.warns(VrxWarning) as said:
        summary = run(calm_sim, 0.5)
    (text,) = [str(item.message) for item in said]
    assert text == "a has capsized at t = 0.1 s: it is 180 degrees from upright"
    assert summary.warnings == (text,)


BOX = """<robot name="box"><link name="base_link"><inertial><mass value="60"/>
<inertia ixx="2" iyy="8" izz="9" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="1.2 0.5 0.4"/></geometry></collision></link></robot>"""
FAST = "a makes 4 m/s on a waterline of 1.2 m"


@pytest.mark.parametrize(
    ("hull", "speed", "text"),
    [
        ("{}", 4.0, f"{FAST}, a Froude number of 1.17: planing, above 1, is not modelled without a `resistance`"),
        ("{resistance: [[0, 0], [3, 60]]}", 4.0, "a makes 4 m/s, more than the 3 m/s at which its `resistance` ends"),
        ("{}", 3.0, None),
    ],
)
def test_a_boat_faster_than_its_resistance_is_modelled_is_said_once(tmp_path, hull, speed, text):
    """A box 1.2 m long; in a current of 1 m/s that goes with it."""
    (tmp_path / "box.urdf").write_text(BOX, encoding="utf-8")
    (tmp_path / "box.yaml").write_text(f"urdf: box.urdf\nhull: {hull}\n", encoding="utf-8")
    world = {"physics": {"profile": "marine"}, "sea": {"model": "none"}, "current": {"speed": 1.0}}
    with warnings.catch_warnings(action="ignore"):
        fleet = {"robot": str(tmp_path / "box.yaml"), "boats": [{"name": "a", "pose": [0.0] * 6}]}
        sim = Simulation(compile_world(world, fleet=fleet))
    sim.set_boat("a", velocity=(speed + 1.0, 0, 0, 0, 0, 0))
    upsets = MotionWarnings(sim.world.parameters)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(2):
            upsets.warn(sim.observe(), sim.time)
    assert [str(item.message) for item in caught] == upsets.lines == ([f"{text} at t = 0.0 s"] if text else [])
    assert bool(upsets.lines) <= is_unusual(sim.features[None], np.array([harmless_speeds(sim.world.parameters)]))
    assert not is_unusual(0.3 * sim.features[None], np.array([harmless_speeds(sim.world.parameters)]))


def test_a_boat_that_spins_is_said_with_its_rate(calm_sim):
    upsets = MotionWarnings(calm_sim.world.parameters)
    calm_sim.set_boat("a", velocity=(0, 0, 0, 0, 5, 12))
    with pytest.warns(VrxWarning, match="^a spins at 13 rad/s at t = 2.0 s, more than 12: check masses, inertias"):
        upsets.warn(calm_sim.observe(), 2.0)
    assert is_unusual(calm_sim.features[None], np.inf)
    upsets.warn(calm_sim.observe(), 3.0)
    assert len(upsets.lines) == 1


def test_touches_of_a_pair_are_one_and_the_hardest_is_first():
    touches = [Touch("a", "b", 1.0, 10.0, 0.5), Touch("a", "quay", 2.0, 30.0, 1.0), Touch("a", "b", 3.0, 20.0, 0.25)]
    assert _by_pair(touches) == (Touch("a", "quay", 2.0, 30.0, 1.0), Touch("a", "b", 1.0, 20.0, 0.75, count=2))


class Told:
    """A simulation that notes what it is told."""

    def __init__(self):
        self.told = []

    def command_all(self, commands):
        self.told.append(commands)

    def fire(self, boat, shooter=None):
        self.told.append((boat, shooter))

    def send(self, topic, content):
        self.told.append((topic, content))


@pytest.mark.parametrize(
    ("commands", "told"),
    [
        ({"a": {"left": 0.5}, "b": {}}, [{"a": {"left": 0.5}}, {"b": {}}]),
        ({"a": {"left": 0.5, "fire": False}}, [{"a": {"left": 0.5}}]),
        ({"a": {"left": 0.5, "fire": True}}, [{"a": {"left": 0.5}}, ("a", None)]),
        ({"a": {"fire": "gun"}}, [{"a": {}}, ("a", "gun")]),
        ({"task": {"/go": 1.0}}, [("/go", 1.0)]),
        ({"task": {"/go": [{"x": 1}, {"x": 2}], "/no": []}}, [("/go", {"x": 1}), ("/go", {"x": 2}), ("/no", [])]),
        ({"task": {"/go": [1.0, 2.0]}}, [("/go", [1.0, 2.0])]),
        ({"task": {"/go": [[1.0], [2.0]]}}, [("/go", [1.0]), ("/go", [2.0])]),
        ({"task": {"/go": [{"x": 1}, 2.0]}}, [("/go", [{"x": 1}, 2.0])]),
        (None, []),
    ],
)
def test_what_a_controller_returns_is_commanded_fired_and_sent(commands, told):
    sim = Told()
    obey(sim, commands)
    assert sim.told == told


def test_messages_to_the_task_that_have_no_topics_are_refused():
    with pytest.raises(CommandError) as refused:
        obey(Told(), {"task": [1.0]})
    assert str(refused.value) == "the controller sent [1.0] to the task: a mapping by topic is needed"


class Listener(Told):
    """A listener that notes events."""

    def rows(self, block):
        """Not needed."""

    def state(self, time, blob):
        """Not needed."""

    def event(self, time, text, level):
        self.told.append((round(time, 9), text, level))


def test_a_run_that_is_interrupted_says_so_and_counts_what_it_did(sim):
    def stop(_observations, time):
        if time > 0.15:
            raise KeyboardInterrupt

    listener = Listener()
    sim.attach(listener, rate=1.0)
    summary = run(sim, 1.0, controller=stop)
    sim.detach(listener)
    assert (summary.interrupted, summary.steps, listener.told) == (True, 20, [(0.2, "interrupted", "WARN")])
    assert not run(sim, 0.1).interrupted
