"""What every learning problem observes, rewards and tells: the numbers that it gave before."""

import numpy as np
import pytest

import fingerprints
from fingerprints import WRITING, check
from vrx_mj.rl import TeamVectorEnv, VectorEnv
from vrx_mj.rl.problem import open_water
from vrx_mj.rl.problems import ALONE, PROBLEMS, SCORE, TEAMS

pytestmark = pytest.mark.filterwarnings("ignore:no effect of:vrx_mj.VrxWarning")  # on calm water, or without wind

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


def test_a_problem_on_calm_water_without_wind_has_a_fingerprint_too(monkeypatch, tmp_path):
    given = VARIED | {"world": open_water(sea={"model": "none"}, wind=None)}
    monkeypatch.setattr(fingerprints, "GOLDEN", tmp_path)
    monkeypatch.setenv(WRITING, "1")
    check_problem("StationKeeping", 10, **given)
    monkeypatch.delenv(WRITING)
    check_problem("StationKeeping", 10, **given)
    with pytest.raises(AssertionError, match="other numbers"):
        check_problem("StationKeeping", 10, **given | {"mass": 1.5})


@pytest.mark.slow
@pytest.mark.nightly
def test_it_still_does_after_episodes_have_ended():
    for name in PROBLEMS:
        check_problem(name, LONG, **options(name))
