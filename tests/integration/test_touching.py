"""What a hull meets when it touches: the drag of floats, whatever the step, and a contact that yields."""

import functools
import json
import math

import mujoco
import numpy as np
import pytest

import vrx_mj
from integration.sailing import AFLOAT, boats, edited, simulation, water
from unit.runtime.test_loop import void
from vrx_mj.physics.flotation import flotation
from vrx_mj.physics.motion import motion, zero_wrench
from vrx_mj.physics.waves import surface_height
from vrx_mj.runtime.state import SIGNATURE

CALM_AIR = {"sea": {"model": "none"}, "wind": None}
REFERENCE = 0.001
"""The step [s] that the others are compared with."""


@functools.cache
def impulse(model, timestep):
    """Horizontal impulse [N s] that a WAM-V coasting at 2 m/s gets from a buoy ahead of its right float, in 3 s."""
    buoy = {"name": "buoy", "model": model, "pose": [3.0, 1.03, 0, 0, 0, 0]}
    sim = simulation(
        boats((0.0, 0.0, 0.0)), objects=[buoy], physics={"profile": "vrx", "timestep": timestep}, **CALM_AIR
    )
    sim.set_boat("a", pose=(0, 0, AFLOAT, 0, 0, 0), velocity=(2.0, 0, 0, 0, 0, 0))
    total = np.zeros(2)
    for _ in range(round(3.0 / timestep)):
        sim.advance(1)
        total += timestep * sim.forces("a")["contact"][:2]
    return total


SOME, OTHERS = ["surmark46104"], ["robotx_light_buoy", "mb_round_buoy_orange"]


@pytest.mark.parametrize("timestep", [0.02, 0.01, 0.005])
@pytest.mark.parametrize("model", [*SOME, *(pytest.param(model, marks=pytest.mark.slow) for model in OTHERS)])
def test_a_buoy_pushes_back_as_hard_whatever_the_step(model, timestep):
    """Drag that was solved for a free buoy alone gave 20 N s at 20 ms, 40 at 10 ms and 106 at 0.5 ms."""
    reference = impulse(model, REFERENCE)
    assert np.linalg.norm(reference) > 20.0
    assert impulse(model, timestep) == pytest.approx(reference, abs=0.1 * np.linalg.norm(reference))


def full_power(timestep):
    """How far [m] a WAM-V pushes a light buoy that is in the way of one of its floats, in 15 s at full power."""
    buoy = {"name": "buoy", "model": "robotx_light_buoy", "pose": [4.0, 1.03, 0, 0, 0, 0]}
    sim = simulation(
        boats((0.0, 0.0, 0.0)), objects=[buoy], physics={"profile": "vrx", "timestep": timestep}, **CALM_AIR
    )
    sim.step({"a": {"left": 1.0, "right": 1.0}}, duration=15.0)
    return sim.observe_object("buoy").position[:2] - (4.0, 1.03), sim.observe()["a"].position[:2]


def test_at_full_power_a_light_buoy_holds_a_boat_as_long_at_10_ms_as_at_1_ms():
    (coarse, boat), (fine, same_boat) = full_power(0.01), full_power(0.001)
    assert coarse == pytest.approx(fine, abs=0.1)
    assert boat == pytest.approx(same_boat, abs=0.25)


@pytest.mark.parametrize("timestep", [0.02, 0.002])
@pytest.mark.parametrize("model", ["surmark46104", "robotx_light_buoy"])
def test_what_nothing_touches_moves_as_with_the_drag_at_the_end_of_the_step(model, timestep):
    """Without a contact the drag in the inertia changes nothing: MuJoCo comes to the same with all of it outside."""
    buoy = {"name": "buoy", "model": model, "pose": [20.0, 0.0, 0.2, 0.3, -0.2, 0.1]}
    sim = simulation(
        boats((0.0, 0.0, 0.0)), objects=[buoy], physics={"profile": "vrx", "timestep": timestep}, **CALM_AIR
    )
    arrays, twin = sim._live.arrays, mujoco.MjData(sim.model)
    flat, row = np.empty(mujoco.mj_stateSize(sim.model, SIGNATURE)), sim._live.arrays.floats[0]
    dof = int(row["dof"])
    for _ in range(60):
        mujoco.mj_getState(sim.model, sim.data, flat, SIGNATURE)
        mujoco.mj_setState(sim.model, twin, flat, SIGNATURE)
        body = motion(twin.qpos, twin.qvel, int(row["qpos"]), dof)
        height = surface_height(arrays.waves, arrays.sea[0], body.x, body.y, sim.time)
        outside = flotation(row, arrays.elements, None, body, height, 0.0, timestep, zero_wrench()).wrench
        sim.advance(1)
        twin.xfrc_applied[row["body"]] = outside
        mujoco.mj_step(sim.model, twin)
        assert sim.data.qvel[dof : dof + 6] == pytest.approx(twin.qvel[dof : dof + 6], abs=1e-8)


