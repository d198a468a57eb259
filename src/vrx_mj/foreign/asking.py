"""Asking for what is in strangers' files: answers come from the sandboxed process, or from those given before."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
import warnings
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import TypeVar

from vrx_mj.cache_folder import chosen_folder
from vrx_mj.errors import ConfigError, Problem, VrxError, VrxWarning
from vrx_mj.foreign.cache import is_valid, keep, stored_answer
from vrx_mj.foreign.plain import Answer, Job, pack, unpack, validate
from vrx_mj.foreign.reader import NOTES, READER, TEXT, TIME, ReaderError

PACKAGE = "vrx_mj"
_MEMORY, _SECONDS, ANSWER = 512 << 20, 10, 128 << 20
"""What a job may take unless its caller says otherwise: memory [bytes], processor time [s], bytes of the answer."""
TOGETHER = {TIME: 120, TEXT: 1 << 10, NOTES: 100_000}
"""Limits on all files of a command together: processor time of reading, text of questions and answers, and notes, which
are warnings and rows of the table of an import."""
_REMEMBERED = 64 << 20
"""Bytes of answers that this process keeps."""
PACKAGES = ("numpy", "pycollada", "pyyaml", "rerun_sdk", "scipy", "trimesh", "xacro", "yourdfpy")
"""Packages whose versions an answer depends on."""
_T = TypeVar("_T")
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
    """Have some calls of a function that reads no file answered by one question: `ask` has their answers then.

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
            raise ReaderError(about, f"the files of this command come to more than {most:,} {name}")


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
            warnings.warn(VrxWarning(text), stacklevel=3)
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
