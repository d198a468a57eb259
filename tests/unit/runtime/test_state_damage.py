"""States that are damaged, or made to do harm: a StateError before any kernel reads them."""

import dataclasses
import json
import re
from dataclasses import replace

import numpy as np
import pytest

import vrx_mj
from integration.sailing import CALM, boats, water
from integration.sensing import GPS, GUN, sailing
from vrx_mj.errors import StateError
from vrx_mj.model.tables import THRUSTER_STATE
from vrx_mj.runtime.loop_arrays import is_valid_column
from vrx_mj.runtime.timing import CLOCK

BUOY = {"name": "buoy", "model": "robotx_light_buoy", "pose": [9.0, 1.0, 0.0, 0.0, 0.0, 0.0]}
CUT = "; it is damaged, or another version of vrx_mj made it: make it again"
TASK = {"type": "stationkeeping", "goal_cart": [3.0, 0.0, 0.0], "initial_state_duration": 0.5}


@pytest.fixture(scope="module")
def sim():
    made = sailing((GPS, GUN), fleet=boats((0.0, 0.0, 0.0)), objects=[BUOY], task=TASK)
    assert made.sense("a")["gps"]
    made.step(duration=1.0)
    return made


@pytest.fixture(scope="module")
def state(sim):
    return sim.get_state()


def header_of(state, **changes):
    head, _, body = state.to_bytes().partition(b"\n")
    return json.dumps(json.loads(head) | changes).encode() + b"\n" + body


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"version": True}, "version: expected a whole number, got true"),
        ({"mujoco": 1e9}, "mujoco: expected a whole number, got 1000000000"),
        ({"moving": -1}, "moving: must be at least 0, got -1"),
        ({"world": 7}, "world: expected text, got 7; put it in quotes"),
        ({"varied": {"mass": 1.25}}, "varied.mass: expected a list, got 1.25"),
        (
            {"varied": {"mäss": [2.0, 1.0]}},
            "varied.mäss.[key]: string should match pattern '^[ -~]{1,600}$', got 'mäss'",
        ),
        ({"time": 1.0}, "time: expected text, got 1; put it in quotes"),
        ({"time": "0x1p99999"}, "invalid time '0x1p99999'"),
    ],
)
def test_a_wrong_kind_in_the_header_is_named(state, changes, reason):
    block = header_of(state, **changes)
    with pytest.raises(StateError) as refused:
        vrx_mj.State.from_bytes(block)
    assert str(refused.value) == f"these {len(block)} bytes are not a saved state: {reason}"


@pytest.mark.parametrize(
    ("time", "shown"), [("inf", "inf"), ("nan", "nan"), ("-0x1p0", "-1"), ("0x1p40", "1.09951e+12")]
)
def test_a_time_that_cannot_be_is_refused(state, time, shown):
    with pytest.raises(StateError) as refused:
        vrx_mj.State.from_bytes(header_of(state, time=time))
    assert str(refused.value) == f"invalid time {shown} s of a state: from 0 to 1e+09 s is needed"


def test_more_moves_than_there_is(state):
    with pytest.raises(StateError) as refused:
        vrx_mj.State.from_bytes(header_of(state, moving=1 << 40))
    there = len(state.ours)
    assert str(refused.value) == f"the saved state is truncated: {there} of {1 << 40} bytes that move"


@pytest.mark.parametrize("deep", ["[" * 100_000, '{"a":' * 100_000])
def test_a_header_without_end_is_refused(deep):
    with pytest.raises(StateError, match=r"^these \d+ bytes are not a saved state: "):
        vrx_mj.State.from_bytes(deep.encode())


def test_files_that_are_not_there_are_named(tmp_path):
    for path in (tmp_path / "none.state", tmp_path):
        with pytest.raises(StateError, match=rf"^no saved state '{re.escape(str(path))}'$"):
            vrx_mj.State.load(path)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"ours": "text"}, "invalid ours of a state: a bytes is needed, not a str"),
        ({"mujoco": [1.0]}, "invalid mujoco of a state: a ndarray is needed, not a list"),
        ({"seed": True}, "invalid seed of a state: a int is needed, not a bool"),
        ({"time": float("nan")}, "invalid time nan s of a state: from 0 to 1e+09 s is needed"),
        ({"mujoco": np.zeros((2, 3))}, "invalid mujoco of a state: a flat array of float64 is needed"),
        ({"task": ""}, "the state does not fit this run: only one of them has a task"),
        ({"task": "[" * 99_999}, None),
        ({"task": "{}"}, None),
    ],
)
def test_a_state_of_other_kinds_is_refused_and_changes_nothing(sim, state, changes, reason):
    before = sim.get_state().sha256
    with pytest.raises(StateError) as refused:
        sim.set_state(dataclasses.replace(state, **changes))
    assert str(refused.value) == reason if reason else "\n" not in str(refused.value)
    assert sim.get_state().sha256 == before


@pytest.mark.parametrize("cut", [0, 3, -1, 1000])
def test_numbers_of_mujoco_must_be_as_many_as_it_takes(sim, state, cut):
    numbers = np.resize(state.mujoco, cut if cut >= 0 else len(state.mujoco) - 1)
    with pytest.raises(StateError) as refused:
        sim.set_state(dataclasses.replace(state, mujoco=numbers))
    needed = len(state.mujoco)
    assert str(refused.value) == f"the state has {len(numbers)} numbers of MuJoCo instead of {needed}{CUT}"


