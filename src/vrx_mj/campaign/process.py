"""Trials in processes of their own: whatever a controller does there, the campaign goes on.

Where the system can fork, processes come from one that has loaded everything, compiled kernels and the world included,
and runs no threads: a trial begins at once. As to fork and to end costs 25 ms, more than a short trial, a process goes
on with the next one after a trial that leaves nothing behind.
"""

import contextlib
import ctypes
import faulthandler
import logging
import math
import multiprocessing
import os
import pickle
import random
import shutil
import signal
import sys
import threading
import time
import warnings
from collections.abc import Iterator, MutableSequence, Sequence
from contextlib import suppress
from importlib.machinery import NamespaceLoader, SourceFileLoader
from multiprocessing.connection import Connection, wait
from multiprocessing.context import BaseContext
from pathlib import Path

import numpy as np

from vrx_mj.campaign.plan import State, Trial
from vrx_mj.campaign.program import MAX_ENDING_TIME, become_subreaper, signal_name
from vrx_mj.campaign.results import ALLOWED, END, GROUP, LOG, REACHED, TIME_UP, WHAT, Result, Stopwatch
from vrx_mj.campaign.trial import COMPILE_TIMEOUT, sail, sail_rows
from vrx_mj.outputs import check_inside
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.signals import handle_signals

_PRELOADED_MODULE = "vrx_mj.campaign.warm"
_GRACE_PERIOD = 5.0
"""A process that should have ended is killed this much later [s]."""
_MOST_LOG = 50_000_000
"""A trial that prints more than this is ended [bytes]."""
_LOG_TAIL_SIZE = 100_000
"""How much of a log is looked through for where a trial hung [bytes]."""
_START_TIMEOUT = 120.0
"""Wall time for starting a process [s]."""
POLL_INTERVAL = 0.25
"""How often trials are looked after [s]."""
_GATHER_TIME = 0.1
"""After a result, those of shorter trials are gathered for this long: to wake up costs more than to take one [s]."""
HAS_FORKSERVER = "forkserver" in multiprocessing.get_all_start_methods()
"""Whether processes can begin with what this one has loaded."""
_SIGKILL = 9
_SET_PDEATHSIG = 1
"""Option of prctl(2)."""


def start_server() -> BaseContext:
    """Context that starts processes. Where it can fork, its server has loaded everything when this returns."""
    if not HAS_FORKSERVER:
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOADED_MODULE])
    with _same_path():
        first = context.Process(target=_nothing)
        first.start()
        first.join()
    return context


def _nothing() -> None:
    """A process that ends at once."""


@contextlib.contextmanager
def _same_path() -> Iterator[None]:
    """Make new interpreters search the folders of this one for modules, in its order, through PYTHONPATH."""
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
    """Delay Ctrl-C and SIGTERM until the end: in between they would leave a process behind that nobody knows of."""
    caught: list[int] = []
    try:
        with handle_signals(("SIGINT", "SIGTERM"), caught.append):
            yield
    finally:
        for came in caught:
            signal.raise_signal(came)


