"""Workers, with false processes: what they sail together or alone, what they keep, and how they begin and end."""

import gc
import os
import signal
import sys
import warnings
from dataclasses import replace
from types import SimpleNamespace

import pytest

from vrx_mj.campaign import worker
from vrx_mj.campaign.plan import Cell, Serving, Trial
from vrx_mj.campaign.results import Result
from vrx_mj.campaign.worker import Worker, WorkerLostError, WorkerProcess, check_controllers
from vrx_mj.errors import VrxError

TRIALS = [Trial(Cell("crew:steady", "bay", seed)) for seed in range(6)]


def result_of(trial, state="finished", **own):
    return Result(trial.cell, state, **own)


@pytest.fixture
def sailed():
    """Seeds of the trials that each process was given, and whether as rows."""
    return []


@pytest.fixture
def sail(monkeypatch, tmp_path, sailed):
    """Run a worker on trials whose results a function gives, of the trial and of its place in its process."""

    def run(trials, fate=lambda trial, _place: result_of(trial), *, task=None, forks=True):
        def process(_root, chunk, *_, together):
            sailed.append(([trial.cell.seed for trial in chunk], together))
            found = [fate(trial, place) for place, trial in enumerate(chunk)]
            return SimpleNamespace(results=lambda: [one for one in found if one], is_over=True)

        monkeypatch.setattr(worker, "TrialProcess", process)
        monkeypatch.setattr(worker, "HAS_FORKSERVER", forks)
        sailor = Worker(tmp_path, None)
        world = SimpleNamespace(parameters=SimpleNamespace(task=task))
        monkeypatch.setattr(sailor, "_prepare", lambda _trial: setattr(sailor, "_warm", SimpleNamespace(world=world)))
        return list(sailor.run(trials))

    return run


def test_a_controller_that_does_alike_after_another_trial_goes_on_in_its_process(sail, sailed):
    assert sail(TRIALS) == [result_of(trial) for trial in TRIALS]
    assert [seeds for seeds, _ in sailed] == [[0, 1], [1], [2, 3, 4, 5]]


def test_one_that_does_not_begins_each_trial_in_a_process_of_its_own(sail, sailed):
    found = sail(TRIALS[:5], lambda trial, place: result_of(trial, sim_time=float(place)))
    assert [one.sim_time for one in found] == [0.0] * 5
    assert [seeds for seeds, _ in sailed] == [[0, 1], [1], [2], [3], [4]]


def test_the_time_that_a_trial_takes_makes_no_difference(sail, sailed):
    sail(TRIALS, lambda trial, place: result_of(trial, wall_time=float(len(sailed) + place)))
    assert [seeds for seeds, _ in sailed] == [[0, 1], [1], [2, 3, 4, 5]]


def test_a_failure_does_not_say_whether_a_controller_repeats(sail, sailed):
    def fate(trial, place):
        if trial.cell.seed in {0, 2}:
            return result_of(trial, "failed") if place == 0 else None
        return result_of(trial) if place == 0 else None

    assert [one.cell.seed for one in sail([*TRIALS, Trial(Cell("crew:steady", "bay", 6))], fate)] == list(range(7))
    assert [seeds for seeds, _ in sailed] == [[0, 1], [1], [2], [3], [4], [5], [6]]


@pytest.mark.parametrize(("count", "forks"), [(2, True), (4, False)])
def test_few_trials_or_processes_that_do_not_fork_are_not_compared(sail, sailed, count, forks):
    sail(TRIALS[:count], forks=forks)
    assert [seeds for seeds, _ in sailed] == [[seed] for seed in range(count)]


def test_trials_are_sailed_by_world_and_controller_and_those_with_a_recording_or_a_program_alone(sail, sailed):
    other = [replace(trial, cell=replace(trial.cell, world="lake")) for trial in TRIALS[:2]]
    alone = [replace(TRIALS[2], record=True), replace(TRIALS[3], serving=Serving())]
    sail([TRIALS[0], other[0], *alone, TRIALS[1], other[1]])
    assert [seeds for seeds, _ in sailed] == [[0], [1], [0], [1], [2], [3]]


def test_rows_are_sailed_64_at_a_time_and_those_that_have_no_result_alone(sail, sailed):
    trials = [Trial(Cell("crew:rows", "bay", seed), rows=True) for seed in range(130)]

    def fate(trial, _place):
        odd = trial.cell.seed in {3, 70}
        return result_of(trial, "failed") if odd and len(sailed[-1][0]) > 1 else result_of(trial)

    assert sorted(one.cell.seed for one in sail(trials, fate)) == list(range(130))
    alone = [([3], False), ([70], False)]
    parts = [(list(range(first, min(first + 64, 130))), True) for first in (0, 64, 128)]
    assert sailed == [parts[0], alone[0], parts[1], alone[1], parts[2]]


