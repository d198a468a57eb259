"""The drag of floating docks inside MuJoCo's inertia, against a slow sum over MuJoCo's own Jacobians."""

import math
from collections import namedtuple

import mujoco
import numpy as np
import pytest

from vrx_mj.frames import rotation_matrix
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.physics.raft import block_load, moor, raft_drag
from vrx_mj.runtime.proximity import movers
from vrx_mj.runtime.simulation import Simulation

DT = 0.01
BOAT = {"boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0]}], "sensors": "none"}
RADIUS, LIFT, MASS, VOLUME = 0.72557, 0.35, 160.0, 4.0 / 3.0 * math.pi * 0.72557**3  # VRX's dock_block_4x4_dynamic


def raft(**keys):
    dock = {"name": "d", "dynamic": True, "pose": [30, 5, -0.15, 0.02, -0.03, 0.6], "layout": "X X\nXXX\n X", **keys}
    world = {"physics": {"profile": "vrx", "timestep": DT}, "sea": {"model": "none"}, "docks": [dock]}
    sim = Simulation(compile_world(world, fleet=BOAT))
    rng = np.random.default_rng(5)
    blocks = sim._live.arrays.blocks
    hinges = blocks[blocks["parent"] >= 0]
    sim.data.qpos[hinges["qpos"]] = rng.uniform(-0.1, 0.1, len(hinges))
    sim.data.qvel[blocks[0]["dof"] :][: 6 + len(hinges)] = rng.uniform(-0.02, 0.02, 6 + len(hinges))
    mujoco.mj_forward(sim.model, sim.data)
    return sim


Run = namedtuple("Run", "blocks raft_work elements element_state block_state sea qpos qvel own_waves")  # noqa: PYI024


def loads(sim):
    arrays, data = sim._live.arrays, sim.data
    run = Run(*(getattr(arrays, name) for name in Run._fields[:6]), data.qpos, data.qvel, None)
    common = run, np.zeros(0, arrays.waves.dtype), (0.0, 0.0), (0.0, 0.0), 1.0, DT
    return [np.array(block_load(i, *common)) for i in range(len(arrays.blocks))]


def dense(sim, flat):
    full = np.zeros((sim.model.nv, sim.model.nv))
    for row in range(sim.model.nv):
        start, count = sim.model.M_rowadr[row], sim.model.M_rownnz[row]
        full[row, sim.model.M_colind[start : start + count]] = flat[start : start + count]
    return np.tril(full) + np.tril(full, -1).T


def wet(height):
    """Volume [m3] and middle [m, world] of a cap of water, of a sphere whose block's middle is at `height` [m]."""
    h = RADIUS - (height + LIFT)
    volume = math.pi * h**2 * (3 * RADIUS - h) / 3
    below = 3 * (2 * RADIUS - h) ** 2 / (4 * (3 * RADIUS - h))
    return volume, height + LIFT - below


def test_the_frames_of_the_blocks_are_mujocos():
    sim = raft()
    loads(sim)
    for row, work in zip(sim._live.arrays.blocks, sim._live.arrays.raft_work, strict=True):
        body = int(row["body"])
        assert work["frame"][:3] == pytest.approx(sim.data.xpos[body], abs=1e-12)
        assert work["frame"][3:12] == pytest.approx(sim.data.xmat[body], abs=1e-12)
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(sim.model, sim.data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 1)
        assert work["frame"][12:] == pytest.approx(np.roll(velocity, 3), abs=1e-12)


def test_the_load_of_a_block_is_vrx_formula():
    sim = raft()
    for row, wrench in zip(sim._live.arrays.blocks, loads(sim), strict=True):
        body = int(row["body"])
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(sim.model, sim.data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
        spin, speed = velocity[:3], velocity[3:]
        z = sim.data.xipos[body][2]
        turn = sim.data.xmat[body].reshape(3, 3)
        top = turn @ (0.0, 0.0, LIFT)
        volume, middle = wet(z + top[2] - LIFT)
        share = volume / VOLUME * MASS
        force = np.array([0, 0, 1000 * 9.8 * volume]) - 1000 * share * speed
        force[2] = max(force[2], 0.0)
        torque = np.cross((top[0], top[1], middle - z), force) - share * 200 * (2 * RADIUS) ** 2 * spin
        assert wrench == pytest.approx(np.concatenate((force, torque)), rel=1e-9, abs=1e-6)


def test_drag_in_the_inertia_is_the_sum_over_all_blocks():
    sim = raft()
    before = np.array(sim.data.M)
    loads(sim)
    raft_drag(sim._live.arrays.blocks, sim._live.arrays.raft_work, sim.data.M, sim.model.M_rowadr)
    added = dense(sim, np.array(sim.data.M) - before)
    expected = np.zeros_like(added)
    for row in sim._live.arrays.blocks:
        body = int(row["body"])
        linear, angular = np.zeros((3, sim.model.nv)), np.zeros((3, sim.model.nv))
        mujoco.mj_jacBodyCom(sim.model, sim.data, linear, angular, body)
        top = sim.data.xmat[body].reshape(3, 3)[2, 2] * LIFT
        share = wet(sim.data.xipos[body][2] + top - LIFT)[0] / VOLUME * MASS
        expected += DT * 1000 * share * linear.T @ linear + DT * 200 * share * (2 * RADIUS) ** 2 * angular.T @ angular
    assert np.allclose(added, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    own = slice(int(sim._live.arrays.blocks[0]["dof"]), int(sim._live.arrays.blocks["dof"].max()) + 1)
    assert np.linalg.eigvalsh(added[own, own]).min() > 0.0


def test_a_block_that_leaves_the_water_fast_is_not_held_back():
    sim = raft(layout="X")
    dof = int(sim._live.arrays.blocks[0]["dof"])
    sim.data.qvel[dof : dof + 6] = (0, 0, 0.5, 0, 0, 0)  # 0.098 m/s would do
    (wrench,) = loads(sim)
    assert wrench[2] == 0.0
    assert sim._live.arrays.raft_work[0]["drag"][2, 2] == 0.0


def test_a_mooring_is_a_spring_and_a_damper_at_a_corner():
    sim = raft(mooring={"stiffness": 300.0, "damping": 70.0})
    arrays = sim._live.arrays
    loads(sim)
    work = arrays.raft_work.copy()
    for line in arrays.moorings:
        body = int(arrays.blocks["body"][line["block"]])
        wrench = np.array(moor(line, arrays.blocks, arrays.raft_work, DT))
        end = sim.data.xpos[body] + sim.data.xmat[body].reshape(3, 3) @ line["point"]
        linear = np.zeros((3, sim.model.nv))
        mujoco.mj_jac(sim.model, sim.data, linear, None, end, body)
        force = -300.0 * (end - (*line["anchor"], 0)) - (70.0 + DT * 300.0) * (linear @ sim.data.qvel)
        force[2] = 0.0
        assert wrench[:3] == pytest.approx(force)
        assert wrench[3:] == pytest.approx(np.cross(end - sim.data.xipos[body], force))
    added = sum(arrays.raft_work["drag"] - work["drag"])
    assert added[:2, :2] == pytest.approx(4 * DT * (70.0 + DT * 300.0) * np.eye(2))


def test_a_mooring_rests_where_the_dock_starts():
    dock = {"name": "d", "dynamic": True, "pose": [3, 50, 0, 0, 0, 0.6], "layout": "X X\nXXX\n X", "mooring": {}}
    sim = Simulation(compile_world({"sea": {"model": "none"}, "docks": [dock]}))
    loads(sim)
    for line in sim._live.arrays.moorings:
        assert np.array(moor(line, sim._live.arrays.blocks, sim._live.arrays.raft_work, DT))[:3] == pytest.approx(
            (0, 0, 0), abs=1e-9
        )


def test_the_sphere_around_a_dock_holds_it_at_any_angles():
    sim = raft()
    row = next(row for row in movers(sim.model) if row["qpos"] == sim._live.arrays.blocks[0]["qpos"])
    qpos = int(row["qpos"])
    middle = sim.data.qpos[qpos : qpos + 3] + rotation_matrix(sim.data.qpos[qpos + 3 : qpos + 7]) @ row["middle"]
    rng = np.random.default_rng(1)
    hinges = sim._live.arrays.blocks[1:]["qpos"]
    shapes = [g for g in range(sim.model.ngeom) if sim.model.geom(g).name.startswith("d/")]
    for _ in range(50):
        sim.data.qpos[hinges] = rng.uniform(-np.pi, np.pi, len(hinges))
        mujoco.mj_kinematics(sim.model, sim.data)
        far = np.linalg.norm(sim.data.geom_xpos[shapes] - middle, axis=1) + sim.model.geom_rbound[shapes]
        assert far.max() < row["radius"]
    assert row["radius"] < 9.0