class TrialProcess:
    """A trial, or several in turn or as rows, sailed in a process, in the campaign's folder `root`."""

    def __init__(
        self,
        root: Path,
        trials: Sequence[Trial],
        warm: Simulation | None = None,
        notes: Sequence[warnings.WarningMessage] = (),
        owner: Connection | None = None,
        *,
        together: bool = False,
    ) -> None:
        """Start it.

        Args:
            root: folder of the campaign.
            trials: what to sail; several are of one world and of one controller.
            warm: a simulation of its world, used where processes are forked.
            notes: warnings of compiling that world, for the log.
            owner: a connection of this process that the new one must not hold.
            together: as the rows of a batch, in place of one after the other.

        Raises:
            OSError: the folder of the campaign is gone, or cannot be written.
        """
        self._root, self._left = root, [trial.cell for trial in trials]
        if not root.is_dir():
            raise FileNotFoundError(f"the folder '{root}' is gone")
        check_inside(root, self._left[0].folder, WHAT)  # of the others their own folders alone can be links
        for cell in self._left:
            shutil.rmtree(root / cell.folder, ignore_errors=True)
        self._folder.mkdir(parents=True)
        self.is_over = self._gathers = False
        self._begun = time.monotonic()
        context = multiprocessing.get_context("fork" if HAS_FORKSERVER else "spawn")
        self._shared = context.Array("d", [self._begun + _START_TIMEOUT, COMPILE_TIMEOUT, 0.0, 0.0], lock=False)
        self._row, sent = context.Pipe(duplex=False)
        given = (warm, notes, owner) if HAS_FORKSERVER else (None, (), None)
        self._process = context.Process(  # type: ignore[attr-defined]
            target=_sail_here, args=(trials, root, self._shared, sent, together, *given)
        )
        self._process.start()
        sent.close()

    @property
    def _folder(self) -> Path:
        """Folder of the trial under way."""
        return self._root / self._left[0].folder

    def wait(self, other: Sequence[Connection]) -> bool:
        """Wait a moment for the trial to end; whether one of these other connections has something instead."""
        ends = [self._process.sentinel, *other]
        came = wait(ends, timeout=_GATHER_TIME) if self._gathers else []
        self._gathers = False
        return bool(set(other) & set(came or wait([self._row, *ends], timeout=POLL_INTERVAL)))

    def results(self) -> Sequence[Result]:
        """How those trials ended that have ended since the last call. What takes or prints too much is ended.

        When it `is_over`, trials without a result are to be sailed anew: as none went wrong that is not the first here.
        """
        late = time.monotonic() - self._shared[END]
        reason: str | None = None
        found: Sequence[Result] | None = None
        if self._row.poll():
            with suppress(EOFError, OSError):  # it ended without a result
                found = self._row.recv()
            if found and len(found) < len(self._left):
                del self._left[: len(found)]
                self._begun, self._gathers = math.nan, True
                return found
            self._process.join(_GRACE_PERIOD)
        if self._process.is_alive():
            if found is None and late <= (_GRACE_PERIOD if TIME_UP is None else 0.0):
                if not self._prints_too_much():
                    return []
                reason = f"printed more than {_MOST_LOG // 1_000_000} MB"
            elif found is None and TIME_UP is not None and self._process.pid is not None:
                os.kill(self._process.pid, TIME_UP)  # it writes to its log where it is, and ends
                self._process.join(_GRACE_PERIOD)
            self.stop()
        self._process.join()
        self._end_groups()
        self.is_over = True
        if found is None and math.isfinite(self._begun):
            hung = reason or (self._timeout_text() if late > -0.1 else None)
            state: State = "lost" if hung is None and self._process.exitcode == -_SIGKILL else "failed"
            error = f"at t = {self._shared[REACHED]:g} s: {hung or _exit_text(self._process.exitcode)}"
            took = time.monotonic() - self._begun
            return [Result(self._left[0], state, error=error, sim_time=self._shared[REACHED], wall_time=took)]
        return found or []

    def stop(self) -> None:
        """End the process and those it started; a program that sails it is ended as Ctrl-C does it."""
        if self._shared[GROUP]:
            self._process.terminate()
            self._process.join(MAX_ENDING_TIME)
        self._end_groups()
        self._process.kill()
        self._process.join()
        self._end_groups()

    def withdraw(self) -> None:
        """End the process and remove what it wrote: the trial counts as not begun."""
        self.stop()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _end_groups(self) -> None:
        """End the processes that it started, as far as it leads or reported their group."""
        _end_group(self._process.pid)
        _end_group(int(self._shared[GROUP]) or None)

    def _prints_too_much(self) -> bool:
        with contextlib.suppress(OSError):
            return (self._folder / LOG).stat().st_size > _MOST_LOG
        return False

    def _timeout_text(self) -> str:
        """The error of a trial whose time was up, with the line where it was then."""
        text = f"not finished after {self._shared[ALLOWED]:g} s of wall time"
        start = f'  File "{Path.cwd()}{os.sep}'.encode("ascii", "backslashreplace")  # as faulthandler writes it
        with contextlib.suppress(OSError):
            lines = (self._folder / LOG).read_bytes()[-_LOG_TAIL_SIZE:].splitlines()
            own = [line.removeprefix(start) for line in lines if line.startswith(start)]  # the innermost first
            text += f"; it was in {own[0].decode('unicode_escape').replace(chr(34), '')}" if own else ""
        return text


