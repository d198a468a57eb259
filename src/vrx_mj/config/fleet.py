"""What a fleet's file says: how many boats, of which kind, where."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import BeforeValidator, Discriminator, Field, Tag, field_validator, model_validator
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import (
    Color,
    Config,
    Coordinate,
    Folder,
    Name,
    Pose,
    Positive,
    fault,
    faults,
    numbers,
)
from vrx_mj.config.build import Order
from vrx_mj.config.loading import check
from vrx_mj.config.parts.read import load_parts
from vrx_mj.config.robots import load_robot
from vrx_mj.config.search import contained, is_path
from vrx_mj.config.wording import shown
from vrx_mj.config.world import Sensors, WorldConfig, check_thrusters

__all__ = ["BoatConfig", "BoatEntry", "FleetConfig", "FleetPosition", "Located"]

RADIUS = 20.0
"""Of a circle whose file says none [m]: that of the published guide's ring."""
SPACING = 10.0
"""Of a line whose file says none [m]."""

Engines = Literal["fixed", "hinged"]
Loc = tuple[str | int, ...]


class BoatConfig(Config):
    """A boat in the world, ready to be built."""

    folder: Folder = None
    """Where a relative path of `robot` starts."""
    name: Name
    robot: str
    thrusters: str | None
    """Layout of the thrusters, or path of a thruster file; None: the robot has no layouts."""
    components: str | None = None
    """Path of a component file."""
    sensors: tuple[str, ...] | None = None
    """Suites or names of sensors; None: what the robot or its component file carries."""
    parts_folder: Folder = None
    """Where relative paths of `thrusters` and `components` start."""
    pose: Pose
    """Of `base_link` in the world [m, rad]."""
    color: Color | None = None
    engines: Engines = "fixed"

    @property
    def order(self) -> Order:
        """How the boat is built; boats of equal orders are alike."""
        layout = self.thrusters if self.thrusters and not is_path(self.thrusters) else None
        file = contained(self.thrusters, self.parts_folder) if self.thrusters and layout is None else None
        parts = contained(self.components, self.parts_folder) if self.components else None
        return Order(self.robot, self.folder, layout, file, parts, self.sensors)


class Located(NamedTuple):
    """A boat, and where the fleet's file says so."""

    boat: BoatConfig
    where: Loc
    """What puts the boat where it is."""
    own: Loc
    """What says something about this boat alone; () if nothing does."""


class FleetPosition(Config):
    """A boat's place in the frame of the fleet's origin."""

    x: Coordinate
    y: Coordinate
    z: Coordinate = 0.1
    Y: float = 0.0
    """Heading [degrees], counter-clockwise from the frame's x axis."""

    @property
    def pose(self) -> Pose:
        """As a pose [m, rad]."""
        return self.x, self.y, self.z, 0.0, 0.0, math.radians(self.Y)


class _Built(Config):
    """What a fleet and a single boat of it can both say."""

    folder: Folder = None
    robot: str | None = None
    """Kind of boat; by default that of the world's spawn."""
    thrusters: str | None = None
    """Layout of the thrusters, H, T or X, or a thruster file; by default that of the world's spawn."""
    components: str | None = None
    """A component file."""
    sensors: Sensors | None = None
    """`vrx`, `none`, or names of suites or sensors; by default those of the world's spawn."""
    engines: Engines | None = None

    @field_validator("robot")
    @classmethod
    def _exists(cls, value: str | None, info: ValidationInfo) -> str | None:
        if value is not None:
            check(info, lambda: load_robot(value, info.data.get("folder")))
        return value

    @field_validator("thrusters")
    @classmethod
    def _robot_has_them(cls, value: str | None, info: ValidationInfo) -> str | None:
        robot, folder = info.data.get("robot"), info.data.get("folder")
        if value is not None and is_path(value):
            check(info, lambda: load_parts(contained(value, folder), "thrusters"))
        elif value is not None and robot is not None:
            check(info, lambda: check_thrusters(robot, value, folder))
        return value

    @field_validator("components")
    @classmethod
    def _can_be_read(cls, value: str | None, info: ValidationInfo) -> str | None:
        if value is not None:
            check(info, lambda: load_parts(contained(value, info.data.get("folder")), "components"))
        return value


class BoatEntry(_Built):
    """What is different about one boat, found by its name or by its place in the list."""

    name: Name | None = None
    pose: Pose | None = None
    """In the frame of the fleet's origin [m, rad]."""
    color: Color | None = None


