"""VRX's own launch files: which world each opens, and with which boats, for where no file of that name is at hand."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from vrx_mj.frames import Pose

__all__ = ["PACKAGES", "STOCK_LAUNCHES", "StockBoat", "StockLaunch", "stock_launch", "stock_launches"]

CLASSIC, OLDER, WAVES, MARITIME = PACKAGES = ("vrx_gazebo", "vrx_2019", "wave_gazebo", "vorc_gazebo")
"""Packages that hold launch files; a launch file that two of them have is that of the earlier one."""

SYDNEY: Pose = (-532.0, 162.0, 0.1, 0.0, 0.0, 1.0)
SAND_ISLAND: Pose = (158.0, 108.0, 0.1, 0.0, 0.0, -2.76)
MARINA: Pose = (10.0, -372.0, 0.1, 0.0, 0.0, 0.3816)
OCEAN: Pose = (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
COMMON = ("world", "gui", "verbose", "extra_gazebo_args", "namespace", "x", "y", "z", "P", "R", "Y", "thrust_config",
          "urdf", "paused", "joy", "non_competition_mode")  # fmt: skip
"""Arguments of all of them."""
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
         boat: str = "wamv", package: str = CLASSIC) -> StockLaunch:  # fmt: skip
    """A launch file with one boat: with VRX's suite of sensors, or with switches for single ones."""
    given = {"thrust_config": thrusters} if thrusters else {}
    sensors = {"vrx_sensors_enabled": "true"} if suite else dict.fromkeys(FLAGS, "false")
    lock = {} if locked is None else {"wamv_locked": str(locked).lower()}
    arguments = given | sensors | lock
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
    _one("marina.launch", "marina", MARINA, "", boat="cora", package=MARITIME),
    _one("ocean_world_buoys.launch", "ocean_buoys", OCEAN, "H", suite=False, package=WAVES),
    _one("ocean_demos.launch", "ocean_buoys", OCEAN, "H", suite=False, package=WAVES),
    StockLaunch("ocean_world.launch", "ocean", (), COMMON, WAVES),
    StockLaunch("demo_thrusterconfigs.launch", "example_course", tuple(_demo()), (*COMMON, *FLAGS)),
    StockLaunch("wave_wamv.launch", "ocean_wamv", tuple(_waves()), (*COMMON, *FLAGS), WAVES),
)
_BY_PACKAGE: Mapping[tuple[str, str], StockLaunch] = {(launch.package, launch.name): launch for launch in _ALL}
STOCK_LAUNCHES: Mapping[str, StockLaunch] = {launch.name: launch for launch in reversed(_ALL)}
"""VRX's launch files by their names."""


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
