"""The commands that sail, look and check; `vrx_mj.cli.program` names them."""

import errno
import itertools
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from typer import Argument, Option, echo

from vrx_mj.cli.files import NEW_KINDS, NEW_ROBOT, copy_robot_files, copy_start_file, listing
from vrx_mj.cli.options import (
    Arguments,
    Fleet,
    Json,
    Nudge,
    Output,
    Record,
    Recording,
    Scale,
    Seed,
    Strict,
    World,
    above_zero,
    compile_source,
    reads_files,
)
from vrx_mj.cli.screen import pace_text, print_summary, program, score_line, show, to_open
from vrx_mj.errors import CommandError, RecordError, VrxError
from vrx_mj.outputs import write_file, writing
from vrx_mj.packages import shell_word

if TYPE_CHECKING:
    from vrx_mj.runtime.run import Summary

_DEMO_WORLD, _DEMO_FLEET, _DEMO_THRUST = "example_course", "trio", "left=0.5,right=0.4"
_DEMO_NAME = "vrx-mj-demo"
"""Name of the recording in the current folder, without its suffix and the number that distinguishes later ones."""
_BagFile = Annotated[
    Path | None, Option(help="Write the ROS topics to a bag: .bag (ROS 1), .mcap, or a folder (rosbag2).")
]
_BagTopics = Annotated[
    list[str] | None,
    Option(
        metavar="<topic>",
        help="Write these images and point clouds to the bag too, as in '/wamv/sensors/cameras/*'; may be repeated.",
    ),
]


@reads_files
def compile_(
    world: World,
    output: Output,
    arguments: Arguments = None,
    fleet: Fleet = None,
    seed: Seed = None,
    nudge: Nudge = False,
    strict: Strict = False,
    simulator: Annotated[
        Literal["mujoco", "warp", "mjx"],
        Option("--for", help="Program that opens it; for MuJoCo Warp and MJX, what they refuse is left out."),
    ] = "mujoco",
) -> None:
    """Compile a world to MJCF that plain MuJoCo opens. The assets it needs are written beside it.

    Example: vrx-mj compile example_course --fleet trio -o course/scene.xml
    """
    from vrx_mj.mjcf.world import SIMULATORS

    compiled = compile_source(world, arguments, fleet=fleet, seed=seed, nudge=nudge)
    scene = compiled.save(output, simulator=simulator)
    to_sail = f"; to sail it: vrx_mj.Simulation.load('{output}')" if simulator == "mujoco" else ""
    echo(f"{scene}: opens in {SIMULATORS[simulator].title}{to_sail}")
    echo("the boats fall in it: water, wind and thrust exist only in vrx_mj (vrx-mj run, vrx-mj view)")


@reads_files
def run(
    world: World,
    arguments: Arguments = None,
    fleet: Fleet = None,
    duration: Annotated[
        float | None, Option(help="Simulated seconds; default: until the task is finished, 60 without a task.")
    ] = None,
    seed: Seed = None,
    record: Record = None,
    control: Annotated[
        str | None, Option(help="Controller (module:function); replaces those that the fleet names.")
    ] = None,
    thrust: Annotated[
        str | None, Option(help="Constant commands, as in left=0.5,right=0.5; in N in profile vrx3.")
    ] = None,
    summary: Annotated[Path | None, Option(help="Write the summary as JSON.")] = None,
    sensors: Annotated[
        str | None, Option(help="Record sensors too: all, or as in wamv1:front_left_camera@5,lidar_wamv (@: Hz).")
    ] = None,
    bag: _BagFile = None,
    topic: _BagTopics = None,
    follow: Annotated[str | None, Option(help="The boat that the recording's camera follows.")] = None,
    nudge: Nudge = False,
    strict: Strict = False,
) -> None:
    """Sail a world, and print where the boats end and how the task is scored.

    Ctrl-C or SIGTERM ends the run early: the recording, the bag and the summary are written, and the exit code is 1.

    Example: vrx-mj run example_course --fleet trio --duration 60 --seed 7 --record run.rrd
    """
    from vrx_mj.cli.sailing import sail, steering
    from vrx_mj.runtime.simulation import Simulation

    _check_outputs(record, summary)
    _check_paired("--record FILE.rrd", record, {"--sensors": sensors, "--follow": follow})
    _check_paired("--bag FILE", bag, {"--topic": topic[0] if topic else None})
    steer = steering(control, thrust)
    sim = Simulation(compile_source(world, arguments, fleet=fleet, seed=seed, nudge=nudge))
    if seed is not None and not sim.world.parameters.has_random_loads:
        show("nothing random moves the boats: every --seed gives the same run, except for sensor noise")
    result = sail(
        sim, steer(sim), duration, record=record, sensors=sensors, follow=follow, bag=bag, topics=topic or (),
        own_code=thrust is None,
    )  # fmt: skip
    _report(result, summary, record, bag)


