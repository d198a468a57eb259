"""The task of a compiled world, resolved: one dataclass for each set of rules."""

from collections.abc import Iterator, Mapping
from dataclasses import field, fields, is_dataclass
from typing import Annotated, Literal, TypeVar, get_args, get_type_hints

from pydantic import Field

from vrx_mj.model.kinds import Angle, Latitude, Longitude, NonNegative, Pose, Positive, Real, Text, Vec3, late, record

_Size = tuple[NonNegative, NonNegative, NonNegative]
_Kind = TypeVar("_Kind")
_Many = Annotated[tuple[_Kind, ...], Field(max_length=100_000)]
Habit = Literal["avoid", "circumnavigate_clockwise", "circumnavigate_counterclockwise"]
THING, BOAT = "object or dock", "boat"
"""Kinds of what moves, by whose poses rules judge."""


def _name_of(kind: str) -> Mapping[str, str]:
    """Metadata of a field that names something in the world."""
    return {"name_of": kind}


@record
class TaskBase:
    """Fields of all tasks."""

    type: str
    """Which set of rules."""
    name: Text
    """VRX's task_name."""
    boat: Text
    """Name of the boat that is scored."""
    profile: Literal["vrx", "vrx3"]
    """Whose rules: VRX classic's, or VRX 3's."""
    durations: tuple[NonNegative, NonNegative, NonNegative]
    """Lengths of the phases initial, ready and running [s]."""
    collision_buffer: NonNegative
    """Time after a counted collision in which others do not count [s]."""
    locked: bool
    """Whether the boat is held until the task is ready."""
    held: bool = False
    """Whether it is held throughout."""
    fixed: Mapping[Text, Pose] = field(metadata=late(1))
    """Poses of what never moves, by name [m, rad]."""
    rivals: _Many[Text] = field(metadata=late(3))
    """Names of all that the boat may touch, in the order of the MJCF's contact sensors."""


@record
class Goal:
    """A place on the water and a heading."""

    x: Real
    """Along x [m]."""
    y: Real
    """Along y [m]."""
    yaw: Angle
    """Heading [rad], counter-clockwise from x."""
    latitude: Latitude | None
    """Latitude [degrees]; None without a georeference."""
    longitude: Longitude | None
    """Longitude [degrees]; None without a georeference."""


@record
class Pinger:
    """Place of a beacon."""

    x: Real
    """Along x [m]."""
    y: Real
    """Along y [m]."""
    z: Real
    """Along z [m]."""
    latitude: Latitude | None
    """Latitude [degrees]; None without a georeference."""
    longitude: Longitude | None
    """Longitude [degrees]; None without a georeference."""


@record
class Gate:
    """Gate of a course: two buoys."""

    left: Text = field(metadata=_name_of(THING))
    """Name of VRX's left buoy, which comes to starboard of a boat that crosses as it should."""
    right: Text = field(metadata=_name_of(THING))
    """Name of the other buoy, which comes to port."""


@record
class Channel:
    """A channel of gates."""

    gates: _Many[Gate]
    """The gates, in their order."""
    obstacle_penalty: NonNegative
    """Penalty for a collision [s]."""
    collision_buffer: NonNegative
    """Time after a counted collision in which others do not count [s]."""


@record
class ShownObject:
    """An object that appears in front of the boat for a while."""

    time: NonNegative
    """Time at which it appears, from the start of the run [s]."""
    duration: Positive
    """Time for which it is visible [s]."""
    type: Text
    """Type in a correct report."""
    name: Text = field(metadata=_name_of(THING))
    """Name of the object."""
    pose: Pose
    """Pose in the boat's frame [m, rad]."""
    stash: Pose
    """Pose where it waits [m, rad]."""


@record
class Box:
    """A box in a dock's frame."""

    center: Vec3
    """Centre [m]."""
    size: _Size
    """Edges [m]."""


@record
class Bay:
    """A bay of a dock."""

    name: Text
    """Name of the bay."""
    placard: Text | None = field(metadata=_name_of("placard"))
    """Name of its placard."""
    symbol: Text
    """Symbol that the task makes the placard show."""
    internal: Box
    """Zone in which a boat is in it."""
    external: Box
    """Zone in which a boat is before it."""
    dock_allowed: bool
    """Whether it is the right one."""


@record
class Hole:
    """A hole in a placard."""

    bay: Text
    """Name of its bay."""
    size: Literal["big", "small"]
    """Kind of hole."""
    center: Vec3
    """Centre in the dock's frame [m]."""
    box: _Size
    """Edges of the box around it [m]."""
    points: NonNegative
    """Points for each ball [points]."""


@record
class Animal:
    """Animal of a task."""

    name: Text = field(metadata=_name_of(THING))
    """Name of the object."""
    model: Text
    """Its model."""
    goal: Habit
    """Required behaviour near it."""


@record
class Stationkeeping(TaskBase):
    """Stay at a pose."""

    type: Literal["stationkeeping"]
    goal: Goal
    """The pose."""
    heading: bool
    """Whether the heading counts."""


@record
class Wayfinding(TaskBase):
    """Pass near poses."""

    type: Literal["wayfinding"]
    waypoints: Annotated[_Many[Goal], Field(min_length=1)]
    """The poses."""


