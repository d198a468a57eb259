"""The command line: what each command takes, and how errors and warnings reach the screen.

Exit codes: 0 done, 1 a run failed or was cut short, 2 wrong input, 130 Ctrl-C before it began.
"""

import json
import sys
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from vrx_mj.cli import campaign, robot, ros, scoring, serve, teleop, worlds
from vrx_mj.cli.files import NEW_KINDS, NEW_ROBOT, copy_robot_files, copy_start_file, listing, look_in, writing
from vrx_mj.cli.screen import console, print_summary, warn_once
from vrx_mj.errors import CommandError, DivergedError, RecordError, VrxError

app = typer.Typer(
    name="vrx-mj",
    help="Simulates unmanned surface vessels: the worlds, boats and habits of VRX, without ROS and Gazebo.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(robot.app)
app.add_typer(ros.app)
app.add_typer(worlds.app)
app.command()(scoring.score)
app.command()(campaign.campaign)
app.command()(ros.convert)
app.command()(serve.serve)
app.command()(teleop.teleop)

World = Annotated[str, typer.Argument(help="Name of a world (see [b]vrx-mj list worlds[/]) or path of its YAML file.")]
Fleet = Annotated[str | None, typer.Option(help="Name of a fleet or path of its YAML file; default: one boat.")]
Nudge = Annotated[
    bool, typer.Option("--nudge", help="Move boats that start on land, docks or each other to free water.")
]
Seed = Annotated[int | None, typer.Option(help="Instead of the world's seed.")]
Packages = Annotated[
    list[Path] | None,
    typer.Option("--package-path", help="A ROS package of a robot's files, or a folder of some.", callback=look_in),
]
BagFile = Annotated[
    Path | None, typer.Option(help="Write ROS's topics into a .bag (ROS 1), an .mcap, or a folder (rosbag2).")
]
BagTopics = Annotated[
    list[str] | None,
    typer.Option(help="Write these images and point clouds into the bag too, as '/wamv/sensors/cameras/*'."),
]
Control = Annotated[str | None, typer.Option(help="module:function(obs, t), 10 times a second; not the fleet's.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="Where to write.")]


def main() -> None:
    """Run the command line; every error that a user can cause is one message, without a traceback."""
    warnings.showwarning = warn_once()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    try:
        app(serve.with_default_port(sys.argv[1:]), prog_name="vrx-mj")
    except VrxError as error:
        console.print(str(error), style="red", markup=False, highlight=False, soft_wrap=True)
        raise SystemExit(1 if isinstance(error, DivergedError) else 2) from None


@app.command("compile")
def compile_(
    world: World,
    output: Output,
    fleet: Fleet = None,
    seed: Seed = None,
    nudge: Nudge = False,
    package_path: Packages = None,
) -> None:
    """Compile a world to MJCF that plain MuJoCo opens, with the assets it needs beside it.

    Example: vrx-mj compile example_course --fleet trio -o course/scene.xml
    """
    from vrx_mj.compiler.compile import compile_world

    compiled = compile_world(world, fleet=fleet, seed=seed, nudge=nudge)
    with writing("the world", output):
        scene = compiled.save(output)
    typer.echo(f"{scene}: opens in MuJoCo; vrx_mj.Simulation.load('{output}') sails it")


@app.command()
def run(
    world: World,
    fleet: Fleet = None,
    duration: Annotated[
        float | None, typer.Option(help="Simulated seconds; default: until the task is finished, 60 without a task.")
    ] = None,
    seed: Seed = None,
    record: Annotated[Path | None, typer.Option(help="Write a recording for rerun (.rrd).")] = None,
    control: Control = None,
    thrust: Annotated[str | None, typer.Option(help="Steady commands: left=0.5,right=0.5; N in profile vrx3.")] = None,
    summary: Annotated[Path | None, typer.Option(help="Write the summary as JSON.")] = None,
    sensors: Annotated[
        str | None, typer.Option(help="Record these sensors too, as in wamv1:front_left_camera@5,lidar_wamv; or all.")
    ] = None,
    bag: BagFile = None,
    topic: BagTopics = None,
    follow: Annotated[str | None, typer.Option(help="The boat that the recording's camera follows.")] = None,
    nudge: Nudge = False,
    package_path: Packages = None,
) -> None:
    """Sail a world, and tell at the end where the boats are, and the score of its task.

    Example: vrx-mj run example_course --fleet trio --duration 60 --seed 7 --record run.rrd
    """
    from vrx_mj.cli.sailing import sail

    _check_paired("--sensors", sensors, "what to record: give --record FILE.rrd too", record)
    _check_paired("--follow", follow, "whom the recording's camera follows: give --record FILE.rrd too", record)
    _check_paired("--topic", topic[0] if topic else None, "what to write into a bag: give --bag FILE too", bag)
    if summary is not None:
        with writing("the summary", summary):  # now: it must not fail after an hour of sailing
            summary.absolute().parent.stat()
    result = sail(
        world, fleet, duration=duration, seed=seed, path=record, control=control, thrust=thrust, sensors=sensors,
        follow=follow, nudge=nudge, bag=bag, topics=topic or (),
    )  # fmt: skip
    print_summary(result)
    if summary is not None:
        with writing("the summary", summary):
            summary.write_text(json.dumps(result.as_dict(), indent=1) + "\n", encoding="utf-8")
    _tell_files(record, bag)
    if result.interrupted:
        raise SystemExit(1)


def _check_paired(option: str, value: str | None, needs: str, file: Path | None) -> None:
    if value is not None and file is None:
        raise CommandError(f"{option} {value} says {needs}")


def _tell_files(record: Path | None, bag: Path | None) -> None:
    if record is not None:
        typer.echo(f"recording: {record}; vrx-mj replay {record} opens it")
    if bag is not None:
        typer.echo(f"bag: {bag}")


@app.command()
def view(
    world: World,
    fleet: Fleet = None,
    boat: Annotated[str | None, typer.Option(help="The boat that the keys drive first; default: the first.")] = None,
    pace: Annotated[float, typer.Option(help="Simulated seconds per second.")] = 1.0,
    seed: Seed = None,
    control: Annotated[str | None, typer.Option(help="module:function, steers boats no key has driven.")] = None,
    thrust: Annotated[str | None, typer.Option(help="Steady commands until a key is pressed.")] = None,
    browser: Annotated[bool, typer.Option("--browser", help="In a browser, even where there is a display.")] = False,
    nudge: Nudge = False,
    package_path: Packages = None,
) -> None:
    """Watch a world live and drive its boats by keys; without a display, in a browser on this machine.

    Example: vrx-mj view example_course --fleet trio --boat wamv2
    """
    from vrx_mj.adapters.view import view as open_view
    from vrx_mj.cli.sailing import steering
    from vrx_mj.compiler.compile import compile_world
    from vrx_mj.runtime.simulation import Simulation

    steer = steering(control, thrust)
    sim = Simulation(compile_world(world, fleet=fleet, seed=seed, nudge=nudge))
    open_view(sim, boat=boat, pace=pace, controller=steer(sim), browser=browser, tell=typer.echo)


@app.command()
def replay(
    recording: Annotated[Path, typer.Argument(help="A recording (.rrd).")],
    video: Annotated[Path | None, typer.Option(help="Draw a video instead: .mp4, .webp or .gif.")] = None,
    view: Annotated[
        str, typer.Option(help="Of the video: chase, above, or both, with above in a corner.", show_default=True)
    ] = "both",
    boat: Annotated[str | None, typer.Option(help="The boat that the camera follows.")] = None,
    size: Annotated[str | None, typer.Option(help="Of the video [pixels]: 1280x720.")] = None,
    fps: Annotated[float | None, typer.Option(help="Pictures per second of the video.")] = None,
    speed: Annotated[float, typer.Option(help="Simulated seconds per second of the video.")] = 1.0,
    begin: Annotated[float | None, typer.Option("--from", help="First simulated second of the video.")] = None,
    end: Annotated[float | None, typer.Option("--to", help="Last simulated second of the video.")] = None,
) -> None:
    """Open a recording in rerun's viewer, or draw it into a video, for which no display is needed.

    Example: vrx-mj replay run.rrd --video run.mp4 --boat wamv2 --speed 2
    """
    from vrx_mj.adapters.record import open_viewer
    from vrx_mj.adapters.video import Shot, draw_video, parse_size

    if not recording.is_file():
        raise RecordError(f"no recording '{recording}'")
    if video is None:
        raise SystemExit(open_viewer(recording, follow=boat))
    typer.echo(draw_video(recording, video, Shot(view, boat, parse_size(size), fps, speed, begin, end)))


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(help="A recording (.rrd).")],
    second: Annotated[Path, typer.Argument(help="Another one.")],
) -> None:
    """Say whether two recordings hold the same motion to the last bit, or when and where they part.

    Example: vrx-mj compare monday.rrd tuesday.rrd
    """
    from vrx_mj.adapters.record import compare as compare_records

    result = compare_records(first, second)
    typer.echo(str(result))
    if not result.equal:
        raise SystemExit(1)


@app.command("list")
def list_(
    kind: Annotated[str, typer.Argument(help="worlds, fleets, robots, objects, docks or tasks.")] = "worlds",
    names: Annotated[str, typer.Argument(help="Only names like this; * stands for anything.")] = "*",
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="What each is, too.")] = False,
) -> None:
    """List what has a name: what is installed, and what VRX_MJ_PATH and the current folder add.

    Example: vrx-mj list worlds 'vrx2022/*' --verbose
    """
    for line in listing(kind, names, verbose=verbose):
        typer.echo(line)


