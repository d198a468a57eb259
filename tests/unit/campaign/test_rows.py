"""Trials as rows of a batch: each is, to the last bit, what it is alone, or is to be sailed alone."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import vrx_mj
from vrx_mj.campaign.plan import Plan
from vrx_mj.campaign.results import Stopwatch
from vrx_mj.campaign.trial import sail, sail_rows
from vrx_mj.campaign.vary import numbers_by_name, parse_vary
from vrx_mj.runtime.run import load_controller

GALE = {
    "extends": "ocean",
    "wind": {"direction": 40, "mean_velocity": 5, "var_gain": 1.5, "var_time": 5,
             "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]},
}  # fmt: skip
TASK = {"type": "stationkeeping", "goal_cart": [8, 0, 0]}
POLICIES = """
import numpy as np

WEIGHTS = np.random.default_rng(1).normal(size=(13, 4), scale=0.1)

class Policy:
    rows = True

    def reset(self, seeds):
        self.bias = 0.1 * np.array(seeds)[:, None]

    def __call__(self, features, t):
        features[..., :3] -= 8.0
        return np.tanh(np.einsum("ni,ij->nj", features[:, 0], WEIGHTS) + self.bias + np.sin(t))

class Mean(Policy):
    def __call__(self, features, t):
        return super().__call__(features, t) + features.mean()

class First(Policy):
    def __call__(self, features, t):
        commands = super().__call__(features, t)
        commands[0] *= len(features)
        return commands

class Stops(Policy):
    def __call__(self, features, t):
        return super().__call__(features, t) / (t < 0.5)

class Short(Policy):
    def __call__(self, features, t):
        return super().__call__(features, t)[:, :3]
"""


@pytest.fixture(autouse=True)
def untimed(monkeypatch, tmp_path):
    monkeypatch.setattr(Stopwatch, "allow", lambda *_: None)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "policies.py").write_text(POLICIES, encoding="utf-8")
    (tmp_path / "gale.yaml").write_text(json.dumps(GALE), encoding="utf-8")


@pytest.fixture(scope="module")
def gale():
    return vrx_mj.Simulation(vrx_mj.compile_world(GALE))


def sailed(policy, sim, count=5, vary=()):
    """The results of some trials as rows, and of each alone."""
    plan = Plan((f"policies:{policy}",), ("gale.yaml",), tuple(range(3, 3 + count)), parse_vary(vary), duration=1.0)
    trials, stopwatch = [plan.trial(cell) for cell in plan.cells], Stopwatch([0.0] * 4)
    rows, alone = sail_rows(trials, stopwatch, sim), []
    for trial in trials:
        sim.reset(0)
        alone.append(sail(trial, None, stopwatch, sim))
    return [[replace(one, wall_time=0.0) for one in own] for own in (rows, alone)]


@pytest.mark.parametrize("vary", [(), ("wind.mean_velocity=2..8", "*.hull.drag_linear.surge=40..60")])
def test_rows_are_the_trials(gale, vary):
    rows, alone = sailed("Policy", gale, vary=vary)
    assert rows == alone
    assert len({one.state_sha256 for one in rows}) == 5
    assert {one.state for one in rows} == {"finished"}


@pytest.mark.parametrize("policy", ["Mean", "First"])
def test_a_policy_whose_rows_depend_on_each_other_sails_each_alone(gale, policy):
    rows, alone = sailed(policy, gale)
    assert rows == []
    assert {one.state for one in alone} == {"finished"}


@pytest.mark.parametrize(
    ("policy", "error"),
    [
        ("Stops", "at t = 0.5 s: invalid command -?inf for left of wamv: a finite number is needed"),
        ("Short", r"invalid commands of shape \(1, 3\): \(1, 4\) is needed"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_what_goes_wrong_in_a_row_is_told_by_the_trial_alone(gale, policy, error, capsys):
    rows, alone = sailed(policy, gale, 2)
    assert rows == []
    assert {one.state for one in alone} == {"failed"}
    assert all(re.fullmatch(error, one.error) for one in alone), alone[0].error


@pytest.mark.parametrize(("world", "vary"), [({**GALE, "task": TASK}, ()), (GALE, ("wamv.hull.mass=190..200",))])
def test_what_a_batch_does_not_do_is_sailed_alone(world, vary, capsys):
    rows, alone = sailed("Policy", vrx_mj.Simulation(vrx_mj.compile_world(world)), 2, vary)
    assert (rows, {one.error for one in alone}) == ([], {None})


def test_a_simulation_has_the_features_of_a_row(gale):
    batch = vrx_mj.Batch(gale.world, 1, seed=4)
    gale.reset(4)
    for sailing in (batch, gale):
        sailing.advance(50)
    np.testing.assert_array_equal(gale.features, batch.features[0])
    assert gale.state_sha256 == batch.get_state(0).sha256


@pytest.mark.filterwarnings("ignore::vrx_mj.VrxWarning")
@pytest.mark.parametrize(("roll", "seconds"), [(1.565, 0.75), (0.0, 0.75)])
def test_trials_with_warnings_are_sailed_alone(roll, seconds):
    """A boat on its side capsizes in some winds earlier than in others."""
    fleet = {"boats": [{"name": "wamv", "pose": [0, 0, 1, roll, 0, 0]}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(GALE, fleet=fleet))
    vary = parse_vary(["wind.mean_velocity=5..150"])
    plan = Plan(("policies:Policy",), ("gale.yaml",), (0, 1, 2, 3), vary, duration=seconds)
    trials, quiet = [plan.trial(cell) for cell in plan.cells], []
    for trial in trials:
        sim.reset(trial.cell.seed, parameters=numbers_by_name(sim.world, trial.parameters))
        controller = load_controller("policies:Policy", trial.cell.seed, sim)
        if not vrx_mj.run(sim, seconds, controller=controller).warnings:
            quiet.append(trial.cell)
    assert [result.cell for result in sail_rows(trials, Stopwatch([0.0] * 4), sim)] == quiet
    assert (0 < len(quiet) < 4) == (roll > 0.0)
