"""The process of trials, with false clocks and processes: what it is given, how long it is waited for, how it ends."""

import contextlib
import faulthandler
import logging
import os
import pickle
import signal
import sys
import threading
import warnings
from itertools import chain
from types import SimpleNamespace

import pytest

from vrx_mj.campaign import process
from vrx_mj.campaign.plan import Cell, Trial
from vrx_mj.campaign.process import TrialProcess
from vrx_mj.campaign.results import END, GROUP, REACHED, Result
from vrx_mj.errors import VrxError

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="process groups of other systems")

TRIALS = [Trial(Cell("crew:steady", "bay", seed)) for seed in range(3)]
FOLDERS = [trial.cell.folder for trial in TRIALS]
RESULTS = [Result(trial.cell, "finished") for trial in TRIALS]
FAILED = [Result(trial.cell, "failed", error="it sank") for trial in TRIALS]
GROUP_KILLED = "group 41: SIGKILL"
KILLED = [GROUP_KILLED, "kill", "join", GROUP_KILLED, "join", GROUP_KILLED]
BEGUN = 1000.0
"""When the process starts, by the false clock [s]."""


class FalseProcess:
    """Runs until it is killed, or `lasts` as many joins as that."""

    pid, sentinel = 41, "end"

    def __init__(self, log, target, args):
        self.log, self.args, self.exitcode, self.lasts = log, args, None, 99
        log.append(f"made for {target.__name__}")

    def start(self):
        self.log.append("start")

    def is_alive(self):
        return self.exitcode is None

    def join(self, timeout=None):
        self.log.append(f"join {timeout:g}" if timeout else "join")
        self.lasts -= 1
        if self.lasts <= 0 and self.exitcode is None:
            self.exitcode = 0

    def terminate(self):
        self.log.append("terminate")

    def kill(self):
        self.log.append("kill")
        self.exitcode = -9 if self.exitcode is None else self.exitcode


class Row:
    """The end of a pipe from which results are read; an error among them is raised."""

    def __init__(self):
        self.came = []

    def poll(self):
        return bool(self.came)

    def recv(self):
        found = self.came.pop(0)
        if isinstance(found, Exception):
            raise found
        return found


@pytest.fixture
def log():
    return []


@pytest.fixture
def clock(monkeypatch):
    now = [BEGUN]
    monkeypatch.setattr(process, "time", SimpleNamespace(monotonic=lambda: now[0]))
    return now


@pytest.fixture
def begin(monkeypatch, tmp_path, clock, log):
    """Start the process of trials, with false parts."""

    def pipe(*, duplex):
        assert not duplex
        return Row(), SimpleNamespace(close=lambda: log.append("close"))

    def context(how):
        log.append(how)
        return SimpleNamespace(
            Array=lambda _kind, numbers, lock: list(numbers),
            Pipe=pipe,
            Process=lambda target, args: FalseProcess(log, target, args),
        )

    monkeypatch.setattr(process.multiprocessing, "get_context", context)
    monkeypatch.setattr(os, "killpg", lambda group, number: log.append(f"group {group}: {number.name}"))
    monkeypatch.setattr(os, "kill", lambda pid, number: log.append(f"{pid}: {number.name}"))
    (tmp_path / FOLDERS[1]).mkdir(parents=True)
    (tmp_path / FOLDERS[0]).mkdir()
    (tmp_path / FOLDERS[0] / "old.txt").touch()

    def start(count=1, **options):
        made = TrialProcess(tmp_path, TRIALS[:count], **options)
        made.started, log[:] = log[:], []
        return made

    return start


