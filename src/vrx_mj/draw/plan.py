"""The plan: shore, docks, objects, waypoints and boats of the part of the world that matters."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.course_marks import course_things, draw_course
from vrx_mj.draw.labels import INK, Thing, label, write
from vrx_mj.draw.map_scene import MapBoat, MapScene

__all__ = ["SOFT", "Box", "draw_plan", "ground", "nice_length", "view_of"]


Box = tuple[float, float, float, float]
"""West, south, east and north [m]."""

WATER, LAND, SHORE, SOFT = "#dbe9f0", "#e9e2cd", "#9a8f6d", "#6c7f8a"
HULL_LENGTH, HULL_BEAM = 4.9, 2.4
"""Outline of a WAM-V [m]."""
LONELY = 80.0
"""An object with nothing within this distance [m] is far from everything."""
SMALL_COURSE = 70.0
"""A course of less than this many pixels gets one name for all its parts."""


def view_of(scene: MapScene, aspect: float) -> Box:
    """West, south, east and north of the plan [m]: what matters, and a margin, in the picture's shape."""
    spots = [(boat.x, boat.y) for boat in scene.boats] + [(x, y) for x, y, _ in scene.waypoints]
    spots += scene.course.spots()
    spots += [(x, y) for dock in scene.docks for x, y in dock.cells.tolist()]
    hidden = {showing.name for showing in scene.course.showings}
    objects = [(item.x, item.y) for item in scene.objects if item.name not in hidden]
    spots += [
        spot
        for i, spot in enumerate(objects)
        if not spots or _has_company(spot, objects[:i] + objects[i + 1 :] + spots)
    ]
    spots = spots or [(x, y) for ring in scene.shore for x, y in ring.tolist()] or [(0.0, 0.0)]
    low, high = np.min(spots, axis=0), np.max(spots, axis=0)
    east, north = (low + high) / 2.0
    width, height = np.maximum((high - low) * 1.16 + 8.0, 40.0)
    width, height = max(width, height * aspect), max(height, width / aspect)
    return (east - width / 2, north - height / 2, east + width / 2, north + height / 2)


def _has_company(spot: tuple[float, float], others: list[tuple[float, float]]) -> bool:
    """Whether anything is near: an object that lies far from everything does not widen the plan."""
    return any(math.dist(spot, other) < LONELY for other in others)


def draw_plan(axes: Any, scene: MapScene, view: Box) -> None:
    """Draw the part `view` of the world into `axes`."""
    ground(axes, scene, view)
    step = nice_length((view[2] - view[0]) / 7.0)
    axes.set_xticks(np.arange(math.ceil(view[0] / step), math.floor(view[2] / step) + 1) * step)
    axes.set_yticks(np.arange(math.ceil(view[1] / step), math.floor(view[3] / step) + 1) * step)
    axes.grid(color="#8fa8b4", linewidth=0.5, alpha=0.45)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=9, colors=SOFT, length=3)
    axes.set_xlabel("east [m]", fontsize=10, color=SOFT)
    axes.set_ylabel("north [m]", fontsize=10, color=SOFT)
    pixel = (view[2] - view[0]) / axes.get_window_extent().width  # [m]
    _docks(axes, scene)
    draw_course(axes, scene, pixel)
    for item in sorted(scene.objects, key=lambda item: -item.size):
        _disc(axes, item.x, item.y, max(item.size / 2.0, 4.5 * pixel), item.color)
    for number, (x, y, yaw) in enumerate(scene.waypoints, start=1):
        _waypoint(axes, x, y, yaw, str(number) if len(scene.waypoints) > 1 else "goal", 13.0 * pixel)
    for boat in scene.boats:
        _boat(axes, boat, max(1.0, 24.0 * pixel / HULL_LENGTH))
    _scale_bar(axes, view)
    label(axes, list(_things(scene, pixel)), pixel)


def _docks(axes: Any, scene: MapScene) -> None:
    from matplotlib.patches import Polygon

    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    for dock in scene.docks:
        square, turn = dock.block * corners, _turn(dock.yaw)
        for cell in dock.cells:
            patch = Polygon(square @ turn.T + cell, facecolor="#9aa3ab", edgecolor="#5d666e", linewidth=0.6, zorder=2)
            axes.add_patch(patch)


def _disc(axes: Any, x: float, y: float, radius: float, color: Any) -> None:
    from matplotlib.patches import Circle

    axes.add_patch(Circle((x, y), radius, facecolor=color, edgecolor=INK, linewidth=0.8, zorder=3))


