"""The sandboxed process, seen from the process that has them: started when first needed, watched, and ended."""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import signal
import subprocess
import sys
import sysconfig
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from vrx_mj.errors import VrxError
from vrx_mj.foreign import child
from vrx_mj.foreign.child import LENGTH, STATUS, block_from
from vrx_mj.foreign.plain import Job, Limits

FORKS = hasattr(os, "fork") and sys.platform != "darwin"  # whose own libraries do not bear it
TIME, TEXT, NOTES = "s of processor time", "MiB of text", "notes and elements"
"""Units of what reading files takes."""
_TICK = 0.05
"""Wall time between two looks at the memory of the process [s]."""
CLOCK_PER_PROCESSOR_TIME = 12
"""Seconds of the clock for each of processor time, on a machine that has other work."""
_OWN_MEMORY = 256 << 20
"""Memory of a process that has read nothing yet, where it cannot fork [bytes]."""
ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "2", "TOKIO_WORKER_THREADS": "2",
    "RUST_BACKTRACE": "0", "LC_ALL": "C.UTF-8",
}  # fmt: skip
"""All that it knows of the environment: each thread's stack counts as memory."""


class ReaderError(VrxError):
    """A file that cannot be read: its reader took too much, ended, or met what it was not made for.

    `reason` is the message without the name of the file.
    """

    def __init__(self, about: str, reason: str) -> None:
        self.about, self.reason = about, reason
        super().__init__(f"{about} cannot be read: {reason}")

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        """Pickle by the arguments of the constructor."""
        return type(self), (self.about, self.reason)


