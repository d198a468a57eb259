"""What a process does outside of its sandbox: files that it opens, makes and removes, programs, connections."""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fuzz.junk import BAIT

WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
CHANGES = {
    "os.mkdir": (1, 2), "os.rmdir": (1, 1), "os.remove": (1, 1), "os.rename": (2, 2), "os.link": (2, 2),
    "os.symlink": (2, 2),
    "os.truncate": (1, None), "os.chmod": (1, 2), "os.chown": (1, 3), "os.utime": (1, 3), "os.setxattr": (1, None),
}  # fmt: skip
"""Audit events that change files: how many of their first arguments are paths, and which is the folder's descriptor."""
FORBIDDEN = {"os.system", "os.exec", "os.posix_spawn", "pty.spawn"}
"""Programs are started by `subprocess` alone, and only this Python."""
SECRETS = ("/etc/passwd", "/etc/shadow")


class Watch:
    """An audit hook, which stays for the life of the process, and what it has seen."""

    def __init__(self) -> None:
        self.allowed: tuple[str, ...] = ()
        self.bait = ""
        self.calls = False
        self.seen: list[str] | None = None
        sys.addaudithook(self._heard)

    @contextmanager
    def over(self, sandbox: Path, writable: tuple[Path, ...], *, calls: bool) -> Iterator[list[str]]:
        """Watch what is done in the `with` statement; the list fills with what was wrong."""
        self.allowed = (*(os.path.realpath(path) for path in writable), os.devnull)
        self.bait, self.calls = os.path.realpath(sandbox / BAIT), calls
        self.seen = seen = []
        try:
            yield seen
        finally:
            self.seen = None

    def _heard(self, event: str, given: tuple[Any, ...]) -> None:
        if self.seen is None:
            return
        if event == "open":
            self._opened(*given)
        elif event in CHANGES:
            count, folder = CHANGES[event]
            for path in given[:count]:
                self._touched(event, path, given[folder] if folder is not None else -1)
        elif event in FORBIDDEN or (event == "subprocess.Popen" and str(given[0]) != sys.executable):
            self.seen.append(f"{event} {given[0]!r}")
        elif event == "socket.connect" and not self.calls and _is_own(given[1]):
            self.seen.append(f"{event} {given[1]!r}")

    def _opened(self, path: Any, mode: Any, flags: Any) -> None:
        if isinstance(path, int) or path is None:
            return
        if (isinstance(flags, int) and flags & WRITING) or (isinstance(mode, str) and set(mode) & set("wax+")):
            self._touched("open for writing", path)
            return
        real = os.path.realpath(os.fsdecode(path))
        if real in SECRETS or real.startswith(self.bait):
            self.seen.append(f"open for reading {real}")  # type: ignore[union-attr]

    def _touched(self, event: str, path: Any, folder: int = -1) -> None:
        """`path` may be relative to a folder's descriptor."""
        if isinstance(path, int) or path is None:
            return
        base = Path(f"/proc/self/fd/{folder}").resolve() if folder >= 0 else ""
        real = os.path.realpath(os.path.join(base, os.fsdecode(path)))  # noqa: PTH118
        if not any(real == place or real.startswith(place + os.sep) for place in self.allowed):
            self.seen.append(f"{event} {real}")  # type: ignore[union-attr]


def _is_own(address: Any) -> bool:
    """Whether a connection over the network is the input's: a server's thread goes on beside later inputs."""
    return threading.current_thread() is threading.main_thread() and not isinstance(address, str | bytes)


def listing(folder: Path, besides: tuple[Path, ...]) -> dict[str, tuple[int, int]]:
    """Every file below a folder with its size and time of change, `besides` some: what native code did."""
    found: dict[str, tuple[int, int]] = {}
    for here, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if Path(here, name) not in besides]
        for name in (*files, *folders):
            status = os.lstat(os.path.join(here, name))  # noqa: PTH118
            is_folder = name in folders
            found[os.path.join(here, name)] = (0, 0) if is_folder else (status.st_size, status.st_mtime_ns)  # noqa: PTH118
    return found
