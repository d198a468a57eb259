"""`--package-path`: its folders come before those of the environment."""

import os

import pytest

from vrx_mj.cli.files import look_in
from vrx_mj.config.search import PACKAGE_PATH, package_paths
from vrx_mj.errors import VrxError


def test_folders_that_are_named_come_before_those_of_the_environment(tmp_path, monkeypatch):
    folders = [tmp_path / name for name in ("one", "two", "inherited")]
    for folder in folders:
        folder.mkdir()
    monkeypatch.setenv(PACKAGE_PATH, str(folders[2]))
    look_in(folders[:2])
    assert package_paths() == tuple(folders)
    monkeypatch.setenv(PACKAGE_PATH, "")
    look_in(folders[:1])
    assert os.environ[PACKAGE_PATH] == str(folders[0])
    with pytest.raises(VrxError):
        look_in([tmp_path / "none"])
