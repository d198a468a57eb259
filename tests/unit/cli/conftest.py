"""`cli`: the command line in this process, in a folder with a blank and Chinese letters in its name."""

import sys
import warnings
from dataclasses import dataclass

import pytest

from vrx_mj import Simulation, compile_world
from vrx_mj.cli import main


@dataclass(frozen=True)
class Said:
    code: int
    out: str
    err: str


@pytest.fixture
def folder(tmp_path, monkeypatch):
    place = tmp_path / "测试 boats"
    place.mkdir()
    monkeypatch.chdir(place)
    return place


@pytest.fixture(scope="session")
def compiled():
    """The physics, compiled: the first run on a machine says so, which no test here is about."""
    Simulation(compile_world("ocean"))


@pytest.fixture
def cli(compiled, folder, monkeypatch, capsys):
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    monkeypatch.setenv("COLUMNS", "200")

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["vrx-mj", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            main()
        captured = capsys.readouterr()
        return Said(int(ended.value.code or 0), captured.out, captured.err)

    return call
