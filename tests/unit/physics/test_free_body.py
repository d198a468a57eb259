"""The step of a free body: what is kept without forces, MuJoCo's own step, and the solve with damping."""

import mujoco
import numpy as np
import pytest

from vrx_mj.physics.free_body import SOLVE_WORK, damped_step, free_body_row, free_step

DT, GRAVITY = 0.01, 9.8
BODY = """<mujoco><option timestep="0.01" gravity="0 0 {}"/><worldbody><body><freejoint/>
<inertial pos="0.2 -0.1 0.3" mass="40" fullinertia="5 9 11 0.5 -0.4 0.3"/></body></worldbody></mujoco>"""


@pytest.fixture
def model():
    return mujoco.MjModel.from_xml_string(BODY.format(-GRAVITY))


def row_of(model, added=None):
    data, rigid = mujoco.MjData(model), np.zeros((6, 6))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, rigid)
    added = np.zeros((6, 6)) if added is None else added
    weight = -model.opt.gravity[2] * model.body_mass[1]
    return free_body_row(rigid, added, body=1, float=-1, weight=weight, pushed=model.body_ipos[1])[0]


def started(model):
    """Data in a turned position, in motion."""
    data = mujoco.MjData(model)
    data.qpos[:] = 1.0, -2.0, 0.5, 0.5, -0.1, 0.7, 0.3
    data.qpos[3:] /= np.linalg.norm(data.qpos[3:])
    data.qvel[:] = 1.0, -0.5, 0.2, 0.4, -0.9, 0.6
    return data


def test_a_step_is_mujocos(model):
    body, data = row_of(model), started(model)
    qpos, qvel, push = data.qpos.copy(), data.qvel.copy(), np.array([30.0, -8.0, 400.0, 5.0, 3.0, -9.0])
    data.xfrc_applied[1] = push
    for _ in range(1000):
        mujoco.mj_step(model, data)
        free_step(body, qpos, qvel, push, DT)
    assert np.abs(qpos - data.qpos).max() < 1e-12 * np.abs(data.qpos).max()
    assert np.abs(qvel - data.qvel).max() < 1e-12 * np.abs(data.qvel).max()


def test_a_body_about_its_centre_of_mass_keeps_its_momentum():
    model = mujoco.MjModel.from_xml_string(BODY.format(0.0).replace("0.2 -0.1 0.3", "0 0 0"))
    body, data = row_of(model), started(model)
    qpos, qvel, start = data.qpos.copy(), data.qvel.copy(), data.qpos[:3].copy()
    for _ in range(1000):
        free_step(body, qpos, qvel, np.zeros(6), DT)
    assert np.abs(qvel[:3] - data.qvel[:3]).max() < 1e-13
    assert np.abs(qvel[3:] - data.qvel[3:]).max() > 0.1  # it tumbles
    np.testing.assert_allclose(qpos[:3], start + 1000 * DT * data.qvel[:3], rtol=0.0, atol=1e-12)


def test_without_forces_momentum_and_energy_drift_as_mujocos(model):
    """Semi-implicit Euler keeps neither of a body that turns about another point; both drift with its order."""
    model.opt.gravity[:] = 0.0
    body, data = row_of(model), started(model)
    qpos, qvel, nothing = data.qpos.copy(), data.qvel.copy(), np.zeros(6)

    def moving(place, velocity):
        own = mujoco.MjData(model)
        own.qpos[:], own.qvel[:] = place, velocity
        mujoco.mj_forward(model, own)
        mujoco.mj_subtreeVel(model, own)
        mujoco.mj_energyVel(model, own)
        return own.subtree_linvel[0] * model.body_mass[1], own.energy[1]

    momentum, energy = moving(qpos, qvel)
    for _ in range(1000):
        free_step(body, qpos, qvel, nothing, DT)
        mujoco.mj_step(model, data)
    later, drifted = moving(qpos, qvel)
    reference, theirs = moving(data.qpos, data.qvel)
    assert np.abs(later - reference).max() < 1e-13 * np.abs(momentum).max()
    assert drifted - energy == pytest.approx(theirs - energy, rel=1e-9)


def test_added_mass_is_inertia_alone(model):
    """A push from rest gives (M + A)^-1 times it."""
    added = np.diag([20.0, 60.0, 90.0, 4.0, 30.0, 25.0])
    added[1, 5] = added[5, 1] = 7.0
    model.opt.gravity[:] = 0.0
    body, qpos, qvel, push = row_of(model, added), np.array([0.0, 0, 0, 1, 0, 0, 0]), np.zeros(6), np.arange(1.0, 7.0)
    free_step(body, qpos, qvel, push, DT)
    torque = push[3:] + np.cross(model.body_ipos[1], push[:3])
    expected = DT * np.linalg.solve(row_of(model)["matrix"] + added, [*push[:3], *torque])
    assert qvel == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("inertial", ['pos="0 0 0" diaginertia="5 9 11"', None])
def test_damping_is_in_world_axes_of_the_velocity_and_alike_for_all_turns(model, inertial):
    """MuJoCo takes it on the diagonal of its coordinates: velocities in world axes, rates in body axes."""
    if inertial:  # the frame is the principal one
        text = BODY.format(-GRAVITY).replace('pos="0.2 -0.1 0.3"', inertial)
        model = mujoco.MjModel.from_xml_string(text.replace('fullinertia="5 9 11 0.5 -0.4 0.3"', ""))
    body, data, damping = row_of(model), started(model), np.array([3.0, 11.0, 2.5])
    mujoco.mj_forward(model, data)
    whole = np.zeros((6, 6))
    mujoco.mj_fullM(model, data, whole)
    whole += np.diag([3.0, 3.0, 11.0, 2.5, 2.5, 2.5])
    expected = data.qvel + DT * np.linalg.solve(whole, data.qfrc_smooth)
    qpos, qvel = data.qpos.copy(), data.qvel.copy()
    damped_step(body, np.zeros(1, SOLVE_WORK), damping, qpos, qvel, np.zeros(6), DT)
    assert bool(body["diagonal"]) == (inertial is not None)
    assert qvel == pytest.approx(expected, rel=1e-12)
