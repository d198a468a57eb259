"""One job in the sandboxed process: what its function returns, warns and raises, and from which files."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module

from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.foreign.cache import state
from vrx_mj.foreign.confinement import confine, lock_calls, lock_files
from vrx_mj.foreign.plain import Answer, Job, pack

_SYSTEM = ("/lib", "/lib64", "/usr/lib", "/usr/lib64", "/etc/ld.so.cache", "/proc/self/status")
"""Where native libraries are that an import may load, and what says how much memory this process has."""


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
