"""Every world that we ship, alone and with every fleet: it compiles, plain MuJoCo opens it, and its boats sail."""

import itertools
import re
import warnings

import mujoco
import numpy as np
import pytest

import vrx_mj
from integration.sailing import same_bits
from vrx_mj.config.search import catalogue
from vrx_mj.errors import VrxWarning
from vrx_mj.model.world import tree_of

WORLDS = list(catalogue("worlds"))
SERIES = [name for name in WORLDS if "/phase2/" in name]
"""The worlds of competitions: like the others in kind, and many. Those for practice are theirs, with other weather."""
FIRST = list({re.sub(r".*/|\d+$", "", name): name for name in reversed(SERIES)}.values())
"""The first world of a series for each kind of task, which is sailed every day; all are by night."""
SINGLE = [name for name in WORLDS if not re.search(r"/(phase2|practice)/", name)]
ROOMS = ["example_course", "my_course", "ocean_buoys", "vrx2023/sydney_regatta"]
"""Worlds into which fleets are put: a course, a dock, drifting buoys, and the other profile."""
ALONE = [(world, None) for world in SINGLE if "/" not in world]
"""The worlds of single years differ little from these."""
WITH_FLEET = [(ROOMS[0], fleet) for fleet in catalogue("fleets")]
OTHERS = ["base/vrx2023", "vrx2022/phase3/course1", "vrx2023/sydney_regatta", "vrx2023/scan_dock_deliver_task"]
"""Worlds of kinds that are not among those."""
YEARS = ("vrx2019", "vrx2022", "vrx2023")
BY_NIGHT = {
    **{year: [(world, None) for world in SINGLE if world.startswith(year) and world not in OTHERS] for year in YEARS},
    **{room: list(itertools.product([room], catalogue("fleets"))) for room in ROOMS[1:]},
}

WILD = {"no_gravity", "vrx2019/wind_test"}
"""Worlds in which nothing floats, or in gusts of 100 m/s."""
NEWTONS = 250.0
"""Of a thruster in profile vrx3 where classic ones have 1."""
KNOWN = {
    ("ocean_buoys", "usv_config"): {
        ("robotx_2018_qualifying_avoid_obstacles_buoys/surmark46104_4/link", "wamv1/base_link")
    }
}
"""The positions of usv_config are a published guide's, and those of the buoys VRX's: one boat lies across a buoy."""


@pytest.fixture(scope="module", params=[*ALONE, *WITH_FLEET], ids=lambda pair: f"{pair[0]}-{pair[1] or 'alone'}")
def world(request):
    return compiled(*request.param)


def compiled(name, fleet):
    with warnings.catch_warnings():
        if fleet:
            warnings.simplefilter("ignore", VrxWarning)  # a fleet may be far from what a world is about
        return vrx_mj.compile_world(name, fleet=fleet)


def test_plain_mujoco_opens_it_and_has_the_same_bodies(world, tmp_path):
    model = mujoco.MjModel.from_xml_path(str(world.save(tmp_path / "saved")))
    names = {model.body(number).name for number in range(model.nbody)}
    assert {f"{boat}/base_link" for boat in world.boats} <= names
    assert {item["body"] for item in tree_of(world.parameters)["objects"]} <= names
    stepping = vrx_mj.Simulation(world).model
    assert (model.nq, model.nv, model.nbody) == (stepping.nq, stepping.nv, stepping.nbody)
    assert same_bits(model.body_mass, stepping.body_mass)
    assert same_bits(model.body_inertia, stepping.body_inertia)
    assert same_bits(model.qpos0, stepping.qpos0)


def test_its_boats_lie_still_and_then_sail(world):
    task = tree_of(world.parameters)["task"] or {"durations": [0.0, 0.0, 0.0], "held": False}
    sim = vrx_mj.Simulation(world)
    start = {boat: seen.position for boat, seen in sim.observe().items()}
    sim.step(duration=10.0)
    assert np.isfinite(sim.data.qpos).all()
    if world.name in WILD:
        return
    for boat, seen in sim.observe().items():
        assert abs(seen.position[2]) < 0.6
        assert max(abs(seen.roll), abs(seen.pitch)) < 0.2
        assert np.linalg.norm((seen.position - start[boat])[:2]) < 5.0
    sim.step(duration=max(1.0, sum(task["durations"][:2]) - 9.0))  # until the task lets go of the boat
    full = NEWTONS if tree_of(world.parameters)["profile"] == "vrx3" else 1.0
    sim.step({boat: {"left": 0.6 * full, "right": 0.5 * full} for boat in sim.boats}, duration=10.0)
    assert np.isfinite(sim.data.qpos).all()
    for seen in sim.observe().values():
        assert abs(seen.position[2]) < 0.6
    assert task["held"] or not world.boats or max(seen.speed for seen in sim.observe().values()) > 0.5


def test_nothing_that_stands_in_it_moves(world):
    sim = vrx_mj.Simulation(world)
    standing = [item["body"] for item in tree_of(world.parameters)["objects"] if item["kind"] == "static"]
    before = [sim.data.body(name).xpos.copy() for name in standing]
    sim.step(duration=1.0)
    assert all(same_bits(sim.data.body(name).xpos, place) for name, place in zip(standing, before, strict=True))


def test_no_boat_starts_inside_of_something(world):
    sim = vrx_mj.Simulation(world)
    pair = (world.name, tree_of(world.parameters)["fleet"])
    assert touched_by_boats(sim) == KNOWN.get(pair, set())


def check(name, fleet, folder):
    """All that is above."""
    world = compiled(name, fleet)
    test_plain_mujoco_opens_it_and_has_the_same_bodies(world, folder)
    test_its_boats_lie_still_and_then_sail(world)
    test_nothing_that_stands_in_it_moves(world)
    test_no_boat_starts_inside_of_something(world)


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_a_world_of_another_kind_is_as_good(name, tmp_path):
    check(name, None, tmp_path)


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("kind", BY_NIGHT)
def test_so_are_the_others_of_a_year_and_those_with_any_fleet(kind, tmp_path):
    assert BY_NIGHT[kind]
    for name, fleet in BY_NIGHT[kind]:
        check(name, fleet, tmp_path / name / str(fleet))


@pytest.mark.parametrize("name", FIRST)
def test_the_first_world_of_a_series_compiles_and_runs(name):
    world = vrx_mj.compile_world(name)
    sim = vrx_mj.Simulation(world)
    assert touched_by_boats(sim) == set()
    assert (world.name, tree_of(world.parameters)["task"]["boat"]) == (name, "wamv")
    sim.step(duration=0.2)
    assert np.isfinite(sim.data.qpos).all()


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("year", YEARS)
def test_the_other_worlds_of_a_series_do_too(year):
    others = [name for name in SERIES if name.startswith(year) and name not in FIRST]
    assert len(others) > 20
    for name in others:
        test_the_first_world_of_a_series_compiles_and_runs(name)


def touched_by_boats(sim):
    return {contact_names(sim, n) for n in range(sim.data.ncon) if touches_boat(sim, n)}


def contact_names(sim, number):
    bodies = sim.model.geom_bodyid[sim.data.contact[number].geom]
    return tuple(sorted(sim.model.body(body).name for body in bodies))


def touches_boat(sim, number):
    return any(name.partition("/")[0] in sim.boats for name in contact_names(sim, number))
