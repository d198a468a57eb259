"""Workers: processes that keep a world compiled and sail trials of it, many one after the other."""

import contextlib
import gc
import os
import signal
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from pathlib import Path

from vrx_mj.campaign.manifest import controller_hash
from vrx_mj.campaign.page import sketch_of
from vrx_mj.campaign.plan import Trial
from vrx_mj.campaign.process import HAS_FORKSERVER, TrialProcess, log_into, signals_held, start_server
from vrx_mj.campaign.results import FORMAT, Result, sketch_file, write_json
from vrx_mj.campaign.trial import RaisedError, load_own_controller
from vrx_mj.errors import VrxError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.run import fingerprint, takes_rows
from vrx_mj.runtime.simulation import Simulation

_MAX_ROWS = 64
"""Rows of a batch, at most."""
_LOADING_TIMEOUT = 60.0
"""Wall time that the check of a controller waits for it [s]."""


class WorkerLostError(VrxError):
    """A worker has ended without being asked to."""


class Worker:
    """Sails trials of a campaign in processes that begin with the world compiled."""

    def __init__(self, root: Path, owner: Connection) -> None:
        """Start without a world.

        Args:
            root: folder of the campaign.
            owner: says something, or is closed, when the trial under way is to be given up.
        """
        self._root, self._owner = root, owner
        self._open: tuple[str, str | None] | None = None
        self._warm: Simulation | None = None
        self._notes: Sequence[warnings.WarningMessage] = ()
        self._repeats: dict[tuple[str, str], bool] = {}
        """Whether a controller does in a world, after another trial in its process, what it does in one of its own."""

    def run(self, chunk: Sequence[Trial]) -> Iterator[Result]:
        """Sail trials; the result of each as soon as it has ended. What the machine did to one is `lost`."""
        together: dict[object, list[Trial]] = {}
        for trial in chunk:
            alone = trial.record or trial.serving
            together.setdefault(trial.cell if alone else (trial.cell.controller, trial.cell.world), []).append(trial)
        for trials in together.values():
            count = _MAX_ROWS if trials[0].rows else len(trials)
            for first in range(0, len(trials), count):
                yield from self._sail(trials[first : first + count])

    def _sail(self, trials: Sequence[Trial]) -> Iterator[Result]:
        """Results of trials of a controller in a world: of rows, where a batch can, and else one after the other."""
        self._prepare(trials[0])
        whose = trials[0].cell.controller, trials[0].cell.world
        if trials[1:] and trials[0].rows and self._warm and not self._warm.world.parameters.task:
            results = [result for result in self._results(trials, together=True) if not result.has_failed]
            yield from results
            sailed = {result.cell for result in results}
            trials = [trial for trial in trials if trial.cell not in sailed]
            self._repeats.setdefault(whose, False)
        if trials[2:] and HAS_FORKSERVER and whose not in self._repeats:
            first, *later = self._results(trials[:2])
            yield first
            (alone,) = self._results(trials[1:2])
            yield alone
            if not first.has_failed:
                self._repeats[whose] = [replace(one, wall_time=alone.wall_time) for one in later] == [alone]
            trials = trials[2:]
        while trials:
            for result in self._results(trials if self._repeats.get(whose) else trials[:1]):
                trials = trials[1:]
                yield result

    def _results(self, trials: Sequence[Trial], *, together: bool = False) -> Iterator[Result]:
        """Results of trials that one process sails; fewer where the rest is to be sailed by another one."""
        try:
            process = TrialProcess(self._root, trials, self._warm, self._notes, self._owner, together=together)
        except OSError as error:
            text = f"cannot write '{self._root}': {error.strerror or error}"
            yield Result(trials[0].cell, "lost", error=text)
            return
        while True:
            found = process.results()
            yield from found
            if process.is_over:
                return
            if not found and process.wait([self._owner]):
                process.withdraw()
                raise SystemExit

    def _prepare(self, trial: Trial) -> None:
        """Compile the trial's world and keep its map for the page; an error of the compiler is raised in its trials."""
        wanted = trial.cell.world, trial.fleet
        if wanted == self._open:
            return
        self._open, self._warm = wanted, None
        with warnings.catch_warnings(record=True) as notes, contextlib.suppress(Exception):
            warnings.simplefilter("always")
            world = compile_world(trial.cell.world, fleet=trial.fleet)
            file = sketch_file(self._root, trial.cell.world)
            if not file.is_file():
                write_json(file, {"format": FORMAT, **sketch_of(world)})
            fingerprint()
            if trial.record:
                import vrx_mj.recording  # noqa: F401 - loaded once
            _ = world.sha256, world.numbers  # found once
            self._warm = Simulation(world)
            if trial.rows and world.parameters.task is None:
                Batch(world, 1)  # its loop is loaded once
        self._notes = notes
        gc.collect()
        gc.freeze()  # trials share this memory


