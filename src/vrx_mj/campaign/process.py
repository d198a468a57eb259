"""Trials, many at a time, each in a process of its own: whatever a controller does there, the campaign goes on.

Where the system can fork, processes come from a server that has loaded everything, compiled kernels included, and runs
no threads: a trial begins at once, and shares nothing with the one before.

Trials on a Ray cluster: each task sails one trial in a process of its own, and sends back its files.

The current folder goes along, with controllers and worlds in it; vrx_mj has to be installed on the nodes.
"""

import contextlib
import faulthandler
import logging
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, MutableSequence, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import wait
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any, TypeVar

from vrx_mj.campaign.page import sketch_of
from vrx_mj.campaign.plan import Trial
from vrx_mj.campaign.program import ENDING, adopt_orphans
from vrx_mj.campaign.results import (
    ALLOWED,
    END,
    FORMAT,
    GROUP,
    LOG,
    REACHED,
    WHAT,
    Result,
    Stopwatch,
    read_result,
    sketch_file,
    write_json,
    write_result,
)
from vrx_mj.campaign.trial import INTERRUPTED, PREPARATION, sail
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.world import World
from vrx_mj.outputs import check_inside, write_files
from vrx_mj.packages import needs_extra

_PRELOADED = "vrx_mj.campaign.warm"
_GRACE = 5.0
"""A process that should have ended itself is killed this much later [s]."""
_MOST_LOG = 50_000_000
"""A trial that prints more than this is ended [bytes]."""
_TAIL = 100_000
"""How much of a log is looked through for where a trial hung [bytes]."""
_START = 120.0
"""Wall time for starting a process [s]."""


def start_server() -> BaseContext:
    """What makes the processes; where it can fork, after everything was loaded, which it waits for."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOADED])
    with _same_path():
        first = context.Process(target=_nothing)
        first.start()
        first.join()
    return context


def _nothing() -> None:
    """A process that ends at once."""


@contextlib.contextmanager
def _same_path() -> Iterator[None]:
    """Have new interpreters look for packages where this one does, in its order."""
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    try:
        yield
    finally:
        del os.environ["PYTHONPATH"]
        if before is not None:
            os.environ["PYTHONPATH"] = before


@contextlib.contextmanager
def signals_held() -> Iterator[None]:
    """Have Ctrl-C and SIGTERM wait until the end: in between they would leave a process behind that nobody knows of."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    handlers = [signal.signal(number, lambda came, _frame: caught.append(came)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, handlers, strict=True):
            signal.signal(number, handler)
        for came in caught:
            signal.raise_signal(came)


class TrialProcess:
    """A trial that is being sailed elsewhere, in the campaign's folder `root`."""

    def __init__(self, context: BaseContext, root: Path, trial: Trial) -> None:
        self.trial, self._root = trial, root
        check_inside(root, trial.cell.folder, WHAT)
        self._folder = root / trial.cell.folder
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True)
        self._begun = time.monotonic()
        self._shared = context.Array("d", [self._begun + _START, PREPARATION, 0.0, 0.0], lock=False)
        arguments = (trial, root, self._shared, dict(os.environ))
        self._process = context.Process(target=_sail_here, args=arguments)  # type: ignore[attr-defined]
        self._process.start()

    @property
    def sentinel(self) -> int:
        """What becomes ready when the process ends, for `multiprocessing.connection.wait`."""
        return int(self._process.sentinel)

    def result(self) -> Result | None:
        """How the trial ended; None while it goes on. One that takes or prints too much is ended."""
        late = time.monotonic() - self._shared[END]
        reason = None
        if self._process.is_alive():
            if late <= _GRACE and not self._prints_too_much():
                return None
            reason = None if late > _GRACE else f"printed more than {_MOST_LOG // 1_000_000} MB"
            self.stop()
        self._process.join()
        self._end_groups()
        found = read_result(self._folder)
        if found is None:
            text = reason or (self._hung() if late > -0.1 else _exit_text(self._process.exitcode))
            found = Result(
                self.trial.cell,
                "failed",
                error=f"at t = {self._shared[REACHED]:g} s: {text}",
                sim_time=self._shared[REACHED],
                wall_time=time.monotonic() - self._begun,
            )
            write_result(self._folder, found)
        return found

    def ask_to_end(self) -> None:
        """Have a program that sails the trial be ended, as Ctrl-C does it; `stop` waits for that."""
        if self._shared[GROUP]:
            self._process.terminate()

    def stop(self) -> None:
        """End the process and those it started."""
        self.ask_to_end()
        self._process.join(ENDING if self._shared[GROUP] else 0.0)
        self._end_groups()
        self._process.kill()
        self._process.join()
        self._end_groups()

    def withdraw(self) -> None:
        """End the process; unless it has just finished, remove what it wrote: the trial counts as not begun."""
        self.stop()
        found = read_result(self._folder)
        if found is None or found.error == INTERRUPTED:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _end_groups(self) -> None:
        """What the process has started, as far as it leads or reported the group."""
        _end_group(self._process.pid)
        _end_group(int(self._shared[GROUP]) or None)

    def _prints_too_much(self) -> bool:
        with contextlib.suppress(OSError):
            return (self._folder / LOG).stat().st_size > _MOST_LOG
        return False

    def _hung(self) -> str:
        """The error of a trial whose time was up, with the line where it was then."""
        text = f"not finished after {self._shared[ALLOWED]:g} s of wall time"
        start = f'  File "{Path.cwd()}{os.sep}'.encode("ascii", "backslashreplace")  # as faulthandler writes it
        with contextlib.suppress(OSError):
            lines = (self._folder / LOG).read_bytes()[-_TAIL:].splitlines()
            own = [line.removeprefix(start) for line in lines if line.startswith(start)]  # the innermost first
            text += f"; it was in {own[0].decode('unicode_escape').replace(chr(34), '')}" if own else ""
        return text


