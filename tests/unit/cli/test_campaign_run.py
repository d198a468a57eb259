"""`vrx-mj campaign` from its words to its last line, with trials that are not sailed."""

import csv
from dataclasses import replace
from types import SimpleNamespace

import pytest

from campaigns import failed, scored
from vrx_mj.campaign.plan import Cell, Serving
from vrx_mj.campaign.results import Result
from vrx_mj.campaign.scores import Mean
from vrx_mj.cli.campaign import CampaignProgress, _engine, _mean, _outcome

CREW = "def steady(obs, t):\n    return {}\n\ndef rows(obs, t):\n    return {}\n"


@pytest.fixture
def sailed(monkeypatch, folder, cli):
    """Start a campaign whose trials end as a function says; what the engine was given, and what was printed."""
    (folder / "crew.py").write_text(CREW, encoding="utf-8")
    asked = []

    def start(*words, fate=lambda cell: scored(cell.controller, cell.world, cell.seed, 1.5)):
        def run_trials(trials, root, engine, *, running):
            asked[:] = [trials, root, engine]
            running(2)
            for trial in trials:
                yield fate(trial.cell)

        monkeypatch.setattr("vrx_mj.campaign.engines.run_trials", run_trials)
        monkeypatch.setattr("vrx_mj.campaign.worker.check_controllers", lambda names: {"crew:rows"} & {*names})
        return asked, cli("campaign", *words, "-o", "out")

    return start


def test_a_campaign_sails_every_cell_and_prints_its_scores(sailed, folder):
    words = ("crew:steady", "crew:rows", "--worlds", "ocean", "--seeds", "0,2", "--jobs", "3", "--duration", "4",
             "--timeout", "9", "--record", "--vary", "wind.mean_velocity=1..5", "--fleet", "trio")  # fmt: skip
    (trials, root, engine), said = sailed(*words)
    assert (said.code, root.name, engine._jobs) == (0, "out", 3)
    assert [(trial.cell, trial.rows) for trial in trials] == [
        (Cell(f"crew:{who}", "ocean", seed), who == "rows") for seed in (0, 2) for who in ("steady", "rows")
    ]
    assert {(trial.duration, trial.timeout, trial.record, trial.fleet, trial.serving) for trial in trials} == {
        (4.0, 9.0, True, "trio", None)
    }
    assert all(1.0 <= trial.parameters["wind.mean_velocity"] <= 5.0 for trial in trials)
    assert said.out.splitlines()[-1] == "4 of 4 trials finished, 0 failed; page: out/index.html"
    assert "leaderboard" in said.out
    lines = [f"[{number}/4] {trial.cell}: 1.5 m (320 s in 0.0 s)" for number, trial in enumerate(trials, start=1)]
    assert said.err.splitlines() == lines
    assert (folder / "out" / "index.html").is_file()
    with (folder / "out" / "results.csv").open(encoding="utf-8") as table:
        assert len(list(csv.DictReader(table))) == 4


def test_a_stopped_campaign_goes_on_with_what_is_left_and_is_compared(sailed, folder):
    def stop(cell):
        if cell.seed == 1:
            raise KeyboardInterrupt
        return scored(cell.controller, cell.world, cell.seed, 2.5)

    words = ("crew:steady", "--worlds", "ocean", "--seeds", "0..2")
    _, said = sailed(*words, fate=stop)
    assert said.code == 1
    assert said.out.splitlines()[-1] == "1 of 3 trials finished, 0 failed; page: out/index.html"
    assert said.err.splitlines()[-1] == "stopped; the same command continues from here"
    (trials, *_), said = sailed(*words)
    assert [trial.cell.seed for trial in trials] == [1, 2]
    assert (said.code, said.err.splitlines()[0]) == (0, "out: 1 of 3 trials are finished")
    (trials, *_), said = sailed(*words, "--restart", "--against", "out")
    assert (len(trials), said.code) == (3, 0)
    assert "compared with out: 3 trials in both, 2 alike" in said.out  # 1.5 m for 2.5 m in the first
    assert "are finished" not in said.err


@pytest.mark.parametrize(("good", "code"), [(0, 1), (1, 0)])
def test_a_campaign_of_which_every_trial_failed_has_failed(sailed, good, code):
    def fate(cell):
        return scored("crew:steady", "ocean", 0, 1.5) if cell.seed < good else failed("crew:steady", "ocean", cell.seed)

    _, said = sailed("crew:steady", "--worlds", "ocean", "--seeds", "0..2", fate=fate)
    last = f"{good} of 3 trials finished, {3 - good} failed; page: out/index.html"
    assert (said.code, said.out.splitlines()[-1]) == (code, last)
    assert f"crew:steady in ocean, seed {good}: it sank (and {2 - good} more like it)" in said.out