@app.command("map")
def map_(
    world: World,
    output: Output = Path("map.png"),
    fleet: Fleet = None,
    nudge: Nudge = False,
    package_path: Packages = None,
) -> None:
    """Draw what a world looks like from above: shore, docks, objects, boats, the course of its task, wind and waves.

    Example: vrx-mj map example_course --fleet trio -o map.png
    """
    from vrx_mj.adapters.map import draw_map, map_of
    from vrx_mj.compiler.compile import compile_world

    drawn = map_of(compile_world(world, fleet=fleet, nudge=nudge))
    with writing("the map", output):
        draw_map(drawn, output)
    typer.echo(f"map: {output}")


@app.command()
def new(
    kind: Annotated[str, typer.Argument(help=f"{', '.join(NEW_KINDS)} or robot.")],
    name: Annotated[str, typer.Argument(help="Name of the new file, without suffix; of a robot, of its folder.")],
) -> None:
    """Copy a commented start file into the current folder; for a robot, a folder with two.

    Example: vrx-mj new world my_bay
    """
    if kind == "robot":
        folder = copy_robot_files(name)
        thrusters, components = (folder / file for file in NEW_ROBOT)
        typer.echo(f"{folder}: edit its {' and '.join(NEW_ROBOT)}, then")
        typer.echo(f"vrx-mj robot check --thrusters '{thrusters}' --components '{components}'")
        return
    typer.echo(f"{copy_start_file(kind, name)}: edit it, then use it by its path")


