"""What a task lays out in the world: gates, bays, circles, paths and beacons, for maps and recordings. Plain data."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.poses import quaternion
from vrx_mj.physics.motion import rotation_matrix
from vrx_mj.tasks.frame import Pose
from vrx_mj.tasks.gates import gate_between
from vrx_mj.tasks.perception import ahead_of

__all__ = [
    "Animal", "Bay", "Beacon", "Course", "GateBar", "Light", "Path", "Showing", "course_of", "gate_rows", "poses_of",
    "symbols_of", "zone_corners",
]  # fmt: skip

Point = tuple[float, float]
DARK = ("off", "off", "off")


@dataclass(frozen=True)
class GateBar:
    """A gate between two buoys at the start. Lengths in m, world frame, as in all that follows."""

    number: int
    """From 1, in the order in which gates are to be crossed."""
    left: Point
    """The buoy that comes to starboard, as VRX's files call it."""
    right: Point
    yaw: float
    """Direction in which to cross it [rad], counter-clockwise from east."""

    @property
    def middle(self) -> Point:
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
    """Within which a boat is engaged with it."""


@dataclass(frozen=True, eq=False)
class Path:
    """Where something swims: its start, then its waypoints (n, 2)."""

    name: str
    start: Point
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
    """Within which it counts as found; 0 where only the distance counts."""


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

    def spots(self) -> Iterator[Point]:
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


def course_of(parameters: Mapping[str, Any]) -> Course:
    """What the task of a world lays out, from the world's parameters; swimmers and lights also where it has no task."""
    task = parameters.get("task") or {}
    poses = poses_of(parameters)
    return Course(
        gates=tuple(_gates(task, poses)),
        bays=tuple(_bays(task, poses)),
        lights=tuple(_lights(task, parameters, poses)),
        animals=tuple(_animals(task, poses)),
        paths=tuple(_paths(parameters, poses)),
        beacons=tuple(_beacons(task, poses)),
        showings=tuple(_showings(task, poses)),
    )


def gate_rows(task: Mapping[str, Any]) -> Sequence[Mapping[str, str]]:
    """The gates of a task, or of its channel, by the names of their buoys."""
    rows: Sequence[Mapping[str, str]] = (task.get("channel") or task).get("gates", ())
    return rows


def symbols_of(parameters: Mapping[str, Any]) -> dict[str, str]:
    """What every placard of a world shows, by its name: what the task tells it, or what it shows by itself."""
    own = {row["name"]: row["symbol"] for row in parameters.get("placards", ())}
    told = {bay["placard"]: bay["symbol"] for bay in (parameters.get("task") or {}).get("bays", ())}
    return {name: told.get(name, symbol) for name, symbol in own.items()}


def zone_corners(zone: Mapping[str, Sequence[float]]) -> FloatArray:
    """Corners (4, 3) of a zone in its dock's frame, counter-clockwise, at the height of its bottom or of the water."""
    (x, y, z), (length, width, height) = zone["center"], zone["size"]
    low = max(0.0, z - height / 2.0)
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    return np.array([(x + i * length, y + j * width, low) for i, j in corners], np.float64)


def poses_of(parameters: Mapping[str, Any]) -> dict[str, Pose]:
    """Where boats, objects and docks are at the start."""
    rows = [*parameters["objects"], *parameters["docks"], *parameters["boats"]]
    return {row["name"]: _pose(row["pose"]) for row in rows}


def _pose(pose: Sequence[float]) -> Pose:
    x, y, z, *turns = pose
    return Pose(x, y, z, quaternion(*turns))


def _gates(task: Mapping[str, Any], poses: Mapping[str, Pose]) -> Iterator[GateBar]:
    for number, row in enumerate(gate_rows(task), start=1):
        left, right = poses[row["left"]], poses[row["right"]]
        yield GateBar(number, (left.x, left.y), (right.x, right.y), gate_between(left, right).yaw)


def _bays(task: Mapping[str, Any], poses: Mapping[str, Pose]) -> Iterator[Bay]:
    for bay in task.get("bays", ()):
        dock = poses[task["anchor"]]
        turn = rotation_matrix(np.array(dock.quaternion))
        inside, outside = (
            zone_corners(bay[zone]) @ turn.T + [dock.x, dock.y, dock.z] for zone in ("internal", "external")
        )
        yield Bay(bay["name"], bay["symbol"], bay["dock_allowed"], inside, outside)


def _lights(task: Mapping[str, Any], parameters: Mapping[str, Any], poses: Mapping[str, Pose]) -> Iterator[Light]:
    for row in parameters.get("lights", ()):
        told = task.get("color_sequence") if row["name"] == task.get("light_buoy") else None
        colors = tuple(str(color).lower() for color in told or row["pattern"])
        if colors != DARK:
            yield Light(row["name"], poses[row["name"]].x, poses[row["name"]].y, colors)


def _animals(task: Mapping[str, Any], poses: Mapping[str, Pose]) -> Iterator[Animal]:
    for row in task.get("animals", ()):
        place = poses[row["name"]]
        yield Animal(row["name"], row["goal"], place.x, place.y, float(task["engagement_distance"]))


def _paths(parameters: Mapping[str, Any], poses: Mapping[str, Pose]) -> Iterator[Path]:
    followers = parameters.get("followers", ())
    for row in parameters.get("floats", ()) if followers else ():
        number = row.get("follower", -1)
        if number is None or number < 0:
            continue
        follower, name = followers[number], row["body"].rpartition("/")[0]
        first = follower["waypoint_start"]
        rows = parameters["path_points"][first : first + follower["waypoint_count"]]
        points = np.array([point["position"] for point in rows], np.float64)
        yield Path(name, (poses[name].x, poses[name].y), points, bool(follower["loop"]))


def _beacons(task: Mapping[str, Any], poses: Mapping[str, Pose]) -> Iterator[Beacon]:
    place = task.get("pinger")
    if isinstance(place, str):
        yield Beacon(place, poses[place].x, poses[place].y)
    elif place is not None:
        name = "black box" if "channel" in task else "beacon"
        yield Beacon(name, place["x"], place["y"], float(task.get("goal_tolerance", 0.0)))


def _showings(task: Mapping[str, Any], poses: Mapping[str, Pose]) -> Iterator[Showing]:
    for row in task.get("objects", ()):
        x, y, *_ = ahead_of(poses[task["boat"]], row["pose"])
        yield Showing(row["name"], row["type"], x, y, row["time"], row["time"] + row["duration"])
