"""A batch that steps free bodies by itself: MuJoCo's motion to rounding, and MuJoCo's own where anything may touch."""

import copy
import random

import numpy as np
import pytest

import vrx_mj
from integration.sailing import COEFFICIENTS, ROUGH, added_mass, boats, edited, head_on, same_bits, water
from vrx_mj.config.search import catalogue
from vrx_mj.errors import CommandError, UnknownNameError, VrxError

CLOSE = 1e-12
"""How far both engines may be apart after 10 s [m, rad], and 32 units of a far place's last digit."""
DOCK = {"name": "d", "layout": "XX\nXX", "dynamic": True, "pose": [60, 60, 0, 0, 0, 0]}
TWO = boats((0.0, 0.0, 0.3), (40.0, 0.0, 1.0), engines="fixed")
BUOYS = [{"model": "mb_round_buoy_black", "name": f"b{k}", "pose": [100.0 + 10.0 * k, 0, 0, 0, 0, 0]} for k in range(3)]


@pytest.fixture(scope="module")
def world():
    return vrx_mj.compile_world(water(objects=BUOYS), fleet=TWO)


def both(world, n=2, **more):
    """Batches of both engines."""
    return [vrx_mj.Batch(world, n, seed=3, threads=1, engine=engine, **more) for engine in ("mujoco", "free")]


def sail(batch, seconds=10.0, share=0.6):
    values = np.linspace(share, 0.2, batch.n)[:, None] * np.ones(len(batch.channels))
    batch.step(values, duration=seconds)


def apart(batches):
    """How far qpos of two batches are apart."""
    one, other = (batch.qpos for batch in batches)
    return (np.abs(one - other) - 32.0 * np.spacing(np.abs(one)) * (np.abs(one) > 100.0)).max()


def test_it_moves_as_mujoco_does_and_no_row_has_data_of_its_own(world):
    batches = both(world)
    for batch in batches:
        sail(batch)
    assert 0.0 < apart(batches) < CLOSE
    assert batches[0].qpos[0, 0] > 2.0
    assert not batches[1]._rows._data


@pytest.mark.parametrize("masses", [(60.0, 90.0, 150.0, 50.0, 60.0, 80.0), (0.0, 0.0, 150.0, 50.0, 60.0, 80.0)])
def test_added_mass_of_vrx_has_its_moment(world, masses):
    """With some in surge or sway the matrix is not symmetric; MuJoCo's loop finds the moment by substitution."""
    batches = both(edited(world, added_mass(*masses)))
    for batch in batches:
        sail(batch)
    assert apart(batches) < 10 * CLOSE


def test_a_row_is_the_same_alone_and_however_it_is_advanced(world):
    together = vrx_mj.Batch(world, 3, seed=5, threads=2, engine="free")
    alone = vrx_mj.Batch(world, 1, seed=7, threads=1, engine="free")
    together.command(np.full((3, 8), 0.5))
    alone.command(np.full((1, 8), 0.5))
    together.advance(90)
    for _ in range(9):
        alone.advance(10)
    assert same_bits(together.features[2], alone.features[0])


def test_what_varies_by_row_is_in_its_step(world):
    batches = both(world)
    for batch in batches:
        batch.vary(rows=[1], mass=1.2, thrust=0.9, waves=0.5, parameters={"b.hull.added_mass.heave": 30.0})
        batch.reset(seed=3)
        sail(batch)
    assert apart(batches) < CLOSE
    assert np.abs(batches[1].qpos[0] - batches[1].qpos[1]).max() > 0.1


@pytest.mark.parametrize(
    ("objects", "fleet"),
    [
        ([], head_on()),
        ([{"model": "mb_round_buoy_black", "name": "b", "pose": [6, 1, 0, 0, 0, 0]}],
         boats((0.0, 0.0, 0.0), engines="fixed")),
    ],
    ids=["boats", "buoy"],
)  # fmt: skip
def test_a_touch_loses_nothing(objects, fleet):
    """Two boats meet, or a boat a buoy: MuJoCo takes over before, and they part as with MuJoCo alone."""
    world = vrx_mj.compile_world(water(sea=ROUGH, objects=objects), fleet=fleet)
    batches = both(world, n=1)
    for batch in batches:
        sail(batch, 8.0, 1.0)
    assert batches[1]._rows._data
    assert apart(batches) < 1e-6
    if objects:  # the buoy is thrown out of the way
        assert np.linalg.norm(batches[0].qpos[0, :2] - (6.0, 1.0)) > 1.0
    batches[1].reset(seed=3)
    assert not batches[1]._rows._data


