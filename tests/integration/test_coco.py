"""Data sets in COCO's form: of recordings, and of runs."""

import importlib
import json

import numpy as np
import pytest
from PIL import Image

import vrx_mj
from integration.sailing import boats
from integration.sensing import GPS, sailing
from needs import PYCOCOTOOLS, needs
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.errors import CommandError, RecordError, UnknownNameError
from vrx_mj.recording import CocoWriter, write_coco
from vrx_mj.recording.exports import run_lengths
from vrx_mj.sensors.view import CATEGORIES

pytestmark = pytest.mark.render

CAMERA = CameraConfig(name="camera", link="camera_link", pose=(0.75, 0, 1.5, 0, 0, 0), width=320, height=180)
BUOYS = [
    {"name": "red", "model": "mb_marker_buoy_red", "pose": [9.0, 1.0, 0.0, 0.0, 0.0, 0.0]},
    {"name": "orange", "model": "mb_round_buoy_orange", "pose": [7.0, -1.5, 0.0, 0.0, 0.0, 0.0]},
]
HERE = boats((0.0, 0.0, 0.0), (14.0, 3.0, 1.0))


def sea():
    return sailing({"a": (CAMERA, GPS), "b": ()}, fleet=HERE, objects=BUOYS, seed=3)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Three seconds of two boats, without a camera's readings; and what the camera saw at every second."""
    file = tmp_path_factory.mktemp("coco") / "run.rrd"
    sim, seen = sea(), []
    with vrx_mj.record(sim, file):
        for _ in range(4):
            seen.append(sim.labelled("a", "camera"))
            sim.step({"a": {"left": 0.2, "right": 0.2}}, duration=1.0)
    return file, seen


