"""What files of Gazebo and VRX are read as: the numbers that they gave before."""

import shutil
from pathlib import Path

import pytest

from axes_files import SAMPLES, WORLDS
from fingerprints import check, numbers_in
from gazebo_files import classic_text, newer_text
from integration.test_fingerprints_worlds import compiled
from sdf_boats import BOATS
from vrx_mj.model.world import tree_of

CLASSIC = ("wildlife_task", "vrx2019/dock", "gymkhana")
NEWER = ("vrx2023/follow_path_task", "vrx2023/acoustic_tracking_task")
URDF = Path(__file__).parents[1] / "golden" / "urdf" / "wamv.urdf"
AT = {"pose": [0, 0, 0, 0, 0, 0.4]}


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def check_world(key, *source, **options):
    world = compiled(*source, **options)
    check("files", key, compiled=[numbers_in(world.mjcf), tree_of(world.parameters)])


@pytest.mark.parametrize("name", [CLASSIC[0]])
def test_a_world_of_gazebo_is_read_as_it_was(name):
    Path("bay.world").write_text(classic_text(name), encoding="utf-8")
    check_world(name, "bay.world")


@pytest.mark.slow
@pytest.mark.nightly
def test_so_are_others():
    for name in [*CLASSIC[1:], *NEWER]:
        Path("bay.sdf").write_text((classic_text if name in CLASSIC else newer_text)(name), encoding="utf-8")
        check_world(name, "bay.sdf")


@pytest.mark.parametrize("name", BOATS)
def test_a_model_of_gazebo_is_the_boat_that_it_was(name):
    Path("boat").mkdir()
    Path("boat/model.sdf").write_text(BOATS[name](), encoding="utf-8")
    check_world(name, "ocean", fleet={"boats": [{"robot": "boat/model.sdf", **AT}]})


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")
def test_a_urdf_file_is_the_boat_that_it_was():
    shutil.copy(URDF, ".")
    check_world("urdf", "ocean", fleet={"boats": [{"robot": "wamv.urdf", **AT}]})


@pytest.mark.slow
@pytest.mark.nightly
def test_series_have_the_worlds_that_they_had():
    for name, count in WORLDS.items():
        for number in range(count):
            check_world(f"{name}#{number}", f"{SAMPLES / name}.yaml#{number}")
