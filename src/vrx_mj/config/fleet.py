"""A fleet's file: how many boats, of which kind, and where."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, ClassVar, Literal, NamedTuple, get_args

from pydantic import Field, Tag, field_validator
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import Config, Fault, Folder, FromFile, Only
from vrx_mj.config.layouts import HEIGHT, Facing, Layout, LayoutName, headings, spots, square
from vrx_mj.config.loading import check, joining, loads, problem_at
from vrx_mj.config.profiles import CLASSIC
from vrx_mj.config.readers import function_of
from vrx_mj.config.robots import Arguments, load_robot
from vrx_mj.config.search import contained, is_path
from vrx_mj.config.tree import Loc
from vrx_mj.config.values import (
    MAX_COORDINATE,
    Cartesian,
    Color,
    Coordinate,
    Name,
    Number,
    Pose,
    Positive,
    Seed,
    by_type,
    demand,
)
from vrx_mj.config.world import Sensors, SpawnConfig, WorldConfig, check_thrusters
from vrx_mj.errors import ConfigError, Problem

RADIUS = 20.0
"""Default radius of a circle [m]: that of the published guide's ring."""
SPACING = 10.0
"""Default distance between neighbours [m]: twice the length of a WAM-V."""

Controller = Annotated[
    str,
    demand(
        re.compile(r"[A-Za-z_]\w*(\.\w+)*:[A-Za-z_]\w*").fullmatch,
        "expected module:function, as in my_boat:controller, got {}",
    ),
]

Engines = Literal["fixed", "hinged"]
Headings = Literal["math", "compass"]


@dataclass(frozen=True)
class Order:
    """How a fleet's file orders a boat; equal orders give equal boats."""

    robot: str
    folder: Path | None = None
    """Where a relative path of `robot` starts."""
    layout: str | None = None
    """Layout of the thrusters, where the robot has layouts."""
    thrusters: Path | None = None
    """VRX's thruster file."""
    components: Path | None = None
    """VRX's component file."""
    sensors: tuple[str, ...] | None = None
    """Suites or names of sensors; None: the robot's own."""
    arguments: tuple[tuple[str, str], ...] = ()
    """Arguments of the robot's xacro, each a name and a value."""
    profile: str = CLASSIC
    """Profile of the world's physics."""


class BoatConfig(Config):
    """A boat in the world, ready to be built."""

    folder: Folder = None
    """Where a relative path of `robot` starts."""
    name: Name
    """Name of the boat."""
    robot: str
    """Kind of boat: a name, or a path relative to `folder`."""
    arguments: Arguments = Field(default_factory=dict)
    """Arguments of the robot's xacro."""
    thrusters: str | None
    """Layout of the thrusters, or path of a thruster file; None: the robot has no layouts."""
    components: str | None = None
    """Path of a component file."""
    sensors: tuple[str, ...] | None = None
    """Suites or names of sensors; None: what the robot or its component file carries."""
    thrusters_folder: Folder = None
    """Where a relative path of `thrusters` starts."""
    components_folder: Folder = None
    """Where a relative path of `components` starts."""
    pose: Pose
    """Pose of `base_link` in the world [m, rad]."""
    color: Color | None = None
    """Colour of the hull; None: the robot's own."""
    engines: Engines = "fixed"
    """Whether the engines are fixed to the hull or bodies on hinges."""
    controller: str | None = None
    """Default controller of the boat, as module:function."""

    @property
    def order(self) -> Order:
        """How the boat is built; boats of equal orders are alike."""
        layout = self.thrusters if self.thrusters and not is_path(self.thrusters) else None
        file = contained(self.thrusters, self.thrusters_folder) if self.thrusters and layout is None else None
        parts = contained(self.components, self.components_folder) if self.components else None
        return Order(self.robot, self.folder, layout, file, parts, self.sensors, tuple(sorted(self.arguments.items())))


