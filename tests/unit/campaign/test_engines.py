"""Trials on workers that end, lose trials or never start: each trial has one result, or the campaign says why not."""

import shutil
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import pytest

from vrx_mj.campaign import worker
from vrx_mj.campaign.engines import run_trials
from vrx_mj.campaign.plan import Cell, Trial
from vrx_mj.campaign.results import Result
from vrx_mj.campaign.worker import WorkerLostError
from vrx_mj.errors import VrxError

TRIALS = [Trial(Cell("crew:steady", "bay.yaml", seed)) for seed in range(40)]


class Workers:
    """An engine of three workers, whose fate is a function of the trial and of how often it has begun."""

    def __init__(self, fate, count=3):
        self.fate, self.begun, self.started, self.closed, self.count, self.chunks = fate, Counter(), 0, 0, count, []

    def open(self, root):
        return self.count

    def start(self):
        self.started += 1
        return Worker(self)

    def ready(self, workers):
        return workers[-1:]

    def close(self):
        self.closed += 1


class Worker:
    def __init__(self, engine):
        self.engine, self.chunk, self.says_idle = engine, [], True

    def submit(self, chunk):
        assert not self.chunk
        self.engine.chunks.append(len(chunk))
        self.chunk, self.says_idle = list(chunk), True

    def take(self):
        if not self.chunk:
            assert self.says_idle
            self.says_idle = False
            return None
        trial = self.chunk.pop(0)
        self.engine.begun[trial.cell.seed] += 1
        fate = self.engine.fate(trial.cell.seed, self.engine.begun[trial.cell.seed])
        if fate == "worker":
            raise WorkerLostError("its worker is gone")
        return Result(trial.cell, fate, error="no memory" if fate == "lost" else None)

    def close(self):
        self.engine.closed += 1

    def join(self):
        pass


@pytest.mark.parametrize("how", ["worker", "lost"])
def test_what_the_machine_loses_is_run_again_and_each_trial_has_one_result(tmp_path, how):
    engine = Workers(lambda seed, begun: how if seed % 7 == 3 and begun < 4 else "finished")
    results = list(run_trials(TRIALS, tmp_path, engine))
    assert sorted(result.cell for result in results) == [trial.cell for trial in TRIALS]
    assert {result.state for result in results} == {"finished"}
    assert engine.begun == {seed: 4 if seed % 7 == 3 else 1 for seed in range(40)}
    assert engine.closed == engine.started + 1


@pytest.mark.parametrize("how", ["worker", "lost"])
def test_a_trial_that_is_lost_four_times_is_given_up_without_a_score(tmp_path, how):
    engine = Workers(lambda seed, _begun: how if seed == 5 else "finished")
    results = {result.cell.seed: result for result in run_trials(TRIALS, tmp_path, engine)}
    assert (len(results), results[5].state, results[5].score, engine.begun[5]) == (40, "lost", None, 4)
    assert Counter(result.state for result in results.values()) == {"finished": 39, "lost": 1}


@pytest.mark.parametrize(
    ("count", "chunks"), [(1, [64, 1000, 936]), (2, [64, 485, 363, 273, 204, 153, 115, 86, 65, 49, 36, 27])]
)
def test_workers_get_many_short_trials_and_fewer_towards_the_end(tmp_path, count, chunks):
    engine = Workers(lambda *_: "finished", count)
    trials = [replace(TRIALS[0], cell=replace(TRIALS[0].cell, seed=seed)) for seed in range(2000)]
    assert len(list(run_trials(trials, tmp_path, engine))) == sum(engine.chunks) == 2000
    assert engine.chunks[: len(chunks)] == chunks
    assert engine.chunks[-1] == (936 if count == 1 else 1)


def test_a_failed_trial_is_not_run_again(tmp_path):
    engine = Workers(lambda _seed, _begun: "failed")
    assert len(list(run_trials(TRIALS, tmp_path, engine))) == sum(engine.begun.values()) == 40


