"""Modules that Windows lacks, None there, which are imported nowhere else; and what the C library does."""

import ctypes
from importlib import import_module
from pathlib import Path
from typing import Any

__all__ = ["release_memory", "resource", "termios", "tty"]


def _module(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        return None


resource, termios, tty = map(_module, ("resource", "termios", "tty"))


DONTNEED = 4
"""The advice of madvise by which a page of a file that was not changed is given back until it is needed again."""


def release_memory() -> None:
    """Give freed memory back where the C library keeps it, as glibc does, and on Linux code until it runs again."""
    if resource is not None and hasattr(library := ctypes.CDLL(None), "malloc_trim"):
        library.malloc_trim(0)
        maps = Path("/proc/self/maps")
        for line in maps.read_text(encoding="utf-8", errors="replace").splitlines() if maps.exists() else ():
            span, mode, _, _, file, *_ = line.split()
            if mode == "r-xp" and file != "0":  # what was compiled in memory is in no file
                begin, end = (int(address, 16) for address in span.split("-"))
                library.madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), DONTNEED)
