"""What appears on the screen: progress, the summary table, warnings."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from vrx_mj.runtime.run import Summary
    from vrx_mj.runtime.simulation import Simulation

console = Console(stderr=True)
"""Messages go to stderr; what other programs may want goes to stdout."""


def warn_once() -> Callable[..., None]:
    """What prints a warning as one line, without the place in our code, and the same words only once."""
    told: set[str] = set()

    def show_warning(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if str(message) not in told:
            told.add(str(message))
            console.print(f"warning: {message}", style="yellow", markup=False, highlight=False, soft_wrap=True)

    return show_warning


@contextmanager
def watching(sim: "Simulation", duration: float) -> Iterator[Callable[[float], None]]:
    """A progress bar over simulated time [s], with the task's state and score, under the referee's lines."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} s"),
        TimeRemainingColumn(),
    )
    told = 0
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        bar = progress.add_task("sailing", total=duration)

        def tick(time: float) -> None:
            nonlocal told
            for moment, text, level in sim.task_events[told:]:
                style = "yellow" if level == "WARN" else None
                progress.console.print(f"{moment:8.2f} s  {text}", style=style, markup=False, highlight=False)
                told += 1
            progress.update(bar, completed=time, description=_standing(sim))

        yield tick


def _standing(sim: "Simulation") -> str:
    task = sim.task
    return "sailing" if task is None else f"{task['name']}: {task['state']}, score {task['score']:.2f}"


def score_line(name: str, state: str, score: float, unit: str, better: str, collisions: int, timed_out: bool) -> str:
    """A task's result in one line."""
    hits = f"{collisions} collision{'' if collisions == 1 else 's'}"
    end = ", timed out" if timed_out else ""
    return f"{name}: score {score:.4g} {unit} ({better} is better), {state}{end}, {hits}"


def print_summary(summary: "Summary") -> None:
    """The table at the end of a run."""
    head = f"{summary.world}, fleet {summary.fleet}, seed {summary.seed}"
    table = Table(title=Text(head + (" (interrupted)" if summary.interrupted else "")))
    table.add_column("boat")
    for name in ("east [m]", "north [m]", "up [m]", "heading [deg]", "way [m]"):
        table.add_column(Text(name), justify="right")
    for name, boat in summary.boats.items():
        x, y, z = boat.position
        heading = math.degrees(boat.heading)
        table.add_row(name, f"{x:.2f}", f"{y:.2f}", f"{z:.2f}", f"{heading:.1f}", f"{boat.distance:.1f}")
    out = Console()
    out.print(table)
    out.print(
        f"{summary.sim_time:g} s in {summary.wall_time:.2f} s: {summary.real_time_factor:.0f} x real time, "
        f"{summary.steps} steps",
        highlight=False,
    )
    if summary.task is not None:
        task = summary.task
        line = score_line(
            task.name, task.state, task.score, task.unit, task.better, task.num_collisions, task.timed_out
        )
        out.print(line, highlight=False, markup=False, soft_wrap=True)
    out.print(f"state_sha256 {summary.state_sha256}", highlight=False, soft_wrap=True)
