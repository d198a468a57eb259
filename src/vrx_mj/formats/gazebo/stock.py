"""VRX's own launch files: which world each opens, with which boats, and what does the work of those that open none."""

import re
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from vrx_mj.formats.urdf.elements import truth
from vrx_mj.frames import Pose
from vrx_mj.packages import shell_word
from vrx_mj.resources import root

CLASSIC, OLDER, WAVES, MARITIME = PACKAGES = ("vrx_gazebo", "vrx_2019", "wave_gazebo", "vorc_gazebo")
"""Packages that hold launch files; a launch file that two of them have is that of the earlier one."""

FOLDER = root() / "assets" / "launch"
"""Launch files of ours by VRX's names, in folders of their packages: arguments with VRX's defaults, and our node."""
SEVERAL: Mapping[str, Sequence[tuple[str, str, Pose]]] = {
    "demo_thrusterconfigs.launch": (
        ("wamvH", "H", (-552.0, 166.0, 0.0, 0.0, 0.0, 1.0)),
        ("wamvT", "T", (-542.0, 164.0, 0.0, 0.0, 0.0, 1.0)),
        ("wamvX", "X", (-532.0, 162.0, 0.0, 0.0, 0.0, 1.0)),
    ),
    "wave_wamv.launch": (
        ("wamv0", "H", (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)), ("wamv1", "H", (0.0, 6.0, 0.1, 0.0, 0.0, 1.57)),
    ),
}  # fmt: skip
"""Name, thrusters and pose [m, rad] of each boat of those launch files that have several."""
POSE = ("x", "y", "z", "R", "P", "Y")
"""Names of arguments for a pose."""
UNUSED: Mapping[str, str] = {
    "paused": "`vrx-mj serve --paused` starts paused",
    "joy": "`vrx-mj teleop --web` beside `vrx-mj serve` has a joystick",
    "non_competition_mode": "VRX_DEBUG=false hides the topics of wind and contacts",
    "extra_gazebo_args": "no Gazebo runs; type options of `vrx-mj` instead",
    "extra_gz_args": "no Gazebo runs; type options of `vrx-mj` instead",
    "recording": "`--record run.rrd` records",
    "debug": "no Gazebo runs that a debugger could take",
    "use_sim_time": "time is always that of the simulation",
    "enable_ros_network": "`vrx-mj serve` opens the wires that its options name",
    "pinger_params": "VRX's launch files do not read it; `task: {pinger: [x, y, z]}` of the world does",
}
"""What to do instead of arguments that have no effect here; nothing is lost where the value is the default."""
USUAL = {"paused": "false"}
"""Defaults that are others than those of all launch files."""
LOCKS = ("wamv_locked", "robot_locked")
"""Arguments that hold a boat in its place."""


@dataclass(frozen=True)
class StockBoat:
    """A boat of a launch file of VRX."""

    name: str
    pose: Pose
    """Pose in the world [m, rad]."""
    robot: str
    """Kind of boat, here."""
    arguments: Mapping[str, str]
    """Arguments of the launch file that its description takes, with their defaults."""


@dataclass(frozen=True)
class StockLaunch:
    """A launch file of VRX."""

    name: str
    world: str
    """Name of the world, here."""
    boats: tuple[StockBoat, ...]
    arguments: Mapping[str, str]
    """What it can be given, with the defaults."""
    package: str
    """Package that it is in."""
    file: Path
    """The file of ours, which starts it by roslaunch."""

    @property
    def own(self) -> Mapping[str, str]:
        """Arguments that its boats' descriptions take, with their defaults."""
        return self.boats[0].arguments if self.boats else {}


def _read(file: Path) -> StockLaunch:
    """The launch file of VRX that a file of ours is."""
    package, text = file.parent.name, file.read_text(encoding="utf-8")
    given = dict(re.findall(r'<arg name="(\w+)" default="(.*?)"/>', text))
    world = PurePosixPath(given["world"]).stem
    own = {key: value for key, value in given.items() if key in {"thrust_config", *LOCKS} or key.endswith("_enabled")}
    x, y, z, roll, pitch, yaw = (float(given[key]) for key in POSE)
    several = SEVERAL.get(file.name) or [(given["namespace"], given["thrust_config"], (x, y, z, roll, pitch, yaw))]
    robot = "wamv" if given["urdf"] else "cora"
    boats = tuple(
        StockBoat(
            name, pose, robot, {key: value for key, value in {**own, "thrust_config": thrusters}.items() if value}
        )
        for name, thrusters, pose in several
        if len(own) > 1
    )
    return StockLaunch(file.name, f"vrx2019/{world}" if package == OLDER else world, boats, given, package, file)


_ALL = tuple(_read(file) for package in PACKAGES for file in sorted((FOLDER / package).glob("*.launch")))
_BY_PACKAGE: Mapping[tuple[str, str], StockLaunch] = {(launch.package, launch.name): launch for launch in _ALL}
STOCK_LAUNCHES: Mapping[str, StockLaunch] = {launch.name: launch for launch in reversed(_ALL)}
"""VRX's launch files by their names."""
LAUNCHED: Mapping[str, str] = {
    name.removesuffix(".launch"): launch.world
    for name, launch in STOCK_LAUNCHES.items()
    if name != f"{launch.world}.launch"
} | {"competition": "vrx2023/sydney_regatta"}
"""Worlds that VRX's launch files open if nothing else is said, where these have other names."""
PLACES = {"sandisland": "sand_island", "sydneyregatta": "sydney_regatta", "nbpark": "vrx2023/nbpark"}
"""World files of VRX that have other names here."""
ENDINGS = (".launch.py", ".launch.xml", ".launch", ".world.xacro", ".world", ".sdf")