def _exit_text(code: int | None) -> str:
    """The error of a process that ended without a result."""
    if code is None or code >= 0:
        return f"the process ended with exit code {code}: the controller, or a library that it uses, ended it"
    name = signal_name(-code)
    memory = "; this happens when memory runs out" if name == "SIGKILL" else ""
    return f"the process was ended by {name}{memory}"


def _end_group(leader: int | None) -> None:
    """End what a trial has started: it leads a group of processes of its own."""
    if leader is not None and hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(leader, signal.SIGKILL)


def _sail_here(
    trials: Sequence[Trial],
    root: Path,
    shared: MutableSequence[float],
    row: Connection,
    together: bool,
    warm: Simulation | None,
    notes: Sequence[warnings.WarningMessage],
    owner: Connection | None,
) -> None:
    """Main function of the process: a group of its own, then the trials, each with its own log."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if owner is not None:
        owner.close()
    if hasattr(os, "setsid"):
        os.setsid()
    die_with_parent()
    become_subreaper()
    if TIME_UP is not None:
        faulthandler.register(TIME_UP, 2, chain=True)  # which ends it
    stopwatch, before = Stopwatch(shared), ProcessState()
    for trial in trials:
        folder = root / trial.cell.folder
        folder.mkdir(exist_ok=trial is trials[0])
        log_into(folder / LOG)
        with warnings.catch_warnings():  # those of the trial before come again
            for note in notes:
                warnings.warn_explicit(note.message, note.category, note.filename, note.lineno)
            results = sail_rows(trials, stopwatch, warm) if together else [sail(trial, folder, stopwatch, warm)]
        sys.stdout.flush()
        sys.stderr.flush()
        if trial is not trials[0] and results[0].has_failed:
            break  # another process sees whether it fails there
        row.send_bytes(pickle.dumps(results))  # of plain data: `send` looks for more
        if together or results[0].has_failed or not before.restore():
            break
    row.close()
    os._exit(0)  # nothing that the controller left running may keep it


class ProcessState:
    """Settings of the process that a controller may change, as they are now."""

    def __init__(self) -> None:
        self._modules = tuple(sys.modules)
        self._packages = {name.partition(".")[0] for name in self._modules}
        self._environ, self._folder, self._paths = dict(os.environ), Path.cwd(), sys.path[:]
        self._loggers, self._handlers = frozenset(logging.root.manager.loggerDict), logging.root.handlers[:]
        self._drawn, self._np_drawn, self._np_errors = random.getstate(), np.random.get_state(), np.geterr()  # noqa: NPY002

    def restore(self) -> bool:
        """Put it back as it was and forget modules loaded since; whether nothing is left behind.

        What modules of known packages hold, and those in machine code, would be shared; children and threads go on.
        """
        if os.environ != self._environ:
            os.environ.clear()
            os.environ.update(self._environ)
        os.chdir(self._folder)
        sys.path[:] = self._paths
        logging.root.handlers[:] = self._handlers
        for name in logging.root.manager.loggerDict.keys() - self._loggers:
            del logging.root.manager.loggerDict[name]
        random.setstate(self._drawn)
        np.random.set_state(self._np_drawn)  # noqa: NPY002
        np.seterr(**self._np_errors)
        known = len(self._modules)
        if (now := tuple(sys.modules))[:known] != self._modules:
            return False
        for name in now[known:]:
            loader = getattr(getattr(sys.modules[name], "__spec__", None), "loader", None)
            if name.partition(".")[0] in self._packages or not isinstance(loader, SourceFileLoader | NamespaceLoader):
                return False
            del sys.modules[name]
        with contextlib.suppress(ChildProcessError):
            os.waitpid(-1, os.WNOHANG)
            return False
        return threading.active_count() == 1


def die_with_parent() -> None:
    """Ask the system to end this process when its parent ends in any way; Linux only."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


def log_into(file: Path) -> None:
    """Redirect everything that this process prints, native code included, into a file."""
    with file.open("wb") as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    sys.stdout = open(1, "w", encoding="utf-8", errors="replace", buffering=1, closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", encoding="utf-8", errors="replace", buffering=1, closefd=False)  # noqa: SIM115
    faulthandler.enable(sys.stderr)
