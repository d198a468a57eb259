"""How much work Python does, in calls: the same on any machine, however loaded it is."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def calls_at_most(most: int) -> Iterator[None]:
    """Around code of this thread: it makes at most so many calls of Python's and of built-in functions."""
    count = 0

    def counted(_frame: object, event: str, _called: object) -> None:
        nonlocal count
        count += event in {"call", "c_call"}

    before = sys.getprofile()
    sys.setprofile(counted)
    try:
        yield
    finally:
        sys.setprofile(before)
    assert count <= most, f"{count} calls, more than {most}"
