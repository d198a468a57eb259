"""`vrx-mj ros`: what programs of ROS need to talk to us."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from vrx_mj.cli.screen import console
from vrx_mj.errors import VrxError

__all__ = ["app", "convert", "messages", "needing_rosbags"]

app = typer.Typer(
    name="ros", help="What programs of ROS need to talk to us.", no_args_is_help=True, rich_markup_mode="rich"
)


@app.callback()
def ros() -> None:
    """What programs of ROS need to talk to us."""


@app.command()
def messages(output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the packages.")]) -> None:
    """Write the ROS 1 message packages that Debian lacks, and print the lines that make its programs find them.

    They are gazebo_msgs, geographic_msgs, usv_msgs, vrx_gazebo and vrx_mj_msgs, each with those of its types that we
    speak: rosservice, rostopic, rosmsg, rosbag and rospy need them. Only the lines go to stdout.

    In bash, eval "$(...)" takes them at once.

    Example: vrx-mj ros messages -o ~/vrx_messages
    """
    with needing_rosbags():
        from vrx_mj.adapters.ros.packages import write_packages
    written = write_packages(output)
    told = [f"{output}: {', '.join(written.packages) or 'nothing'}"]
    told += [f"left out: {name}, which is in {place}" for name, place in written.left_out.items()]
    told += [f"{name} is missing: apt-get install python3-{name.replace('_', '-')}" for name in written.missing]
    told += ["paste into every shell, or into ~/.bashrc:"]
    for line in told:
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    for line in written.exports:
        typer.echo(line)


def convert(
    recording: Annotated[Path, typer.Argument(help="A recording (.rrd).")],
    bag: Annotated[Path, typer.Argument(help="A .bag (ROS 1), an .mcap, or a folder (rosbag2).")],
) -> None:
    """Write a recording as a bag: the topics of vrx-mj run --bag, as far as the recording holds what they tell.

    Boats, frames, objects, wind, joints and commands are told 20 times a second, the task once a second, and what
    sensors measured where run --sensors recorded them; pictures have been JPEG. A recording has no contacts, no pace,
    no other sensors, and no commands: those follow from the thrust, so that one that timed out is 0, and steering is
    where the engine was.

    Example: vrx-mj convert run.rrd run.bag
    """
    with needing_rosbags():
        from vrx_mj.adapters.ros.convert import convert as write_bag
    count = write_bag(recording, bag)
    typer.echo(f"{bag}: {count} messages")


@contextmanager
def needing_rosbags() -> Iterator[None]:
    """Around an import: say which extra brings rosbags where it is not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "rosbags":
            raise
        raise VrxError("ROS's messages need rosbags, which is not installed: pip install 'vrx-mj[ros1]'") from None
