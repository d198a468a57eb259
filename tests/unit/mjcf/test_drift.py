"""The mean force of waves on hulls without diffraction."""

import math
from functools import cache

import numpy as np
import pytest

from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.mjcf.drift import HullInWaves, with_drift
from vrx_mj.mjcf.flotation import outline

SEA = {"model": "regular", "height": 0.1, "period": 2.0, "ramp": 4.0}
RHO, G = 1025.0, 9.81


@cache
def run(robot, heading=0.0, timestep=0.01):
    fleet = {"robot": robot, "boats": [{"name": "a", "pose": [0.0, 0.0, 0.0, 0.0, 0.0, heading]}], "sensors": "none"}
    physics = {"profile": "marine", "gravity": G, "timestep": timestep}
    world = {"name": "tank", "physics": physics, "sea": SEA, "wind": {"objects": []}}
    return Simulation(compile_world(world, fleet=fleet))


@cache
def barge():
    """The barge of 4 x 2 m and 0.5 m of draft."""
    vessel = run("barge_4m").world.parameters.hulls[0].vessel
    own = np.diag((4100.0, 4100.0, 4100.0, 1700.0, 5800.0, 6800.0))
    weight = 4100.0 * G
    stiffness = np.diag((0.0, 0.0, RHO * G * 8.0, weight * 0.4, weight * 2.4, 0.0))
    return HullInWaves(vessel, own, stiffness, 0.0, RHO, G)


def test_an_outline_closes_and_its_normals_point_outward():
    vessel = barge().vessel
    middles, normals = outline(np.array(vessel.vertices)[np.array(vessel.triangles)], -0.2)
    assert normals.sum(axis=0) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert np.linalg.norm(normals, axis=1).sum() == pytest.approx(12.0)
    assert (middles * normals).sum() == pytest.approx(2.0 * 8.0)  # Gauss: twice the area


