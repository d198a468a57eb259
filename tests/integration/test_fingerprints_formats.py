"""What small files that use many elements of URDF and SDF are read as: the values that they gave before."""

import warnings
from pathlib import Path

import pytest
import yaml

import vrx_mj
from fingerprints import check
from integration.test_fingerprints_models import plain
from integration.test_fingerprints_worlds import model_numbers
from urdf_boats import FILE, robot
from vrx_mj.formats.gazebo.sdf_objects import object_document
from vrx_mj.formats.urdf.reader import read_urdf
from vrx_mj.mjcf.robots import jointed_model

TESTS = Path(__file__).parents[1]
GOLDEN = TESTS / "golden" / "urdf" / "wamv.urdf"
FILES = yaml.safe_load((TESTS / "small_files.yaml").read_text(encoding="utf-8"))


def object_text(name):
    """An object's file."""
    thing = FILES["objects"][name]
    inside = "".join(FILES["sdf"][part] for part in thing["parts"]) + thing.get("more", "")
    return f'<sdf version="1.9"><model name="thing">{inside}</model></sdf>'


def told(call):
    """What a call returns, and the texts of its warnings."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", vrx_mj.VrxWarning)
        value = call()
    return value, [str(item.message).replace(" ", "_") for item in found]


def values(thing):
    """The fields of what a reader returns, each text as one word."""
    if hasattr(thing, "model_dump"):
        return plain(thing.model_dump(mode="json"))
    if hasattr(thing, "__dataclass_fields__"):
        return [
            [name, values(getattr(thing, name))]
            for name in thing.__dataclass_fields__
            if name not in {"file", "files", "place"}
        ]
    if isinstance(thing, dict):
        return [[str(key), values(value)] for key, value in thing.items()]
    if isinstance(thing, list | tuple):
        return [values(value) for value in thing]
    return plain(thing)


@pytest.mark.parametrize("name", FILES["urdf"])
def test_a_urdf_is_read_as_it_was(name):
    read, said = told(lambda: read_urdf(robot(FILES["urdf"][name]), FILE))
    check(
        "formats",
        f"urdf, {name}",
        links=values(read.links),
        joints=values(read.joints),
        gazebo=values(read.gazebo),
        said=said,
    )


def test_the_wamv_is_read_as_it_was():
    read, _ = told(lambda: read_urdf(GOLDEN.read_text(encoding="utf-8"), GOLDEN))
    check("formats", "wamv", links=values(read.links), joints=values(read.joints), gazebo=values(read.gazebo))


@pytest.mark.parametrize("name", FILES["objects"])
def test_an_object_of_gazebo_is_read_as_it_was(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("thing.sdf").write_text(object_text(name), encoding="utf-8")
    (section, _), said = told(lambda: object_document(Path("thing.sdf")))
    check("formats", f"object, {name}", read=values(dict(section)), said=said)


@pytest.mark.parametrize("name", ["shapes", "joints", "thrusters"])
def test_a_boat_with_its_joints_is_drawn_as_it_was(name):
    model = jointed_model(read_urdf(robot(FILES["urdf"][name]), FILE))
    look = [*model.vis.headlight.ambient, *model.vis.headlight.diffuse, *model.tex_data[::997]]
    check("formats", f"drawn {name}", model=model_numbers(model), names=model.names, look=look)
