"""The thread in which networks live, what they report, and which process holds a port."""

import asyncio
import concurrent.futures
import contextlib
import logging
import os
import shlex
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from pathlib import Path
from typing import TypeVar

__all__ = ["Network", "Notices", "shown_process", "who_listens"]

Result = TypeVar("Result")
CLOSING = 2.0
"""Wall time that what still runs has to end [s]."""


class Network:
    """An event loop in a daemon thread."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="vrx_mj network", daemon=True)
        self._thread.start()

    def call(self, work: Coroutine[object, None, Result], timeout: float) -> Result:
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
            self.call(_end(), CLOSING)
        self.soon(self.loop.stop)
        self._thread.join(CLOSING)

    def _run(self) -> None:
        self.loop.run_forever()
        self.loop.close()


async def _end() -> None:
    own = asyncio.current_task()
    tasks = [task for task in asyncio.all_tasks() if task is not own]
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


PROC = Path("/proc")
LISTENING = "0A"
"""A socket's state in /proc/net/tcp."""
SHOWN = 120
"""Characters of a command that are shown, at most."""


def who_listens(port: int, proc: Path = PROC) -> str | None:
    """Who listens on a TCP port, since when, and how to stop it; None where nobody does, or nobody can be found."""
    owners = dict(_sockets(port, proc))
    if not owners:
        return None
    for pid in _processes(proc):
        if not owners.keys().isdisjoint(_sockets_of(pid, proc)):
            return shown_process(pid, proc)
    user = next(iter(owners.values()))
    return f"a process of the user {_user(user)} that this user may not inspect; 'sudo ss -ltnp' shows it"


def _sockets(port: int, proc: Path) -> Iterator[tuple[str, int]]:
    """Inode and user of every socket that listens there."""
    for file in ("tcp", "tcp6"):
        try:
            lines = (proc / "net" / file).read_text(encoding="ascii").splitlines()[1:]
        except OSError:
            continue
        for fields in map(str.split, lines):
            if fields[3] == LISTENING and int(fields[1].rpartition(":")[2], 16) == port:
                yield fields[9], int(fields[7])


def _processes(proc: Path) -> list[int]:
    return sorted(int(entry.name) for entry in proc.iterdir() if entry.name.isdigit())


def _sockets_of(pid: int, proc: Path) -> Iterator[str]:
    """Inodes of a process's sockets, of those that may be read."""
    try:
        files = list((proc / str(pid) / "fd").iterdir())
    except OSError:
        return
    for file in files:
        try:
            target = str(file.readlink())
        except OSError:  # closed in between
            continue
        if target.startswith("socket:["):
            yield target[len("socket:[") : -1]


def shown_process(pid: int, proc: Path = PROC) -> str:
    """A process of this machine, since when it runs, and how to stop it."""
    return f"process {pid} ({_command(pid, proc)}){_since(pid, proc)}; to stop it: kill {pid}"


def _command(pid: int, proc: Path) -> str:
    try:
        raw = (proc / str(pid) / "cmdline").read_bytes()
    except OSError:
        return "already ended"
    text = shlex.join(part.decode("utf-8", "replace") for part in raw.rstrip(b"\0").split(b"\0"))
    line = "".join(character if character.isprintable() else "?" for character in text)
    return line if len(line) <= SHOWN else f"{line[: SHOWN - 3]}..."


def _since(pid: int, proc: Path) -> str:
    """When it was started, by this machine's clock."""
    try:
        stat = (proc / str(pid) / "stat").read_text(encoding="utf-8", errors="replace")
        uptime = float((proc / "uptime").read_text(encoding="ascii").split()[0])
    except OSError:
        return ""
    ticks = int(stat.rpartition(")")[2].split()[19])  # field 22 of proc(5), after a name that may hold anything
    started = time.time() - uptime + ticks / os.sysconf("SC_CLK_TCK")
    return f", since {time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(started))}"


def _user(number: int) -> str:
    import pwd  # not on Windows, where there is no /proc either

    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return str(number)


MOST_NOTICES = 1000
"""Different notices that are remembered; once there are so many, no new ones are written."""
LONGEST_NOTICE = 500
"""Characters of a notice: parts of it come from unknown_publishers."""

_logger = logging.getLogger("vrx_mj.ros")


class Notices:
    """Lines for Python's log `vrx_mj.ros` and for a listener."""

    def __init__(self) -> None:
        self.listener: Callable[[str, str], None] | None = None
        """Takes the level, `INFO`, `WARN` or `ERROR`, and the text."""
        self._written: set[tuple[str, str]] = set()

    def write(self, level: str, kind: str, who: str, text: str) -> None:
        """Write a line, unless one of this kind about the same peer was written."""
        if (kind, who) in self._written or len(self._written) >= MOST_NOTICES:
            return
        self._written.add((kind, who))
        line = "".join(letter if letter.isprintable() else "?" for letter in text[:LONGEST_NOTICE])
        _logger.log({"INFO": logging.INFO, "WARN": logging.WARNING}.get(level, logging.ERROR), "%s", line)
        if self.listener is not None:
            self.listener(level, line)

    def forget(self, kind: str, who: str) -> None:
        """Let a line of this kind be written again."""
        self._written.discard((kind, who))
