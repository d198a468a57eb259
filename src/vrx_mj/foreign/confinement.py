"""The rights of a process that reads strangers' files: some folders may be read, and nothing else is allowed.

Walls, of which a system may lack all but the first: a hook of Python's own that sees what Python opens and starts,
limits of the system, Landlock, which Linux has since 5.13, for what native code opens, and a filter of its calls.
"""

import contextlib
import ctypes
import hashlib
import os
import stat
import struct
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.foreign.plain import Answer, Job, Limits, pack
from vrx_mj.unix import resource

_ALLOWED_EVENTS = {
    "_thread.start_joinable_thread", "_thread.start_new_thread", "array.__new__", "builtins.id", "code.__new__",
    "compile", "exec", "gc.get_objects", "glob.glob", "glob.glob/2", "import", "marshal.loads", "object.__getattr__",
    "object.__setattr__", "object.__delattr__", "re.compile", "sys._current_frames", "sys._getframe",
    "sys._getframemodulename", "sys.excepthook", "sys.setrecursionlimit", "sys.unraisablehook", "time.sleep",
}  # fmt: skip
"""Events of Python that are allowed; `open`, `os.listdir` and `os.scandir` are where they lead."""
_CODE = (".py", ".pyc", ".so", ".pyd")
"""Endings of files in Python's own folders that may be read: late imports."""
_FILES = 64
"""Files that may be open."""
READ, LISTED, _SEEN = "read", "listed", "seen"
"""Uses of a path: its content, the names in it, or whether it is there."""
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF, _VERSION, _PATH_BENEATH, _NO_NEW_PRIVS = 444, 445, 446, 1, 1, 38
_READ_FILE, _READ_DIR = 1 << 2, 1 << 3
_RIGHTS = {1: 13, 2: 14, 3: 15, 5: 16}
"""Rights on files, as many bits as a version of Landlock has."""
_NETWORK, _SCOPES = 3, 3
"""All rights on TCP, from version 4 on, and all scopes, from version 6 on."""
_SET_SECCOMP, _FILTER, _X86_64, _X32 = 22, 2, 0xC000003E, 0x40000000
_CALLS = {"socket": 41, "connect": 42, "execve": 59, "execveat": 322, "io_uring_setup": 425}
"""Calls of x86_64 that open a connection, start a program, or do either unseen."""
_LOAD, _EQUAL, _AT_LEAST, _RETURN = 0x20, 0x15, 0x35, 0x06
_ALLOW, _REFUSE = 0x7FFF0000, 0x00050001
_SYSTEM = ("/lib", "/lib64", "/usr/lib", "/usr/lib64", "/etc/ld.so.cache", "/proc/self/status")
"""Where native libraries are that an import may load, and what says how much memory this process has."""


class AccessLog:
    """Paths that the process accessed, each with its use and its state at that time."""

    def __init__(self) -> None:
        self.paths: dict[str, tuple[str, object]] = {}
        self._stat, self._busy = os.stat, False

    def add(self, use: str, path: str) -> None:
        """Log a path; reading outweighs looking whether it exists."""
        if use != _SEEN or path not in self.paths:
            self.paths[path] = (use, self._stamp(path))

    def _stamp(self, path: str) -> object:
        with contextlib.suppress(OSError, ValueError):
            found = self._stat(path)
            return found.st_mtime_ns, found.st_size
        return None

    def is_unchanged(self) -> bool:
        """Whether what was read and listed has not changed since."""
        return all(self._stamp(path) == stamp for path, (use, stamp) in self.paths.items() if use != _SEEN)

    def watch(self) -> None:
        """Log calls of `os.stat` and `os.lstat`, for which Python has no audit event."""

        def noting(ask: Callable[..., os.stat_result]) -> Callable[..., os.stat_result]:
            def note_and_ask(path: object, *arguments: object, **options: object) -> os.stat_result:
                if not self._busy and isinstance(path, str | os.PathLike):
                    self.add(_SEEN, os.path.join(os.getcwd(), path))  # noqa: PTH109, PTH118 - pathlib would ask again
                return ask(path, *arguments, **options)

            return note_and_ask

        os.stat, os.lstat = noting(os.stat), noting(os.lstat)

    @contextlib.contextmanager
    def silent(self) -> Iterator[None]:
        """Log nothing inside."""
        before, self._busy = self._busy, True
        try:
            yield
        finally:
            self._busy = before