def _report(result: "Summary", summary: Path | None, record: Path | None, bag: Path | None) -> None:
    """Print and write the summary of a run, and name the files that were written; exit code 1 if it was cut short."""
    print_summary(result)
    if summary is not None:
        write_file(summary, json.dumps(result.as_dict(), indent=1) + "\n", "the summary")
    if record is not None:
        echo(f"recording: {record}; {to_open(record)}")
    if bag is not None:
        files = [bag] if bag.is_file() else bag.glob("*")
        echo(f"bag: {bag} ({sum(file.stat().st_size for file in files) / 1e6:.3g} MB)")
    if result.interrupted:
        raise SystemExit(1)


def _check_outputs(record: Path | None, summary: Path | None) -> None:
    """Check before the run that its files can be written: it must not fail after an hour of sailing."""
    if record is not None and record.suffix.lower() not in {"", ".rrd"}:
        advice = "; --bag FILE writes a bag" if record.suffix == ".bag" else ""
        raise CommandError(f"invalid --record '{record}': a name that ends in .rrd is needed{advice}")
    if summary is not None:
        with writing("the summary", summary):
            if summary.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            summary.absolute().parent.stat()


def _check_paired(needs: str, file: Path | None, options: Mapping[str, str | None]) -> None:
    """Refuse options that say something of a file which is not written."""
    for option, value in options.items():
        if value is not None and file is None:
            raise CommandError(f"{option} {value} needs {needs}")


@reads_files
def view(
    world: World,
    arguments: Arguments = None,
    fleet: Fleet = None,
    boat: Annotated[
        str | None, Option(help="The boat that the keyboard drives at first; default: the first one.")
    ] = None,
    pace: Annotated[float, Option(help="Simulated seconds per second.")] = 1.0,
    seed: Seed = None,
    control: Annotated[
        str | None, Option(help="Controller (module:function) of boats that the keyboard has not driven.")
    ] = None,
    thrust: Annotated[str | None, Option(help="Constant commands until a key is pressed.")] = None,
    browser: Annotated[bool, Option("--browser", help="Open in a browser, even where there is a display.")] = False,
    nudge: Nudge = False,
) -> None:
    """Watch a world live, and drive its boats with the keyboard. Without a display it opens in a browser.

    Example: vrx-mj view example_course --fleet trio --boat wamv2
    """
    from vrx_mj.cli.sailing import steering
    from vrx_mj.drive.view import view as open_view
    from vrx_mj.runtime.simulation import Simulation

    steer = steering(control, thrust)
    sim = Simulation(compile_source(world, arguments, fleet=fleet, seed=seed, nudge=nudge))
    open_view(sim, boat=boat, pace=pace, controller=steer(sim), browser=browser, write=echo)


def replay(
    recording: Recording,
    video: Annotated[Path | None, Option(help="Draw a video instead, into a .mp4, .webp or .gif file.")] = None,
    coco: Annotated[
        Path | None,
        Option(help="Write the cameras' pictures, with boxes and masks, to a folder as a COCO data set instead."),
    ] = None,
    view: Annotated[
        str, Option(help="View of the video: chase, above, or both (above in a corner).", show_default=True)
    ] = "both",
    boat: Annotated[
        str | None, Option(help="The boat that the camera follows; for a data set, the boat with the cameras.")
    ] = None,
    size: Annotated[str | None, Option(help="Size of the video [pixels], as in 1280x720.")] = None,
    fps: Annotated[float | None, Option(help="Pictures per second of the video.")] = None,
    speed: Annotated[float, Option(help="Simulated seconds per second of the video.")] = 1.0,
    begin: Annotated[float | None, Option("--from", help="First simulated second of the video or data set.")] = None,
    end: Annotated[float | None, Option("--to", help="Last simulated second of the video or data set.")] = None,
) -> None:
    """Open a recording in rerun's viewer, or draw a video of it. Without a display the viewer opens in a browser.

    A video needs no display; .mp4 needs the extra `video`. A data set has the pictures of every second.

    Example: vrx-mj replay run.rrd --video run.mp4 --boat wamv2 --speed 2
    """
    from vrx_mj.recording import open_viewer, write_coco
    from vrx_mj.recording.parts import no_recording
    from vrx_mj.recording.video import Shot, draw_video, parse_size

    if video is not None and coco is not None:
        raise CommandError("--video and --coco cannot be combined: give one of them")
    if not recording.is_file():
        raise RecordError(no_recording(recording))
    if coco is not None:
        count = write_coco(recording, coco, boat=boat, begin=begin, end=end)
        echo(f"data set: {coco}, {count} pictures, annotations.json")
        return
    if video is None:
        raise SystemExit(open_viewer(recording, follow=boat, write=echo))
    echo(draw_video(recording, video, Shot(view, boat, parse_size(size), fps, speed, begin, end)))


