"""Every world of VRX that is shipped, written as VRX's own file has it, is read as the shipped one, without a loss."""

import re
import warnings
from pathlib import Path

import pytest

from gazebo_files import classic_text, newer_text
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import load_world
from vrx_mj.errors import VrxWarning

OURS = {"my_course", "no_gravity", "buoyancy_plugin_demo"}
"""Worlds that are none of VRX's courses."""
NAMES = [name for name in catalogue("worlds") if name not in OURS and not name.startswith("base/")]


FIRST = [name for name in NAMES if not re.search(r"/(phase\d|practice)/", name) or name.endswith("0")]
"""One of each series of a competition, and all that are in none."""
YEARS = ("vrx2019", "vrx2022", "vrx2023")


def comparable(world):
    """What a world's file says, in an order of its own; without what only a launch file says."""
    said = world.model_dump(exclude={"name", "description", "spawn", "folder"})
    said["sea"]["direction"] = [round(value, 6) for value in said["sea"]["direction"]]  # VRX 3 gives an angle
    said["objects"] = sorted(said["objects"], key=lambda thing: thing["name"])
    if world.task is not None:
        said["task"]["name"] = said["task"]["name"] or said["task"]["type"]
    for animal in said["task"].get("animals", ()) if said["task"] else ():
        animal["goal"] = None
    return said


def read(text):
    Path("bay.world").write_text(text, encoding="utf-8")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", VrxWarning)
        world = load_world("bay.world")
    told = [str(each.message).splitlines() for each in caught]
    lost = {line.partition(": ")[2] for head, *lines in told if "differ from Gazebo" in head for line in lines}
    assert lost <= {"<clouds> ignored: clouds are not drawn"}
    return world


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", FIRST)
def test_a_world_of_vrx_is_the_shipped_one(name):
    text = newer_text(name) if "2023" in name else classic_text(name)
    assert comparable(read(text)) == comparable(load_world(name))


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("year", YEARS)
def test_so_are_the_others_of_each_series(year):
    others = [name for name in NAMES if name.startswith(year) and name not in FIRST]
    assert len(others) > 40
    for name in others:
        test_a_world_of_vrx_is_the_shipped_one(name)
