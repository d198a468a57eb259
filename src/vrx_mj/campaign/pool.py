"""Many trials at a time, each in a process of its own, on this machine."""

from collections.abc import Callable, Generator, Sequence
from multiprocessing.connection import wait
from pathlib import Path

from vrx_mj.campaign.process import TrialProcess, start_server, undisturbed
from vrx_mj.campaign.results import Result
from vrx_mj.campaign.trial import Trial

__all__ = ["sail_all"]

LOOK = 0.25
"""How often trials are looked after [s]."""


def sail_all(
    trials: Sequence[Trial], root: Path, jobs: int, *, running: Callable[[int], None] = lambda _count: None
) -> Generator[Result, None, None]:
    """Sail trials, `jobs` of them at a time; the result of each as soon as it has ended.

    Closed early, by Ctrl-C too, it ends what is under way and removes what that has written.

    Args:
        trials: in the order in which they begin.
        root: the campaign's folder.
        jobs: how many processes there are at a time.
        running: is told how many trials are under way, when that changes.
    """
    waiting, under_way = list(reversed(trials)), list[TrialProcess]()
    try:
        context = start_server() if trials else None
        while waiting or under_way:
            while context and waiting and len(under_way) < jobs:
                with undisturbed():
                    under_way.append(TrialProcess(context, waiting.pop(), root))
            running(len(under_way))
            wait([process.sentinel for process in under_way], timeout=LOOK)
            for process in list(under_way):
                result = process.result()
                if result is not None:
                    under_way.remove(process)
                    yield result
    finally:
        for process in under_way:
            process.ask_to_end()
        for process in under_way:
            process.withdraw()
