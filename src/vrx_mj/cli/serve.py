"""`vrx-mj serve`: a world for ROS, in a process that has none."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from vrx_mj.cli.screen import console
from vrx_mj.errors import CommandError, NetworkError

__all__ = ["serve", "with_default_port"]

COLORS = {"WARN": "yellow", "ERROR": "red"}
DEFAULT_PORT = "9090"
"""Of rosbridge."""


def with_default_port(arguments: Sequence[str]) -> list[str]:
    """The words of a command line, with a port after every --rosbridge that has none."""
    words = []
    for index, word in enumerate(arguments):
        bare = word == "--rosbridge" and not "".join(arguments[index + 1 : index + 2]).isdecimal()
        words.append(f"--rosbridge={DEFAULT_PORT}" if bare else word)
    return words


def serve(
    world: Annotated[str, typer.Argument(help="Name of a world, or path of its YAML file.")],
    fleet: Annotated[str | None, typer.Option(help="Name of a fleet or its file; default: one boat.")] = None,
    ros1: Annotated[bool, typer.Option("--ros1", help="ROS 1, with a master if none answers.")] = False,
    rosbridge: Annotated[int | None, typer.Option(help="rosbridge v2; its port may be left out: 9090.")] = None,
    ros2: Annotated[bool, typer.Option("--ros2", help="ROS 2, by the rclpy of this Python.")] = False,
    host: Annotated[str, typer.Option(help="Address to listen on; 0.0.0.0: all networks.")] = "127.0.0.1",
    rate: Annotated[str, typer.Option(help="Simulated seconds per second, or max.")] = "1.0",
    lockstep: Annotated[
        str | None, typer.Option(help="Topics that time waits for after every clock, A,B; or step: by /vrx_mj/step.")
    ] = None,
    clock: Annotated[float, typer.Option(help="Rate of /clock, per simulated second.")] = 100.0,
    cmd_vel: Annotated[str, typer.Option(help="What cmd_vel is: thrust, as in VRX, or velocity.")] = "thrust",
    truth: Annotated[bool, typer.Option("--truth", help="Tell in /tf where the boats really are in map.")] = False,
    duration: Annotated[float | None, typer.Option(help="Simulated seconds after which it ends.")] = None,
    record: Annotated[Path | None, typer.Option(help="Write a recording for rerun (.rrd).")] = None,
    seed: Annotated[int | None, typer.Option(help="Instead of the world's seed.")] = None,
    exit_on_completion: Annotated[
        bool,
        typer.Option("--exit-on-completion", envvar="VRX_EXIT_ON_COMPLETION", help="End with the world's task."),
    ] = False,
    nudge: Annotated[bool, typer.Option("--nudge", help="Move boats that start in something to free water.")] = False,
) -> None:
    """Serve a world to ROS: VRX's topics and services. Without --ros1, --rosbridge or --ros2: the first two.

    Example: vrx-mj serve example_course --fleet usv_config --ros1
    """
    from vrx_mj.adapters.ros.serve import Wanted
    from vrx_mj.adapters.ros.serve import serve as run
    from vrx_mj.cli.sailing import recording
    from vrx_mj.compiler.compile import compile_world
    from vrx_mj.runtime.simulation import Simulation

    if cmd_vel not in {"thrust", "velocity"}:
        raise CommandError(f"--cmd-vel {cmd_vel}: thrust or velocity")
    none = not (ros1 or ros2 or rosbridge is not None)
    wanted = Wanted(
        ros1=ros1 or none,
        rosbridge=int(DEFAULT_PORT) if none else rosbridge,
        ros2=ros2,
        host=host,
        rate=_rate(rate),
        duration=duration,
        lockstep=None if lockstep is None else [topic for topic in lockstep.split(",") if topic not in {"", "step"}],
        cmd_vel="velocity" if cmd_vel == "velocity" else "thrust",
        truth=truth,
        clock_rate=clock,
        exit_on_completion=exit_on_completion,
    )
    _check_installed(rosbridge=wanted.rosbridge is not None, ros2=wanted.ros2)
    sim = Simulation(compile_world(world, fleet=fleet, seed=seed, nudge=nudge))
    with recording(sim, record, ()):
        run(sim, wanted, tell=_tell, status=_status())


def _rate(text: str) -> float | None:
    if text == "max":
        return None
    try:
        return float(text)
    except ValueError:
        raise CommandError(f"--rate {text}: a number above 0, 1 for real time, or max") from None


def _check_installed(*, rosbridge: bool, ros2: bool) -> None:
    """Say what to install before the world is compiled."""
    from importlib.util import find_spec

    needed = ("rosbags",) + ("websockets", "cbor2") * rosbridge
    missing = [name for name in needed if find_spec(name) is None]
    if missing:
        extra = "rosbridge" if rosbridge else "ros1"
        raise NetworkError(f"{', '.join(missing)}: not installed; pip install 'vrx-mj[{extra}]'")
    if ros2:
        from vrx_mj.adapters.ros.ros2.installed import load_rclpy

        load_rclpy()


def _tell(level: str, text: str) -> None:
    """A line of the log, above that of the status."""
    if console.is_terminal:
        sys.stderr.write("\r\x1b[K")
    console.print(text, style=COLORS.get(level), markup=False, highlight=False, soft_wrap=True)


def _status() -> Callable[[str], None]:
    """Shows the line of status where somebody looks."""
    if not console.is_terminal:
        return lambda _line: None

    def show(line: str) -> None:
        sys.stderr.write(f"\r\x1b[K{line[: max(20, console.width - 1)]}")
        sys.stderr.flush()

    return show