class Located(NamedTuple):
    """A boat, and the keys of the fleet's file that it comes from."""

    boat: BoatConfig
    where: Loc
    """The key of its pose."""
    own: Loc
    """The key of this boat alone; () if it has none."""


class FleetPosition(Config):
    """A boat's place in the frame of the fleet's origin."""

    x: Coordinate
    """Along the x axis of the fleet's frame [m]."""
    y: Coordinate
    """Along the y axis of the fleet's frame [m]."""
    z: Coordinate = HEIGHT
    """Height of the boat's origin over the mean water [m]."""
    Y: Number = 0.0
    """Heading [degrees], counter-clockwise from the frame's x axis; of `headings: compass` clockwise from its y."""

    def pose_in(self, headings: Headings) -> Pose:
        """The place as a pose [m, rad]; `headings` is the convention of `Y`."""
        yaw = 90.0 - self.Y if headings == "compass" else self.Y
        return self.x, self.y, self.z, 0.0, 0.0, math.radians(yaw)


def _read_parts(kind: str, path: str, near: Path | None) -> None:
    read = function_of("parts", path)
    assert read is not None, "any file may have parts"
    read(contained(path, near), kind)


_read_components = partial(_read_parts, "components")


class _Built(Config):
    """Keys of a fleet and of a single boat of it."""

    folder_keys: ClassVar = {"folder": "robot", "thrusters_folder": "thrusters", "components_folder": "components"}
    folder: Folder = None
    thrusters_folder: Folder = None
    components_folder: Folder = None
    robot: Annotated[str, loads(load_robot)] | None = None
    """Kind of boat; by default that of the world's spawn."""
    arguments: Arguments | None = None
    """Arguments of the robot's xacro, as `{mast_height: 2.5, locked: false}`; a boat's come on top of the fleet's."""
    thrusters: str | None = None
    """Layout of the thrusters, H, T or X, or a thruster file; by default that of the world's spawn."""
    components: Annotated[str, loads(_read_components, "components_folder")] | None = None
    """Path of a component file."""
    sensors: Sensors | None = None
    """`vrx`, `none`, or names of suites or sensors; by default those of the world's spawn."""
    engines: Engines | None = None
    """Whether the engines are fixed to the hull, the default, or bodies on hinges, at four times the cost."""
    controller: Controller | None = None
    """Controller of the boats, module:function or module:Class, unless a run is given another."""

    @field_validator("thrusters")
    @classmethod
    def _robot_has_them(cls, value: str | None, info: ValidationInfo) -> str | None:
        robot, folder = info.data.get("robot"), info.data.get("folder")
        if value is not None and is_path(value):
            check(info, lambda: _read_parts("thrusters", value, info.data.get("thrusters_folder")))
        elif value is not None and robot is not None:
            check(info, lambda: check_thrusters(robot, value, folder))
        return value


class BoatEntry(_Built):
    """What is different about one boat, found by its name or by its place in the list."""

    name: Name | None = None
    """Name of the boat."""
    pose: Pose | None = None
    """Pose in the frame of the fleet's origin [m, rad]."""
    color: Color | None = None
    """Colour of the boat's skin."""


Origin = Annotated[
    Annotated[Literal["world", "spawn"], Tag("word")] | Annotated[Cartesian, Tag("frame")],
    by_type("world, spawn or [x, y, yaw]", ("world", "spawn"), frame=(tuple, list)),
]
Heading = Annotated[
    Annotated[Facing, Tag("word")] | Annotated[Number, Tag("degrees")],
    by_type(f"{', '.join(get_args(Facing))} or degrees", get_args(Facing), degrees=(int, float)),
]


