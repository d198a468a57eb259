"""A run needs what pyproject.toml declares, and nothing that only the developers' environment has."""

import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from vrx_command import environment
from vrx_mj.foreign.asking import PACKAGES

PROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"
ALONE = """
import sys
sys.modules.update(dict.fromkeys(sys.argv.pop().split(",")))
from vrx_mj.cli import main
main()
"""
"""Runs `vrx-mj`; the modules that the last word names cannot be imported."""


def declared():
    """Distributions that installing vrx_mj brings, itself among them."""
    needed = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["dependencies"]
    found, waiting = {"vrx-mj"}, [Requirement(line).name for line in needed]
    while waiting:
        each = canonicalize_name(waiting.pop())
        if each in found:
            continue
        found.add(each)
        wanted = map(Requirement, metadata.requires(each) or ())
        waiting += [item.name for item in wanted if item.marker is None or item.marker.evaluate({"extra": ""})]
    return found


def undeclared_modules():
    """Modules that are installed here, and would not be beside vrx_mj alone."""
    brought = declared()
    found = metadata.packages_distributions()
    return {name for name, of in found.items() if name.isidentifier() and not {*map(canonicalize_name, of)} & brought}


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("run", "ocean_buoys", "--duration", "1", "--record", "run.rrd", "--sensors", "wamv:lidar_wamv,imu_wamv"),
        ("map", "example_course"),
        ("robot", "build", "-o", "boat.urdf", "--mjcf", "boat.xml"),
    ],
)
def test_a_command_needs_declared_packages_only(words, tmp_path):
    blocked = undeclared_modules()
    assert "pytest" in blocked
    done = subprocess.run(
        [sys.executable, "-c", ALONE, *words, ",".join(sorted(blocked))],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr


def test_what_reads_strangers_files_is_declared():
    """No command's own process imports it, so the test above cannot miss it."""
    assert set(map(canonicalize_name, PACKAGES)) <= declared()


IMPORTED = """
import sys, warnings
from pathlib import Path
from vrx_mj import cli
from vrx_mj.foreign import asking
warnings.simplefilter("ignore")
if sys.argv.pop() == "cold":
    asking._folder = lambda: None
try:
    cli.main()
except SystemExit as ended:
    assert not ended.code
found = sorted({"collada", "networkx", "trimesh", "xacro", "yourdfpy"} & set(sys.modules))
found += sorted(name for name in sys.modules if name.count(".") == 1 and name.startswith(("scipy.o", "scipy.sp")))
Path("imported.txt").write_text(" ".join(found), encoding="utf-8")
"""
"""Runs `vrx-mj`, and says which packages that read strangers' files it has imported. numba imports scipy's root."""


@pytest.mark.slow
@pytest.mark.parametrize("answers", ["cold", "warm"])
def test_a_run_imports_nothing_that_reads_strangers_files(answers, tmp_path):
    words = [
        "run",
        "example_course",
        "--fleet",
        "trio",
        "--duration",
        "1",
        "--seed",
        "7",
        "--thrust",
        "left=0.6,right=0.4",
        "--record",
        "run.rrd",
    ]
    subprocess.run([sys.executable, "-c", IMPORTED, *words, answers], cwd=tmp_path, env=environment(), check=True,
                   capture_output=True)  # fmt: skip
    assert not (tmp_path / "imported.txt").read_text(encoding="utf-8")
