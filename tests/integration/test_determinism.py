"""Same world, seed and commands: the same motion to the last bit, however the run is cut up, stored or watched."""

import os
import pickle
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from integration.sailing import AHEAD, CALM, boats, edited, head_on, same_bits, simulation

ROOT = Path(__file__).resolve().parents[2]
BUOYS = [
    {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [7, 3, 0, 0, 0, 0]},
    {"name": "light", "model": "robotx_light_buoy", "pose": [-6, -8, 0.2, 0, 0, 0]},
]
STEER = {"left": 0.8, "right": -0.3, "left_angle": 0.9, "right_angle": -0.4}


def busy(engines="fixed", **more):
    """Waves, gusts, a boat and buoys."""
    return simulation(boats((0.0, 0.0, 0.3), engines=engines), objects=BUOYS, **more)


def sail(sim, seconds=5.0):
    """The fingerprint of the state after some steering, with commands that run out on the way."""
    sim.command("a", **STEER)
    sim.advance(round(seconds / sim.timestep))
    return sim.get_state().sha256


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
def test_two_simulations_sail_alike(engines):
    assert sail(busy(engines)) == sail(busy(engines))


def test_a_reset_starts_again():
    sim = busy()
    first = sail(sim)
    sim.reset()
    assert sail(sim) == first


def test_a_reset_takes_a_seed_and_keeps_no_memory_of_another():
    sim = busy(seed=3)
    sail(sim)
    sim.reset(4)
    assert sail(sim) == sail(busy(seed=4))


def test_seeds_give_different_gusts_and_nothing_else_differs():
    one, other = busy(seed=1), busy(seed=2)
    sail(one)
    sail(other)
    times = np.arange(1.0, 5.0, 0.5)
    assert np.abs(one.wind.velocity(times) - other.wind.velocity(times))[:, :2].min() > 1e-6
    assert same_bits(one.sea.height(times, 0, times), other.sea.height(times, 0, times))
    still, as_still = (simulation(wind=None, seed=seed) for seed in (1, 2))
    assert sail(still) != sail(as_still)  # the seed is part of the state
    assert same_bits(still.data.qpos, as_still.data.qpos)


WIND, MARINE = {"mean_velocity": 3.0, "var_gain": 0.0}, {"physics": {"profile": "marine"}}
LOADS = {
    "calm": {"sea": CALM, "wind": None},
    "waves of VRX": {"wind": None},
    "steady wind": {"wind": WIND},
    "gusts": {"wind": {**WIND, "var_gain": 2.0}},
    "regular waves": {"wind": None, "sea": {"model": "regular", "height": 0.4, "period": 4}, **MARINE},
    "a spectrum": {"wind": None, "sea": {"model": "pm", "significant_height": 0.4, "peak_period": 4}, **MARINE},
    "steady current": {"wind": None, "sea": CALM, "current": {"speed": 0.5}, **MARINE},
    "random current": {"wind": None, "sea": CALM, "current": {"speed": 0.5, "var_gain": 0.2}, **MARINE},
    "steady wind over marine": {"wind": WIND, "sea": CALM, **MARINE},
    "gusts of a spectrum": {"wind": {"mean_velocity": 6.0, "spectrum": "npd"}, "sea": CALM, **MARINE},
    "wind that turns at random": {"wind": {**WIND, "var_direction": 20.0}, "sea": CALM, **MARINE},
}  # fmt: skip


@pytest.mark.parametrize("loads", LOADS)
def test_a_world_knows_whether_seeds_move_its_boats(loads):
    """By what two seeds make of one boat."""
    sim, places = simulation(**LOADS[loads]), []
    for seed in (1, 2):
        sim.reset(seed)
        sim.step(duration=4.0)
        places.append(sim.row()[1:8].tobytes())
    assert sim.world.parameters.has_random_loads == (places[0] != places[1])


def test_the_winds_own_seed_is_part_of_it():
    def reseed(parameters):
        parameters["wind"]["seed"] = 99

    one, other = busy(), busy(edit=reseed)
    assert not same_bits(one.wind.velocity(2.0), other.wind.velocity(2.0))


# Continuing


MOMENTS = {
    "in a gust": (busy, 2.0),
    "before a command runs out": (busy, 0.5),
    "while a servo slews": (busy, 0.05),
    "while a hinge slews": (lambda: busy("hinged"), 0.05),
    "in a collision": (lambda: simulation(head_on()), None),
    "in a collision of boats with hinges": (lambda: simulation(head_on("hinged")), None),
}
"""Name -> (simulation, seconds to sail): every memory of a run, in its use; None: until boats touch."""


@cache
def continued_at(moment):
    """A world, a state in the middle of a run, and the fingerprint 3 s later."""
    made, seconds = MOMENTS[moment]
    sim = made()
    if seconds is None:
        while not sim.data.ncon:
            assert sim.time < 10.0
            sim.step(dict.fromkeys(sim.boats, AHEAD), duration=0.03)
    else:
        sim.command("a", **STEER)
        sim.advance(round(seconds / sim.timestep))
    state = sim.get_state()
    sim.advance(300)
    return sim.world, state, sim.get_state().sha256


@pytest.fixture(params=MOMENTS)
def continued(request):
    return continued_at(request.param)


