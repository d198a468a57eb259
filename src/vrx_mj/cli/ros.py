"""Commands for ROS: `vrx-mj serve`, `vrx-mj ros` (packages for programs of ROS 1), `vrx-mj convert` (bags)."""

import logging
import shlex
import shutil
import sys
import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from typer import Argument, Option, Typer, echo

from vrx_mj.arguments import as_ports
from vrx_mj.bar import Bar
from vrx_mj.cli import missing_modules
from vrx_mj.cli.options import (
    DEFAULT_PORT,
    Arguments,
    Fleet,
    Folder,
    Nudge,
    Record,
    Recording,
    Seed,
    World,
    compile_source,
    reads_files,
)
from vrx_mj.cli.screen import is_watched, show
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.packages import importing, install_extra, needs_extra
from vrx_mj.signals import handle_signals

if TYPE_CHECKING:
    from vrx_mj.autopilot import ArduPilot
    from vrx_mj.mjcf.world import World as CompiledWorld
    from vrx_mj.runtime.simulation import Simulation


app = Typer(rich_markup_mode=None)
_NMEA_PORTS = "[BOAT:]PORT,... of boats is needed, as in wamv:10110"
_DEFAULT_URL = "ws://127.0.0.1:9090"
_COLORS = {"WARN": "yellow", "ERROR": "red"}


@app.command()
def messages(output: Folder) -> None:
    """Write the ROS 1 message packages that Debian lacks, and print the shell lines that put them on ROS's paths.

    The packages are gazebo_msgs, geographic_msgs, uuid_msgs, usv_msgs, vrx_gazebo, usv_gazebo_plugins and
    robotx_gazebo, each with all its types, those types of robot_localization, tf2_web_republisher and
    trajectory_msgs that are served, and vrx_mj_msgs; rosservice, rostopic, rosmsg, rosbag and rospy need them.
    Only the lines go to stdout.

    In bash, eval "$(vrx-mj ros messages -o FOLDER)" sets them in the current shell.

    Example: vrx-mj ros messages -o ~/vrx_messages
    """
    with importing("a ROS message", "rosbags", "ros1"):
        from vrx_mj.ros.packages import write_packages
    written = write_packages(output)
    lines = [f"{output}: {', '.join(written.packages) or 'nothing'}"]
    lines += [f"left out: {name}, which is in {place}" for name, place in written.left_out.items()]
    lines += [f"{name} is missing: apt-get install python3-{name.replace('_', '-')}" for name in written.missing]
    lines += ["paste into every shell, or into ~/.bashrc:"]
    for line in lines:
        show(line)
    for line in written.exports:
        echo(line)


@app.command()
def packages(
    output: Folder,
    over: Annotated[
        Path | None,
        Option(help="Your workspace with VRX's packages: links make your files in them available too."),
    ] = None,
) -> None:
    """Write ROS 1 packages with VRX's launch files, which start vrx-mj serve, and print the line that sets their path.

    The packages are vrx_gazebo, vrx_2019, wave_gazebo, vorc_gazebo, wamv_gazebo, wamv_description, gazebo_ros,
    teleop_twist_keyboard and xacro. With the line, roslaunch vrx_gazebo sandisland.launch and your own launch files
    work, with VRX's names and arguments. In the src folder of a catkin workspace, catkin_make builds them with yours.
    The scripts run the Python of this vrx-mj: generate them again if the environment moves.

    In bash, eval "$(vrx-mj ros packages -o FOLDER)" sets it in the current shell.

    Example: vrx-mj ros packages -o ~/vrx_packages
    """
    with importing("a ROS message", "rosbags", "ros1"):
        from vrx_mj.ros.packages import write_launch_packages
    show(f"{output}: {', '.join(write_launch_packages(output, over))}")
    show("paste into every shell, or into ~/.bashrc:")
    top = shlex.quote(str(output.absolute()))
    echo(f"export ROS_PACKAGE_PATH={top}${{ROS_PACKAGE_PATH:+:$ROS_PACKAGE_PATH}}")


