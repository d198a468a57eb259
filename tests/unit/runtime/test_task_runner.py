"""A task in a simulation: when its referee looks, and places on earth and in the world."""

import pytest

import vrx_mj
from integration.sailing import CALM, water
from vrx_mj.runtime.task_runner import TaskRunner

EARTH = {"latitude": -33.722718, "longitude": 150.674031}
GOAL = [20.0, 10.0, 0.5]
TASK = {"type": "stationkeeping", "goal_cart": GOAL, "initial_state_duration": 1.0, "ready_state_duration": 1.0}


class Recorder:
    """Notes the frames of the task."""

    def __init__(self):
        self.times = []

    def frame(self, time, row, messages):
        self.times.append(round(time, 9))

    def rows(self, block):
        """Not needed."""

    def state(self, time, blob):
        """Not needed."""

    def event(self, time, text, level):
        """Not needed."""


@pytest.fixture(scope="module")
def sim():
    world = water(sea=CALM, wind=None, task=TASK, georeference=EARTH, spawn={"sensors": "none", "thrusters": "H"})
    return vrx_mj.Simulation(vrx_mj.compile_world(world))


def test_frames_come_at_the_same_times_however_the_run_is_cut(sim):
    sim.reset()
    recorder = Recorder()
    sim.attach(recorder, rate=20.0)
    for steps in (3, 1, 4, 7, 13, 2, 30):
        sim.advance(steps)
    sim.detach(recorder)
    assert recorder.times == pytest.approx([0.05 * number for number in range(13)])


def test_the_team_is_told_of_places_on_earth_and_in_the_world(sim):
    sim.reset()
    sim.advance(150)
    goal = sim.task["goal"]
    assert (goal["x"], goal["y"]) == (20.0, 10.0)
    assert goal["latitude"] == pytest.approx(EARTH["latitude"] + 10.0 / 110_900, abs=1e-6)
    assert goal["longitude"] == pytest.approx(EARTH["longitude"] + 20.0 / 92_600, abs=1e-6)


@pytest.mark.parametrize(
    "told", [3.5, "red", None, {"state": "ready"}, [1.0, 2.0], {"x": 1.0, "y": 2.0, "latitude": 5.0, "longitude": 6.0}]
)
def test_only_places_whose_latitude_is_open_are_worked_out(sim, told):
    assert on_earth(sim)(told) == told


def test_places_in_lists_are_worked_out_too(sim):
    open_place = {"x": 0.0, "y": 0.0, "latitude": None, "longitude": None}
    (found,) = on_earth(sim)([open_place])
    assert (found["latitude"], found["longitude"]) == pytest.approx((EARTH["latitude"], EARTH["longitude"]))


def on_earth(sim):
    runner = sim._task_runner
    assert isinstance(runner, TaskRunner)
    return runner._on_earth


def test_places_on_earth_are_told_to_the_task_in_the_world(sim):
    in_world, east = sim._task_runner._in_world, {**EARTH, "longitude": EARTH["longitude"] + 20.0 / 92_600}
    assert in_world({**EARTH, "altitude": 3.0, "name": "x"}) == pytest.approx({"name": "x", "x": 0.0, "y": 0.0})
    there = in_world({key: str(value) for key, value in east.items()})
    assert (there["x"], there["y"]) == pytest.approx((20.0, 0.0), abs=0.05)
    lacking = [
        {"latitude": 1.0},
        [1.0, 2.0],
        "red",
        {"latitude": "north", "longitude": 1.0},
        {**EARTH, "latitude": None},
    ]
    assert [in_world(content) for content in lacking] == lacking
