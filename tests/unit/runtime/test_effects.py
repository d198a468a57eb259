"""The list of effects: on every kind of hull, `Simulation.forces` and the loop have all of it, and no more."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import mujoco
import numpy as np
import pytest

import vrx_mj
from vrx_mj.runtime.effects import EFFECTS, Hulls

KINDS = {
    "vrx": ("vrx", "wamv", Hulls.STATIONS),
    "vrx3": ("vrx3", "wamv", Hulls.STATIONS),
    "marine, stations": ("marine", "wamv_stereo", Hulls.STATIONS),
    "marine, mesh": ("marine", "wamv", Hulls.VESSELS),
    "marine, panels of Capytaine": ("marine", "barge_4m", Hulls.VESSELS),
}
"""Profile and robot of a hull of every kind."""
WITH_A_DUMMY = """
from vrx_mj.physics import kernel

kept, composed = kernel._cache_of, {__name__, *(f"vrx_mj.runtime.{name}" for name in ("effects", "loop", "rows"))}
kernel._cache_of = lambda function, form="": (
    kernel.Uncached() if function.__module__ in composed else kept(function, form)
)

from vrx_mj.physics.motion import Wrench
from vrx_mj.runtime import effects, forces

dummy = effects.Effect("dummy", effects.Hulls.ALL, lambda hull, now, a: Wrench(900.0, 70.0, 80.0, 10.0, 20.0, 30.0))
effects.EFFECTS = forces.EFFECTS = (*effects.EFFECTS, dummy)
effects._loads_on_stations = effects._sum_on(effects.Hulls.STATIONS)
effects._loads_on_vessel = effects._sum_on(effects.Hulls.VESSELS)

import test_effects as tests

for kind, (profile, robot, _) in tests.KINDS.items():
    tests.test_forces_are_the_effects_on_the_hull_and_add_up_to_what_the_loop_applies(kind)
    sim = tests.simulation(profile, robot)
    assert sim.forces(sim.boats[0])["dummy"][:3].tolist() == [900.0, 70.0, 80.0], kind
    print(kind)
    if kind == "vrx":
        batch = tests.vrx_mj.Batch(sim.world, 2, threads=1)
        sim.advance(10)
        batch.advance(10)
        assert batch.qpos[1].tolist() == sim.data.qpos.tolist()
        print("row")
"""
"""A program that adds an effect on all hulls to the list before it is composed, and looks for its force on every kind.

Only kernels that are composed of the list are compiled: by numba's quickest way, and without a cache.
"""


def simulation(profile, robot):
    wind = {"mean_velocity": 6.0, "direction": 40.0, "objects": [{"model": robot, "coefficients": [0.5, 0.5, 0.33]}]}
    world = {"name": "bay", "physics": {"profile": profile}, "sea": {"model": "none"}, "wind": wind}
    return vrx_mj.Simulation(vrx_mj.compile_world(world | {"spawn": {"robot": robot}}))


def lever_of(sim, boat):
    """From the boat's centre of mass to that of its hull [m], about which MuJoCo applies forces."""
    data, body = mujoco.MjData(sim.model), sim.model.body(f"{boat}/base_link").id
    data.qpos[:] = sim.data.qpos
    mujoco.mj_kinematics(sim.model, data)
    mujoco.mj_comPos(sim.model, data)
    return data.xipos[body] - data.subtree_com[body]


@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
@pytest.mark.parametrize("kind", KINDS)
def test_forces_are_the_effects_on_the_hull_and_add_up_to_what_the_loop_applies(kind):
    """Forces and torques. On a boat that goes straight ahead in calm water, added mass acts by its acceleration."""
    profile, robot, hulls = KINDS[kind]
    sim = simulation(profile, robot)
    (boat,) = sim.boats
    sim.step(duration=1.0)
    sim.set_boat(boat, velocity=(1.5, 0.0, 0.0, 0.0, 0.0, 0.0))
    before, forces = sim.get_state(), sim.forces(boat)
    lever = lever_of(sim, boat)
    assert sim.get_state().sha256 == before.sha256
    named = {effect.name for effect in EFFECTS if effect.hulls & hulls} - {"added_mass_bias"}
    assert named <= set(forces) <= named | {"gravity", "thrust", "contact", "rudder", "sail"}
    sim.advance(1)
    applied = sim.data.xfrc_applied[sim.model.body(f"{boat}/base_link").id].copy()
    applied[3:] += np.cross(lever, applied[:3])
    acting = sum(wrench for name, wrench in forces.items() if name not in ("gravity", "contact"))
    assert acting == pytest.approx(applied, rel=1e-9, abs=1e-6)
    assert abs(applied[3:]).max() > 5.0
    assert all(abs(forces[name][:3]).max() > 1.0 for name in named - {"radiation", "diffraction", "drift"})


@pytest.mark.slow
def test_a_new_effect_acts_on_every_kind_of_hull_in_the_loop_in_forces_and_in_rows():
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", WITH_A_DUMMY],
        env=os.environ | {"NUMBA_OPT": "0"}, cwd=Path(__file__).parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    kinds = list(KINDS)
    assert done.stdout.splitlines() == [kinds[0], "row", *kinds[1:]], done.stderr


def test_no_hull_has_two_effects_of_one_name():
    for kind in (Hulls.STATIONS, Hulls.VESSELS):
        names = Counter(effect.name for effect in EFFECTS if effect.hulls & kind)
        assert set(names.values()) == {1}
