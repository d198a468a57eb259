"""What a map or a recording shows of a world and its task, as plain data: gates, bays, circles, paths, beacons."""

import colorsys
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.arguments import check_kind
from vrx_mj.arrays import FloatArray
from vrx_mj.constants import DOCK_CELL
from vrx_mj.draw.style import boat_color, hex_color
from vrx_mj.frames import quaternion, rotation_matrix
from vrx_mj.mjcf.objects import BALL
from vrx_mj.mjcf.world import World
from vrx_mj.model import tasks
from vrx_mj.model.boats import Boat, boat_label
from vrx_mj.model.kinds import Pose as StartPose
from vrx_mj.model.things import Dock, Object
from vrx_mj.model.water import Sea, Wind
from vrx_mj.model.world import Parameters
from vrx_mj.tasks.courses import gate_between
from vrx_mj.tasks.perception import ahead_of
from vrx_mj.tasks.referee import Pose

if TYPE_CHECKING:
    import mujoco


_Point = tuple[float, float]
_DARK = ("off", "off", "off")
_NO_FLEET = "single"
"""Name that the compiler gives the one boat of a world without a fleet."""


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
        """Points that a picture of the course has to contain."""
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
    """Layout of the task of a world; animals, lights and their paths also where it has no task."""
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
    """Symbol of every placard of a world, by name: the one that the task makes it show, or its own."""
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
    for item in tasks.parts_of(task, tasks.ShownObject):
        assert task is not None
        x, y, *_ = ahead_of(poses[task.boat], item.pose)
        yield Showing(item.name, item.type, x, y, item.time, item.time + item.duration)


Rgb = tuple[float, float, float]

_EMPTY = Course()


@dataclass(frozen=True)
class MapDock:
    """A dock: the centres of its cells (n, 2) [m] in the world frame, its yaw [rad] and the edge of a cell [m]."""

    name: str
    cells: FloatArray
    yaw: float
    block: float = DOCK_CELL


@dataclass(frozen=True)
class MapObject:
    """A buoy, a post, ... at (x, y) [m]; `size` is its width as seen from above [m]."""

    name: str
    model: str
    x: float
    y: float
    color: Rgb
    size: float
    floating: bool = True


@dataclass(frozen=True)
class MapPlacard:
    """A placard at (x, y) [m] and its symbol, such as `red_circle`."""

    name: str
    x: float
    y: float
    symbol: str


@dataclass(frozen=True)
class MapBoat:
    """A boat at (x, y) [m] that heads to `yaw` [rad]; any colour matplotlib knows."""

    name: str
    x: float
    y: float
    yaw: float
    color: str | Rgb


@dataclass(frozen=True)
class MapScene:
    """All that a map shows. Lengths in m, world frame."""

    title: str
    shore: tuple[FloatArray, ...] = ()
    """Rings (n, 2), the land on their left."""
    docks: tuple[MapDock, ...] = ()
    objects: tuple[MapObject, ...] = ()
    boats: tuple[MapBoat, ...] = ()
    waypoints: tuple[tuple[float, float, float], ...] = ()
    """Places x, y and headings [rad], in their order."""
    wind: Wind | None = None
    sea: Sea | None = None
    """Wind and waves, where there are any."""
    placards: tuple[MapPlacard, ...] = ()
    course: Course = _EMPTY
    """Layout of the task."""
    x_from_east: float = 0.0
    """Direction of the x axis [rad], counter-clockwise from east."""


def map_of(world: World) -> MapScene:
    """The map of a compiled world at its start; CommandError if it is not one."""
    check_kind("map_of", world, World, "a World, as compile_world returns it")
    values = world.parameters
    fleet = f" with {values.fleet}" if values.fleet not in {"", _NO_FLEET} else ""
    wind, sea = values.wind, values.sea
    model = _model(world)
    shown = world.parameters.objects if model is not None else ()  # the MJCF holds their colours and widths
    return MapScene(
        title=f"{values.name}{fleet}",
        shore=tuple(np.asarray(ring, dtype=np.float64) for ring in values.shoreline),
        docks=tuple(_dock(dock) for dock in values.docks),
        objects=tuple(_object(model, item) for item in shown if item.model != BALL),
        boats=tuple(_boat(boat, i) for i, boat in enumerate(values.boats)),
        waypoints=values.waypoints,
        wind=wind if wind.mean > 0.0 else None,
        sea=sea if sea.waves else None,
        placards=tuple(_placards(world, model)),
        course=course_of(values),
        x_from_east=values.x_from_east,
    )


