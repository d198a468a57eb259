"""Calls from one file of the sources to another, counted: `python tests/crossings.py [WORLD]`, from any folder."""

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType

from figures import SOURCE
from vrx_mj import compile_world

Calls = Counter[tuple[str, str]]


def calls_between_files(run: Callable[[], object]) -> Calls:
    """How often `run` calls from each file (below `src/vrx_mj`; "" outside of it) to each other one there."""
    root = str(SOURCE)
    found: Calls = Counter()

    def count(frame: FrameType, event: str, _: object) -> None:
        called = frame.f_code.co_filename
        if event == "call" and called.startswith(root):
            caller = frame.f_back.f_code.co_filename if frame.f_back else ""
            found[caller, called] += caller != called

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        run()
    finally:
        sys.setprofile(before)
    named: Calls = Counter()
    for (caller, called), times in found.items():
        named[_name(caller), _name(called)] += times
    return +named


def _name(file: str) -> str:
    path = Path(file)
    return path.relative_to(SOURCE).as_posix() if path.is_relative_to(SOURCE) else ""


def crossings(calls: Calls) -> int:
    """Calls from a file of the sources to another one of them."""
    return sum(times for (caller, _), times in calls.items() if caller)


if __name__ == "__main__":
    calls = calls_between_files(lambda: compile_world(next(iter(sys.argv[1:]), "example_course")))
    print(f"{crossings(calls):,} calls from one file to another")
    for (caller, called), times in calls.most_common(20):
        print(f"{times:8,} {caller or '(outside)'} -> {called}")
