"""Processes that try inputs, watched from outside: one that dies, hangs or grows is ended and replaced."""

import contextlib
import faulthandler
import multiprocessing
import os
import signal
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path

import psutil

from fuzz.kind import Kind
from fuzz.trial import CRASH, HANG, MEMORY, Limits, Result, Trials, peak_memory

Job = tuple[str, int, int]
"""Kind, seed and number of an input."""
GRACE = 0.5
"""Processor time [s] over the limit at which an input is ended: it may still end by itself, with its figures."""
GLANCE = 0.02
"""Wall time between two looks at the workers [s]."""
RENEWED = 400
"""Inputs after which a worker is replaced, so that what they leave behind stays small."""


@dataclass
class Worker:
    """A process with one input at a time."""

    process: multiprocessing.process.BaseProcess
    pipe: Connection
    folder: Path
    job: Job | None = None
    begun: float = 0.0
    """Wall time at which its input was handed over."""
    spent: float = 0.0
    """Processor time that it had then taken [s]."""
    done: int = 0

    def give(self, job: Job) -> None:
        """Hand an input over."""
        self.job, self.begun, self.spent = job, time.monotonic(), processor_time(self.process.pid or 0)
        self.pipe.send(job)

    def verdict(self, limits: Limits) -> tuple[str, str] | None:
        """Why the input has to be ended, if so."""
        pid, waited = self.process.pid or 0, time.monotonic() - self.begun
        if (peak := peak_memory(pid)) > limits.memory:
            return MEMORY, f"{peak / 1e6:.0f} MB after {waited:.1f} s; ended"
        spent = processor_time(pid) - self.spent if waited > limits.seconds else 0.0
        if spent > limits.seconds + GRACE or waited > limits.wait:
            return HANG, f"{spent:.1f} s of processor time in {waited:.1f} s; ended"
        return None

    def end(self) -> str:
        """End it with all that it has started; what it said at the end."""
        if self.process.pid and self.process.is_alive():
            try:
                os.killpg(self.process.pid, signal.SIGKILL)
            except (OSError, AttributeError):
                self.process.kill()
        self.process.join()
        self.pipe.close()
        said = self.folder / "said.txt"
        return said.read_text("utf-8", "replace")[-3000:] if said.is_file() else ""


@dataclass
class Pool:
    """Tries jobs in some processes."""

    kinds: dict[str, Kind]
    jobs: int = 1
    limits: Limits = field(default_factory=Limits)
    kept: Callable[[Result, Path], None] = lambda _result, _folder: None
    """Is called with each bad result and the folder of its input while that is still there."""
    workers: list[Worker] = field(default_factory=list)

    def results(self, todo: Iterator[Job]) -> Iterator[Result]:
        """What became of every job, as it is known; `kinds` are warmed first, in this process, which is then forked."""
        for kind in self.kinds.values():
            kind.warm()
        with tempfile.TemporaryDirectory(prefix="vrx_mj-fuzz-") as folder:
            try:
                yield from self._results(todo, Path(folder))
            finally:
                for worker in self.workers:
                    worker.end()
                self.workers.clear()

    def _results(self, todo: Iterator[Job], folder: Path) -> Iterator[Result]:
        for number in range(self.jobs):
            worker = self._started(folder / str(number))
            self.workers.append(worker)
            if (job := next(todo, None)) is not None:
                worker.give(job)
        while any(worker.job for worker in self.workers):
            wait([worker.pipe for worker in self.workers if worker.job], timeout=GLANCE)
            for number, worker in enumerate(self.workers):
                if worker.job is None or (result := self._heard(worker)) is None:
                    continue
                yield result
                job = next(todo, None)
                if not worker.process.is_alive() or (job and self._is_used_up(worker, job)):
                    worker.end()
                    worker = self.workers[number] = self._started(folder / str(number))  # noqa: PLW2901
                worker.job = None
                if job is not None:
                    worker.give(job)

    def _is_used_up(self, worker: Worker, job: Job) -> bool:
        """Whether another process is to try the next input: servers go on beside what comes after them."""
        assert worker.job is not None
        return worker.done >= RENEWED or self.kinds[job[0]].calls != self.kinds[worker.job[0]].calls

    def _heard(self, worker: Worker) -> Result | None:
        """A worker's result, or what its death or its end by us says."""
        assert worker.job is not None
        result = None
        try:
            if worker.pipe.poll():
                result = worker.pipe.recv()
        except (EOFError, OSError):
            worker.process.join()
            code = worker.process.exitcode or 0
            name = signal.Signals(-code).name if code < 0 else f"exit {code}"
            said = worker.end()
            result = Result(*worker.job, CRASH, f"{name}{told_place(said)}", said)
        if result is None and (verdict := worker.verdict(self.limits)):
            said = self._asked(worker)
            result = Result(*worker.job, verdict[0], f"{verdict[0]}{told_place(said)}", f"{verdict[1]}\n{said}")
        if result is not None:
            worker.done += 1
            self.kept(result, worker.folder / "sandbox" / "work")
        return result

    @staticmethod
    def _asked(worker: Worker) -> str:
        """Where a worker is that has to be ended: its Python stack, if it can still say."""
        if worker.process.pid and hasattr(signal, "SIGUSR1"):
            os.kill(worker.process.pid, signal.SIGUSR1)
            time.sleep(0.1)
        return worker.end()

    def _started(self, folder: Path) -> Worker:
        ours, theirs = multiprocessing.Pipe()
        folder.mkdir(exist_ok=True)
        context = multiprocessing.get_context("fork")
        others = [worker.pipe for worker in self.workers]
        process = context.Process(target=_work, args=(self.kinds, theirs, [ours, *others], folder, self.limits))
        process.start()
        theirs.close()
        return Worker(process, ours, folder)


def _work(kinds: dict[str, Kind], pipe: Connection, others: Sequence[Connection], folder: Path, limits: Limits) -> None:
    """Try what comes through the pipe, until it is closed."""
    for other in others:
        other.close()
    os.setsid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    said = os.open(folder / "said.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    for stream in (1, 2):
        os.dup2(said, stream)
    faulthandler.enable(2)
    faulthandler.register(signal.SIGUSR1, 2)
    trials = Trials(kinds, folder / "sandbox", limits)
    try:
        while True:
            job = pipe.recv()
            os.ftruncate(said, 0)
            os.lseek(said, 0, os.SEEK_SET)
            pipe.send(trials.try_one(*job))
    except (EOFError, OSError):  # nobody is there any more
        os._exit(0)  # nor are threads of an input waited for
    except BaseException:  # a mistake of the fuzzers' own
        traceback.print_exc()
        os._exit(70)


def told_place(said: str) -> str:
    """The innermost frame of ours in the main thread's stack, as faulthandler has written it."""
    for line in said.rpartition("Current thread")[2].splitlines():
        if line.lstrip().startswith("File") and "/vrx_mj/" in line:
            name = line.split('"')[1].rpartition("/vrx_mj/")[2]
            return f" at vrx_mj/{name}:{line.rpartition('line ')[2]}"
    return ""


def processor_time(process: int) -> float:
    """Processor time that a process and its reader of strangers' files have taken [s]; 0 where it is not told.

    The reader goes on from one input to the next, and has copies of itself work: the time of those that have ended is
    the reader's, and that of a reader which has ended is nobody's.
    """
    spent = 0.0
    with contextlib.suppress(psutil.Error):
        worker = psutil.Process(process)
        spent = sum(worker.cpu_times()[:2])
        for reader in worker.children():
            spent += sum(reader.cpu_times()[:4]) + sum(sum(copy.cpu_times()[:2]) for copy in reader.children())
    return spent
