"""A fleet's file, and the fleet in a world: how many boats of which kind start where.

Reading checks names that clash, a square that is full, bearings, and a fleet far from everything.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import Field, Tag

from vrx_mj.config.base import Config, Fault, Faults, Folder, FromFile, InFolder
from vrx_mj.config.kinds import CLASSIC, function_of
from vrx_mj.config.layouts import HEIGHT, Headings, Layout, headings, roomy_square, spots, yaw_of
from vrx_mj.config.loading import Loading, Source, document, joining, loads, problem_at, validate
from vrx_mj.config.objects import Placement
from vrx_mj.config.robots import Arguments, load_robot
from vrx_mj.config.search import catalogue, contained_file, is_path
from vrx_mj.config.tree import Loc
from vrx_mj.config.values import MAX_COORDINATE, Cartesian, Color, Coordinate, Name, Number, Pose, by_type, demand
from vrx_mj.config.world import FULL_TURN, Sensors, SpawnConfig, WorldConfig, check_thrusters, warn_of_degrees
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxError, warn
from vrx_mj.frames import ZERO, Vector
from vrx_mj.model.boats import AisClass

_FUNCTION = re.compile(r"[A-Za-z_]\w*(\.\w+)*:[A-Za-z_]\w*")
_Controller = Annotated[str, demand(_FUNCTION.fullmatch, "expected module:function, as in my_boat:controller, got {}")]
_Engines = Literal["fixed", "hinged"]
_OUTWARD = math.radians(5.0)
"""How near a heading is to outward that was meant so [rad]."""
_FAR_AWAY = 300.0
"""Distance from everything in a world beyond which a fleet is probably misplaced [m]."""


@dataclass(frozen=True)
class Order:
    """How a fleet's file orders a boat; equal orders give equal boats."""

    robot: str
    folder: Path | None = None
    """Folder in which a relative path of `robot` starts."""
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


class FleetPosition(Config):
    """A boat's position in the frame of the fleet's origin."""

    x: Coordinate
    """Position along the x axis of the fleet's frame [m]."""
    y: Coordinate
    """Position along the y axis of the fleet's frame [m]."""
    z: Coordinate = HEIGHT
    """Height of the boat's origin above the mean water level [m]."""
    Y: Number = 0.0
    """Heading [degrees], counter-clockwise from the frame's x axis; with `headings: compass` clockwise from its y
    axis."""

    def pose_in(self, headings: Headings | None) -> Pose:
        """The place as a pose [m, rad]; `headings` is the convention of `Y`."""
        return self.x, self.y, self.z, 0.0, 0.0, yaw_of(self.Y, headings)


def _read_parts(kind: str, text: str, near: Path | None) -> None:
    if kind == "components" or is_path(text):  # else it is the name of a layout
        read = function_of("parts", text)
        assert read is not None, "any file may have parts"
        read(contained_file(text, near), kind)


class _BoatKeys(InFolder):
    """Keys of a fleet and of a single boat of it."""

    folder_keys: ClassVar = {"folder": "robot", "thrusters_folder": "thrusters", "components_folder": "components"}
    thrusters_folder: Folder = None
    components_folder: Folder = None
    robot: Annotated[str, loads(load_robot)] | None = None
    """Kind of boat; by default that of the world's `spawn`."""
    arguments: Arguments | None = None
    """Arguments of the robot's xacro, such as `{mast_height: 2.5, locked: false}`. Those of a boat are added to those
    of the fleet."""
    thrusters: Annotated[str, loads(partial(_read_parts, "thrusters"), "thrusters_folder")] | None = None
    """Layout of the thrusters (H, T or X), or a thruster file; by default that of the world's `spawn`."""
    components: Annotated[str, loads(partial(_read_parts, "components"), "components_folder")] | None = None
    """Path of a component file."""
    sensors: Sensors | None = None
    """`vrx`, `none`, or names of suites or sensors; by default those of the world's `spawn`."""
    engines: _Engines | None = None
    """Whether the engines are fixed to the hull (the default), or bodies on hinges, at four times the cost."""
    controller: _Controller | None = None
    """Controller of the boats, module:function or module:Class. A controller given to the run overrides it."""
    ais: AisClass | None = None
    """Class of the AIS transponder, A or B; by default B for hulls shorter than 20 m."""


