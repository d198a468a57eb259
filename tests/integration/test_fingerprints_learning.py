"""What every learning problem observes, rewards and tells: the numbers that it gave before."""

import numpy as np
import pytest

from fingerprints import check
from vrx_mj.rl import TeamVectorEnv, VectorEnv
from vrx_mj.rl.problems import ALONE, PROBLEMS, SCORE, TEAMS

VARIED = {"wind_speed": (0, 6), "gusts": 1, "waves": (0.2, 1), "thrust": (0.8, 1.1), "mass": (0.9, 1.1)}
MOVING = {"joining": 0.7, "leaving": 0.7}
QUICK, LONG = 20, 250
"""Steps of 0.1 s."""


def check_problem(name, steps, **options):
    """Rows of a problem with random actions that change each second."""
    rows, kind = 1 if name == SCORE else 3, VectorEnv if name in ALONE else TeamVectorEnv
    env, random = kind(name, rows, threads=1, duration=15.0, **options), np.random.default_rng(4)
    shape = env.action_space.shape if name in ALONE else (*env.present.shape, max(map(len, env.action_names.values())))
    returned = [env.reset(seed=3)]
    for action in random.uniform(-0.5, 1.0, (steps // 10, *shape)).astype(np.float32):
        returned += [env.step(action) for _ in range(10)]
    env.close()
    check("learning", f"{name} for {steps} steps", began=returned[0], stepped=returned[1:])


def options(name):
    if name == SCORE:
        return {"world": "wayfinding_task", "boats": 2} | MOVING
    return VARIED | (MOVING if name in TEAMS and not PROBLEMS[name].fixed else {})


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_problem_gives_what_it_gave(name):
    check_problem(name, QUICK, **options(name))


@pytest.mark.slow
@pytest.mark.nightly
def test_it_still_does_after_episodes_have_ended():
    for name in PROBLEMS:
        check_problem(name, LONG, **options(name))
