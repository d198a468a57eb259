"""A program beside a simulation: started by the shell, heard, and ended with all that it has started."""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from typing import IO

import psutil

from vrx_mj.errors import VrxError

_SIGNAL_TIMEOUTS = {"SIGINT": 6.0, "SIGTERM": 4.0, "SIGKILL": 2.0}
"""How a program is ended: after each signal it has so long [s]."""
MAX_ENDING_TIME = sum(_SIGNAL_TIMEOUTS.values()) + 3.0
"""Wall time that ending one takes, at most [s]."""
_POLL_INTERVAL = 0.02
"""How often it is seen whether all have ended [s]."""
MOST_OUTPUT = 10_000_000
"""Output of a program that is kept [bytes]."""
_READ_SIZE = 1 << 16
_TAIL_SIZE = 4096
"""Bytes in which the last lines are looked for."""
_MAX_SHOWN_LINES, _MAX_LINE_LENGTH = 3, 200
"""Last lines that are shown, and characters of each."""
_SET_CHILD_SUBREAPER = 36
"""Option of prctl(2)."""


class Program:
    """A line of the shell that runs in a session of its own."""

    def __init__(self, line: str, environment: Mapping[str, str], log: IO[bytes]) -> None:
        """Start it.

        Args:
            line: for /bin/sh, run in the current folder.
            environment: all of its environment variables.
            log: takes what it prints, up to a bound, from a thread.

        Raises:
            VrxError: this system has no process groups.
        """
        if not hasattr(os, "killpg"):
            raise VrxError("--exec needs the process groups of Linux or macOS")
        self._log = log
        self._tail, self._kept = b"", 0
        self._before = set(_descendants())
        self._process = subprocess.Popen(
            ["/bin/sh", "-c", line],
            env=dict(environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            bufsize=0,
            start_new_session=True,
        )
        self.group = self._process.pid
        self._reader = threading.Thread(target=self._read_output, args=(self._process.stdout,), daemon=True)
        self._reader.start()

    @property
    def code(self) -> int | None:
        """Exit code, below 0 the signal that ended it; None while it runs."""
        return self._process.poll()

    @property
    def last_lines(self) -> str:
        """The last lines that it printed, joined into one."""
        lines = [line.strip() for line in self._tail.decode("utf-8", "replace").splitlines() if line.strip()]
        return " | ".join(line[:_MAX_LINE_LENGTH] for line in lines[-_MAX_SHOWN_LINES:])

    def end(self, timeouts: Mapping[str, float] = _SIGNAL_TIMEOUTS) -> None:
        """End it and what it started, by one signal after the other; nothing happens where all have ended."""
        for name, timeout in timeouts.items():
            if self._all_ended():
                break
            self._signal(signal.Signals[name])
            deadline = time.monotonic() + timeout
            while not self._all_ended() and time.monotonic() < deadline:
                time.sleep(_POLL_INTERVAL)
        self._reader.join(1.0)

    def _signal(self, number: signal.Signals) -> None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.group, number)
        if number is signal.SIGINT:
            return  # who has left the group is ended by who started it: roslaunch's nodes by roslaunch
        for pid in self._strays():
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, number)

    def _all_ended(self) -> bool:
        self._process.poll()
        strays = [pid for pid in self._strays() if not _has_ended(pid)]
        try:
            os.killpg(self.group, 0)
        except ProcessLookupError:
            return not strays
        except PermissionError:  # what macOS raises for a group of which all have ended
            return self._process.poll() is not None and not strays
        return False

    def _strays(self) -> Iterator[int]:
        """Processes that this process and the program have started meanwhile, without the program itself."""
        return (one.pid for one in _descendants() if one.pid != self.group and one not in self._before)

    def _read_output(self, stream: IO[bytes]) -> None:
        with stream:
            while data := stream.read(_READ_SIZE):
                self._tail = (self._tail + data)[-_TAIL_SIZE:]
                self._keep(data)

    def _keep(self, data: bytes) -> None:
        room = MOST_OUTPUT - self._kept
        if room <= 0:
            return
        self._kept += len(data)
        rest = b"" if len(data) <= room else b"\n[the program printed more than is kept]\n"
        with contextlib.suppress(OSError, ValueError):
            self._log.write(data[:room] + rest)
            self._log.flush()


def signal_name(number: int) -> str:
    """The name of a signal, or its number in words."""
    return signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"


def become_subreaper() -> None:
    """Become the parent of what programs of this process leave behind, so that it can be ended; only Linux can."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def _descendants() -> list[psutil.Process]:
    """All descendants of this process, zombies included."""
    return list(psutil.Process().children(recursive=True))


def _has_ended(pid: int) -> bool:
    """Whether a process has ended; a child of ours that ended is reaped."""
    try:
        return os.waitpid(pid, os.WNOHANG)[0] == pid
    except ChildProcessError:  # no child of ours: it is looked for again
        return False