def test_what_may_touch_and_does_not_goes_back_to_its_own_step():
    """Boats whose bounding spheres overlap, then far apart: MuJoCo's data stay, and its step does not."""
    world = vrx_mj.compile_world(water(), fleet=boats((0.0, 0.0, 0.0), (0.0, 5.0, 0.0), engines="fixed"))
    batches = both(world, n=1)
    for batch in batches:
        sail(batch, 1.0)
        batch.set_boat("b", pose=[0.0, 60.0, 0.0, 0.0, 0.0, 0.0])
        sail(batch, 9.0)
    assert batches[1]._rows._data
    assert batches[1]._rows.stacks["broadphase"]["clearance"][0, 0] > 0.0
    assert 0.0 < apart(batches) < CLOSE


def test_a_copy_and_a_simulation_go_on_from_where_it_is(world):
    batch = vrx_mj.Batch(world, 2, seed=3, threads=1, engine="free")
    sail(batch, 2.0)
    other, sim = copy.deepcopy(batch), vrx_mj.Simulation(world)
    sim.set_state(batch.get_state(1))
    for each in (batch, other):
        each.advance(200)
    sim.advance(200)
    assert other.engine == "free"
    assert same_bits(batch.features, other.features)
    assert np.abs(sim.observe()["a"].position - batch.features[1, 0, :3]).max() < CLOSE


def test_a_boat_that_is_set_is_there(world):
    batch = vrx_mj.Batch(world, 2, seed=3, threads=1, engine="free")
    batch.set_boat("a", pose=[5, 6, 0, 0, 0, 1], rows=[1])
    assert batch.features[1, 0, :2] == pytest.approx([5, 6])
    assert batch.features[0, 0, :2] == pytest.approx([0, 0])


@pytest.mark.parametrize(
    ("more", "fleet", "told"),
    [
        ({}, boats((0, 0, 0), engines="hinged"), "2 engines .* turn on hinges; give the fleet `engines: fixed`, or"),
        ({"docks": [DOCK]}, TWO, "has a floating dock; make it `dynamic: false`, or use"),
    ],
)
def test_worlds_with_joints_are_refused_with_what_to_do(more, fleet, told):
    with pytest.raises(CommandError, match=told):
        vrx_mj.Batch(vrx_mj.compile_world(water(**more), fleet=fleet), 1, engine="free")


def test_an_engine_that_is_not_known_is_refused(world):
    with pytest.raises(UnknownNameError, match="mujoco"):
        vrx_mj.Batch(world, 1, engine="mujocco")


@pytest.mark.parametrize(("kind", "problem"), [("VectorEnv", "StationKeeping"), ("TeamVectorEnv", "Formation")])
def test_environments_take_it(kind, problem):
    seen = []
    for engine in ("mujoco", "free"):
        rows = getattr(pytest.importorskip("vrx_mj.rl"), kind)(problem, 2, threads=1, engine=engine)
        rows.reset(seed=1)
        shape = rows._core._last.shape if kind == "TeamVectorEnv" else rows.action_space.shape
        seen.append([rows.step(np.full(shape, 0.3, np.float32))[0] for _ in range(20)])
    assert np.allclose(*seen, rtol=0.0, atol=1e-6)


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::vrx_mj.VrxWarning")
def test_it_moves_as_mujoco_does_in_worlds_drawn_at_random():
    """200 worlds of the catalogue, with all seas, winds, currents and things; those that it refuses do not count."""
    rng, seen = random.Random(7), 0
    for name in rng.choices(list(catalogue("worlds")), k=200):
        sea = rng.choice([{}, {"sea": {"model": "jonswap", "sea_state": rng.randint(0, 3), "spreading": 10}}])
        marine = {"physics": {"profile": "marine"}, "current": {"speed": 0.3}} if rng.random() < 0.3 else {}
        wind = {"mean_velocity": 5.0, "var_gain": 1.0, "objects": [{"model": "wamv", "coefficients": COEFFICIENTS}]}
        try:
            made = vrx_mj.compile_world(
                {"extends": name, "task": None, "wind": wind, **sea, **marine},
                fleet={"usv_count": rng.randint(1, 3), "engines": "fixed", "thrusters": rng.choice("HTX")},
            )
            batches = both(made, n=1)
        except VrxError:
            continue
        for batch in batches:
            sail(batch)
        seen += 1
        assert apart(batches) < CLOSE, name
    assert seen > 100
