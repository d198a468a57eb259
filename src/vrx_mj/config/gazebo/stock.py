"""VRX's own launch files: which world each opens, and with which boats, for where no file of that name is at hand."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from vrx_mj.frames import Pose

__all__ = ["STOCK_LAUNCHES", "StockBoat", "StockLaunch", "stock_launch"]

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


def _one(name: str, world: str, pose: Pose, thrusters: str, *, suite: bool = True, locked: bool | None = None,
         boat: str = "wamv") -> StockLaunch:  # fmt: skip
    """A launch file with one boat: with VRX's suite of sensors, or with switches for single ones."""
    given = {"thrust_config": thrusters} if thrusters else {}
    sensors = {"vrx_sensors_enabled": "true"} if suite else dict.fromkeys(FLAGS, "false")
    lock = {} if locked is None else {"wamv_locked": str(locked).lower()}
    arguments = given | sensors | lock
    return StockLaunch(name, world, (StockBoat(boat, pose, boat, arguments),), (*COMMON, *arguments, "pinger_params"))


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
    _one("sandisland.launch", "vrx2019/example_course", SAND_ISLAND, "H", suite=False),
    _one("dock.launch", "vrx2019/dock", SAND_ISLAND, "H", locked=True),
    _one("navigation_task.launch", "vrx2019/navigation_task", SAND_ISLAND, "H", locked=True),
    _one("scan_and_dock.launch", "vrx2019/scan_and_dock", SAND_ISLAND, "H", locked=True),
    _one("marina.launch", "marina", MARINA, "", boat="cora"),
    _one("ocean_world_buoys.launch", "ocean_buoys", OCEAN, "H", suite=False),
    _one("ocean_demos.launch", "ocean_buoys", OCEAN, "H", suite=False),
    StockLaunch("ocean_world.launch", "ocean", (), COMMON),
    StockLaunch("demo_thrusterconfigs.launch", "example_course", tuple(_demo()), (*COMMON, *FLAGS)),
    StockLaunch("wave_wamv.launch", "ocean_wamv", tuple(_waves()), (*COMMON, *FLAGS)),
)
STOCK_LAUNCHES: Mapping[str, StockLaunch] = {launch.name: launch for launch in _ALL}
"""VRX's launch files by their names."""


def stock_launch(name: str) -> StockLaunch | None:
    """VRX's launch file of a name, with `.launch` or without; None: it has none."""
    return STOCK_LAUNCHES.get(name if name.endswith(".launch") else f"{name}.launch")
