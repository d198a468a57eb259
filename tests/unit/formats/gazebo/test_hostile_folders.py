"""Folders that are damaged or mean harm: links in circles, pipes, too much of everything, names of any bytes."""

import ctypes
import os
import socket
import sys
from pathlib import Path

import pytest

from vrx_mj.errors import VrxError
from vrx_mj.formats.gazebo import launch, opening
from vrx_mj.formats.gazebo.document import read_document
from vrx_mj.formats.gazebo.importing import import_files
from vrx_mj.formats.gazebo.opening import file_of_folder, files_below
from work import calls_at_most

pytestmark = pytest.mark.skipif(os.name == "nt", reason="of file systems of POSIX")

CALLS = 1_000_000  # 6,000 files of other kinds take 300,000
"""Calls of Python's that reading a folder may take."""
WORLD = '<sdf version="1.6"><world name="bay">{}</world></sdf>'
LAUNCH = '<launch><arg name="a" default="1"/></launch>'
NO_WORLD = "'team': no launch file and no Gazebo world in this folder"
NO_IMPORT = "no file to import in team: none ends in .world, .world.xacro, .launch, .sdf, .sdf.erb, .urdf, .urdf.xacro"


@pytest.fixture(autouse=True)
def team(tmp_path, monkeypatch):
    """An empty folder of this name in the current one."""
    monkeypatch.chdir(tmp_path)
    Path("team").mkdir()
    return Path("team")


def bay(folder: Path) -> None:
    (folder / "bay.world").write_text(WORLD.format(""), encoding="utf-8")


def outcome(use) -> str:
    """What becomes of a folder, in bounded time: the result, or the message of the error."""
    with calls_at_most(CALLS):
        try:
            return str(use(Path("team")))
        except VrxError as error:
            return str(error)


def opened() -> str:
    return outcome(file_of_folder)


def imported() -> str:
    return outcome(lambda folder: sorted(import_files(folder).texts))


def bind(file: Path) -> None:
    """Make a socket of this name."""
    with socket.socket(socket.AF_UNIX) as door:
        door.bind(str(file))


LINKS = {
    "itself": {"a.world": "a.world"},
    "a circle": {"a.launch": "b.launch", "b.launch": "a.launch"},
    "nowhere": {"a.world": "gone.world", "b.launch": "gone/b.launch"},
    "a device": {"a.world": "/dev/zero", "b.launch": "/dev/stdin"},
    "out of the folder": {"a.world": "../outside.world", "b.world": "/etc/passwd"},
    "a name that is too long": {"a.world": "x" * 300},
    "folders above": {"a": "..", "b.world": ".", "c": "/"},
    "pipes of the process": {"a.world": "/proc/self/fd/0", "b.launch": "/proc/self/mem"},
}


@pytest.mark.parametrize("kind", LINKS)
def test_links_are_not_followed_astray(team, kind):
    Path("outside.world").write_text(WORLD.format(""), encoding="utf-8")
    for name, target in LINKS[kind].items():
        (team / name).symlink_to(target)
    links = "'team': no world; symbolic links are not followed: name the folder that 'team/a' points to"
    assert opened() == (links if kind == "folders above" else NO_WORLD)
    assert imported() == NO_IMPORT
    bay(team)
    assert opened() == "team/bay.world"
    assert imported() == "['bay.yaml']"


@pytest.mark.parametrize(("make", "thing"), [(os.mkfifo, "pipe"), (bind, "socket")])
def test_what_is_no_file_is_named_and_not_waited_for(team, make, thing):
    make(team / "bay.world")
    assert imported() == f"team/bay.world: cannot be read: it is a {thing}, not a file"
    (team / "bay.world").unlink()
    bay(team)
    make(team / "bay.launch")
    with pytest.warns(UserWarning, match=f"team/bay.launch: cannot be read: it is a {thing}, not a file$"):
        assert opened() == "team/bay.world"
    make(team / "package.xml")
    assert imported() == "['bay.yaml']"


@pytest.mark.parametrize("name", ["model.sdf", "model.config", "model.sdf.erb"])
def test_a_pipe_in_the_place_of_a_model_is_left_out(team, name):
    (team / "models/buoy").mkdir(parents=True)
    os.mkfifo(team / "models/buoy" / name)
    (team / "bay.world").write_text(WORLD.format("<include><uri>model://buoy</uri></include>"), encoding="utf-8")
    assert "bay.yaml" in imported()
    assert [note.fate for note in import_files(team).notes if "buoy" in note.what + note.ours] == ["ignored"]


def test_folders_in_the_place_of_files_are_folders(team):
    for name in ("bay.world", "bay.launch", "model.sdf", "boat.urdf"):
        (team / name).mkdir()
    assert opened() == NO_WORLD
    assert imported() == NO_IMPORT
    bay(team / "bay.world")
    assert opened() == "team/bay.world/bay.world"


