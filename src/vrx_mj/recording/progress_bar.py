"""How far a run has come: `vrx_mj.bar` or a notebook's bar, with what the task's referee says."""

import html
import math
import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from vrx_mj.arguments import as_number, check_kind
from vrx_mj.bar import Bar
from vrx_mj.errors import CommandError, shown
from vrx_mj.recording.notebook import in_notebook

if TYPE_CHECKING:
    from vrx_mj.runtime.simulation import Simulation

__all__ = ["progress", "terminal_bar"]

Tick = Callable[[float], None]
Line = Callable[[str, str], None]
REDRAWN = 0.1
"""Wall time between two drawings of a notebook's bar [s], at least."""


@contextmanager
def progress(sim: "Simulation", duration: float | None = None) -> Iterator[Tick]:
    """A bar for `vrx_mj.run(sim, duration, progress=tick)` in a notebook or a terminal; elsewhere a line every 10 s.

    Args:
        sim: the simulation that is run.
        duration: duration of the run [s]; by default the longest that `vrx_mj.run` lasts.

    Raises:
        CommandError: `sim` is not a Simulation, or the duration is not above 0.
    """
    from vrx_mj.runtime.run import planned
    from vrx_mj.runtime.simulation import Simulation

    check_kind("progress", sim, Simulation, "a simulation, as Simulation(world)")
    total = planned(sim) if duration is None else as_number(duration)
    if not 0.0 < total < math.inf:
        raise CommandError(f"invalid duration {shown(duration)}: a number of seconds above 0 is needed")
    with notebook_bar(sim, total) if in_notebook() else terminal_bar(sim, total) as tick:
        yield tick


@contextmanager
def terminal_bar(sim: "Simulation", duration: float) -> Iterator[Tick]:
    """A bar over simulated time [s], with the task's state and score, under the referee's lines."""
    with Bar("sailing", duration, "s") as bar:
        referee = _referee(sim, lambda line, level: bar.print(line, "yellow" if level == "WARN" else None))

        def tick(time: float) -> None:
            referee()
            bar.update(time, _standing(sim))

        yield tick


@contextmanager
def notebook_bar(sim: "Simulation", duration: float) -> Iterator[Tick]:
    """The same in a notebook, where it stays when the run is over; the referee's lines stand under it."""
    from IPython.display import HTML, display

    lines: list[str] = []
    referee = _referee(sim, lambda line, _level: lines.append(line))
    reached, drawn = 0.0, clock.perf_counter()

    def drawing() -> Any:
        said = f"<pre>{html.escape(chr(10).join(lines))}</pre>" if lines else ""
        text = html.escape(f"{_standing(sim) or 'sailing'}, {reached:.0f} of {duration:.0f} s")
        return HTML(f'<progress value="{reached:g}" max="{duration:g}"></progress> {text}{said}')

    def tick(time: float) -> None:
        nonlocal reached, drawn
        reached = time
        referee()
        if clock.perf_counter() - drawn > REDRAWN:
            handle.update(drawing())
            drawn = clock.perf_counter()

    handle = display(drawing(), display_id=True)
    try:
        yield tick
    finally:
        handle.update(drawing())


def _referee(sim: "Simulation", say: Line) -> Callable[[], None]:
    """What says every line of the referee once, with its level."""
    told = 0

    def tell() -> None:
        nonlocal told
        for moment, text, level in sim.task_events[told:]:
            say(f"{moment:8.2f} s  {text}", level)
            told += 1

    return tell


def _standing(sim: "Simulation") -> str:
    task = sim.task
    return "" if task is None else f"{task['name']}: {task['state']}, score {task['score']:.2f}"