class BoatEntry(_BoatKeys):
    """Settings of a single boat, identified by its name or by its place in the list."""

    name: Name | None = None
    """Name of the boat."""
    pose: Pose | None = None
    """Pose in the frame of the fleet's origin [m, rad]."""
    color: Color | None = None
    """Colour of the boat's skin."""


class _JoiningBoat(BoatEntry):
    """A boat that joins a world later."""

    name: Name
    pose: Pose


class BoatConfig(BoatEntry):
    """A boat in the world, ready to be built; without `thrusters` its robot has no layouts."""

    name: Name
    robot: str
    arguments: Arguments = Field(default_factory=dict)
    pose: Pose
    engines: _Engines = "fixed"

    @property
    def order(self) -> Order:
        """How the boat is built; boats of equal orders are alike."""
        layout = self.thrusters if self.thrusters and not is_path(self.thrusters) else None
        file = contained_file(self.thrusters, self.thrusters_folder) if self.thrusters and layout is None else None
        parts = contained_file(self.components, self.components_folder) if self.components else None
        return Order(self.robot, self.folder, layout, file, parts, self.sensors, tuple(sorted(self.arguments.items())))

    @property
    def layout_fault(self) -> str:
        """The message about a layout of thrusters that the boat's kind does not have; empty otherwise."""
        try:
            if self.thrusters and not is_path(self.thrusters):
                check_thrusters(self.robot, self.thrusters, self.folder)
        except VrxError as error:
            return str(error)
        return ""


class Slot(NamedTuple):
    """A boat's place, and the keys of the fleet's file that it comes from."""

    name: str
    pose: Pose
    entry: BoatEntry | None = None
    """Its differences from the other boats."""
    where: Loc = ()
    """The key of its pose."""
    own: Loc = ()
    """The key of this boat alone; () if it has none."""


Origin = Annotated[
    Annotated[Literal["world", "spawn"], Tag("word")] | Annotated[Cartesian, Tag("frame")],
    by_type("world, spawn or [x, y, yaw]", ("world", "spawn"), frame=(tuple, list)),
]


class FleetConfig(Layout, _BoatKeys, FromFile):
    """A fleet's file. Boats are numbered `wamv1 ... wamvN` unless `boats` names them."""

    name: str = "fleet"
    """Name of the fleet; by default that of the file."""
    description: str = ""
    """Description in `vrx-mj list fleets --verbose`."""
    usv_count: Annotated[int, Field(ge=0, le=10_000)] | None = None
    """Number of boats; by default as many as `positions` and `boats` define."""
    positions: tuple[FleetPosition, ...] = ()
    """Positions of the first boats, in any layout."""
    origin: Origin = "world"
    """Frame of positions and poses: the world, its spawn pose, or [x, y, yaw] [m, rad]."""
    boats: tuple[BoatEntry, ...] = ()
    """Settings of single boats, and additional boats with their own names and poses."""

    def _faults(self) -> Iterable[Fault]:
        return list(_count_faults(self)) or _entry_faults(self)

    @property
    def is_empty(self) -> bool:
        """Whether this has no boats of its own: then there is one, `wamv`, at the world's spawn pose."""
        return not (self.positions or self.boats or self.layout) and self.usv_count is None

    def boats_in(self, world: WorldConfig) -> list[tuple[BoatConfig, Slot]]:
        """Every boat of the fleet in a world, posed in world coordinates."""
        if self.is_empty:
            found = [Slot("wamv", world.spawn.pose)]
        else:
            frame = self.frame(world)
            found = [slot._replace(pose=_pose_in_world(slot.pose, frame)) for slot in _slots(self, world.seed)]
        far = [problem_at(self.section, slot.where, text) for slot in found if (text := _too_far(slot))]
        if far:
            raise ConfigError(far)
        return [(_boat(self, world.spawn, slot), slot) for slot in found]

    def frame(self, world: WorldConfig) -> Vector:
        """x, y [m] and yaw [rad] in the world of the frame that positions are given in."""
        if isinstance(self.origin, tuple):
            return self.origin
        x, y, _, _, _, yaw = world.spawn.pose
        return (x, y, yaw) if self.origin == "spawn" else ZERO


