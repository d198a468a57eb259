"""Modules that Windows lacks, None there, which are imported nowhere else; and what the C library does."""

import ctypes
from importlib import import_module
from typing import Any

__all__ = ["release_memory", "resource", "termios", "tty"]


def _module(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        return None


resource, termios, tty = map(_module, ("resource", "termios", "tty"))


def release_memory() -> None:
    """Give freed memory back to the system where the C library keeps it, as glibc does."""
    if resource is not None and hasattr(library := ctypes.CDLL(None), "malloc_trim"):
        library.malloc_trim(0)
