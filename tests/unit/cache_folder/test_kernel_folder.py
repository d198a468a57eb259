"""Compiled kernels are kept where this user alone can write, wherever that is."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import vrx_mj.physics.kernel as module
from vrx_mj import cache_folder
from vrx_mj.cache_folder import chosen_folder, insecure

SOURCE = Path(module.__file__).parents[2]
PROGRAM = "from vrx_mj.physics.elementary import cosine; print('imported'); print(cosine(0.0))"
STRANGER = 65534
"""Another user's number: nobody's, on Debian."""

pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes are POSIX's")
as_root = pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root gives files away")


@pytest.fixture
def home(tmp_path, monkeypatch):
    """An empty home, whose folder for caches comes second."""
    home, temporary = tmp_path / "home", tmp_path / "temporary"
    for folder in (home, temporary):
        folder.mkdir(mode=0o700)
    for name in ("HOME", "XDG_CACHE_HOME"):
        monkeypatch.setenv(name, str(home))
    monkeypatch.delenv("VRX_MJ_CACHE", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    return home


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """The folder that the user asks for, two levels deep."""
    asked = tmp_path / "above" / "asked"
    asked.mkdir(parents=True, mode=0o755)
    monkeypatch.setenv("VRX_MJ_CACHE", str(asked))
    return asked


def refusal(folder, reason):
    return f"no compiled kernels are read from {folder} or kept there: {reason}"


def test_a_folder_of_ones_own_is_used(home, asked):
    assert chosen_folder("x") == (asked / "x", ())
    assert (asked / "x").stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("mode", [0o775, 0o757, 0o1777])
def test_a_folder_that_others_can_write_to_is_refused_and_the_next_used(home, asked, mode):
    asked.chmod(mode)
    (asked / "x").mkdir(mode=0o700)
    if mode & 0o1000:  # where nobody can replace what another has made
        expected = (asked / "x", ())
    else:
        expected = (home / "vrx_mj" / "x", (refusal(asked, f"others can write to {asked}"),))
    assert chosen_folder("x") == expected


@pytest.mark.parametrize("mode", [0o777, 0o1777])
def test_others_cannot_put_files_into_the_folder_itself(home, asked, mode):
    (asked / "x").mkdir()
    (asked / "x").chmod(mode)
    reason = f"others can write to {asked / 'x'}"
    assert chosen_folder("x") == (home / "vrx_mj" / "x", (refusal(asked, reason),))


def test_a_parent_that_others_can_write_to_lets_them_replace_it(home, asked):
    asked.parent.chmod(0o777)
    assert insecure(asked) == f"others can write to {asked.parent}"
    asked.parent.chmod(0o1777)
    assert insecure(asked) is None


@as_root
@pytest.mark.parametrize("which", ["the folder", "its parent"])
def test_a_folder_of_another_user_is_refused(home, asked, which):
    owned = asked if which == "the folder" else asked.parent
    os.chown(owned, STRANGER, STRANGER)
    assert chosen_folder("x").refused == (refusal(asked, f"{owned} belongs to another user"),)


def test_behind_a_symbolic_link_the_folder_itself_counts(home, asked, tmp_path, monkeypatch):
    link = tmp_path / "link"
    link.symlink_to(asked)
    monkeypatch.setenv("VRX_MJ_CACHE", str(link))
    assert chosen_folder("x") == (link / "x", ())
    asked.chmod(0o777)
    assert chosen_folder("x").refused == (refusal(link, f"others can write to {asked}"),)


def test_the_folders_that_links_lie_in_count(home, asked, tmp_path, monkeypatch):
    """first -> loose/second -> asked: whoever turns the second round chooses what is run."""
    loose = tmp_path / "loose"
    loose.mkdir()
    (loose / "second").symlink_to(asked)
    (tmp_path / "first").symlink_to("loose/second")
    assert insecure(tmp_path / "first") is None
    loose.chmod(0o777)
    assert insecure(tmp_path / "first") == f"others can write to {loose}"
    assert insecure(tmp_path / "first" / "..") == f"others can write to {loose}"


def test_a_circle_of_links_is_no_folder(home, asked, tmp_path, monkeypatch):
    (tmp_path / "circle").symlink_to("circle")
    monkeypatch.setenv("VRX_MJ_CACHE", str(tmp_path / "circle"))
    assert chosen_folder("x") == (home / "vrx_mj" / "x", (refusal(tmp_path / "circle", "it cannot be written"),))


def test_the_users_own_cache_is_made_private(home):
    """A umask of 002 had it made for the group too; what stands there under our name may be another's."""
    planted = home / "vrx_mj" / "x" / "planted.nbc"
    planted.parent.mkdir(parents=True)
    planted.touch()
    (home / "vrx_mj").chmod(0o775)
    assert chosen_folder("x") == (home / "vrx_mj" / "x", ())
    assert (home / "vrx_mj").stat().st_mode & 0o777 == 0o755
    assert not planted.exists()


