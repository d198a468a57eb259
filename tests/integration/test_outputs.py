"""Disks that are full, folders that are gone, readers that leave: one line, and no half of a file."""

import contextlib
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

import vrx_mj
from vrx_command import environment
from vrx_mj.cli.program import COMMANDS
from vrx_mj.errors import StateError, VrxError
from vrx_mj.outputs import atomic_write, write_files

FULL = Path("/dev/full")
PROGRAM = [sys.executable, "-m", "vrx_mj"]
full = pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")


def called(*words, **more):
    """The command line with these words, run to its end."""
    return subprocess.run([*PROGRAM, *words], stderr=subprocess.PIPE, env=environment(), text=True, check=False, **more)


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    file = tmp_path / "some.txt"
    file.write_text("before", encoding="utf-8")
    with contextlib.suppress(KeyboardInterrupt), atomic_write(file, "the text") as target:
        target.write_text("half", encoding="utf-8")
        raise KeyboardInterrupt
    assert file.read_text(encoding="utf-8") == "before"
    with atomic_write(file, "the text") as target:
        target.write_text("whole", encoding="utf-8")
        assert file.read_text(encoding="utf-8") == "before"
    assert file.read_text(encoding="utf-8") == "whole"
    assert list(tmp_path.iterdir()) == [file]


def test_permissions_and_links_stay(tmp_path):
    file, link = tmp_path / "file", tmp_path / "link"
    file.write_text("before", encoding="utf-8")
    file.chmod(0o640)
    link.symlink_to(file)
    with atomic_write(link, "the text") as target:
        target.write_text("after", encoding="utf-8")
    assert link.is_symlink()
    assert file.read_text(encoding="utf-8") == "after"
    assert file.stat().st_mode & 0o777 == 0o640


def test_a_file_that_is_not_ours_stays_and_nothing_is_written_beside_it(tmp_path):
    (tmp_path / "mine").write_text("mine", encoding="utf-8")
    (tmp_path / "old").write_text("old", encoding="utf-8")
    files = {"new": "new", "old": "new", "mine": "new"}
    with pytest.raises(VrxError, match=r"mine exists and is not a list: choose another folder$"):
        write_files(tmp_path, files, "the lists", replaces=lambda name: name != "mine", kind="a list")
    assert {file.name: file.read_text(encoding="utf-8") for file in tmp_path.iterdir()} == {
        "mine": "mine",
        "old": "old",
    }
    del files["mine"]
    write_files(tmp_path, files, "the lists", replaces=lambda name: name != "mine", kind="a list")
    assert (tmp_path / "old").read_text(encoding="utf-8") == (tmp_path / "new").read_text(encoding="utf-8") == "new"


@full
def test_a_full_disk_is_told_in_a_line():
    with pytest.raises(VrxError, match=r"^cannot write the text '/dev/full': No space left on device$"), \
         atomic_write(FULL, "the text") as target:  # fmt: skip
        target.write_text("text", encoding="utf-8")


def test_a_state_that_does_not_fit_leaves_the_one_before(tmp_path):
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean"))
    sim.get_state().save(tmp_path / "some.state")
    before = (tmp_path / "some.state").read_bytes()
    sim.step()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
    try:
        with pytest.raises(StateError, match=r"^cannot write the state '.*some.state': File too large$"):
            sim.get_state().save(tmp_path / "some.state")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert (tmp_path / "some.state").read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.slow
def test_a_folder_that_was_deleted(tmp_path):
    for command in (*COMMANDS, "--help", "--version"):
        gone = tmp_path / "gone"
        gone.mkdir()
        words = ["sh", "-c", "cd $0 && rmdir $0 && exec $@", str(gone), *PROGRAM, command]
        done = subprocess.run(words, capture_output=True, env=environment(), text=True, check=False)
        said = "the current folder cannot be used: No such file or directory; change to another\n"
        assert (command, done.returncode, done.stdout, done.stderr) == (command, 2, "", said)


@full
@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ["compile", "ocean", "-o", "/dev/full"],
        ["run", "ocean", "--duration", "1", "--summary", "/dev/full"],
        ["run", "ocean", "--duration", "1", "--record", "/dev/full"],
    ],
)
def test_commands_on_a_full_disk(words, tmp_path):
    done = subprocess.run(
        [*PROGRAM, *words], capture_output=True, env=environment(), text=True, cwd=tmp_path, check=False
    )
    assert done.returncode in {1, 2}
    assert done.stderr.splitlines()[-1].startswith("cannot write ")
    assert "Traceback" not in done.stderr


@full
@pytest.mark.slow
@pytest.mark.parametrize("words", [["list", "worlds"], ["--help"], ["list", "objects", "--verbose"]])
def test_output_that_nobody_takes(words):
    with FULL.open("w", encoding="utf-8") as out:
        done = subprocess.run(
            [*PROGRAM, *words], stdout=out, stderr=subprocess.PIPE, env=environment(), text=True, check=False
        )
    assert done.returncode == 1
    assert done.stderr.count("\n") <= 1
    assert "Traceback" not in done.stderr
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [*PROGRAM, *words], stdout=write, stderr=subprocess.PIPE, env=environment(), text=True, check=False
    )
    os.close(write)
    assert done.stderr == ""