def rebound(folder, timestep):
    """Of a boat that comes to a wall at 2 m/s, without water: how long [s] it touches that, the share of its speed that
    it rebounds with, and the largest force [N].
    """
    (folder / "wall.yaml").write_text("static: true\ncollisions: [{type: box, size: [20, 40, 20]}]\n", encoding="utf-8")
    wall = {"name": "wall", "model": "./wall.yaml", "pose": [20.0, 0, 0, 0, 0, 0]}
    world = water(
        objects=[wall],
        physics={"profile": "vrx", "timestep": timestep, "gravity": 0.0},
        sea={"model": "none"},
        wind=None,
    )
    (folder / "world.yaml").write_text(json.dumps(world), encoding="utf-8")
    compiled = vrx_mj.compile_world(folder / "world.yaml", fleet=boats((0.0, 0.0, 0.0)))
    sim = vrx_mj.Simulation(edited(compiled, void))
    sim.set_boat("a", pose=(0, 0, 0, 0, 0, 0), velocity=(2.0, 0, 0, 0, 0, 0))
    touching, peak = 0, 0.0
    for _ in range(round(6.0 / timestep)):
        sim.advance(1)
        force = np.linalg.norm(sim.forces("a")["contact"][:3])
        touching, peak = touching + (force > 0.0), max(peak, force)
    return touching * timestep, -sim.observe()["a"].velocity[0] / 2.0, peak


@pytest.mark.parametrize("timestep", [0.02, 0.005])
def test_a_hull_yields_for_a_third_of_a_second(tmp_path, timestep):
    """x'' + 2 zeta w x' + w^2 x = 0 from rest at 2 m/s until its force is zero, with zeta = 0.5."""
    duration, share, peak = rebound(tmp_path, timestep)
    assert duration == pytest.approx(0.3, abs=0.03)
    assert share == pytest.approx(math.exp(-0.5 * 2.0 * math.pi / 3.0 / math.sin(math.pi / 3.0)), abs=0.05)
    assert peak < 258.0 * 2.0 * 2.0 * math.pi / 0.3


BOWS = {"wamv": 2.55, "otter": 1.05, "skiff": 1.3}
"""x of what touches a wall ahead first, less some cm [m]."""


@pytest.mark.slow
@pytest.mark.parametrize("timestep", [0.01])
@pytest.mark.parametrize("robot", BOWS)
def test_boats_of_marine_meet_a_wall_as_a_mass_on_a_spring_and_a_damper(tmp_path, monkeypatch, robot, timestep):
    """With zeta = 0.5 the largest deceleration is the first, w v with w = 2.418 / 0.3 s: 1.64 g at 2 m/s.

    What is carried along in the inertia is stopped too: the force is that of m + A11, or less as the bow dips.
    """
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wall.yaml").write_text("static: true\ncollisions: [{type: box, size: [20, 40, 20]}]\n", "utf-8")
    world = {
        "name": "tank", "physics": {"profile": "marine", "timestep": timestep}, "sea": {"model": "none"},
        "wind": {"objects": []}, "objects": [{"name": "wall", "model": "./wall.yaml", "pose": [30, 0, 0, 0, 0, 0]}],
    }  # fmt: skip
    compiled = vrx_mj.compile_world(world, fleet={"robot": robot, "usv_count": 1, "positions": [{"x": 0, "y": 0}]})
    hull = compiled.parameters.hulls[0]
    mass = hull.mass + (hull.vessel.added_mass[0][0] if hull.vessel else hull.added_mass[0])
    sim = vrx_mj.Simulation(compiled)
    (boat,) = sim.boats
    sim.step(duration=5.0)
    sim.set_boat(boat, pose=(20.0 - BOWS[robot] - 0.1, 0, sim.data.qpos[2], 0, 0, 0), velocity=(2.0, 0, 0, 0, 0, 0))
    speeds, forces = [], []
    for _ in range(round(1.0 / timestep)):
        speeds.append(sim.data.qvel[0])
        sim.advance(1)
        forces.append(np.linalg.norm(sim.forces(boat)["contact"][:3]))
    touching = np.flatnonzero(forces)
    first = np.flatnonzero(np.diff(touching, append=len(forces) + 1) > 1)[0] + 1  # a bow may touch again
    share = max(forces) / (mass * 2.418 / 0.3 * speeds[touching[0]])
    assert 0.85 < share < 1.15
    assert first * timestep == pytest.approx(0.3, abs=0.03)
    assert max(forces) < 1.8 * 9.81 * mass


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("timestep", [0.005, 0.001])
def test_so_do_they_with_shorter_steps(tmp_path, monkeypatch, subtests, timestep):
    for robot in BOWS:
        with subtests.test(robot):
            test_boats_of_marine_meet_a_wall_as_a_mass_on_a_spring_and_a_damper(tmp_path, monkeypatch, robot, timestep)