class FleetConfig(_Built, FromFile):
    """A fleet's file. Boats are numbered `wamv1 ... wamvN` unless `boats` names them."""

    name: str = "fleet"
    """Name of the fleet; by default that of the file."""
    description: str = ""
    """What `vrx-mj list fleets --verbose` shows."""
    usv_count: Annotated[int, Field(ge=0, le=10_000)] | None = None
    """Number of boats; by default as many as `positions` and `boats` make."""
    layout: LayoutName | None = None
    """How boats that have no `positions` are placed."""
    radius: Annotated[Positive | None, Only("layout", ("circle",))] = None
    """Radius of the circle [m]."""
    start_angle: Annotated[Number | None, Only("layout", ("circle",))] = None
    """Angle of the circle's first boat [degrees], counter-clockwise from the frame's x axis."""
    spacing: Annotated[Positive | None, Only("layout", ("line", "column", "wedge", "grid", "random"))] = None
    """Distance between neighbours; in a random layout the least distance [m]."""
    size: Annotated[Positive | None, Only("layout", ("random",))] = None
    """Edge of the square of a random layout, around the origin [m]."""
    seed: Annotated[Seed | None, Only("layout", ("random",))] = None
    """Seed of a random layout; by default that of the world's file."""
    heading: Annotated[Heading | None, Only("layout")] = None
    """Heading of the layout's boats, by the convention that `headings` gives [degrees]."""
    headings: Headings | None = None
    """How `Y` and `heading` are read: math, counter-clockwise from x, or compass, clockwise from y. By default math."""
    positions: tuple[FleetPosition, ...] = ()
    """Places of the first boats, whatever the layout."""
    origin: Origin = "world"
    """What positions and poses are relative to: the world, its spawn pose, or [x, y, yaw] [m, rad]."""
    boats: tuple[BoatEntry, ...] = ()
    """What is different about single boats, and boats with names and poses of their own."""

    def _faults(self) -> list[Fault]:
        return list(_count_faults(self)) or _entry_faults(self)

    @property
    def is_empty(self) -> bool:
        """Whether this has no boats of its own: then there is one, `wamv`, at the world's spawn pose."""
        return not (self.positions or self.boats or self.layout) and self.usv_count is None

    def located(self, world: WorldConfig) -> tuple[Located, ...]:
        """Every boat of the fleet in a world, with its keys in the file."""
        if self.is_empty:
            return (Located(_boat(self, world.spawn, "wamv", world.spawn.pose, None), (), ()),)
        frame = self.frame(world)
        moved = [(slot, _moved(slot.pose, frame)) for slot in slots(self, world.seed)]
        far = [
            problem_at(self.section, slot.where, _far_message(slot.name, pose)) for slot, pose in moved if _is_far(pose)
        ]
        if far:
            raise ConfigError(far)
        return tuple(
            Located(_boat(self, world.spawn, slot.name, pose, slot.entry), slot.where, slot.own) for slot, pose in moved
        )

    def frame(self, world: WorldConfig) -> tuple[float, float, float]:
        """x, y [m] and yaw [rad] in the world of the frame that positions are given in."""
        if self.origin == "world":
            return 0.0, 0.0, 0.0
        if isinstance(self.origin, tuple):
            return self.origin
        x, y, _, _, _, yaw = world.spawn.pose
        return x, y, yaw

    def resolve(self, world: WorldConfig) -> tuple[BoatConfig, ...]:
        """Every boat of the fleet in a world, posed in world coordinates."""
        return tuple(item.boat for item in self.located(world))


def _moved(pose: Pose, frame: tuple[float, float, float]) -> Pose:
    """A pose in the world from one in the frame, which is level: roll and pitch stay."""
    x, y, z, roll, pitch, yaw = pose
    x0, y0, turn = frame
    cos, sin = math.cos(turn), math.sin(turn)
    return x0 + cos * x - sin * y, y0 + sin * x + cos * y, z, roll, pitch, yaw + turn


def _is_far(pose: Pose) -> bool:
    """Whether a pose in the world has a coordinate beyond what a file may give, or one that is not finite."""
    return not all(abs(value) <= MAX_COORDINATE for value in pose[:3]) or not math.isfinite(pose[5])


