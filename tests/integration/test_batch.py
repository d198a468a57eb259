"""A batch's rows are simulations, to the last bit, whatever the number of rows and threads."""

import contextlib
import copy
import inspect
import multiprocessing
import os
import threading

import mujoco
import numpy as np
import pytest

import vrx_mj
from vrx_mj.errors import CommandError, DivergedError, StateError, UnknownNameError

VRX = {"profile": "vrx"}
SEA = {
    "extends": "ocean_buoys",
    "sea": {"gain": 0.6},
    "wind": {
        "direction": 30, "mean_velocity": 5.0, "var_gain": 2.0, "var_time": 2.0,
        "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}],
    },
}  # fmt: skip
FLEET = {
    "thrusters": "H",
    "sensors": "none",
    "boats": [
        {"name": "fixed", "pose": [0, 0, 0.1, 0, 0, 0]},
        {"name": "hinged", "pose": [0, 30, 0.1, 0, 0, 0], "engines": "hinged"},
    ],
}
COMMANDS = {
    "fixed": {"left": 0.7, "right": 0.2, "left_angle": 0.3, "right_angle": -0.1},
    "hinged": {"left": -0.4, "right": 0.9, "left_angle": -0.2, "right_angle": 0.4},
}


@pytest.fixture(scope="module")
def world():
    return vrx_mj.compile_world(SEA, fleet=FLEET)


@pytest.fixture(scope="module")
def boat():
    """One boat alone."""
    fleet = {"thrusters": "H", "sensors": "none", "boats": [{"name": "wamv", "pose": [0, 0, 0.1, 0, 0, 0]}]}
    return vrx_mj.compile_world({"physics": VRX, "wind": SEA["wind"], "sea": SEA["sea"]}, fleet=fleet)


def values(batch, commands=COMMANDS):
    return np.tile([commands[boat][name] for boat, name in batch.channels], (batch.n, 1))


def alone(world, seed, *, change=None, commands=COMMANDS, duration=2.0):
    """The state of a simulation after its commands; `change` is made before it is reset."""
    sim = vrx_mj.Simulation(world)
    if change:
        change(sim)
    sim.reset(seed)
    sim.step(commands, duration=duration)
    return sim.get_state().sha256


ONE = {"wamv": COMMANDS["fixed"]}


@pytest.mark.parametrize(("n", "threads"), [(1, 1), (3, 2), (40, 3)])
def test_a_row_is_a_simulation(world, n, threads):
    batch = vrx_mj.Batch(world, n, seed=5, threads=threads)
    assert batch.get_state(n - 1).sha256 == vrx_mj.Simulation(world, seed=5 + n - 1).get_state().sha256
    batch.step(values(batch), duration=2.0)
    assert batch.get_state(n - 1).sha256 == alone(world, 5 + n - 1)
    assert batch.seeds.tolist() == list(range(5, 5 + n))
    assert batch.get_state(0).sha256 != batch.get_state(n - 1).sha256 or n == 1  # other gusts


