"""`sim.forces(boat).total` is the rate of change of the boat's momentum in the step to come.

The momentum is MuJoCo's, from the Jacobians of its bodies and the accelerations that the step found: a second way
to the same numbers, which knows nothing of our tables.
"""

import mujoco
import numpy as np
import pytest

from integration.sailing import AHEAD, GUSTY, added_mass, boats, head_on, simulation

NONE = added_mass(0, 0, 0, 0, 0, 0)
SWELL = {"model": "pms", "gain": 1.0, "period": 6.0, "scale": 2.5, "tau": 0.5}


def momentum_rate(sim, before, acceleration, boat):
    """(6,): rate of change of linear [N] and angular momentum [N m], about the boat's centre of mass, world axes."""
    model, data = sim.model, mujoco.MjData(sim.model)
    data.qpos[:], data.qvel[:] = before
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    root = model.body(f"{boat}/base_link").id
    center = data.subtree_com[root]
    total = np.zeros(6)
    for body in np.flatnonzero(model.body_rootid == root):
        push, spin = com_motion(model, data, body, acceleration)
        force = model.body_mass[body] * push
        total += [*force, *(spin + np.cross(data.xipos[body] - center, force))]
    return total


def com_motion(model, data, body, acceleration):
    """Acceleration [m/s2] of a body's centre of mass and rate of its angular momentum [N m] about it."""
    linear, angular, rate, angular_rate = (np.zeros((3, model.nv)) for _ in range(4))
    mujoco.mj_jacBodyCom(model, data, linear, angular, body)
    mujoco.mj_jacDot(model, data, rate, angular_rate, data.xipos[body], body)
    push = linear @ acceleration + rate @ data.qvel
    alpha = angular @ acceleration + angular_rate @ data.qvel
    omega = angular @ data.qvel
    axes = data.ximat[body].reshape(3, 3)
    inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
    return push, inertia @ alpha + np.cross(omega, inertia @ omega)


def step_and_compare(sim, boat="a"):
    """What `forces` says before a step, and the rate of momentum in it."""
    before = sim.data.qpos.copy(), sim.data.qvel.copy()
    forces = sim.forces(boat)
    mujoco.mj_kinematics(sim.model, sim.data)
    mujoco.mj_comPos(sim.model, sim.data)
    root = sim.model.body(f"{boat}/base_link").id
    assert forces.center == pytest.approx(sim.data.subtree_com[root], abs=1e-12 * np.abs(before[0]).max())
    sim.advance(1)
    return forces, momentum_rate(sim, before, sim.data.qacc.copy(), boat)


@pytest.mark.parametrize("engines", ["fixed", "hinged"])
@pytest.mark.parametrize("thrusters", ["H", "T", "X"])
def test_force_and_torque_are_the_rate_of_momentum(engines, thrusters):
    fleet = boats((3.0, -2.0, 0.4), engines=engines, thrusters=thrusters)
    sim = simulation(fleet, sea=SWELL, wind=GUSTY, edit=NONE)
    names = [name for name in sim.command_names("a") if not name.endswith("_angle")]
    sim.set_boat("a", pose=(3, -2, 0.1, 0.2, -0.1, 0.4), velocity=(2, 0.5, 0.3, 0.2, -0.3, 0.4))
    command = {name: 0.9 - 0.4 * k for k, name in enumerate(names)}
    for _ in range(50):
        sim.step({"a": {**command, f"{names[0]}_angle": 0.6}}, duration=0.05)
        forces, rate = step_and_compare(sim)
        np.testing.assert_allclose(forces.total, rate, rtol=1e-9, atol=1e-6)  # of 2,500 N and as many N m


def test_each_effect_has_a_name_and_none_is_nothing_here():
    sim = simulation(sea=SWELL)
    sim.step({"a": AHEAD}, duration=3.0)
    forces = sim.forces("a")
    assert list(forces) == ["gravity", "hydrostatics", "drag", "wind", "thrust", "contact"]
    assert [name for name, wrench in forces.items() if not wrench.any()] == ["contact"]
    assert list(forces.inertial) == ["added_mass"]
    assert forces.total == pytest.approx(sum(forces.values()))


def check_added_mass(sim):
    """In the step to come, all forces and added mass at its acceleration are the rate of momentum."""
    state = sim.get_state()
    forces, rate = step_and_compare(sim)
    found = sim.data.qacc.copy()
    sim.set_state(state)
    sim.data.qacc[:] = found
    added = sim.forces("a").inertial["added_mass"]
    np.testing.assert_allclose(forces.total + added, rate, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("values", [(0, 0, 0.1, 0.1, 0.1, 0), (20, 60, 40, 20, 40, 60)])
def test_added_mass_is_what_remains(values):
    sim = simulation(sea=SWELL, edit=added_mass(*values))
    sim.set_boat("a", velocity=(1.5, 0.5, 0.3, 0.2, -0.3, 0.4))
    for _ in range(20):
        sim.step({"a": AHEAD}, duration=0.05)
        check_added_mass(sim)


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
@pytest.mark.parametrize("robot", ["wamv", "barge_4m", "wamv_hydro", "blueboat", "skiff"])
def test_added_mass_is_what_remains_in_a_sea_and_a_current(robot):
    physics, current = {"profile": "marine"}, {"speed": 0.5, "direction": 70.0}
    boat = {"name": "a", "robot": robot, "pose": [0, 0, 0, 0, 0, 0.3]}
    fleet = {"boats": [boat], "sensors": "none", "engines": "hinged"}
    sim = simulation(fleet, sea=SWELL, physics=physics, current=current)
    sim.set_boat("a", velocity=(1.5, 0.5, 0.1, 0.2, -0.1, 0.4))
    for _ in range(10):
        sim.step({"a": dict.fromkeys(sim.command_names("a"), 0.5)}, duration=0.05)
        check_added_mass(sim)


def test_contact_forces_of_two_boats_are_equal_and_opposite():
    sim = simulation(head_on(), sea={"model": "none"}, wind=None)
    seen = 0
    for _ in range(600):
        sim.step({"a": AHEAD, "b": AHEAD})
        one, other = (sim.forces(boat)["contact"][:3] for boat in "ab")
        seen += bool(one.any())
        np.testing.assert_allclose(one, -other, atol=1e-9 * max(1.0, np.abs(one).max()))
    assert seen > 20
