"""`axes`: an axes file of some text in an empty current folder. `sample`: an equivalent of one of VRX's examples."""

import pytest

from axes_files import SAMPLES
from vrx_mj.formats.series.axes import read_series


@pytest.fixture
def axes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(text):
        file = tmp_path / "bay.yaml"
        file.write_text(text, encoding="utf-8")
        return read_series(file)

    return write


@pytest.fixture
def sample(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def copy(name):
        text = (SAMPLES / f"{name}.yaml").read_text(encoding="utf-8")
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
        return f"{name}.yaml"

    return copy
