"""`vrx-mj ros`: packages for ROS 1 programs and roslaunch; `vrx-mj convert`: recordings to bags."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from vrx_mj.bar import Bar
from vrx_mj.cli.options import Folder, Recording
from vrx_mj.cli.screen import show
from vrx_mj.errors import CommandError, NetworkError
from vrx_mj.packages import importing, needs_extra

app = typer.Typer(rich_markup_mode=None)


@app.command()
def messages(output: Folder) -> None:
    """Write the ROS 1 message packages that Debian lacks, and print the lines that make programs find them.

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
        typer.echo(line)


@app.command()
def packages(
    output: Folder,
    over: Annotated[
        Path | None,
        typer.Option(help="A workspace with VRX's packages: files of yours in them are there too, by links."),
    ] = None,
) -> None:
    """Write ROS 1 packages with VRX's launch files, which start vrx-mj serve, and print the line that sets their path.

    The packages are vrx_gazebo, vrx_2019, wave_gazebo, vorc_gazebo, wamv_gazebo, wamv_description, gazebo_ros,
    teleop_twist_keyboard and xacro. With the line, roslaunch vrx_gazebo sandisland.launch and your own launch files
    work, with VRX's names and arguments. In the src of a catkin workspace catkin_make builds them with your packages.
    The scripts run the Python of this vrx-mj: generate them again if the environment moves.

    In bash, eval "$(vrx-mj ros packages -o FOLDER)" sets it in the current shell.

    Example: vrx-mj ros packages -o ~/vrx_packages
    """
    with importing("a ROS message", "rosbags", "ros1"):
        from vrx_mj.ros.launch_packages import write_launch_packages
    show(f"{output}: {', '.join(write_launch_packages(output, over))}")
    show("paste into every shell, or into ~/.bashrc:")
    top = shlex.quote(str(output.absolute()))
    typer.echo(f"export ROS_PACKAGE_PATH={top}${{ROS_PACKAGE_PATH:+:$ROS_PACKAGE_PATH}}")


def convert(
    recording: Recording,
    target: Annotated[
        Path,
        typer.Argument(help="A bag: .bag (ROS 1), .mcap, or a folder (rosbag2); or .csv, .parquet, .gpx or .geojson."),
    ],
    table: Annotated[
        str, typer.Option(help="What .csv and .parquet hold: motion, thrust, wind, contacts or events.")
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
    from vrx_mj.recording.tables import SUFFIXES, write_table

    if target.suffix.lower() not in {"", ".bag", ".mcap", *SUFFIXES}:
        kinds = ", ".join((".bag", ".mcap", *SUFFIXES))
        raise CommandError(f"invalid target '{target}'; allowed: {kinds}, or a folder without a suffix (rosbag2)")
    if target.suffix.lower() in SUFFIXES:
        typer.echo(f"{target}: {write_table(recording, target, table)} rows")
        return
    with importing("a ROS message", "rosbags", "ros1"):
        from vrx_mj.ros.convert import convert as write_bag
    with Bar("converting", 0.0, "s") as shown:
        count = write_bag(recording, target, lambda done, total: shown.update(done, total=total))
    typer.echo(f"{target}: {count} messages")


_DEFAULT_URL = "ws://127.0.0.1:9090"


def teleop(
    boat: Annotated[str | None, typer.Option(help="The boat to drive at first; default: the first one.")] = None,
    url: Annotated[str, typer.Option(help="Address of the rosbridge.")] = _DEFAULT_URL,
    web: Annotated[int | None, typer.Option(help="Serve a page to drive from; the port may be left out: 8090.")] = None,
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
        typer.echo(f"Open {server.page}")
        typer.echo(f"It drives the world at {url}, and is for this machine only. Ctrl-C stops.")
        typer.echo(f"From another machine, first: ssh {tunnel} this-machine")
        if not reaches(url):
            typer.echo(f"nothing answers at {url} yet; start a world there: vrx-mj serve WORLD --rosbridge", err=True)
        server.serve_forever(poll_interval=0.2)
