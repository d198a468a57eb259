"""Every example's main() runs."""

import importlib.util
import math
import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted(path for path in FOLDER.glob("[0-9]*.py") if "roslibpy" not in path.stem)
"""Those that need no server; test_ros_tutorials.py runs the others."""


def loaded(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_there_are_examples():
    assert EXAMPLES


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(path, tmp_path):
    assert loaded(path).main(tmp_path / "out.rrd", 20.0)
    assert (tmp_path / "out.rrd").stat().st_size > 10_000


def test_the_heading_of_the_first_example_is_kept(tmp_path):
    summary = loaded(EXAMPLES[0]).main(tmp_path / "out.rrd", 40.0)
    assert summary.boats["wamv"].heading == pytest.approx(math.radians(45.0), abs=0.15)  # wind of 5 m/s with gusts


def test_the_skiff_of_the_third_example_holds_its_course(tmp_path):
    summary = loaded(EXAMPLES[2]).main(tmp_path / "out.rrd", 40.0)
    assert summary.boats["skiff"].heading == pytest.approx(math.radians(60.0), abs=0.05)


@pytest.mark.slow
def test_the_boats_of_the_eleventh_example_keep_their_places_and_pass_the_gate(tmp_path, capsys):
    (path,) = (path for path in EXAMPLES if path.stem.startswith("11"))
    summary = loaded(path).main(tmp_path / "out.rrd")
    told = capsys.readouterr().out
    numbers = dict(re.findall(r"^(wedge|column|boats kept|7 boats passed the gate,)\D*([\d.]+) m", told, re.MULTILINE))
    assert float(numbers["wedge"]) < 1.5
    assert float(numbers["column"]) < 1.5
    assert float(numbers["boats kept"]) > 7.0  # a WAM-V is 4.9 m long
    assert float(numbers["7 boats passed the gate,"]) < 1.0  # of 6 m to either side
    assert "no contacts of hulls and buoys" in told
    assert min(boat.position[0] for boat in summary.boats.values()) > 88.0