def _origin(value: Any) -> Any:
    if not isinstance(value, tuple | list) and value not in {"world", "spawn"}:
        raise fault(f"expected world, spawn or [x, y, yaw], got {shown(value)}")
    return value


Origin = Annotated[
    Annotated[Literal["world", "spawn"], Tag("word")]
    | Annotated[tuple[Coordinate, Coordinate, float], numbers("x y yaw"), Tag("frame")],
    Discriminator(lambda value: "word" if isinstance(value, str) else "frame"),
    BeforeValidator(_origin),
]


class FleetConfig(_Built):
    """A fleet's file. Boats are numbered `wamv1 ... wamvN` unless `boats` names them."""

    name: str = "fleet"
    description: str = ""
    usv_count: Annotated[int, Field(ge=1, le=10_000)] | None = None
    layout: Literal["circle", "line"] | None = None
    """How to place boats where there are no `positions`; beside them it only tells the reader."""
    radius: Positive | None = None
    """Of the circle [m]."""
    spacing: Positive | None = None
    """Between neighbours of the line [m]."""
    positions: tuple[FleetPosition, ...] = ()
    origin: Origin = "world"
    """What positions and poses are relative to: the world, its spawn pose, or [x, y, yaw] [m, rad]."""
    boats: tuple[BoatEntry, ...] = ()

    @model_validator(mode="after")
    def _counts_agree(self) -> Self:
        found = [*_count_faults(self), *_layout_faults(self)]
        if not found:
            found = _entry_faults(self)
        if found:
            raise faults(*found)
        return self

    @property
    def is_empty(self) -> bool:
        """Whether this says nothing about boats: then there is one, `wamv`, at the world's spawn pose."""
        return not (self.positions or self.boats or self.usv_count or self.layout)

    def located(self, world: WorldConfig) -> tuple[Located, ...]:
        """Every boat of the fleet in a world, with what the file says about it."""
        if self.is_empty:
            return (Located(_boat(self, world, "wamv", world.spawn.pose, None), (), ()),)
        frame = _frame(self, world)
        return tuple(
            Located(_boat(self, world, slot.name, _moved(slot.pose, frame), slot.entry), slot.where, slot.own)
            for slot in _slots(self)
        )

    def resolve(self, world: WorldConfig) -> tuple[BoatConfig, ...]:
        """Every boat of the fleet in a world, posed in world coordinates."""
        return tuple(item.boat for item in self.located(world))


class Slot(NamedTuple):
    """A boat in the fleet's frame."""

    name: str
    pose: Pose
    entry: BoatEntry | None
    where: Loc
    own: Loc


def _count(fleet: FleetConfig) -> int:
    """How many boats are numbered: those with positions, or those that a layout places."""
    if fleet.positions:
        return len(fleet.positions)
    if fleet.layout or not any(entry.pose for entry in fleet.boats):
        return fleet.usv_count or 0
    return 0


def _numbered(fleet: FleetConfig) -> list[Pose]:
    """Poses of the numbered boats in the fleet's frame: a circle is sailed clockwise, a line is abreast."""
    if fleet.positions:
        return [position.pose for position in fleet.positions]
    count = _count(fleet)
    if fleet.layout == "circle":
        radius, step = fleet.radius or RADIUS, 2 * math.pi / max(count, 1)
        return [
            (radius * math.sin(step * i), radius * math.cos(step * i), 0.1, 0.0, 0.0, -step * i) for i in range(count)
        ]
    spacing = fleet.spacing or SPACING
    return [(0.0, spacing * ((count - 1) / 2 - i), 0.1, 0.0, 0.0, 0.0) for i in range(count)]


def _slots(fleet: FleetConfig) -> list[Slot]:
    """Numbered boats with what `boats` changes about them, then the boats that it adds."""
    slots = [
        Slot(f"wamv{i + 1}", pose, None, ("positions", i) if fleet.positions else (), ())
        for i, pose in enumerate(_numbered(fleet))
    ]
    count = len(slots)
    for index, entry in enumerate(fleet.boats):
        own: Loc = ("boats", index)
        at = _slot_of(entry, index, count)
        if at is not None:
            name, pose, _, where, _ = slots[at]
            slots[at] = Slot(entry.name or name, entry.pose or pose, entry, own if entry.pose else where, own)
        elif entry.pose is not None:
            slots.append(Slot(entry.name or f"wamv{len(slots) + 1}", entry.pose, entry, own, own))
    return slots


