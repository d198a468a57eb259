"""Objects and docks of a batch are put somewhere, and read, by row."""

import numpy as np
import pytest

import vrx_mj
from integration.jointed import RAFT, write
from integration.sailing import ROUGH, boats, same_bits, water
from vrx_mj.errors import CommandError, UnknownNameError

VELOCITY = [0.5, 0.1, 0.0, 0.0, 0.1, 0.3]
BUOY = {"name": "buoy", "model": "surmark46104", "pose": [9, 0, 0, 0, 0, 0]}
PIER = {"name": "pier", "dynamic": True, "pose": [0, 40, 0, 0, 0, 0], "layout": "X X\nXXX"}
WHARF = {**PIER, "name": "wharf", "dynamic": False}
FLEET = boats((0.0, 0.0, 0.0), engines="fixed")


def world_of(tmp_path, profile="vrx"):
    """A boat, a buoy, a raft of links on hinges and a floating dock in waves of each seed's own."""
    raft = {"name": "raft", "model": str(write(tmp_path, "raft", RAFT)), "pose": [0, -40, 0, 0, 0, 0]}
    sea = {"model": "jonswap", "significant_height": 0.6, "peak_period": 5.0, "direction": [1, 0.5]}
    content = {"physics": {"profile": profile}, "sea": sea, "objects": [BUOY, raft], "docks": [PIER]}
    return vrx_mj.compile_world(content, fleet=FLEET)


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_what_is_put_in_a_row_moves_as_in_a_simulation(tmp_path, profile):
    world = world_of(tmp_path, profile)
    batch, sim = vrx_mj.Batch(world, 3, seed=5, threads=1), vrx_mj.Simulation(world, seed=6)
    still = vrx_mj.Batch(world, 3, seed=5, threads=1)
    for each in (batch, sim, still):
        each.step(duration=1.0)
    for x, name in enumerate(("buoy", "raft", "pier"), start=1):
        pose = [30.0 * x, -20.0, 0.3, 0.1, -0.2, 2.0]
        batch.set_object(name, pose=[pose] * 2, velocity=VELOCITY, rows=[1, 2])
        sim.set_object(name, pose=pose, velocity=VELOCITY)
        seen = sim.observe_object(name)
        expected = [*seen.position, *seen.quaternion, *seen.velocity, *seen.angular_velocity]
        assert batch.observe_object(name, [1])[0] == pytest.approx(expected, abs=1e-15)
    assert batch.get_state(1).sha256 == sim.get_state().sha256
    for each in (batch, sim, still):
        each.step(duration=0.5)
    assert batch.get_state(1).sha256 == sim.get_state().sha256
    assert batch.get_state(0).sha256 == still.get_state(0).sha256
    batch.reset(seed=5)
    still.reset(seed=5)
    assert batch.get_state(1).sha256 == still.get_state(1).sha256


@pytest.fixture(scope="module")
def course():
    return vrx_mj.compile_world(water(sea=ROUGH, objects=[BUOY], docks=[WHARF]), fleet=FLEET)


def test_the_engine_free_puts_objects_where_mujoco_has_them(course):
    batches = [vrx_mj.Batch(course, 2, seed=3, threads=1, engine=engine) for engine in ("mujoco", "free")]
    for each in batches:
        each.step(duration=1.0)
        each.set_object("buoy", pose=[20.0, 5.0, 0.5, 0.0, 0.0, 0.0], rows=[1])
        each.set_object("buoy", velocity=[0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
        each.step(duration=1.0)
    theirs, ours = (each.observe_object("buoy") for each in batches)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9)
    assert not batches[1]._rows._data
    assert theirs[1, 0] == pytest.approx(20.0, abs=1.0)
    assert theirs[0, 0] == pytest.approx(9.0, abs=1.0)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda b: b.set_object("bouy"), UnknownNameError, "no floating object named 'bouy'; did you mean 'buoy'?"),
        (lambda b: b.observe_object("a"), UnknownNameError, "no floating object named 'a'; known: buoy"),
        (lambda b: b.set_object(3), CommandError, "invalid name 3: text is needed"),
        (lambda b: b.set_object("wharf", pose=[0.0] * 6), CommandError, "wharf cannot be moved: it is fixed"),
        (lambda b: b.set_object("buoy", pose=[0.0] * 5), CommandError,
         r"invalid pose of buoy of shape \(5,\): \(2, 6\) or \(6,\), of numbers below 1e\+07, is needed"),
        (lambda b: b.set_object("buoy", pose=[0.0] * 6, velocity=[1e9] * 6), CommandError, "invalid velocity of buoy"),
        (lambda b: b.set_boat("a", pose=[9.0] * 6, velocity=[np.nan] * 6), CommandError, "invalid velocity of a"),
        (lambda b: b.set_object("buoy", rows=[2]), CommandError, r"invalid rows \[2\]: a mask of 2 booleans"),
        (lambda b: b.observe_object("buoy", [2]), CommandError, r"invalid rows \[2\]: a mask of 2 booleans"),
    ],
)  # fmt: skip
def test_what_cannot_be_put_is_told_and_changes_nothing(course, call, error, message):
    batch = vrx_mj.Batch(course, 2, threads=1)
    before, seen = batch.get_state(1).sha256, batch.qpos.copy()
    with pytest.raises(error, match=message):
        call(batch)
    assert batch.get_state(1).sha256 == before
    assert same_bits(batch.qpos, seen)


def test_a_heap_of_objects_that_has_no_room_is_refused(monkeypatch):
    names = [f"buoy{number}" for number in range(6)]
    heap = [{**BUOY, "name": name, "pose": [20.0 * k, 30, 0, 0, 0, 0]} for k, name in enumerate(names)]
    batch = vrx_mj.Batch(vrx_mj.compile_world(water(objects=heap), fleet=FLEET), 2, threads=1)
    monkeypatch.setattr("vrx_mj.runtime.stepping_models.PER_CONTACT", 10**9)
    for name in names[:4]:
        batch.set_object(name, pose=[0.0, 90.0, 0.0, 0.0, 0.0, 0.0])
    before = batch.qpos.copy()
    with pytest.raises(CommandError, match="too many contacts at one place"):
        batch.set_object(names[4], pose=[0.0, 90.0, 0.0, 0.0, 0.0, 0.0])
    assert same_bits(batch.qpos, before)
