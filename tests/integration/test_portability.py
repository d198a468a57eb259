"""The same run whatever the machine: systems, processes, caches, PYTHONPATH, processors without new instructions."""

import re
import subprocess
import sys

import psutil
import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

from vrx_command import environment, state_in, vrx

pytestmark = pytest.mark.slow

RUN = ("run", "ocean_buoys", "--duration", "2", "--thrust", "left=0.6,right=0.4")
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


@pytest.mark.nightly
def test_another_process_compiles_and_sails_the_same(here):
    """By day those whose numpy has other instructions do."""
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


@pytest.mark.nightly
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


# Systems, by stubs: what they lack is taken from every Python that is started

POSIX_MODULES = ("crypt", "curses", "fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty")
POSIX_NAMES = (
    "getegid", "geteuid", "getgid", "getpgid", "getpgrp", "getuid", "killpg", "sched_getaffinity", "setsid",
    "sysconf", "tcgetpgrp",
)  # fmt: skip
LACKING = {
    "Linux": ((), (), ()),
    "macOS": ((), ("sched_getaffinity",), ("/proc", "/sys")),
    "Windows": (POSIX_MODULES, POSIX_NAMES, ("/proc", "/sys")),
}
"""Modules, names of `os` and folders that a system is without."""
SITE = """
import asyncio, concurrent.futures.process, ctypes.util, getpass, multiprocessing.process, os, pathlib, platform
import shutil, socket, subprocess, sys, tempfile, psutil  # what Python and psutil have is of this system
modules, names, folders = {lacking!r}
platform.uname()  # is kept
for name in modules:
    sys.modules[name] = None
for name in names:
    vars(os).pop(name, None)

def is_ours():
    frame = sys._getframe(2)
    while frame is not None:
        if frame.f_globals.get("__name__", "").partition(".")[0] in {{"vrx_mj", "__main__"}}:
            return True
        if frame.f_globals.get("__name__", "").partition(".")[0] == "psutil":
            return False
        frame = frame.f_back
    return False

def hook(event, arguments):
    if event in {{"open", "os.listdir", "os.scandir"}} and str(arguments[0]).startswith(folders) and is_ours():
        raise FileNotFoundError(2, "no such file on that system", str(arguments[0]))

sys.addaudithook(hook)
"""
MACHINE = """
import os, socket, sys
from vrx_mj.cli.bench import child_cost
from vrx_mj.drive.pilot import Terminal
from vrx_mj.foreign.confinement import _limit as limit
from vrx_mj.ros.network import addresses, interface_addresses, is_local
from vrx_mj.ros.limits import _most_connections as allowed
from vrx_mj.ros.network import who_listens
from vrx_mj.runtime.limits import core_share, free_memory, process_memory, thread_count, total_memory
with socket.create_server(("127.0.0.1", 0)) as server, Terminal() as terminal:
    assert f"process {os.getpid()} (" in who_listens(server.getsockname()[1])
    assert list(terminal.pressed_keys()) == []
assert all(map(is_local, interface_addresses()))
assert child_cost([sys.executable, "-c", "sum(range(10_000_000))"])[0] > 0.02
assert 5e7 < process_memory() < total_memory()
assert 0 < free_memory() <= total_memory()
assert allowed() > 0 and core_share()[0] >= thread_count() >= 1
limit(1 << 30, 60)
print(*interface_addresses())
"""


@pytest.fixture
def system(request, tmp_path):
    """A folder of PYTHONPATH that makes of a Python one of that system."""
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(SITE.format(lacking=LACKING[request.param]), encoding="utf-8")
    return request.param, tmp_path / "site"


@pytest.mark.parametrize("system", LACKING, indirect=True)
def test_figures_of_the_machine_are_known_on_every_system(system):
    done = subprocess.run(
        [sys.executable, "-c", MACHINE],
        env=environment([system[1]]),
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    here = {one.address for entries in psutil.net_if_addrs().values() for one in entries}
    assert set(done.stdout.split()) <= here


@pytest.mark.nightly
@pytest.mark.parametrize("system", LACKING, indirect=True)
def test_runs_are_recorded_read_served_and_tried_on_every_system(system, tmp_path):
    _, site = system
    recorded = vrx(*RUN, "--record", "run.rrd", cwd=tmp_path, python_path=[site])
    assert recorded[0] == 0, recorded[2]
    assert vrx("compare", "run.rrd", "run.rrd", cwd=tmp_path, python_path=[site])[0] == 0
    served = vrx("serve", "ocean", "--rosbridge", "0", "--duration", "2.5", cwd=tmp_path, python_path=[site])
    assert served[0] == 0, served[2]
    sizes = [float(size) for size in re.findall(r"(\d+) MB, ", served[1] + served[2])]
    assert sizes
    assert all(50.0 < size < 2000.0 for size in sizes)
    doctor = vrx("doctor", cwd=tmp_path, python_path=[site])
    assert (doctor[0], "Traceback" in doctor[2]) == (0, False)
    words = ("campaign", "vrx_mj.control:Captain", "--worlds", "stationkeeping_task", "--seeds", "1")
    tried = vrx(*words, "--duration", "2", "-o", "campaign", cwd=tmp_path, python_path=[site])
    assert tried[0] == 0, tried[2]
