"""Files that have no end, or none that comes, and those that are too large: refused before they are read."""

import os
import socket
import sys
from pathlib import Path

import pytest

import vrx_mj
from peak_memory import peak_memory
from vrx_mj.config.docks import load_dock
from vrx_mj.config.fleet import Order, load_fleet
from vrx_mj.config.objects import load_object
from vrx_mj.config.robots import load_robot
from vrx_mj.config.search import ReadingError, read_limited
from vrx_mj.config.world import load_world
from vrx_mj.config.yaml_text import read_lines
from vrx_mj.errors import VrxError
from vrx_mj.formats.parts.read import load_parts
from vrx_mj.formats.urdf.expand import Files, arguments, expand
from vrx_mj.formats.urdf.reader import MeshFiles, mesh_bytes, read_mesh
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.terrain import shoreline

WHOLE = 100
LARGE = 5_000_000_000
"""Bytes of a file with nothing in it: it takes no room on the disk."""


def refusal(call):
    with pytest.raises(VrxError) as caught:
        call()
    return str(caught.value)


@pytest.mark.parametrize("size", [0, 1, WHOLE])
def test_what_is_small_enough_is_read(tmp_path, size):
    (tmp_path / "a").write_bytes(b"x" * size)
    assert read_limited(tmp_path / "a", WHOLE) == b"x" * size


def test_what_is_too_large_is_not_read(tmp_path):
    with (tmp_path / "a").open("wb") as stream:
        stream.truncate(LARGE)
    message = []
    assert peak_memory(lambda: message.append(refusal(lambda: read_limited(tmp_path / "a", WHOLE)))) < 1_000_000
    assert message == ["is larger than 0.0001 MB, the maximum"]


def test_a_file_that_says_it_is_empty_is_read_up_to_the_limit():
    """Those of Linux's `/proc` do."""
    if not Path("/proc/cpuinfo").exists():
        pytest.skip("no /proc here")
    assert len(read_limited(Path("/proc/self/stat"), 10_000)) > 10
    with pytest.raises(ReadingError):
        read_limited(Path("/proc/self/maps"), 10)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("folder", "it is a folder, not a file"),
        ("pipe", "it is a pipe, not a file"),
        ("socket", "it is a socket, not a file"),
        ("zero", "it is a device, not a file"),
        ("none", "No such file or directory"),
        ("a" * 400, "File name too long"),
        ("a\0b", "its name is not valid"),
    ],
)
@pytest.mark.skipif(sys.platform != "linux", reason="makes pipes and sockets, and uses /dev/zero")
def test_what_is_no_file_is_told(tmp_path, monkeypatch, name, reason):
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    os.mkfifo("pipe")
    Path("zero").symlink_to("/dev/zero")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("socket")
        assert refusal(lambda: read_limited(Path(name), WHOLE)) == f"cannot be read: {reason}"


READERS = {
    "a.yaml": [load_world, lambda path: load_fleet(path, load_world("ocean")), vrx_mj.compile_world, read_lines,
               lambda path: load_object(path.name, path.parent), lambda path: load_robot(path.name, path.parent),
               lambda path: load_parts(path, "components"), lambda path: load_parts(path, "thrusters")],
    "a.txt": [lambda path: load_dock(path.name, path.parent), read_lines],
    "a.xacro": [expand, arguments, lambda path: build_boat(Order(robot=path.name, folder=path.parent))],
    "a.urdf": [expand, lambda path: build_boat(Order(robot=path.name, folder=path.parent))],
    "a.stl": [read_mesh, mesh_bytes],
    "a.json": [lambda path: shoreline("a", path.parent.parent)],
}  # fmt: skip


@pytest.mark.parametrize(("name", "read"), [(name, read) for name, several in READERS.items() for read in several])
@pytest.mark.parametrize("kind", ["large", "zero", "pipe"])
@pytest.mark.skipif(sys.platform != "linux", reason="makes pipes, and uses /dev/zero")
def test_every_reader_refuses_what_has_no_end(tmp_path, monkeypatch, name, read, kind):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "terrain" / name if name == "a.json" else tmp_path / name
    file.parent.mkdir(exist_ok=True)
    if kind == "large":
        with file.open("wb") as stream:
            stream.truncate(LARGE)
    elif kind == "zero":
        file.symlink_to("/dev/zero")
    else:
        os.mkfifo(file)

    def refused():
        with pytest.raises(VrxError):
            read(file)

    assert peak_memory(refused) < 20_000_000


@pytest.mark.skipif(sys.platform != "linux", reason="makes pipes")
def test_a_package_whose_name_never_comes_has_none(tmp_path):
    (tmp_path / "boats").mkdir()
    os.mkfifo(tmp_path / "boats" / "package.xml")
    files = Files(tmp_path / "boats" / "a.xacro", {}, [tmp_path / "boats"])
    assert files.package("boats") == tmp_path / "boats"
    assert refusal(lambda: MeshFiles(tmp_path / "boats").find("package://other/a.stl")).startswith("no file")
