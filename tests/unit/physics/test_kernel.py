"""Where compiled kernels are kept."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numba
import pytest

import vrx_mj.physics.kernel as module
from vrx_mj.physics.kernel import cache_folder, kernel, kernel_modules, source_hash
from vrx_mj.physics.waves import ramp

PACKAGE = Path(module.__file__).parents[1]
SOURCE = PACKAGE.parent
PROGRAM = "from vrx_mj.physics.elementary import cosine; print(cosine(0.0))"


@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """A file where a folder would have to be: not even root can make a folder there."""
    file = tmp_path / "file"
    file.write_text("", encoding="utf-8")
    for name in ("HOME", "USERPROFILE", "XDG_CACHE_HOME", "LOCALAPPDATA", "VRX_MJ_CACHE"):
        monkeypatch.setenv(name, str(file / "no"))
    return file / "no"


def test_the_folder_that_a_user_chooses_comes_first(tmp_path, monkeypatch):
    monkeypatch.setenv("VRX_MJ_CACHE", str(tmp_path / "chosen"))
    assert cache_folder() == tmp_path / "chosen" / source_hash()


def test_the_user_s_cache_folder_is_next(tmp_path, monkeypatch):
    monkeypatch.delenv("VRX_MJ_CACHE", raising=False)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(tmp_path))
    folder = cache_folder()
    assert folder is not None
    assert folder.is_relative_to(tmp_path)


@pytest.mark.usefixtures("nowhere")
def test_where_nothing_else_can_be_written_it_is_the_temporary_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder = cache_folder()
    assert folder is not None
    assert folder.is_relative_to(tmp_path)


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes are POSIX's")
@pytest.mark.usefixtures("nowhere")
def test_a_temporary_folder_that_others_can_write_is_not_used(tmp_path, monkeypatch):
    """They could put code there that we run."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder = tmp_path / f"vrx_mj-{os.getuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    assert cache_folder() is None
    folder.chmod(0o700)
    assert cache_folder() == folder / source_hash()


def test_without_any_folder_kernels_still_run(nowhere, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(nowhere))
    assert cache_folder() is None
    monkeypatch.setattr(module, "FOLDER", None)
    assert kernel(_twice)(2.0) == 4.0


def _twice(x):
    return 2.0 * x


def test_numba_s_own_setting_stays_as_it_was(monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", "elsewhere")
    kernel(_twice)
    assert numba.config.CACHE_DIR == "elsewhere"


def test_kernels_lie_in_the_folder_by_package_wherever_that_is_installed():
    assert Path(ramp.stats.cache_path) == module.FOLDER / "physics"


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of the sources whose kernels count."""
    for package in ("model", "physics", "runtime", "sensors", "recording"):
        shutil.copytree(PACKAGE / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    for file in PACKAGE.glob("*.py"):
        shutil.copy(file, tmp_path)
    monkeypatch.setattr(module, "__file__", str(tmp_path / "physics" / "kernel.py"))
    return tmp_path


@pytest.mark.parametrize("name", ["runtime/limits.py", "runtime/simulation.py", "sensors/readings.py", "errors.py"])
def test_a_change_in_a_module_without_kernels_compiles_nothing_again(copy, name):
    before = source_hash()
    (copy / name).write_text((copy / name).read_text(encoding="utf-8") + "# a comment\n", encoding="utf-8")
    assert source_hash() == before


@pytest.mark.parametrize(
    "name",
    [
        "physics/drag.py",
        "runtime/loop.py",
        "sensors/rays.py",
        "recording/packing.py",
        "constants.py",
        "model/boats.py",
    ],
)
def test_a_change_in_a_module_with_kernels_or_in_what_they_take_over_changes_the_folder(copy, name):
    hashes = [source_hash()]
    (copy / name).write_text((copy / name).read_text(encoding="utf-8") + "# a comment\n", encoding="utf-8")
    hashes.append(source_hash())
    if name not in module._TAKEN_OVER:
        (copy / name).rename((copy / name).with_name("other.py"))
        hashes.append(source_hash())
    assert len(set(hashes)) == len(hashes)


def test_every_module_that_imports_the_decorator_counts():
    decorated = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if re.search(r"kernel import .*\b(allocating_)?kernel\b|numba.extending", path.read_text(encoding="utf-8"))
    }
    assert decorated
    assert decorated <= kernel_modules(PACKAGE).keys()


def test_kernels_take_numbers_only_from_modules_that_count():
    """A number of another module is compiled into a kernel: a change of it has to change the folder."""
    modules = kernel_modules(PACKAGE)
    for name, source in modules.items():
        if name not in module._TAKEN_OVER and b"kernel import" in source:
            for node in ast.parse(source).body:
                if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vrx_mj."):
                    numbers = [alias.name for alias in node.names if alias.name.strip("_").isupper()]
                    file = node.module.removeprefix("vrx_mj.").replace(".", "/") + ".py"
                    assert not numbers or file in modules, f"{name}: {numbers} of {file}"


@pytest.mark.slow
@pytest.mark.usefixtures("nowhere")
def test_processes_that_start_at_once_share_one_cache(tmp_path):
    environment = os.environ | {"VRX_MJ_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(SOURCE)}
    running = [
        subprocess.Popen([sys.executable, "-c", PROGRAM], env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    outputs = [process.communicate(timeout=60)[0].strip() for process in running]
    assert outputs == ["1.0"] * 2
    assert list((tmp_path / "cache").rglob("elementary.cosine-*.nbc"))


def test_a_process_without_a_home_starts(tmp_path):
    hidden = ("HOME", "USERPROFILE", "XDG_CACHE_HOME", "LOCALAPPDATA", "VRX_MJ_CACHE")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    environment |= {
        "PYTHONPATH": str(SOURCE),
        "TMPDIR": str(tmp_path),
        "TEMP": str(tmp_path),
        "TMP": str(tmp_path),
    }
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert done.stdout.strip() == "1.0"
