"""What a task lays out in the world: gates, bays, circles, paths and beacons, for maps and recordings. Plain data."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import quaternion, rotation_matrix
from vrx_mj.model import tasks
from vrx_mj.model.boats import Boat
from vrx_mj.model.kinds import Pose as StartPose
from vrx_mj.model.site import Dock, Object
from vrx_mj.model.world import Parameters
from vrx_mj.tasks.frame import Pose
from vrx_mj.tasks.gates import gate_between
from vrx_mj.tasks.perception import ahead_of

_Point = tuple[float, float]
_DARK = ("off", "off", "off")


@dataclass(frozen=True)
class GateBar:
    """A gate between two buoys at the start. Lengths in m, world frame, as in all that follows."""

    number: int
    """Number from 1, in the order in which gates are to be crossed."""
    left: _Point
    """The buoy that comes to starboard, as VRX's files call it."""
    right: _Point
    yaw: float
    """Direction in which to cross it [rad], counter-clockwise from x."""

    @property
    def middle(self) -> _Point:
        """Halfway between the buoys."""
        return (self.left[0] + self.right[0]) / 2.0, (self.left[1] + self.right[1]) / 2.0


@dataclass(frozen=True, eq=False)
class Bay:
    """A bay of a dock: corners (4, 3) of where a boat must stay, and of where it then backs out to."""

    name: str
    symbol: str
    right: bool
    """Whether it is one of those to dock in."""
    internal: FloatArray
    external: FloatArray


@dataclass(frozen=True)
class Light:
    """A light buoy and the three colours that it goes through once the task runs."""

    name: str
    x: float
    y: float
    colors: tuple[str, ...]


@dataclass(frozen=True)
class Animal:
    """Something to circle or to keep away from."""

    name: str
    goal: str
    """avoid, circumnavigate_clockwise or circumnavigate_counterclockwise."""
    x: float
    y: float
    radius: float
    """Distance within which a boat is engaged with it [m]."""


@dataclass(frozen=True, eq=False)
class Path:
    """Where something swims: its start, then its waypoints (n, 2)."""

    name: str
    start: _Point
    points: FloatArray
    closed: bool
    """Whether it goes on to the first waypoint after the last one."""


@dataclass(frozen=True)
class Beacon:
    """A place to find, or where one that swims starts."""

    name: str
    x: float
    y: float
    radius: float = 0.0
    """Distance within which it counts as found [m]; 0 where only the distance counts."""


@dataclass(frozen=True)
class Showing:
    """An object that comes up before the boat, for a while."""

    name: str
    model: str
    x: float
    y: float
    start: float
    """Since the task began to run [s]."""
    end: float


@dataclass(frozen=True)
class Course:
    """All that a task lays out, as it is when the world starts."""

    gates: tuple[GateBar, ...] = ()
    bays: tuple[Bay, ...] = ()
    lights: tuple[Light, ...] = ()
    animals: tuple[Animal, ...] = ()
    paths: tuple[Path, ...] = ()
    beacons: tuple[Beacon, ...] = ()
    showings: tuple[Showing, ...] = ()

    def spots(self) -> Iterator[_Point]:
        """What a picture of the course has to hold."""
        for gate in self.gates:
            yield from (gate.left, gate.right)
        for bay in self.bays:
            yield from ((x, y) for x, y, _ in np.concatenate([bay.internal, bay.external]).tolist())
        for path in self.paths:
            yield from ((x, y) for x, y in path.points.tolist())
        rounds: tuple[Animal | Beacon, ...] = (*self.animals, *self.beacons)
        for place in rounds:
            yield from ((place.x + side * place.radius, place.y + side * place.radius) for side in (-1.0, 1.0))
        yield from ((light.x, light.y) for light in self.lights)
        yield from ((showing.x, showing.y) for showing in self.showings)


def nice_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is at most `most`."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most * (1 + 1e-9))


def course_of(world: Parameters) -> Course:
    """What the task of a world lays out; swimmers and lights also where it has no task."""
    task, poses = world.task, poses_of(world)
    return Course(
        gates=tuple(_gates(task, poses)),
        bays=tuple(_bays(task, poses)),
        lights=tuple(_lights(world, poses)),
        animals=tuple(_animals(task, poses)),
        paths=tuple(_paths(world, poses)),
        beacons=tuple(_beacons(task, poses)),
        showings=tuple(_showings(task, poses)),
    )


