"""One job in the process without rights: what its function returns, warns and raises, and from which files."""

from __future__ import annotations

import encodings.aliases
import os
import pkgutil
import warnings
from importlib import import_module
from typing import Any

from vrx_mj.errors import VrxError, VrxWarning
from vrx_mj.foreign.cache import states
from vrx_mj.foreign.confinement import confine
from vrx_mj.foreign.plain import packed

for found in pkgutil.iter_modules(encodings.__path__):  # XML may be in any
    if found.name.startswith(("ascii", "cp125", "idna", "iso8859", "latin", "utf_")):
        import_module(f"encodings.{found.name}")


def answer(job: dict[str, Any], libraries: list[str]) -> bytes:
    """The block with what a job comes to: `value`, `error` or `fault`, `warnings` and `files`."""
    try:
        os.chdir(job["folder"])
        function = getattr(import_module(job["module"]), job["function"])
        notes = confine(job["reads"], libraries, job["limits"])
        found = outcome(function, job["arguments"])
        with notes.silent():
            found["files"] = states(notes.paths) if notes.unchanged() else None
        return packed(found)
    except BaseException as error:  # whatever a file makes of a reader
        return packed({"fault": fault(error)})


def outcome(function: Any, arguments: list[Any]) -> dict[str, Any]:
    """What a function returns or raises, and its warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", VrxWarning)
        try:
            found: dict[str, Any] = {"value": function(*arguments)}
        except VrxError as error:
            found = {"error": [type(error).__name__, error.__reduce__()[1]]}
    return {**found, "warnings": [str(one.message) for one in caught]}


def fault(error: BaseException) -> str:
    """What went wrong, in one line."""
    if isinstance(error, MemoryError):
        return "it takes too much memory"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    words = str(error).strip().splitlines()
    return f"{type(error).__name__}: {words[0]}" if words else type(error).__name__