MANY = {
    "files of other kinds": (6_000, "{}.txt", "team/bay.world", "['bay.yaml']"),
    "worlds": (6_000, "{}.world", *["more than 2000 files to read in team: name a smaller folder"] * 2),
    "folders": (20_001, "{}/", *["more than 20000 folders in team: name a smaller one"] * 2),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", MANY)
def test_a_folder_of_very_much(team, kind):
    count, name, open_said, import_said = MANY[kind]
    bay(team)
    for number in range(count):
        path = f"team/{name.format(number)}"
        if path.endswith("/"):
            os.mkdir(path)  # noqa: PTH102 - a Path for each takes longer than all that is tested
        else:
            os.close(os.open(path, os.O_CREAT | os.O_WRONLY))
    assert opened() == open_said
    assert imported() == import_said


def test_many_launch_files(team):
    for number in range(1000):
        (team / f"{number}.launch").write_text(LAUNCH, encoding="utf-8")
    assert opened() == "1000 launch files in team: name one, or a smaller folder"


@pytest.mark.parametrize(
    ("count", "said"),
    [
        (2000, "inner.launch cannot be read: the files of this command take more than 100,000 notes and elements"),
        (30_000, "more than 50000 elements and attributes in a file"),
    ],
)
def test_a_launch_file_that_is_included_199_times_is_read_once(team, monkeypatch, count, said):
    """It took minutes and 1.2 GB."""
    read = []
    monkeypatch.setattr(launch, "read_document", lambda file: read.append(file) or read_document(file))
    for name, inner in {"inner": "<node pkg='a'/>" * count, "outer": "<include file='inner.launch'/>" * 199}.items():
        (team / f"{name}.launch").write_text(f"<launch>{inner}</launch>", encoding="utf-8")
    with pytest.raises(VrxError) as refused:
        launch.read_launch(team / "outer.launch", {})
    assert str(refused.value).endswith(said)
    assert str(refused.value).count("\n") == 0
    assert [file.name for file in read] == ["outer.launch", "inner.launch"]


def test_a_folder_that_is_deep(team):
    bay(team)
    below = os.open(team, os.O_RDONLY)
    for _ in range(1100):  # deeper than any path may be long, and than calls may be nested
        os.mkdir("deep", dir_fd=below)
        above, below = below, os.open("deep", os.O_RDONLY, dir_fd=below)
        os.close(above)
    os.close(below)
    said = "folders more than 50 deep in team: name a smaller one"
    assert opened() == said
    assert imported() == said
    for _ in range(1100):  # from above, each with what is two below: the removal of pytest is recursive
        Path("team/deep").rename("team/e")
        if Path("team/e/deep").is_dir():
            Path("team/e/deep").rename("team/deep")
        Path("team/e").rmdir()


@pytest.mark.parametrize(("count", "each", "said"), [
    (1, 10**12, "team/0.world: is larger than 4 MB, the maximum"),
    (10, 3_900_000, "more than 32 MB to read in team: name a smaller folder"),
])  # fmt: skip
def test_files_that_are_large(team, count, each, said):
    for number in range(count):
        with (team / f"{number}.world").open("wb") as stream:
            stream.truncate(each)
    assert imported() == said


@pytest.mark.parametrize(("files", "most", "said"), [
    (3 * [1], 3, "3 files"), (3 * [1], 2, "more than 2 files to read in team: name a smaller folder"),
    (8 * [4_000_000], 9, "8 files"), ([4_000_001, *8 * [4_000_000]], 9, "9 files"),
    ([*8 * [4_000_000], 1], 9, "more than 32 MB to read in team: name a smaller folder"),
])  # fmt: skip
def test_so_much_is_read_of_a_folder(team, monkeypatch, files, most, said):
    """Files of more than 4 MB are refused where they are read."""
    monkeypatch.setattr(opening, "MOST_FILES", most)
    for number, size in enumerate(files):
        (team / f"{number}.txt").touch()
        with (team / f"{number}.world").open("wb") as stream:
            stream.truncate(size)
    assert outcome(lambda folder: f"{len(list(files_below(folder, ('.world',))))} files") == said


def test_names_of_any_bytes(team):
    for name in (b"\xff\xfe.world", b"a\nb.world", b"c\x1b[31md.world", b"it's.world"):
        Path(os.fsdecode(bytes(team) + b"/" + name)).write_text(WORLD.format(""), encoding="utf-8")
    assert opened() == (
        "team has 4 worlds; type one of these:\n"
        "  vrx-mj run team $'a\\x0ab.world'\n"
        "  vrx-mj run team $'c\\x1b[31md.world'\n"
        """  vrx-mj run team 'it'"'"'s.world'\n"""
        "  vrx-mj run team $'\\xff\\xfe.world'"
    )
    made = import_files(team)
    assert sorted(made.texts) == ["__.yaml", "a_b.yaml", "c__31md.yaml", "it_s.yaml"]
    for text in (made.table(), *made.texts.values()):
        assert all(line.isprintable() for line in text.encode("utf-8").decode("utf-8").split("\n"))


def without_privileges(use) -> str:
    """What becomes of the folder `team` where permissions count, as they do not for root."""
    if os.geteuid() != 0:
        return outcome(use)
    if sys.platform != "linux":
        pytest.skip("root may read everything")
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        version_3 = (ctypes.c_uint32 * 2)(0x20080522, 0)
        ctypes.CDLL(None).capset(version_3, (ctypes.c_uint32 * 6)())  # root it stays, so that it can import from here
        try:
            os.write(write, outcome(use).encode())
        finally:
            os._exit(0)
    os.close(write)
    os.waitpid(child, 0)
    with os.fdopen(read, "rb") as stream:
        return stream.read().decode()


@pytest.mark.parametrize(("closed", "said"), [
    ("team", "team: cannot be read: Permission denied"),
    ("team/closed", "['bay.yaml']"),
    ("team/bay.world", "team/bay.world: cannot be read: Permission denied"),
])  # fmt: skip
def test_what_may_not_be_read(closed, said):
    Path("team/closed").mkdir()
    bay(Path("team"))
    if closed == "team/closed":
        bay(Path(closed))
    Path(closed).chmod(0)
    try:
        assert without_privileges(lambda folder: sorted(import_files(folder).texts)) == said
    finally:
        Path(closed).chmod(0o700)