def _model(world: World) -> "mujoco.MjModel | None":
    """MuJoCo's model of the world, which has the looks of things and where placards hang; None where it has neither."""
    import mujoco

    if not world.parameters.objects and not world.parameters.placards:
        return None
    return mujoco.MjModel.from_xml_string(world.mjcf, assets=dict(world.assets))


def _dock(dock: Dock) -> MapDock:
    x, y, *_, yaw = dock.pose
    local = dock.block * np.asarray(dock.cells, dtype=np.float64).reshape(-1, 2)
    return MapDock(dock.name, local @ turn_matrix(yaw).T + [x, y], yaw, dock.block)


def turn_matrix(yaw: float) -> FloatArray:
    """The rotation (2, 2) by an angle [rad]."""
    return np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])


def _boat(boat: Boat, index: int) -> MapBoat:
    x, y, *_, yaw = boat.pose
    return MapBoat(boat_label(boat.name, boat.robot), x, y, yaw, hex_color(boat_color(index, boat.color)))


def _placards(world: World, model: "mujoco.MjModel | None") -> Iterator[MapPlacard]:
    import mujoco

    rows = world.parameters.placards
    if model is None or not rows:
        return
    data, symbols = mujoco.MjData(model), symbols_of(world.parameters)
    mujoco.mj_kinematics(model, data)
    for row in rows:
        x, y, _ = data.body(row.body).xpos.tolist()
        yield MapPlacard(row.name, x, y, symbols[row.name])


def _object(model: "mujoco.MjModel", item: Object) -> MapObject:
    color, size = _look(model, model.body(item.body).id)
    x, y = item.pose[:2]
    return MapObject(item.name, item.model, x, y, color, size, item.kind == "floating")


def _look(model: "mujoco.MjModel", body: int) -> tuple[Rgb, float]:
    """The colour that shows most of a body, vivid ones first, and the body's width [m]."""
    first, count = model.body_geomadr[body], model.body_geomnum[body]
    seen = [i for i in range(first, first + count) if model.geom_group[i] < 3 and model.geom_rgba[i, 3] > 0.1]
    shares: dict[Rgb, float] = {}
    width = 0.5
    for i in seen:
        half = model.geom_aabb[i, 3:]
        red, green, blue = (float(share) for share in model.geom_rgba[i, :3])
        color = (red, green, blue)
        vivid = 0.2 + colorsys.rgb_to_hsv(*color)[1]
        shares[color] = shares.get(color, 0.0) + vivid * float(
            half[0] * half[1] + half[1] * half[2] + half[2] * half[0]
        )
        width = max(width, 2.0 * float(sorted(half)[1]))
    return max(shares, key=lambda color: shares[color], default=(0.5, 0.5, 0.5)), width


def object_color(item: MapObject) -> str:
    """The colour of an object as `#rrggbb`."""
    return hex_color(round(255 * min(max(share, 0.0), 1.0)) for share in item.color)


def ground_of(scene: MapScene) -> dict[str, object]:
    """The shore and the docks for JSON."""
    docks = [
        {"name": dock.name, "cells": to_centimetres(dock.cells), "yaw": dock.yaw, "cell": dock.block}
        for dock in scene.docks
    ]
    return {"shore": [to_centimetres(ring) for ring in scene.shore], "docks": docks}


def to_centimetres(points: Iterable[Sequence[float]] | FloatArray) -> list[list[float]]:
    """Points [m] to a centimetre."""
    return [[round(float(x), 2), round(float(y), 2)] for x, y in points]