def symbols_of(world: Parameters) -> dict[str, str]:
    """What every placard of a world shows, by its name: what the task makes it show, or what it shows by itself."""
    wanted = {bay.placard: bay.symbol for bay in tasks.parts_of(world.task, tasks.Bay)}
    return {placard.name: wanted.get(placard.name, placard.symbol) for placard in world.placards}


def zone_corners(zone: tasks.Box) -> FloatArray:
    """Corners (4, 3) of a zone in its dock's frame, counter-clockwise, at the height of its bottom or of the water."""
    (x, y, z), (length, width, height) = zone.center, zone.size
    low = max(0.0, z - height / 2.0)
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    return np.array([(x + i * length, y + j * width, low) for i, j in corners], np.float64)


def poses_of(world: Parameters) -> dict[str, Pose]:
    """Where boats, objects and docks are at the start."""
    things: tuple[Object | Dock | Boat, ...] = (*world.objects, *world.docks, *world.boats)
    return {thing.name: _pose(thing.pose) for thing in things}


def _pose(pose: StartPose) -> Pose:
    x, y, z, *turns = pose
    return Pose(x, y, z, quaternion(*turns))


def _gates(task: tasks.Task | None, poses: Mapping[str, Pose]) -> Iterator[GateBar]:
    for number, gate in enumerate(tasks.parts_of(task, tasks.Gate), start=1):
        left, right = poses[gate.left], poses[gate.right]
        yield GateBar(number, (left.x, left.y), (right.x, right.y), gate_between(left, right).yaw)


def _bays(task: tasks.Task | None, poses: Mapping[str, Pose]) -> Iterator[Bay]:
    if not isinstance(task, tasks.Dock):
        return
    dock = poses[task.anchor]
    turn = rotation_matrix(np.array(dock.quaternion))
    for bay in task.bays:
        inside, outside = (
            zone_corners(zone) @ turn.T + [dock.x, dock.y, dock.z] for zone in (bay.internal, bay.external)
        )
        yield Bay(bay.name, bay.symbol, bay.dock_allowed, inside, outside)


def _lights(world: Parameters, poses: Mapping[str, Pose]) -> Iterator[Light]:
    task = world.task
    sequences = {task.light_buoy: task.color_sequence} if isinstance(task, tasks.Dock) else {}
    for light in world.lights:
        colors = tuple(color.lower() for color in sequences.get(light.name, light.pattern))
        if colors != _DARK:
            yield Light(light.name, poses[light.name].x, poses[light.name].y, colors)


def _animals(task: tasks.Task | None, poses: Mapping[str, Pose]) -> Iterator[Animal]:
    if not isinstance(task, tasks.Wildlife):
        return
    for animal in task.animals:
        place = poses[animal.name]
        yield Animal(animal.name, animal.goal, place.x, place.y, task.engagement_distance)


def _paths(world: Parameters, poses: Mapping[str, Pose]) -> Iterator[Path]:
    for row in world.floats:
        if row.follower < 0:
            continue
        follower, name = world.followers[row.follower], row.body.rpartition("/")[0]
        first = follower.waypoint_start
        rows = world.path_points[first : first + follower.waypoint_count]
        points = np.array([point.position for point in rows], np.float64)
        yield Path(name, (poses[name].x, poses[name].y), points, bool(follower.loop))


def _beacons(task: tasks.Task | None, poses: Mapping[str, Pose]) -> Iterator[Beacon]:
    if isinstance(task, tasks.AcousticTracking):
        yield Beacon(task.pinger, poses[task.pinger].x, poses[task.pinger].y)
    name = "black box" if isinstance(task, tasks.Gymkhana) else "beacon"
    radius = task.goal_tolerance if isinstance(task, tasks.AcousticPerception) else 0.0
    yield from (Beacon(name, pinger.x, pinger.y, radius) for pinger in tasks.parts_of(task, tasks.Pinger))


def _showings(task: tasks.Task | None, poses: Mapping[str, Pose]) -> Iterator[Showing]:
    for item in tasks.parts_of(task, tasks.Shown):
        assert task is not None
        x, y, *_ = ahead_of(poses[task.boat], item.pose)
        yield Showing(item.name, item.type, x, y, item.time, item.time + item.duration)
