"""What a task lays out, in the views of a recording: gates, zones of bays, circles, paths and beacons.

What moves with something hangs on its entity: zones on their dock, circles on their animals.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.arrays import FloatArray
from vrx_mj.config.bays import RGB
from vrx_mj.draw.course import Course, Light, course_of, zone_corners
from vrx_mj.model import tasks
from vrx_mj.model.world import Parameters
from vrx_mj.recording.static_chunks import static
from vrx_mj.tasks.frame import Pose
from vrx_mj.tasks.gates import gate_between

__all__ = [
    "FATES",
    "GATES",
    "animal_color",
    "animal_path",
    "bay_color",
    "bays_path",
    "course_chunks",
    "gate_lines",
]

Rgb = tuple[int, int, int]

HEIGHT = 0.35
"""Height over the mean water of what is drawn [m], so that few waves hide it."""
FATES: Mapping[str, Rgb] = {
    "next": (255, 214, 64),
    "ahead": (235, 245, 255),
    "crossed": (70, 220, 110),
    "missed": (150, 150, 160),
    "backwards": (255, 70, 60),
}
"""Colours of gates by what became of them; `next` is the first that is ahead."""
RIGHT, WRONG, INSIDE, DOCKED = (70, 220, 110), (150, 160, 170), (255, 214, 64), (60, 150, 255)
"""Colours of bays: to dock in, others, with the boat in it, docked in."""
STATUS: Mapping[str, Rgb] = {
    "never_engaged": (235, 245, 255),
    "engaged": (255, 214, 64),
    "not_engaged": (190, 200, 210),
    "circumnavigated": (70, 220, 110),
}
"""Colours of circles by what the boat does with the animal."""
LOST: Rgb = (130, 90, 90)
"""Colour of the circle of an animal to keep away from, once the boat did not."""
AVOID, PATH, BEACON, SHOWING = (255, 70, 60), (170, 150, 255), (255, 64, 200), (190, 200, 210)
GATES = "/world/course/gates"
ARROW_SHARE = 0.35
HEAD_SHARE = 0.08
"""Length of a gate's arrow and of its head, in widths of the gate."""
CORNERS = 48
"""Corners of a circle."""


def animal_path(name: str) -> str:
    """The entity of an animal's circle."""
    return f"/world/objects/{name}/circle"


def bays_path(task: tasks.Dock) -> str:
    """The entity of the zones in which a boat stays to dock."""
    return f"/world/docks/{task.anchor}/bays"


def bay_color(bay: tasks.Bay, progress: Mapping[str, Any]) -> Rgb:
    """The colour of a bay by what the boat has done there."""
    if bay.name in progress.get("docked", ()):
        return DOCKED
    if progress.get("bay") == bay.name:
        return INSIDE
    return RIGHT if bay.dock_allowed else WRONG


def animal_color(animal: Mapping[str, Any]) -> Rgb:
    """The colour of an animal's circle, by its goal and its status."""
    if animal["goal"] == "avoid" and animal["status"] != "never_engaged":
        return LOST
    return AVOID if animal["goal"] == "avoid" else STATUS[animal["status"]]


def course_chunks(parameters: Parameters | None) -> Iterator[Chunk]:
    """Every static chunk of what the task of a world lays out; what changes, as colours do, comes with the frames."""
    if not (parameters and parameters.task):
        return
    course = course_of(parameters)
    if course.gates:
        yield from gate_chunks(len(course.gates))
    if isinstance(parameters.task, tasks.Dock):
        yield from bay_chunks(parameters.task)
    for animal in course.animals:
        strips = circle(animal.radius, animal.goal)
        yield static(animal_path(animal.name), rr.LineStrips3D.from_fields(strips=strips, radii=[thick(1.6)]))
    for light in course.lights:
        yield lamps(light)
    yield from places(course)


def gate_chunks(count: int) -> Iterator[Chunk]:
    """What stays of gates: sizes, and numbers."""
    yield static(GATES, rr.LineStrips3D.from_fields(radii=[thick(2.2)]))
    labels = [str(number) for number in range(1, count + 1)]
    yield static(f"{GATES}/numbers", rr.Points3D.from_fields(labels=labels, radii=[0.2], show_labels=True))