def _slot_of(entry: BoatEntry, index: int, count: int) -> int | None:
    """Which numbered boat an entry is about: that of its name, or else of its place; None: a new one."""
    number = (entry.name or "").removeprefix("wamv")
    if entry.name and entry.name.startswith("wamv") and number.isdecimal() and 1 <= int(number) <= count:
        return int(number) - 1
    return index if index < count and (entry.name is None or entry.pose is None) else None


def _count_faults(fleet: FleetConfig) -> Iterator[tuple[Loc, str]]:
    given, placed = fleet.usv_count, len(fleet.positions)
    if given is not None and placed and given != placed:
        yield ("usv_count",), f"{given}, but `positions` has {placed}"
    alone = not fleet.positions and not fleet.layout and any(entry.pose for entry in fleet.boats)
    if given is not None and alone and given != len(fleet.boats):
        yield ("usv_count",), f"{given}, but `boats` has {len(fleet.boats)}"
    if fleet.layout and given is None and not placed:
        yield ("usv_count",), f"layout {fleet.layout} without positions needs it"


def _layout_faults(fleet: FleetConfig) -> Iterator[tuple[Loc, str]]:
    for key, layout in (("radius", "circle"), ("spacing", "line")):
        if getattr(fleet, key) is None:
            continue
        if fleet.positions:
            yield (key,), "has no effect beside `positions`; remove one of them"
        elif fleet.layout != layout:
            yield (key,), f"goes with layout {layout}, got layout {fleet.layout or 'nothing'}"


def _entry_faults(fleet: FleetConfig) -> list[tuple[Loc, str]]:
    count, taken = _count(fleet), set()
    found: list[tuple[Loc, str]] = []
    for index, entry in enumerate(fleet.boats):
        slot = _slot_of(entry, index, count)
        if slot is None and entry.pose is None:
            found.append((("boats", index, "pose"), f"required: this boat is not one of the {count} placed ones"))
        elif slot in taken:
            found.append((("boats", index), f"about wamv{(slot or 0) + 1}, as an entry before it"))
        if slot is not None:
            taken.add(slot)
    return found


def _frame(fleet: FleetConfig, world: WorldConfig) -> tuple[float, float, float]:
    """x, y [m] and yaw [rad] in the world of the frame that positions are given in."""
    if fleet.origin == "world":
        return 0.0, 0.0, 0.0
    if isinstance(fleet.origin, tuple):
        return fleet.origin
    x, y, _, _, _, yaw = world.spawn.pose
    return x, y, yaw


def _moved(pose: Pose, frame: tuple[float, float, float]) -> Pose:
    """A pose in the world from one in the frame, which is level: roll and pitch stay."""
    x, y, z, roll, pitch, yaw = pose
    x0, y0, turn = frame
    cos, sin = math.cos(turn), math.sin(turn)
    return x0 + cos * x - sin * y, y0 + sin * x + cos * y, z, roll, pitch, yaw + turn


def _boat(fleet: FleetConfig, world: WorldConfig, name: str, pose: Pose, entry: BoatEntry | None) -> BoatConfig:
    """A boat of its own kind, thrusters and engines, or else the fleet's, or else the world's."""
    levels = [level for level in (entry, fleet) if level is not None]
    owner = next((level for level in levels if level.robot), world.spawn)
    robot = str(owner.robot)
    parts = next((level for level in levels if level.thrusters or level.components), world.spawn)
    engines = next((level.engines for level in levels if level.engines), None)
    return BoatConfig(
        folder=owner.folder,
        name=name,
        robot=robot,
        thrusters=_layout(levels, robot, owner.folder, world),
        components=next((level.components for level in levels if level.components), None),
        sensors=_sensors(levels, robot, world),
        parts_folder=parts.folder,
        pose=pose,
        color=entry.color if entry else None,
        engines=engines or "fixed",
    )


def _layout(levels: Sequence[_Built], robot: str, folder: Path | None, world: WorldConfig) -> str | None:
    """The thrusters that somebody says, or else the world's, or else the robot's first; None: it has no layouts."""
    said = next((level.thrusters for level in levels if level.thrusters), None)
    if said is not None:
        return said
    known = load_robot(robot, folder).layouts
    return world.spawn.thrusters if world.spawn.thrusters in known else next(iter(known), None)


def _sensors(levels: Sequence[_Built], robot: str, world: WorldConfig) -> tuple[str, ...] | None:
    """The sensors that somebody says, or else those of a component file, or else the world's for its own robot."""
    for level in levels:
        if level.sensors is not None or level.components is not None:
            return level.sensors
    return world.spawn.sensors if robot == world.spawn.robot else None
