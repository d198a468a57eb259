"""`vrx-mj run`: from the words of the command line to a run and its summary."""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from importlib.abc import MetaPathFinder
from pathlib import Path

from vrx_mj.bar import waiting
from vrx_mj.errors import CommandError
from vrx_mj.packages import importing
from vrx_mj.recording.notebook import terminal_bar
from vrx_mj.runtime.run import (
    Controller,
    Summary,
    fleet_controller,
    load_controller,
    names_controllers,
    planned_duration,
    run,
    steady,
)
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.signals import check_interrupts
from vrx_mj.unix import release_memory


def sail(
    sim: Simulation,
    controller: Controller | None,
    duration: float | None,
    *,
    record: Path | None = None,
    sensors: str | None = None,
    follow: str | None = None,
    bag: Path | None = None,
    topics: Sequence[str] = (),
    own_code: bool = False,
) -> Summary:
    """Sail and record as asked; `own_code`: whether a controller is the user's code."""
    check_interrupts()  # numba's import may keep Ctrl-C to itself
    most = planned_duration(sim) if duration is None else duration
    sim.steps_in(most)
    with (
        recording(sim, record, sensors or (), follow=follow, pandas=own_code and controller is not None),
        _bagging(sim, bag, controller, topics) as (advance, steer),
        terminal_bar(sim, most) as tick,
    ):
        return run(sim, duration, controller=steer, progress=tick, advance=advance)


@contextmanager
def _bagging(
    sim: Simulation, path: Path | None, controller: Controller | None, topics: Sequence[str]
) -> Iterator[tuple[Callable[[int], None], Controller | None]]:
    """Functions that advance and steer the simulation, and write a bag if there is one."""
    if path is None:
        yield sim.advance, controller
        return
    with importing("a ROS message", "rosbags", "ros1"):
        from vrx_mj.ros.bags import bag_run
    with bag_run(sim, path, controller, topics=topics) as pair:
        yield pair


@contextmanager
def recording(
    sim: Simulation,
    path: Path | None,
    sensors: str | Sequence[str],
    *,
    follow: str | None = None,
    pandas: bool = False,
) -> Iterator[None]:
    """Record a simulation into a file, if there is one; to close a long recording takes a while.

    With `pandas` a user's code runs here, which may want it; see `_lean_pyarrow`.
    """
    if path is None:
        yield
        return
    from vrx_mj.recording import record

    with ExitStack() as closing, ExitStack() as recorder:
        recorder.enter_context(record(sim, path, sensors=sensors, follow=follow))
        if not pandas:
            recorder.callback(_lean_pyarrow)
        recorder.callback(lambda: closing.enter_context(waiting("closing the recording")))
        yield


class _NoPandas(MetaPathFinder):
    """Finds that pandas is not installed."""

    def find_spec(self, fullname: str, *_: object) -> None:
        if fullname == "pandas":
            raise ModuleNotFoundError(name=fullname)


def _lean_pyarrow() -> None:
    """Import pyarrow, and hide pandas while it looks for that, once: loading pandas takes 0.2 s and 40 MB.

    Its own memory pool keeps 15 MB of what was freed; the system's does not.
    """
    release_memory()  # what the run needed, before pyarrow is loaded on top of it
    from pyarrow import array, set_memory_pool, system_memory_pool

    set_memory_pool(system_memory_pool())
    sys.meta_path.insert(0, _NoPandas())
    try:
        array([0])
    finally:
        del sys.meta_path[0]


def steering(control: str | None, thrust: str | None) -> Callable[[Simulation], Controller | None]:
    """Maker of a simulation's controller, by `--control` or `--thrust`; without either, of the fleet's own.

    Raises:
        CommandError: both are given, or the thrust is not of its form.
    """
    if control is not None and thrust is not None:
        raise CommandError("--control and --thrust both command the boats: give one of them")
    commands = None if thrust is None else parse_thrust(thrust)

    def make(sim: Simulation) -> Controller | None:
        if commands is not None:
            return steady(sim, commands)
        if control is None and not names_controllers(sim):
            return None
        sys.path.insert(0, str(Path.cwd()))
        return fleet_controller(sim) if control is None else load_controller(control, sim.seed, sim)

    return make


def parse_thrust(text: str) -> Mapping[str, float]:
    """Commands from `left=0.5,right=0.5`.

    Raises:
        CommandError: it is not of that form.
    """
    commands: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = (word.strip() for word in part.partition("="))
        if name in commands:
            raise CommandError(f"invalid --thrust '{text}': '{name}' occurs twice")
        try:
            commands[name] = float(value)
        except ValueError:
            name = ""
        if not name:
            raise CommandError(f"invalid --thrust '{text}': '{part}' is not name=number, as in left=0.5,right=0.5")
    return commands
