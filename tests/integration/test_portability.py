"""The same run whatever the machine: processes, processors without their newest instructions, caches, PYTHONPATH."""

import subprocess
import sys

import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

from vrx_command import environment, state_in, vrx

pytestmark = pytest.mark.slow

RUN = ("run", "ocean_buoys", "--duration", "2", "--seed", "7", "--thrust", "left=0.6,right=0.4")
SEA = {"extends": "sand_island", "sea": {"gain": 1.0}, "wind": {"mean_velocity": 6.0, "var_gain": 2.0, "var_time": 2.0}}
CHILD = """
import hashlib, sys
import numpy
from numpy._core._multiarray_umath import __cpu_features__
from vrx_mj import Simulation, compile_world
assert [name for name in sys.argv[1:] if __cpu_features__[name]] == []
world = compile_world({world!r}, fleet="trio", seed=7)
sim = Simulation(world)
sim.step({{boat: {{"left": 0.6, "right": 0.4}} for boat in sim.boats}}, duration=3.0)
numbers = numpy.linspace(0.0, 10.0, 1001)
print(hashlib.sha256(world.mjcf.encode()).hexdigest(), world.sha256, sim.get_state().sha256)
print(hashlib.sha256(numpy.cos(numbers).tobytes() + numpy.exp(numbers).tobytes()).hexdigest())
"""
ACTIVE = [name for name in __cpu_dispatch__ if __cpu_features__[name]]
NEWEST = [name for name in ACTIVE if "512" in name or name == "X86_V4"]


def sailed(*disabled):
    """Hashes of the world's text, the world and the state, and of numpy's own cosines and exponentials."""
    done = subprocess.run(
        [sys.executable, "-c", CHILD.format(world=SEA), *disabled],
        env=environment(NPY_DISABLE_CPU_FEATURES=" ".join(disabled) or None),
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-2:]


@pytest.fixture(scope="module")
def here():
    return sailed()


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """The state in which `RUN` ends where nothing is unusual."""
    return state_in(vrx(*RUN, cwd=tmp_path_factory.mktemp("usual"))[1])


def test_another_process_compiles_and_sails_the_same(here):
    assert sailed() == here


@pytest.mark.skipif(not ACTIVE, reason="numpy has no instructions to leave out on this processor")
@pytest.mark.parametrize("disabled", [NEWEST, ACTIVE], ids=["no_avx512", "none_dispatched"])
def test_numpys_vector_instructions_do_not_matter(here, disabled):
    ours, _numpys = sailed(*disabled)  # numpy's own functions may differ: that is the point
    assert ours == here[0]


def below_a_file(tmp_path):
    """A folder that nobody can make, root included."""
    (tmp_path / "file").write_bytes(b"")
    return tmp_path / "file" / "folder"


def homeless(place, **more):
    """An environment in which no folder of the user can be written."""
    names = ("HOME", "USERPROFILE", "LOCALAPPDATA", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR", "TMPDIR")
    return {**dict.fromkeys(names, place), **more}


NOWHERE = "import sys, tempfile; tempfile.tempdir = sys.argv.pop(1); from vrx_mj.cli import main; main()"


def test_where_nothing_can_be_kept_a_run_is_the_same(usual, tmp_path):
    """Compiled for this process only; tests/integration/test_packaging.py has first uses that keep it."""
    place = below_a_file(tmp_path)
    alone = subprocess.run(
        [sys.executable, "-c", NOWHERE, str(place), *RUN],
        cwd=tmp_path,
        env=environment(**homeless(place, VRX_MJ_CACHE=place)),
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert alone.returncode == 0, alone.stderr
    assert state_in(alone.stdout) == usual


@pytest.fixture
def poison(tmp_path):
    """A folder with packages that fail, as a sourced ROS puts old ones on PYTHONPATH."""
    folder = tmp_path / "ros 旧"
    folder.mkdir()

    def put(**modules):
        for name, text in modules.items():
            (folder / f"{name}.py").write_text(text + "\n", encoding="utf-8")
        return folder

    return put


OLD = {
    "raises": "raise ImportError('built for another Python')",
    "lacks_names": "__version__ = '1.8.2'",
    "python_2": "print 'hello'",
}


@pytest.mark.parametrize("text", OLD.values(), ids=OLD)
def test_old_packages_on_pythonpath_do_not_matter(usual, tmp_path, poison, text):
    names = ("trimesh", "yaml", "numpy", "typer", "rich", "jinja2", "pydantic", "typing_extensions", "six")
    folder = poison(**dict.fromkeys(names, text))
    code, out, err = vrx(*RUN, cwd=tmp_path, python_path=(folder,))
    assert (code, err) == (0, "")
    assert state_in(out) == usual


def test_old_packages_in_the_current_folder_do_not_matter(poison):
    folder = poison(numpy=OLD["raises"], yaml=OLD["raises"])
    code, out, err = vrx("list", "worlds", cwd=folder, python_path=("",))
    assert (code, err) == (0, "")
    assert "example_course" in out


@pytest.mark.parametrize("name", ["typer", "rich"])
def test_one_that_is_installed_nowhere_else_is_told_in_one_line(tmp_path, poison, name):
    folder = poison(typer="from rich import new_name", rich="") if name == "rich" else poison(typer=OLD["raises"])
    code, out, err = vrx("list", "worlds", cwd=tmp_path, python_path=(folder,), flags=("-S",))
    assert (code, out) == (2, "")
    assert err.startswith(
        f"vrx-mj: {name} in {folder.resolve() / name}.py, from PYTHONPATH, is in the way (ImportError: "
    )
    assert err.endswith(f": run with PYTHONPATH empty; if {name} is missing then, install vrx_mj again\n")
    assert err.count("\n") == 1


def test_a_screen_without_unicode_gets_its_summary(usual, tmp_path):
    boats = tmp_path / "测试 boats"
    boats.mkdir()
    code, out, err = vrx(*RUN, "--summary", boats / "小结.json", cwd=boats, PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert (code, err) == (0, "")
    assert state_in(out) == usual
    assert [file.name for file in boats.iterdir()] == ["小结.json"]
