"""Modules that Windows lacks, None there, which are imported nowhere else; and what the C library does."""

import ctypes
import re
from importlib import import_module
from pathlib import Path
from typing import Any


def _module(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        return None


resource, termios, tty = map(_module, ("resource", "termios", "tty"))


_DONTNEED = 4
"""The advice of madvise by which a page of a file is given back until it is needed again; what was changed is lost."""
_CODE = re.compile(r"^(\w+)-(\w+) r-xp \S+ \S+ [1-9]\d* .*\n(?:\w+: .*\n)*?Anonymous: +0 kB$", re.MULTILINE)
"""Code of a file of which nothing was changed in memory, in Linux' list of what a process has mapped."""


def release_memory(*, code: bool = True) -> None:
    """Give freed memory back where the C library keeps it, as glibc does, and on Linux `code` until it runs again."""
    if resource is not None and hasattr(library := ctypes.CDLL(None), "malloc_trim"):
        library.malloc_trim(0)
        for begin, end in _untouched_code() if code else ():
            library.madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), _DONTNEED)


def _untouched_code() -> list[tuple[int, int]]:
    try:
        maps = Path("/proc/self/smaps").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return []
    return [(int(found[1], 16), int(found[2], 16)) for found in _CODE.finditer(maps)]
