"""Which process listens at a port, and since when: from /proc, where there is one."""

import contextlib
import os
import time
from pathlib import Path

__all__ = ["listener", "shown_process"]

PROC = Path("/proc")
LISTENING = "0A"
"""A socket's state in /proc/net/tcp."""


def listener(port: int) -> int | None:
    """The process that listens at a port of this machine; None if it cannot be told."""
    inodes = set()
    for table in ("tcp", "tcp6"):
        with contextlib.suppress(OSError):
            for line in (PROC / "net" / table).read_text("ascii").splitlines()[1:]:
                columns = line.split()
                if columns[3] == LISTENING and int(columns[1].rpartition(":")[2], 16) == port:
                    inodes.add(f"socket:[{columns[9]}]")
    folders = [folder for folder in PROC.glob("[0-9]*") if inodes] if PROC.is_dir() else []
    return next((int(folder.name) for folder in folders if inodes & _sockets(folder)), None)


def shown_process(pid: int) -> str:
    """`pid 4711 (roscore), since 2026-07-01 12:00:00; stop it with: kill 4711`, as far as it can be told."""
    text = f"pid {pid}"
    try:
        command = (PROC / str(pid) / "cmdline").read_bytes().replace(b"\0", b" ").decode("utf-8", "replace").strip()
        ticks = int((PROC / str(pid) / "stat").read_text("utf-8").rpartition(")")[2].split()[19])
        boot = next(line for line in (PROC / "stat").read_text("ascii").splitlines() if line.startswith("btime"))
        began = time.localtime(int(boot.split()[1]) + ticks / os.sysconf("SC_CLK_TCK"))
        text += f" ({command[:100]}), since {time.strftime('%Y-%m-%d %H:%M:%S', began)}"
    except (OSError, ValueError, IndexError, StopIteration):
        pass  # it is another user's, or there is no /proc
    return f"{text}; stop it with: kill {pid}"


def _sockets(folder: Path) -> set[str]:
    """What a process's open files are."""
    found = set()
    with contextlib.suppress(OSError):
        for file in (folder / "fd").iterdir():
            with contextlib.suppress(OSError):
                found.add(str(file.readlink()))
    return found
