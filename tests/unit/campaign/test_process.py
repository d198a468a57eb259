"""How a trial's process ended, in words, and whether it can go on with another trial."""

import logging
import os
import random
import signal
import sys
import threading
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from vrx_mj.campaign.process import ProcessState, _exit_text
from vrx_mj.foreign.asking import READER, start


@pytest.fixture
def alone(monkeypatch, tmp_path):
    """A process without threads and children, which looks for modules in a folder."""

    def no_child(*_):
        raise ChildProcessError

    monkeypatch.setattr(threading, "active_count", lambda: 1)
    monkeypatch.setattr(os, "waitpid", no_child)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "team").mkdir()
    (tmp_path / "team" / "boat.py").write_text("calls = []\n", encoding="utf-8")


def test_a_process_that_goes_on_is_as_it_was(alone, monkeypatch, tmp_path):
    before, drawn, handlers = ProcessState(), set(), logging.root.handlers[:]
    for calls in range(2):
        drawn.add((random.random(), np.random.random()))  # noqa: NPY002
        boat = import_module("team.boat")
        assert boat.calls == []
        boat.calls.append(calls)
        os.environ["MOOD"], old = "good", np.seterr(all="ignore")
        os.chdir("team")
        sys.path.insert(0, "somewhere")
        for log in (logging.getLogger("team.boat"), logging.root):
            log.addHandler(logging.NullHandler())
        assert len(logging.getLogger("team.boat").handlers) == 1
        assert before.restore()
        assert ("MOOD" in os.environ, Path.cwd(), np.geterr()) == (False, tmp_path, old)
        assert "somewhere" not in sys.path
        assert logging.root.handlers == handlers
        assert not {"team", "team.boat"} & sys.modules.keys()
    assert len(drawn) == 1


@pytest.mark.parametrize("left", ["numpy.mine", "machine", "thread", "child", "gap"])
def test_a_process_in_which_something_is_left_does_not_go_on(alone, monkeypatch, left):
    before = ProcessState()
    if left == "thread":
        monkeypatch.setattr(threading, "active_count", lambda: 2)
    elif left == "child":
        monkeypatch.setattr(os, "waitpid", lambda *_: (0, 0))
    elif left == "gap":
        monkeypatch.delitem(sys.modules, "csv")  # comes again as another one
    else:
        monkeypatch.setitem(sys.modules, left, ModuleType(left))
    assert not before.restore()


def test_the_process_from_which_trials_are_forked_has_no_child_of_its_own(monkeypatch):
    monkeypatch.setattr(READER, "_process", start())
    monkeypatch.setattr("vrx_mj.mjcf.compile.compile_world", lambda _world: None)
    monkeypatch.setattr("vrx_mj.runtime.simulation.Simulation", lambda _world: None)
    monkeypatch.delitem(sys.modules, "vrx_mj.campaign.warm", raising=False)
    import_module("vrx_mj.campaign.warm")
    monkeypatch.delitem(sys.modules, "vrx_mj.campaign.warm")
    assert READER._process is None


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (None, "the process ended with exit code None: the controller, or a library that it uses, ended it"),
        (0, "the process ended with exit code 0: the controller, or a library that it uses, ended it"),
        (-signal.SIGSEGV, "the process was ended by SIGSEGV"),
        (-99, "the process was ended by signal 99"),
    ],
)
def test_a_process_without_a_result_says_how_it_ended(code, words):
    assert _exit_text(code) == words


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="Windows has no SIGKILL")
def test_a_process_that_is_killed_may_have_met_the_end_of_the_memory():
    assert _exit_text(-9) == "the process was ended by SIGKILL; this happens when memory runs out"
