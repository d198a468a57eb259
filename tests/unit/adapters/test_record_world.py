"""Worlds in recordings: what comes from somebody else is read, and never written to disk."""

import json
import tempfile

import pytest

from vrx_mj.adapters.record.companies import Company
from vrx_mj.adapters.record.scene import RowLayout
from vrx_mj.compiler.world import WORLD_FORMAT
from vrx_mj.errors import StateError

HULL = '<mujoco><asset><mesh name="hull" file="{name}"/></asset></mujoco>'


def company(name="hull.obj", **others):
    """Boats whose world has one asset, and other files in its archive."""
    world = {"scene.xml": HULL.format(name=name).encode(), "scene.json": json.dumps({"format": WORLD_FORMAT}).encode()}
    layout = RowLayout(nq=0, nv=0, thrusters=(), bodies=())
    return Company(layout, "", {**world, f"assets/{name}": b"v 0 0 0", **others})


def test_names_in_a_recording_are_no_paths_on_disk(tmp_path, monkeypatch):
    home = tmp_path / "a" / "b"
    home.mkdir(parents=True)
    monkeypatch.setattr(tempfile, "tempdir", str(home))
    outside = {"../../evil": b"1", str(tmp_path / "worse"): b"2"}
    assert company(**outside).world.assets == {"hull.obj": b"v 0 0 0"}
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("name", ["../hull.obj", "/etc/passwd", "..\\hull.obj", "C:hull.obj", ".."])
def test_an_asset_with_a_folder_in_its_name_is_refused(name):
    with pytest.raises(StateError) as refused:
        company(name).world  # noqa: B018
    text = f"the recording's scene.json is damaged: invalid asset name '{name}': a file name without folders is needed"
    assert str(refused.value) == text


def test_a_recording_that_lacks_a_file_of_its_world_is_refused():
    lacking = company()
    del lacking.files["assets/hull.obj"]
    with pytest.raises(StateError) as refused:
        lacking.world  # noqa: B018
    assert str(refused.value) == "no saved world in the recording: 'assets/hull.obj'"
