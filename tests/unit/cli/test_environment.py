import ast
import sys
from pathlib import Path

import pytest

import vrx_mj
from vrx_mj.cli import PACKAGES, installed_first, shadowed_package

PARTS = {"vrx_mj", "annotated_types", "pydantic_core", "rerun_bindings"}  # ours, and what comes with pydantic and rerun


def test_the_packages_are_those_that_the_sources_import():
    named = set()
    for file in Path(vrx_mj.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                named |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                named.add((node.module or "").split(".")[0])
    assert named - set(sys.stdlib_module_names) - PARTS <= PACKAGES


@pytest.fixture
def ros(tmp_path, monkeypatch):
    """A folder that a sourced ROS would put first."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    return tmp_path


def test_what_pythonpath_names_comes_last(ros, monkeypatch):
    installed = [str(ros.parent / "python3.zip"), str(ros.parent / "site-packages")]
    monkeypatch.setattr(sys, "path", ["", str(ros), *installed])
    installed_first()
    assert sys.path == [*installed, "", str(ros)]


BROKEN = {
    "raise RuntimeError('too old')": "RuntimeError: too old",
    "print 'Python 2'": "SyntaxError: Missing parentheses in call to 'print'. Did you mean print(...)? ",
    "import numpy_of_another_python": "ModuleNotFoundError: No module named 'numpy_of_another_python'",
}


@pytest.mark.parametrize("text", BROKEN)
def test_a_package_in_the_way_is_named_with_its_file(ros, monkeypatch, text):
    file = ros / "cbor2.py"
    file.write_text(text + "\n", encoding="utf-8")
    monkeypatch.delitem(sys.modules, "cbor2", raising=False)
    with pytest.raises(Exception, match=r".") as error:
        __import__("cbor2")
    told = shadowed_package(error.value)
    assert told.startswith(f"vrx-mj: cbor2 in {file.resolve()}, from PYTHONPATH, is in the way (")
    assert BROKEN[text].strip() in told
    assert told.endswith("): run with PYTHONPATH empty; if cbor2 is missing then, install vrx_mj again")


def test_a_package_that_lacks_a_name_is_in_the_way(ros, monkeypatch):
    (ros / "cbor2.py").write_text("", encoding="utf-8")
    monkeypatch.delitem(sys.modules, "cbor2", raising=False)
    module = __import__("cbor2")
    with pytest.raises(AttributeError) as error:
        _ = module.dumps
    assert "cbor2.py, from PYTHONPATH, is in the way" in shadowed_package(error.value)


def test_other_errors_are_nobodys_fault(ros):
    (ros / "my_controller.py").write_text("raise RuntimeError('mine')\n", encoding="utf-8")
    with pytest.raises(RuntimeError) as error:
        __import__("my_controller")
    assert shadowed_package(error.value) is None