def _pose_in_world(pose: Pose, frame: Vector) -> Pose:
    """A pose in the world from one in the frame, which is level: roll and pitch stay."""
    x, y, z, roll, pitch, yaw = pose
    x0, y0, turn = frame
    cos, sin = math.cos(turn), math.sin(turn)
    return x0 + cos * x - sin * y, y0 + sin * x + cos * y, z, roll, pitch, yaw + turn


def _too_far(slot: Slot) -> str:
    """The message about coordinates in the world beyond what a file may give, or not finite; empty for others."""
    x, y, z, _, _, yaw = slot.pose
    if all(abs(value) <= MAX_COORDINATE for value in (x, y, z)) and math.isfinite(yaw):
        return ""
    place = f"x {x:.4g}, y {y:.4g}, z {z:.4g} m in the world"
    return f"puts {slot.name} at {place}: at most {MAX_COORDINATE:g} m are allowed"


def joining_boat(said: Mapping[str, object], spawn: SpawnConfig) -> BoatConfig:
    """A boat that joins a world later: what is said of it, as in a fleet's `boats`, and the rest from its spawn.

    Raises:
        ConfigError: something that is said is wrong, or the name or the pose is missing.
    """
    entry = joining(_JoiningBoat, "boat", said)
    boat = _boat(FleetConfig(), spawn, Slot(entry.name, entry.pose, entry))
    if boat.layout_fault:
        raise ConfigError.of("<boat>", boat.layout_fault, key="thrusters")
    return boat


def _boat(fleet: FleetConfig, spawn: SpawnConfig, slot: Slot) -> BoatConfig:
    """A boat of its own kind, thrusters and engines, or else the fleet's, or else the world's.

    A robot that has not the layout of the world has its own first one.
    """
    levels: list[_BoatKeys] = [slot.entry, fleet] if slot.entry else [fleet]
    given: dict[str, Any] = {"robot": spawn.robot, "folder": spawn.folder}
    for key in (key for key in _BoatKeys.model_fields if key not in {*_BoatKeys.folder_keys, "arguments", "sensors"}):
        if level := next((level for level in levels if getattr(level, key) not in (None, "")), None):
            folders = (name for name, owner in _BoatKeys.folder_keys.items() if owner == key)
            given |= {name: getattr(level, name) for name in (key, *folders)}
    robot = given["robot"]
    if "thrusters" not in given:
        known = load_robot(robot, given["folder"]).layouts
        given["thrusters"] = spawn.thrusters if spawn.thrusters in known else next(iter(known), None)
    return BoatConfig(
        name=slot.name,
        pose=slot.pose,
        color=slot.entry.color if slot.entry else None,
        arguments=_arguments([*levels, spawn]),
        sensors=_sensors(levels, robot, spawn),
        **given,
    )


def _arguments(levels: Sequence[_BoatKeys | SpawnConfig]) -> dict[str, str]:
    """The arguments of the level that names the robot, and of those before it on top."""
    found: dict[str, str] = {}
    for level in levels:
        found = (level.arguments or {}) | found
        if level.robot:
            break
    return found


def _sensors(levels: Sequence[_BoatKeys], robot: str, spawn: SpawnConfig) -> tuple[str, ...] | None:
    """The sensors of the boat or fleet, or else those of a component file, or else the world's for its own robot."""
    for level in levels:
        if level.sensors is not None or level.components is not None:
            return level.sensors
    return spawn.sensors if robot == spawn.robot else None


