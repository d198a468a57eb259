"""`vrx-mj worlds generate`, and `FILE#k` wherever a world is named."""

import shutil
from pathlib import Path

import pytest

from axes_files import LOST_AN_AXIS, SAMPLES, WORLDS
from vrx_mj.config.world import load_world

AXES = """
waves: {steps: 2, macros: {ocean_waves: [{gain: 0.1 * n}]}}
pinger: {steps: 2, macros: {insert_model: [{uri: "'red_totem'", x: 5, y: n}]}, yamls: {1: {position: [1, 2, -3]}}}
"""


def test_generate_writes_the_worlds_and_prints_their_coordinates(cli, folder):
    (folder / "bay.yaml").write_text(AXES, encoding="utf-8")
    said = cli("worlds", "generate", "bay.yaml", "-o", "worlds")
    assert (said.code, said.err) == (0, "")
    assert said.out.splitlines() == [
        "world  waves  pinger",
        "bay0       0       0",
        "bay1       1       0",
        "bay2       0       1",
        "bay3       1       1",
        f"4 worlds in worlds; to sail the first: vrx-mj run {Path('worlds/bay0.yaml')}",
    ]
    assert sorted(file.name for file in (folder / "worlds").iterdir()) == [
        *(f"bay{k}.yaml" for k in range(4)),
        "config",
    ]
    assert load_world("worlds/bay3.yaml").sea.gain == 0.1
    assert load_world("bay3").objects[0].pose[1] == 1.0  # the current folder's worlds have names


def test_a_file_says_what_made_it(cli, folder):
    (folder / "bay.yaml").write_text(AXES, encoding="utf-8")
    cli("worlds", "generate", "bay.yaml", "-o", "worlds")
    assert (folder / "worlds" / "bay3.yaml").read_text(encoding="utf-8") == (
        "# World 3 of bay.yaml, made by vrx-mj worlds generate.\n"
        "# COORDINATE: {waves: 1, pinger: 1}\n"
        'description: "world 3 of bay.yaml: waves 1, pinger 1"\n'
        "sea: {model: pms, gain: 0.1, period: 5.0, angle: 0.4, scale: 1.5, direction: [1.0, 0.0]}\n"
        "objects:\n"
        "- {name: red_totem, model: red_totem, pose: [5.0, 1.0, 0.0, 0.0, 0.0, 0.0]}\n"
    )
    assert (folder / "worlds" / "config" / "bay2.yaml").read_text(encoding="utf-8").endswith("position: [1, 2, -3]\n")
    assert not (folder / "worlds" / "config" / "bay1.yaml").exists()


def test_wind_on_a_link_that_is_gone_is_told_in_the_file(cli, folder):
    shutil.copy(SAMPLES / "scan_and_dock_shallow.yaml", folder)
    cli("worlds", "generate", "scan_and_dock_shallow.yaml", "-o", ".")
    text = (folder / "scan_and_dock_shallow1.yaml").read_text(encoding="utf-8")
    assert text.splitlines()[2:4] == [
        "# VRX's wind acts on the link base_link, which boats no longer have; here it acts on the boat",
        "# (`physics: {quirks: [wind_stale_link]}` for VRX's).",
    ]


@pytest.mark.filterwarnings("default::vrx_mj.errors.VrxWarning")
def test_a_lost_axis_is_one_warning(cli, folder):
    shutil.copy(SAMPLES / "station_keeping_shallow.yaml", folder)
    said = cli("worlds", "generate", "station_keeping_shallow.yaml", "-o", "worlds")
    assert (said.code, said.err) == (0, f"warning: {LOST_AN_AXIS}\n")
    assert "1 world in worlds;" in said.out


def test_a_series_is_made_anew_but_other_files_are_kept(cli, folder):
    (folder / "bay.yaml").write_text(AXES, encoding="utf-8")
    assert [cli("worlds", "generate", "bay.yaml", "-o", "worlds").code for _ in range(2)] == [0, 0]
    (folder / "worlds" / "bay1.yaml").write_text("sea: {gain: 7}\n", encoding="utf-8")
    said = cli("worlds", "generate", "bay.yaml", "-o", "worlds")
    file = Path("worlds/bay1.yaml")
    told = f"{file} exists and is not a world of a series: choose another folder\n"
    assert (said.code, said.err) == (2, told)
    assert (folder / "worlds" / "bay1.yaml").read_text(encoding="utf-8") == "sea: {gain: 7}\n"


def test_nothing_is_written_if_one_world_is_wrong(cli, folder):
    (folder / "bay.yaml").write_text(
        "a:\n  steps: 3\n  macros:\n    ocean_waves: [{period: 2 - n}]\n", encoding="utf-8"
    )
    said = cli("worlds", "generate", "bay.yaml", "-o", "worlds")
    assert (said.code, said.out) == (2, "")
    assert said.err == "bay.yaml:4:28: sea.period: must be above 0, got 0\n"
    assert not (folder / "worlds").exists()


def test_a_folder_that_cannot_be_written_is_told(cli, folder):
    (folder / "bay.yaml").write_text(AXES, encoding="utf-8")
    (folder / "worlds").write_text("a file\n", encoding="utf-8")
    said = cli("worlds", "generate", "bay.yaml", "-o", "worlds")
    assert said.code == 2
    assert said.err.startswith("cannot write the world 'worlds")


@pytest.mark.slow
def test_a_world_of_a_series_is_compiled_and_drawn_by_its_number(cli, folder):
    shutil.copy(SAMPLES / "nav_challenge_deep.yaml", folder)
    last = f"nav_challenge_deep.yaml#{WORLDS['nav_challenge_deep'] - 1}"
    assert cli("compile", last, "-o", "scene.xml").code == 0
    assert cli("map", last, "-o", "map.png").code == 0
    assert (folder / "scene.xml").exists()
    assert (folder / "map.png").exists()
