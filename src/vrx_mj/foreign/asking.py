"""Asking for what is in strangers' files: answers come from the sandboxed process, or from those given before.

The sandboxed process is started when first needed, watched, and ended.
"""

import atexit
import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import sysconfig
import threading
import time
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import TypeVar

from vrx_mj.cache_folder import chosen_folder
from vrx_mj.errors import ConfigError, Problem, VrxError, warn
from vrx_mj.foreign import child
from vrx_mj.foreign.child import LENGTH, STATUS, block_from
from vrx_mj.foreign.confinement import state
from vrx_mj.foreign.plain import Answer, Job, Limits, pack, unpack, validate
from vrx_mj.outputs import write_file

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
PACKAGE = "vrx_mj"
_MEMORY, _SECONDS, ANSWER = 512 << 20, 10, 128 << 20
"""Limits of a job unless its caller gives others: memory [bytes], processor time [s], bytes of the answer."""
TOGETHER = {TIME: 120, TEXT: 1 << 10, NOTES: 100_000}
"""Limits on all files of a command together: processor time of reading, text of questions and answers, and notes, which
are warnings and rows of the table of an import."""
_REMEMBERED = 64 << 20
"""Bytes of answers that this process keeps."""
PACKAGES = ("numpy", "pycollada", "pyyaml", "rerun_sdk", "scipy", "trimesh", "xacro", "yourdfpy")
"""Packages whose versions an answer depends on."""
_T = TypeVar("_T")
MAX_KEPT = 256 << 20
"""Largest size of the answers that are kept [bytes]; the oldest are removed first."""
_DIGEST = 32
"""Bytes of the digest in front of a file."""


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
            reasons.append(f"more than {most >> 20} MiB")
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
            return f"its reader was killed by {signal.Signals(-code).name}"
    return f"its reader exited with code {code}"


_answers: OrderedDict[str, bytes] = OrderedDict()
_begun: ContextVar[Mapping[str, float] | None] = ContextVar("begun", default=None)
"""Totals of `READER.spent` at the start of the budget."""


@contextlib.contextmanager
def budget() -> Iterator[None]:
    """Limit what all files read inside of it take together; an inner budget is the outer one."""
    if _begun.get() is not None:
        yield
        return
    token = _begun.set(dict(READER.spent))
    try:
        yield
    finally:
        _begun.reset(token)


def ask(
    job: str, *arguments: object, returns: type[_T], about: str, reads: Iterable[Path | str] = (),
    memory: int = _MEMORY, seconds: int = _SECONDS, answer: int = ANSWER, threads: bool = False, cached: bool = True,
) -> _T:  # fmt: skip
    """Return what a function of ours returns in the sandboxed process, with its warnings and errors.

    Args:
        job: the function, as "formats.urdf.mesh_file:mesh". Its module is imported there alone.
        arguments: plain data; paths become texts.
        returns: the type of what it returns: dataclasses of plain data and arrays.
        about: what is read, for messages: "mesh hull.stl".
        reads: folders and files below which it may read.
        memory: it may take [bytes].
        seconds: of processor time that it may take.
        answer: bytes that its answer may have.
        threads: whether it may start threads.
        cached: whether an answer that was given before will do, and this one may be kept.

    Raises:
        ReaderError: it took too much, or ended.
        VrxError: what it raises, of the same class if that is loaded here.
    """
    request = _job(job, arguments, reads)
    request["limits"] = {"memory": memory, "seconds": seconds, "answer": answer, "threads": threads}
    key = _key(request) if cached else ""
    spend(about, notes=0)
    found = _cached_answer(key) if cached else None
    if found is None:
        block, found = _fresh_answer(request, about)
        if key and found.get("files") is not None:
            _keep(key, block)
    return _outcome(found, returns, about)


def ask_ahead(job: str, calls: Iterable[Sequence[object]], about: str) -> None:
    """Ask for several calls of a function that reads no file in one question: `ask` has their answers then.

    If they take too much together there are none, and each is asked for by itself.
    """
    waiting = {_key(request): request for request in (_job(job, arguments) for arguments in calls)}
    waiting = {key: request for key, request in waiting.items() if _cached_answer(key) is None}
    if len(waiting) > 1:
        spend(about, notes=0)
        together = _job(job, ())
        together["each"] = [request["arguments"] for request in waiting.values()]
        with contextlib.suppress(ReaderError):
            _, found = _fresh_answer(together, about)
            for key, answer in zip(waiting, validate(found["value"], list[dict[str, object]]), strict=True):
                _keep(key, pack({**answer, "files": {}}))


def spend(about: str, notes: int = 1) -> None:
    """Count notes on a file.

    Raises:
        ReaderError: all files of the command come to too much, in notes or in what reading them takes.
    """
    READER.spent[NOTES] += notes
    before = _begun.get() or READER.spent
    for name, most in TOGETHER.items():
        if READER.spent[name] - before[name] > most:
            raise ReaderError(about, f"the files of this command take more than {most:,} {name}")