def _slots(fleet: FleetConfig, seed: int) -> list[Slot]:
    """Numbered boats with what `boats` changes about them, then the boats that it adds; `seed` is the world's."""
    found = [
        Slot(f"wamv{i + 1}", pose, where=("positions", i) if i < len(fleet.positions) else ())
        for i, pose in enumerate(_numbered_poses(fleet, seed))
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


def _numbered_poses(fleet: FleetConfig, seed: int) -> list[Pose]:
    """Poses of the numbered boats in the fleet's frame: their positions, and the layout's for those without one."""
    given = [position.pose_in(fleet.headings) for position in fleet.positions]
    count = _count(fleet)
    if count == len(given):
        return given
    places = spots(fleet, count, seed)
    turns = headings(fleet, places, seed)
    placed = [(x, y, HEIGHT, 0.0, 0.0, turn) for (x, y), turn in zip(places, turns, strict=True)]
    return [*given, *placed[len(given) :]]


def _count(fleet: FleetConfig) -> int:
    """How many boats are numbered: those with positions, and those that a layout places beside them."""
    if fleet.positions:
        return (fleet.layout and fleet.usv_count) or len(fleet.positions)
    if fleet.layout or not any(entry.pose for entry in fleet.boats):
        return fleet.usv_count or 0
    return 0


def _slot_of(entry: BoatEntry, index: int, count: int) -> int | None:
    """Index of the numbered boat that an entry is about, by its name or else by its place; None: a new one."""
    number = (entry.name or "").removeprefix("wamv")
    if entry.name and entry.name.startswith("wamv") and number.isdecimal() and 1 <= int(number) <= count:
        return int(number) - 1
    return index if index < count and (entry.name is None or entry.pose is None) else None


def _count_faults(fleet: FleetConfig) -> Faults:
    given, key = fleet.usv_count, "positions" if fleet.positions else "boats"
    listed = len(getattr(fleet, key))
    counted = fleet.positions or (not fleet.layout and any(entry.pose for entry in fleet.boats))
    if given is not None and counted and (given < listed or (given > listed and not fleet.layout)):
        yield ("usv_count",), f"{given}, but `{key}` has {listed}"
    if fleet.layout and given is None and not fleet.positions:
        yield ("usv_count",), f"required for layout {fleet.layout} without positions"


def _entry_faults(fleet: FleetConfig) -> Faults:
    count, taken = _count(fleet), set()
    for index, entry in enumerate(fleet.boats):
        slot = _slot_of(entry, index, count)
        if slot is None and entry.pose is None:
            yield ("boats", index, "pose"), f"required: the layout places only {count} boats"
        elif slot in taken:
            yield ("boats", index), f"duplicate entry for wamv{(slot or 0) + 1}"
        if slot is not None:
            taken.add(slot)


def room_faults(fleet: FleetConfig, seed: int) -> Faults:
    """A random layout whose square is full before all its boats have a place."""
    count = _count(fleet)
    done = len(spots(fleet, count, seed))
    if done < count:
        enough, key = roomy_square(fleet.spacing, count), "size" if fleet.size else "layout"
        edge = fleet.size or enough
        text = f"{done} of {count} boats fit in {edge:g} m x {edge:g} m, {fleet.spacing:g} m apart"
        yield (key,), f"{text}; use {math.ceil(enough)} m or more, or a smaller spacing"


def load_fleet(source: Source | None, world: WorldConfig) -> FleetConfig:
    """The fleet of a name, a path or a dict, checked in a world; None: one boat at the world's spawn pose."""
    section, stem = document(
        "fleets", {} if source is None else source, "fleet" if isinstance(source, Mapping) and source else "single"
    )
    fleet = validate(FleetConfig, section, Loading(), name=stem)
    fleet._section = section
    boats = fleet.boats_in(world)
    layouts = (((*slot.own, "thrusters"), text) for boat, slot in boats if (text := boat.layout_fault))
    found = [*_name_faults(boats, world), *layouts, *room_faults(fleet, world.seed)]
    problems = [*(problem_at(section, loc, str(message)) for loc, message in found), *_wind_problems(world, boats)]
    if problems:
        raise ConfigError(dict.fromkeys(problems))
    if not fleet.is_empty:
        if fleet.headings is None:
            _warn_of_bearings(fleet)
            _warn_of_radians(fleet)
        warn_of_degrees(f"fleet {fleet.name}", _angles(fleet))
    return fleet


def _name_faults(boats: Sequence[tuple[BoatConfig, Slot]], world: WorldConfig) -> Faults:
    taken = {thing.name: f"an object of world {world.name}" for thing in world.placements}
    for boat, slot in boats:
        if boat.name in taken:
            loc = (*slot.own, "name") if slot.own else slot.where
            yield loc, f"duplicate name '{boat.name}': it is the name of {taken[boat.name]}"
        taken[boat.name] = "another boat"


def _wind_problems(world: WorldConfig, boats: Sequence[tuple[BoatConfig, Slot]]) -> Iterator[Problem]:
    """Wind on things that are no boats, docks, objects of the world, nor kinds of such."""
    listed = (world.wind.objects if world.wind else None) or ()
    if not listed:
        return
    plain = {name for boat, _ in boats for name in (boat.name, boat.robot)} | {dock.name for dock in world.docks}
    plain |= {name for thing in world.objects for name in (thing.name, thing.model)}
    unclear = [(index, thing) for index, thing in enumerate(listed) if thing.model not in plain]
    known = {*plain, *_names(world.objects, ""), *catalogue("robots")} if unclear else plain
    for index, thing in unclear:
        if thing.model not in known:
            error = UnknownNameError("boat, object, dock or robot", thing.model, sorted(known))
            yield problem_at(world.section, ("wind", "objects", index, "model"), str(error))


def _names(placements: Sequence[Placement], prefix: str) -> Iterator[str]:
    for thing in placements:
        yield from (prefix + thing.name, thing.model)
        yield from _names(thing.config.objects, f"{prefix}{thing.name}/")


def far_from_all(fleet: FleetConfig, boats: Sequence[tuple[BoatConfig, Slot]], world: WorldConfig) -> str:
    """How far a fleet is from everything in a world, if that is suspicious; else empty."""
    if not boats or fleet.is_empty:
        return ""
    places = [("the spawn pose", world.spawn.pose), *((f"'{thing.name}'", thing.pose) for thing in world.placements)]
    distance, nearest = min((math.dist(boat.pose[:2], pose[:2]), name) for boat, _ in boats for name, pose in places)
    if distance <= _FAR_AWAY:
        return ""
    text = f"fleet {fleet.name} is {distance:.0f} m from {nearest}, the nearest thing in world {world.name}"
    return f"{text}; more than {_FAR_AWAY:.0f} m"


def _warn_of_bearings(fleet: FleetConfig) -> None:
    """Positions whose headings point away from their middle, all of them, if they are bearings, and only then."""
    places = fleet.positions
    if len(places) > 1 and _all_outward(places, "compass") and not _all_outward(places, "math"):
        text = f"fleet {fleet.name}: its headings point outward as compass bearings only, but are read as degrees"
        advice = "write `headings: compass` for bearings, or `headings: math` to keep this"
        warn(f"{text} counter-clockwise from x; {advice}", 3)


def _warn_of_radians(fleet: FleetConfig) -> None:
    """Headings in degrees that are all within a full turn in radians, the unit of poses."""
    places = [(f"positions[{i}].Y", position.Y) for i, position in enumerate(fleet.positions)]
    own = [(key, getattr(fleet, key)) for key in ("heading", "start_angle")]
    said = [(key, angle) for key, angle in (*places, *own) if isinstance(angle, float | int) and angle]
    if said and all(abs(angle) < FULL_TURN for _, angle in said):
        key, angle = said[0]
        text = f"fleet {fleet.name}: {key} {angle:g} is read as degrees, unlike the radians of poses"
        advice = f"write {math.degrees(angle):.6g} for {angle:g} rad, or `headings: math` to keep this"
        warn(f"{text}; {advice}", 3)


def _all_outward(positions: Sequence[FleetPosition], headings: Headings) -> bool:
    x0, y0 = fmean(position.x for position in positions), fmean(position.y for position in positions)
    poses = (position.pose_in(headings) for position in positions)
    turns = (math.remainder(yaw - math.atan2(y - y0, x - x0), 2 * math.pi) for x, y, *_, yaw in poses)
    return all(abs(turn) <= _OUTWARD for turn in turns)


def _angles(fleet: FleetConfig) -> list[tuple[str, Sequence[float]]]:
    origin = [("origin", fleet.origin[2:])] if isinstance(fleet.origin, tuple) else []
    return [*origin, *((entry.name or "boats", entry.pose[3:]) for entry in fleet.boats if entry.pose)]
