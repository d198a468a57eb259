"""Modules of the standard library that Windows lacks; None there. They are imported nowhere else."""

from importlib import import_module
from typing import Any

__all__ = ["resource", "termios", "tty"]


def _module(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        return None


resource, termios, tty = map(_module, __all__)
