"""Where the views of a recording look from, and what they follow."""

from __future__ import annotations

import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.course import course_of
from vrx_mj.recording.record_scene import RecordScene

FLEET, PLANNED, PLAN = "/world/fleet", "/world/fleet/plan", "/world/plan"
"""Entities: in the middle of what the camera follows, what a plan follows there, and one that frames a track."""
PLAN_MARGIN = 8.0
"""Water around the outermost body in the plan [m]."""
PLAN_REACH = 40.0
"""How far from the outermost boat a body may be and still be fitted into the plan [m]."""
PLAN_SLOPE = 0.5
"""Half the height of what the plan shows, per height of its eye: the viewer's lens."""
PLAN_ASPECT = 1.3
"""Width of the plan's view, in its heights, about."""
PLAN_LINE = 0.09
"""Height of a line of figures at the upper edge of the plan, in heights of the plan."""


def around(distance: float) -> list[list[float]]:
    """Points on either side of a followed entity, from which a viewer looks at it from `distance` [m].

    A viewer that meets the entity in its first picture goes to 1.5 times the length of what the entity holds.
    """
    return [[distance / 3.0, 0.0, 0.0], [-distance / 3.0, 0.0, 0.0]]


def sea_eye(reach: float) -> FloatArray:
    """The way (3,) [m] from what the sea's view follows to its eye; `reach` [m] holds it all, and grows by a third."""
    return (9.0 + 2.0 * reach) * np.array([-0.72, -0.72, 0.42])


def plan_eye(scene: RecordScene, track: FloatArray | None = None) -> tuple[FloatArray, float]:
    """What the plan's eye is over (2,) [m], and its height [m]: figures of the weather have room over a track."""
    middle, radius = plan_circle(scene, track)
    half = (radius + PLAN_MARGIN) / (1.0 if track is None else 1.0 - PLAN_LINE * len(scene.weather()))
    return middle + (half - radius - PLAN_MARGIN) * east_and_north(scene)[1], half / PLAN_SLOPE


def east_and_north(scene: RecordScene) -> FloatArray:
    """Unit vectors (2, 2) to the east and to the north, along x and y."""
    x = scene.parameters.x_from_east if scene.parameters else 0.0
    return np.array([[math.cos(x), -math.sin(x)], [math.sin(x), math.cos(x)]])


def plan_circle(scene: RecordScene, track: FloatArray | None) -> tuple[FloatArray, float]:
    """Middle (2,) and radius [m] of the plan: of the whole track and what it starts from, or around the fleet."""
    middle, reach = fleet_circle(scene)
    places = plan_places(scene, middle, reach)
    if track is None:
        return middle, max([reach, *(math.dist(place, middle) for place in places)])
    axes = east_and_north(scene)
    places = np.vstack([places, [(x, y) for x in track[:, 0] for y in track[:, 1]]]) @ axes.T
    low, high = places.min(axis=0), places.max(axis=0)
    width, height = high - low
    return (low + high) / 2.0 @ axes, max(10.0, float(height) / 2.0, float(width) / 2.0 / PLAN_ASPECT)


def plan_places(scene: RecordScene, middle: FloatArray, reach: float) -> FloatArray:
    """Places (n, 2) [m] that the plan holds: the fleet, and all that a task lays out or else what is near."""
    boats = [boat.pose[:2] for boat in scene.boats()]
    if scene.parameters and scene.parameters.task:
        laid = [*course_of(scene.parameters).spots(), *(waypoint.position[:2] for waypoint in scene.waypoints)]
        return np.reshape([*laid, *boats], (-1, 2))
    others = (body.pose[:2] for body in scene.bodies if body.kind != "ball")
    near = (place for place in others if math.dist(place, middle) < reach + PLAN_REACH)
    return np.reshape([*boats, *near], (-1, 2))


def followed_path(scene: RecordScene) -> str:
    """The entity that the camera follows."""
    return FLEET if scene.follow is None else f"/world/boats/{scene.follow}/label"


def followed_circle(scene: RecordScene) -> tuple[FloatArray, float]:
    """Middle (2,) and radius [m] of what is followed when recording starts."""
    own = [boat.pose[:2] for boat in scene.boats() if boat.name == scene.follow]
    return (np.array(own[0]), 0.0) if own else fleet_circle(scene)


def fleet_circle(scene: RecordScene) -> tuple[FloatArray, float]:
    """Middle (2,) and radius [m] of the fleet when recording starts."""
    places = np.array([boat.pose[:2] for boat in scene.boats() or scene.bodies])
    if not len(places):
        return np.zeros(2), 10.0
    middle = places.mean(axis=0)
    return middle, math.sqrt(float(((places - middle) ** 2).sum(axis=1).max()))
