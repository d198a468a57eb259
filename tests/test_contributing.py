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
    assert [(file, before) for file, before, _ in hunks if before and read(ROOT / file).count(before) != 1] == []
    assert len(hunks) > 25


def read(path):
    return path.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.nightly
def test_what_contributing_adds_works_at_the_first_try(tmp_path):
    for name in PARTS:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, tmp_path / name)
    for file, before, after in (hunk for diff in DIFFS for hunk in changes(diff)):
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(read(path).replace(before, after) if before else after, encoding="utf-8")
    own = {**environment(VRX_MJ_CACHE=tmp_path / "cache"), "PYTHONPATH": str(tmp_path / "src")}
    for words in (
        ["tools/format_pages.py"],
        ["tools/cli_page.py"],
        ["tools/gallery.py", "--text"],
        ["-m", "vrx_mj", "digest", "ocean"],
    ):
        subprocess.run([sys.executable, *words], check=True, cwd=tmp_path, env=own)
    names = (
        "test_kinds.py", "unit/tasks", "unit/runtime/test_effects.py", "unit/runtime/test_ocean.py",
        "unit/ros/test_table.py", "unit/ros/table/test_vrx3.py", "unit/cli/test_program.py",
        "unit/formats/test_csv_fleets.py", "unit/control/test_loitering.py", "unit/rl/problems/test_registry.py",
        "integration/test_exploits.py", "integration/test_shipped_robots.py",
        "integration/test_controllers_of_robots.py", "unit/tools/test_gallery.py",
    )  # fmt: skip
    chosen = "effect or spectrum or task or sensor or kind or list or topic or offer or command"
    chosen += " or pram or fleets or loitering or Cruise or gallery"
    program = [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", "-m", "not nightly", "-k", chosen]
    program += [f"tests/{name}" for name in names]
    done = subprocess.run(program, check=False, cwd=tmp_path, env=own, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stdout
    assert all(f"[{name}]" in done.stdout for name in ("wallops", "rendezvous", "pram", "Cruise"))
