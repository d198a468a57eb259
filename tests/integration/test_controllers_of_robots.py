"""The controllers know the boat that they steer: every robot of the catalogue comes to its goal and stays there."""

import math
import zlib

import mujoco
import numpy as np
import pytest

import vrx_mj
from unit.physics.rows import moving
from vrx_mj.config.fleet import Order
from vrx_mj.config.search import catalogue
from vrx_mj.control import Captain
from vrx_mj.control.pilot import Pilot
from vrx_mj.control.velocity import WAMV, WAMV_VRX3, VelocityKeeper, craft_of
from vrx_mj.mjcf.build import build_boat
from vrx_mj.physics.thrust import rudder_force

UNSTEERED = {"barge_4m", "barge_10m", "cylinder", "sphere"}
"""Robots without thrusters, or whose only one turns too little."""
ROBOTS = sorted({*catalogue("robots")} - UNSTEERED)
SYDNEY = {"latitude": -33.724223, "longitude": 150.679736}
PROFILES = ("vrx", "vrx3", "marine")
BY_DAY = {(robot, PROFILES[zlib.crc32(robot.encode()) % 3]) for robot in ROBOTS}
"""Each robot in one profile, by its name: its own figures, and the profiles', are what differs."""
GOAL = (60.0, 20.0)  # [m], some of it sideways; the boats start at the origin and look east


def world_of(robot, profile, **more):
    return {
        "physics": {"profile": profile},
        "sea": {"model": "none"},
        "georeference": SYDNEY,
        "spawn": {"robot": robot},
        **more,
    }


def boat(robot, profile="vrx", **fleet):
    fleet = {"robot": robot, "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}], "sensors": "none", **fleet}
    return vrx_mj.Simulation(vrx_mj.compile_world(world_of(robot, profile), fleet=fleet)).observe()["a"]


def distances(robot, profile, duration):
    """From the goal [m], ten times a second."""
    north, east = (math.degrees(metres / 6371e3) for metres in GOAL[::-1])
    goal = [
        SYDNEY["latitude"] + north,
        SYDNEY["longitude"] + east / math.cos(math.radians(SYDNEY["latitude"])),
        1.0,
    ]
    task = {
        "type": "stationkeeping",
        "goal": goal,
        "locked": False,
        "initial_state_duration": 1.0,
        "ready_state_duration": 1.0,
    }
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world_of(robot, profile, task=task)), seed=1)
    captain, name = Captain(), sim.boats[0]
    captain.reset(1)
    rows = []

    def advance(steps):
        sim.advance(steps)
        rows.append(sim.observe()[name].position[:2])

    vrx_mj.run(sim, duration, controller=captain, advance=advance)
    assert sim.task["goal"]["x"] == pytest.approx(GOAL[0], abs=0.5)
    return np.linalg.norm(np.array(rows) - GOAL, axis=1)


@pytest.mark.slow
def test_every_robot_with_thrusters_is_tried():
    assert {name for name in catalogue("robots") if not build_boat(Order(name)).thrusters} == UNSTEERED


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "profile"), sorted(BY_DAY))
def test_the_captain_brings_a_robot_to_its_goal_and_keeps_it_there(robot, profile):
    found, length = distances(robot, profile, 100.0), boat(robot, profile).hull.length
    assert found[600:].max() < 1.5 * length  # a minute is enough for all
    assert found[-1] < 1.1 * length


@pytest.mark.slow
@pytest.mark.nightly
def test_it_does_in_the_other_profiles(subtests):
    for robot in ROBOTS:
        for profile in PROFILES:
            if (robot, profile) not in BY_DAY:
                with subtests.test(robot=robot, profile=profile):
                    test_the_captain_brings_a_robot_to_its_goal_and_keeps_it_there(robot, profile)


def test_a_wam_v_is_steered_by_the_figures_of_the_gains():
    for layout in ("H", "T", "X"):
        for sensors in ("none", "vrx"):
            assert craft_of(boat("wamv", thrusters=layout, sensors=sensors)) is WAMV
    assert craft_of(boat("wamv", "vrx3")) is WAMV_VRX3
    assert craft_of(boat("wamv_stereo")) is WAMV


def test_other_boats_are_steered_by_their_own_figures():
    """CORA's and the skiff's files: masses of the links, drag of the plugin and of the YAML."""
    cora = craft_of(boat("cora"))
    assert cora.mass == pytest.approx(33_000.0, rel=0.001)
    assert cora.inertia == pytest.approx(420_000.0, rel=0.001)
    assert (cora.surge_drag, cora.sway_drag, cora.yaw_drag) == ((120, 240), (240, 2600), (400_000, 0))
    assert (cora.length, dict(cora.rudders)) == (pytest.approx(12.2), {})
    skiff = craft_of(boat("skiff"))
    assert skiff.mass == pytest.approx(60.0 + 3.0)
    assert (skiff.surge_drag, skiff.sway_drag, skiff.yaw_drag) == ((12, 18), (60, 220), (40, 60))
    assert skiff.rudders["rudder"].max_angle == pytest.approx(0.61)


