"""Engines that run the trials of a campaign: workers on this machine, or on a Ray cluster."""

import logging
import os
import platform
import secrets
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from vrx_mj.campaign.manifest import code_version
from vrx_mj.campaign.plan import Cell, Trial
from vrx_mj.campaign.process import POLL_INTERVAL, signals_held, start_server
from vrx_mj.campaign.results import WHAT, Result
from vrx_mj.campaign.worker import WorkerLostError, WorkerProcess
from vrx_mj.errors import VrxError
from vrx_mj.outputs import write_files
from vrx_mj.packages import needs_extra

_MAX_RETRIES = 3
"""Largest number of times that a lost trial is run again."""
_CAMPAIGN_FILE = ".cluster"
"""File by which a node knows the campaign's folder."""
_EXCLUDED_FILES = ("*.rrd", ".git", ".venv", "__pycache__", "*.pyc")
"""Files of the current folder that no node needs."""
_PROBE_FILE, _PROBE_SIZE = ".probe", 65_536
"""A file that is written to see whether there is room, and its size [bytes]."""
_MAX_UNREAD_RESULTS = 16
"""Results that a worker may be ahead of those taken."""
_CHUNK_SIZE, _SHORT_CHUNK_SIZE = 64, 1000
"""Largest number of trials that a worker gets at a time, and the same if trials are short: a start takes as long."""
_SHORT_TRIAL = 0.1
"""Wall time of a short trial [s]."""


class ProcessPool:
    """An engine whose workers are processes of this machine."""

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs

    def open(self, root: Path) -> int:
        """Prepare to run trials in the campaign's folder `root`; returns the largest number of workers."""
        self._root, self._context = root, start_server()
        return self._jobs

    def start(self) -> WorkerProcess:
        """Start a worker, whose first result is None, when it is ready."""
        return WorkerProcess(self._context, self._root)

    def ready(self, workers: Sequence[Any]) -> Sequence[Any]:
        """The workers that have a result to take, after waiting for a moment at most."""
        return wait(workers, timeout=POLL_INTERVAL)

    def close(self) -> None:
        """Do nothing: an engine of processes has nothing left once its workers have ended."""


class RayCluster:
    """An engine whose workers are on the nodes of a Ray cluster.

    These have vrx_mj, and the campaign's folder at the same path. The files of the
    current folder go to the nodes, with controllers and worlds in it.
    """

    def __init__(self, address: str | None = None, jobs: int | None = None) -> None:
        """Choose a cluster.

        Args:
            address: of the cluster; None: that of RAY_ADDRESS, or one that is started on this machine.
            jobs: number of workers; None: one for each processor that the cluster has now.
        """
        self._address, self._jobs = address, jobs

    def open(self, root: Path) -> int:
        """Connect to the cluster.

        Raises:
            VrxError: Ray is not installed, the cluster does not exist, or the folder cannot be written to.
        """
        try:
            import ray
        except ImportError:
            raise VrxError(needs_extra("--ray", "Ray", "ray")) from None
        with suppress(AttributeError):  # a thread that prints the log of a node that dies; results say what was lost
            ray._private.worker.listen_error_messages = lambda *_: None
        self._ray, self._root, self._ticket = ray, root.resolve(), secrets.token_hex(8)
        excluded = list(_EXCLUDED_FILES)
        with suppress(ValueError):
            excluded.append(f"/{self._root.relative_to(Path.cwd()).as_posix()}/")
        named = {name: value for name, value in os.environ.items() if name.startswith("VRX_MJ_")}
        environment = {"working_dir": str(Path.cwd()), "excludes": excluded, "env_vars": named}
        try:
            ray.init(self._address, runtime_env=environment, log_to_driver=False, logging_level=logging.ERROR)
        except (ConnectionError, RuntimeError, ValueError, OSError) as error:
            token = "" if "RAY_AUTH_MODE" in os.environ else "; for one with a token set RAY_AUTH_MODE=token"
            raise VrxError(f"cannot use a Ray cluster: {error}{token}") from error
        try:
            write_files(self._root, {_CAMPAIGN_FILE: self._ticket}, WHAT)
        except VrxError:
            ray.shutdown()
            raise
        self._node = ray.get_runtime_context().get_node_id()
        self._actor = ray.remote(num_cpus=1, scheduling_strategy="SPREAD")(_NodeWorker)
        return self._jobs or max(1, int(ray.cluster_resources().get("CPU", 1)))

    def start(self) -> "_RayWorker":
        """Ask for an actor; it begins when a node has a processor for it."""
        return _RayWorker(self._ray, self._actor.remote(self._root, self._ticket, code_version()))

    def ready(self, workers: Sequence[Any]) -> Sequence[Any]:
        """The workers that have a result to take, after waiting for a moment at most.

        Raises:
            VrxError: Ray has stopped on this machine: its workers are gone, and it would never start another.
        """
        streams = {worker.stream: worker for worker in workers}
        found, _ = self._ray.wait(list(streams), timeout=POLL_INTERVAL)
        if not found and any(node["NodeID"] == self._node and not node["Alive"] for node in self._ray.nodes()):
            raise VrxError("Ray has stopped on this machine: start it again, and run the same command to continue")
        return [streams[stream] for stream in found]

    def close(self) -> None:
        """Leave the cluster, or end the one that was started."""
        with suppress(OSError):
            (self._root / _CAMPAIGN_FILE).unlink(missing_ok=True)
        self._ray.shutdown()


