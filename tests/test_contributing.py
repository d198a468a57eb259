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


def changes(diff):
    """Each file of a diff, and its hunks as texts before and after."""
    for file, body in re.findall(r"^\+\+\+ b/(\S+)\n(.*?)(?=^--- |\Z)", diff, re.MULTILINE | re.DOTALL):
        for hunk in body.split("@@\n")[1:]:
            lines = hunk.splitlines(keepends=True)
            yield file, *("".join(line[1:] for line in lines if line[0] in kept) for kept in (" -", " +"))


def changed(folder, diff):
    """Change the copy of the sources in a folder."""
    for file, before, after in changes(diff):
        path = folder / file
        text = path.read_text(encoding="utf-8") if before else ""
        assert not before or text.count(before) == 1, f"{file}: {before}"
        path.write_text(text.replace(before, after) if before else after, encoding="utf-8")


@pytest.mark.slow
def test_what_contributing_adds_works_at_the_first_try(tmp_path):
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("assets", "templates", "fleets"):
        (tmp_path / name).symlink_to(ROOT / name)
    for diff in DIFFS:
        changed(tmp_path, diff)
    assert len(DIFFS) >= 2
    tests = ["tests/unit/runtime/test_effects.py", "tests/unit/runtime/test_ocean.py", "-k", "effect or spectrum"]
    program = [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", *tests]
    own = {**environment(VRX_MJ_CACHE=tmp_path / "cache"), "PYTHONPATH": str(tmp_path / "src")}
    done = subprocess.run(program, check=False, cwd=ROOT, env=own, capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 0, done.stdout
    assert "[wallops]" in done.stdout