def world_message(name: str, known: Container[str]) -> str | None:
    """The message about a name that VRX has for a launch file or a world; None: it has no such name."""
    base = Path(name).name
    stem = next((base[: -len(end)] for end in ENDINGS if base.lower().endswith(end)), base)
    ending = base[len(stem) :]
    launched = LAUNCHED.get(stem) if not ending or ending.startswith(".launch") else None
    place = PLACES.get(stem) if not ending.startswith(".launch") else None
    if launched and place:
        return f"VRX's {stem}.launch opens '{launched}', its {stem}.world is '{place}'"
    if launched:
        return f"VRX's {stem}{ending or '.launch'} opens '{launched}'"
    if place or (ending and stem in known):
        return f"VRX's {base} is '{place or stem}'" if ending else f"VRX's {stem}.world is '{place}'"
    return None


def stock_launch(name: str, package: str = "") -> StockLaunch | None:
    """VRX's launch file of a name, with `.launch` or without, in a package or any; None: it has none."""
    full = name if name.endswith(".launch") else f"{name}.launch"
    return _BY_PACKAGE.get((package, full)) or STOCK_LAUNCHES.get(full)


def stock_launches(package: str) -> Sequence[StockLaunch]:
    """The launch files that a package of VRX has, or had in an earlier release."""
    own = [launch for launch in _ALL if launch.package == package]
    names = {launch.name for launch in own}
    moved = [launch for launch in _ALL if package == CLASSIC and launch.package == OLDER and launch.name not in names]
    return [*own, *moved]


def unused(launch: StockLaunch, name: str, value: str) -> str:
    """What to do instead of an argument that has no effect here; empty if nothing is lost."""
    if name in LOCKS:
        if truth(value) is None:
            return "true or false is expected"
        held = truth(value) and not truth(launch.own.get(name, "true"))
        return "a boat is held by a task, until it is ready" if held else ""
    usual = USUAL.get(name, launch.arguments[name])
    same = value.lower() == usual or (truth(value) is not None and truth(value) == truth(usual))
    return "" if same else UNUSED.get(name, "")


def unlocks(launch: StockLaunch, given: Mapping[str, str]) -> bool:
    """Whether arguments of a launch file free its boat, which it would lock."""
    return any(truth(given.get(name, "true")) is False and truth(launch.own.get(name, "")) for name in LOCKS)


@dataclass(frozen=True)
class _Tool:
    """A launch file of VRX that opens no world, and the command that does its work."""

    command: str
    options: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Options by the names of arguments, each with what to type where it is not given; empty: nothing."""
    reason: str = ""
    """What to know before."""


_TELEOP = {"namespace": ("--boat", "")}
_BESIDE = _Tool("", reason="start it with `roslaunch`, beside `vrx-mj serve`")
_PROGRAM = _Tool(
    "vrx-mj serve --ros2",
    {"world": ("vrx2023/", "sydney_regatta")},
    "launch files of ROS 2 are programs, which are not run",
)
_TOOLS: Mapping[str, _Tool] = {
    "generate_wamv.launch": _Tool(
        "vrx-mj robot build",
        {
            "thruster_yaml": ("--thrusters", ""),
            "component_yaml": ("--components", ""),
            "sensor_yaml": ("--sensor-yaml", ""),
            "wamv_locked": ("--locked", ""),
            "wamv_target": ("-o", "my_wamv.urdf"),
        },
    ),
    "generate_worlds.launch": _Tool(
        "vrx-mj worlds generate", {"requested": ("", "axes.yaml"), "world_target": ("-o", "my_worlds")}
    ),
    "usv_keydrive.launch": _Tool("vrx-mj teleop", _TELEOP, "keys are for a second terminal, beside `vrx-mj serve`"),
    "usv_joydrive.launch": _Tool("vrx-mj teleop --web", _TELEOP, "a joystick is on a page, beside `vrx-mj serve`"),
    "playback.launch": _Tool("vrx-mj replay run.rrd", reason="logs of Gazebo are not read; `--record run.rrd` records"),
    "pinger.launch": _Tool(
        "", reason="publish places of the beacon yourself, to /wamv/sensors/pingers/pinger/set_pinger_position"
    ),
    "localization_example.launch": _BESIDE,
    "rviz_vrx.launch": _BESIDE,
    "rviz.launch": _BESIDE,
    "competition.launch.py": _PROGRAM,
    "spawn.launch.py": _PROGRAM,
    "vrx_environment.launch.py": _PROGRAM,
}
"""VRX's launch files that open no world here."""


def is_tool(name: str) -> bool:
    """Whether VRX has a launch file of this name that opens no world here."""
    return name in _TOOLS


def instead_of(name: str, given: Mapping[str, str]) -> str:
    """What to type instead of one of VRX's launch files that open no world here, with its arguments."""
    tool = _TOOLS[name]
    command = " ".join([tool.command, *_words(tool.options, given)])
    return "; ".join(filter(None, ("opens no world here", tool.reason, tool.command and f"type: {command}")))


def _words(options: Mapping[str, tuple[str, str]], given: Mapping[str, str]) -> Iterator[str]:
    """The options of a command."""
    for name, (option, usual) in options.items():
        value = given.get(name, usual)
        if option == "--locked":
            yield from ["--locked"] if value.lower() in {"true", "1"} else []
        elif value:
            yield from (f"{option}{value}",) if option.endswith("/") else filter(None, (option, shell_word(value)))