def confine(folders: Sequence[str], libraries: Sequence[str], limits: Limits) -> AccessLog:
    """Take Python's rights from this process but to read below some folders; returns what it looks at.

    Args:
        folders: absolute paths.
        libraries: folders of Python's own, and of its packages.
        limits: `memory` more than now [bytes], `seconds` of processor time from now on, `threads` if any may start.
    """
    log = AccessLog()
    _limit(limits["memory"], limits["seconds"], threads=limits["threads"])
    log.watch()
    sys.addaudithook(_hook([os.path.realpath(each) for each in folders], libraries, log))
    return log


def _limit(memory: int, seconds: int, *, threads: bool = True) -> None:
    """Limit this process to so many more bytes and seconds of processor time; only where the system can.

    It writes no byte into a file, and starts no process, nor a thread without `threads`.
    """
    if resource is None:
        return
    spent = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    limits = {resource.RLIMIT_CORE: 0, resource.RLIMIT_CPU: int(spent) + seconds, resource.RLIMIT_FSIZE: 0}
    limits[resource.RLIMIT_NOFILE] = _FILES
    if not threads:
        limits[resource.RLIMIT_NPROC] = 0
    with contextlib.suppress(OSError):
        status = Path("/proc/self/status").read_text(encoding="ascii")
        held = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmData"))
        limits[resource.RLIMIT_DATA] = 1024 * held + memory
    for kind, most in limits.items():
        hard = resource.getrlimit(kind)[1]
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (least, least + 1 if kind == resource.RLIMIT_CPU and least == most else least))


def _hook(folders: Sequence[str], libraries: Sequence[str], log: AccessLog) -> Callable[[str, tuple[Any, ...]], None]:
    """Audit hook that raises PermissionError for events of Python that are not allowed."""
    writes = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if event in _ALLOWED_EVENTS:
            return
        if event not in {"open", "os.listdir", "os.scandir"}:
            raise PermissionError(f"not allowed: {event}")
        path = arguments[0]
        if event == "open" and isinstance(arguments[2], int) and arguments[2] & writes:
            raise PermissionError(13, "not allowed to write", str(path))
        if not isinstance(path, int):
            with log.silent():
                _check(event, os.path.abspath(os.fsdecode(path or ".")), folders, libraries)  # noqa: PTH100 - of any path
                log.add(READ if event == "open" else LISTED, os.path.abspath(os.fsdecode(path or ".")))  # noqa: PTH100

    return watch


def _check(event: str, path: str, folders: Sequence[str], libraries: Sequence[str]) -> None:
    """Refuse to open what is not below a folder, or no regular file."""
    real = os.path.realpath(path)
    code = event != "open" or real.endswith(_CODE)
    if not (_below(real, folders) or (code and _below(real, libraries))):
        raise PermissionError(13, "not allowed to read", path)
    with contextlib.suppress(FileNotFoundError):
        if event == "open" and not stat.S_ISREG(os.stat(real).st_mode):  # noqa: PTH116
            raise PermissionError(13, "not a file", path)


def _below(path: str, folders: Sequence[str]) -> bool:
    return any(path == folder or path.startswith(folder.rstrip(os.sep) + os.sep) for folder in folders)


def lock_files(folders: Sequence[str]) -> bool:
    """Restrict this process, native code too, to files below some folders: it opens no others and no TCP connection.

    Returns whether the system can: Linux, from 5.13 on.
    """
    if not sys.platform.startswith("linux"):
        return False
    call = ctypes.CDLL(None, use_errno=True).syscall
    if (version := call(_CREATE_RULESET, None, 0, _VERSION)) < 1:
        return False
    rights = (1 << max(bits for since, bits in _RIGHTS.items() if since <= version)) - 1
    fields = [rights] + [_NETWORK] * (version >= 4) + [_SCOPES] * (version >= 6)
    attributes = struct.pack(f"={len(fields)}Q", *fields)
    rules = call(_CREATE_RULESET, attributes, len(attributes), 0)
    for folder in folders:
        with contextlib.suppress(OSError):  # what is not there cannot be read
            handle = os.open(folder, os.O_PATH | os.O_CLOEXEC)
            allowed = _READ_FILE | (_READ_DIR if stat.S_ISDIR(os.fstat(handle).st_mode) else 0)
            call(_ADD_RULE, rules, _PATH_BENEATH, struct.pack("=Qi", allowed, handle), 0)
            os.close(handle)
    ctypes.CDLL(None).prctl(_NO_NEW_PRIVS, 1, 0, 0, 0)
    locked = rules >= 0 and call(_RESTRICT_SELF, rules, 0) == 0
    os.close(rules)
    return bool(locked)