def _far_message(name: str, pose: Pose) -> str:
    x, y, z = pose[:3]
    return f"puts {name} at x {x:.4g}, y {y:.4g}, z {z:.4g} m in the world: at most {MAX_COORDINATE:g} m are allowed"


def joining_boat(said: Mapping[str, object], spawn: SpawnConfig) -> BoatConfig:
    """A boat that joins a world later: what is said of it, as in a fleet's `boats`, and the rest from its spawn.

    Raises:
        ConfigError: something that is said is wrong, or the name or the pose is missing.
    """
    entry = joining(BoatEntry, "boat", said)
    missing = [key for key in ("name", "pose") if getattr(entry, key) is None]
    if missing or entry.name is None or entry.pose is None:
        raise ConfigError(Problem("<boat>", None, None, key, "required") for key in missing)
    return _boat(FleetConfig(), spawn, entry.name, entry.pose, entry)


def _boat(fleet: FleetConfig, spawn: SpawnConfig, name: str, pose: Pose, entry: BoatEntry | None) -> BoatConfig:
    """A boat of its own kind, thrusters and engines, or else the fleet's, or else the world's."""
    levels = [level for level in (entry, fleet) if level is not None]

    def giving(key: str) -> _Built:
        return next((level for level in levels if getattr(level, key)), _Built())

    owner = giving("robot") if giving("robot").robot else spawn
    robot = str(owner.robot)
    return BoatConfig(
        folder=owner.folder,
        name=name,
        robot=robot,
        arguments=_arguments(levels, spawn),
        thrusters=giving("thrusters").thrusters or _layout(robot, owner.folder, spawn),
        components=giving("components").components,
        sensors=_sensors(levels, robot, spawn),
        thrusters_folder=giving("thrusters").thrusters_folder,
        components_folder=giving("components").components_folder,
        pose=pose,
        color=entry.color if entry else None,
        engines=giving("engines").engines or "fixed",
        controller=giving("controller").controller,
    )


def _arguments(levels: Sequence[_Built], spawn: SpawnConfig) -> dict[str, str]:
    """The arguments of the level that names the robot, and of those before it on top."""
    owner = next((index for index, level in enumerate(levels) if level.robot), len(levels))
    found = dict(spawn.arguments) if owner == len(levels) else {}
    for level in reversed(levels[: owner + 1]):
        found |= level.arguments or {}
    return found


def _layout(robot: str, folder: Path | None, spawn: SpawnConfig) -> str | None:
    """The layout of the world, or else the robot's first; None: it has no layouts."""
    known = load_robot(robot, folder).layouts
    return spawn.thrusters if spawn.thrusters in known else next(iter(known), None)


def _sensors(levels: Sequence[_Built], robot: str, spawn: SpawnConfig) -> tuple[str, ...] | None:
    """The sensors of the boat or fleet, or else those of a component file, or else the world's for its own robot."""
    for level in levels:
        if level.sensors is not None or level.components is not None:
            return level.sensors
    return spawn.sensors if robot == spawn.robot else None


class Slot(NamedTuple):
    """A boat in the fleet's frame."""

    name: str
    pose: Pose
    entry: BoatEntry | None
    where: Loc
    """The key of its pose."""
    own: Loc
    """The key of this boat alone; () if it has none."""


def slots(fleet: FleetConfig, seed: int) -> list[Slot]:
    """Numbered boats with what `boats` changes about them, then the boats that it adds; `seed` is the world's."""
    found = [
        Slot(f"wamv{i + 1}", pose, None, ("positions", i) if i < len(fleet.positions) else (), ())
        for i, pose in enumerate(_numbered(fleet, seed))
    ]
    count = len(found)
    for index, entry in enumerate(fleet.boats):
        own: Loc = ("boats", index)
        at = _slot_of(entry, index, count)
        if at is not None:
            name, pose, _, where, _ = found[at]
            found[at] = Slot(entry.name or name, entry.pose or pose, entry, own if entry.pose else where, own)
        elif entry.pose is not None:
            found.append(Slot(entry.name or f"wamv{len(found) + 1}", entry.pose, entry, own, own))
    return found


