"""One trial: how it ends, in words, by a controller's errors, the machine's and ours; and how long it may take."""

import errno
import itertools
import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

import vrx_mj
from vrx_mj.campaign import trial as trials
from vrx_mj.campaign.plan import Cell, Serving, Trial
from vrx_mj.campaign.results import ALLOWED, REACHED, Stopwatch, Tracks
from vrx_mj.campaign.trial import sail

WORLD = {"physics": {"profile": "marine"}, "sea": {"model": "none"}, "spawn": {"robot": "skiff", "sensors": "none"}}
CREW = """
import errno

def steady(obs, t):
    return {"wamv": {"propeller": 0.5}}

def broken(obs, t):
    return steady(obs, t) if t < 0.15 else {}["mood"]

def silent(obs, t):
    raise RuntimeError

def full(obs, t):
    raise OSError(errno.ENOSPC, "No space left on device")

def missing(obs, t):
    raise ValueError("no shore")

def hungry(obs, t):
    raise MemoryError("no memory")

def leaves(obs, t):
    raise SystemExit(3)

def stranger(obs, t):
    return {"wamv": {"sail": 0.5}} if t > 0.15 else {}

def stopped(obs, t):
    if t > 0.15:
        raise KeyboardInterrupt
    return {}

class Late:
    def reset(self, seed):
        raise ValueError("no seed")

    def __call__(self, obs, t):
        return {}
"""


@pytest.fixture(scope="module")
def sim():
    return vrx_mj.Simulation(vrx_mj.compile_world(WORLD))


@pytest.fixture
def sailed(sim, monkeypatch, tmp_path):
    """The result of a controller in a calm world, and the memory that the trial shares."""
    monkeypatch.setattr("vrx_mj.campaign.results.TIME_UP", 12)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "trial_crew.py").write_text(CREW, encoding="utf-8")
    shared = [0.0] * 4

    ticks = itertools.count(1000.0)
    monkeypatch.setattr(trials, "time", SimpleNamespace(perf_counter=lambda: next(ticks)))

    def run(name, **options):
        trial = Trial(Cell(f"trial_crew:{name}", "bay", 3), **({"duration": 0.5} | options))
        result = sail(trial, tmp_path, Stopwatch(shared), sim)
        assert 0.0 < result.wall_time < 1000.0  # not a moment of the clock
        return result, shared

    return run


def test_a_trial_has_what_its_run_has(sailed, sim):
    result, shared = sailed("steady")
    assert (result.state, result.error, result.task, result.recording) == ("finished", None, None, None)
    assert (result.sim_time, result.score) == (pytest.approx(0.5), None)
    assert (result.world_sha256, result.state_sha256, sim.seed) == (sim.world.sha256, sim.state_sha256, 3)
    assert result.platform
    assert result.tracks == {"wamv": [[0.0, 0.0]]}
    assert shared[ALLOWED] == 60.5  # what it simulates, and a minute
    assert shared[REACHED] == pytest.approx(0.4)  # the last call
    again, shared = sailed("steady", timeout=7.0)
    assert (replace(again, wall_time=result.wall_time), shared[ALLOWED]) == (result, 7.0)
    farther = sailed("steady", duration=0.6)[0]
    assert farther.poses_sha256 != result.poses_sha256


@pytest.mark.parametrize(
    ("name", "state", "moment", "words"),
    [
        ("broken", "failed", 0.2, "at t = 0.2 s the controller raised KeyError: 'mood' (trial_crew.py, line 8)"),
        ("silent", "failed", 0.0, "at t = 0 s the controller raised RuntimeError (trial_crew.py, line 11)"),
        (
            "full", "lost", 0.0,
            "at t = 0 s the controller raised OSError: [Errno 28] No space left on device (trial_crew.py, line 14)",
        ),
        ("missing", "failed", 0.0, "at t = 0 s the controller raised ValueError: no shore (trial_crew.py, line 17)"),
        ("hungry", "lost", 0.0, "at t = 0 s the controller raised MemoryError: no memory (trial_crew.py, line 20)"),
        ("leaves", "failed", 0.0, "at t = 0 s the controller raised SystemExit: 3 (trial_crew.py, line 23)"),
        ("Late", "failed", 0.0, "loading the controller raised ValueError: no seed (trial_crew.py, line 35)"),
    ],
)  # fmt: skip
def test_what_a_controller_raises_is_told_with_its_place(sailed, capsys, name, state, moment, words):
    result, _ = sailed(name)
    assert (result.state, result.error, result.sim_time) == (state, words, pytest.approx(moment))
    assert "Traceback" in capsys.readouterr().err


def test_a_wrong_command_is_told_with_its_time(sailed, capsys):
    result, _ = sailed("stranger")
    assert result.state == "failed"
    assert result.error.startswith("at t = 0.2 s: no ")
    assert "Traceback" not in capsys.readouterr().err


def test_what_cannot_begin_is_told_without_a_time(sailed):
    result, _ = sailed("nobody")
    assert (result.state, result.sim_time) == ("failed", 0.0)
    assert not result.error.startswith("at t")


def test_a_world_that_does_not_compile_has_no_time(tmp_path):
    result = sail(Trial(Cell("trial_crew:steady", "nowhere", 3)), tmp_path, Stopwatch([0.0] * 4), None)
    assert (result.state, result.sim_time) == ("failed", 0.0)
    assert "nowhere" in result.error


def test_ctrl_c_ends_a_trial(sailed):
    result, _ = sailed("stopped")
    assert (result.state, result.error, result.sim_time) == ("failed", "interrupted", pytest.approx(0.2))


