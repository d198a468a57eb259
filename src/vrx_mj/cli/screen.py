"""What appears on the screen: progress, the summary table, warnings."""

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from vrx_mj.runtime.run import Summary

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


def progress_bar(duration: float) -> AbstractContextManager[Callable[[float], None]]:
    """A progress bar over simulated time [s]."""

    @contextmanager
    def bar() -> Iterator[Callable[[float], None]]:
        columns = (
            TextColumn("sailing"),
            BarColumn(),
            TextColumn("{task.completed:.0f} of {task.total:.0f} s"),
            TimeRemainingColumn(),
        )
        watched = console.is_terminal
        with Progress(*columns, console=console, transient=True, disable=not watched) as progress:
            task = progress.add_task("sailing", total=duration)
            yield lambda time: progress.update(task, completed=time)

    return bar()


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
    out.print(f"state_sha256 {summary.state_sha256}", highlight=False, soft_wrap=True)
