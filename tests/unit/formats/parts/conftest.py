"""Parts files from text, as a user has them in the current folder."""

import pytest

from vrx_mj.formats.parts.read import load_parts


@pytest.fixture
def parts(tmp_path, monkeypatch):
    """Read a text as `components.yaml` or `thrusters.yaml`."""
    monkeypatch.chdir(tmp_path)

    def read(text, kind="components"):
        (tmp_path / f"{kind}.yaml").write_text(text, encoding="utf-8")
        return load_parts(f"{kind}.yaml", kind)

    return read
