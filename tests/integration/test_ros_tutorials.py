"""The pages on ROS: every command that they show is executed, and both languages show the same."""

import collections
import re

import pytest
import yaml

import vrx_mj
from needs import ROS1_TOOLS, needs
from page_blocks import blocks, pieces
from ros_scene import served
from tutorial_pages import REPO, Reader
from vrx_mj.ros.diagnosis import _touching_land
from vrx_mj.sensors.canvas import BACKENDS, problem_of

DOCS = REPO / "docs"
PAGES = ("tutorial_one_boat.md", "tutorial_many_boats.md", "ros.md")
NOT_RUN = {
    "what the test runs in is installed": 1,
    "needs a keyboard; tests/integration/test_ros_teleop.py drives it": 1,
    "needs a display and rqt": 1,
    "needs a display and RViz": 1,
    "it changes the machine; .ci/run does it": 1,
}
"""All reasons for which a command is not run here, and how many commands have each."""


@pytest.mark.slow
@needs(ROS1_TOOLS)
@pytest.mark.parametrize("name", PAGES)
def test_every_command_of_a_page_does_what_the_page_says(name, tmp_path):
    with Reader(tmp_path, pictures=any(problem_of(backend) is None for backend in BACKENDS)) as reader:
        for piece in pieces(DOCS / name):
            if isinstance(piece, str):
                reader.end_section()
            else:
                reader.follow(piece)
        reader.end_section()
        reader.end_server()


def test_what_is_not_run_is_little_and_has_a_reason():
    notes = [note for name in PAGES for block in blocks(DOCS / name) for note in block.notes]
    reasons = [reason for key, reason in notes if key == "not run"]
    assert dict(collections.Counter(reasons)) == NOT_RUN
    assert all((REPO / path).exists() for reason in reasons for path in re.findall(r"tests/\S+\.py", reason))
    assert len([key for key, _ in notes if key in {"expect", "moves", "server says"}]) > 60


@pytest.mark.parametrize("name", PAGES)
def test_both_languages_show_the_same_blocks(name):
    english, chinese = (
        [(block.kind, block.text) for block in blocks(path)] for path in (DOCS / name, DOCS / "zh" / name)
    )
    assert chinese == english


@pytest.mark.slow
def test_the_boats_of_the_tutorials_world_drift_free_of_the_land(tmp_path, monkeypatch):
    """Nobody drives them while the page is read: the wind blows off the shore."""
    files = {block.note("file"): block.text for block in blocks(DOCS / "tutorial_one_boat.md") if block.note("file")}
    (tmp_path / "my_lake.yaml").write_text(files["my_lake.yaml"], encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    boats = [{**boat, "sensors": "none"} for boat in yaml.safe_load(files["my_fleet.yaml"])["boats"]]
    fleet = {"boats": [{key: boat[key] for key in ("name", "pose", "sensors")} for boat in boats]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world("my_lake.yaml", fleet=fleet))
    touched = set()
    for _ in range(600):
        sim.step(duration=0.1)
        touched |= _touching_land(sim)
    assert touched == set()
    assert all(boat.position[1] > 165.0 for boat in sim.observe().values())  # they began at 162 m


def named(page):
    """Patterns of the topics and services in the first cells of a page's tables; what has no slash is a sibling."""
    for row in re.findall(r"^\| (?:< )?`(/[^|]*)", page.read_text("utf-8"), re.MULTILINE):
        first, *others = re.findall(r"`([^`]+)`", f"`{row}")
        names = [
            first,
            *(other if other.startswith("/") else f"{first.rpartition('/')[0]}/{other}" for other in others),
        ]
        for name in names:
            yield re.sub(r"BOAT|NAME|PLACARD|LIGHT_BUOY", "[^/]+", name)


def test_the_reference_names_every_topic_and_service():
    two = {"usv_count": 2, "layout": "line", "origin": "spawn", "sensors": "none"}
    offered = set()
    for world, fleet in (("example_course", None), ("stationkeeping_task", two), ("wayfinding_task", None)):
        table = served(vrx_mj.compile_world(world, fleet=fleet)).network.table
        offered |= {*table.outputs, *table.inputs, *table.services}
    assert len(offered) > 60
    for page in (DOCS / "ros.md", DOCS / "zh" / "ros.md"):
        known = [re.compile(pattern) for pattern in named(page)]
        assert sorted(name for name in offered if not any(pattern.fullmatch(name) for pattern in known)) == []