def convert(
    recording: Recording,
    target: Annotated[
        Path,
        Argument(help="A bag: .bag (ROS 1), .mcap, or a folder (rosbag2); or .csv, .parquet, .gpx or .geojson."),
    ],
    table: Annotated[
        str, Option(help="What .csv and .parquet hold: motion, thrust, wind, contacts or events.")
    ] = "motion",
) -> None:
    """Convert a recording to a bag, a table or tracks.

    Tables are CSV or Parquet; tracks of the boats are GPX or GeoJSON.

    A bag has the topics of vrx-mj run --bag, where the recording contains the data. Boats, frames, objects, wind,
    joints and commands are written at 20 Hz, the task at 1 Hz, and sensors where run --sensors recorded them; images
    are decoded from JPEG. Real-time factor and other sensors are not in a recording. Commands are computed from the
    thrust: one that timed out is 0, and steering is the angle of the engine.

    Example: vrx-mj convert run.rrd run.csv
    """
    from vrx_mj.recording.exports import SUFFIXES, write_table

    if target.suffix.lower() not in {"", ".bag", ".mcap", *SUFFIXES}:
        kinds = ", ".join((".bag", ".mcap", *SUFFIXES))
        raise CommandError(f"invalid target '{target}'; allowed: {kinds}, or a folder without a suffix (rosbag2)")
    if target.suffix.lower() in SUFFIXES:
        echo(f"{target}: {write_table(recording, target, table)} rows")
        return
    with importing("a ROS message", "rosbags", "ros1"):
        from vrx_mj.ros.convert import convert as write_bag
    with Bar("converting", 0.0, "s") as shown:
        count = write_bag(recording, target, lambda done, total: shown.update(done, total=total))
    echo(f"{target}: {count} messages")


def teleop(
    boat: Annotated[str | None, Option(help="The boat to drive at first; default: the first one.")] = None,
    url: Annotated[str, Option(help="Address of the rosbridge.")] = _DEFAULT_URL,
    web: Annotated[int | None, Option(help="Serve a web page to drive from; default port: 8090.")] = None,
) -> None:
    """Drive a boat of a served world. The keys are those of VRX; --web serves a page to drive from.

    Example: vrx-mj teleop --boat wamv2
    """
    from importlib.util import find_spec

    if find_spec("websockets") is None:
        raise NetworkError(needs_extra("vrx-mj teleop", "websockets", "rosbridge"))
    if web is not None:
        _serve_page(web, url, boat)
        return
    if "://" not in url:
        raise CommandError(f"invalid --url '{url}': ws://HOST:PORT is needed, as in {_DEFAULT_URL}")
    from vrx_mj.ros.teleop.driving import drive_served_world

    drive_served_world(url, boat=boat)


def _serve_page(port: int, url: str, boat: str | None) -> None:
    import contextlib
    from urllib.parse import urlsplit

    from vrx_mj.ros.teleop.web import PageServer, reaches

    with PageServer(port, url, boat) as server, contextlib.suppress(KeyboardInterrupt):
        ports = (server.server_address[1], urlsplit(url).port or 80)
        tunnel = " ".join(f"-L {number}:127.0.0.1:{number}" for number in ports)
        echo(f"Open {server.page}")
        echo(f"It drives the world at {url}, and is for this machine only. Ctrl-C stops.")
        echo(f"From another machine, first: ssh {tunnel} this-machine")
        if not reaches(url):
            show(f"nothing answers at {url} yet; start a world there: vrx-mj serve WORLD --rosbridge")
        server.serve_forever(poll_interval=0.2)


