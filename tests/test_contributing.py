"""The diffs of CONTRIBUTING.md apply to the sources, and what they add works at the first try."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from vrx_command import environment

ROOT = Path(__file__).resolve().parents[1]
DIFFS = re.findall(r"```diff\n(.*?)```", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), re.DOTALL)
PARTS = ("src", "tests", "docs", "tools", "templates", "fleets", "assets", "pyproject.toml", "mkdocs.yml")


def changes(diff):
    """Each file of a diff, and its hunks as texts before and after."""
    for file, body in re.findall(r"^\+\+\+ b/(\S+)\n(.*?)(?=^--- |\Z)", diff, re.MULTILINE | re.DOTALL):
        for hunk in body.split("@@\n")[1:]:
            lines = hunk.splitlines(keepends=True)
            yield file, *("".join(line[1:] for line in lines if line[0] in kept) for kept in (" -", " +"))


def test_each_hunk_begins_at_lines_that_the_file_has_once():
    hunks = [hunk for diff in DIFFS for hunk in changes(diff)]
    lost = [(file, before) for file, before, _ in hunks if before and read(ROOT / file).count(before) != 1]
    assert lost == [], "diffs of CONTRIBUTING.md quote lines that are not there once: quote others, or fewer"
    assert len(hunks) > 25


def read(path):
    return path.read_text(encoding="utf-8")


@pytest.fixture
def changed(tmp_path):
    """A copy of the sources with all that the page adds."""
    for name in PARTS:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, tmp_path / name)
    for file, before, after in (hunk for diff in DIFFS for hunk in changes(diff)):
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(read(path).replace(before, after) if before else after, encoding="utf-8")
    return tmp_path


def python(folder, *words):
    own = {**environment(VRX_MJ_CACHE=folder / "cache"), "PYTHONPATH": str(folder / "src")}
    done = subprocess.run(
        [sys.executable, *words], check=False, cwd=folder, env=own, capture_output=True, encoding="utf-8"
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_what_contributing_adds_is_in_style_and_is_imported(changed):
    python(changed, "-m", "ruff", "check", "--no-cache", "src", "tests")
    new = re.findall(r"^--- /dev/null\n\+\+\+ b/src/(\S+)\.py$", "".join(DIFFS), re.MULTILINE)
    assert len(new) == 7
    python(changed, "-c", "; ".join(f"import {name.replace('/', '.')}" for name in new))


@pytest.mark.slow
@pytest.mark.nightly
def test_what_contributing_adds_works_at_the_first_try(changed):
    for words in (["tools/format_pages.py"], ["tools/cli_page.py"], ["tools/gallery.py", "--text"]):
        python(changed, *words)
    python(changed, "-m", "vrx_mj", "digest", "ocean")
    files = (
        "test_kinds.py", "unit/tasks", "unit/runtime/test_effects.py", "unit/runtime/test_ocean.py",
        "unit/ros/test_table.py", "unit/ros/table/test_vrx3.py", "unit/cli/test_program.py",
        "unit/cli/test_messages.py", "unit/cli/test_prepared_folders.py", "unit/config/test_broken.py",
        "unit/formats/test_csv_fleets.py", "unit/control/test_loitering.py", "unit/rl/problems/test_registry.py",
        "unit/tools/test_gallery.py",
    )  # fmt: skip
    pytest_run = ("-m", "pytest", "-v", "-p", "no:cacheprovider", "-n", "2")
    drawn = "tests/unit/tools/test_gallery.py::test_every_sheet_has_a_tile_for_each_of_its_names"  # nothing draws here
    said = python(changed, *pytest_run, *(f"tests/{name}" for name in files), "--deselect", drawn)
    assert all(f"[{name}]" in said for name in ("wallops", "rendezvous", "digest", "Cruise"))
    files = ("integration/test_exploits.py", "integration/test_shipped_robots.py", "integration/test_ros_bags.py")
    chosen = ("-m", "not nightly", "-k", "Cruise or pram or wamv/speed")  # the weed slows the others
    said = python(changed, *pytest_run, *chosen, *(f"tests/{name}" for name in files))
    assert all(f"[{name}]" in said for name in ("pram", "/wamv/speed"))
