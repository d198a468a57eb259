"""Channels and docks, found with lidar and cameras, give the scores that they gave when the controllers were made."""

import pytest

import vrx_mj
from vrx_mj.control import Captain, Channel
from vrx_mj.model.world import tree_of

pytestmark = [pytest.mark.slow, pytest.mark.render]
NIGHTLY = pytest.mark.nightly


def sailed(world, controller=None, seed=1):
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world), seed=seed)
    controller = controller or Captain()
    controller.reset(seed)
    return vrx_mj.run(sim, controller=controller).task


@pytest.mark.parametrize(
    ("world", "points"),
    [
        ("vrx2023/phase2/follow_path0", 33.0),  # three gates of three, in calm water
        pytest.param("vrx2023/phase2/follow_path1", 66.0, marks=NIGHTLY),  # six of six, one of them after a turn back
    ],
)
def test_every_gate_of_a_path_is_crossed(world, points):
    task = sailed(world)
    assert task.state == "finished"
    # points are whole gates: one missed costs 11 or 12, a buoy touched because another CPU rounds otherwise costs 3
    assert task.score == pytest.approx(points, abs=3.0)


@pytest.mark.parametrize(
    ("world", "seconds"),
    [
        pytest.param("vrx2019/phase2/nav_challenge1", 16.6, marks=NIGHTLY),  # wind of 8 m/s, haze
        pytest.param("vrx2019/phase2/nav_challenge2", 22.9, marks=NIGHTLY),
    ],
)
def test_a_navigation_course_is_finished(world, seconds):
    task = sailed(world)
    assert task.score < 200.0  # which is a failure
    assert task.score == pytest.approx(
        seconds, abs=8.0
    )  # s per gate: to look around once more takes 11 s, a touch 10 s


def test_a_gymkhana_is_finished_near_the_black_box():
    task = sailed("vrx2022/phase2/gymkhana0")
    assert task.num_collisions <= 1
    assert task.score == pytest.approx(20.4, abs=6.0)  # m: 10 s later at the box make 4 m


def test_the_same_pictures_give_the_same_way():
    def moved():
        sim = vrx_mj.Simulation(vrx_mj.compile_world("vrx2023/phase2/follow_path0"), seed=2)
        return vrx_mj.run(sim, 25.0, controller=Captain()).state_sha256

    assert moved() == moved()


def test_a_chart_leads_through_the_gates_of_a_boat_without_a_camera():
    world = vrx_mj.compile_world("vrx2023/phase2/follow_path0", fleet={"sensors": "none"})
    places = {item["name"]: item["pose"] for item in tree_of(world.parameters)["objects"]}
    gates = tree_of(world.parameters)["task"]["gates"]
    chart = [[dict(zip("xy", places[gate[side]], strict=False)) for side in ("left", "right")] for gate in gates]
    sim = vrx_mj.Simulation(world, seed=1)
    with pytest.warns(vrx_mj.VrxWarning, match="navigation by ground truth: the boat has no GPS"):
        task = vrx_mj.run(sim, controller=Channel(chart=chart)).task
    assert task.score == 33.0


@pytest.mark.parametrize(
    ("world", "points"),
    [
        pytest.param("vrx2019/phase2/dock1", 20.0, marks=NIGHTLY),  # a floating dock 150 m off, a wrong bay seen first
        pytest.param("vrx2019/phase2/scan_and_dock1", 30.0, marks=NIGHTLY),  # its buoy 80 m off, beyond stones
        pytest.param("vrx2022/phase2/scan_dock_deliver3", 30.0, marks=NIGHTLY),
        ("vrx2023/phase2/scan_dock_deliver4", 30.0),  # waves of gain 0.6, in which a square looks askew
    ],
)
def test_the_lights_are_read_and_the_right_bay_is_docked_in(world, points):
    task = sailed(world)
    assert task.state == "finished"
    assert task.score == points  # 10 for the lights, 20 for the bay