def test_what_is_seen_is_what_a_simulation_sees(world):
    batch = vrx_mj.Batch(world, 2, seed=5)
    batch.step(values(batch), duration=1.0)
    sim = vrx_mj.Simulation(world)
    sim.set_state(batch.get_state(1))
    seen = sim.observe()
    for index, name in enumerate(batch.boats):
        told = seen[name]
        expected = np.concatenate((told.position, told.quaternion, told.velocity, told.angular_velocity))
        np.testing.assert_allclose(batch.features[1, index], expected, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(batch.wind[1], sim.wind.velocity(sim.time)[:2])
    assert batch.time.tolist() == [sim.time] * 2


def test_a_run_is_the_same_however_it_is_cut(world):
    batch = vrx_mj.Batch(world, 2, seed=5)
    batch.command(values(batch))  # which last for a second, as those of `Simulation.command`
    for steps in (1, 49, 100, 0, 50):
        batch.advance(steps)
    sim = vrx_mj.Simulation(world, seed=6)
    sim.command_all(COMMANDS)
    sim.advance(200)
    assert batch.get_state(1).sha256 == sim.get_state().sha256


def test_rows_are_reset_alone(boat):
    batch = vrx_mj.Batch(boat, 3, seed=5)
    batch.step(values(batch, ONE), duration=1.0)
    batch.reset([False, True, False], seed=[77])
    assert batch.time[1] == 0.0
    batch.step(values(batch, ONE), duration=1.0)
    assert batch.seeds.tolist() == [5, 77, 7]
    assert batch.get_state(1).sha256 == alone(boat, 77, commands=ONE, duration=1.0)
    sim = vrx_mj.Simulation(boat, seed=7)
    for _ in range(2):
        sim.step(ONE, duration=1.0)
    assert batch.get_state(2).sha256 == sim.get_state().sha256


def test_boats_are_put_somewhere(boat):
    pose, velocity = [5.0, -3.0, 0.2, 0.1, -0.05, 2.0], [1.0, 0.2, 0.0, 0.0, 0.0, 0.3]
    batch = vrx_mj.Batch(boat, 2, seed=5)
    batch.set_boat("wamv", pose=pose, velocity=[velocity], rows=[1])
    sim = vrx_mj.Simulation(boat, seed=6)
    sim.set_boat("wamv", pose=pose, velocity=velocity)
    assert batch.get_state(1).mujoco.tolist() == sim.get_state().mujoco.tolist()
    np.testing.assert_allclose(batch.features[1, 0, 7:10], velocity[:3], atol=1e-15)
    assert (batch.features[0, 0, 7:] == 0.0).all()


CALM = {**SEA["wind"], "mean_velocity": 2.0, "var_gain": 0.5, "direction": -60}


def test_a_row_with_another_wind_is_a_world_with_it(boat):
    batch = vrx_mj.Batch(boat, 2)
    batch.vary([1], wind_speed=2.0, gusts=0.5, wind_direction=np.radians(-60.0))
    batch.reset(seed=5)
    batch.step(values(batch, ONE), duration=1.0)
    fleet = {"thrusters": "H", "sensors": "none", "boats": [{"name": "wamv", "pose": [0, 0, 0.1, 0, 0, 0]}]}
    other = vrx_mj.Simulation(
        vrx_mj.compile_world({"physics": VRX, "wind": CALM, "sea": SEA["sea"]}, fleet=fleet), seed=6
    )
    other.step(ONE, duration=1.0)
    np.testing.assert_allclose(batch.get_state(1).mujoco, other.get_state().mujoco, rtol=0, atol=1e-12)
    assert batch.get_state(0).sha256 == alone(boat, 5, commands=ONE, duration=1.0)


def heavy(sim):
    for body in range(1, sim.model.nbody):
        sim.model.body_mass[body] *= 1.25
        sim.model.body_inertia[body] *= 1.25
    mujoco.mj_setConst(sim.model, mujoco.MjData(sim.model))
    sim._live.arrays.hulls["mass"] *= 1.25


def strong(sim):
    sim._live.arrays.thrusters["gain"] = 0.8


def flat(sim):
    sim._live.arrays.waves["amplitude"] *= 0.5


@pytest.mark.parametrize(
    ("varied", "change"), [({"mass": 1.25}, heavy), ({"thrust": 0.8}, strong), ({"waves": 0.5}, flat)]
)
def test_a_row_with_a_parameter_of_its_own(boat, varied, change):
    batch = vrx_mj.Batch(boat, 3, seed=5)
    batch.vary([False, True, False], **varied)
    batch.reset(seed=5)
    batch.step(values(batch, ONE), duration=1.0)
    assert batch.get_state(1).sha256 == alone(boat, 6, change=change, commands=ONE, duration=1.0)
    assert batch.get_state(1).sha256 != alone(boat, 6, commands=ONE, duration=1.0)
    assert batch.get_state(2).sha256 == alone(boat, 7, commands=ONE, duration=1.0)


DIFFERENT = {
    "wind_speed": (2.0, "wind_speed 2, not 5"), "wind_direction": (1.0, "wind_direction 1, not 0.523599"),
    "gusts": (0.5, "gusts 0.5, not 2"), "waves": (0.5, "waves 0.5, not 1"), "mass": (1.25, "mass 1.25, not 1"),
    "thrust": (0.8, "thrust 0.8, not 1"), "wave_period": (1.5, "wave_period 1.5, not 1"),
    "wave_band": (0.5, "wave_band 0.5, not 1"), "wave_direction": (1.0, "wave_direction 1, not 0"),
    "wave_spread": (0.5, "wave_spread 0.5, not 1"), "wave_phases": ([0.5, 0.25, -1.0], "wave_phases 1, not 0"),
    "parameters": ({"wamv.hull.drag_linear.sway": 55.0}, "wamv.hull.drag_linear.sway 55, not 40"),
}  # fmt: skip
"""A value of each parameter that differs from the world's, and what is said of it."""


@pytest.mark.parametrize("n", [1, 3])
@pytest.mark.parametrize("name", DIFFERENT)
def test_the_state_of_a_row_that_differs_from_its_world_is_refused_by_name(boat, name, n):
    value, text = DIFFERENT[name]
    batch = vrx_mj.Batch(boat, n, seed=5)
    batch.vary([n - 1], **{name: value})
    batch.reset()
    batch.advance(10)
    sim = vrx_mj.Simulation(boat)
    before = sim.get_state().sha256
    state = batch.get_state(n - 1)
    for one in (state, vrx_mj.State.from_bytes(state.to_bytes()), copy.deepcopy(batch).get_state(n - 1)):
        with pytest.raises(StateError) as raised:
            sim.set_state(one)
        assert str(raised.value) == (
            f"the state belongs to a row of a Batch that differs from the world {boat.sha256[:12]}: {text}"
        )
    assert sim.get_state().sha256 == before
    if n > 1:
        assert sim.set_state(batch.get_state(0))


def test_all_that_differs_is_named_and_what_the_world_has_is_no_difference(boat):
    batch = vrx_mj.Batch(boat, 3, seed=5)
    assert set(DIFFERENT) == set(inspect.signature(batch.vary).parameters) - {"rows"}
    batch.vary(mass=[1.25, 1.0, 1.0], waves=[0.25, 1.0, 1.0], thrust=1.0, wind_speed=5.0, gusts=2.0)
    batch.reset()
    sim = vrx_mj.Simulation(boat)
    with pytest.raises(StateError, match=r": waves 0.25, not 1, mass 1.25, not 1$"):
        sim.set_state(batch.get_state(0))
    plain = batch.get_state(1)
    assert b"varied" not in plain.to_bytes()
    assert sim.set_state(plain)
    batch.vary([0], mass=1.0, waves=1.0)
    assert sim.set_state(batch.get_state(0))


def test_nothing_that_is_written_into_what_a_batch_returns_is_lost_in_silence(boat):
    """An array of a property is a copy, or cannot be written to."""
    batch = vrx_mj.Batch(boat, 2)
    names = [name for name, own in inspect.getmembers(vrx_mj.Batch) if isinstance(own, property)]
    arrays = [name for name in names if isinstance(getattr(batch, name), np.ndarray)]
    before = {name: getattr(batch, name).copy() for name in arrays}
    for name in arrays:
        with contextlib.suppress(ValueError):  # read-only
            getattr(batch, name)[:] = 1
        np.testing.assert_array_equal(getattr(batch, name), before[name], err_msg=name)
    for name in ("features", "qpos"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(batch, name)[0] = 1.0


def test_a_row_that_diverges_stands_until_it_is_reset(boat):
    batch = vrx_mj.Batch(boat, 3, seed=5)
    batch.set_boat("wamv", velocity=[0, 0, 9e6, 0, 0, 0], rows=[1])
    with pytest.raises(DivergedError) as raised:
        batch.advance(400)
    assert str(raised.value).startswith("rows 1 have a state that is not finite, or huge, at about t = ")
    assert str(raised.value).endswith(" s; they do not move until reset(rows)")
    assert batch.diverged.tolist() == [False, True, False]
    batch.advance(100)  # told once
    sim = vrx_mj.Simulation(boat, seed=7)
    sim.advance(500)
    assert batch.get_state(2).sha256 == sim.get_state().sha256
    batch.reset(batch.diverged, seed=[9])
    batch.advance(10)
    sim.reset(9)
    sim.advance(10)
    assert batch.get_state(1).sha256 == sim.get_state().sha256


def advanced(batch, results, key):
    batch.advance(100)
    results[key] = [batch.get_state(row).sha256 for row in range(batch.n)]


def in_a_child(batch, pipe):
    results = {}
    advanced(batch, results, "child")
    pipe.send(results["child"])


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_forked_child_goes_on_with_threads_of_its_own(boat):
    batch = vrx_mj.Batch(boat, 40, seed=5, threads=2)
    batch.advance(100)
    ours, theirs = multiprocessing.Pipe()
    child = multiprocessing.get_context("fork").Process(target=in_a_child, args=(batch, theirs))
    child.start()
    assert ours.poll(60.0)
    told = ours.recv()
    child.join()
    results = {}
    advanced(batch, results, "parent")
    assert told == results["parent"]


def test_two_batches_sail_in_two_threads(boat):
    batches = [vrx_mj.Batch(boat, 20, seed=5, threads=2) for _ in range(2)]
    results = {}
    threads = [threading.Thread(target=advanced, args=(batch, results, k)) for k, batch in enumerate(batches)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    advanced(vrx_mj.Batch(boat, 20, seed=5, threads=1), results, "alone")
    assert results[0] == results[1] == results["alone"]


def test_the_threads_go_with_their_batch(boat):
    before = set(threading.enumerate())
    batch = vrx_mj.Batch(boat, 20, threads=3)
    helpers = set(threading.enumerate()) - before
    assert len(helpers) == 2
    del batch
    for thread in helpers:
        thread.join(10.0)
    assert not any(thread.is_alive() for thread in helpers)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda b: b.command(np.zeros((2, 3))), "invalid commands of shape (2, 3): (2, 4) is needed"),
        (
            lambda b: b.command([[0, 0, 0, 0], [0, np.nan, 0, 0]]),
            "invalid command nan for right of wamv in row 1: a finite number is needed",
        ),
        (lambda b: b.reset([2]), "invalid rows [2]: a mask of 2 booleans, or numbers from 0 to 1, is needed"),
        (lambda b: b.reset(seed=[1]), "invalid seed [1]: one whole number, or 2 of them, is needed"),
        (lambda b: b.vary(mass=0.0), "invalid mass 0.0: one finite number above 0, or 2 of them, is needed"),
        (lambda b: b.vary(gusts=[1.0]), "invalid gusts [1.0]: one finite number of 0 or more, or 2 of them, is needed"),
        (
            lambda b: b.set_boat("wamv", pose=[0.0] * 5),
            "invalid pose of wamv of shape (5,): (2, 6) or (6,), of numbers below 1e+07, is needed",
        ),
        (lambda b: b.set_boat("wamv", pose="here"), "invalid pose of wamv 'here': an array of numbers is needed"),
        (lambda b: b.vary(waves="none"), "invalid waves 'none': an array of numbers is needed"),
        (lambda b: b.command({"left": 1}), "invalid commands {'left': 1}: an array of numbers is needed"),
    ],
)
def test_bad_input_is_told_and_changes_nothing(boat, call, message):
    batch = vrx_mj.Batch(boat, 2)
    before = batch.get_state(1).sha256
    with pytest.raises(CommandError) as raised:
        call(batch)
    assert str(raised.value) == message
    assert batch.get_state(1).sha256 == before


def test_what_cannot_be_a_batch(boat):
    with pytest.raises(CommandError, match=r"^Batch takes a World, as compile_world returns it, not 'ocean'$"):
        vrx_mj.Batch("ocean", 1)
    with pytest.raises(CommandError, match=r"^invalid n 0: a whole number above 0 is needed$"):
        vrx_mj.Batch(boat, 0)
    for threads in (1.5, "two", float("nan"), [2]):
        with pytest.raises(CommandError) as raised:
            vrx_mj.Batch(boat, 1, threads=threads)
        assert str(raised.value) == f"invalid threads {threads!r}: a whole number above 0 is needed"
    with pytest.raises(UnknownNameError, match="no boat named 'wam'"):
        vrx_mj.Batch(boat, 1).set_boat("wam", pose=[0.0] * 6)
    with pytest.raises(CommandError) as raised:
        vrx_mj.Batch(vrx_mj.compile_world("stationkeeping_task"), 1)
    assert str(raised.value) == (
        "the world stationkeeping_task has a task, and a Batch has no referee: compile it without one, "
        '{"extends": name, "task": None}'
    )
