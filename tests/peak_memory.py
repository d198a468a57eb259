"""The memory that a call takes at its peak."""

import tracemalloc
from collections.abc import Callable
from typing import Any

__all__ = ["peak_memory"]


def peak_memory(call: Callable[[], Any]) -> int:
    """Bytes that Python and NumPy hold at most during a call, over those before it; what it raises is raised."""
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