def _exit_text(code: int | None) -> str:
    """The error of a process that ended without a result."""
    if code is None or code >= 0:
        return f"the process ended with exit code {code}: the controller, or a library that it uses, ended it"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    memory = "; this happens when memory runs out" if name == "SIGKILL" else ""
    return f"the process was ended by {name}{memory}"


def _end_group(leader: int | None) -> None:
    """End what a trial has started: it leads a group of processes of its own."""
    if leader is not None and hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(leader, signal.SIGKILL)


def _sail_here(trial: Trial, root: Path, shared: MutableSequence[float], environ: Mapping[str, str]) -> None:
    """What the process does: its own group, its own log, then the trial."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "setsid"):
        os.setsid()
    os.environ.clear()
    os.environ.update(environ)
    folder = root / trial.cell.folder
    _log_into(folder / LOG)
    adopt_orphans()
    result = sail(trial, folder, Stopwatch(shared), partial(_keep_sketch, root, trial.cell.world))
    faulthandler.cancel_dump_traceback_later()
    write_result(folder, result)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)  # nothing that the controller left running may keep it


def _keep_sketch(root: Path, name: str, world: World) -> None:
    """Keep what the page's map needs, once for each world."""
    file = sketch_file(root, name)
    if not file.is_file():
        write_json(file, {"format": FORMAT, **sketch_of(world)})