def test_a_state_that_is_set_is_the_one_that_is_got(continued):
    world, state, _ = continued
    sim = vrx_mj.Simulation(world)
    sim.set_state(state)
    assert sim.get_state().sha256 == state.sha256


def test_a_run_continues_from_its_state(continued):
    world, state, after = continued
    sim = vrx_mj.Simulation(world)
    for _ in range(2):  # also over a run that is under way
        sim.set_state(state)
        sim.advance(300)
        assert sim.get_state().sha256 == after


def test_a_run_continues_from_a_pickle_and_a_file(continued, tmp_path):
    world, state, after = continued
    state.save(tmp_path / "run.state")
    for copy in (pickle.loads(pickle.dumps(state)), vrx_mj.State.load(tmp_path / "run.state")):
        sim = vrx_mj.Simulation(world, seed=77)
        sim.set_state(copy)
        sim.advance(300)
        assert sim.get_state().sha256 == after
        assert sim.seed == state.seed


ELSEWHERE = """
import sys, vrx_mj
for folder in sys.argv[1:]:
    sim = vrx_mj.Simulation.load(f"{folder}/world")
    sim.set_state(vrx_mj.State.load(f"{folder}/run.state"))
    sim.advance(300)
    print(sim.get_state().sha256)
"""


@pytest.mark.slow
def test_runs_continue_in_another_process(tmp_path):
    """All in one, which takes as long to start as all of them to sail."""
    after = {}
    for moment in MOMENTS:
        world, state, after[moment] = continued_at(moment)
        world.save(tmp_path / moment / "world")
        state.save(tmp_path / moment / "run.state")
    command = [sys.executable, "-c", ELSEWHERE, *after]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment, cwd=tmp_path)
    assert dict(zip(MOMENTS, done.stdout.splitlines(), strict=True)) == after


# However it is done


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
def test_a_world_from_its_folder_sails_as_the_one_in_memory(engines, tmp_path):
    sim = busy(engines)
    sim.world.save(tmp_path)
    assert vrx_mj.World.load(tmp_path).sha256 == sim.world.sha256
    assert sail(vrx_mj.Simulation.load(tmp_path)) == sail(sim)


@pytest.mark.parametrize("fleet", [boats((0.0, 0.0, 0.3)), head_on()], ids=["alone", "collision"])
def test_a_run_may_be_cut_into_steps(fleet):
    whole, single, mixed = (simulation(fleet, objects=BUOYS[1:]) for _ in range(3))
    for sim in (whole, single, mixed):
        for boat in sim.boats:
            sim.command(boat, **STEER)
    whole.advance(1000)
    for _ in range(1000):
        single.step()
    for steps in (1, 2, 3, 94, 300, 17, 583):
        mixed.advance(steps)
    assert whole.get_state().sha256 == single.get_state().sha256 == mixed.get_state().sha256


class Listener:
    """Keeps what a recorder would write."""

    def __init__(self):
        self.blocks, self.states = [], []

    def rows(self, block):
        self.blocks.append(block)

    def state(self, time, blob):
        self.states.append((time, blob))

    def event(self, time, text, level):
        pass


@pytest.mark.parametrize("rate", [1.0, 20.0, 100.0])
def test_listening_changes_nothing(rate):
    heard, alone = busy(), busy()
    listener = Listener()
    heard.attach(listener, rate=rate)
    assert sail(heard) == sail(alone)
    heard.detach(listener)
    rows = np.concatenate(listener.blocks)
    assert rows[:, 0] == pytest.approx([*(np.arange(5.0 * rate) / rate), 5.0])  # the last is where it ended
    assert listener.states
    for time, blob in listener.states:
        assert vrx_mj.State.from_bytes(blob).time == time


def test_recording_changes_nothing(tmp_path):
    recorded, alone = busy(), busy()
    with vrx_mj.record(recorded, tmp_path / "run.rrd"):
        first = sail(recorded)
    assert first == sail(alone)
    assert sail(recorded) == sail(alone)


def test_a_state_a_listener_heard_continues_the_run():
    sim = busy()
    listener = Listener()
    sim.attach(listener, rate=10.0)
    sail(sim)
    later = next(vrx_mj.State.from_bytes(blob) for time, blob in listener.states if time == pytest.approx(3.0))
    other = busy()
    other.set_state(later)
    other.advance(200)
    assert other.get_state().sha256 == sim.get_state().sha256


def test_looking_changes_nothing():
    """Queries between steps: forces, sea, wind, poses."""
    looked, alone = busy(), busy()
    for sim in (looked, alone):
        sim.command("a", **STEER)
    for _ in range(50):
        looked.forces("a")
        looked.wind.velocity([0.0, 20.0])
        looked.sea.height(np.zeros(3), 1.0, 2.0)
        looked.observe_object("buoy")
        looked.advance(4)
    alone.advance(200)
    assert looked.get_state().sha256 == alone.get_state().sha256


def test_a_small_difference_shows_in_the_fingerprint():
    def heavier(parameters):
        parameters["hulls"][0]["density"] *= 1 + 1e-15

    world = busy(sea=CALM).world
    assert sail(vrx_mj.Simulation(world)) != sail(vrx_mj.Simulation(edited(world, heavier)))
