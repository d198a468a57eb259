"""Campaigns as users start them: whatever a controller does, the others are sailed and the page is made."""

import re
import shutil
import signal
import sys
import time
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest

import vrx_mj
from campaigns import results_in
from vrx_command import ended, start, vrx
from vrx_mj.campaign.engines import ProcessPool, run_trials
from vrx_mj.campaign.plan import Cell, Plan, Trial
from vrx_mj.campaign.vary import parse_vary
from vrx_mj.runtime.run import load_controller

pytestmark = pytest.mark.slow

WORLD = """
extends: ocean
task: {type: stationkeeping, goal_cart: [8, 0, 0], initial_state_duration: 0.5, ready_state_duration: 0.5,
       running_state_duration: 4}
"""
GUSTS = """
extends: ocean
wind: {direction: 40, mean_velocity: 5, var_gain: 3, var_time: 1,
       objects: [{model: wamv, coefficients: [0.5, 0.5, 0.33]}]}
"""
CREW = """
import ctypes, math, os, sys, time
import numpy as np

calls = 0

def steady(obs, t):
    return {"wamv": {"left": 0.5, "right": 0.4}}

def counting(obs, t):  # what one trial leaves behind, another one must not see
    global calls
    calls += 1
    return {"wamv": {"left": 0.001 * calls}}

def hoarding(obs, t):  # in a module of all trials
    math.calls = getattr(math, "calls", 0) + 1
    return {"wamv": {"left": 0.001 * math.calls}}

class Moody:
    def reset(self, seed):
        self.seed = seed
        print("seed", seed, "in", os.getpid(), np.random.uniform(), os.environ.get("MOOD"))
        np.random.seed(seed)
        os.environ["MOOD"] = str(seed)
        np.seterr(all="raise")

    def __call__(self, obs, t):
        if t > 1.05 and self.seed == 5:
            os._exit(3)
        if t > 1.05 and self.seed == 6:
            {}["mood"]
        if t > 1.05 and self.seed == 7:
            os.kill(os.getpid(), 11)
        return steady(obs, t)

def raises(obs, t):
    return steady(obs, t) if t < 2.0 else 1 / 0

def nan(obs, t):
    return {"wamv": {"left": math.nan}}

def stranger(obs, t):
    return {"wamv7": {"left": 0.5}}

def leaves(obs, t):
    if t > 1.05:
        os._exit(3)

def crashes(obs, t):
    ctypes.string_at(0)

def hangs(obs, t):
    if t > 1.05:
        time.sleep(1e6)

def quits(obs, t):
    sys.exit("enough")

def slow(obs, t):
    if not os.path.exists("hurry"):
        time.sleep(0.05)

def killed(obs, t):  # twice, by what ends processes when memory runs out
    if t > 1.05 and len(os.listdir("kills")) < 2:
        open(f"kills/{os.getpid()}", "w").close()
        os.kill(os.getpid(), 9)
    return steady(obs, t)

def orphaned(obs, t):  # twice, with its worker
    if t > 1.05 and len(os.listdir("kills")) < 2:
        open(f"kills/{os.getpid()}", "w").close()
        os.kill(os.getppid(), 9)
        time.sleep(60)
    return steady(obs, t)

def one_argument(obs):
    return steady(obs, 0.0)

def abreast(features, t):
    return np.repeat([[0.5, 0.4, 0.0, 0.0]], len(features), axis=0)

def leave(features, t):  # and all rows with it
    if t > 1.05 and (features[:, 0, 1] > 0.001).any():
        os._exit(3)
    return abreast(features, t)

def mutiny(features, t):  # of several, against their worker
    if t > 1.05 and len(features) > 1:
        os.kill(os.getppid(), 9)
        time.sleep(60)
    return abreast(features, t)

abreast.rows = leave.rows = mutiny.rows = True
"""
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="signals of other systems")


def line(text):
    """Number of the line of `CREW` that has this text."""
    (number,) = [i for i, code in enumerate(CREW.splitlines(), start=1) if text in code]
    return number