def _job(job: str, arguments: Sequence[object], reads: Iterable[Path | str] = ()) -> Job:
    module, _, function = job.partition(":")
    return {
        "module": f"{PACKAGE}.{module}", "function": function, "arguments": arguments, "each": None,
        "reads": sorted({str(Path(each).absolute()) for each in reads}), "folder": str(Path.cwd()),
        "limits": {"memory": _MEMORY, "seconds": _SECONDS, "answer": ANSWER, "threads": False},
    }  # fmt: skip


def _key(request: Job) -> str:
    """Hash of all that an answer depends on but files; of the current folder where paths are shown relative to it."""
    here = request["folder"]
    near = any(os.path.commonpath([here, each]) in {here, each} for each in request["reads"])
    text = json.dumps(
        [{**request, "folder": here if near else "", "limits": ""}, _versions()], sort_keys=True, default=os.fspath
    )
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def _versions() -> str:
    """Hash of the versions of Python, of this package's sources and of the packages that read files."""
    package = Path(__file__).parents[1]
    sources = (entry for folder in (package, *package.rglob("*/")) for entry in os.scandir(folder))
    stamps = sorted((entry.path, entry.stat().st_mtime_ns, entry.stat().st_size)
                    for entry in sources if entry.name.endswith((".py", ".json")))  # fmt: skip
    found = (file.name for folder in sys.path for file in Path(folder).glob("*.dist-info"))
    installed = sorted(name for name in found if name.split("-")[0].lower() in PACKAGES)
    return hashlib.sha256(repr((sys.version, stamps, installed)).encode()).hexdigest()


@cache
def _folder() -> Path | None:
    return chosen_folder("answers").folder


def _cached_answer(key: str) -> Answer | None:
    """The answer of a key, if all that it came from is as it was."""
    folder = _folder()
    block = _answers.get(key) or (stored_answer(folder, key) if folder else None)
    if block is None:
        return None
    found: Answer = unpack(block)
    if not is_valid(found["files"] or {}):
        return None
    READER.spent[TEXT] += len(block) / (1 << 20)
    _remember(key, block)
    return found


def _keep(key: str, block: bytes) -> None:
    _remember(key, block)
    if folder := _folder():
        keep(folder, key, block)


def _remember(key: str, block: bytes) -> None:
    _answers[key] = block
    _answers.move_to_end(key)
    while len(_answers) > 1 and sum(map(len, _answers.values())) > _REMEMBERED:
        _answers.popitem(last=False)


def _fresh_answer(request: Job, about: str) -> tuple[bytes, Answer]:
    """The answer of the process, packed and unpacked."""
    block = READER.answer(request, about)
    try:
        found: Answer = unpack(block)
    except ValueError as error:
        raise ReaderError(about, f"the answer of its reader is {error}") from None
    if "fault" in found:
        raise ReaderError(about, str(found["fault"]))
    return block, found


def _outcome(found: Answer, returns: type[_T], about: str) -> _T:
    """Give the warnings of an answer, then return its value or raise its error."""
    spend(about, notes=len(found["warnings"]))
    try:
        for text in found["warnings"]:
            warn(text, 3)
        if "error" in found:
            raise _error(*found["error"])
        return validate(found["value"], returns)
    except (ValueError, KeyError, TypeError) as error:
        raise ReaderError(about, f"the answer of its reader is damaged: {str(error).splitlines()[0]}") from None


def _error(name: str, arguments: object) -> VrxError:
    """An error of a class by its name, or its message alone where that is not loaded."""
    kinds, waiting = {VrxError.__name__: VrxError}, [VrxError]
    while waiting:
        below = waiting.pop().__subclasses__()
        kinds |= {kind.__name__: kind for kind in below}
        waiting += below
    if name == ConfigError.__name__:
        return ConfigError(*validate(arguments, tuple[tuple[Problem, ...]]))
    return kinds.get(name, VrxError)(*validate(arguments, list[object]))


_trimmed: list[Path] = []
"""Folders from which this process has removed what was too old."""


def is_valid(files: Mapping[str, tuple[str, str]]) -> bool:
    """Whether all paths are as they were."""
    return all(state(use, path) == before for path, (use, before) in files.items())


def stored_answer(folder: Path, key: str) -> bytes | None:
    """The answer of a key; None without a whole one."""
    with contextlib.suppress(OSError):
        content = (folder / key).read_bytes()
        if hashlib.blake2b(content[_DIGEST:], digest_size=_DIGEST).digest() == content[:_DIGEST]:
            os.utime(folder / key)
            return content[_DIGEST:]
    return None


def keep(folder: Path, key: str, answer: bytes) -> None:
    """Keep an answer whole, or not at all; a full disk is no error. The first of a process removes the oldest."""
    content = hashlib.blake2b(answer, digest_size=_DIGEST).digest() + answer
    with contextlib.suppress(OSError, VrxError):
        write_file(folder / key, content, "an answer")
        if not _trimmed:
            _trimmed.append(folder)
            _trim(folder)


def _trim(folder: Path) -> None:
    """Remove the oldest files until those that are left are small enough."""
    with os.scandir(folder) as entries:
        found = sorted((entry.stat().st_mtime_ns, entry.stat().st_size, entry.path) for entry in entries)
    total = sum(size for _, size, _ in found)
    for _, size, path in found:
        if total <= MAX_KEPT:
            return
        total -= size
        with contextlib.suppress(OSError):
            Path(path).unlink()
