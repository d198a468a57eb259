"""The thread in which networks live, what they report, and which process holds a port."""

import asyncio
import concurrent.futures
import contextlib
import errno
import logging
import os
import shlex
import threading
import time
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

import psutil

from vrx_mj.errors import LONGEST_LINE, shortened

_Result = TypeVar("_Result")
_CLOSING = 2.0
"""Wall time that what still runs has to end [s]."""


class Network:
    """An event loop in a daemon thread."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="vrx_mj network", daemon=True)
        self._thread.start()

    def call(self, work: Coroutine[object, None, _Result], timeout: float) -> _Result:
        """Run a coroutine there, and wait for its result; TimeoutError after so long [s]. Not from the loop itself."""
        future = asyncio.run_coroutine_threadsafe(work, self.loop)
        try:
            return future.result(timeout)
        except concurrent.futures.TimeoutError:
            future.cancel()
            raise

    def soon(self, function: Callable[..., object], *arguments: object) -> None:
        """Have a function called there; nothing happens once it is closed."""
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(function, *arguments)

    def close(self) -> None:
        """End all that runs there, and the thread."""
        if not self._thread.is_alive():
            return
        with contextlib.suppress(TimeoutError, concurrent.futures.TimeoutError):
            self.call(_end(), _CLOSING)
        self.soon(self.loop.stop)
        self._thread.join(_CLOSING)

    def _run(self) -> None:
        self.loop.run_forever()
        self.loop.close()


async def _end() -> None:
    own = asyncio.current_task()
    tasks = [task for task in asyncio.all_tasks() if task is not own]
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


_SHOWN = 120
"""Characters of a command that are shown, at most."""


def who_listens(port: int) -> str | None:
    """Who listens on a TCP port, since when, and how to stop it; None where nobody does, or nobody can be found."""
    try:
        found = [one.pid for one in psutil.net_connections("tcp") if _listens(one, port)]
    except psutil.AccessDenied:  # macOS shows the connections of one's own processes alone, one by one
        every = psutil.process_iter(["net_connections"])
        found = [each.pid for each in every if any(_listens(one, port) for one in each.info["net_connections"] or ())]
    if not found:
        return None
    pid = next(filter(None, found), None)
    return "a process of another user; 'sudo ss -ltnp' shows it" if pid is None else shown_process(pid)


def refusal(what: str, host: str, port: int, error: Exception) -> str:
    """Why a TCP port cannot be listened on."""
    if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
        return f"{what}: port {port} of {host} is taken by {who_listens(port) or 'an unknown program'}"
    reason = os.strerror(error.errno) if isinstance(error, OSError) and error.errno else str(error)
    return f"{what}: port {port} of {host} cannot be opened: {reason or 'it timed out'}"


def _listens(connection: Any, port: int) -> bool:
    return bool(connection.status == psutil.CONN_LISTEN and connection.laddr.port == port)


def shown_process(pid: int) -> str:
    """A process of this machine, since when it runs, and how to stop it."""
    stop = f"to stop it: kill {pid}"
    try:
        known = psutil.Process(pid).as_dict(["cmdline", "create_time"])
    except (psutil.Error, ValueError):  # `pid` may be any number that another node gave
        return f"process {pid} (already ended); {stop}"
    text = shlex.join(known["cmdline"] or ())
    line = "".join(character if character.isprintable() else "?" for character in text)
    shown = line if len(line) <= _SHOWN else f"{line[: _SHOWN - 3]}..."
    started = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(known["create_time"]))
    return f"process {pid} ({shown}), since {started}; {stop}"


_MOST_NOTICES = 1000
"""Different notices that are remembered; once there are so many, no new ones are written."""

_logger = logging.getLogger("vrx_mj.ros")


class Notices:
    """Lines for Python's log `vrx_mj.ros` and for a listener."""

    def __init__(self) -> None:
        self.listener: Callable[[str, str], None] | None = None
        """Takes the level, `INFO`, `WARN` or `ERROR`, and the text."""
        self._written: set[tuple[str, str]] = set()

    def write(self, level: str, kind: str, who: str, text: str) -> None:
        """Write a line, unless one of this kind about the same peer was written."""
        if (kind, who) in self._written or len(self._written) >= _MOST_NOTICES:
            return
        self._written.add((kind, who))
        line = shortened(text, LONGEST_LINE)  # parts of it come from unknown publishers
        _logger.log({"INFO": logging.INFO, "WARN": logging.WARNING}.get(level, logging.ERROR), "%s", line)
        if self.listener is not None:
            self.listener(level, line)

    def forget(self, kind: str, who: str) -> None:
        """Let a line of this kind be written again."""
        self._written.discard((kind, who))