def test_a_folder_that_is_gone_ends_the_campaign_with_one_line(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    run = run_trials(TRIALS, folder, engine := Workers(lambda seed, _begun: "lost" if seed else "finished"))
    with pytest.raises(VrxError, match=r"^the campaign's folder '.*results' is gone; once it can be written, the same"):
        [shutil.rmtree(folder, ignore_errors=True) for _ in run]
    assert (sum(engine.begun.values()) < 5, engine.closed) == (True, engine.started + 1)


def test_workers_that_never_start_end_the_campaign(tmp_path, monkeypatch):
    def take(_worker):
        raise WorkerLostError("its worker ended with exit code 1")

    monkeypatch.setattr(Worker, "take", take)
    with pytest.raises(VrxError, match=r"^no worker starts: its worker ended with exit code 1$"):
        list(run_trials(TRIALS, tmp_path, engine := Workers(None)))
    assert engine.started <= 10


@pytest.mark.parametrize("task", [None, "stationkeeping"])
def test_rows_are_sailed_together_unless_their_world_has_a_task(tmp_path, monkeypatch, task):
    sailed, trials = [], [replace(trial, rows=True) for trial in TRIALS[:3]]

    def sailing(_root, chunk, *_, together):
        sailed.append((len(chunk), together))
        return SimpleNamespace(results=lambda: [Result(trial.cell, "finished") for trial in chunk], is_over=True)

    monkeypatch.setattr(worker, "TrialProcess", sailing)
    sailor = worker.Worker(tmp_path, None)
    sailor._open = trials[0].cell.world, trials[0].fleet
    sailor._warm = SimpleNamespace(world=SimpleNamespace(parameters=SimpleNamespace(task=task)))
    assert [result.cell for result in sailor.run(trials)] == [trial.cell for trial in trials]
    with_run_lock = [(2, False), (1, False), (1, False)]  # whether the second comes out alike alone; then the third
    assert sailed == ([(3, True)] if task is None else with_run_lock)


def test_how_many_trials_are_under_way_is_told_as_it_changes(tmp_path):
    told, engine = [], Workers(lambda *_: "finished", 2)
    engine.ready = list
    list(run_trials(TRIALS[:4], tmp_path, engine, running=told.append))
    assert told == [0, 2, 1, 1]  # one chunk of two trials, then single ones
    assert list(run_trials([], tmp_path, None)) == []


def test_long_trials_are_handed_out_by_64_at_most(tmp_path, monkeypatch):
    engine, take = Workers(lambda *_: "finished", 1), Worker.take
    monkeypatch.setattr(Worker, "take", lambda own: (found := take(own)) and replace(found, wall_time=0.1))
    trials = [replace(TRIALS[0], cell=replace(TRIALS[0].cell, seed=seed)) for seed in range(150)]
    list(run_trials(trials, tmp_path, engine))
    assert engine.chunks == [64, 64, 22]


def test_rows_of_a_worker_that_ended_are_sailed_alone(tmp_path, monkeypatch):
    handed, submit = [], Worker.submit
    monkeypatch.setattr(Worker, "submit", lambda own, chunk: handed.append([*chunk]) or submit(own, chunk))
    trials = [replace(trial, rows=True) for trial in TRIALS[:3]]
    engine = Workers(lambda seed, begun: "worker" if (seed, begun) == (1, 1) else "finished", 1)
    list(run_trials(trials, tmp_path, engine))
    assert [[(trial.cell.seed, trial.rows) for trial in chunk] for chunk in handed] == [
        [(0, True), (1, True), (2, True)], [(1, False), (2, False)],
    ]  # fmt: skip


def test_a_folder_that_is_full_ends_the_campaign(tmp_path, monkeypatch):
    wrote = []

    def write_files(_folder, files, _what):
        wrote.extend((name, len(text)) for name, text in files.items())
        raise VrxError("cannot write the campaign: No space left on device")

    monkeypatch.setattr("vrx_mj.campaign.engines.write_files", write_files)
    with pytest.raises(VrxError, match=r"^cannot write .* left on device; once it can be written, the same command"):
        list(run_trials(TRIALS, tmp_path, Workers(lambda *_: "lost")))
    assert wrote == [(".probe", 65536)]


@pytest.mark.parametrize("jobs", [1, 4])
def test_as_many_workers_may_fail_to_start_as_there_are_and_three(tmp_path, monkeypatch, jobs):
    def take(_worker):
        raise WorkerLostError("its worker ended with exit code 1")

    monkeypatch.setattr(Worker, "take", take)
    engine = Workers(None, jobs)
    engine.ready = lambda workers: workers[:1]
    with pytest.raises(VrxError, match=r"^no worker starts: its worker ended with exit code 1$"):
        list(run_trials(TRIALS, tmp_path, engine))
    assert engine.started == 2 * jobs + 3
