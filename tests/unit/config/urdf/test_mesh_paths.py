"""Meshes in a description that is read elsewhere."""

import pytest

from vrx_mj.config.urdf.meshes import MeshFiles, with_file_uris


@pytest.fixture
def files(tmp_path):
    for name in ("boat/meshes/hull & deck.obj", "vrx/wamv/meshes/arch.dae", "secret.obj"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    return MeshFiles(tmp_path / "boat", {}, [tmp_path / "vrx"])


@pytest.mark.parametrize(
    ("written", "there"),
    [
        ('<mesh filename="meshes/hull &amp; deck.obj"/>', "boat/meshes/hull%20%26%20deck.obj"),
        ("<mesh scale='1 1 1' filename='package://wamv/meshes/arch.dae'/>", "vrx/wamv/meshes/arch.dae"),
        ('<mesh\n  filename = "meshes/../meshes/hull%20&amp;%20deck.obj" />', "boat/meshes/hull%20%26%20deck.obj"),
    ],
)
def test_a_mesh_that_is_found_is_named_by_where_it_is(files, tmp_path, written, there):
    text = f"<geometry>{written}</geometry>"
    told = with_file_uris(text, files)
    assert f'"{tmp_path.as_uri()}/{there}"' in told
    assert with_file_uris(told, files) == told


@pytest.mark.parametrize(
    "name", ["meshes/none.obj", "../secret.obj", "package://none/a.obj", "https://example.org/a.obj", "C:\\a.obj", ""]
)
def test_other_meshes_stay_as_they_are(files, name):
    text = f'<robot><mesh filename="{name}"/><texture filename="meshes/hull &amp; deck.obj"/></robot>'
    assert with_file_uris(text, files) == text