class _RayWorker:
    """A worker on a node, seen from here: Ray's handle of an actor, and the stream of results of its chunk."""

    def __init__(self, ray: Any, actor: Any) -> None:
        self._ray, self._actor = ray, actor
        self.submit([])

    def submit(self, chunk: Sequence[Trial]) -> None:
        options = {"num_returns": "streaming", "_generator_backpressure_num_objects": _MAX_UNREAD_RESULTS}
        self.stream = self._actor.run.options(**options).remote(list(chunk))

    def take(self) -> Result | None:
        try:
            return self._ray.get(next(self.stream))  # type: ignore[no-any-return]
        except StopIteration:
            return None
        except self._ray.exceptions.RayError as error:
            if isinstance(cause := getattr(error, "cause", None), VrxError):
                raise cause from None
            if "No module named 'vrx_mj" in str(error):
                raise VrxError(f"a node of the Ray cluster has no vrx_mj {code_version()}: install it there") from None
            raise WorkerLostError(f"Ray lost its worker: {str(error).strip().splitlines()[0]}") from None

    def close(self) -> None:
        self._ray.kill(self._actor)

    def join(self) -> None: ...


Engine = ProcessPool | RayCluster
_Worker = WorkerProcess | _RayWorker


class _NodeWorker:
    """The actor: holds a worker of this machine, with the folder of the campaign that all nodes share."""

    def __init__(self, root: Path, ticket: str, code: str) -> None:
        self._root, self._ticket, self._code = root, ticket, code
        self._worker: WorkerProcess | None = None

    def run(self, chunk: Sequence[Trial]) -> Iterator[Result]:
        if self._worker is None:
            self._check()
            self._worker = WorkerProcess(start_server(), self._root)
        else:
            self._worker.submit(chunk)
        while (result := self._worker.take()) is not None:
            yield result

    def _check(self) -> None:
        node = platform.node()
        if code_version() != self._code:
            raise VrxError(f"the node {node} has vrx_mj {code_version()}: install {self._code} there, as here")
        file = self._root / _CAMPAIGN_FILE
        if not (file.is_file() and file.read_text(encoding="utf-8") == self._ticket):
            raise VrxError(
                f"the node {node} does not have the folder '{self._root}': -o needs one that all nodes share"
            )


def run_trials(
    trials: Sequence[Trial], root: Path, engine: Engine, *, running: Callable[[int], None] = lambda _count: None
) -> Generator[Result, None, None]:
    """Run trials in the campaign's folder `root`; the result of each, once, as soon as it has ended.

    A trial that the machine lost is run again, up to three times, before it is `lost`. Closed early, by Ctrl-C too,
    this ends what is under way and removes what that has written.

    Args:
        trials: in an order in which those of one world follow each other.
        root: folder of the campaign; logs and recordings are written below it.
        engine: has the workers.
        running: is called with the number of trials under way, when that changes.

    Raises:
        VrxError: the engine cannot start workers, or the folder is full or gone.
    """
    if trials:
        yield from _Run(trials, root, engine).results(running)