def lock_calls() -> bool:
    """Refuse this process, native code too, sockets of any kind and new programs; only on Linux of x86_64.

    Returns whether the system can. It holds for root too.
    """
    if not sys.platform.startswith("linux") or os.uname().machine != "x86_64":
        return False
    tests = [(_AT_LEAST, _X32), *((_EQUAL, number) for number in _CALLS.values())]
    refused = [(code, len(tests) - at, 0, value) for at, (code, value) in enumerate(tests)]
    lines = [(_LOAD, 0, 0, 4), (_EQUAL, 0, len(tests) + 2, _X86_64), (_LOAD, 0, 0, 0), *refused,
             (_RETURN, 0, 0, _ALLOW), (_RETURN, 0, 0, _REFUSE)]  # fmt: skip
    program = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *line) for line in lines))
    header = struct.pack("@HP", len(lines), ctypes.addressof(program))
    prctl = ctypes.CDLL(None).prctl
    prctl(_NO_NEW_PRIVS, 1, 0, 0, 0)
    return bool(prctl(_SET_SECCOMP, _FILTER, header, 0, 0) == 0)


def state(use: str, path: str) -> str:
    """The digest of what was read of a path, or what it is."""
    try:
        found = os.stat(path)  # noqa: PTH116 - a path is a text here
        if use == READ and stat.S_ISREG(found.st_mode):
            return _content(path, (found.st_mtime_ns, found.st_size, found.st_ino))
        if use == LISTED and stat.S_ISDIR(found.st_mode):
            return hashlib.sha256("\0".join(sorted(os.listdir(path))).encode("utf-8", "surrogateescape")).hexdigest()  # noqa: PTH208
        return "folder" if stat.S_ISDIR(found.st_mode) else "file"
    except (OSError, ValueError):
        return "missing"


@lru_cache(maxsize=4096)
def _content(path: str, _stamp: tuple[int, int, int]) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def answer(job: Job, libraries: list[str]) -> bytes:
    """The block with what a job comes to: `value`, `error` or `_fault`, `warnings` and `files`."""
    try:
        os.chdir(job["folder"])
        lock_files([*job["reads"], *libraries, *_SYSTEM])  # of threads too, which imports may start
        lock_calls()
        function = getattr(import_module(job["module"]), job["function"])
        log = confine(job["reads"], libraries, job["limits"])
        if job["each"] is None:
            found = _outcome(function, job["arguments"])
        else:
            found = {"value": [_outcome(function, each) for each in job["each"]], "warnings": []}
        with log.silent():
            seen = {path: (use, state(use, path)) for path, (use, _) in log.paths.items()}
            found["files"] = seen if log.is_unchanged() else None
        return pack(found)
    except BaseException as error:  # whatever a file makes of a reader
        return pack({"fault": _fault(error, job["limits"]["memory"])})


def _outcome(function: Callable[..., object], arguments: Sequence[object]) -> Answer:
    """Call a function: what it returns or raises, and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", VrxWarning)
        try:
            found: Answer = {"value": function(*arguments), "warnings": []}
        except VrxError as error:
            found = {"error": (type(error).__name__, error.__reduce__()[1]), "warnings": []}
    found["warnings"] = [str(one.message) for one in caught]
    return found


def _fault(error: BaseException, memory: int) -> str:
    """One line about an exception."""
    if isinstance(error, MemoryError):
        return f"it takes more than {memory >> 20} MiB of memory"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    words = str(error).strip().splitlines()
    return f"{type(error).__name__}: {words[0]}" if words else type(error).__name__
