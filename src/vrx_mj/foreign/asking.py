"""Asking for what is in strangers' files: answers come from the process without rights, or from those given before."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
import warnings
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Sequence
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from vrx_mj.cache_folder import chosen_folder
from vrx_mj.errors import ConfigError, Problem, VrxError, VrxWarning
from vrx_mj.foreign.cache import is_valid, keep, kept
from vrx_mj.foreign.plain import checked, unpacked
from vrx_mj.foreign.reader import READER, ReaderError

PACKAGE = "vrx_mj"
MEMORY, SECONDS, ANSWER = 512 << 20, 10, 128 << 20
"""What a job may take unless its caller says otherwise: memory [bytes], processor time [s], bytes of the answer."""
TOGETHER, TEXT = 120, 1 << 30
"""What all jobs of a command may take: processor time [s], and bytes of what they are told and answer."""
REMEMBERED = 64 << 20
"""Bytes of answers that this process keeps."""
PACKAGES = ("numpy", "pycollada", "pyyaml", "rerun_sdk", "scipy", "trimesh", "xacro", "yourdfpy")
"""Whose versions an answer depends on."""
T = TypeVar("T")
_answers: OrderedDict[str, bytes] = OrderedDict()
_begun: ContextVar[tuple[float, int] | None] = ContextVar("begun", default=None)
"""Processor time and bytes of all jobs before the command."""


@contextlib.contextmanager
def budget() -> Iterator[None]:
    """Around a command: its jobs together have limits of time and bytes. One inside another has its budget."""
    if _begun.get() is not None:
        yield
        return
    token = _begun.set((READER.spent, READER.handled))
    try:
        yield
    finally:
        _begun.reset(token)


def ask(
    job: str, *arguments: object, returns: type[T], about: str, reads: Iterable[Path | str] = (),
    memory: int = MEMORY, seconds: int = SECONDS, answer: int = ANSWER, threads: bool = False, cached: bool = True,
) -> T:  # fmt: skip
    """What a function of ours gives in the process without rights; its warnings and errors are those of this call.

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
    module, _, function = job.partition(":")
    limits = {"memory": memory, "seconds": seconds, "answer": answer, "threads": int(threads)}
    request: dict[str, Any] = {
        "module": f"{PACKAGE}.{module}", "function": function, "arguments": _plain(arguments),
        "reads": sorted({str(Path(each).absolute()) for each in reads}), "folder": str(Path.cwd()), "limits": limits,
    }  # fmt: skip
    key = _key(request) if cached else ""
    _check_budget(about)
    found = _given_before(key) if cached else None
    if found is None:
        found = _new(request, key, about)
    return _outcome(found, returns, about)


def _check_budget(about: str) -> None:
    seconds, size = _begun.get() or (READER.spent, READER.handled)
    if READER.spent - seconds > TOGETHER:
        raise ReaderError(about, f"files before it have taken more than {TOGETHER} s of processor time")
    if READER.handled - size > TEXT:
        raise ReaderError(about, f"files before it have come to more than {TEXT >> 20} MiB")


def _plain(value: Any) -> Any:
    """Arguments with texts for paths."""
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value


def _key(request: dict[str, Any]) -> str:
    """Of all that an answer depends on but files; the current folder counts where paths are shown relative to it."""
    here = request["folder"]
    near = any(os.path.commonpath([here, each]) in {here, each} for each in request["reads"])
    text = json.dumps([{**request, "folder": here if near else "", "limits": ""}, _versions()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def _versions() -> str:
    """Of Python, of this package's sources and of what reads files."""
    package = Path(__file__).parents[1]
    sources = (entry for folder in (package, *package.rglob("*/")) for entry in os.scandir(folder))
    stamps = sorted((entry.path, entry.stat().st_mtime_ns, entry.stat().st_size)
                    for entry in sources if entry.name.endswith((".py", ".json")))  # fmt: skip
    found = (name for folder in sys.path for name in _names(folder))
    installed = sorted(name for name in found if name.endswith(".dist-info") and name.split("-")[0].lower() in PACKAGES)
    return hashlib.sha256(repr((sys.version, stamps, installed)).encode()).hexdigest()


def _names(folder: str) -> list[str]:
    """What is in a folder of modules; some are not there, or archives."""
    try:
        return os.listdir(folder)  # noqa: PTH208 - names alone
    except OSError:
        return []


@cache
def _folder() -> Path | None:
    return chosen_folder("answers").folder


def _given_before(key: str) -> dict[str, Any] | None:
    """The answer of a key, if all that it came from is as it was."""
    folder = _folder()
    block = _answers.get(key) or (kept(folder, key) if folder else None)
    if block is None:
        return None
    found: dict[str, Any] = unpacked(block)
    if not is_valid(found["files"]):
        return None
    _remember(key, block)
    return found


def _remember(key: str, block: bytes) -> None:
    READER.handled += len(block)
    _answers[key] = block
    _answers.move_to_end(key)
    while len(_answers) > 1 and sum(map(len, _answers.values())) > REMEMBERED:
        _answers.popitem(last=False)


def _new(request: dict[str, Any], key: str, about: str) -> dict[str, Any]:
    """The answer of the process, which is kept if it is one of a key."""
    block = READER.answer(request, about)
    try:
        found: dict[str, Any] = unpacked(block)
    except ValueError as error:
        raise ReaderError(about, f"the answer of its reader is {error}") from None
    if "fault" in found:
        raise ReaderError(about, str(found["fault"]))
    if key and found["files"] is not None:
        _remember(key, block)
        if folder := _folder():
            keep(folder, key, block)
    return found


def _outcome(found: dict[str, Any], returns: type[T], about: str) -> T:
    """What was returned, after the warnings; or what was raised."""
    try:
        for text in found["warnings"]:
            warnings.warn(VrxWarning(text), stacklevel=3)
        if "error" in found:
            raise _error(*found["error"])
        return checked(found["value"], returns)
    except (ValueError, KeyError, TypeError) as error:
        raise ReaderError(about, f"the answer of its reader is damaged: {str(error).splitlines()[0]}") from None


def _error(name: str, arguments: Sequence[Any]) -> VrxError:
    """An error of a class by its name, or its message alone where that is not loaded."""
    kinds, waiting = {VrxError.__name__: VrxError}, [VrxError]
    while waiting:
        below = waiting.pop().__subclasses__()
        kinds |= {kind.__name__: kind for kind in below}
        waiting += below
    if name == ConfigError.__name__:
        return ConfigError(checked(arguments[0], tuple[Problem, ...]))
    return kinds.get(name, VrxError)(*arguments)
