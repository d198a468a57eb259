"""`vrx-mj demo`: what it writes, keeps and opens."""

import pytest

from vrx_mj import read_record
from vrx_mj.draw import display


@pytest.fixture
def opened(monkeypatch):
    """The recordings that a viewer is asked to open."""
    files = []
    monkeypatch.setattr("vrx_mj.recording.open_viewer", lambda file: files.append(str(file)) or 0)
    return files


@pytest.fixture
def screen(monkeypatch):
    monkeypatch.setattr(display, "no_window", lambda **_: None)


@pytest.fixture
def no_screen(monkeypatch):
    monkeypatch.setattr(display, "no_window", lambda **_: "no display")


def test_the_trio_is_recorded_and_opened(cli, folder, opened, screen):
    said = cli("demo", "--duration", 1)
    assert said.code == 0
    assert f"recording: {folder / 'vrx-mj-demo.rrd'}\n" in said.err
    assert opened == ["vrx-mj-demo.rrd"]
    record = read_record(folder / "vrx-mj-demo.rrd")
    assert (list(record.boats), record.time[-1]) == (["wamv1", "wamv2", "wamv3"], pytest.approx(1.0))


def test_without_a_display_the_last_line_says_how_to_open_it(cli, opened, no_screen):
    said = cli("demo", "--duration", 0.1)
    assert (said.code, opened) == (0, [])
    assert said.out.splitlines()[-1] == "no display; to open it: vrx-mj replay vrx-mj-demo.rrd"


def test_no_open_opens_nothing(cli, opened, screen):
    said = cli("demo", "--duration", 0.1, "--no-open", "-o", "my run.rrd")
    assert (said.code, opened) == (0, [])
    assert said.out.splitlines()[-1] == "to open it: vrx-mj replay 'my run.rrd'"


def test_earlier_recordings_are_kept(cli, folder, opened, no_screen):
    (folder / "vrx-mj-demo.rrd").write_bytes(b"mine")
    assert cli("demo", "--duration", 0.1).code == 0
    assert (folder / "vrx-mj-demo.rrd").read_bytes() == b"mine"
    assert read_record(folder / "vrx-mj-demo-2.rrd").complete
    said = cli("demo", "-o", "vrx-mj-demo.rrd")
    assert (said.code, said.err) == (2, "vrx-mj-demo.rrd exists: choose another name, or remove it\n")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-o", "no/run.rrd"), "cannot write the recording 'no/run.rrd': No such file or directory"),
        (("--duration", "0"), "invalid duration 0 s: at least one timestep, 0.01 s, is needed"),
    ],
)
def test_what_cannot_be_recorded_leaves_nothing(cli, folder, words, message):
    said = cli("demo", *words)
    assert (said.code, said.err.splitlines()[-1]) == (2, message)
    assert list(folder.iterdir()) == []


@pytest.mark.slow
def test_the_command_that_is_printed_makes_the_same_motion(cli, folder, opened, no_screen):
    import shlex

    said = cli("demo", "--duration", 1)
    words = next(line for line in said.out.splitlines() if line.startswith("the same by hand: ")).partition(": ")[2]
    assert cli(*shlex.split(words)[1:-1], "hand.rrd").code == 0
    assert cli("compare", "vrx-mj-demo.rrd", "hand.rrd").code == 0
