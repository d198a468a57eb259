"""What is pickled, or copied, goes on as the original does: to the last bit."""

import copy
import inspect
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import FrozenInstanceError

import gymnasium
import numpy as np
import pytest
from gymnasium.vector.utils import CloudpickleWrapper

import vrx_mj
from integration.sailing import GUSTY, ROUGH, boats, edited, water
from vrx_mj import errors
from vrx_mj.errors import Problem, SensorError, UnknownNameError, VrxError
from vrx_mj.rl import Env, ParallelEnv, TeamVectorEnv, VectorEnv

COPIES = {
    "pickle": lambda one: pickle.loads(pickle.dumps(one)),
    "cloudpickle": lambda one: pickle.loads(pickle.dumps(CloudpickleWrapper(one))).fn,
    "deepcopy": copy.deepcopy,
}
copying = pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
AHEAD = {"a": {"left": 1.0, "right": 0.4}}
BUOY = [{"name": "buoy", "model": "mb_marker_buoy_red", "pose": [3, 0.2, 0, 0, 0, 0]}]


@pytest.fixture(scope="module")
def world():
    fleet = boats((0.0, 0.0, 0.3), (9.0, 0.9, np.pi), sensors=["gps_wamv", "imu_wamv"])
    return vrx_mj.compile_world(
        water(sea=ROUGH, wind=GUSTY, objects=BUOY, georeference={"latitude": 1.0, "longitude": 2.0}), fleet=fleet
    )


@copying
def test_a_world_is_the_same_world(world, copied):
    other = copied(world)
    assert other == world
    assert other.sha256 == world.sha256
    assert other.boats == world.boats
    with pytest.raises(TypeError, match="does not support item assignment"):
        other.assets["name"] = "other"
    with pytest.raises(FrozenInstanceError):
        other.parameters.name = "other"


def test_a_world_that_was_read_or_edited_is_the_same(world, tmp_path):
    world.save(tmp_path)
    for one in (vrx_mj.World.load(tmp_path), edited(world, lambda tree: tree.update(seed=9))):
        assert COPIES["pickle"](one).sha256 == one.sha256


@copying
def test_a_simulation_continues_bit_for_bit(world, copied):
    sim = vrx_mj.Simulation(world, seed=5)
    sim.step(AHEAD, duration=3.0)
    other = copied(sim)
    assert (other.time, other.seed, other.get_state().sha256) == (sim.time, 5, sim.get_state().sha256)
    for one in (sim, other):
        one.step(AHEAD, duration=2.0)
    assert other.get_state().sha256 == sim.get_state().sha256
    for one in (sim, other):
        one.reset()
    assert other.get_state().sha256 == sim.get_state().sha256


def test_a_simulation_continues_with_the_boats_that_it_has(world):
    sim = vrx_mj.Simulation(world)
    sim.step(AHEAD, duration=0.5)
    sim.spawn("c", pose=(0, 20, 0.1, 0, 0, 0), sensors="none")
    sim.remove("b")
    sim.step(duration=0.5)
    other = COPIES["pickle"](sim)
    for one in (sim, other):
        one.step(AHEAD | {"c": {"left": 1.0}}, duration=2.0)
    assert other.boats == sim.boats == ("a", "c")
    assert other.get_state().sha256 == sim.get_state().sha256
    for one in (sim, other):
        one.reset()
    assert other.boats == ("a", "b")
    assert other.get_state().sha256 == sim.get_state().sha256


def test_a_copy_reads_sensors_as_the_original(world):
    sim = vrx_mj.Simulation(world)
    sim.sense("a")["imu_wamv"]
    sim.step(AHEAD, duration=1.0)
    other = COPIES["deepcopy"](sim)
    for _ in range(3):
        one, two = (each.step(AHEAD, duration=0.1)["a"].sensors["imu_wamv"] for each in (sim, other))
        assert one.time == two.time
        assert np.array_equal(one.data.linear_acceleration, two.data.linear_acceleration)


def test_a_copy_has_no_recorders_and_no_subscriptions(world, tmp_path):
    sim, heard = vrx_mj.Simulation(world), []
    sim.subscribe("a", "gps_wamv", heard.append)
    sim.watch_contacts(heard.append)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sea=False):
        other = COPIES["pickle"](sim)
        other.step(AHEAD, duration=1.0)
    assert heard == []
    other.reset()  # which a recorded run refuses


def test_a_run_with_a_task_continues(tmp_path):
    sim = vrx_mj.Simulation(vrx_mj.compile_world("stationkeeping_task"))
    vrx_mj.run(sim, 12.0)
    other = COPIES["pickle"](sim)
    for one in (sim, other):
        vrx_mj.run(one, 3.0)
    assert other.task == sim.task
    assert other.task_events == sim.task_events
    assert other.get_state().sha256 == sim.get_state().sha256


@copying
def test_observations(world, copied):
    sim = vrx_mj.Simulation(world)
    obs = sim.step(AHEAD, duration=0.5)
    read = obs["a"].sensors["gps_wamv"]
    other = copied(obs)
    assert list(other) == ["a", "b"]
    assert other.task is None
    for name in ("position", "quaternion", "velocity", "angular_velocity"):
        assert np.array_equal(getattr(other["a"], name), getattr(obs["a"], name))
    assert other["a"].thrusters["left"] == obs["a"].thrusters["left"]
    assert other["a"].thrusters["left"].command(100.0) == obs["a"].thrusters["left"].command(100.0)
    sim.step(AHEAD, duration=1.0)
    again = copied(other)["a"].sensors
    assert list(again) == ["gps_wamv", "imu_wamv"]
    assert again["gps_wamv"].data.latitude == read.data.latitude
    with pytest.raises(SensorError, match=r"^no reading of imu_wamv in a copied observation: read it before copying$"):
        again["imu_wamv"]
    with pytest.raises(UnknownNameError, match=r"^no sensor named 'x'; known: gps_wamv, imu_wamv$"):
        again["x"]


