"""Who holds a port on this machine, read from Linux's /proc: for errors that say how to get it back."""

import os
import shlex
import time
from collections.abc import Iterator
from pathlib import Path

__all__ = ["who_listens"]

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
            return _told(pid, proc)
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


def _told(pid: int, proc: Path) -> str:
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
