import os
import shlex
import sys
from pathlib import Path

import pytest

from vrx_mj.cli import screen


@pytest.fixture
def typed(tmp_path, monkeypatch):
    """A start script that was typed by its path, as in the README: the shell does not find it."""
    script = tmp_path / "strange place" / "vrx-mj"
    script.parent.mkdir()
    script.write_text("#!/bin/sh\n", encoding="utf-8")
    script.chmod(0o755)
    monkeypatch.setattr(sys, "argv", [str(script)])
    monkeypatch.setenv("PATH", str(tmp_path))
    return script


@pytest.mark.skipif(os.name == "nt", reason="quoted otherwise there")
def test_a_program_that_the_shell_does_not_find_is_named_by_its_path(typed):
    assert shlex.split(screen.to_open(Path("my run.rrd")).removeprefix("to open it: ")) == [
        str(typed), "replay", "my run.rrd"
    ]  # fmt: skip


@pytest.mark.skipif(os.name == "nt", reason="found by its suffix there")
def test_a_program_that_the_shell_finds_is_named_alone(typed, monkeypatch):
    monkeypatch.setenv("PATH", str(typed.parent))
    assert screen.program() == "vrx-mj"


@pytest.mark.parametrize(("phase", "score", "line"), [
    ("ready", None, "way: no score yet (lower is better), cut while ready, 1 collision"),
    ("running", 0.00196, "way: score 0.00196 m (lower is better), cut while running, 1 collision"),
    ("finished", 2.0, "way: score 2 m (lower is better), finished, 1 collision"),
])  # fmt: skip
def test_a_run_that_was_cut_is_called_so(phase, score, line):
    assert screen.score_line("way", "wayfinding", phase, score, 1, timed_out=False) == line


@pytest.mark.parametrize(("factor", "text"), [(0.3333, "0.33"), (0.0042, "0.0042"), (9.96, "10"), (715.8, "716")])
def test_a_run_slower_than_real_time_is_not_called_0(factor, text):
    assert screen.pace_text(factor) == f"{text} x real time"


def test_started_by_another_program_it_has_its_own_name(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["pytest"])
    assert screen.program() == "vrx-mj"