def compare(
    first: Recording,
    second: Annotated[Path, Argument(help="The recording to compare with (.rrd).")],
) -> None:
    """Compare the motion in two recordings, bit for bit.

    Differences are printed with their time and place. Exit code 0: the motion is equal, whatever the names of world
    and fleet, and the seed. Exit code 1: it differs, or one recording has rows or boats that the other lacks.

    Example: vrx-mj compare monday.rrd tuesday.rrd
    """
    from vrx_mj.recording import compare as compare_records

    result = compare_records(first, second)
    echo(str(result))
    if not result.equal:
        raise SystemExit(1)


def list_(
    kind: Annotated[str, Argument(help="What to list: worlds, fleets, robots, objects, docks or tasks.")] = "worlds",
    names: Annotated[str, Argument(help="Only names that match this pattern; * matches anything.")] = "*",
    verbose: Annotated[bool, Option("--verbose", "-v", help="Describe each one.")] = False,
) -> None:
    """List worlds, fleets, robots, objects, docks or tasks.

    The list contains what is installed, and what VRX_MJ_PATH and the current folder add.

    Example: vrx-mj list worlds 'vrx2022/*' --verbose
    """
    for line in listing(kind, names, verbose=verbose):
        echo(line)


@reads_files
def map_(
    world: World,
    arguments: Arguments = None,
    output: Output = Path("map.png"),
    fleet: Fleet = None,
    nudge: Nudge = False,
) -> None:
    """Draw a world as seen from above. The map shows shore, docks, objects, boats, the task's course, wind and waves.

    Example: vrx-mj map example_course --fleet trio -o map.png
    """
    from vrx_mj.draw.course import map_of
    from vrx_mj.draw.map import draw_map

    draw_map(map_of(compile_source(world, arguments, fleet=fleet, nudge=nudge)), output)
    echo(f"map: {output}")


def new(
    kind: Annotated[str, Argument(help=f"What to make: {', '.join(NEW_KINDS)} or robot.")],
    name: Annotated[str, Argument(help="Name of the new file, without suffix; for a robot, of its folder.")],
    hull: Annotated[Path | None, Option(help="Closed mesh of a robot [m]: x forward, z up.")] = None,
    mass: Annotated[float | None, Option(help="Mass of the robot with --hull [kg].", callback=above_zero())] = None,
    thrusters: Annotated[
        int, Option(min=1, max=4, help="Thrusters of the robot with --hull, 1 to 4; a single one steers.")
    ] = 2,
    center: Annotated[str | None, Option(help="Its centre of mass: x,y,z [m] of the mesh.")] = None,
    scale: Scale = 1.0,
) -> None:
    """Copy a commented start file into the current folder. For a robot that is a folder, which sails as a fleet.

    With --hull it is a boat with that mesh. Its numbers are estimated by published rules, which its files name.

    Example: vrx-mj new world my_bay
    """
    if kind != "robot":
        if hull is not None:
            raise CommandError(f"--hull is for a robot, not for a {kind}")
        echo(f"{copy_start_file(kind, name)}: edit it, then use it by its path")
    elif hull is not None:
        from vrx_mj.cli.new_robot import make_robot

        if mass is None:
            raise CommandError("--hull needs --mass, that of the whole boat [kg]")
        make_robot(name, hull, mass, thrusters, center, scale)
    else:
        folder = copy_robot_files(name)
        _, engines, components = (folder / file for file in NEW_ROBOT)
        echo(f"{folder}: edit its {', '.join(NEW_ROBOT)}, then")
        echo(f"vrx-mj robot check --thrusters '{engines}' --components '{components}'")
        echo(f"vrx-mj run ocean --fleet './{folder}'")


@reads_files
def doctor(
    world: Annotated[str | None, Argument(help="A world to check too, with its fleet.")] = None,
    fleet: Fleet = None,
    json_: Json = None,
) -> None:
    """Check what is installed and what works on this machine. Whatever does not work is listed with its fix.

    Example: vrx-mj doctor example_course --fleet trio --json doctor.json
    """
    from vrx_mj.cli.doctor import as_json, examine, examine_world, healthy, print_rows, sound

    if fleet is not None and world is None:
        raise CommandError(f"--fleet {fleet} needs a world: vrx-mj doctor WORLD --fleet {fleet}")
    rows = examine()
    if world is not None:
        rows += examine_world(world, fleet)
    print_rows(rows)
    if json_ is not None:
        write_file(json_, json.dumps(as_json(rows), indent=1) + "\n", "the rows")
    if world is not None:
        echo(f"{world}{f' with {fleet}' if fleet else ''}: {'no errors found' if sound(rows) else 'see above'}")
    if not (healthy(rows) and sound(rows)):
        raise SystemExit(1)


