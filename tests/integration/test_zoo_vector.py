"""Every problem for teams as rows, against single environments: what is returned beside the numbers, and keeping it."""

import pickle

import numpy as np
import pytest
from pettingzoo.test import render_test
from pettingzoo.utils.conversions import parallel_to_aec

from integration.returned import plain
from integration.variety import variety
from vrx_mj.rl import ParallelEnv, TeamVectorEnv
from vrx_mj.rl.problems import PROBLEMS, TEAMS

KINDS = [*sorted(TEAMS), "Score"]
VARIED = {"wind_speed": (0, 6), "waves": (0.2, 1), "mass": (0.9, 1.1)}


def made(kind, problem, **more):
    """A short environment, with boats that come and go where its problem has such."""
    if problem == "Score":
        own = {"world": "stationkeeping_task"}
    else:
        own = variety(problem, VARIED) | ({} if PROBLEMS[problem].fixed else {"joining": 0.7, "leaving": 0.7})
    return kind(problem, duration=0.6, **own, **more)


def drawn(env, steps):
    shape = (*env.present.shape, max(map(len, env.action_names.values())))
    return np.random.default_rng(5).uniform(-1, 1, (steps, *shape)).astype(np.float32)


@pytest.mark.parametrize("problem", KINDS)
def test_what_is_returned_does_not_change_later(problem):
    env = made(TeamVectorEnv, problem, num_envs=1 if problem == "Score" else 3)
    returned = [env.reset(seed=3)]
    copies = [plain(returned[0])]
    for step, actions in enumerate(drawn(env, 16)):
        if step == 2:
            env._core.batch.set_boat(env.boats[0], velocity=np.array([[9e6, 0, 0, 0, 0, 9e6]]), rows=[0], **pose(env))
        returned.append(env.step(actions))
        copies.append(plain(returned[-1]))
    assert any(one[4]["diverged"].any() for one in returned[1:])
    assert any(one[3].any() for one in returned[1:])
    assert [plain(one) for one in returned] == copies


def pose(env):
    """What only the row with a referee must have besides a velocity."""
    return {} if hasattr(env._core.batch, "vary") else {"pose": np.array([[0.0, 0.0, 0.1, 0.0, 0.0, 0.0]])}


@pytest.mark.parametrize("problem", KINDS)
def test_the_infos_of_a_row_are_those_of_an_environment_alone(problem):
    rows = 1 if problem == "Score" else 2
    many = made(TeamVectorEnv, problem, num_envs=rows)
    alone = [made(ParallelEnv, problem) for _ in range(rows)]
    _, info = many.reset(seed=3)
    for row, env in enumerate(alone):
        compare(env, env.reset(seed=3 + row)[1], info, row, many.drawn_names)
    for actions in drawn(many, 14):
        *_, info = many.step(actions)
        for row, env in enumerate(alone):
            own = {boat: actions[row, k, : len(many.action_names[boat])] for k, boat in enumerate(many.boats)}
            compare(env, env.step(own)[4] if env.agents else env.reset()[1], info, row, many.drawn_names)


def compare(env, infos, info, row, drawn):
    """What each boat is told, by name and type, is its part of the row's arrays, or what was drawn for the row."""
    there = [boat for boat, here in zip(env.possible_agents, info["present"][row], strict=True) if here]
    assert set(infos) >= set(there)
    for boat, told in infos.items():
        part = {}
        for name in told:
            value, number = info[name][row], env.possible_agents.index(boat)
            part[name] = value if name in drawn or not np.ndim(value) else value[number]
        values = {name: getattr(value, "tolist", lambda v=value: v)() for name, value in part.items()}
        assert plain({name: getattr(value, "tolist", lambda v=value: v)() for name, value in told.items()}) == plain(
            values
        )


@pytest.mark.slow
@pytest.mark.render
@pytest.mark.parametrize("problem", sorted({*KINDS} - {"Formation"}))  # which `test_zoo.py` draws
def test_pettingzoo_s_render_test_has_nothing_to_say(problem, capsys):
    size = {"width": 64, "height": 48}
    render_test(lambda render_mode: parallel_to_aec(made(ParallelEnv, problem, render_mode=render_mode, **size)))
    assert "\x1b[48;2;" in capsys.readouterr().out


@pytest.mark.parametrize("kind", [ParallelEnv, TeamVectorEnv])
@pytest.mark.parametrize("problem", KINDS)
def test_what_is_pickled_continues(problem, kind):
    env = made(kind, problem)
    env.reset(seed=3)
    onward(env, 3)
    other = pickle.loads(pickle.dumps(env))
    assert onward(other, 3) == onward(env, 3)
    assert plain(other.reset()) == plain(env.reset())
    assert onward(other, 2) == onward(env, 2)


def onward(env, steps):
    """What some steps return."""
    found, random = [], np.random.default_rng(6)
    for _ in range(steps):
        if isinstance(env, ParallelEnv):
            actions = {boat: random.uniform(-1, 1, env.action_space(boat).shape) for boat in env.agents}
        else:
            actions = random.uniform(-1, 1, drawn(env, 1)[0].shape)
        found.append(plain(env.step(actions)))
    return found
