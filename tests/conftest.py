"""Tiers, a home of the tests' own, kernels that are compiled once, and what was skipped.

`pytest` runs all that is not marked `slow`; `-m quick` physics, config, mjcf and runtime; `-m slow` the rest.

Kernels compile at their first call, which is no reason to fail an example for being slow. A property gets 20 examples,
with `--hypothesis-profile=thorough` 500.
"""

import gc
import os
import shutil
import signal
import site
import subprocess
import sys
import tempfile
import time
from collections import Counter
from functools import cache
from itertools import groupby
from pathlib import Path
from time import process_time  # a test may put another clock in the module

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: workers' own threads wait for each other, busily

import psutil
import pytest
from hypothesis import settings
from hypothesis.configuration import set_hypothesis_home_dir
from numba.core import event

settings.register_profile("thorough", deadline=None, database=None, max_examples=500)
settings.register_profile("everyday", settings.get_profile("thorough"), max_examples=20)
settings.load_profile("everyday")

TESTS = Path(__file__).parent
QUICK = tuple(TESTS / "unit" / name for name in ("physics", "config", "formats", "mjcf", "runtime"))
LENGTHY = {"test_kernel.py", "test_yaml_text.py", "test_wamv_sensors.py", "test_xacro_bombs.py"}
"""Files in those folders that take a quarter of their time."""
LONGEST = (
    "[tutorial_one_boat.md]",
    "::test_a_larger_share_of_everything_is_used_or_refused",
    "[tutorial_many_boats.md]",
    "[ros.md]",
    "test_what_a_thread_does_compiles_for_the_processor",
    "test_catkin_workspace.py",
    "test_campaign_on_ray.py",
    "test_packaging.py",
    "test_kernel_cache.py",
    "test_ros_bags.py",
    "test_prepared_sensors.py",
)
"""Parts of the names of the slow tests that take longest, the longest first."""
EVERY_CASE_BY_DAY = {
    "test_an_example_runs_and_its_controller_goes_on_after_the_end",
    "test_every_key_of_every_kind_changes_the_world_or_is_refused",
    "test_what_is_lost_is_told",
    "test_what_is_read_changes_what_comes_out",
}
"""Slow tests whose cases are other files or keys, of which each may break alone."""
WORK, MOST_WORK = "processor time", 2.0
"""A property of reports [s], and how much a test that is not slow may take."""
COMPILED = event.RecordingListener()
"""What numba compiles."""
event.register("numba:compile", COMPILED)
WITH_A_CASE_BY_DAY = set()
"""Slow tests of which one case is collected."""
SANDBOX, COMPILERS = pytest.StashKey[Path](), pytest.StashKey[list[subprocess.Popen]]()
COMPILING = "VRX_MJ_TESTS_COMPILING"
"""Processes that compile kernels, for the workers, which wait for them before their first test."""
SANDBOX_VARIABLE = "VRX_MJ_TESTS"
"""Names the sandbox; whatever the tests start inherits it."""


@pytest.fixture(autouse=True, scope="session")
def _profile_was_noticed():
    """No test is the one that gets the notice of worlds without a profile, of which a process has one."""
    from vrx_mj.config import world  # after the home is set

    world._NOTICED.append("tests")


