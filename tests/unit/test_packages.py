import os
import shlex
import subprocess
import sys

import pytest

from vrx_mj import packages
from vrx_mj.packages import install_command, install_extra, needs_extra

PYTHON = "/home/me/strange place/it's/.venv/bin/python"


def test_the_command_is_for_this_python():
    assert shlex.split(install_command(".[video]")) == [sys.executable, "-m", "pip", "install", ".[video]"]


@pytest.mark.skipif(os.name == "nt", reason="pasted into a shell of POSIX")
def test_a_path_with_spaces_can_be_pasted(monkeypatch):
    monkeypatch.setattr(sys, "executable", PYTHON)
    pasted = ["sh", "-c", f"printf '%s\\n' {install_command('numba>=0.68,<1', 'b')}"]
    said = subprocess.run(pasted, capture_output=True, check=True, encoding="utf-8").stdout.splitlines()
    assert said == [PYTHON, "-m", "pip", "install", "numba>=0.68,<1", "b"]


def test_on_windows_quotes_are_double(monkeypatch):
    monkeypatch.setattr(packages.os, "name", "nt")
    monkeypatch.setattr(sys, "executable", r"C:\My Files\python.exe")
    assert install_command(".[rl]", "b") == r'"C:\My Files\python.exe" -m pip install ".[rl]" b'


def test_an_environment_without_pip_needs_uv(monkeypatch):
    monkeypatch.setattr(packages.importlib.util, "find_spec", lambda _name: None)
    monkeypatch.setattr(sys, "executable", "/x/python")
    assert install_command("numba") == "uv pip install --python /x/python numba"


def test_an_extra_comes_from_the_clone():
    assert install_extra("ros1") == f"run in the clone of vrx_mj: {install_command('.[ros1]')}"


@pytest.mark.parametrize(("name", "package"), [("vrx_mj.rl", "Gymnasium"), ("vrx_mj.rl.zoo", "PettingZoo")])
def test_environments_without_their_extra_name_it(monkeypatch, name, package):
    for module in [module for module in sys.modules if module.startswith(name)]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, package.lower(), None)
    with pytest.raises(ModuleNotFoundError) as raised:
        __import__(name)
    assert str(raised.value) == needs_extra(name, package, "rl")
    assert raised.value.name == package.lower()


@pytest.mark.slow
def test_environments_with_one_boat_need_no_pettingzoo():
    code = (
        "import sys; sys.modules['pettingzoo'] = None; import vrx_mj.rl; print(vrx_mj.rl.Env.__name__)\n"
        "try: vrx_mj.rl.ParallelEnv\nexcept ModuleNotFoundError as error: print(error)\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, encoding="utf-8")
    assert ran.stdout.splitlines() == ["Env", needs_extra("vrx_mj.rl.zoo", "PettingZoo", "rl")]


def test_another_missing_package_is_not_blamed_on_the_extra():
    refused = pytest.raises(ModuleNotFoundError, match=r"^No module named 'no_such_module'$")
    with refused, packages.importing("x", "Gymnasium", "rl"):
        __import__("no_such_module")
