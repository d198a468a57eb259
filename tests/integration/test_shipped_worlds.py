"""Every world that we ship, alone and with every fleet: it compiles, plain MuJoCo opens it, and its boats sail."""

import itertools
import warnings

import mujoco
import numpy as np
import pytest

import vrx_mj
from integration.sailing import same_bits
from vrx_mj.config.search import catalogue
from vrx_mj.errors import VrxWarning

WORLDS = list(catalogue("worlds"))
PAIRS = [*((world, None) for world in WORLDS), *itertools.product(WORLDS, catalogue("fleets"))]

KNOWN = {
    ("ocean_buoys", "usv_config"): {
        ("robotx_2018_qualifying_avoid_obstacles_buoys/surmark46104_4/link", "wamv1/base_link")
    }
}
"""The positions of usv_config are a published guide's, and those of the buoys VRX's: one boat lies across a buoy."""


@pytest.fixture(scope="module", params=PAIRS, ids=lambda pair: f"{pair[0]}-{pair[1] or 'alone'}")
def world(request):
    name, fleet = request.param
    with warnings.catch_warnings():
        if fleet:
            warnings.simplefilter("ignore", VrxWarning)  # a fleet may be far from what a world is about
        return vrx_mj.compile_world(name, fleet=fleet)


def test_plain_mujoco_opens_it_and_has_the_same_bodies(world, tmp_path):
    model = mujoco.MjModel.from_xml_path(str(world.save(tmp_path / "saved")))
    names = {model.body(number).name for number in range(model.nbody)}
    assert {f"{boat}/base_link" for boat in world.boats} <= names
    assert {item["body"] for item in world.parameters["objects"]} <= names
    stepping = vrx_mj.Simulation(world).model
    assert (model.nq, model.nv, model.nbody) == (stepping.nq, stepping.nv, stepping.nbody)
    assert same_bits(model.body_mass, stepping.body_mass)
    assert same_bits(model.body_inertia, stepping.body_inertia)
    assert same_bits(model.qpos0, stepping.qpos0)


def test_its_boats_lie_still_and_then_sail(world):
    sim = vrx_mj.Simulation(world)
    start = {boat: seen.position for boat, seen in sim.observe().items()}
    sim.step(duration=10.0)
    for boat, seen in sim.observe().items():
        assert abs(seen.position[2]) < 0.5
        assert max(abs(seen.roll), abs(seen.pitch)) < 0.2
        assert np.linalg.norm((seen.position - start[boat])[:2]) < 5.0
    ahead = {"left": 0.6, "right": 0.5}
    sim.step(dict.fromkeys(sim.boats, ahead), duration=10.0)
    assert np.isfinite(sim.data.qpos).all()
    for seen in sim.observe().values():
        assert abs(seen.position[2]) < 0.5
    assert max(seen.speed for seen in sim.observe().values()) > 0.5


def test_nothing_that_stands_in_it_moves(world):
    sim = vrx_mj.Simulation(world)
    standing = [item["body"] for item in world.parameters["objects"] if item["kind"] == "static"]
    before = [sim.data.body(name).xpos.copy() for name in standing]
    sim.step(duration=1.0)
    assert all(same_bits(sim.data.body(name).xpos, place) for name, place in zip(standing, before, strict=True))


def test_no_boat_starts_inside_of_something(world):
    sim = vrx_mj.Simulation(world)
    touching = {contact_names(sim, n) for n in range(sim.data.ncon) if touches_boat(sim, n)}
    pair = (world.name, world.parameters["fleet"])
    assert touching == KNOWN.get(pair, set())


def contact_names(sim, number):
    bodies = sim.model.geom_bodyid[sim.data.contact[number].geom]
    return tuple(sorted(sim.model.body(body).name for body in bodies))


def touches_boat(sim, number):
    return any(name.partition("/")[0] in sim.boats for name in contact_names(sim, number))