_Rosbridge = Annotated[int | None, Option(help="Serve rosbridge v2; default port: 9090.")]
_Foxglove = Annotated[int | None, Option(help="Serve the viewers Foxglove and Lichtblick; default port: 8765.")]
_Sitl = Annotated[
    str | None,
    Option(
        metavar="<boat:port,...>",
        help="Let ArduPilot's SITL control boats in lock-step, each on its UDP port; default: all boats, the first on "
        "9002, each further one 10 above.",
    ),
]
_Nmea = Annotated[
    str | None,
    Option(
        metavar="<[boat:]port,...>",
        help="Send NMEA 0183 and AIS of the first boat, or of those named, to chart plotters by UDP and TCP; default "
        "port: 10110.",
    ),
]
_Waits = Annotated[
    str | None,
    Option(help="Topics A,B that the simulation waits for after every /clock; step: the service /vrx_mj/step."),
]
_Completion = Annotated[
    bool,
    Option("--exit-on-completion", envvar="VRX_EXIT_ON_COMPLETION", help="End when the world's task is finished."),
]
_Origins = Annotated[
    list[str] | None,
    Option(
        metavar="<origin>",
        help="Let pages of this site use rosbridge, as in https://app.foxglove.dev; may be repeated; default: only "
        "pages of this machine.",
    ),
]
_Truth = Annotated[bool, Option("--truth", help="Publish the true poses of the boats in /tf, in the frame map.")]
_CmdVel = Literal["thrust", "velocity", "off"]
_Localized = Annotated[
    Literal["truth", "navigator"] | None,
    Option(
        help="Publish each boat's pose as robot_localization does: navigator (the default), from its GPS and IMU, or "
        "truth."
    ),
]
_Duration = Annotated[float | None, Option(help="End after this many simulated seconds; default: never.")]


@reads_files
def serve(
    world: World,
    arguments: Arguments = None,
    fleet: Fleet = None,
    ros1: Annotated[bool, Option("--ros1", help="Serve ROS 1; starts a master if none answers.")] = False,
    rosbridge: _Rosbridge = None,
    foxglove: _Foxglove = None,
    ardupilot: _Sitl = None,
    nmea: _Nmea = None,
    ros2: Annotated[bool, Option("--ros2", help="Serve ROS 2, through the rclpy of this Python.")] = False,
    host: Annotated[str, Option(help="Address to listen on; 0.0.0.0: all networks.")] = "127.0.0.1",
    allow_origin: _Origins = None,
    rate: Annotated[str, Option(help="Simulated seconds per second, or max.")] = "1.0",
    lockstep: _Waits = None,
    clock: Annotated[float, Option(help="Rate of /clock, per simulated second [Hz].")] = 100.0,
    cmd_vel: Annotated[_CmdVel, Option(help="What cmd_vel commands, in VRX thrust.")] = "thrust",
    truth: _Truth = False,
    localization: _Localized = None,
    paused: Annotated[bool, Option("--paused", help="Start paused, like paused:=true in VRX.")] = False,
    duration: _Duration = None,
    record: Record = None,
    seed: Seed = None,
    exit_on_completion: _Completion = False,
    nudge: Nudge = False,
) -> None:
    """Serve a world to ROS, with VRX's topics and services. By default ROS 1 and rosbridge, without ROS 2.

    Ctrl-C or SIGTERM ends it and closes the recording. For viewers only: vrx-mj serve example_course --foxglove
    For ArduPilot: vrx-mj serve example_course --ardupilot
    For chart plotters: vrx-mj serve example_course --nmea

    Example: vrx-mj serve example_course --fleet usv_config --ros1
    """
    by_default = not (ros1 or ros2) and (rosbridge, foxglove, ardupilot, nmea) == (None,) * 4
    _compile_and_serve(
        partial(compile_source, world, arguments, fleet=fleet, seed=seed, nudge=nudge), record, ardupilot, nmea,
        ros1=ros1 or by_default,
        rosbridge=int(DEFAULT_PORT) if by_default else rosbridge,
        foxglove=foxglove,
        ros2=ros2, host=host,
        origins=allow_origin or (),
        lockstep=None if lockstep is None else parse_lockstep(lockstep),
        cmd_vel=cmd_vel,
        truth=truth, localization=localization,
        rate=parse_rate(rate), clock_rate=clock,
        duration=duration, paused=paused, exit_on_completion=exit_on_completion,
    )  # fmt: skip