def test_an_error_of_ours_says_so(sailed, monkeypatch, capsys):
    def run(*_, **__):
        return 1 / 0

    monkeypatch.setattr(trials, "run", run)
    result, _ = sailed("steady")
    words = "an error inside vrx_mj: ZeroDivisionError: division by zero (test_trial.py, line"
    assert (result.state, result.error[: len(words)], "Traceback" in capsys.readouterr().err) == ("failed", words, True)


def test_a_world_is_compiled_where_none_is_warm(sailed, sim, monkeypatch, tmp_path):
    asked, own = [], Trial(Cell("trial_crew:steady", "bay", 3), duration=0.1, fleet="two", parameters={"mass": 2.0})
    monkeypatch.setattr(trials, "Simulation", lambda world: world)
    monkeypatch.setattr(trials, "compile_world", lambda *name, **options: asked.append((*name, options)) or sim)
    monkeypatch.setattr(trials, "numbers_by_name", lambda _world, drawn: {f"a.{name}": drawn[name] for name in drawn})
    assert sail(own, tmp_path, Stopwatch([0.0] * 4), None).error is None
    assert asked == [("bay", {"fleet": "two"}), ("bay", {"fleet": "two", "parameters": {"a.mass": 2.0}})]


@pytest.mark.parametrize(
    ("duration", "timeout", "rate", "wall"),
    [
        (None, None, 1.0, 120.0), (30.0, None, 1.0, 90.0), (30.0, None, 0.5, 120.0), (30.0, None, 2.0, 90.0),
        (30.0, None, None, 90.0), (30.0, 5.0, 0.5, 5.0),
    ],
)  # fmt: skip
def test_a_program_may_take_what_it_simulates_at_its_rate_and_a_minute(sim, monkeypatch, duration, timeout, rate, wall):
    monkeypatch.setattr("vrx_mj.campaign.program_trial.sail_by_program", lambda *given: given)
    own = Trial(Cell("./sail", "bay", 3), duration=duration, timeout=timeout, serving=Serving(rate))
    sim.reset(0)
    given = trials._summary(own, sim, "folder", "tracks", "stopwatch")
    assert given == (own.cell, own.serving, sim, "folder", duration, wall, "tracks", "stopwatch")


@dataclass
class Task:
    score: float | None
    state: str = "finished"
    events: tuple = ()
    name: str = "dock"


def ended(task, *, record=False, interrupted=False):
    summary = SimpleNamespace(
        task=task, interrupted=interrupted, boats={"a": SimpleNamespace(distance=3.0)}, sim_time=4.0, wall_time=1.5,
        state_sha256="ab", platform="here",
    )  # fmt: skip
    qpos = SimpleNamespace(tobytes=lambda: b"qpos")
    return trials._result_of(
        Trial(Cell("a:f", "bay", 0), record=record), summary, Tracks(), world_sha256="w", qpos=qpos
    )


@pytest.mark.parametrize(
    ("phase", "state"),
    [("initial", "not started"), ("ready", "not started"), ("running", "cut"), ("finished", "finished")],
)
def test_a_trial_ends_as_its_task_does(phase, state):
    result = ended(Task(2.5, phase))
    assert (result.state, result.error, result.recording) == (state, None, None)
    assert (result.sim_time, result.wall_time, result.state_sha256, result.world_sha256) == (4.0, 1.5, "ab", "w")
    assert ended(Task(2.5, phase), record=True).recording == "run.rrd"
    assert ended(Task(2.5, phase), interrupted=True).state == "failed"


@pytest.mark.parametrize("score", [math.nan, math.inf])
def test_a_score_that_is_no_number_is_an_error(score):
    with pytest.raises(vrx_mj.VrxError, match=rf"^the score of dock is {score}: a finite number is needed$"):
        ended(Task(score))


def test_the_last_two_hundred_events_are_kept():
    events = ended(Task(None, events=tuple((float(number), "buoy") for number in range(201)))).task["events"]
    assert (len(events), events[0], events[-1]) == (200, [1.0, "buoy"], [200.0, "buoy"])


@pytest.mark.parametrize("code", [errno.EDQUOT, errno.EIO, errno.ENOMEM, errno.EROFS, errno.ESTALE, errno.ENOTCONN])
def test_errors_of_disks_and_memory_are_the_machines(code):
    assert trials._is_the_machines(OSError(code, "odd"))
    assert not trials._is_the_machines(OSError(errno.ENOENT, "odd"))


def test_rows_share_their_time_and_each_has_its_part(monkeypatch, sim, tmp_path):
    """By a clock that goes on by one second with each look; the world is compiled where none is warm."""
    asked = []
    monkeypatch.setattr("vrx_mj.campaign.results.TIME_UP", 12)
    monkeypatch.setattr(trials, "time", SimpleNamespace(perf_counter=itertools.count().__next__))
    monkeypatch.setattr(trials, "load_own_controller", lambda *_: lambda features, _t: np.zeros((len(features), 2)))
    monkeypatch.setattr(trials, "compile_world", lambda name, fleet: asked.append((name, fleet)))
    monkeypatch.setattr(trials, "Simulation", lambda _world: sim)
    own = [Trial(Cell("crew:rows", "bay", seed), duration=0.5, fleet="two") for seed in range(4)]
    shared = [0.0] * 4
    results = trials.sail_rows(own, Stopwatch(shared), None)
    assert [(result.cell.seed, result.wall_time, result.sim_time) for result in results] == [
        (seed, 0.25, pytest.approx(0.5)) for seed in range(4)
    ]
    assert len(trials.sail_rows(own[:1], Stopwatch(shared), None)) == 1
    assert asked == [("bay", "two")] * 2
    assert (shared[ALLOWED], shared[REACHED]) == (60.5, pytest.approx(0.4))