class Reader:
    """The process; of several threads one at a time has it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self.spent = {TIME: 0.0, TEXT: 0.0, NOTES: 0.0}
        """Totals of all jobs so far; those that were ended count with the time that they might take."""

    def answer(self, job: Job, about: str) -> bytes:
        """The answer to a job.

        Raises:
            ReaderError: there is none.
        """
        with self._lock:
            try:
                block = json.dumps(job, default=os.fspath).encode()
                process = self._with_job(LENGTH.pack(len(block)) + block)
                with self._watcher(process, job["limits"]) as reasons:
                    pieces, status, seconds = _receive(process, job["limits"]["answer"], reasons)
                self.spent[TIME] += job["limits"]["seconds"] if status is None else seconds
                self.spent[TEXT] += (len(block) + sum(map(len, pieces))) / (1 << 20)
            except BaseException:
                self.end()
                raise
            if status == 0 and not reasons:
                if not FORKS:
                    self.end()
                return b"".join(pieces)
            ended = self.end()
            raise ReaderError(about, reasons[0] if reasons else _ending(ended if status is None else status, job))

    def _with_job(self, block: bytes) -> subprocess.Popen[bytes]:
        """The process, which has been told a job: it may have ended, for want of work."""
        for _ in range(2):
            process = self._process = self._process or start()
            assert process.stdin is not None, "its input is a pipe"
            with contextlib.suppress(OSError):
                process.stdin.write(block)
                process.stdin.flush()
                return process
            self.end()
        raise ReaderError("a file", "the process that reads it ends immediately")

    @contextlib.contextmanager
    def _watcher(self, process: subprocess.Popen[bytes], limits: Limits) -> Iterator[list[str]]:
        """End the process if it takes too long or too much memory; yields why, at the end."""
        reasons: list[str] = []
        ready = threading.Event()
        thread = threading.Thread(target=_watch, args=(process.pid, limits, ready, reasons), daemon=True)
        thread.start()
        try:
            yield reasons
        finally:
            ready.set()
            thread.join()

    def end(self) -> int:
        """End the process, and all that it started; its exit code."""
        process, self._process = self._process, None
        if process is None:
            return 0
        early = process.poll()
        kill(process.pid)
        process.kill()
        with contextlib.suppress(OSError):
            process.communicate()
        return process.returncode if early is None else early

    def forget(self) -> None:
        """Leave the process to the one from which this one was forked."""
        process, self._process, self._lock = self._process, None, threading.Lock()
        if process is not None and process.stdin is not None and process.stdout is not None:
            process.returncode = 0  # which keeps it from being waited for
            process.stdout.close()
            with contextlib.suppress(OSError):
                process.stdin.close()


READER = Reader()
atexit.register(READER.end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=READER.forget)


def start() -> subprocess.Popen[bytes]:
    """The process, which waits for a job."""
    package, paths = Path(__file__).parents[1], sysconfig.get_paths()
    own = [paths[name] for name in ("stdlib", "platstdlib", "purelib", "platlib")]
    libraries = {*own, *(each for each in sys.path if each.endswith(("-packages", "lib-dynload", ".zip")))}
    modules = [*(str(Path(each).absolute()) for each in sys.path if each), str(package.parent)]
    places = {"modules": modules, "libraries": sorted({*libraries, str(package)}), "forks": FORKS}
    block = json.dumps(places).encode()
    environment = {**ENVIRONMENT, **{name: os.environ[name] for name in ("SYSTEMROOT",) if name in os.environ}}
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", child.__file__],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment,
        cwd=Path(sys.executable).anchor, start_new_session=os.name != "nt",
    )  # fmt: skip
    assert process.stdin is not None, "its input is a pipe"
    process.stdin.write(LENGTH.pack(len(block)) + block)
    return process


def _receive(process: subprocess.Popen[bytes], most: int, reasons: list[str]) -> tuple[list[bytes], int | None, float]:
    """Pieces of an answer, the status at its end and the processor time [s].

    Without an end, or if the answer is too long, which `reasons` then says, the status is None.
    """
    assert process.stdout is not None, "its output is a pipe"
    pieces, size = list[bytes](), 0
    while piece := block_from(process.stdout):
        pieces.append(piece)
        size += len(piece)
        if size > most:
            reasons.append(f"it comes to more than {most >> 20} MiB")
            return [], None, 0.0
    status = process.stdout.read(STATUS.size)
    return (pieces, *(STATUS.unpack(status) if len(status) == STATUS.size else (None, 0.0)))


def _watch(pid: int, limits: Limits, ready: threading.Event, reasons: list[str]) -> None:
    """End the process `pid`, with the reason, if it takes too long or too much memory before it is ready."""
    late = time.monotonic() + CLOCK_PER_PROCESSOR_TIME * limits["seconds"]
    while not ready.wait(_TICK):
        if time.monotonic() > late:
            reasons.append(f"it takes more than {CLOCK_PER_PROCESSOR_TIME * limits['seconds']} s")
        elif memory(pid) > limits["memory"]:
            reasons.append(f"it takes more than {limits['memory'] >> 20} MiB of memory")
        if reasons:
            kill(pid)
            return


def memory(pid: int) -> int:
    """Memory that a process takes for a job [bytes]."""
    import psutil

    with contextlib.suppress(psutil.Error):
        process = psutil.Process(pid)
        own = process.memory_info().rss
        copies = [copy.memory_info().rss for copy in process.children()]
        return int(max(copies, default=own) - own if FORKS else own - _OWN_MEMORY)
    return 0


def kill(pid: int) -> None:
    """End a process and its copies."""
    with contextlib.suppress(OSError):
        if os.name == "nt":
            os.kill(pid, signal.SIGTERM)
        else:
            os.killpg(pid, signal.SIGKILL)


def _ending(code: int, job: Job) -> str:
    """Reason for a missing answer, from the exit code of the process."""
    limits = job["limits"]
    if code == -getattr(signal, "SIGXCPU", 24):
        return f"it takes more than {limits['seconds']} s of processor time"
    if code < 0:
        with contextlib.suppress(ValueError):
            return f"its reader was ended by {signal.Signals(-code).name}"
    return f"its reader ended with exit code {code}"
