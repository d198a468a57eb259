import sys

import pytest

from vrx_mj.campaign.manifest import code_version, controller_hash
from vrx_mj.errors import VrxError


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    package = tmp_path / "crew" / "deck"
    package.mkdir(parents=True)
    for file in (package.parent / "__init__.py", package / "__init__.py", package / "hand.py", tmp_path / "lone.py"):
        file.write_text("raise SystemExit('not to be run')\n", encoding="utf-8")
    return tmp_path


def test_the_hash_follows_the_module_and_runs_nothing(folder):
    before = controller_hash("lone:f")
    assert controller_hash("lone:g") == before
    (folder / "lone.py").write_text("f = 1\n", encoding="utf-8")
    assert controller_hash("lone:f") != before
    assert "lone" not in sys.modules


def test_the_hash_of_a_package_holds_all_its_modules(folder):
    before = controller_hash("crew.deck.hand:f")
    assert controller_hash("crew.deck:f") == before
    (folder / "crew" / "chart.py").write_text("", encoding="utf-8")
    assert controller_hash("crew.deck.hand:f") != before


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("lone", "invalid controller 'lone': module:function is needed, as in my_boat:controller"),
        ("lone.py:f", "no module named 'lone.py' for the controller 'lone.py:f'"),
        ("../lone:f", "invalid controller '../lone:f': module:function is needed, as in my_boat:controller"),
        ("nobody:f", "no module named 'nobody' for the controller 'nobody:f'"),
        ("crew.sail:f", "no module named 'crew.sail' for the controller 'crew.sail:f'"),
    ],
)
def test_what_is_no_controller(folder, name, message):
    with pytest.raises(VrxError) as raised:
        controller_hash(name)
    assert str(raised.value) == message


def test_the_version_names_the_code_too():
    version, digest = code_version().split()
    assert version == "0.1.0"
    assert len(digest) == 12


def test_the_version_follows_the_data_and_not_what_python_compiled_of_a_recipe_there(tmp_path, monkeypatch):
    monkeypatch.setattr("vrx_mj.campaign.manifest.root", lambda: tmp_path)
    (tmp_path / "assets").mkdir()
    versions = []
    for name in ("make_otter.py", "make_otter.cpython-311.pyc", "otter.yaml"):
        (tmp_path / "assets" / name).write_bytes(b"")
        versions.append(code_version.__wrapped__())
    assert versions[0] == versions[1] != versions[2]


def test_the_hash_of_a_package_follows_the_names_of_its_modules(folder):
    package = folder / "crew_of_two"
    package.mkdir()
    for name in ("__init__", "a", "b"):
        (package / f"{name}.py").write_text("def go(obs, t): ...\n" if name == "a" else "", encoding="utf-8")
    before = controller_hash("crew_of_two.a:go")
    (package / "b.py").rename(package / "c.py")
    assert controller_hash("crew_of_two.a:go") != before
