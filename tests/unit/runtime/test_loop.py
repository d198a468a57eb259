"""The compiled loop against MuJoCo's own `mj_step`, stage by stage."""

import math
import re

import mujoco
import numpy as np
import pytest

import kernels
import vrx_mj
from integration.sailing import AHEAD, added_mass, boats, edited, head_on, same_bits, simulation, water
from integration.sensing import GUN, sailing
from vrx_mj.model.world import tree_of
from vrx_mj.runtime.loop import LOOPS
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.state import SIGNATURE

NONE = added_mass(0, 0, 0, 0, 0, 0)
FLEETS = {
    "fixed engines": boats((0.0, 0.0, 0.3)),
    "hinged engines": boats((0.0, 0.0, 0.3), engines="hinged", thrusters="T"),
    "a collision": head_on(),
    "a collision with hinges": head_on("hinged"),
}
BUOY = {"name": "buoy", "model": "dock_block_2x2", "pose": [20, 20, 1.0, 0.3, 0, 0]}


def nothing_in_the_inertia(parameters):
    """No added mass of hulls and no drag of floats: both are parts of the inertia here."""
    NONE(parameters)
    for item in parameters["floats"]:
        item.update(linear_drag=0.0, angular_drag=0.0)


def void(parameters):
    """Water without weight or drag."""
    for hull in parameters["hulls"]:
        hull.update(density=0.0, drag_linear=[0.0] * 6, drag_quadratic=[0.0] * 6)


@pytest.mark.parametrize("fleet", FLEETS.values(), ids=FLEETS)
def test_a_step_is_mj_step_where_nothing_is_added_to_the_inertia(fleet):
    sim = simulation(fleet, edit=nothing_in_the_inertia, objects=[BUOY])
    twin = mujoco.MjData(sim.model)
    flat = np.empty(mujoco.mj_stateSize(sim.model, SIGNATURE))
    touched = 0
    for _ in range(700):
        mujoco.mj_getState(sim.model, sim.data, flat, SIGNATURE)
        sim.step(dict.fromkeys(sim.boats, AHEAD))
        mujoco.mj_setState(sim.model, twin, flat, SIGNATURE)
        twin.xfrc_applied[:], twin.qfrc_applied[:] = sim.data.xfrc_applied, sim.data.qfrc_applied
        mujoco.mj_step(sim.model, twin)
        for name in ("qpos", "qvel", "qacc", "time", "qacc_warmstart"):
            assert same_bits(getattr(sim.data, name), getattr(twin, name)), (name, sim.time)
        touched += sim.data.ncon > 0
    assert (touched > 0) == (len(sim.boats) == 2)


