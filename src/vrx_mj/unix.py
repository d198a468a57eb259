"""Modules that Windows lacks, None there, which are imported nowhere else; and what the C library does."""

import ctypes
import re
from importlib import import_module
from io import FileIO
from pathlib import Path
from typing import Any

_DONTNEED = 4
"""The advice of madvise by which a page of a file is given back until it is needed again; what was changed is lost."""
_CODE = re.compile(rb"^(\w+)-(\w+) r-xp \S+ \S+ [1-9]", re.MULTILINE)
"""Code of a file in Linux' list of what a process has mapped."""
_CHANGED = {state for state in range(256) if state >> 6 and not state >> 5 & 1}
"""Last bytes of Linux' entries of pages that are in memory or swapped, but are not the file's."""


def _module(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        return None


resource, termios, tty = map(_module, ("resource", "termios", "tty"))


def release_memory(*, code: bool = True) -> None:
    """Give freed memory back where the C library keeps it, as glibc does, and on Linux `code` until it runs again."""
    if resource is not None and hasattr(library := ctypes.CDLL(None), "malloc_trim"):
        library.malloc_trim(0)
        for begin, end in _untouched_code() if code else ():
            library.madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), _DONTNEED)


def _untouched_code() -> list[tuple[int, int]]:
    """Begin and end of the code of each file in memory of which nothing was changed there."""
    try:
        found = [(int(code[1], 16), int(code[2], 16)) for code in _CODE.finditer(Path("/proc/self/maps").read_bytes())]
        with Path("/proc/self/pagemap").open("rb", buffering=0) as pages:
            return [(begin, end) for begin, end in found if _CHANGED.isdisjoint(_page_states(pages, begin, end))]
    except OSError:
        return []


def _page_states(pages: FileIO, begin: int, end: int) -> bytes:
    """The last byte of the entry, of eight, of each page from one address to another."""
    first, last = (8 * address // resource.getpagesize() for address in (begin, end))
    pages.seek(first)
    return pages.read(last - first)[7::8]