def test_a_boat_at_the_end_of_the_universe_is_refused(sim, state):
    numbers = state.mujoco.copy()
    numbers[1] = 1e300
    with pytest.raises(StateError) as refused:
        sim.set_state(dataclasses.replace(state, mujoco=numbers))
    assert str(refused.value) == "the state has a position or velocity beyond 1e+07"


# Our tables


def moments_at(sim):
    """Where the marks begin in the bytes of ours."""
    return sum(table.nbytes for table in sim._live.arrays.state_tables)


def changed(state, at, value):
    ours = bytearray(state.ours)
    ours[at : at + 8] = np.array([value]).tobytes()
    return dataclasses.replace(state, ours=bytes(ours))


@pytest.mark.parametrize("value", [-1.0, 0.5, 500.0, 1e300, np.nan])
def test_shots_and_what_lights_show_are_in_their_ranges(sim, state, value):
    """They are indices of colours, and numbers of balls."""
    marks, shots, shown = (
        moments_at(sim),
        sim._live.arrays.sensors[1].mark,
        len(sim._live.arrays.sample_clocks.device_state) - 7,
    )
    assert sim.set_state(state)
    for at, wanted in ((shots, ".*"), (shown, ".*"), (shown + 6, ".*")):
        with pytest.raises(StateError, match=wanted):
            sim.set_state(changed(state, marks + 8 * at, value))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("slot", 2),
        ("slot", -1),
        ("slot", 1 << 40),
        ("index", -1),
        ("rate", np.nan),
        ("rate", -1.0),
        ("rate", np.inf),
        ("time", np.nan),
    ],
)
def test_a_sensors_clock_that_cannot_be_is_refused(sim, state, field, value):
    """A slot is an index of the compiled loop."""
    at = moments_at(sim) + sim._live.arrays.sample_clocks.device_state.nbytes + 8 + CLOCK.fields[field][1]
    with pytest.raises(StateError, match=r"^the state has a sensor clock "):
        sim.set_state(changed(state, at, value))


def test_the_numbers_of_tables_are_finite(sim, state):
    at = sim._live.arrays.wind_state.nbytes + THRUSTER_STATE.fields["angle"][1]
    with pytest.raises(StateError) as refused:
        sim.set_state(changed(state, at, np.inf))
    assert str(refused.value) == "the state has an invalid angle in thruster_state"


def test_columns_of_tables_have_their_ranges():
    """A target is a row of waypoints: the loop does not look whether it is there."""
    counts = np.array([3, 1])
    assert is_valid_column("target", np.array([2, 0]), counts)
    for wrong in ([3, 0], [0, 1], [-1, 0], [1 << 62, 0]):
        assert not is_valid_column("target", np.array(wrong), counts)
    assert is_valid_column("held", np.array([0, 1]), counts)
    assert not is_valid_column("held", np.array([2]), counts)
    assert is_valid_column("expires", np.array([-np.inf, np.inf]), counts)
    assert not is_valid_column("expires", np.array([np.nan]), counts)
    assert is_valid_column("counter", np.array([2**64 - 1], np.uint64), counts)


# The referee's part


def told(**changes):
    return lambda task: task | changes


def in_part(part, **changes):
    return lambda task: task | {part: task[part] | changes}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (told(seen="x"), "seen: expected a whole number, got 'x'"),
        (told(seen=10**400), "seen: must be at most 9007199254740992, got a number of more than 60 digits"),
        (told(sent=[["here"]]), None),
        (told(sent=[["here", 1]]), "station-keeping takes no message 'here'; known: none"),
        (told(lines=[[0.0, 1, "INFO"]]), None),
        (in_part("sheet", phase=3), None),
        (in_part("rules", total="far"), None),
    ],
)
def test_a_wrong_kind_in_the_tasks_part_is_named(sim, state, change, reason):
    task = json.dumps(change(json.loads(state.task)))
    with pytest.raises(StateError) as refused:
        sim.set_state(dataclasses.replace(state, task=task))
    if reason is not None:
        assert str(refused.value) == f"the state of the task 'stationkeeping' is damaged: {reason}"


def test_a_state_is_taken_after_all_that(sim, state):
    sim.set_state(state)
    assert sim.get_state().sha256 == state.sha256


def test_a_world_without_a_task_takes_states_without():
    plain = vrx_mj.Simulation(vrx_mj.compile_world(water(sea=CALM, wind=None), fleet=boats((0.0, 0.0, 0.3))))
    plain.set_state(plain.get_state())


def test_what_follows_the_tables_is_not_huge_and_the_tables_are_whole(sim, state):
    size, latched = moments_at(sim), len(state.ours) - sim._live.arrays.sample_clocks.latched.nbytes
    short = replace(state, ours=state.ours[: size - 1], moving=0)
    cases = {
        "the state has a touch time that is not finite": changed(state, size - 8, np.inf),
        "the state has a sensor time beyond 1e+07": changed(state, latched, 1e7),
        f"the state has {size - 1} bytes of tables instead of {size}: it ends in or before touches{CUT}": short,
        "the state at t = 1 s is not finite": replace(state, mujoco=np.append(state.mujoco[:-1], np.nan)),
        f"invalid moving -1 of a state: from 0 to {len(state.ours)} is needed": replace(state, moving=-1),
        f"invalid moving {len(state.ours) + 1} of a state: from 0 to {len(state.ours)} is needed": replace(
            state, moving=len(state.ours) + 1
        ),
    }
    for reason, wrong in cases.items():
        with pytest.raises(StateError) as refused:
            sim.set_state(wrong)
        assert str(refused.value) == reason
    sim.set_state(changed(state, latched, 9.9e6))
    sim.set_state(state)