def test_everything_that_is_made_is_private(home):
    folder = chosen_folder("x").folder
    assert folder == home / "vrx_mj" / "x"
    assert {path.stat().st_mode & 0o777 for path in (folder, folder.parent)} == {0o700}


def test_where_all_are_refused_there_is_none(home, asked):
    for folder in (home, home.parent / "temporary", asked):
        folder.chmod(0o777)
    reasons = [f"others can write to {folder}" for folder in (asked, home, home.parent / "temporary")]
    places = [asked, home / "vrx_mj", home.parent / "temporary" / f"vrx_mj-{os.getuid()}"]
    assert chosen_folder("x") == (None, tuple(map(refusal, places, reasons)))


@pytest.mark.slow
@pytest.mark.parametrize("rest", ["the home", "nothing"])
def test_it_is_said_in_one_line_when_the_first_kernel_is_called(home, asked, rest):
    asked.chmod(0o777)
    place = os.environ | {"PYTHONPATH": str(SOURCE), "TMPDIR": str(home.parent / "temporary")}
    instead = f"{home / 'vrx_mj' / module.source_hash()} is used instead"
    lines = [refusal(asked, f"others can write to {asked}")]
    if rest == "nothing":
        place |= dict.fromkeys(("HOME", "XDG_CACHE_HOME", "TMPDIR"), str(below_a_file(home)))
        instead = "they are compiled in every process"
        program = "import tempfile, os; tempfile.tempdir = os.environ['TMPDIR']; " + PROGRAM
    else:
        program = PROGRAM
    done = subprocess.run(
        [sys.executable, "-c", f"{program}; print(cosine(0.0))"],
        env=place, capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout == "imported\n1.0\n1.0\n"
    assert done.stderr == "".join(f"vrx_mj: {line}; {instead}\n" for line in lines)


def below_a_file(folder):
    (folder / "file").touch()
    return folder / "file" / "no"


@pytest.mark.parametrize(
    ("platform", "variables", "folder"),
    [
        ("linux", {}, "/home/a/.cache"),
        ("linux", {"XDG_CACHE_HOME": ""}, "/home/a/.cache"),
        ("linux", {"XDG_CACHE_HOME": "/var/b"}, "/var/b"),
        ("darwin", {"XDG_CACHE_HOME": "/var/b"}, "/home/a/Library/Caches"),
        ("win32", {}, "/home/a/AppData/Local"),
        ("win32", {"LOCALAPPDATA": "/c/b"}, "/c/b"),
    ],
)
def test_each_platform_has_its_folder_for_caches(monkeypatch, platform, variables, folder):
    monkeypatch.setattr(cache_folder.sys, "platform", platform)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert cache_folder._user_cache(Path("/home/a")) == Path(folder) / "vrx_mj"


def test_where_there_are_no_owners_everything_is_secure_and_users_have_names(monkeypatch, tmp_path):
    monkeypatch.delattr(os, "getuid")
    monkeypatch.setenv("USERNAME", "ann")
    (tmp_path / "open").mkdir(mode=0o777)
    assert insecure(tmp_path / "open") is None
    assert cache_folder._user_name() == "ann"
    monkeypatch.delenv("USERNAME")
    assert cache_folder._user_name() == "user"


def test_every_step_to_a_folder_is_passed(tmp_path):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "to_b").symlink_to(tmp_path / "a" / "b")
    (tmp_path / "a" / "near").symlink_to("b/../b")
    rest = [tmp_path.parents[len(tmp_path.parents) - 1 - i] for i in range(len(tmp_path.parents))] + [tmp_path]
    a, b = tmp_path / "a", tmp_path / "a" / "b"
    assert list(cache_folder._steps(b)) == [*rest, a, b]
    assert list(cache_folder._steps(tmp_path / "to_b")) == [*rest, tmp_path / "to_b", *rest[1:], a, b]
    assert list(cache_folder._steps(a / "near")) == [*rest, a, a / "near", b, b / "..", b]
    circle = tmp_path / "circle"
    circle.symlink_to("circle")
    assert sum(step == circle for step in cache_folder._steps(circle)) == cache_folder._MAX_LINKS + 1