def _log_into(file: Path) -> None:
    """Let everything that is printed here, by whatever, go into a file."""
    with file.open("wb") as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    sys.stdout = open(1, "w", encoding="utf-8", errors="replace", buffering=1, closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", errors="replace", buffering=1, closefd=False)  # noqa: SIM115
    faulthandler.enable(sys.stderr)


LOOK = 0.25
"""How often trials are looked after [s]."""
_Running = TypeVar("_Running")


def keep_sailing(
    trials: Sequence[Trial],
    jobs: int,
    running: Callable[[int], None],
    *,
    begin: Callable[[Trial], _Running],
    results: Callable[[Sequence[_Running]], Iterator[tuple[_Running, Result]]],
    end: Callable[[Sequence[_Running]], None],
) -> Generator[Result, None, None]:
    """Have `jobs` trials under way until all have ended; the result of each as soon as it has.

    Args:
        trials: in the order in which they begin.
        jobs: how many are under way at a time.
        running: is called with the number of trials under way, when that changes.
        begin: begins one.
        results: waits for a moment, and gives those that have ended meanwhile.
        end: ends what is under way when this is closed early, by Ctrl-C too.
    """
    waiting, under_way = list(reversed(trials)), list[_Running]()
    try:
        while waiting or under_way:
            while waiting and len(under_way) < jobs:
                with signals_held():
                    under_way.append(begin(waiting.pop()))
            running(len(under_way))
            for one, result in results(under_way):
                under_way.remove(one)
                yield result
    finally:
        end(under_way)


def sail_all(
    trials: Sequence[Trial], root: Path, jobs: int, *, running: Callable[[int], None] = lambda _count: None
) -> Generator[Result, None, None]:
    """Sail trials in the campaign's folder `root`, `jobs` of them at a time; the result of each when it has ended.

    Closed early, by Ctrl-C too, it ends what is under way and removes what that has written.
    """
    if trials:
        begin = partial(TrialProcess, start_server(), root)
        yield from keep_sailing(trials, jobs, running, begin=begin, results=_results, end=_withdraw)


def _results(under_way: Sequence[TrialProcess]) -> Iterator[tuple[TrialProcess, Result]]:
    wait([process.sentinel for process in under_way], timeout=LOOK)
    for process in list(under_way):
        result = process.result()
        if result is not None:
            yield process, result


def _withdraw(under_way: Sequence[TrialProcess]) -> None:
    for process in under_way:
        process.ask_to_end()
    for process in under_way:
        process.withdraw()


_STOP_TIMEOUT = 10.0
"""How long trials may take to stop [s]."""
_EXCLUDED_FILES = ("*.rrd", ".git", ".venv", "__pycache__", "*.pyc")
"""Files of the current folder that no node needs."""
_Files = dict[str, bytes]
_Task = tuple[Any, Trial]
"""Ray's reference to a task, and its trial."""


def sail_on_ray(
    trials: Sequence[Trial],
    root: Path,
    jobs: int | None = None,
    *,
    running: Callable[[int], None] = lambda _count: None,
) -> Generator[Result, None, None]:
    """Sail trials on the cluster that RAY_ADDRESS names, or one that is started on this machine.

    As `sail_all`; without `jobs`, as many at a time as the cluster has processors.

    Raises:
        VrxError: Ray is not installed, or the cluster does not exist.
    """
    if not trials:
        return
    ray = _connection(root)
    most = jobs or max(1, int(ray.cluster_resources().get("CPU", 1)))
    task = ray.remote(num_cpus=1, max_retries=0)(_sail_there)

    def results(under_way: Sequence[_Task]) -> Iterator[tuple[_Task, Result]]:
        ready, _ = ray.wait([reference for reference, _ in under_way], timeout=LOOK)
        for reference, trial in list(under_way):
            if reference in ready:
                yield (reference, trial), _result(ray, reference, trial, root)

    def end(under_way: Sequence[_Task]) -> None:
        references = [reference for reference, _ in under_way]
        for reference in references:
            ray.cancel(reference)
        if references:
            ray.wait(references, num_returns=len(references), timeout=_STOP_TIMEOUT)
        ray.shutdown()

    yield from keep_sailing(
        trials, most, running, begin=lambda trial: (task.remote(trial), trial), results=results, end=end
    )


def _connection(root: Path) -> Any:
    """Ray, connected to a cluster whose workers have this folder's files, without results."""
    try:
        import ray
    except ImportError:
        raise VrxError(needs_extra("--ray", "Ray", "ray")) from None
    excluded = list(_EXCLUDED_FILES)
    with suppress(ValueError):
        excluded.append(f"/{root.resolve().relative_to(Path.cwd()).as_posix()}/")
    named = {name: value for name, value in os.environ.items() if name.startswith("VRX_MJ_")}
    environment = {"working_dir": str(Path.cwd()), "excludes": excluded, "env_vars": named}
    try:
        ray.init(runtime_env=environment, log_to_driver=False, logging_level=logging.ERROR)
    except (ConnectionError, RuntimeError, ValueError, OSError) as error:
        raise VrxError(f"cannot use a Ray cluster: {error}") from error
    return ray


def _sail_there(trial: Trial) -> _Files:
    """What a task does: sail a trial in a folder that is gone afterwards; the files of that folder."""
    with tempfile.TemporaryDirectory(prefix="vrx_mj-") as folder:
        root = Path(folder)
        process = TrialProcess(start_server(), root, trial)
        try:
            while process.result() is None:
                wait([process.sentinel], timeout=LOOK)
        finally:
            process.stop()
        return {file.relative_to(root).as_posix(): file.read_bytes() for file in root.rglob("*") if file.is_file()}


def _result(ray: Any, reference: Any, trial: Trial, root: Path) -> Result:
    """The result of a task that has ended, its files put where a trial on this machine puts them."""
    cell = trial.cell
    try:
        files: _Files = ray.get(reference)
    except ray.exceptions.RayError as error:
        result = Result(cell, "lost", error=f"Ray lost the trial: {str(error).strip().splitlines()[0]}")
        write_result(root / cell.folder, result)
        return result
    sketch = sketch_file(root, cell.world)
    for name, content in sorted(files.items(), key=lambda item: item[0].endswith("result.json")):
        if root / name != sketch or not sketch.is_file():
            write_files(root, {name: content}, WHAT)
    return read_result(root / cell.folder) or Result(cell, "lost", error="Ray returned no result")
