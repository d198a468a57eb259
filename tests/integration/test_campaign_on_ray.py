"""The same trials on a real Ray cluster of this machine give the same results."""

import dataclasses
import sys

import pytest

from needs import RAY, needs
from vrx_mj.campaign.plan import Cell, Trial
from vrx_mj.campaign.process import sail_all, sail_on_ray
from vrx_mj.campaign.results import LOG, read_results, read_sketches
from vrx_mj.errors import VrxError
from vrx_mj.packages import needs_extra

WORLD = """
extends: ocean
task: {type: stationkeeping, goal_cart: [8, 0, 0], initial_state_duration: 0.5, ready_state_duration: 0.5,
       running_state_duration: 2}
"""
CREW = """
import os

def steady(obs, t):
    print("steady as she goes")
    return {"wamv": {"left": 0.5, "right": 0.4}}

def leaves(obs, t):
    os._exit(3)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bay.yaml").write_text(WORLD, encoding="utf-8")
    (tmp_path / "crew.py").write_text(CREW, encoding="utf-8")
    return tmp_path


@needs(RAY)
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # Ray's own
@pytest.mark.nightly
def test_a_cluster_gives_what_this_machine_gives(folder):
    cells = [Cell("crew:steady", "bay.yaml", 0), Cell("crew:steady", "bay.yaml", 1), Cell("crew:leaves", "bay.yaml", 0)]
    trials = [Trial(cell) for cell in cells]
    there = {result.cell: result for result in sail_on_ray(trials, folder / "there", 2)}
    here = {result.cell: result for result in sail_all(trials, folder / "here", 2)}

    def lasting(result):
        return dataclasses.replace(result, wall_time=0.0)

    assert {cell: lasting(result) for cell, result in there.items()} == {
        cell: lasting(result) for cell, result in here.items()
    }
    assert there[cells[0]].score is not None
    assert "exit code 3" in there[cells[2]].error
    assert read_results(folder / "there", cells) == there
    assert read_sketches(folder / "there", ["bay.yaml"]) == read_sketches(folder / "here", ["bay.yaml"])
    log = folder / "there" / cells[0].folder / LOG
    assert "steady as she goes" in log.read_text(encoding="utf-8")


def test_without_ray_it_says_what_to_install(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    sailed = sail_on_ray([Trial(Cell("crew:steady", "bay.yaml", 0))], folder / "there")
    with pytest.raises(VrxError) as raised:
        next(sailed)
    assert str(raised.value) == needs_extra("--ray", "Ray", "ray")
