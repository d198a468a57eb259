"""Jobs that do what a stranger's file might make a reader do."""

import ctypes
import os
import resource
import socket
import subprocess
import sys
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxWarning

OPEN = ctypes.CDLL(None).open
PROGRAM = (ctypes.c_char_p * 2)(b"true", None)
SOCKET, EXECV = ctypes.CDLL(None).socket, ctypes.CDLL(None).execv


@dataclass(frozen=True)
class Row:
    """One of each kind of plain data."""

    name: str
    numbers: FloatArray
    table: Mapping[str, tuple[int, ...]]
    place: Path | None = None
    blob: bytes = b""


def echoed(name: str, numbers: list[float], table: dict[str, list[int]]) -> Row:
    return Row(name, np.array(numbers), {key: tuple(each) for key, each in table.items()}, Path("a/b"), b"\0\xff")


def content(path: str) -> str:
    return Path(path).read_text(encoding="utf-8")


def first_there(paths: list[str]) -> str:
    return next((Path(path).read_text(encoding="utf-8") for path in paths if Path(path).is_file()), "none")


def natively(path: str) -> str:
    """What a native library would open."""
    handle = OPEN(path.encode(), os.O_RDONLY)
    return os.read(handle, 99).decode() if handle >= 0 else "refused"


def datagrams_natively() -> str:
    """What a native library would open without TCP."""
    return "opened" if SOCKET(2, 2, 0) >= 0 else "refused"


def program_natively() -> str:
    """What is left of a program that a native library would start: nothing if it can."""
    EXECV(b"/bin/true", PROGRAM)
    return "refused"


def warned() -> int:
    warnings.warn(VrxWarning("a hull of 0.1 kg"), stacklevel=2)
    return 7


def named(name: str) -> str:
    if name == "none":
        raise UnknownNameError("thruster", name, ["left", "right"])
    warnings.warn(VrxWarning(f"a hull of {name[:9]}"), stacklevel=2)
    return name


def unknowns() -> int:
    """How many names are unknown."""
    return 0


def unknown() -> int:
    raise UnknownNameError("thruster", "lef", ["left", "right"])


def refused() -> int:
    raise ConfigError([Problem("a.xacro", 3, 9, "mass", "must be positive")])


def wrong() -> int:
    raise KeyError("no such key")


def memory() -> int:
    return len(bytearray(4 << 30))


def slowly_memory() -> int:
    held = []
    while True:
        held.append(bytearray(1 << 20))


def forever() -> int:
    while True:
        pass


def asleep() -> int:
    time.sleep(1000)
    return 1


def flood() -> bytes:
    return bytes(8 << 20)


def aborts() -> int:
    os.abort()


def chunks(_file: str, _entities: list[str], _columns: list[str], _whole: bool) -> None:
    """As the parser of recordings, with a panic."""
    os.abort()


def shares(kind: str) -> str:
    """What is left of limits of the system once Python's own hook has been passed by."""
    return str(resource.getrlimit(getattr(resource, kind)))


def environment() -> dict[str, str]:
    return dict(os.environ)


def modules() -> list[str]:
    return sorted(sys.modules)


def attempt(what: str, path: str) -> str:
    """What comes of something that is not allowed."""
    attempts = {
        "write": lambda: Path(path).write_text("x", encoding="utf-8"),
        "append": lambda: Path(path).open("ab").close(),
        "create": lambda: os.close(os.open(path + "2", os.O_WRONLY | os.O_CREAT)),
        "remove": lambda: Path(path).unlink(),
        "rename": lambda: Path(path).rename(path + "2"),
        "folder": lambda: Path(path + "2").mkdir(),
        "link": lambda: Path(path + "2").symlink_to(path),
        "start": lambda: subprocess.run(["true"], check=True),
        "system": lambda: os.system("true"),
        "fork": os.fork,
        "exec": lambda: os.execv("/bin/true", ["true"]),
        "socket": lambda: socket.create_connection(("127.0.0.1", 9)),
        "name": lambda: socket.getaddrinfo("localhost", 80),
        "library": lambda: ctypes.CDLL("libm.so.6"),
        "kill": lambda: os.kill(os.getppid(), 0),
        "list": lambda: list(Path("/").iterdir()),
        "device": lambda: Path("/dev/zero").read_bytes(),
        "self": lambda: Path("/proc/self/environ").read_bytes(),
        "read": lambda: Path(path).read_bytes(),
    }  # fmt: skip
    try:
        attempts[what]()
    except PermissionError as error:
        return str(error)
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    return "done"