def test_short_waves_are_thrown_back_by_the_breadth_that_they_meet():
    """Maruo (1960): rho g / 2 per metre of amplitude squared and of breadth, of waves of half the hull's length."""
    hull = barge()
    index = int(np.searchsorted(hull.frequencies, math.sqrt(2.0 * math.pi * G / 1.0))) - 1
    row = index * hull.angles
    bow, side = hull.reflection_drift()[[row, row + hull.angles // 4]]
    assert bow == pytest.approx((0.5 * RHO * G * 2.0, 0.0, 0.0), rel=0.1, abs=1e-6 * RHO * G)
    assert side == pytest.approx((0.0, 0.5 * RHO * G * 4.0, 0.0), rel=0.1, abs=1e-6 * RHO * G)


def test_a_hull_that_throws_waves_all_around_feels_the_power_over_their_speed():
    """Waves carry power / c of momentum; those that leave alike in all directions carry none."""
    hull = barge()
    hull.excited, hull.slip = np.zeros_like(hull.excited), np.zeros_like(hull.slip)
    hull.excited[:, 2], hull.slip[:, 2] = 5000.0, 0.3
    omega = hull.waves["frequency"]
    damping = omega**3 / (4.0 * math.pi * RHO * G**3) * 2.0 * math.pi * 5000.0**2  # Newman (1962)
    force = 0.5 * damping * 0.3**2 * omega / G
    assert hull.radiation_drift()[:, :2] == pytest.approx(force[:, None] * hull.waves["direction"], rel=1e-9, abs=1e-9)
    barge.cache_clear()


def test_waves_that_a_hull_meets_as_it_goes_are_others():
    """Aranha (1994), of a force omega cos(beta), sin(beta + 1), omega sin(beta) in its table."""
    hull, (u, v) = barge(), (0.06, -0.04)

    def force(omega, beta):
        return np.stack((omega * np.cos(beta), omega**2 * np.sin(beta + 1.0), omega * np.sin(beta)), axis=1)

    def angles(waves):
        return np.arctan2(waves["direction"][:, 1], waves["direction"][:, 0])

    speed = hull.at(np.array((u, v)))
    omega, beta = speed.waves["frequency"], angles(speed.waves)
    long = np.minimum(1.0, 0.3 * omega * math.sqrt(hull.vessel.length / G) / math.hypot(u, v))  # Froude number
    along, across = long * (u * np.cos(beta) + v * np.sin(beta)), long * (u * np.sin(beta) - v * np.cos(beta))
    found = hull.met_at(speed, force(hull.waves["frequency"], angles(hull.waves)))
    expected = (1.0 - 4.0 * along)[:, None] * force(omega * (1.0 - along), beta + 2.0 * across)
    inside = (omega * (1.0 - along) < hull.frequencies[-1]) & (omega > 1.0)
    assert found[inside] == pytest.approx(expected[inside], rel=1e-3, abs=1e-3)


def test_between_every_second_frequency_a_table_is_linear_and_it_begins_at_0():
    hull = barge()
    slopes = np.random.default_rng(0).normal(size=(hull.angles, 3))
    values = np.concatenate([number * slopes for number in range(1, hull.frequencies.size + 1)])
    whole = hull.frequencies.size // 2 * 2 * hull.angles  # of one after the last of these nothing is known
    assert hull.at_all(hull.every(values))[:whole] == pytest.approx(values[:whole])


def test_a_hull_that_swings_as_it_goes_has_the_velocity_of_the_kernels():
    """A bow that rises has some of the speed ahead upward in the hull's axes; the kernels turn the whole hull."""
    speed = barge().at(np.array((0.06, -0.04)))
    through, met = speed._loads(speed.motions)[2], speed._loads(np.zeros_like(speed.motions))[2]
    small = np.abs(speed.motions).max(axis=1) < 5.0  # no resonance
    assert (through - met)[small] == pytest.approx(speed._rate[small], abs=0.02)


@pytest.mark.parametrize(("axis", "first"), [(0, 3), (1, 9)])
@pytest.mark.parametrize("tau", [0.06, -0.06])
def test_a_table_has_at_a_speed_what_the_forces_lack_there(axis, first, tau):
    hull = barge()
    speed = hull.at(tau * np.eye(2)[axis])
    most = RHO * G * 4.0 * np.array((1.0, 1.0, 4.0))
    lacks = np.clip(
        hull.met_at(speed, hull.radiation_drift() + hull.reflection_drift()) - speed.own_mean(), -most, most
    )
    table, slow = np.array(with_drift(hull, None, np.eye(6)).drift.forces)[2::2], speed.tau[:, axis].reshape(-1, 16, 1)
    found = table[..., :3] + slow * table[..., first : first + 3] + slow**2 * table[..., first + 3 : first + 6]
    assert found.reshape(-1, 3) == pytest.approx(lacks, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize(
    ("robot", "heading"), [("blueboat", 0.0), ("heron", math.pi), ("cylinder", 0.0), ("barge_4m", 0.5 * math.pi)]
)
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_hulls_drift_with_waves_as_short_as_they(robot, heading):
    """Not against them: by the forces of first order alone a Heron goes at three times the Stokes drift astern."""
    omega = math.pi
    assert speed_adrift(robot, heading) > 0.6 * omega**3 / G * 0.05**2


def speed_adrift(robot, *setup):
    sim = run(robot, *setup)
    sim.step(duration=20.0)
    before = sim.data.qpos[0]
    sim.step(duration=20.0)
    return (sim.data.qpos[0] - before) / 20.0


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_the_step_is_no_part_of_how_fast_a_boat_drifts():
    """Its velocity is that of half a step ago; with the water's of now it drifted 13 % faster than at half the step."""
    assert speed_adrift("blueboat", 0.0, 0.01) == pytest.approx(speed_adrift("blueboat", 0.0, 0.005), rel=0.01)


def test_a_hull_in_calm_water_has_no_table():
    world = {"name": "pool", "physics": {"profile": "marine"}, "sea": {"model": "none"}, "wind": {"objects": []}}
    calm = compile_world(world, fleet={"robot": "blueboat", "boats": [{"name": "a", "pose": [0.0] * 6}]})
    assert calm.parameters.hulls[0].vessel.drift is None
    assert run("blueboat").world.parameters.hulls[0].vessel.drift is not None


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_on_another_planet_waves_of_a_length_are_as_fast_as_its_gravity_makes_them():
    """Froude: under four times the gravity frequencies are doubled, and forces of waves four times as large."""
    fleet = {"robot": "barge_4m", "boats": [{"name": "a", "pose": [0.0] * 6}], "sensors": "none"}
    here, there = (
        compile_world({"name": "tank", "physics": {"profile": "marine", "gravity": g}, "sea": SEA}, fleet=fleet)
        .parameters.hulls[0].vessel.drift
        for g in (G, 4.0 * G)
    )  # fmt: skip
    assert there.step == pytest.approx(2.0 * here.step)
    shortest = [np.array(drift.forces)[-1, 0, 0] for drift in (here, there)]
    assert shortest[1] == pytest.approx(4.0 * shortest[0], rel=0.05)  # but for the damping, which is as it is


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_what_holds_for_some_steps_is_part_of_the_state():
    """A run that goes on from a state amid the steps for which the force is held, and rows of both engines."""
    sim = run("blueboat")
    sim.reset(seed=3)
    sim.advance(1234)
    state = sim.get_state()
    sim.advance(21)
    expected = sim.get_state().sha256
    other = Simulation(sim.world)
    other.set_state(state)
    other.advance(21)
    assert other.get_state().sha256 == expected
    rows, free = Batch(sim.world, 2, seed=2), Batch(sim.world, 2, seed=2, engine="free")
    for batch in (rows, free):
        batch.advance(1234)
        batch.advance(21)
    assert rows.get_state(1).sha256 == expected
    assert free.get_state(1).mujoco[:14] == pytest.approx(sim.get_state().mujoco[:14], abs=1e-11)


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_a_hull_put_elsewhere_has_the_force_of_there_at_once():
    sim = run("barge_4m")
    sim.reset(seed=3)
    sim.advance(1000)
    (boat,) = sim.boats
    before = sim.forces(boat)["drift"]
    sim.set_boat(boat, pose=(0.0, 0.0, 0.0, 0.0, 0.0, 0.5 * math.pi))
    after = sim.forces(boat)["drift"]
    assert np.linalg.norm(after[:2]) != pytest.approx(np.linalg.norm(before[:2]), rel=0.5)


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_what_holds_for_others_stays_when_a_boat_leaves():
    sim = Simulation(run("blueboat").world)
    sim.spawn("b", robot="blueboat", pose=(30.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    sim.advance(203)
    of_b = sim._live.arrays.drift_state[1:].copy()
    assert of_b["left"] > 0
    assert of_b["sway"] != 0.0
    sim.remove("a")
    assert sim._live.arrays.drift_state == of_b


def test_a_hull_moves_in_proportion_to_the_forces_of_waves_with_what_it_scatters():
    hull = barge()
    damping = np.zeros((hull.waves.size, 6, 6))
    alone = hull._free_motions(damping)
    hull.scattered = 1j * hull.excited
    assert hull._free_motions(damping) == pytest.approx((1.0 + 1j) * alone, rel=1e-9, abs=1e-12)
    barge.cache_clear()