class _Run:
    """Trials that wait, and those that workers have."""

    def __init__(self, trials: Sequence[Trial], root: Path, engine: Engine) -> None:
        self._waiting, self._root, self._engine = deque(trials), root, engine
        self._losses: Counter[Cell] = Counter()
        self._chunks: dict[_Worker, dict[Cell, Trial]] = {}
        """The workers, with the trials that each has not ended yet."""
        self._idle: list[_Worker] = []
        self._failed_starts, self._chunk = 0, _CHUNK_SIZE

    def results(self, running: Callable[[int], None]) -> Generator[Result, None, None]:
        self._most = min(self._engine.open(self._root), len(self._waiting))
        try:
            while self._waiting or any(self._chunks.values()):
                while len(self._chunks) < self._most:
                    with signals_held():
                        self._chunks[self._engine.start()] = {}
                self._hand_out()
                running(sum(map(bool, self._chunks.values())))
                for worker in self._engine.ready([one for one in self._chunks if one not in self._idle]):
                    yield from self._take(worker)
        finally:
            for worker in self._chunks:
                worker.close()
            for worker in self._chunks:
                worker.join()
            self._engine.close()

    def _hand_out(self) -> None:
        """Give idle workers trials: fewer at a time towards the end, so that several workers end together."""
        parts = 1 if self._most == 1 else 2 * self._most
        while self._waiting and self._idle:
            count = min(self._chunk, 1 + len(self._waiting) // parts)
            chunk = [self._waiting.popleft() for _ in range(min(count, len(self._waiting)))]
            worker = self._idle.pop()
            self._chunks[worker] = {trial.cell: trial for trial in chunk}
            worker.submit(chunk)

    def _take(self, worker: _Worker) -> Iterator[Result]:
        """Results settled by the next message of a worker: that of a trial, that it is idle, or that it has ended."""
        chunk = self._chunks[worker]
        try:
            result = worker.take()
        except WorkerLostError as error:
            del self._chunks[worker]
            worker.close()
            if chunk:
                first, *rest = (replace(trial, rows=False) for trial in chunk.values())  # one of them may have ended it
                self._waiting.extendleft(reversed(rest))
                yield from self._settle(first, Result(first.cell, "lost", error=str(error)))
            else:
                self._count_failed_start(error)
            return
        self._failed_starts = 0
        if result is None:
            self._idle.append(worker)
        else:
            self._chunk = _SHORT_CHUNK_SIZE if result.wall_time < _SHORT_TRIAL else _CHUNK_SIZE
            yield from self._settle(chunk.pop(result.cell), result)

    def _settle(self, trial: Trial, result: Result) -> Iterator[Result]:
        """The result of a trial, unless it is to be run again."""
        if result.state == "lost":
            self._losses[trial.cell] += 1
            self._check_folder()
            if self._losses[trial.cell] <= _MAX_RETRIES:
                self._waiting.appendleft(trial)
                return
        yield result

    def _check_folder(self) -> None:
        """Stop where the folder is the reason.

        Raises:
            VrxError: it cannot be written.
        """
        then = "once it can be written, the same command continues"
        if not self._root.is_dir():
            raise VrxError(f"the campaign's folder '{self._root}' is gone; {then}")
        try:
            write_files(self._root, {_PROBE_FILE: b"0" * _PROBE_SIZE}, WHAT)
            (self._root / _PROBE_FILE).unlink()
        except VrxError as error:
            raise VrxError(f"{error}; {then}") from None

    def _count_failed_start(self, error: WorkerLostError) -> None:
        self._failed_starts += 1
        if self._failed_starts > self._most + _MAX_RETRIES:
            raise VrxError(f"no worker starts: {error}")