@app.command()
def doctor(
    world: Annotated[str | None, typer.Argument(help="A world to check too, with its fleet, for serving it.")] = None,
    fleet: Fleet = None,
    json_: Annotated[Path | None, typer.Option("--json", help="Write the rows as JSON.")] = None,
) -> None:
    """Look at what is installed, try what can be tried, and say what to do where something does not work.

    Example: vrx-mj doctor example_course --fleet trio --json doctor.json
    """
    from vrx_mj.cli.doctor import as_json, examine, healthy, print_rows
    from vrx_mj.cli.doctor_world import examine_world, sound

    if fleet is not None and world is None:
        raise CommandError(f"--fleet {fleet} needs a world: vrx-mj doctor WORLD --fleet {fleet}")
    rows = examine()
    if world is not None:
        rows += examine_world(world, fleet)
    print_rows(rows)
    if json_ is not None:
        with writing("the rows", json_):
            json_.write_text(json.dumps(as_json(rows), indent=1) + "\n", encoding="utf-8")
    if world is not None:
        typer.echo(f"{world}{f' with {fleet}' if fleet else ''}: {'no mistakes found' if sound(rows) else 'see above'}")
    if not (healthy(rows) and sound(rows)):
        raise SystemExit(1)


@app.command()
def bench(
    json_: Annotated[Path | None, typer.Option("--json", help="Write the rows as JSON.")] = None,
    fleet_table: Annotated[
        bool, typer.Option("--fleet-table", help="Instead: what 1 to 3000 boats take, beside VRX's figures.")
    ] = False,
) -> None:
    """Measure what this machine does, against the budgets. Takes one or two minutes.

    Example: vrx-mj bench --json bench.json
    """
    rows = _fleets_measured() if fleet_table else _budgets_measured()
    if json_ is not None:
        with writing("the rows", json_):
            json_.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def _budgets_measured() -> list[dict[str, Any]]:
    from vrx_mj.cli.bench import measure, print_rows

    rows = measure()
    print_rows(rows)
    return rows


def _fleets_measured() -> list[dict[str, Any]]:
    from vrx_mj.cli.bench_fleet import fleet_table, print_fleet_table

    rows = fleet_table()
    print_fleet_table(rows)
    return rows