def _numbered(fleet: FleetConfig, seed: int) -> list[Pose]:
    """Poses of the numbered boats in the fleet's frame: their positions, and the layout's for those without one."""
    given = [position.pose_in(fleet.headings or "math") for position in fleet.positions]
    count = _count(fleet)
    if count == len(given):
        return given
    layout = _fleet_layout(fleet, seed)
    places = spots(layout, count)
    turns = headings(layout, places)
    placed = [(x, y, HEIGHT, 0.0, 0.0, turn) for (x, y), turn in zip(places, turns, strict=True)]
    return [*given, *placed[len(given) :]]


def _fleet_layout(fleet: FleetConfig, seed: int) -> Layout:
    heading = fleet.heading
    if isinstance(heading, float | int):
        heading = math.radians(90.0 - heading if fleet.headings == "compass" else heading)
    return Layout(
        name=fleet.layout or "line",
        radius=fleet.radius or RADIUS,
        spacing=fleet.spacing or SPACING,
        start_angle=math.radians(fleet.start_angle or 0.0),
        heading=heading,
        size=fleet.size,
        seed=seed if fleet.seed is None else fleet.seed,
    )


def _count(fleet: FleetConfig) -> int:
    """How many boats are numbered: those with positions, and those that a layout places beside them."""
    if fleet.positions:
        return (fleet.layout and fleet.usv_count) or len(fleet.positions)
    if fleet.layout or not any(entry.pose for entry in fleet.boats):
        return fleet.usv_count or 0
    return 0


def _slot_of(entry: BoatEntry, index: int, count: int) -> int | None:
    """Which numbered boat an entry is about: that of its name, or else of its place; None: a new one."""
    number = (entry.name or "").removeprefix("wamv")
    if entry.name and entry.name.startswith("wamv") and number.isdecimal() and 1 <= int(number) <= count:
        return int(number) - 1
    return index if index < count and (entry.name is None or entry.pose is None) else None


def _count_faults(fleet: FleetConfig) -> Iterator[Fault]:
    given, placed = fleet.usv_count, len(fleet.positions)
    if given is not None and (given < placed or (given != placed and placed and not fleet.layout)):
        yield ("usv_count",), f"{given}, but `positions` has {placed}"
    alone = not fleet.positions and not fleet.layout and any(entry.pose for entry in fleet.boats)
    if given is not None and alone and given != len(fleet.boats):
        yield ("usv_count",), f"{given}, but `boats` has {len(fleet.boats)}"
    if fleet.layout and given is None and not placed:
        yield ("usv_count",), f"required for layout {fleet.layout} without positions"


def _entry_faults(fleet: FleetConfig) -> list[Fault]:
    count, taken = _count(fleet), set()
    found: list[Fault] = []
    for index, entry in enumerate(fleet.boats):
        slot = _slot_of(entry, index, count)
        if slot is None and entry.pose is None:
            found.append((("boats", index, "pose"), f"required: this boat is not one of the {count} placed ones"))
        elif slot in taken:
            found.append((("boats", index), f"duplicate entry for wamv{(slot or 0) + 1}"))
        if slot is not None:
            taken.add(slot)
    return found


def room_faults(fleet: FleetConfig, seed: int) -> Iterator[Fault]:
    """A random layout whose square is full before all its boats have a place."""
    if fleet.layout != "random":
        return
    count, layout = _count(fleet), _fleet_layout(fleet, seed)
    done = len(spots(layout, count))
    if done < count:
        edge, enough = square(layout, count), math.ceil(square(replace(layout, size=None), count))
        text = f"{done} of {count} boats fit in {edge:g} m x {edge:g} m, {layout.spacing:g} m apart"
        yield ("size",) if fleet.size else ("layout",), f"{text}; use {enough} m or more, or a smaller spacing"