def pytest_configure(config):
    """Give the tests, and all that they start, a home and a temporary folder that are removed at the end."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs ignore it, and so would what they start
    if SANDBOX_VARIABLE not in os.environ:  # a worker's are its parent's
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # the sandbox is removed then too
        sandbox = Path(tempfile.mkdtemp(prefix="vrx_mj-tests-")).resolve()
        config.stash[SANDBOX] = sandbox
        os.environ.update(_variables(config, sandbox))
        for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_RUNTIME_DIR"):
            os.environ.pop(name, None)
        tempfile.tempdir = None  # read TMPDIR anew
        if getattr(config.option, "numprocesses", None) and config.args_source is config.ArgsSource.TESTPATHS:
            config.stash[COMPILERS] = _compilers()
            os.environ[COMPILING] = " ".join(str(process.pid) for process in config.stash[COMPILERS])
    kept = config.cache.mkdir("hypothesis") if hasattr(config, "cache") else os.environ[SANDBOX_VARIABLE]
    set_hypothesis_home_dir(kept)  # it reads all of the sources, 2 s for each worker, unless it has before


def _variables(config, sandbox):
    """The environment of the tests; what is kept between runs stays where it is."""
    home, temporary = sandbox / "home", sandbox / "tmp"
    for folder in (home, temporary):
        folder.mkdir()
    made = {
        SANDBOX_VARIABLE: sandbox,
        "HOME": home,
        "USERPROFILE": home,
        "LOCALAPPDATA": home,
        "TMPDIR": temporary,
        "TEMP": temporary,
        "TMP": temporary,
        "RAY_TMPDIR": temporary,
        "PYTHONUSERBASE": site.getuserbase(),
        "NPM_CONFIG_USERCONFIG": Path.home() / ".npmrc",
        "VRX_MJ_ROS2": os.environ.get("VRX_MJ_ROS2") or Path.home() / ".cache" / "vrx_mj_ros2",
        "VRX_MJ_CACHE": os.environ.get("VRX_MJ_CACHE") or _kernels(config),
    }
    return {name: str(value) for name, value in made.items() if value}


def _kernels(config):
    """Where compiled kernels are kept: the user's cache where there is one, else pytest's."""
    kept = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "vrx_mj"
    if kept.is_dir():
        return kept
    return config.cache.mkdir("kernels") if hasattr(config, "cache") else None


def _compilers():
    """Processes that compile, while the workers collect, what nearly all tests need; none where there is a cache."""
    from vrx_mj.physics.kernel import cache_folder  # after VRX_MJ_CACHE is set

    folder = cache_folder()
    if folder is None or any(folder.iterdir()):
        return []
    program = [sys.executable, str(TESTS / "kernels.py")]
    return [subprocess.Popen([*program, group], stderr=subprocess.DEVNULL) for group in ("loops", "pictures")]


def _runs(pid):
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@pytest.hookimpl(wrapper=True)
def pytest_sessionfinish(session):
    """Fail a run whose tests have left processes behind, or whose kernels were not compiled at the start."""
    result = yield
    faults = []
    for process in session.config.stash.get(COMPILERS, []):
        faults += [f"it failed: {' '.join(process.args)}"] if process.poll() else []
        process.terminate()
        process.wait()
    left = _left_running(session.config.stash[SANDBOX]) if SANDBOX in session.config.stash else []
    faults += ["tests left processes running:", *left] if left else []
    if faults:
        session.config.get_terminal_writer().line("\n".join(["", *faults]), red=True)
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
    return result


def pytest_unconfigure(config):
    """Remove the home and the temporary folder of the tests."""
    if SANDBOX in config.stash:
        shutil.rmtree(config.stash[SANDBOX], ignore_errors=True)


def _left_running(sandbox, seconds=10.0):
    """Command lines of processes that were started by tests and do not end; Linux alone says."""
    until = time.monotonic() + seconds
    while (left := _inheritors(sandbox)) and time.monotonic() < until:
        time.sleep(0.1)
    return left


def _inheritors(sandbox):
    mark, found = f"{SANDBOX_VARIABLE}={sandbox}".encode(), []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if int(process.name) != os.getpid() and mark in (process / "environ").read_bytes().split(b"\0"):
                line = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                found += [line] if "multiprocessing.resource_tracker" not in line else []  # it ends with this process
        except OSError:  # it ended meanwhile, or is another user's
            continue
    return found


def pytest_ignore_collect(collection_path, config):
    """Leave files unread that have no test of the one tier that is wanted: reading them all takes each worker 10 s."""
    slow = dict.fromkeys(("slow", "slow and not nightly", "nightly"), _may_be_slow)
    chosen = {"quick": _is_quick, **slow}.get(config.option.markexpr)
    return (chosen is not None and collection_path.is_file() and not chosen(collection_path)) or None


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Let each worker begin to collect elsewhere: in a fresh clone each compiles its share of the files, not all."""
    report = yield
    if isinstance(collector, pytest.Directory):
        worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
        first = len(report.result) * worker // int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
        report.result = report.result[first:] + report.result[:first]
    return report


