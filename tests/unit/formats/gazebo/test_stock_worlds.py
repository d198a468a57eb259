"""Every world of VRX that is shipped, written as VRX's own file has it, is read as the shipped one, without a loss."""

import re
import warnings
from pathlib import Path

import pytest

import vrx_mj
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


def test_the_navigation_plugin_of_vrx_3_gives_points_by_its_name_alone():
    text = newer_text("vrx2023/navigation_task")
    for tag in ("points_per_gate_crossed", "bonus"):
        text = re.sub(f"<{tag}>.*?</{tag}>", "", text)
    text = text.replace('name="plugin" filename="libNav', 'name="vrx::NavigationScoringPlugin" filename="libNav')
    assert read(text).task.type == "follow_path"


def test_an_animal_may_be_a_model_in_a_model_and_swims():
    """As in wildlife3 to 5 of VRX 2022."""
    follow = '<plugin filename="libfollow_plugin.so"><circle><radius>3</radius></circle></plugin>'
    croc = f"<include><name>croc</name><uri>model://crocodile_static</uri>{follow}</include>"
    links = {"pen": "croc::link", "lone": "lone::link"}
    rows = (f"<model_name>{model}</model_name><link_name>{link}</link_name>" for model, link in links.items())
    buoys = "".join(f"<buoy>{row}<goal>avoid</goal></buoy>" for row in rows)
    text = (
        f'<sdf version="1.6"><world name="bay"><model name="pen"><pose>30 0 0 0 0 0</pose>{croc}</model>'
        "<include><name>lone</name><uri>model://turtle_static</uri><pose>60 0 0 0 0 0</pose></include>"
        f'<plugin filename="libwildlife_scoring_plugin.so"><vehicle>wamv</vehicle><buoys>{buoys}</buoys></plugin>'
        "</world></sdf>"
    )
    Path("bay.world").write_text(text, encoding="utf-8")
    found = vrx_mj.compile_world("bay.world", fleet="single").parameters
    assert [animal.name for animal in found.task.animals] == ["pen/croc", "lone"]
    assert [one.waypoint_count for one in found.followers] == [8]
