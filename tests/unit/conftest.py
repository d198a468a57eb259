"""Small assets of our own, so that these tests do not depend on the package's."""

from pathlib import Path

import pytest

from vrx_mj.config import search

BROKEN = Path(__file__).parents[1] / "broken"


@pytest.fixture
def ours(monkeypatch):
    """`tests/broken/ours` in place of the package's assets, and no other search path."""
    monkeypatch.setattr(search, "root", lambda: BROKEN / "ours")
    monkeypatch.delenv("VRX_MJ_PATH", raising=False)
    return BROKEN / "ours"


@pytest.fixture
def here(ours, tmp_path, monkeypatch):
    """An empty current folder with a name that is not ASCII."""
    folder = tmp_path / "测试 boats"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder
