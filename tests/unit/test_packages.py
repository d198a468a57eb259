import os
import re
import shlex
import subprocess
import sys
from ctypes.util import find_library

import pytest

from needs import STABLE_BASELINES3, needs
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


@pytest.mark.slow
@pytest.mark.parametrize(("chosen", "does"), [("", "vrx_mj.sensors.canvas.choose_backend()"), ("osmesa", "mujoco")])
def test_the_llvm_of_pytorch_is_loaded_before_that_of_mesa(tmp_path, chosen, does):
    """Loaded the other way round, both are one; MuJoCo loads OSMesa when it is imported if `MUJOCO_GL` names it."""
    library = tmp_path / "triton" / "_C" / "libtriton.so"
    library.parent.mkdir(parents=True)
    library.write_bytes(b"no library: what cannot be loaded is left out")
    (tmp_path / "triton" / "__init__.py").write_text("raise SystemExit('not imported')", encoding="utf-8")
    code = (
        "import contextlib, sys\n"
        "sys.addaudithook(lambda event, given: event == 'ctypes.dlopen' and print(given[0]))\n"
        "import vrx_mj, vrx_mj.packages\n"
        "assert 'mujoco' not in sys.modules\n"
        "with contextlib.suppress(vrx_mj.VrxError, ImportError, AttributeError):\n"
        f"    import mujoco, vrx_mj.sensors.canvas; {does}\n"
    )
    paths = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    variables = {**os.environ, "MUJOCO_GL": chosen, "PYTHONPATH": paths}
    ran = subprocess.run([sys.executable, "-c", code], env=variables, capture_output=True, check=True, encoding="utf-8")
    loaded = [name for name in ran.stdout.splitlines() if re.search("triton|EGL|OSMesa", name)]
    assert loaded[0] == f"{library.parent.parent}/_C/libtriton.so"
    drawing = find_library("OSMesa" if chosen else "EGL") is not None
    assert sys.platform != "linux" or len(loaded) > drawing


@pytest.mark.slow
@pytest.mark.render
@needs(STABLE_BASELINES3)
def test_who_has_drawn_trains_with_pytorch():
    """Its optimisers import triton, where it is installed."""
    code = (
        "import gymnasium, vrx_mj.rl\n"
        "env = gymnasium.make('vrx_mj/StationKeeping-v0', render_mode='rgb_array', width=32, height=24)\n"
        "env.reset(seed=1)\nenv.render()\n"
        "from stable_baselines3 import PPO\n"
        "PPO('MlpPolicy', env, device='cpu', n_steps=64).learn(64)\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert ran.returncode == 0, ran.stderr