@pytest.mark.parametrize(("forks", "how"), [(True, "fork"), (False, "spawn")])
def test_it_begins_in_empty_folders_with_what_can_be_handed_on(begin, monkeypatch, tmp_path, forks, how):
    monkeypatch.setattr(process, "HAS_FORKSERVER", forks)
    sailing = begin(2, warm="a world", notes=["a warning"], owner="a pipe", together=True)
    assert sailing.started == [how, "made for _sail_here", "start", "close"]
    assert [(tmp_path / folder).exists() for folder in FOLDERS[:2]] == [True, False]
    assert list((tmp_path / FOLDERS[0]).iterdir()) == []
    trials, root, shared, _sent, together, *given = sailing._process.args
    assert (trials, root, together) == (TRIALS[:2], tmp_path, True)
    assert given == (["a world", ["a warning"], "a pipe"] if forks else [None, (), None])
    assert shared == [BEGUN + 120.0, 120.0, 0.0, 0.0]  # time to start, and to compile a world
    assert sailing.is_over is False
    assert begin()._process.args[4] is False


def test_it_begins_neither_without_its_folder_nor_outside_of_it(begin, tmp_path):
    with pytest.raises(FileNotFoundError, match=r"^the folder '.*/gone' is gone$"):
        TrialProcess(tmp_path / "gone", TRIALS)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "cells").symlink_to(elsewhere)
    with pytest.raises(VrxError, match=r"inside/cells' is a link; remove it$"):
        TrialProcess(inside, TRIALS)


def test_it_is_looked_after_four_times_a_second_and_results_that_follow_each_other_are_gathered(begin, monkeypatch):
    waits, came = [], [[], ["owner"], ["end"], [], []]

    def wait(ends, timeout):
        waits.append((len(ends), timeout))
        return came.pop(0)

    monkeypatch.setattr(process, "wait", wait)
    sailing = begin(2)
    assert [sailing.wait(["owner"]), sailing.wait(["owner"])] == [False, True]
    sailing._row.came = [RESULTS[:1]]
    assert sailing.results() == RESULTS[:1]
    assert sailing.wait(["owner"]) is False  # it has ended, and no more is to be waited for
    assert waits == [(3, 0.25), (3, 0.25), (2, 0.1)]
    sailing._row.came = [RESULTS[:1]]
    sailing._left = [trial.cell for trial in TRIALS]
    sailing.results()
    assert (sailing.wait([]), waits[3:]) == (False, [(1, 0.1), (2, 0.25)])


def test_results_come_as_trials_end_and_the_last_one_ends_it(begin, tmp_path):
    sailing = begin(3)
    assert (sailing.results(), sailing.is_over) == ([], False)
    sailing._row.came = [RESULTS[:1]]
    assert (sailing.results(), sailing.is_over, sailing._folder) == (RESULTS[:1], False, tmp_path / FOLDERS[1])
    sailing._process.lasts = 1
    sailing._row.came = [RESULTS[1:]]
    assert (sailing.results(), sailing.is_over) == (RESULTS[1:], True)


def test_one_that_stays_after_its_result_is_killed_five_seconds_later(begin, log):
    sailing = begin()
    sailing._row.came = [RESULTS[:1]]
    assert (sailing.results(), sailing.is_over) == (RESULTS[:1], True)
    assert log == [
        "join 5",
        *["group 41: SIGKILL", "kill", "join"],
        *["group 41: SIGKILL", "join"],
        "group 41: SIGKILL",
    ]


def test_a_process_that_ends_between_two_trials_leaves_the_others_to_another_one(begin):
    sailing = begin(2)
    sailing._row.came = [RESULTS[:1], EOFError()]
    sailing.results()
    sailing._process.exitcode = 3
    assert (sailing.results(), sailing.is_over) == ([], True)


TRACEBACK = """Fatal
  File "/lib/a.py", line 9 in x
  File "{here}/crew.py", line 7 in steer
  File "{here}/b.py", line 1
"""