@pytest.fixture(scope="module")
def folder(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("coco") / "data"
    assert write_coco(recording[0], folder, end=3.0) == 4
    return folder


def decoded(segmentation):
    """A mask from COCO's run lengths: in turn so many 0 and so many 1, column by column."""
    height, width = segmentation["size"]
    pixels, value = [], 0
    for count in segmentation["counts"]:
        pixels += [value] * count
        value = 1 - value
    return np.array(pixels).reshape(width, height).T


@pytest.mark.slow
def test_a_data_set_of_a_recording_is_what_the_cameras_saw(recording, folder):
    data = json.loads((folder / "annotations.json").read_text(encoding="utf-8"))
    assert [image["time"] for image in data["images"]] == pytest.approx([0, 1, 2, 3])
    for image, reading in zip(data["images"], recording[1], strict=True):
        labels = reading.data.labels
        own = [one for one in data["annotations"] if one["image_id"] == image["id"]]
        assert [(one["name"], one["area"], tuple(one["bbox"])) for one in own] == [
            (one.name, one.area, one.box) for one in labels.objects
        ]
        for one, label in zip(own, labels.objects, strict=True):
            assert np.array_equal(decoded(one["segmentation"]), labels.mask == label.number)
            assert one["category_id"] == CATEGORIES[label.category]["id"]
        with Image.open(folder / "images" / image["file_name"]) as picture:
            assert picture.size == (image["width"], image["height"]) == (320, 180)
            assert np.abs(np.asarray(picture).astype(int) - reading.data.rgb).mean() < 2.0
    assert {one["name"] for one in data["annotations"]} >= {"red", "orange", "b"}
    assert [one["id"] for one in data["annotations"]] == list(range(1, len(data["annotations"]) + 1))
    assert data["categories"] == list(CATEGORIES.values())


def test_a_data_set_has_the_same_bytes_each_time(recording, folder, tmp_path):
    write_coco(recording[0], tmp_path, boat="a", begin=0.0, end=3.0)
    files = sorted(path.relative_to(folder) for path in folder.rglob("*.*"))
    assert len(files) == 5
    assert {file: (tmp_path / file).read_bytes() == (folder / file).read_bytes() for file in files} == dict.fromkeys(
        files, True
    )


@pytest.mark.slow
@needs(PYCOCOTOOLS)
@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
def test_pycocotools_reads_masks_and_boxes_as_they_were(recording, folder):
    masks, coco = (importlib.import_module(f"pycocotools.{name}") for name in ("mask", "coco"))
    data = coco.COCO(str(folder / "annotations.json"))
    for number, reading in zip(data.getImgIds(), recording[1], strict=True):
        found = data.loadAnns(data.getAnnIds(imgIds=number))
        assert len(found) == len(reading.data.labels.objects)
        for one, label in zip(found, reading.data.labels.objects, strict=True):
            assert np.array_equal(data.annToMask(one), reading.data.labels.mask == label.number)
            assert masks.toBbox(data.annToRLE(one)).tolist() == one["bbox"]
            assert masks.area(data.annToRLE(one)) == one["area"]
            assert data.loadCats(one["category_id"])[0]["name"] == label.category
    assert len(data.getImgIds(catIds=data.getCatIds(catNms=["mb_marker_buoy_red"]))) == 4


@pytest.mark.parametrize(
    ("rows", "counts"),
    [([[0, 1], [1, 1]], [1, 3]), ([[1, 1], [1, 1]], [0, 4]), ([[0, 0], [0, 0]], [4]), ([[1, 0], [0, 1]], [0, 1, 2, 1])],
)
def test_run_lengths_go_down_the_columns(rows, counts):
    assert run_lengths(np.array(rows, bool)) == counts


def test_episodes_of_a_run_become_one_data_set(tmp_path):
    def interrupted():
        sim = sea()
        with CocoWriter(tmp_path / "data", "three episodes") as coco:
            for seed in range(3):
                sim.reset(seed=seed)
                coco.add(sim.labelled("a", "camera"))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    data = json.loads((tmp_path / "data/annotations.json").read_text(encoding="utf-8"))
    assert data["info"] == {"description": "three episodes"}
    assert [image["file_name"] for image in data["images"]] == [f"00000{number}_a_camera.jpg" for number in (1, 2, 3)]
    assert all((tmp_path / "data/images" / image["file_name"]).is_file() for image in data["images"])


def test_what_is_no_picture_with_labels_is_refused(tmp_path):
    sim, coco = sea(), CocoWriter(tmp_path)
    for given in (sim.sense("a")["camera"], sim.sense("a")["gps"], 7):
        with pytest.raises(
            CommandError, match=r"^invalid reading .*: one with labels is needed, as sim\.labelled gives it$"
        ):
            coco.add(given)
    assert list(tmp_path.iterdir()) == []


def test_what_a_recording_has_not_is_told(recording, tmp_path):
    file = recording[0]
    with pytest.raises(UnknownNameError, match="no boat with a camera named 'b'; known: a"):
        write_coco(file, tmp_path / "data", boat="b")
    with pytest.raises(
        RecordError, match=r"^invalid begin 7\.0 or end None: '.*' has no state in that span; one is saved every"
    ):
        write_coco(file, tmp_path / "data", begin=7.0)
    blind = sailing((GPS,), seed=3)
    with vrx_mj.record(blind, tmp_path / "blind.rrd"):
        blind.advance(10)
    with pytest.raises(RecordError, match=r"blind\.rrd' has no boat with a camera$"):
        write_coco(tmp_path / "blind.rrd", tmp_path / "data")
    assert not (tmp_path / "data").exists()


@pytest.mark.slow
def test_boats_that_come_and_go_are_in_the_pictures_of_their_time(tmp_path):
    one = {"boats": [{"name": "a", "pose": [0, 0, 0.1, 0, 0, 0], "sensors": "front_left_camera"}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean", fleet=one))
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        sim.step(duration=1.0)
        sim.spawn("b", pose=(12, 3, 0.1, 0, 0, 1.0), sensors="front_left_camera")
        sim.step(duration=1.0)
        sim.remove("a")
        sim.step(duration=1.0)
    write_coco(tmp_path / "run.rrd", tmp_path / "data")
    data = json.loads((tmp_path / "data/annotations.json").read_text(encoding="utf-8"))
    seen = {image["id"]: [image["file_name"][7], round(image["time"]), set()] for image in data["images"]}
    for one in data["annotations"]:
        seen[one["image_id"]][2].add(f"{one['name']} {one['category_id']}")
    assert list(seen.values()) == [
        ["a", 0, {"a 1"}], ["a", 1, {"a 1", "b 2"}], ["b", 1, {"b 1"}], ["b", 2, {"b 1"}], ["b", 3, {"b 1"}],
    ]  # fmt: skip