def pytest_itemcollected(item):
    """Put tests into the quick tier by their folder, and cases of a slow test after the first into the nightly one."""
    if item.get_closest_marker("slow") is not None:
        assert _may_be_slow(item.path), f"{item.nodeid}: `-m slow` finds it where its file has the words 'mark.slow'"
        test = item.path, item.originalname
        if test in WITH_A_CASE_BY_DAY and item.originalname not in EVERY_CASE_BY_DAY and not _names_nightly_cases(item):
            item.add_marker("nightly")
        WITH_A_CASE_BY_DAY.add(test)
    elif _is_quick(item.path):
        item.add_marker("quick")


def _names_nightly_cases(item):
    """Whether a test says itself which of its cases run by night."""
    values = [value for mark in item.iter_markers("parametrize") for value in mark.args[1]]
    return any(mark.name == "nightly" for value in values for mark in getattr(value, "marks", ()))


@cache
def _is_quick(path):
    return path.name not in LENGTHY and any(path.is_relative_to(folder) for folder in QUICK)


@cache
def _may_be_slow(path):
    return path.suffix == ".py" and b"mark.slow" in path.read_bytes()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Skip what draws where nothing can be drawn, and deal the tests that were chosen out to the workers."""
    items.sort(key=lambda item: item.nodeid.partition("::")[0])  # in whatever order the files were collected
    if any(item.get_closest_marker("render") for item in items):
        from needs import EGL, needs

        for item in items:
            if item.get_closest_marker("render"):
                item.add_marker(needs(EGL))
    _deal(items, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Search for no garbage meanwhile: there is none, and it takes a fifth of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_finish():
    """Leave the tests themselves, about a million objects, out of all that later searches for garbage, now rarer."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(2000, 10, 50)
    while any(_runs(int(pid)) for pid in os.environ.get(COMPILING, "").split()):
        time.sleep(0.1)


def _deal(items, workers):
    """Sort tests into the blocks that workers begin with, of equal numbers.

    Slow tests come first, and of them those of `LONGEST`, each with another worker, or the last would go on alone.
    """
    slow, others = _split(items, lambda item: item.get_closest_marker("slow") is not None)
    longest, slow = _split(slow, lambda item: _rank(item) < len(LONGEST))
    firsts = [list(group) for _, group in groupby(sorted(longest, key=_rank), key=_rank)]
    left = len(items)
    items.clear()
    for worker in range(workers):
        own = [item for first in firsts[worker::workers] for item in first]
        due = left // (workers - worker)
        own += _taken(slow, min(due - len(own), len(slow) // (workers - worker)))
        for pool in (others, slow):
            own += _taken(pool, due - len(own))
        items += own
        left -= len(own)


def _taken(pool, number):
    """So many tests from the front of a pool, removed from it."""
    taken = pool[: max(number, 0)]
    del pool[: len(taken)]
    return taken


def _rank(item):
    """Place of a slow test in `LONGEST`; after all of them if it is not there."""
    return next((k for k, name in enumerate(LONGEST) if name in item.nodeid), len(LONGEST))


def _split(items, condition):
    """Those that meet a condition, and the others."""
    return [item for item in items if condition(item)], [item for item in items if not condition(item)]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    """Keep the processor time that a test takes, unless kernels are compiled in it, which any other may pay."""
    begun, compiled = process_time(), len(COMPILED.buffer)
    try:
        return (yield)
    finally:
        if len(COMPILED.buffer) == compiled:
            item.user_properties.append((WORK, process_time() - begun))


def pytest_terminal_summary(terminalreporter):
    """Which tests are slow and not marked so; how many were skipped, why, and what to install to run them."""
    passed = [report for report in terminalreporter.stats.get("passed", []) if "slow" not in report.keywords]
    work = {report.nodeid: dict(report.user_properties).get(WORK, 0.0) for report in passed}
    long = sorted((name for name in work if work[name] > MOST_WORK), key=work.get, reverse=True)
    if long:
        terminalreporter.write_sep("=", f"{len(long)} not marked slow, above {MOST_WORK:g} s of processor time")
    for name in long:
        terminalreporter.write_line(f"{work[name]:4.1f} s {name}")
    _say_skipped(terminalreporter)


def _say_skipped(terminalreporter):
    reports = terminalreporter.stats.get("skipped", [])
    if not reports:
        return
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in reports)
    terminalreporter.write_sep("=", f"{len(reports)} tests skipped")
    for reason, number in reasons.most_common():
        terminalreporter.write_line(f"{number:4d} {reason}")