def test_added_mass_makes_the_boat_heavier_by_itself():
    """F = (m + A) a: a force of 100 N on a boat without weight, water or drag, which has 258 kg and carries 42 kg."""

    def in_a_void(parameters):
        added_mass(42, 0, 0, 0, 0, 0)(parameters)
        void(parameters)
        for thruster in parameters["thrusters"]:
            thruster.update(mapping=0, max_forward=50.0)

    world = {"physics": {"profile": "vrx", "timestep": 0.01, "gravity": 0.0}, "sea": {"model": "none"}, "wind": None}
    fleet = {"boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}], "thrusters": "H", "sensors": "none"}
    sim = simulation(fleet, edit=in_a_void, **world)
    before = sim.data.qvel[:3].copy()
    sim.step({"a": {"left": 1.0, "right": 1.0}})
    pushed = sim.data.qvel[:3] - before
    turned = sim.data.qacc[4]
    height = tree_of(sim.world.parameters)["hulls"][0]["body_com"][2]
    # of the centre of mass: a + alpha x r, where the added mass pulls at the origin
    com = pushed[0] / 0.01 + turned * height
    assert 258.0 * com + 42.0 * pushed[0] / 0.01 == pytest.approx(100.0)


def test_a_step_draws_one_gust_and_advances_the_clock_by_the_timestep():
    sim = simulation()
    for step in range(1, 101):
        sim.advance(1)
        assert sim._live.arrays.wind_state["counter"][0] == step
    assert sim.time == pytest.approx(1.0, abs=1e-12)


def test_poses_of_all_bodies_follow_the_step():
    """`xpos` and `xquat` are those of `qpos` after each call, not of the step before."""
    sim = simulation(FLEETS["hinged engines"])
    sim.step({"a": {"left": 1.0, "left_angle": 1.0}}, duration=1.0)
    fresh = mujoco.MjData(sim.model)
    fresh.qpos[:] = sim.data.qpos
    mujoco.mj_kinematics(sim.model, fresh)
    assert same_bits(sim.data.xpos, fresh.xpos)
    assert same_bits(sim.data.xquat, fresh.xquat)


def test_added_mass_in_sway_is_felt_by_a_hull_that_surges_while_it_yaws():
    """A (omega x v), as in VRX: 42 kg in sway at r u = 0.5 rad/s 2 m/s, to port."""

    def turning(parameters):
        added_mass(0, 42, 0, 0, 0, 0)(parameters)
        void(parameters)

    world = {"physics": {"profile": "vrx", "timestep": 0.01, "gravity": 0.0}, "sea": {"model": "none"}, "wind": None}
    sim = simulation(boats((0.0, 0.0, 0.0)), edit=turning, **world)
    sim.set_boat("a", velocity=(2.0, 0.0, 0.0, 0.0, 0.0, 0.5))
    sim.advance(1)
    _, sway, heave = sim.data.xfrc_applied[sim.model.body("a/base_link").id][:3]  # ahead: VRX's thrust at no command
    assert (sway, heave) == (pytest.approx(42.0), 0.0)


def test_a_row_with_half_the_thrust_is_pushed_half_as_hard():
    world = vrx_mj.compile_world(water(sea={"model": "none"}, wind=None), fleet=boats((0.0, 0.0, 0.0)))
    batch = vrx_mj.Batch(world, 3, seed=1, threads=1)
    batch.vary(thrust=[0.0, 0.5, 1.0])
    batch.reset(seed=1)
    batch.step(np.tile([float(name in {"left", "right"}) for _, name in batch.channels], (3, 1)), duration=0.01)
    surge = batch.features[:, 0, 7]
    assert surge[2] - surge[0] > 1e-3
    assert surge[1] - surge[0] == pytest.approx(0.5 * (surge[2] - surge[0]), rel=1e-6)


def test_nothing_acts_on_a_ball_that_waits():
    sim = sailing((GUN,), sea={"model": "none"}, wind=None, fleet=boats((0.0, 0.0, 0.0)))
    ball = sim.model.body("a/gun/link").id
    sim.advance(10)
    assert not sim.data.xfrc_applied[ball].any()
    assert sim.fire("a")
    sim.step(duration=2.0)  # it has fallen into the water
    assert sim.data.xfrc_applied[ball].any()


SPHERE = """<robot name="ball"><link name="base_link">
<inertial><mass value="200"/><inertia ixx="30" iyy="30" izz="30" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="2 1 0.5"/></geometry></collision>
</link></robot>"""
"""A boat whose frame is its principal one: MuJoCo would keep only the diagonal of its inertia."""


def test_added_mass_of_a_boat_whose_inertia_is_diagonal(tmp_path):
    """F = R (m + A) R^T a and T = (I + A) alpha, though the boat is turned and its inertia isotropic."""
    (tmp_path / "ball.urdf").write_text(SPHERE, encoding="utf-8")
    (tmp_path / "fleet.yaml").write_text(
        "boats: [{name: a, robot: ./ball.urdf, pose: [0, 0, 0, 0, 0, 0.7]}]", encoding="utf-8"
    )
    with pytest.warns(vrx_mj.VrxWarning):
        world = vrx_mj.compile_world(
            {"physics": {"profile": "vrx", "gravity": 0.0}, "sea": {"model": "none"}}, fleet=tmp_path / "fleet.yaml"
        )

    def heavy_sideways(parameters):
        void(parameters)
        added_mass(0, 300, 0, 0, 0, 70)(parameters)

    sim = vrx_mj.Simulation(edited(world, heavy_sideways))
    sim.data.qfrc_applied[:6] = 100.0, 0.0, 0.0, 0.0, 0.0, 50.0
    sim.advance(1)
    along, across = math.cos(0.7) / 200.0, -math.sin(0.7) / 500.0
    expected = [along * math.cos(0.7) - across * math.sin(0.7), along * math.sin(0.7) + across * math.cos(0.7)]
    assert sim.data.qvel[:2] == pytest.approx(np.multiply(expected, 100.0 * 0.01), rel=1e-9)
    assert sim.data.qvel[5] == pytest.approx(50.0 * 0.01 / (30 + 70), rel=1e-9)


def test_an_inertia_that_mujoco_keeps_as_a_diagonal_is_refused(tmp_path):
    scene = simulation(FLEETS["fixed engines"]).world.save(tmp_path)
    own = '<inertial pos="0 0 0" mass="9" diaginertia="3 2 1"/>'
    scene.write_text(re.sub(r"<inertial pos=[^>]*fullinertia=[^>]*>", own, scene.read_text("utf-8")), encoding="utf-8")
    with pytest.raises(vrx_mj.VrxError) as caught:
        vrx_mj.Simulation.load(tmp_path)
    assert str(caught.value) == (
        "body a/base_link: invalid inertia: MuJoCo keeps only its diagonal; turn its `inertial` by a `quat`"
    )


def test_many_waves_at_a_time_change_no_bit(monkeypatch):
    """The loop that takes them one by one, in which floats and floating docks feel them too."""
    sea = {"model": "jonswap", "significant_height": 0.5, "peak_period": 4.0, "components": 21}
    dock = {"name": "raft", "layout": "XXX", "pose": [-30, 0, 0, 0, 0, 0.3], "dynamic": True}
    described = {"physics": {"profile": "vrx"}, "sea": sea, "objects": [BUOY], "docks": [dock]}
    world = vrx_mj.compile_world(described, fleet=boats((0.0, 0.0, 0.3)))
    found = []
    assert vrx_mj.Simulation(world)._live.arrays.loop == 2
    for loop in (2, 1):
        monkeypatch.setattr(LoopArrays, "loop", loop)
        sim, batch = vrx_mj.Simulation(world, seed=5), vrx_mj.Batch(world, 2, seed=5, threads=1)
        sim.step(duration=1.0)
        batch.advance(round(sim.time / sim.timestep))
        found.append((sim.state_sha256, batch.qpos.tobytes()))
        assert same_bits(batch.qpos[0], sim.data.qpos)
    assert found[0] == found[1]


def test_each_loop_is_compiled_at_the_start_of_the_tests():
    worlds = [kernels.world_of(*water) for water in kernels.WATERS]
    assert {vrx_mj.Simulation(world)._live.arrays.loop for world in worlds} == {*range(len(LOOPS))}