RESISTS = "hull: {damping_quadratic: [0, 99.99, 10, 5, 5, 17.3], resistance: [[0, 0], [0.6, 12], [1.2, 39]]}\n"


@pytest.mark.parametrize(
    ("keys", "speed"),
    [
        (RESISTS, 1.2 * math.sqrt(48.0 / 39.0)),
        ("propellers: {left: &jet {vanishing_speed: 4}, right: *jet}\n", 1.3559),  # 48 (1 - u / 4) = 17.26 u^2
        ("propellers: {left: &jet {four_quadrant: wageningen_b4_70}, right: *jet}\n", None),
    ],
)
def test_a_boats_top_speed_is_the_one_that_it_makes(tmp_path, keys, speed):
    (tmp_path / "own.yaml").write_text(f"extends: heron\n{keys}", encoding="utf-8")
    fleet = {"robot": str(tmp_path / "own.yaml"), "boats": [{"name": "a", "pose": [0] * 6}], "sensors": "none"}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world_of("heron", "marine"), fleet=fleet))
    seen = sim.observe()["a"]
    pilot, keeper = Pilot(seen.thrusters, craft_of(seen)), VelocityKeeper(seen.thrusters, craft_of(seen))
    sim.step({"a": {"left": 1.0, "right": 1.0}}, duration=20.0)
    assert pilot.top_speed == pytest.approx(keeper.top_speed)
    assert pilot.top_speed == pytest.approx(sim.observe()["a"].velocity[0], rel=0.005)  # its trim takes the rest
    assert speed is None or pilot.top_speed == pytest.approx(speed, rel=1e-3)


def test_a_hulls_figures_are_those_of_profile_marine():
    """Of the WAM-V's forces in this profile, with the drag of flow across its hulls."""
    hull = boat("wamv", "marine").hull
    sim = vrx_mj.Simulation(
        vrx_mj.compile_world(world_of("wamv", "marine"), fleet={"robot": "wamv", "sensors": "none"})
    )
    sim.step(duration=10.0)
    vessel, (x, y, z, *_) = sim.world.parameters.hulls[0].vessel, sim.observe()["wamv"].position
    assert hull.added_mass == tuple(vessel.added_mass[axis][axis] for axis in range(6))
    for axis in (0, 1, 5):
        velocity = np.zeros(6)
        velocity[axis] = 0.8
        sim.set_boat("wamv", pose=(x, y, z, 0, 0, 0), velocity=velocity)
        force = -0.8 * (hull.drag_linear[axis] + 0.8 * hull.drag_quadratic[axis])
        drag = sim.forces("wamv")["drag"]
        drag[3:] += np.cross(hull.centre, drag[:3])  # about the origin
        assert drag[axis] == pytest.approx(force, rel=1e-3)


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
def test_the_hulls_figures_are_those_of_the_mass_matrix(engines):
    """MuJoCo's own: the last of the free joint's diagonal is the moment about the link's vertical."""
    sim = vrx_mj.Simulation(
        vrx_mj.compile_world(
            world_of("wamv", "vrx"), fleet={"engines": engines, "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]}
        )
    )
    hull, model = sim.observe()["a"].hull, sim.model
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, sim.data)
    mujoco.mj_fullM(model, sim.data, full)
    dof = int(model.body_dofadr[model.body("a/base_link").id])
    assert full[dof, dof] == pytest.approx(hull.mass + hull.added_mass[0])
    x, y, _ = hull.centre
    about_link = hull.inertia + hull.mass * (x * x + y * y) + hull.added_mass[5]
    assert full[dof + 5, dof + 5] == pytest.approx(about_link, rel=1e-3)


@pytest.mark.parametrize(("speed", "thrust"), [(1.0, 0.0), (1.5, 60.0), (0.0, 120.0)])
def test_a_rudders_slope_is_that_of_its_force(speed, thrust):
    """The kernel's force at a small angle, over the angle; the sine of 0.01 is that within 2e-5."""
    fleet = {"robot": "skiff", "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]}
    world = vrx_mj.compile_world(world_of("skiff", "vrx"), fleet=fleet)
    sim = vrx_mj.Simulation(world)
    rudder, row = sim.observe()["a"].hull.rudders["rudder"], sim._live.arrays.thrusters[1]
    force = rudder_force(row, moving(velocity=(speed, 0, 0, 0, 0, 0)), 0.01, thrust)
    assert rudder.force_slope(speed, thrust) == pytest.approx(force / 0.01, rel=1e-4)
    assert rudder.position[0] == pytest.approx(-1.2)