def bench(
    json_: Json = None,
    fleet_table: Annotated[
        bool, Option("--fleet-table", help="Measure fleets of 1 to 3000 boats instead, next to VRX's figures.")
    ] = False,
    recordings: Annotated[
        bool, Option("--recordings", help="Measure what recordings cost instead. It takes some minutes.")
    ] = False,
) -> None:
    """Measure the speed of this machine against the budgets. It takes one or two minutes.

    Example: vrx-mj bench --json bench.json
    """
    from vrx_mj.cli import bench_fleet
    from vrx_mj.cli.bench import measure, print_rows, recording_rows

    if fleet_table:
        rows = bench_fleet.fleet_table()
        bench_fleet.print_fleet_table(rows)
    else:
        rows = recording_rows() if recordings else measure()
        print_rows(rows)
    if json_ is not None:
        write_file(json_, json.dumps(rows, indent=1) + "\n", "the rows")


def score(
    recording: Annotated[Path, Argument(help="A recording (.rrd) of a world with a task.")],
    events: Annotated[bool, Option("--events", help="Print the referee's messages too.")] = False,
) -> None:
    """Score a recording again, with the task's own rules. The score equals that of the run.

    Example: vrx-mj score run.rrd
    """
    from vrx_mj.recording.checks import rescore

    referee, lines = rescore(recording)
    for time, text, level in lines if events else ():
        echo(f"{time:8.2f} s  {level:5}  {text}")
    status = referee.status
    echo(score_line(referee.name, referee.type, status.phase, status.score, status.collisions, status.timed_out))


def demo(
    output: Annotated[
        Path | None, Option("--output", "-o", help="The recording; default: a new vrx-mj-demo.rrd here.")
    ] = None,
    duration: Annotated[float, Option(help="Simulated seconds.")] = 45.0,
    open_: Annotated[
        bool, Option("--open/--no-open", help="Open the recording in the viewer, where there is a display.")
    ] = True,
) -> None:
    """Sail three boats into a recording, and open it in the viewer.

    The boats of fleet trio turn on example_course under steady thrust. The recording is a new file: earlier ones are
    kept. Without a display, the last line says how to open it. Ctrl-C keeps what has been recorded.

    Example: vrx-mj demo
    """
    from vrx_mj.cli.sailing import sail, steering
    from vrx_mj.mjcf.compile import compile_world
    from vrx_mj.runtime.simulation import Simulation

    file = _free_name(output)
    said = f"world {_DEMO_WORLD}, fleet {_DEMO_FLEET}, {duration:g} s, thrust {_DEMO_THRUST}"
    show(f"{said}; recording: {file.absolute()}")
    sim = Simulation(compile_world(_DEMO_WORLD, fleet=_DEMO_FLEET))
    result = sail(sim, steering(None, _DEMO_THRUST)(sim), duration, record=file)
    echo(f"sailed {result.sim_time:g} s in {result.wall_time:.1f} s: {pace_text(result.real_time_factor)}")
    echo("the same by hand: " + by_hand(file, duration))
    if result.interrupted:
        echo(f"interrupted; {to_open(file)}")
        raise SystemExit(1)
    from vrx_mj.draw.display import no_window

    reason = no_window(mujoco=False) if open_ else ""
    if reason is not None:
        echo(f"{reason}; {to_open(file)}" if reason else to_open(file))
        return
    from vrx_mj.recording import open_viewer

    echo("opening the viewer: close its window or press Ctrl-C to end")
    raise SystemExit(open_viewer(file))


def by_hand(file: Path, duration: float) -> str:
    """The command that makes this recording."""
    words = (
        f"{program()} run {_DEMO_WORLD} --fleet {_DEMO_FLEET} --thrust {_DEMO_THRUST} --duration {duration:g} --record"
    )
    return f"{words} {shell_word(str(file))}"


def _free_name(output: Path | None) -> Path:
    """The file that was asked for, or one in the current folder; never one that exists.

    Raises:
        VrxError: it exists, or cannot be written.
    """
    if output is not None and output.exists():
        raise VrxError(f"{output} exists: choose another name, or remove it")
    names = (Path(f"{_DEMO_NAME}{f'-{number}' if number > 1 else ''}.rrd") for number in itertools.count(1))
    file = output or next(name for name in names if not name.exists())
    with writing("the recording", file):
        file.touch(exist_ok=False)
        file.unlink()
    return file
