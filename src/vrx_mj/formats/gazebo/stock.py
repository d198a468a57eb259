"""VRX's own launch files: which world each opens, with which boats, and what does the work of those that open none."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from vrx_mj.formats.urdf.elements import truth
from vrx_mj.frames import Pose
from vrx_mj.packages import shell_word

CLASSIC, OLDER, WAVES, MARITIME = PACKAGES = ("vrx_gazebo", "vrx_2019", "wave_gazebo", "vorc_gazebo")
"""Packages that hold launch files; a launch file that two of them have is that of the earlier one."""

SYDNEY: Pose = (-532.0, 162.0, 0.1, 0.0, 0.0, 1.0)
SAND_ISLAND: Pose = (158.0, 108.0, 0.1, 0.0, 0.0, -2.76)
MARINA: Pose = (10.0, -372.0, 0.1, 0.0, 0.0, 0.3816)
OCEAN: Pose = (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
COMMON = ("world", "gui", "verbose", "extra_gazebo_args", "namespace", "x", "y", "z", "P", "R", "Y", "thrust_config",
          "urdf", "paused", "joy", "non_competition_mode", "recording", "debug", "use_sim_time", "enable_ros_network",
          "extra_gz_args")  # fmt: skip
"""Arguments of all of them: VRX's own, and those of Gazebo's launch file that some pass on."""
UNUSED: Mapping[str, tuple[frozenset[str], str]] = {
    "paused": (frozenset({"false", "0"}), "`vrx-mj serve --paused` starts paused"),
    "joy": (frozenset({"false", "0"}), "`vrx-mj teleop --web` beside `vrx-mj serve` has a joystick"),
    "non_competition_mode": (frozenset({"true", "1"}), "VRX_DEBUG=false hides the topics of wind and contacts"),
    "extra_gazebo_args": (frozenset({""}), "no Gazebo runs; type options of `vrx-mj` instead"),
    "extra_gz_args": (frozenset({""}), "no Gazebo runs; type options of `vrx-mj` instead"),
    "recording": (frozenset({"false", "0"}), "`--record run.rrd` records"),
    "debug": (frozenset({"false", "0"}), "no Gazebo runs that a debugger could take"),
    "use_sim_time": (frozenset({"true", "1"}), "time is always that of the simulation"),
    "enable_ros_network": (frozenset({"true", "1"}), "`vrx-mj serve` opens the wires that its options name"),
    "pinger_params": (
        frozenset({""}),
        "VRX's launch files do not read it; `task: {pinger: [x, y, z]}` of the world does",
    ),
}
"""Arguments without effect here: the values with which nothing is lost, and what to do instead."""
LOCKS = ("wamv_locked", "robot_locked")
"""Arguments that hold a boat in its place."""
FLAGS = ("camera_enabled", "gps_enabled", "imu_enabled", "lidar_enabled", "ground_truth_enabled")


@dataclass(frozen=True)
class StockBoat:
    """A boat of a launch file of VRX."""

    name: str
    pose: Pose
    """Pose in the world [m, rad]."""
    robot: str = "wamv"
    """Kind of boat, here."""
    arguments: Mapping[str, str] = field(default_factory=dict)
    """Arguments of the launch file that its description takes, with their defaults."""


@dataclass(frozen=True)
class StockLaunch:
    """A launch file of VRX."""

    name: str
    world: str
    """Name of the world, here."""
    boats: tuple[StockBoat, ...]
    arguments: tuple[str, ...]
    """What it can be given."""
    package: str = CLASSIC
    """Package that it is in."""

    @property
    def own(self) -> Mapping[str, str]:
        """Arguments that its boats' descriptions take, with their defaults."""
        return self.boats[0].arguments if self.boats else {}


def _one(name: str, world: str, pose: Pose, thrusters: str, *, suite: bool = True, locked: bool | None = None,
         boat: str = "wamv", package: str = CLASSIC, lock: str = "wamv_locked") -> StockLaunch:  # fmt: skip
    """A launch file with one boat: with VRX's suite of sensors, or with switches for single ones."""
    given = {"thrust_config": thrusters} if thrusters else {}
    sensors = {"vrx_sensors_enabled": "true"} if suite else dict.fromkeys(FLAGS, "false")
    held = {} if locked is None else {lock: str(locked).lower()}
    arguments = given | sensors | held
    boats = (StockBoat(boat, pose, boat, arguments),)
    return StockLaunch(name, world, boats, (*COMMON, *arguments, "pinger_params"), package)


def _older(name: str, world: str, thrusters: str, *, suite: bool = True, locked: bool | None = True) -> StockLaunch:
    """A launch file of 2019, at Sand Island."""
    return _one(name, f"vrx2019/{world}", SAND_ISLAND, thrusters, suite=suite, locked=locked, package=OLDER)


def _demo() -> Iterator[StockBoat]:
    for x, y, layout in ((-552.0, 166.0, "H"), (-542.0, 164.0, "T"), (-532.0, 162.0, "X")):
        flags = dict.fromkeys(FLAGS, "false")
        yield StockBoat(f"wamv{layout}", (x, y, 0.0, 0.0, 0.0, 1.0), arguments={"thrust_config": layout, **flags})


def _waves() -> Iterator[StockBoat]:
    for index, (y, yaw) in enumerate(((0.0, 0.0), (6.0, 1.57))):
        flags = dict.fromkeys(FLAGS, "true")
        yield StockBoat(f"wamv{index}", (0.0, y, 0.1, 0.0, 0.0, yaw), arguments={"thrust_config": "H", **flags})


_ALL = (
    _one("vrx.launch", "example_course", SYDNEY, "T", locked=False),
    _one("sydneyregatta.launch", "example_course", SYDNEY, "H", suite=False),
    _one("station_keeping.launch", "stationkeeping_task", SYDNEY, "T", locked=True),
    _one("wayfinding.launch", "wayfinding_task", SYDNEY, "T", locked=True),
    _one("perception_task.launch", "perception_task", SYDNEY, "H", locked=True),
    _one("wildlife.launch", "wildlife_task", SYDNEY, "H", locked=True),
    _one("scan_dock_deliver.launch", "scan_dock_deliver", SYDNEY, "H", locked=True),
    _one("gymkhana.launch", "gymkhana", SYDNEY, "T", locked=True),
    _older("sandisland.launch", "example_course", "H", suite=False, locked=None),
    _older("dock.launch", "dock", "H"),
    _older("navigation_task.launch", "navigation_task", "H"),
    _older("scan_and_dock.launch", "scan_and_dock", "H"),
    _older("vrx.launch", "example_course", "T", locked=False),
    _older("station_keeping.launch", "stationkeeping_task", "T"),
    _older("wayfinding.launch", "wayfinding_task", "T"),
    _older("perception_task.launch", "perception_task", "H"),
    _one("marina.launch", "marina", MARINA, "", locked=False, boat="cora", package=MARITIME, lock="robot_locked"),
    _one("ocean_world_buoys.launch", "ocean_buoys", OCEAN, "H", suite=False, package=WAVES),
    _one("ocean_demos.launch", "ocean_buoys", OCEAN, "H", suite=False, package=WAVES),
    StockLaunch("ocean_world.launch", "ocean", (), COMMON, WAVES),
    StockLaunch("demo_thrusterconfigs.launch", "example_course", tuple(_demo()), (*COMMON, *FLAGS)),
    StockLaunch("wave_wamv.launch", "ocean_wamv", tuple(_waves()), (*COMMON, *FLAGS), WAVES),
)
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
    usual, instead = UNUSED.get(name, (frozenset({value.lower()}), ""))
    return "" if value.lower() in usual else instead


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
