"""The controllers to start from finish their stock worlds, with the scores that they had when they were made."""

import numpy as np
import pytest

import vrx_mj
from vrx_mj.control import Captain
from vrx_mj.runtime.run import load_controller


def sailed(world, controller=None, seed=1):
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world), seed=seed)
    controller = controller or Captain()
    controller.reset(seed)
    return vrx_mj.run(sim, controller=controller).task


GOLDEN = {  # score with seed 1, and how far another CPU's rounding may lead from it
    "stationkeeping_task": (0.001, 0.01),  # m: a centimetre is what waves and noise make
    "vrx2022/phase2/stationkeeping5": (0.049, 0.05),  # m: wind of 8 m/s with gusts of 2 m/s
    "wayfinding_task": (0.015, 0.03),  # m: a waypoint is left with an error below 0.08 m
    "vrx2023/phase2/wayfinding2": (0.05, 0.03),
    "wildlife_task": (0.0, 5.0),  # s: 76 s less a bonus of 90 s, and no less than 0
    "vrx2023/wildlife_task": (-35.0, 10.0),  # s: without that limit
    "vrx2023/acoustic_perception_task": (2.6, 5.0),  # s: one more turn if the first estimate was poor
}


EVERYDAY = {"wayfinding_task", "vrx2022/phase2/stationkeeping5"}
SLOW = {"vrx2023/wildlife_task", "vrx2023/acoustic_perception_task"}
"""Kinds of tasks that are in no world of every day; other worlds of all these kinds are sailed by night."""
BY_NIGHT = [pytest.mark.slow, pytest.mark.nightly]


def marks(world):
    return () if world in EVERYDAY else pytest.mark.slow if world in SLOW else BY_NIGHT


@pytest.mark.slow
@pytest.mark.parametrize("world", [pytest.param(world, marks=marks(world)) for world in GOLDEN])
def test_the_captain_finishes_a_stock_world(world):
    score, slack = GOLDEN[world]
    task = sailed(world)
    assert task.state == "finished"
    assert task.score == pytest.approx(score, abs=slack)


@pytest.mark.slow
def test_a_beacon_is_followed_among_buoys():
    task = sailed("vrx2023/acoustic_tracking_task")
    assert task.num_collisions <= 4  # the buoys drift where the lidar, 1.8 m up, cannot see them: nearer than 5 m
    assert task.score - task.num_collisions == pytest.approx(2.5, abs=2.0)  # m: mean distance


@pytest.mark.slow
@pytest.mark.render
@pytest.mark.parametrize(
    "world",
    [
        "perception_task",
        pytest.param("vrx2019/phase2/perception1", marks=pytest.mark.nightly),
        pytest.param("vrx2022/phase2/perception5", marks=pytest.mark.nightly),
    ],
)
def test_landmarks_are_found(world):
    task = sailed(world)
    assert task.state == "finished"
    assert task.score < 1.5  # m; one that is missed costs 10 m over their number


@pytest.mark.slow
def test_a_boat_without_a_lateral_thruster_keeps_its_station_too():
    sim = vrx_mj.Simulation(vrx_mj.compile_world("vrx2022/phase2/stationkeeping5", fleet={"thrusters": "H"}), seed=1)
    task = vrx_mj.run(sim, controller=Captain()).task
    assert task.score == pytest.approx(0.15, abs=0.3)  # m: it pushes sideways with 100 N at most


def test_the_same_seed_gives_the_same_score():
    def moved():
        sim = vrx_mj.Simulation(vrx_mj.compile_world("vrx2022/phase2/stationkeeping5"), seed=3)
        return vrx_mj.run(sim, 30.0, controller=Captain()).state_sha256

    assert moved() == moved()


@pytest.mark.parametrize("name", ["Captain", "StationKeeper", "WaypointFollower", "WildlifeCircler", "BeaconSeeker"])
def test_a_controller_is_loaded_by_name(name):
    controller = load_controller(f"vrx_mj.control:{name}", 1)
    assert type(controller).__name__ == name


def test_a_world_without_georeference_is_sailed_by_ground_truth():
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean"), seed=1)
    start = sim.observe()["wamv"].position
    with pytest.warns(vrx_mj.VrxWarning, match="navigation by ground truth: .*the world ocean has no georeference"):
        vrx_mj.run(sim, 20.0, controller=Captain())
    assert np.hypot(*(sim.observe()["wamv"].position - start)[:2]) < 0.2