FAILURES = {
    "raises": r"^at t = 2 s the controller raised ZeroDivisionError: division by zero \(crew\.py, line "
    rf"{line('1 / 0')}\)$",
    "nan": r"^invalid command nan for left of wamv: a finite number is needed$",
    "stranger": r"^no boat named 'wamv7'; did you mean 'wamv'\?$",
    "leaves": (
        r"^at t = 1\.1 s: the process ended with exit code 3: the controller, or a library that it uses, ended it$"
    ),
    "crashes": r"^at t = 0 s: the process was ended by SIGSEGV$",
    "hangs": r"^at t = 1\.1 s: not finished after 2 s of wall time; it was in crew\.py, line "
    rf"{line('sleep(1e6)')} in hangs$",
    "quits": rf"^at t = 0 s the controller raised SystemExit: enough \(crew\.py, line {line('sys.exit')}\)$",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("测试 campaigns")
    (place / "bay.yaml").write_text(WORLD, encoding="utf-8")
    (place / "windy.yaml").write_text(GUSTS + WORLD.split("ocean")[1], encoding="utf-8")
    (place / "gusts.yaml").write_text(GUSTS, encoding="utf-8")
    (place / "crew.py").write_text(CREW, encoding="utf-8")
    return place


def campaign(folder, names, *words, output="results", **how):
    crew = [f"crew:{name}" for name in names]
    return vrx("campaign", *crew, "--worlds", "bay.yaml", "-o", output, *words, cwd=folder, **how)


def results(folder, output="results"):
    """Each result by controller and seed."""
    found = results_in(folder / output)
    return {(controller.removeprefix("crew:"), seed): each for (controller, seed), each in found.items()}


@pytest.fixture(scope="module")
def sailed(folder):
    """A campaign of good and bad controllers: exit code, stdout, stderr."""
    return campaign(folder, ["steady", "counting", *FAILURES], "--seeds", "0", "--jobs", "2", "--timeout", "2")


@POSIX
@pytest.mark.parametrize("name", FAILURES)
def test_a_bad_controller_is_one_failed_cell(sailed, folder, name):
    cell = results(folder)[name, 0]
    assert re.match(FAILURES[name], cell.error), cell.error
    assert cell.task is None


@POSIX
def test_the_others_have_scores_and_the_campaign_succeeds(sailed, folder):
    code, out, err = sailed
    assert (code, "Traceback" in err) == (0, False), err
    assert f"2 of {2 + len(FAILURES)} trials finished, {len(FAILURES)} failed" in out
    good = results(folder)["steady", 0]
    assert good.error is None
    assert good.state == "finished"
    assert 0.0 < good.score < 20.0
    assert good.tracks["wamv"][0] == [0.0, 0.0]


@POSIX
def test_the_log_keeps_the_traceback(sailed, folder):
    (log,) = (folder / "results" / "cells" / "crew.raises").rglob("log.txt")
    text = log.read_text(encoding="utf-8")
    assert "Traceback (most recent call last)" in text
    assert "return steady(obs, t) if t < 2.0 else 1 / 0" in text


@POSIX
def test_the_page_and_the_table_are_there(sailed, folder):
    page = (folder / "results" / "index.html").read_text(encoding="utf-8")
    assert page.count('class="track') >= 2
    assert "ZeroDivisionError" in page
    table = (folder / "results" / "results.csv").read_text(encoding="utf-8").splitlines()
    assert len(table) == 1 + 2 + len(FAILURES)


def made(folder):
    folder.mkdir()
    return folder


def test_results_depend_neither_on_the_jobs_nor_on_their_order(folder, monkeypatch):
    monkeypatch.chdir(folder)
    trials = [Trial(Cell("crew:counting", "bay.yaml", seed)) for seed in range(3)]
    one = {result.cell: result for result in run_trials(trials, made(folder / "one"), ProcessPool(1))}
    two = {result.cell: result for result in run_trials(trials[::-1], made(folder / "two"), ProcessPool(2))}
    assert all(result.error is None for result in one.values())
    assert {cell: result.state_sha256 for cell, result in one.items()} == {
        cell: result.state_sha256 for cell, result in two.items()
    }
    assert {cell: result.score for cell, result in one.items()} == {cell: result.score for cell, result in two.items()}


@POSIX
@pytest.mark.parametrize("name", ["counting", "hoarding", "Moody"])
def test_trials_that_one_process_sails_are_what_they_are_alone(folder, monkeypatch, tmp_path, name):
    monkeypatch.chdir(folder)
    trials = [Trial(Cell(f"crew:{name}", "bay.yaml", seed)) for seed in range(16)]
    ended = {result.cell.seed: result for result in run_trials(trials, tmp_path, ProcessPool(1))}
    assert len(ended) == 16
    fate = {5: "exit code 3", 6: "KeyError", 7: "SIGSEGV"} if name == "Moody" else {}
    assert {seed: one.state for seed, one in ended.items()} == {n: "failed" if n in fate else "finished" for n in ended}
    assert all(text in ended[seed].error for seed, text in fate.items())
    assert len({one.poses_sha256 for one in ended.values() if one.state == "finished"}) == 1
    if name == "counting":
        monkeypatch.syspath_prepend(folder)
        monkeypatch.delitem(sys.modules, "crew", raising=False)
        sim = vrx_mj.Simulation(vrx_mj.compile_world("bay.yaml"))
        alone = vrx_mj.run(sim, controller=load_controller("crew:counting", 0))
        assert ended[0].state_sha256 == alone.state_sha256
    if name == "Moody":
        lines = [(tmp_path / trial.cell.folder / "log.txt").read_text(encoding="utf-8").split() for trial in trials]
        assert [int(words[1]) for words in lines] == list(range(16))
        assert len({words[3] for words in lines[2:5]}) == 1
        assert len({(*words[4:6],) for words in lines}) == 1  # no trial sees the numbers and names of another


def test_trials_are_the_runs_of_worlds_with_their_numbers(folder, monkeypatch, tmp_path):
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    plan = Plan(
        ("crew:steady",), ("windy.yaml", "gusts.yaml"), (3, 4), parse_vary(["wind.mean_velocity=2..8"]), duration=3.0
    )
    for result in run_trials([plan.trial(cell) for cell in plan.cells], tmp_path, ProcessPool(1)):
        numbers = {"wind.mean": result.parameters["wind.mean_velocity"]}
        sim = vrx_mj.Simulation(vrx_mj.compile_world(result.cell.world, parameters=numbers), seed=result.cell.seed)
        alone = vrx_mj.run(sim, 3.0, controller=import_module("crew").steady)
        score = alone.task.score if alone.task else None
        assert (result.state_sha256, result.score) == (alone.state_sha256, score)


@POSIX
def test_rows_are_sailed_together_and_one_that_fails_fails_alone(folder, monkeypatch):
    monkeypatch.chdir(folder)
    cells = [Cell(f"crew:{name}", "gusts.yaml", seed) for seed in range(6) for name in ("abreast", "leave")]
    ended = {}
    for rows in (True, False):
        place = made(folder / f"rows {rows}")
        trials = [Trial(cell, duration=2.0, rows=rows) for cell in cells]
        ended[rows] = {one.cell: replace(one, wall_time=0.0) for one in run_trials(trials, place, ProcessPool(1))}
    assert ended[True] == ended[False]
    states = {cell: result.state for cell, result in ended[True].items()}
    assert {states[cell] for cell in cells[::2]} == {"finished"}
    assert {states[cell] for cell in cells[1::2]} == {"finished", "failed"}
    logs = [len(list((folder / f"rows {rows}" / "cells" / "crew.abreast").rglob("log.txt"))) for rows in (True, False)]
    assert logs[0] < logs[1] == 6


@POSIX
def test_logs_of_rows_have_their_warnings(folder, monkeypatch):
    monkeypatch.chdir(folder)
    Path("upset.yaml").write_text("boats: [{name: wamv, pose: [0, 0, 1, 3, 0, 0]}]", encoding="utf-8")
    logs = {}
    for rows in (True, False):
        place = made(folder / f"upset {rows}")
        trials = [
            Trial(Cell("crew:abreast", "gusts.yaml", seed), fleet="upset.yaml", duration=1.0, rows=rows)
            for seed in range(3)
        ]
        assert all(not result.has_failed for result in run_trials(trials, place, ProcessPool(1)))
        texts = [(place / trial.cell.folder / "log.txt").read_text(encoding="utf-8") for trial in trials]
        logs[rows] = [re.findall("VrxWarning: (.*)", text) for text in texts]
    assert logs[True] == logs[False]
    assert [line for line in logs[True][2] if line.startswith("wamv has capsized at t = 0.1 s")]


@POSIX
def test_rows_that_end_their_worker_are_sailed_alone(folder, monkeypatch, tmp_path):
    monkeypatch.chdir(folder)
    trials = [Trial(Cell("crew:mutiny", "gusts.yaml", seed), duration=2.0, rows=True) for seed in range(16)]
    ended = run_trials(trials, tmp_path, ProcessPool(1))
    assert {(result.cell.seed, result.state) for result in ended} == {(seed, "finished") for seed in range(16)}


@POSIX
@pytest.mark.parametrize("how", ["killed", "orphaned"])
def test_a_trial_that_the_machine_ends_is_run_again(folder, monkeypatch, tmp_path, how):
    monkeypatch.chdir(folder)
    shutil.rmtree("kills", ignore_errors=True)
    Path("kills").mkdir()
    trials = [Trial(Cell(f"crew:{name}", "bay.yaml", seed)) for seed in (0, 1) for name in ("steady", how)]
    ended = {result.cell: result for result in run_trials(trials, tmp_path, ProcessPool(1))}
    assert [ended[trial.cell].state for trial in trials] == ["finished"] * 4
    fates = [{ended[trial.cell].state_sha256 for trial in trials if trial.cell.seed == seed} for seed in (0, 1)]
    assert ([len(own) for own in fates], len(list(Path("kills").iterdir()))) == ([1, 1], 2)


def test_a_controller_of_another_signature_is_refused_before_the_first_trial(folder):
    code, _, err = campaign(folder, ["steady", "one_argument"], output="refused")
    assert (code, len(err.splitlines())) == (2, 1)
    assert err.startswith("invalid controller 'crew:one_argument(obs)': two arguments are needed, the observations by")
    assert not (folder / "refused").exists()


@POSIX
def test_ctrl_c_keeps_what_is_finished_and_the_same_command_goes_on(folder):
    words = ("campaign", "crew:slow", "--worlds", "bay.yaml", "--seeds", "0..2", "--jobs", "1", "-o", "stopped")
    process = start(*words, cwd=folder)
    deadline = time.monotonic() + 300.0
    while not results(folder, "stopped"):
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    code, out, err = ended(process)
    before = results(folder, "stopped")
    assert (code, "Traceback" in err) == (1, False), err
    assert f"{len(before)} of 3 trials finished, 0 failed" in out
    assert "stopped; the same command continues from here" in err
    assert 1 <= len(before) < 3
    assert len(list((folder / "stopped").glob("cells/*/*/seed_*"))) == len(before)
    (folder / "hurry").touch()
    code, out, err = vrx(*words, "--against", "stopped", cwd=folder)
    after = results(folder, "stopped")
    assert (code, len(after)) == (0, 3), err
    assert f"stopped: {len(before)} of 3 trials are finished" in err
    assert {key: after[key].wall_time for key in before} == {key: each.wall_time for key, each in before.items()}


def test_a_changed_controller_is_not_mixed_in_and_is_compared(folder):
    (folder / "pilot.py").write_text("def go(obs, t):\n    return None\n", encoding="utf-8")
    words = ("campaign", "pilot:go", "--worlds", "bay.yaml", "--seeds", "0..1")
    assert vrx(*words, "-o", "before", cwd=folder)[0] == 0
    (folder / "pilot.py").write_text(
        "def go(obs, t):\n    return {'wamv': {'left': 0.3, 'right': 0.3}}\n", encoding="utf-8"
    )
    code, _, err = vrx(*words, "-o", "before", cwd=folder)
    assert (code, err.splitlines()) == (
        2,
        [
            "the campaign in 'before' is a different one:",
            "  the controller pilot:go has changed since",
            "give another folder with -o, or --restart to run all of it again",
        ],
    )
    code, out, _ = vrx(*words, "-o", "after", "--against", "before", "--record", cwd=folder)
    assert code == 0
    assert "compared with before: 2 trials in both, 0 alike" in out
    page = (folder / "after" / "index.html").read_text(encoding="utf-8")
    assert "too few pairs: 2 differ, at least 6 are needed" in page
    for seed in (0, 1):
        (file,) = (folder / "after").glob(f"cells/*/*/seed_{seed}/run.rrd")
        assert f'href="{file.relative_to(folder / "after").as_posix()}"' in page
