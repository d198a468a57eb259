"""Every example's main() runs, and past the end of what it sails."""

import importlib.util
import math
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import vrx_mj
from fingerprints import check
from needs import STABLE_BASELINES3, TORCH, needs
from vrx_mj.rl import Env, VectorEnv

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted(path for path in FOLDER.glob("[0-9]*.py") if "roslibpy" not in path.stem)
"""Those that need no server; test_ros_tutorials.py runs the others."""
RUN = vrx_mj.run
RECIPE = FOLDER / "train_station_keeping.py"
TRAINERS = {
    "torch": (), "stable_baselines3": ("SAC",), "stable_baselines3.common.callbacks": ("BaseCallback",),
    "stable_baselines3.common.vec_env": ("VecEnv",),
}  # fmt: skip
"""Modules that the recipe imports, and what it takes from them."""
ANOTHER_MACHINE = 1e-2
"""Share of where a run ends that another machine's rounding and renderer may change, as they decide when it turns."""


def loaded(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_there_are_examples():
    assert EXAMPLES


def beyond_the_end(sim, duration=None, **options):
    """As `vrx_mj.run`, which without a duration ends with the task, and 2 s more with the same controller."""
    summary = RUN(sim, duration, **options)
    assert duration is not None or summary.task.state == "finished"
    return RUN(sim, 2.0, **options)


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_its_controller_goes_on_after_the_end(path, tmp_path, monkeypatch):
    ends = []

    def kept(sim, duration=None, **options):
        ends.append(beyond_the_end(sim, duration, **options))
        return ends[-1]

    monkeypatch.setattr(vrx_mj, "run", kept)
    example = loaded(path)
    monkeypatch.setattr(example, "SEEDS", range(1000, 1002), raising=False)  # two of twenty
    assert example.main(tmp_path / "out.rrd")
    assert (tmp_path / "out.rrd").stat().st_size > 10_000
    found = [[end.sim_time, end.boats, end.task] for end in ends]
    check("examples", path.stem, rounding=ANOTHER_MACHINE, ends=found)


@pytest.fixture
def recipe(monkeypatch):
    """The training recipe, loaded without its trainers."""
    for module, names in TRAINERS.items():
        stub = ModuleType(module)
        vars(stub).update({name: type(name, (), {"__init__": lambda self, *_: None}) for name in names})
        monkeypatch.setitem(sys.modules, module, stub)
    return loaded(RECIPE)


def rewards_of_one(recipe, decisions, duration):
    """What the decisions (n, 4) of a row are worth, and the observations that follow, by an environment alone."""
    env, worth, seen = Env("StationKeeping", duration=duration), [], []
    env.reset(seed=1)
    for decision in decisions:
        errors, cut = [], False
        for _ in range(recipe.HOLD):
            observation, _, _, cut, info = env.step(decision)
            errors.append(info["pose_error"])
            if cut:
                break
        worth.append(-recipe.WEIGHT * np.sqrt(errors).sum() / recipe.HOLD)
        seen.append(observation)
        if cut:
            return np.array(worth), seen, info["mean_pose_error"]
    raise AssertionError("the episode did not end")


@pytest.mark.parametrize("duration", [1.6, 1.4])
def test_the_recipe_hands_on_what_an_episode_is_worth_up_to_its_end(recipe, duration):
    """Also where an episode ends within a hold; the row goes on with the next one."""
    decisions = np.random.default_rng(5).uniform(-1, 1, (4, 4)).astype(np.float32)
    worth, seen, mean = rewards_of_one(recipe, decisions, duration)
    rows = recipe.Rows(VectorEnv("StationKeeping", 2, autoreset_mode="SameStep", duration=duration))
    rows.num_envs = 2  # which the real base class sets
    rows.reset()
    for number, decision in enumerate(decisions):
        rows.step_async(np.stack([decision, decision]))
        observation, reward, over, infos = rows.step_wait()
        assert reward[0] == pytest.approx(worth[number], rel=1e-12)
        assert over.tolist() == [number == 3] * 2
        if number < 3:
            np.testing.assert_array_equal(observation[0], seen[number])
    np.testing.assert_array_equal(infos[0]["terminal_observation"], seen[-1])
    assert infos[0]["TimeLimit.truncated"] is True
    assert infos[0]["error"] == mean
    rows.step_async(np.stack([decision, decision]))
    assert not rows.step_wait()[2].any()


def test_the_recipe_lets_a_lost_boat_forfeit_what_the_problem_says(recipe):
    """Else a policy would learn to sink: an episode that ends costs nothing more."""
    env = VectorEnv("StationKeeping", 2, autoreset_mode="SameStep")
    rows = recipe.Rows(env)
    rows.num_envs = 2
    rows.reset()
    env._core.batch.set_boat("wamv", velocity=(9e6, 0, 0, 0, 0, 9e6), rows=[0])
    rows.step_async(np.zeros((2, 4), np.float32))
    _, reward, over, infos = rows.step_wait()
    assert over.tolist() == [True, False]
    assert reward[0] < -200.0 < reward[1]
    assert infos[0]["TimeLimit.truncated"] is False


@pytest.mark.slow
@needs(STABLE_BASELINES3)
def test_the_recipe_trains_across_the_ends_of_episodes_and_keeps_a_policy(tmp_path, capsys, monkeypatch):
    recipe = loaded(RECIPE)
    monkeypatch.setattr(recipe.Clock, "_on_step", lambda clock: clock.num_timesteps < 200 * recipe.ROWS)
    recipe.main(1.0, tmp_path / "policy.npz")
    kept, shipped = np.load(tmp_path / "policy.npz"), np.load(FOLDER / "station_keeping_policy.npz")
    assert {name: kept[name].shape for name in kept} == {name: shipped[name].shape for name in shipped}
    assert "policy.npz: 25 kB" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.nightly
@needs(TORCH)
def test_a_policy_that_learns_on_rows_keeps_station():
    """200 updates on `engine="free"`; without thrust the error is 8.3 m, and 0.4 m was reached."""
    before, after = loaded(FOLDER / "train_on_rows.py").main("cpu", 256, 200)
    assert before > 6.0
    assert after < 0.8


def test_the_heading_of_the_first_example_is_kept(tmp_path):
    summary = loaded(EXAMPLES[0]).main(tmp_path / "out.rrd", 40.0)
    assert summary.boats["wamv"].heading == pytest.approx(math.radians(45.0), abs=0.15)  # wind of 5 m/s with gusts


def test_the_skiff_of_the_third_example_holds_its_course(tmp_path):
    summary = loaded(EXAMPLES[2]).main(tmp_path / "out.rrd", 40.0)
    assert summary.boats["skiff"].heading == pytest.approx(math.radians(60.0), abs=0.05)


@pytest.mark.slow
def test_the_boats_of_the_eleventh_example_keep_their_places_and_pass_the_gate(tmp_path, capsys):
    (path,) = (path for path in EXAMPLES if path.stem.startswith("11"))
    summary = loaded(path).main(tmp_path / "out.rrd")
    told = capsys.readouterr().out
    numbers = dict(re.findall(r"^(wedge|column|boats kept|7 boats passed the gate,)\D*([\d.]+) m", told, re.MULTILINE))
    assert float(numbers["wedge"]) < 1.5
    assert float(numbers["column"]) < 1.5
    assert float(numbers["boats kept"]) > 7.0  # a WAM-V is 4.9 m long
    assert float(numbers["7 boats passed the gate,"]) < 1.0  # of 6 m to either side
    assert "no contacts of hulls and buoys" in told
    assert min(boat.position[0] for boat in summary.boats.values()) > 88.0