@pytest.mark.parametrize("how", ["asked", "ends by itself"])
def test_one_whose_time_is_up_says_where_it_was(begin, clock, log, monkeypatch, tmp_path, how):
    grace = 0.0
    if how == "ends by itself":
        monkeypatch.setattr(process, "TIME_UP", None)
        grace = 5.0
    monkeypatch.chdir(tmp_path)
    sailing = begin()
    clock[0] = BEGUN + 120.0 + grace
    sailing._shared[REACHED] = 3.5
    assert (sailing.results(), log) == ([], [])
    (sailing._folder / "log.txt").write_text(TRACEBACK.format(here=tmp_path), encoding="utf-8")
    clock[0] += 0.25
    (result,) = sailing.results()
    words = "at t = 3.5 s: not finished after 120 s of wall time; it was in crew.py, line 7 in steer"
    assert (result.state, result.error, result.sim_time) == ("failed", words, 3.5)
    assert result.wall_time == 120.25 + grace
    assert result.cell == TRIALS[0].cell
    assert log == ([*["41: SIGUSR2", "join 5"], *KILLED] if how == "asked" else KILLED)


def test_only_the_end_of_a_log_is_looked_through_for_the_place(begin, clock, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    line = f'  File "{tmp_path}/a.py", line 1\n'
    for size, place in ((100_000, "; it was in a.py, line 1"), (100_001, "")):
        sailing = begin()
        (sailing._folder / "log.txt").write_text(line.ljust(size), encoding="utf-8")
        clock[0] = sailing._shared[END] + 1.0
        (result,) = sailing.results()
        assert result.error == f"at t = 0 s: not finished after 120 s of wall time{place}"


@pytest.mark.parametrize(("size", "ends"), [(50_000_000, False), (50_000_001, True)])
def test_one_that_prints_too_much_is_ended(begin, size, ends):
    sailing = begin()
    with (sailing._folder / "log.txt").open("wb") as file:
        file.truncate(size)
    errors = [(result.state, result.error) for result in sailing.results()]
    assert errors == [("failed", "at t = 0 s: printed more than 50 MB")] * ends


@pytest.mark.parametrize(
    ("code", "early", "state", "words"),
    [
        (3, 60.0, "failed", "the process ended with exit code 3: the controller, or a library that it uses, ended it"),
        (-9, 60.0, "lost", "the process was ended by SIGKILL; this happens when memory runs out"),
        (-9, 0.125, "lost", "the process was ended by SIGKILL; this happens when memory runs out"),
        (-11, 60.0, "failed", "the process was ended by SIGSEGV"),
        (1, 0.0625, "failed", "not finished after 120 s of wall time"),
        (-9, 0.0625, "failed", "not finished after 120 s of wall time"),
    ],
)
def test_one_that_ends_without_a_result_failed_or_was_lost(begin, clock, log, code, early, state, words):
    sailing = begin()
    sailing._process.exitcode, sailing._row.came = code, [OSError()]
    clock[0] = BEGUN + 120.0 - early
    (result,) = sailing.results()
    assert (result.state, result.error, result.wall_time) == (state, f"at t = 0 s: {words}", 120.0 - early)
    assert log == ["join 5", "join", "group 41: SIGKILL"]


def test_a_program_that_sails_is_asked_to_end_before_it_is_killed(begin, log, tmp_path):
    sailing = begin()
    sailing._shared[GROUP] = 77.0
    sailing.withdraw()
    groups = ["group 41: SIGKILL", "group 77: SIGKILL"]
    assert log == ["terminate", "join 15", *groups, "kill", "join", *groups]
    assert not (tmp_path / FOLDERS[0]).exists()


def test_a_group_that_has_ended_is_nothing(monkeypatch):
    for error in (ProcessLookupError, PermissionError):
        monkeypatch.setattr(os, "killpg", lambda *_, error=error: (_ for _ in ()).throw(error))
        process._end_group(77)


class EndedError(Exception):
    """Stands for the end of the process."""


class State:
    """Of a process in which something is left after some of its trials, counted from 1."""

    left, log = frozenset(), None

    def restore(self):
        self.log.append("restore")
        return self.log.count("restore") not in self.left


@pytest.fixture
def noted(monkeypatch, tmp_path, log):
    """What a process does to itself is written down instead."""

    def leave(code):
        log.append(f"exit {code}")
        raise EndedError

    State.left, State.log = frozenset(), log
    monkeypatch.setattr(os, "_exit", leave)
    monkeypatch.setattr(os, "setsid", lambda: log.append("setsid"))
    monkeypatch.setattr(signal, "signal", lambda number, how: log.append(f"{number.name} {how.name}"))
    monkeypatch.setattr(faulthandler, "register", lambda number, file, chain: log.append((number.name, file, chain)))
    for name in ("die_with_parent", "become_subreaper"):
        monkeypatch.setattr(process, name, lambda name=name: log.append(name))
    monkeypatch.setattr(process, "log_into", lambda file: log.append(file.relative_to(tmp_path).as_posix()))
    monkeypatch.setattr(process, "ProcessState", State)


@pytest.fixture
def inside(noted, monkeypatch, tmp_path, log):
    """Run what the process does, in this one, with what trials come out as; what it sends."""

    def sail(trial, folder, _stopwatch, warm):
        warnings.warn(f"in {warm}", UserWarning, stacklevel=1)
        log.append(f"sail {trial.cell.seed} in {folder.name}")
        return outcomes[trial.cell.seed]

    def sail_rows(trials, _stopwatch, warm):
        log.append(f"sail {len(trials)} rows in {warm}")
        return RESULTS[: len(trials)]

    outcomes = dict(enumerate(RESULTS))
    monkeypatch.setattr(process, "sail", sail)
    monkeypatch.setattr(process, "sail_rows", sail_rows)
    note = SimpleNamespace(message="shallow", category=UserWarning, filename="bay.yaml", lineno=1)

    def run(count=3, *, together=False, owner=None, left=(), **ends):
        State.left = frozenset(left)
        outcomes.update({int(name[1:]): result for name, result in ends.items()})
        (tmp_path / FOLDERS[0]).mkdir(parents=True)
        sent = []
        row = SimpleNamespace(send_bytes=lambda data: sent.append(pickle.loads(data)), close=lambda: log.append("end"))
        with warnings.catch_warnings(record=True) as told, contextlib.suppress(EndedError):
            warnings.simplefilter("always")
            process._sail_here(TRIALS[:count], tmp_path, [0.0] * 4, row, together, "it", [note], owner)
        return sent, [str(one.message) for one in told]

    return run


PREPARED = ["SIGINT SIG_IGN", "setsid", "die_with_parent", "become_subreaper", ("SIGUSR2", 2, True)]


def logged(seed):
    return f"{FOLDERS[seed]}/log.txt"


def test_trials_follow_each_other_with_logs_and_warnings_of_their_own(inside, log, monkeypatch):
    for stream in ("stdout", "stderr"):
        monkeypatch.setattr(sys, stream, SimpleNamespace(flush=lambda stream=stream: log.append(stream)))
    owner = SimpleNamespace(close=lambda: log.append("close"))
    sent, told = inside(owner=owner)
    assert sent == [[result] for result in RESULTS]
    parts = [(logged(seed), f"sail {seed} in seed_{seed}", "stdout", "stderr", "restore") for seed in range(3)]
    assert log == [PREPARED[0], "close", *PREPARED[1:], *chain.from_iterable(parts), "end", "exit 0"]
    assert told == ["shallow", "in it"] * 3


@pytest.mark.parametrize(
    ("how", "count", "sailed"),
    [({"s0": FAILED[0]}, 1, 1), ({"s1": FAILED[1]}, 1, 2), ({"left": (2,)}, 2, 2)],
)
def test_none_goes_on_after_a_failure_or_where_something_is_left(inside, log, how, count, sailed):
    """One that fails after others is not taken: another process sees whether it fails alone."""
    sent, _ = inside(**how)
    assert (len(sent), sum("sail" in str(entry) for entry in log)) == (count, sailed)
    assert log[-2:] == ["end", "exit 0"]


def test_rows_are_sailed_at_once(inside, log):
    sent, told = inside(together=True)
    assert (sent, told) == ([RESULTS], ["shallow"])
    assert log[len(PREPARED) :] == [logged(0), "sail 3 rows in it", "end", "exit 0"]


def test_a_folder_of_a_later_trial_is_new(inside, tmp_path):
    (tmp_path / FOLDERS[1]).mkdir(parents=True)
    with pytest.raises(FileExistsError):
        inside()


def test_the_server_has_loaded_everything_and_looks_where_this_process_does(monkeypatch, log):
    paths = []

    def first(target):
        paths.append(os.environ["PYTHONPATH"])
        log.append(target.__name__)
        return SimpleNamespace(start=lambda: log.append("start"), join=lambda: log.append("join"))

    forking = SimpleNamespace(set_forkserver_preload=log.append, Process=first)
    contexts = {"forkserver": forking, "spawn": "spawning"}
    monkeypatch.setattr(process.multiprocessing, "get_context", contexts.__getitem__)
    monkeypatch.setattr(sys, "path", ["", "/here", "/there"])
    monkeypatch.setenv("PYTHONPATH", "/before")
    assert process.start_server() is forking
    assert log == [["vrx_mj.campaign.warm"], "_nothing", "start", "join"]
    assert os.environ["PYTHONPATH"] == "/before"
    monkeypatch.delenv("PYTHONPATH")
    process.start_server()
    assert "PYTHONPATH" not in os.environ
    assert paths == [os.pathsep.join(("/here", "/there"))] * 2
    monkeypatch.setattr(process, "HAS_FORKSERVER", False)
    assert process.start_server() == "spawning"


def test_signals_wait_until_the_end(monkeypatch):
    came = []
    for number in (signal.SIGINT, signal.SIGTERM):
        before = signal.signal(number, lambda number, _frame: came.append(number))
        try:
            with process.signals_held():
                signal.raise_signal(number)
                assert came == []
            assert came == [number]
            thread = threading.Thread(target=lambda: process.signals_held().__enter__())
            thread.start()
            thread.join()
            signal.raise_signal(number)
            assert came == [number] * 2
        finally:
            signal.signal(number, before)
        came.clear()


def test_what_is_printed_goes_into_a_log_by_line(monkeypatch, tmp_path, log):
    monkeypatch.setattr(faulthandler, "enable", lambda file: log.append(file.fileno()))
    kept = [os.dup(1), os.dup(2)]
    try:
        with monkeypatch.context() as streams:
            for stream in ("stdout", "stderr"):
                streams.setattr(sys, stream, None)
            process.log_into(tmp_path / "log.txt")
            print("one \udcff")
            os.write(1, b"two\n")
            print("three", file=sys.stderr)
            os.write(2, b"four\n")
            found = (tmp_path / "log.txt").read_text(encoding="utf-8")
    finally:
        for stream, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, stream)
            os.close(copy)
    assert (found, log) == ("one ?\ntwo\nthree\nfour\n", [2])


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux can")
def test_a_process_ends_with_its_parent_by_prctl(monkeypatch, log):
    """Options of prctl(2): PR_SET_PDEATHSIG is 1, PR_SET_CHILD_SUBREAPER 36."""
    library = SimpleNamespace(CDLL=lambda _name: SimpleNamespace(prctl=lambda *given: log.append(given)))
    for module in (process, sys.modules["vrx_mj.campaign.program"]):
        monkeypatch.setattr(module, "ctypes", library)
    process.die_with_parent()
    process.become_subreaper()
    assert log == [(1, signal.SIGKILL, 0, 0, 0), (36, 1, 0, 0, 0)]


def test_loggers_made_by_a_trial_are_forgotten():
    before = process.ProcessState()
    logging.getLogger("of.a.trial")
    before.restore()
    assert not {"of", "of.a", "of.a.trial"} & logging.root.manager.loggerDict.keys()