@copying
def test_states_and_summaries(world, copied):
    sim = vrx_mj.Simulation(world)
    summary, state = vrx_mj.run(sim, 0.2), sim.get_state()
    assert copied(summary) == summary
    assert copied(state).sha256 == state.sha256
    assert copied(state).to_bytes() == state.to_bytes()


@copying
def test_a_batch_continues_bit_for_bit(world, copied):
    batch = vrx_mj.Batch(world, 3, seed=4, threads=1)
    batch.vary([1], mass=1.2, waves=0.5, wind_speed=2.0, thrust=0.8)
    batch.reset([1])
    values = np.full((3, len(batch.channels)), 0.3)
    batch.step(values, duration=1.0)
    other = copied(batch)
    for one in (batch, other):
        one.step(values, duration=1.0)
        one.reset([2], seed=8)
        one.step(duration=0.5)
    for row in range(3):
        assert other.get_state(row).sha256 == batch.get_state(row).sha256
    assert np.array_equal(other.features, batch.features)


def played(env, steps):
    """Everything that an environment gives under the same actions."""
    random, seen = np.random.default_rng(3), []
    for _ in range(steps):
        if isinstance(env, ParallelEnv):
            action = {boat: random.uniform(-1, 1, env.action_space(boat).shape) for boat in env.agents}
        else:
            shape = env.action_space.shape if hasattr(env, "action_space") else env._core._last.shape
            action = random.uniform(-1, 1, shape).astype(np.float32)
        seen.append(env.step(action))
    return plain(seen)


def plain(value):
    """What was seen, with the bits of its arrays, to be compared."""
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return (value.dtype, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value


@pytest.mark.parametrize("copied", [COPIES["cloudpickle"], COPIES["deepcopy"]])
@pytest.mark.parametrize(
    ("kind", "problem", "options"),
    [
        (Env, "StationKeeping", {"waves": (0.5, 1.0), "mass": (0.9, 1.1)}),
        (VectorEnv, "Wayfinding", {"num_envs": 2, "gusts": 1.0}),
        (ParallelEnv, "Formation", {"boats": 2}),
        (TeamVectorEnv, "Rendezvous", {"num_envs": 2}),
        (ParallelEnv, "Score", {"world": "stationkeeping_task"}),
    ],
)
def test_environments_continue(kind, problem, options, copied):
    env = kind(problem, threads=1, **options)
    env.reset(seed=3)
    played(env, 5)
    other = copied(env)
    assert played(other, 20) == played(env, 20)
    for one in (env, other):
        one.reset()
    assert played(other, 3) == played(env, 3)
    env.close()
    other.close()


@pytest.mark.slow
def test_a_simulation_goes_to_another_process_and_an_error_comes_back(world):
    sim = vrx_mj.Simulation(world, seed=2)
    sim.step(AHEAD, duration=1.0)
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = pool.submit(vrx_mj.run, sim, 1.0).result()
        with pytest.raises(UnknownNameError, match=r"^no boat, object or dock named 'c'; known: a, b, buoy$"):
            pool.submit(sim.remove, "c").result()
    assert there.state_sha256 == vrx_mj.run(sim, 1.0).state_sha256


@pytest.mark.slow
def test_environments_run_in_processes_that_are_spawned():
    env = Env("StationKeeping")
    many = gymnasium.vector.AsyncVectorEnv([lambda: copy.deepcopy(env)], context="spawn")  # it closes its first
    first, _ = many.reset(seed=[3])
    single, _ = env.reset(seed=3)
    assert np.array_equal(first, [single])
    action = many.action_space.sample()
    seen = many.step(action)[0]
    many.close()
    assert np.array_equal(seen[0], env.step(action[0])[0])


KINDS = [one for _, one in inspect.getmembers(errors, inspect.isclass) if issubclass(one, Exception)]


@copying
@pytest.mark.parametrize("kind", KINDS)
def test_errors(kind, copied):
    made = {
        UnknownNameError: lambda: kind("boat", "b", ["a", "c"]),
        errors.ConfigError: lambda: kind([Problem("f.yaml", 1, 2, "sea.gain", "wrong")]),
        errors.ChoiceError: lambda: kind("folder", "world", {"a.world": "a world"}),
    }.get(kind, lambda: kind("what is wrong"))()
    other = copied(made)
    assert (type(other), str(other), vars(other)) == (type(made), str(made), vars(made))


def subclasses(kind):
    """All classes below."""
    return {kind, *(one for each in kind.__subclasses__() for one in subclasses(each))}


def test_all_errors_with_more_than_a_message_say_how_they_are_pickled():
    for kind in (subclasses(VrxError) | subclasses(errors.VrxWarning)) - {VrxError, errors.VrxWarning}:
        own = "__init__" in vars(kind)
        assert not own or "__reduce__" in vars(kind) or "__getnewargs__" in vars(kind), kind