class WorkerProcess:
    """A worker in a process of its own, which ends with this one."""

    def __init__(self, context: BaseContext, root: Path) -> None:
        self._connection, theirs = context.Pipe()
        arguments = (theirs, root, dict(os.environ), str(Path.cwd()))
        self._process = context.Process(target=_work, args=arguments)  # type: ignore[attr-defined]
        self._process.start()
        theirs.close()

    def fileno(self) -> int:
        """Handle that is ready when there is something to take, for `multiprocessing.connection.wait`."""
        return self._connection.fileno()

    def submit(self, chunk: Sequence[Trial]) -> None:
        """Give it trials; it must be idle."""
        with contextlib.suppress(OSError):  # `take` says so
            self._connection.send(list(chunk))

    def take(self) -> Result | None:
        """The next result; None when it is idle, as at its start.

        Raises:
            WorkerLostError: it has ended.
        """
        try:
            return self._connection.recv()  # type: ignore[no-any-return]
        except (EOFError, OSError):
            self._process.join()
            raise WorkerLostError(f"its worker ended with exit code {self._process.exitcode}") from None

    def close(self) -> None:
        """Ask it to give up what is under way and to end; `join` waits for that."""
        self._connection.close()

    def join(self) -> None:
        """Wait until it has ended."""
        self._process.join()


def _work(owner: Connection, root: Path, environ: Mapping[str, str], folder: str) -> None:
    """Main function of a worker's process: trials as they come, until its owner ends."""
    _begin_process(environ, folder)
    worker = Worker(root, owner)
    with contextlib.suppress(EOFError, OSError):
        while True:
            owner.send(None)
            for result in worker.run(owner.recv()):
                owner.send(result)


def _begin_process(environ: Mapping[str, str], folder: str) -> None:
    """Leave the terminal's group, and take over the environment of who started this process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "setsid"):
        os.setsid()
    os.environ.clear()
    os.environ.update(environ)
    os.chdir(folder)


def check_controllers(names: Sequence[str]) -> frozenset[str]:
    """The controllers that take rows; any that does not exist or takes other arguments is refused.

    Each is loaded in a process of its own, as for a trial; what it raises there is left to its trials.

    Raises:
        VrxError: one cannot be a controller.
    """
    for name in names:
        controller_hash(name)
    context, rows = start_server(), set()
    for name in names:
        faults, theirs = context.Pipe(duplex=False)
        arguments = (theirs, name, dict(os.environ), str(Path.cwd()))
        process = context.Process(target=_check_controller, args=arguments)  # type: ignore[attr-defined]
        with signals_held():
            process.start()
        theirs.close()
        try:
            if faults.poll(_LOADING_TIMEOUT):
                with contextlib.suppress(EOFError):
                    if fault := faults.recv():
                        raise VrxError(fault)
                    rows.add(name)
        finally:
            process.kill()
            process.join()
    return frozenset(rows)


def _check_controller(faults: Connection, name: str, environ: Mapping[str, str], folder: str) -> None:
    """Main function of the process that checks a controller: send its fault, or an empty text if it takes rows."""
    _begin_process(environ, folder)
    log_into(Path(os.devnull))
    try:
        if takes_rows(load_own_controller(name, 0)):
            faults.send("")
    except VrxError as error:
        if not isinstance(error, RaisedError):
            faults.send(str(error))
    os._exit(0)
