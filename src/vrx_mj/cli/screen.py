"""Output on the screen: errors, warnings, tables. Messages go to stderr, results to stdout."""

import math
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from vrx_mj.bar import in_color
from vrx_mj.packages import shell_word

if TYPE_CHECKING:
    from rich.text import Text

    from vrx_mj.runtime.run import Summary


def is_watched() -> bool:
    """Whether messages go to a terminal."""
    return sys.stderr.isatty()


def show(text: str, color: str | None = None, *, result: bool = False) -> None:
    """Print a message, or a line of the result, in a color where that is a terminal."""
    stream = sys.stdout if result else sys.stderr
    stream.write(f"{in_color(text, color) if stream.isatty() else text}\n")
    stream.flush()


def show_error(text: str) -> None:
    """Print what is wrong."""
    show(text, "red")


def warn_once() -> Callable[..., None]:
    """A function that prints a warning as one line, without the place in our code, and the same words only once."""
    shown: set[str] = set()

    def show_warning(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if str(message) not in shown:
            shown.add(str(message))
            show(f"warning: {message}", "yellow")

    return show_warning


def score_line(name: str, kind: str, state: str, score: float | None, collisions: int, timed_out: bool) -> str:
    """The result of a task of a kind in one line."""
    from vrx_mj.tasks import TASK_KINDS
    from vrx_mj.tasks.referee import score_text

    meaning, hits = TASK_KINDS[kind], f"{collisions} collision{'' if collisions == 1 else 's'}"
    end = "finished, timed out" if timed_out else "finished" if state == "finished" else f"cut while {state}"
    return f"{name}: {score_text(state, score, meaning.unit)} ({meaning.better} is better), {end}, {hits}"


def pace_text(factor: float) -> str:
    """How much faster than real time a run was."""
    return f"{factor:.0f} x real time" if factor >= 10.0 else f"{factor:.2g} x real time"


def print_summary(summary: "Summary") -> None:
    """The table at the end of a run."""
    from vrx_mj.model.boats import boat_label
    from vrx_mj.recording.notebook import POSE

    head = f"{summary.world}, fleet {summary.fleet}, seed {summary.seed}"
    columns, boats = (*POSE, "distance [m]"), list[tuple[str, ...]]()
    for name, boat in summary.boats.items():
        angles = math.degrees(boat.heading), boat.heading_compass, boat.course_compass
        metres = [f"{value:z.2f}" for value in boat.position]
        turns = (f"{angle:z.1f}" for angle in angles)
        boats.append((boat_label(name, boat.robot), *metres, *turns, f"{boat.distance:.1f}"))
    print_table(head + " (interrupted)" * summary.interrupted, ("boat",), columns, boats)
    pace = pace_text(summary.real_time_factor)
    show(f"{summary.sim_time:g} s in {summary.wall_time:.2f} s: {pace}, {summary.steps} steps", result=True)
    if (task := summary.task) is not None:
        line = score_line(task.name, task.type, task.state, task.score, task.num_collisions, task.timed_out)
        show(line, result=True)
    if summary.touches:
        names = ("times", "force [N]", "lasting [s]", "first [s]")
        rows = [
            (one.boat, one.other, str(one.count), f"{one.force:.0f}", f"{one.duration:.1f}", f"{one.time:.1f}")
            for one in summary.touches
        ]
        print_table("touches of the whole run, with the largest force", ("boat", "touches"), names, rows)
    for line in (*summary.warnings, f"state_sha256 {summary.state_sha256}"):
        show(line, result=True)


def print_table(title: str, left: Sequence[str], right: Sequence[str], rows: Iterable[Sequence["str | Text"]]) -> None:
    """Print a table of texts, whose first columns are aligned at the left, the others at the right."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(title), title_justify="left")
    for number, name in enumerate((*left, *right)):
        table.add_column(Text(name), justify="left" if number < len(left) else "right", overflow="fold")
    for row in rows:
        table.add_row(*(Text(cell) if isinstance(cell, str) else cell for cell in row))
    Console().print(table)


def to_open(recording: Path) -> str:
    """The command that opens a recording, to be pasted into a shell."""
    return f"to open it: {program()} replay {shell_word(str(recording))}"


def program() -> str:
    """The name that starts this program: `vrx-mj` where the shell finds it, else the path that was typed."""
    typed = Path(sys.argv[0])
    if typed.stem != "vrx-mj" or not typed.is_file():
        return "vrx-mj"
    found = shutil.which("vrx-mj")
    return "vrx-mj" if found and typed.samefile(found) else shell_word(str(typed))
