"""Broken xacro files and the whole message that each must give: `tests/broken/xacro/CASE.xacro` and `CASE.expected`."""

from pathlib import Path

import pytest

from vrx_mj.config.urdf.expand import expand
from vrx_mj.errors import ConfigError

BROKEN = Path(__file__).parents[3] / "broken" / "xacro"
CASES = sorted(BROKEN.glob("*.xacro"))
PACKAGES = {"wamv_gazebo": BROKEN / "parts", "wamv_description": BROKEN / "parts"}


@pytest.mark.parametrize("file", CASES, ids=[file.stem for file in CASES])
def test_a_broken_file_says_what_and_where(file, monkeypatch):
    monkeypatch.chdir(BROKEN)
    with pytest.raises(ConfigError) as caught:
        expand(Path(file.name), packages=PACKAGES)
    assert str(caught.value) == file.with_suffix(".expected").read_text(encoding="utf-8").rstrip("\n")


@pytest.mark.parametrize("file", CASES, ids=[file.stem for file in CASES])
def test_every_message_names_file_line_and_column(file, monkeypatch):
    monkeypatch.chdir(BROKEN)
    with pytest.raises(ConfigError) as caught:
        expand(Path(file.name), packages=PACKAGES)
    (problem,) = caught.value.problems
    lines = (BROKEN / problem.file).read_text(encoding="utf-8").split("\n")
    assert 1 <= problem.line <= len(lines)
    assert 1 <= problem.column <= len(lines[problem.line - 1]) + 1


def test_there_are_enough_broken_files():
    assert len(CASES) >= 80


def test_no_message_speaks_of_python_or_xacro_internals():
    text = "\n".join(file.read_text(encoding="utf-8") for file in BROKEN.glob("*.expected"))
    for word in ("XacroException", "Traceback", "expat", "identifier", "object has no attribute", "<class", "None"):
        assert word not in text