def test_failures_of_ten_kinds_are_shown(sailed):
    def fate(cell):
        return failed("crew:steady", "ocean", cell.seed, f"it sank by {'x' * cell.seed}")

    _, said = sailed("crew:steady", "--worlds", "ocean", "--seeds", "0..10", fate=fate)
    assert said.out.count("it sank by") == 10
    assert "and 1 other kinds of failures: see the page" in said.out
    _, said = sailed("crew:steady", "--worlds", "ocean", "--seeds", "0..9", "--restart", fate=fate)
    assert (said.out.count("it sank by"), "other kinds" in said.out) == (10, False)


def test_worlds_that_no_seed_changes_are_named(sailed):
    def fate(cell):
        return replace(scored(cell.controller, cell.world, cell.seed, 1.5), poses_sha256="ab", state_sha256="ab")

    _, said = sailed("crew:steady", "--worlds", "ocean", "--seeds", "0..2", fate=fate)
    assert "ocean: all 3 seeds give the same motion; --vary draws weather or boats per seed" in said.out


@pytest.mark.parametrize(
    ("words", "serving"),
    [
        ((), Serving(1.0, None, rosbridge=False, ardupilot=False)),
        (("--rate", "max", "--lockstep", "A,B", "--rosbridge"), Serving(None, ("A", "B"), rosbridge=True)),
        (("--rate", "2", "--ardupilot"), Serving(2.0, None, ardupilot=True)),
    ],
)
def test_programs_are_served_as_the_words_say(sailed, words, serving):
    (trials, *_), said = sailed("--exec", "./sail", "--worlds", "ocean", *words)
    assert said.code == 0
    assert [(trial.cell.controller, trial.rows, trial.serving) for trial in trials] == [("./sail", False, serving)]


def test_trials_run_on_each_core_or_on_a_cluster(monkeypatch):
    for share, jobs in ((2.9, 2), (0.5, 1)):
        monkeypatch.setattr("vrx_mj.runtime.limits.core_share", lambda share=share: (8, share))
        assert _engine(None, None)._jobs == jobs
    assert _engine(5, None)._jobs == 5
    cluster = _engine(5, "auto")
    assert (cluster._address, cluster._jobs) == ("auto", 5)
    assert _engine(None, "")._address is None


@pytest.mark.parametrize(
    ("mean", "count", "task", "text"),
    [
        (Mean((1.0, 3.0), 0), 2, True, "2 ± 1.4"),
        (Mean((1.0,), 1, lost=2), 5, True, "1, 1 of 5 failed, 2 of 5 lost"),
        (Mean((1.0,), 0, unstarted=1, cut=1), 3, True, "1, 1 of 3 not started, 1 of 3 cut"),
        (Mean((), 2), 2, True, "2 of 2 failed"),
        (Mean((), 0, lost=2), 2, True, "2 of 2 lost"),
        (Mean((), 0, unstarted=1), 1, True, "1 of 1 not started"),
        (Mean((), 0), 0, True, "not sailed"),
        (Mean((), 0), 2, False, "no task"),
        (Mean((), 1), 2, False, "no task, 1 of 2 failed"),
        (Mean((), 1, lost=1), 2, False, "1 of 2 failed, 1 of 2 lost"),
    ],
)  # fmt: skip
def test_a_mean_has_notes_of_what_is_missing(mean, count, task, text):
    assert _mean(mean, count, has_task=task) == text


def test_an_outcome_is_a_score_or_how_it_ended():
    cut, early = (scored("a:f", "w", 0, 1.23456, phase=phase) for phase in ("running", "ready"))
    plain = Result(cut.cell, sim_time=2.5, wall_time=0.26)
    assert [_outcome(one) for one in (cut, early, plain, failed("a:f", "w", 0))] == [
        "1.235 m, cut (320 s in 0.0 s)", "not started (320 s in 0.0 s)", "no task (2.5 s in 0.3 s)", "failed: it sank",
    ]  # fmt: skip


def test_a_bar_shows_how_many_run_and_failures_are_red():
    lines, states = [], []
    bar = SimpleNamespace(watched=False, print=lambda _line, color: lines.append(color))
    bar.update = lambda *given: states.append(given)
    progress = CampaignProgress(bar, 4)
    progress.running(3)
    progress.note_result(failed("a:f", "w", 0))
    progress.note_result(replace(failed("a:f", "w", 1), state="lost"))
    progress.note_result(scored("a:f", "w", 2, 1.0))
    assert states == [(0, "3 running, 0 failed"), *((done, f"3 running, {min(done, 2)} failed") for done in (1, 2, 3))]
    assert lines == ["red", "red", None]
