"""Notebooks: worlds and simulations that show themselves, recordings inside the page.

`import vrx_mj` registers this with IPython where one runs; nothing heavy is loaded before something is shown.
"""

import html
import math
import sys
import tempfile
import time as clock
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vrx_mj.arguments import as_number, check_kind
from vrx_mj.bar import Bar
from vrx_mj.errors import CommandError, VrxError, quote
from vrx_mj.packages import install_extra, shell_word
from vrx_mj.tasks.referee import score_text

if TYPE_CHECKING:
    from vrx_mj.mjcf.world import World
    from vrx_mj.runtime.simulation import Simulation

_MAP_SIZE = (1000, 720)
"""Width and height of a world's map [px]."""
POSE = ("x [m]", "y [m]", "z [m]", "yaw from x [deg]", "compass heading [deg]", "compass course [deg]")
"""Columns of where a boat is, in the tables of a run and of a simulation."""
REDRAW_PERIOD = 0.1
"""Least wall time between two drawings of a notebook's bar [s]."""


def register() -> None:
    """Register with IPython, if it runs in this process, to show a world as its map and a simulation as a table."""
    shell = _shell()
    if shell is None:
        return
    forms = shell.display_formatter.formatters
    forms["image/png"].for_type_by_name("vrx_mj.mjcf.world", "World", _world_map)
    forms["text/html"].for_type_by_name("vrx_mj.runtime.simulation", "Simulation", simulation_table)
    forms["text/plain"].for_type_by_name(
        "vrx_mj.runtime.simulation", "Simulation", lambda sim, printer, _cycle: printer.text(simulation_line(sim))
    )


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook, which shows more than text."""
    return getattr(_shell(), "kernel", None) is not None


def _shell() -> Any:
    """IPython's shell in this process; None where none runs. IPython itself is not loaded for it."""
    package = sys.modules.get("IPython")
    return None if package is None else package.get_ipython()


def _world_map(world: "World") -> bytes:
    """A world from above, as a PNG."""
    from vrx_mj.draw.course import map_of
    from vrx_mj.draw.map import map_png

    return map_png(map_of(world), _MAP_SIZE)


def simulation_line(sim: "Simulation") -> str:
    """World, time, seed and status of a simulation, in one line."""
    status = _status(sim, " is")
    return f"{sim.world.name} at t = {sim.time:g} s, seed {sim.seed}{status and f'; {status}'}"


def simulation_table(sim: "Simulation") -> str:
    """Where the boats of a simulation are now, as HTML."""
    head = "".join(f"<th>{name}</th>" for name in ("boat", *POSE, "speed [m/s]"))
    rows = []
    compass = sim.world.parameters.compass
    for name, boat in sim.observe().items():
        angles = math.degrees(boat.heading), compass(boat.heading), compass(boat.course)
        metres = [f"{value:.2f}" for value in boat.position]
        figures = *metres, *(f"{angle:.1f}" for angle in angles), f"{boat.speed:.2f}"
        rows.append(f"<tr>{''.join(f'<td>{text}</td>' for text in (html.escape(name), *figures))}</tr>")
    line = html.escape(simulation_line(sim))
    return f"<table><caption>{line}</caption><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def show(recording: str | Path, *, width: int | str = "auto", height: int | str = 480) -> Any:
    """Show a recording in rerun's viewer inside a notebook, as the last line of a cell.

    Args:
        recording: path of the recording (.rrd).
        width: width of the viewer [px], or "auto" for that of the cell.
        height: height of the viewer [px], or "auto".

    Raises:
        RecordError: the file does not exist, or is not a recording of vrx_mj.
        VrxError: this is not a notebook, or the extra `notebook` is not installed.
    """
    from vrx_mj.recording.reader import read_record
    from vrx_mj.recording.session import viewable

    record = read_record(recording, whole=True)
    if not in_notebook():
        command = f"vrx-mj replay {shell_word(str(recording))}"
        raise VrxError(f"show('{recording}') needs a notebook; elsewhere run: {command}")
    try:
        from rerun_notebook import Viewer
    except ModuleNotFoundError as error:
        raise VrxError(f"no module '{error.name}' to show '{recording}'; {install_extra('notebook')}") from error
    viewer = Viewer(width=width, height=height)
    with tempfile.TemporaryDirectory() as folder:
        viewer.send_rrd(viewable(record, None, Path(folder)).read_bytes())
    return viewer


_Tick = Callable[[float], None]


def progress(sim: "Simulation", duration: float | None = None) -> AbstractContextManager[_Tick]:
    """A bar for `vrx_mj.run(sim, duration, progress=tick)` in a notebook or a terminal; elsewhere a line every 10 s.

    Args:
        sim: the simulation that is run.
        duration: duration of the run [s]; by default the longest that `vrx_mj.run` lasts.

    Raises:
        CommandError: `sim` is not a Simulation, or the duration is not above 0.
    """
    from vrx_mj.runtime.run import planned_duration
    from vrx_mj.runtime.simulation import Simulation

    check_kind("progress", sim, Simulation, "a simulation, as Simulation(world)")
    total = planned_duration(sim) if duration is None else as_number(duration)
    if not 0.0 < total < math.inf:
        raise CommandError(f"invalid duration {quote(duration)}: a number of seconds above 0 is needed")
    return notebook_bar(sim, total) if in_notebook() else terminal_bar(sim, total)


@contextmanager
def terminal_bar(sim: "Simulation", duration: float) -> Iterator[_Tick]:
    """A bar over simulated time [s], with the task's state and score, under the referee's lines."""
    with Bar("sailing", duration, "s") as bar:
        write_events = _new_events(sim, lambda line, level: bar.print(line, "yellow" if level == "WARN" else None))

        def tick(time: float) -> None:
            write_events()
            bar.update(time, _status(sim))

        yield tick


@contextmanager
def notebook_bar(sim: "Simulation", duration: float) -> Iterator[_Tick]:
    """A bar in a notebook, which stays when the run is over, with the referee's lines under it."""
    from IPython.display import HTML, display

    lines: list[str] = []
    write_events = _new_events(sim, lambda line, _level: lines.append(line))
    reached, drawn = 0.0, clock.perf_counter()

    def drawing() -> Any:
        log = f"<pre>{html.escape(chr(10).join(lines))}</pre>" if lines else ""
        text = html.escape(f"{_status(sim) or 'sailing'}, {reached:.0f} of {duration:.0f} s")
        return HTML(f'<progress value="{reached:g}" max="{duration:g}"></progress> {text}{log}')

    def tick(time: float) -> None:
        nonlocal reached, drawn
        reached = time
        write_events()
        if clock.perf_counter() - drawn > REDRAW_PERIOD:
            handle.update(drawing())
            drawn = clock.perf_counter()

    handle = display(drawing(), display_id=True)
    try:
        yield tick
    finally:
        handle.update(drawing())


def _new_events(sim: "Simulation", write: Callable[[str, str], None]) -> Callable[[], None]:
    """A function that writes the lines which the referee has added since its last call, with their levels."""
    count = 0

    def write_new() -> None:
        nonlocal count
        for moment, text, level in sim.task_events[count:]:
            write(f"{moment:8.2f} s  {text}", level)
            count += 1

    return write_new


def _status(sim: "Simulation", mark: str = ":") -> str:
    task = sim.task
    return "" if task is None else f"{task['name']}{mark} {task['state']}, {score_text(task['state'], task['score'])}"