@record
class Perception(TaskBase):
    """Report objects that show up."""

    type: Literal["perception"]
    objects: _Many[ShownObject]
    """The objects."""
    loop_forever: bool
    """Whether they show up again."""


@record
class Navigation(Channel, TaskBase):
    """Pass gates without a collision."""

    type: Literal["navigation_course"]


@record
class FollowPath(TaskBase):
    """Pass gates for points."""

    type: Literal["follow_path"]
    gates: _Many[Gate]
    """The gates, in their order."""
    points_per_gate_crossed: NonNegative
    """Points for a gate [points]."""
    bonus: NonNegative
    """Bonus for a gate crossed directly after the previous one, and for the last gate [points]."""
    obstacle_penalty: NonNegative
    """Penalty for a collision [points]."""


@record
class Dock(TaskBase):
    """Dock in the right bay, and shoot balls into holes."""

    type: Literal["dock", "scan_and_dock", "scan_dock_deliver"]
    dock: Text
    """Name that the file gives the dock."""
    anchor: Text = field(metadata=_name_of(THING))
    """Name of the dock."""
    bays: Annotated[_Many[Bay], Field(min_length=1)]
    """The bays."""
    holes: _Many[Hole]
    """The holes that count."""
    balls: _Many[Text] = field(metadata={**late(2), **_name_of(THING)})
    """Names of the boat's balls."""
    light_buoy: Text | None = field(metadata=_name_of("light"))
    """Name of the light buoy."""
    color_sequence: tuple[Text, Text, Text]
    """Colours that it shows."""
    color_bonus_points: NonNegative
    """Points for a correct report of the colours [points]."""
    dock_bonus_points: NonNegative
    """Points for docking [points]."""
    correct_dock_bonus_points: NonNegative
    """Bonus for docking in the correct bay [points]."""
    enable_color_checker: bool
    """Whether the colours can be sent."""
    min_dock_time: NonNegative
    """Time to stay in the bay [s]."""


@record
class Wildlife(TaskBase):
    """Circle some animals and avoid others."""

    type: Literal["wildlife"]
    animals: Annotated[_Many[Animal], Field(min_length=1)]
    """The animals."""
    engagement_distance: Positive
    """Distance within which an animal is engaged [m]."""
    time_bonus: NonNegative
    """Bonus for each animal with the required behaviour [s]."""
    publication_rate: Positive | None
    """Rate at which the animals' positions are published [Hz]; by default at every check of the task."""


@record
class Gymkhana(TaskBase):
    """Pass a channel, then stay near a beacon."""

    type: Literal["gymkhana"]
    channel: Channel
    """The channel."""
    pinger: Pinger
    """The beacon."""
    obstacle_penalty: NonNegative
    """Penalty for a collision [m]."""


@record
class AcousticPerception(TaskBase):
    """Find a beacon."""

    type: Literal["acoustic_perception"]
    pinger: Pinger
    """The beacon."""
    goal_tolerance: Positive
    """Distance in three dimensions at which it counts as reached [m]."""


@record
class AcousticTracking(TaskBase):
    """Follow a beacon that moves."""

    type: Literal["acoustic_tracking"]
    pinger: Text = field(metadata=_name_of(THING))
    """Name of the object under which the beacon hangs."""
    pinger_depth: Real
    """z of the beacon that receivers detect [m]; in VRX it is above the water."""
    obstacle_penalty: NonNegative
    """Penalty for a collision [m]."""


Task = Annotated[
    Stationkeeping
    | Wayfinding
    | Perception
    | Navigation
    | FollowPath
    | Dock
    | Wildlife
    | Gymkhana
    | AcousticPerception
    | AcousticTracking,
    Field(discriminator="type"),
]
"""A task of any type."""

TASKS: Mapping[str, type[TaskBase]] = {
    name: kind for kind in get_args(get_args(Task)[0]) for name in get_args(get_type_hints(kind)["type"])
}
"""Compiled forms of tasks, by type."""


def parts_of(task: TaskBase | None, kind: type[_Kind]) -> Iterator[_Kind]:
    """All parts of a kind in a task, such as its gates, in the order of its fields."""
    return (part for _, part in _walk("", task) if isinstance(part, kind))


def names_in(task: TaskBase) -> Iterator[tuple[str, str, str]]:
    """Names by which a task refers to its world: place in the task, kind of thing, name."""
    for place, part in _walk("", task):
        for own in fields(part) if is_dataclass(part) else ():
            kind = own.metadata.get("name_of", "")
            found = _walk(f"{place}.{own.name}", vars(part).get(own.name)) if kind else ()
            yield from ((spot.removeprefix("."), kind, name) for spot, name in found if isinstance(name, str))


def followed_things(task: TaskBase) -> tuple[str, ...]:
    """Names of the objects, docks and other boats whose poses a task's rules need, each once."""
    return tuple(dict.fromkeys(name for _, kind, name in names_in(task) if kind in {THING, BOAT}))


def _walk(place: str, part: object) -> Iterator[tuple[str, object]]:
    """A part of a task with its place, then the parts of that."""
    yield place, part
    if isinstance(part, tuple):
        for number, item in enumerate(part):
            yield from _walk(f"{place}[{number}]", item)
    elif is_dataclass(part):
        for name, item in vars(part).items():
            yield from _walk(f"{place}.{name}", item)
