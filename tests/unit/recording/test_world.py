"""Worlds in recordings: what comes from somebody else is read, and never written to disk."""

import tempfile

import pytest

from vrx_mj.errors import StateError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.recording.boat_sets import BoatSet
from vrx_mj.recording.record_scene import RowLayout


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A saved world, by relative path."""
    folder = tmp_path_factory.mktemp("saved")
    compile_world("ocean").save(folder)
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def boat_set(files):
    """Boats whose world's archive has these files."""
    return BoatSet(RowLayout(nq=0, nv=0, thrusters=(), bodies=()), "", files)


def test_names_in_a_recording_are_no_paths_on_disk(saved, tmp_path, monkeypatch):
    home = tmp_path / "a" / "b"
    home.mkdir(parents=True)
    monkeypatch.setattr(tempfile, "tempdir", str(home))
    outside = {"../../evil": b"1", str(tmp_path / "worse"): b"2"}
    assets = boat_set(saved | outside).world.assets
    assert {f"assets/{name}" for name in assets} == {name for name in saved if name.startswith("assets/")}
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("name", ["../hull.obj", "/etc/passwd", "..\\hull.obj", "C:hull.obj", ".."])
def test_an_asset_with_a_folder_in_its_name_is_refused(saved, name):
    mjcf = saved["scene.xml"].replace(b"<asset>", b'<asset><mesh name="hull" file="%s"/>' % name.encode(), 1)
    with pytest.raises(StateError) as refused:
        boat_set({**saved, "scene.xml": mjcf, f"assets/{name}": b"v 0 0 0"}).world  # noqa: B018
    assert str(refused.value) == f"the recording's scene.xml is damaged: invalid file '{name}' of <mesh>"


def test_a_recording_that_lacks_a_file_of_its_world_is_refused(saved):
    name = next(name for name in saved if name.startswith("assets/"))
    with pytest.raises(StateError) as refused:
        boat_set({other: content for other, content in saved.items() if other != name}).world  # noqa: B018
    assert str(refused.value) == f"no saved world in the recording: '{name}'"
