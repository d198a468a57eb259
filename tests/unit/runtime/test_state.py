"""Saved states: what they hold, and what is refused."""

import dataclasses
import re

import numpy as np
import pytest

import vrx_mj
from integration.sailing import boats, simulation
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import StateError, VrxWarning


@pytest.fixture(scope="module")
def sim():
    return simulation()


@pytest.fixture
def state(sim):
    sim.reset()
    sim.advance(123)
    return sim.get_state()


def test_bytes_hold_the_whole_state(state):
    copy = vrx_mj.State.from_bytes(state.to_bytes())
    assert copy.sha256 == state.sha256
    assert (copy.version, copy.world, copy.seed, copy.time) == (state.version, state.world, state.seed, state.time)
    assert copy.ours == state.ours


def test_a_state_knows_its_time_and_its_world(sim, state):
    assert state.time == pytest.approx(1.23)
    assert state.world == sim.world.sha256


def test_a_state_is_a_copy(sim, state):
    before = state.sha256
    sim.advance(10)
    assert state.sha256 == before


@pytest.mark.parametrize(
    ("fleet", "parts"),
    [
        (boats((1.0, 0.0, 0.3)), r"the same bodies, but other numbers, shapes or weather"),
        (
            boats((1.0, 0.0, 0.3), (9.0, 0.0, 0.3)),
            r"\d+ numbers of MuJoCo's bodies, not \d+, \d+ bytes of tables, not \d+",
        ),
        (boats((1.0, 0.0, 0.3), thrusters="T"), r"\d+ bytes of tables, not \d+"),
    ],
)
def test_the_state_of_another_world_is_refused_with_the_parts_that_differ(sim, state, fleet, parts):
    other = simulation(fleet)
    with pytest.raises(StateError) as caught:
        other.set_state(state)
    worlds = f"the world {sim.world.sha256[:12]}, not to this one, {other.world.sha256[:12]}"
    last = "; set it in a simulation of its own world"
    assert re.fullmatch(f"the state belongs to {worlds}, and has {parts}{last}", str(caught.value))


def test_a_state_of_another_version_is_refused(sim, state):
    newer = dataclasses.replace(state, version=99)
    message = "^the state has version 99; this version of vrx_mj reads 3$"
    with pytest.raises(StateError, match=message):
        sim.set_state(newer)
    with pytest.raises(StateError, match=message):
        vrx_mj.State.from_bytes(newer.to_bytes())


def test_a_state_of_another_physics_goes_on_with_a_warning(sim, state):
    older = vrx_mj.State.from_bytes(state.to_bytes().replace(b', "physics_version": %d' % PHYSICS_VERSION, b"", 1))
    told = f"is of physics version 1, and this is {PHYSICS_VERSION}: equal runs differ"
    with pytest.warns(VrxWarning) as warned:
        sim.set_state(older)
    assert [str(each.message) for each in warned] == [f"the state at t = {state.time:g} s {told}"]
    assert sim.get_state().physics_version == PHYSICS_VERSION


def test_a_world_of_another_physics_is_loaded_with_a_warning(sim, tmp_path):
    file = sim.world.save(tmp_path).with_suffix(".json")
    told = f' "physics_version": {PHYSICS_VERSION},\n'
    file.write_text(file.read_text(encoding="utf-8").replace(told, ""), encoding="utf-8")
    with pytest.warns(VrxWarning, match=r"^the world \S+ is of physics version 1, and this is \d+: equal runs differ$"):
        assert vrx_mj.World.load(tmp_path).parameters.physics_version == 1


def test_a_refused_state_changes_nothing(sim, state):
    with pytest.raises(StateError):
        sim.set_state(dataclasses.replace(state, world="0" * 64))
    assert sim.get_state().sha256 == state.sha256


def test_a_file_that_is_no_state_is_refused(tmp_path):
    file = tmp_path / "some.state"
    for content in (b"", b"hello", b'{"version": 3}\n', b"\x00" * 100, b"[]\nx"):
        file.write_bytes(content)
        with pytest.raises(StateError, match=rf"^these {len(content)} bytes are not a saved state: "):
            vrx_mj.State.load(file)


def test_a_state_that_is_cut_off_is_refused(state):
    block = state.to_bytes()
    head = block.index(b"\n") + 1
    size = 8 * len(state.mujoco)
    with pytest.raises(StateError, match=f"^the saved state is truncated: 100 of {size} bytes$"):
        vrx_mj.State.from_bytes(block[: head + 100])


@pytest.mark.parametrize("bytes_off", [8, 1, -3])
def test_a_state_whose_tables_have_another_size_is_refused(sim, state, bytes_off):
    """Cut off by 8 bytes or 1, or 3 too long."""
    before = sim.get_state().sha256
    block = state.to_bytes() + b"xxx"
    with pytest.raises(StateError):
        sim.set_state(vrx_mj.State.from_bytes(block[: len(block) - 3 - bytes_off]))
    assert sim.get_state().sha256 == before


def test_everything_that_changes_is_in_the_fingerprint(sim, state):
    numbers, last = state.mujoco.copy(), state.moving - 1
    numbers[0] = np.nextafter(numbers[0], np.inf)
    changed = [
        dataclasses.replace(state, seed=state.seed + 1),
        dataclasses.replace(state, time=np.nextafter(state.time, np.inf)),
        dataclasses.replace(state, mujoco=numbers),
        dataclasses.replace(state, ours=state.ours[:last] + bytes([state.ours[last] ^ 1]) + state.ours[last + 1 :]),
    ]
    assert len({item.sha256 for item in (state, *changed)}) == 5


def test_a_saved_world_of_another_version_is_refused(sim, tmp_path):
    file = sim.world.save(tmp_path).with_suffix(".json")
    file.write_text(file.read_text(encoding="utf-8").replace('"format": 4', '"format": 9'), encoding="utf-8")
    with pytest.raises(StateError, match=rf"^{re.escape(str(file))} has format 9; this version reads 3 and 4$"):
        vrx_mj.Simulation.load(tmp_path)


def test_a_folder_without_a_world_is_refused(tmp_path):
    place = re.escape(str(tmp_path))
    with pytest.raises(
        StateError, match=f"^no saved world at {place}: scene.xml and scene.json are needed in {place}$"
    ):
        vrx_mj.Simulation.load(tmp_path)


def test_a_fingerprint_is_of_the_motion_the_time_and_the_task(state):
    changes = {"task": "{}", "time": state.time + 0.01, "seed": 5, "mujoco": state.mujoco + 1e-9}
    others = [dataclasses.replace(state, **{name: value}).sha256 for name, value in changes.items()]
    assert len({state.sha256, *others}) == 1 + len(changes)
    unread = dataclasses.replace(state, ours=state.ours + b"moments of sensors")
    assert unread.sha256 == state.sha256