def test_rows_of_a_world_with_a_task_or_a_single_one_are_no_batch(sail, sailed):
    rows = [replace(trial, rows=True) for trial in TRIALS[:2]]
    sail(rows, task="dock")
    sail(rows[:1])
    assert sailed == [([0], False), ([1], False), ([0], False)]


class Process:
    """A process of trials that has results once it was waited for, or hears from the owner meanwhile."""

    def __init__(self, heard=()):
        self.is_over, self.heard, self.withdrawn = False, list(heard), False

    def results(self):
        if self.heard:
            return []
        self.is_over = True
        return [result_of(TRIALS[0])]

    def wait(self, other):
        assert other == ["owner"]
        return self.heard.pop(0)

    def withdraw(self):
        self.withdrawn = True


def test_what_is_under_way_is_waited_for_or_given_up_when_its_owner_ends(monkeypatch, tmp_path):
    process = Process([False, False])
    monkeypatch.setattr(worker, "TrialProcess", lambda *_, **_options: process)
    assert list(Worker(tmp_path, "owner")._results(TRIALS[:1])) == [result_of(TRIALS[0])]
    assert not process.withdrawn
    process = Process([False, True])
    with pytest.raises(SystemExit):
        list(Worker(tmp_path, "owner")._results(TRIALS[:1]))
    assert process.withdrawn


@pytest.mark.parametrize(
    ("error", "words"), [(OSError(28, "No space left on device"), "No space left on device"), (OSError("odd"), "odd")]
)
def test_a_trial_whose_folder_cannot_be_made_is_lost(monkeypatch, tmp_path, error, words):
    def process(*_, **_options):
        raise error

    monkeypatch.setattr(worker, "TrialProcess", process)
    (result,) = Worker(tmp_path, None)._results(TRIALS[1:])
    assert (result.cell, result.state, result.error) == (
        TRIALS[1].cell, "lost", f"cannot write '{tmp_path}': {words}"
    )  # fmt: skip


def test_a_world_is_compiled_once_with_its_warnings_and_its_map(monkeypatch, tmp_path):
    done = []

    def compiled(name, fleet):
        done.append(f"compile {name} {fleet}")
        warnings.warn(f"{name} is shallow", UserWarning, stacklevel=1)
        if name == "nowhere":
            raise VrxError("no world")
        task = "dock" if name == "dock" else None
        return SimpleNamespace(name=name, sha256="1", numbers={}, parameters=SimpleNamespace(task=task))

    monkeypatch.setattr(worker, "compile_world", compiled)
    monkeypatch.setattr(worker, "sketch_of", lambda world: done.append("sketch") or {"name": world.name})
    monkeypatch.setattr(worker, "Simulation", lambda world: done.append("simulation") or SimpleNamespace(world=world))
    monkeypatch.setattr(worker, "Batch", lambda _world, rows: done.append(f"batch of {rows}"))
    monkeypatch.setattr(worker, "fingerprint", lambda: done.append("fingerprint"))
    for name in ("collect", "freeze"):
        monkeypatch.setattr(gc, name, lambda name=name: done.append(name))
    sailor = Worker(tmp_path, None)

    def prepared(trial):
        done.clear()
        sailor._prepare(trial)
        return done[:]

    last = ["collect", "freeze"]
    first = ["compile bay None", "sketch", "fingerprint", "simulation"]
    assert prepared(TRIALS[0]) == [*first, *last]
    assert (tmp_path / "worlds" / "bay.json").read_text(encoding="utf-8") == '{"format": 1, "name": "bay"}\n'
    assert [str(note.message) for note in sailor._notes] == ["bay is shallow"]
    assert prepared(TRIALS[1]) == []
    rows = replace(TRIALS[0], rows=True, fleet="two")
    assert prepared(rows) == ["compile bay two", "fingerprint", "simulation", "batch of 1", *last]
    dock = replace(rows, cell=Cell("crew:steady", "dock", 0))
    assert prepared(dock) == ["compile dock two", "sketch", "fingerprint", "simulation", *last]
    assert sailor._warm.world.name == "dock"
    assert prepared(replace(dock, cell=Cell("crew:steady", "nowhere", 0))) == ["compile nowhere two", *last]
    assert sailor._warm is None  # its trials say what is wrong


class Context:
    """Makes false processes, whose ends of pipes are these."""

    def __init__(self, ours, theirs, target=None):
        self.ours, self.theirs, self.target, self.did, self.exitcode = ours, theirs, target, [], 7

    def Pipe(self, duplex=True):  # noqa: N802 - as multiprocessing has it
        self.duplex = duplex
        return self.ours, self.theirs

    def Process(self, target, args):  # noqa: N802
        self.made = target, args
        return self

    def start(self):
        self.did.append("start")
        if self.target:
            self.target(*self.made[1])

    def kill(self):
        self.did.append("kill")

    def join(self):
        self.did.append("join")