def _compile_and_serve(
    compile_: Callable[[], "CompiledWorld"], record: Path | None, ardupilot: str | None, nmea: str | None, **wanted: Any
) -> None:
    """Compile and serve; imports wait until they are needed."""
    given = wanted | {"nmea": nmea}
    extras = [extra for extra in ("rosbridge", "foxglove", "nmea") if given[extra] is not None]
    wires = wanted["ros1"] or wanted["ros2"] or extras
    if wires:
        check_installed(*extras, "ros1")
        if wanted["ros2"]:
            from vrx_mj.ros.ros2 import load_rclpy

            load_rclpy()
        from vrx_mj.ros.network import checked_origins
        from vrx_mj.ros.serve import ServeOptions
        from vrx_mj.ros.serve import serve as run

        services = ServeOptions(**wanted | {"origins": checked_origins(wanted["origins"])})
    from vrx_mj.cli.sailing import recording
    from vrx_mj.runtime.simulation import Simulation

    logging.getLogger("vrx_mj").addHandler(_Log())
    sim = Simulation(compile_())
    with ExitStack() as closing:
        autopilots = (
            None
            if ardupilot is None
            else closing.enter_context(_ardupilot(sim, ardupilot, wanted["host"], wanted["rate"]))
        )
        closing.enter_context(recording(sim, record, ()))
        if wires:
            if nmea is not None:
                services = replace(services, nmea=as_ports("--nmea", nmea, _NMEA_PORTS, *sim.boats[:1]))
            run(sim, services, report=_log_line, status=_status(), autopilots=autopilots)
        elif autopilots:
            ending = threading.Event()
            with handle_signals(("SIGINT", "SIGTERM"), lambda _: ending.set()):
                autopilots.run(
                    duration=wanted["duration"],
                    over=lambda: ending.is_set() or (wanted["exit_on_completion"] and sim.task_is_over),
                )


def _ardupilot(sim: "Simulation", ports: str, host: str, rate: float | None) -> "ArduPilot":
    """Listen for autopilots, and show how to start them."""
    from vrx_mj.autopilot import ArduPilot, ports_of

    autopilots = ArduPilot(sim, ports_of(sim, ports), host=host, rate=rate, report=_log_line)
    for line in autopilots.descriptions():
        _log_line("INFO", line)
    return autopilots


def parse_rate(text: str) -> float | None:
    """Simulated seconds per second; None for `max`. CommandError: it is neither, or not above 0."""
    if text == "max":
        return None
    with suppress(ValueError):
        if 0.0 < (rate := float(text)) < float("inf"):
            return rate
    raise CommandError(f"invalid --rate '{text}': a number above 0 is needed, 1 for real time, or max")


def parse_lockstep(text: str) -> tuple[str, ...]:
    """Topics from `A,B`; none from `step`."""
    return tuple(topic for topic in text.split(",") if topic not in {"", "step"})


def check_installed(*extras: str) -> None:
    """Check that extras are installed, before the world is compiled.

    Raises:
        NetworkError: modules are missing; it names them and what to install.
    """
    for extra in extras:
        if missing := missing_modules(extra):
            raise NetworkError(f"not installed: {', '.join(missing)}; {install_extra(extra)}")


def _log_line(level: str, text: str) -> None:
    """Print a line of the log above the status line."""
    if is_watched():
        sys.stderr.write("\r\x1b[K")
    show(text, _COLORS.get(level))


class _Log(logging.Handler):
    """Prints warnings of the network thread."""

    def emit(self, record: logging.LogRecord) -> None:
        """Show a line of the log."""
        _log_line({"WARNING": "WARN"}.get(record.levelname, record.levelname), record.getMessage())


def _status() -> Callable[[str], None]:
    """Write the status line if stderr is a terminal."""
    if not is_watched():
        return lambda _line: None

    def write(line: str) -> None:
        sys.stderr.write(f"\r\x1b[K{line[: max(20, shutil.get_terminal_size().columns - 1)]}")
        sys.stderr.flush()

    return write