def _waypoint(axes: Any, x: float, y: float, yaw: float, label: str, reach: float) -> None:
    ahead = (x + 1.9 * reach * math.cos(yaw), y + 1.9 * reach * math.sin(yaw))
    style = {"arrowstyle": "-|>", "color": "#7a2e8e", "linewidth": 1.3, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", ahead, (x, y), arrowprops=style, zorder=4)
    axes.plot([x], [y], marker="D", markersize=13, color="white", markeredgecolor="#7a2e8e", zorder=4.1)
    small = 6 if len(label) > 2 else 8
    write(axes, x, y, label, size=small, color="#7a2e8e", ha="center", va="center", zorder=4.2, weight="bold")


def _boat(axes: Any, boat: MapBoat, scale: float) -> None:
    """A hull's outline, bow forward, and an arrow along its heading."""
    from matplotlib.patches import Polygon

    bow, side = HULL_LENGTH / 2.0, HULL_BEAM / 2.0
    hull = np.array([[-bow, -side], [0.45 * bow, -side], [bow, 0.0], [0.45 * bow, side], [-bow, side]])
    turn, place = _turn(boat.yaw), np.array([boat.x, boat.y])
    outline = scale * hull @ turn.T + place
    tip = place + scale * 2.2 * bow * turn[:, 0]
    style = {
        "arrowstyle": "-|>",
        "color": INK,
        "linewidth": 1.4,
        "shrinkA": 0,
        "shrinkB": 0,
        "mutation_scale": 11,
    }
    axes.annotate("", tip, place, arrowprops=style, zorder=4.9)
    axes.add_patch(Polygon(outline, facecolor=boat.color, edgecolor=INK, linewidth=1.1, zorder=5))


def _scale_bar(axes: Any, view: Box) -> None:
    width, height = view[2] - view[0], view[3] - view[1]
    length = nice_length(width / 5.0)
    x, y = view[0] + 0.025 * width, view[1] + 0.03 * height
    for part, color in ((0.0, INK), (0.5, "white")):
        from matplotlib.patches import Rectangle

        corner = (x + part * length, y)
        axes.add_patch(Rectangle(corner, length / 2, 0.008 * height, facecolor=color, edgecolor=INK, lw=0.8, zorder=6))
    write(axes, x + length / 2, y + 0.014 * height, f"{length:g} m", size=9, ha="center", va="bottom", zorder=6)


def _things(scene: MapScene, pixel: float) -> Iterator[Thing]:
    """What is in the plan, as labels see it: boats with the tips of their arrows first, objects last."""
    reach = max(HULL_LENGTH / 2.0, 12.0 * pixel)
    for boat in scene.boats:
        yield Thing(boat.name, boat.x, boat.y, 1.12 * reach, must=True)
        tip = 1.7 * reach
        yield Thing("", boat.x + tip * math.cos(boat.yaw), boat.y + tip * math.sin(boat.yaw), 8.0 * pixel)
    for x, y, yaw in scene.waypoints:
        yield Thing("", x, y, 10.0 * pixel)
        yield Thing("", x + 20.0 * pixel * math.cos(yaw), y + 20.0 * pixel * math.sin(yaw), 6.0 * pixel)
    yield from course_things(scene, pixel)
    for dock in scene.docks:
        x, y = dock.cells.mean(axis=0).tolist()
        beside = 0.5 * (float(np.max(np.ptp(dock.cells, axis=0))) + dock.block) if scene.placards else 0.0
        yield Thing(dock.name.split("/")[0], x, y, beside, must=True)
    for item, name in zip(scene.objects, _object_names(scene, pixel), strict=True):
        yield Thing(name, item.x, item.y, max(item.size / 2.0, 4.5 * pixel))


def _object_names(scene: MapScene, pixel: float) -> list[str]:
    """What to write beside each object: its own name, or that of a course too small to see its parts."""
    groups: dict[str, list[tuple[float, float]]] = {}
    for item in scene.objects:
        groups.setdefault(item.name.split("/")[0], []).append((item.x, item.y))
    small = {
        group
        for group, spots in groups.items()
        if len(spots) > 1 and np.max(np.ptp(spots, axis=0)) < SMALL_COURSE * pixel
    }
    written = {dock.name.split("/")[0] for dock in scene.docks} | {beacon.name for beacon in scene.course.beacons}
    names = []
    for item in scene.objects:
        group, _, part = item.name.partition("/")
        shared = "" if group in written else group
        names.append(shared if group in small else part.split("/")[-1] or group)
        written |= {group} & small
    return names


def _turn(yaw: float) -> FloatArray:
    return np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])


def nice_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is at most `most`."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most * (1 + 1e-9))


def ground(axes: Any, scene: MapScene, view: Box) -> None:
    """Water, land and the frame of the axes."""
    axes.set_facecolor(WATER)
    axes.set_xlim(view[0], view[2])
    axes.set_ylim(view[1], view[3])
    axes.set_aspect("equal")
    for side in axes.spines.values():
        side.set_color(SOFT)
    if not scene.shore:
        return
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    rings = [Outline(np.vstack([ring, ring[:1]]), closed=True) for ring in scene.shore]
    land = PathPatch(Outline.make_compound_path(*rings), facecolor=LAND, edgecolor=SHORE, linewidth=1.1, zorder=0.5)
    axes.add_patch(land)