class End:
    """An end of a pipe."""

    def __init__(self, *came):
        self.came, self.sent, self.closed, self.waits = list(came), [], False, []

    def recv(self):
        found = self.came.pop(0)
        if isinstance(found, BaseException):
            raise found
        return found

    def send(self, what):
        if what == ["gone"]:
            raise BrokenPipeError
        self.sent.append(what)

    def poll(self, timeout):
        self.waits.append(timeout)
        return bool(self.came)

    def fileno(self):
        return 5

    def close(self):
        self.closed = True


def test_a_worker_of_its_own_process_takes_trials_and_gives_results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ours, theirs = End(None, result_of(TRIALS[0]), EOFError()), End()
    process = WorkerProcess(context := Context(ours, theirs), tmp_path)
    assert context.made == (worker._work, (theirs, tmp_path, dict(os.environ), str(tmp_path)))
    assert (theirs.closed, context.did, process.fileno()) == (True, ["start"], 5)
    process.submit((TRIALS[0],))
    process.submit(("gone",))  # which the next result says
    assert ours.sent == [[TRIALS[0]]]
    assert [process.take(), process.take()] == [None, result_of(TRIALS[0])]
    with pytest.raises(WorkerLostError, match=r"^its worker ended with exit code 7$"):
        process.take()
    assert context.did == ["start", "join"]
    process.close()
    process.join()
    assert (ours.closed, context.did) == (True, ["start", "join", "join"])


def test_its_process_says_when_it_is_idle_and_ends_with_its_owner(monkeypatch, tmp_path):
    begun = []
    monkeypatch.setattr(worker, "_begin_process", lambda *given: begun.append(given))
    monkeypatch.setattr(Worker, "run", lambda _self, chunk: map(result_of, chunk))
    owner = End(TRIALS[:2], TRIALS[2:3], EOFError())
    worker._work(owner, tmp_path, {"SIDE": "port"}, "/here")
    first, second, third = map(result_of, TRIALS[:3])
    assert owner.sent == [None, first, second, None, third, None]
    assert begun == [({"SIDE": "port"}, "/here")]


@pytest.mark.skipif(not hasattr(os, "setsid"), reason="sessions of other systems")
def test_a_process_takes_over_where_it_was_started(monkeypatch, tmp_path):
    done = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "setsid", lambda: done.append("setsid"))
    monkeypatch.setattr(signal, "signal", lambda *given: done.append(given))
    monkeypatch.setattr(os, "environ", {"MOOD": "bad"})
    (tmp_path / "here").mkdir()
    worker._begin_process({"SIDE": "port"}, str(tmp_path / "here"))
    assert done == [(signal.SIGINT, signal.SIG_IGN), "setsid"]
    assert (os.environ, os.getcwd()) == ({"SIDE": "port"}, str(tmp_path / "here"))  # noqa: PTH109


CREW = """
class Rows:
    rows = True

    def reset(self, seeds):
        pass

    def __call__(self, features, t):
        return features

def steady(obs, t):
    return {}

def short(obs):
    return {}

def __getattr__(name):
    raise RuntimeError("no such sailor")
"""


@pytest.fixture
def crew(monkeypatch, tmp_path):
    """Controllers in the current folder, checked in this process; what it is waited for, and how it ended."""
    ended, contexts = [], []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path[:])
    (tmp_path / "checked_crew.py").write_text(CREW, encoding="utf-8")
    monkeypatch.setattr(worker, "_begin_process", lambda *_: None)
    monkeypatch.setattr(worker, "log_into", lambda file: ended.append(str(file)))
    monkeypatch.setattr(os, "_exit", ended.append)
    monkeypatch.setattr(worker, "start_server", lambda: contexts[-1])

    def check(*names):
        pipe = End()
        pipe.send = pipe.came.append
        contexts.append(Context(pipe, pipe, worker._check_controller))
        return check_controllers([f"checked_crew:{name}" for name in names]), pipe, contexts[-1], ended

    yield check
    sys.modules.pop("checked_crew", None)


def test_controllers_that_take_rows_are_known_and_what_one_raises_is_left_to_its_trials(crew):
    found, pipe, context, ended = crew("steady", "Rows", "ghost")
    assert found == {"checked_crew:Rows"}
    assert (pipe.waits, context.duplex) == ([60.0] * 3, False)
    assert context.did == ["start", "kill", "join"] * 3
    assert ended == [os.devnull, 0] * 3
    assert pipe.closed


def test_a_controller_that_takes_other_arguments_is_refused(crew):
    with pytest.raises(VrxError, match="checked_crew:short"):
        crew("short")


def test_a_check_that_ends_early_says_nothing(monkeypatch):
    monkeypatch.setattr(worker, "controller_hash", lambda _name: "1")
    monkeypatch.setattr(worker, "start_server", lambda: Context(End(EOFError()), End()))
    assert check_controllers(["a:f"]) == frozenset()