def gate_lines(left: Pose, right: Pose) -> list[FloatArray]:
    """A bar between a gate's buoys, and the shaft and the head of an arrow in the direction in which to cross it."""
    gate = gate_between(left, right)
    along = np.array([math.cos(gate.yaw), math.sin(gate.yaw), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    middle = np.array([gate.x, gate.y, HEIGHT])
    tip, head = middle + ARROW_SHARE * gate.width * along, HEAD_SHARE * gate.width
    bar = np.array([(left.x, left.y, HEIGHT), (right.x, right.y, HEIGHT)])
    barbs = [tip - head * (along - 0.6 * across), tip, tip - head * (along + 0.6 * across)]
    return [bar, np.array([middle, tip]), np.array(barbs)]


def thick(points: float) -> Any:
    """The radius of a line as thick in all views, whatever their scale."""
    return rr.Radius.ui_points(points)


def bay_chunks(task: tasks.Dock) -> Iterator[Chunk]:
    """The zones of bays, in the dock's frame: frames to stay in, dashed ones to back out to."""
    path, bays = bays_path(task), task.bays
    inside, outside = ([raised(zone_corners(getattr(bay, zone))) for bay in bays] for zone in ("internal", "external"))
    yield static(path, rr.LineStrips3D.from_fields(strips=[closed(ring) for ring in inside], radii=[thick(1.8)]))
    pieces = [dashes(closed(ring)) for ring in outside]
    colors = [bay_color(bay, {}) for bay, ring in zip(bays, pieces, strict=True) for _ in ring]
    strips = [piece for ring in pieces for piece in ring]
    yield static(f"{path}/external", rr.LineStrips3D(strips, colors=colors, radii=[thick(1.2)]))
    labels = [f"{bay.name} {bay.symbol}" + (" ✓" if bay.dock_allowed else "") for bay in bays]
    spots = [ring.mean(axis=0) for ring in outside]
    colors = [bay_color(bay, {}) for bay in bays]
    yield static(f"{path}/names", rr.Points3D(spots, labels=labels, colors=colors, radii=[0.06], show_labels=True))


def circle(radius: float, goal: str) -> list[FloatArray]:
    """A circle round an animal, dashed where it is to be avoided, else with heads of arrows in the wanted sense."""
    ring = circle_at((0.0, 0.0, HEIGHT), radius)
    if goal == "avoid":
        return [ring[i : i + 2] for i in range(0, CORNERS, 2)]
    sense = 1.0 if goal == "circumnavigate_counterclockwise" else -1.0
    return [ring, *(barb(radius, at, sense) for at in np.linspace(0.0, math.tau, 4, endpoint=False))]


def barb(radius: float, angle: float, sense: float) -> FloatArray:
    """The head of an arrow along a circle."""
    back = angle - sense * 1.2 / radius
    tail = [((radius + side) * math.cos(back), (radius + side) * math.sin(back), HEIGHT) for side in (0.7, -0.7)]
    return np.array([tail[0], (radius * math.cos(angle), radius * math.sin(angle), HEIGHT), tail[1]])


def lamps(light: Light) -> Chunk:
    """A light buoy's colours over it, in their order."""
    spots = [(light.x + 0.6 * (number - 1), light.y, 4.0) for number in range(len(light.colors))]
    colors = [tuple(round(255 * share) for share in RGB[color]) for color in light.colors]
    return static(f"/world/course/{light.name}", rr.Points3D(spots, colors=colors, radii=[0.22]))


def places(course: Course) -> Iterator[Chunk]:
    """Paths of what swims, beacons, and places where things come up."""
    for path in course.paths:
        strip = np.insert(closed(path.points) if path.closed else path.points, 2, HEIGHT, axis=1)
        line = rr.LineStrips3D(dashes(strip), colors=[PATH], radii=[thick(1.0)])
        yield static(f"/world/course/paths/{path.name}", line)
    for beacon in course.beacons:
        spot = (beacon.x, beacon.y, HEIGHT)
        arms = [[np.add(spot, (s, t, 0)), np.subtract(spot, (s, t, 0))] for s, t in ((1, 1), (1, -1))]
        around = [circle_at(spot, beacon.radius)] if beacon.radius else []
        entity = f"/world/course/{beacon.name.replace(' ', '_')}"
        yield static(entity, rr.LineStrips3D([*arms, *around], colors=[BEACON], radii=[thick(2.0)]))
        yield static(f"{entity}/name", rr.Points3D([spot], labels=[beacon.name], colors=[BEACON], radii=[0.1]))
    if course.showings:
        spots = [(showing.x, showing.y, HEIGHT) for showing in course.showings]
        yield static("/world/course/showings", rr.Points3D(spots, colors=[SHOWING], radii=[0.25]))


def circle_at(spot: Sequence[float], radius: float) -> FloatArray:
    """A ring round a place."""
    angle = np.linspace(0.0, math.tau, CORNERS + 1)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1) + spot


def closed(points: FloatArray) -> FloatArray:
    """Points, and the first once more."""
    return np.vstack([points, points[:1]])


def raised(points: FloatArray) -> FloatArray:
    """Points, over the waves."""
    return np.add(points, (0.0, 0.0, HEIGHT))


def dashes(strip: FloatArray) -> list[FloatArray]:
    """Pieces of a line of points (n, 3), dashes of about 0.6 m, longer where there would be many."""
    pieces = []
    for start, end in pairwise(strip):
        count = min(24, max(1, round(math.dist(start, end))))
        for share in np.arange(count) / count:
            ends = np.array([share + 0.2 / count, share + 0.8 / count])
            pieces.append(start + ends[:, None] * (end - start))
    return pieces
