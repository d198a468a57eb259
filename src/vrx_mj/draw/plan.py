"""The plan of a map: shore, docks, objects, waypoints and boats, and what a task lays out there."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle, PathPatch, Polygon, Rectangle
from matplotlib.path import Path as Outline

from vrx_mj.arrays import FloatArray
from vrx_mj.config.docks import RGB
from vrx_mj.draw.course import (
    Animal,
    Bay,
    Beacon,
    GateBar,
    MapBoat,
    MapPlacard,
    MapScene,
    Path,
    nice_length,
    turn_matrix,
)
from vrx_mj.draw.style import INK, Thing, label, write

Box = tuple[float, float, float, float]
"""Least x and y, greatest x and y [m]."""

_WATER, _LAND, _SHORE, SOFT = "#dbe9f0", "#e9e2cd", "#9a8f6d", "#6c7f8a"
_HULL_LENGTH, _HULL_BEAM = 4.9, 2.4
"""Outline of a WAM-V [m]."""
_LONELY = 80.0
"""An object with nothing within this distance [m] is far from everything."""
_SMALL_COURSE = 70.0
"""A course of less than this many pixels gets one name for all its parts."""
_GATE, _RIGHT, _WRONG, _PATH, _BEACON = "#0f7b5f", "#2a9d3a", "#77818a", "#5a4fa3", "#b3261e"
_AVOID, _CIRCLE = "#c0392b", "#1c6fb5"
_DISC = 15.0
"""Diameter of a gate's number [px]."""
_GOALS = {
    "avoid": (_AVOID, 0, "keep away"),
    "circumnavigate_clockwise": (_CIRCLE, -1, "circle clockwise"),
    "circumnavigate_counterclockwise": (_CIRCLE, 1, "circle counter-clockwise"),
}
"""Goals of animals: colour, sense of the circle (1: counter-clockwise), and what to do, in words."""
_SYMBOL_MARKS = {"circle": "o", "cross": "P", "triangle": "^", "rectangle": "s"}
_ARROWS = 3
"""Arrows on a circle."""
_LAMPS = 15.0
"""Height of a light buoy's colours over it [px]."""


def view_of(scene: MapScene, aspect: float) -> Box:
    """Least x and y, greatest x and y of the plan [m]: what matters, and a margin, in the picture's shape."""
    spots = [(boat.x, boat.y) for boat in scene.boats] + [(x, y) for x, y, _ in scene.waypoints]
    spots += scene.course.spots()
    spots += [(x, y) for dock in scene.docks for x, y in dock.cells.tolist()]
    hidden = {showing.name for showing in scene.course.showings}
    objects = [(item.x, item.y) for item in scene.objects if item.name not in hidden]
    spots += [
        spot
        for i, spot in enumerate(objects)
        if not spots or any(math.dist(spot, other) < _LONELY for other in objects[:i] + objects[i + 1 :] + spots)
    ]
    spots = spots or [(x, y) for ring in scene.shore for x, y in ring.tolist()] or [(0.0, 0.0)]
    low, high = np.min(spots, axis=0), np.max(spots, axis=0)
    east, north = (low + high) / 2.0
    width, height = np.maximum((high - low) * 1.16 + 8.0, 40.0)
    width, height = max(width, height * aspect), max(height, width / aspect)
    return (east - width / 2, north - height / 2, east + width / 2, north + height / 2)


def draw_plan(axes: Axes, scene: MapScene, view: Box) -> None:
    """Draw the part `view` of the world into `axes`."""
    ground(axes, scene, view)
    step = nice_length((view[2] - view[0]) / 7.0)
    axes.set_xticks(np.arange(math.ceil(view[0] / step), math.floor(view[2] / step) + 1) * step)
    axes.set_yticks(np.arange(math.ceil(view[1] / step), math.floor(view[3] / step) + 1) * step)
    axes.grid(color="#8fa8b4", linewidth=0.5, alpha=0.45)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=9, colors=SOFT, length=3)
    axes.set_xlabel("x [m]", fontsize=10, color=SOFT)
    axes.set_ylabel("y [m]", fontsize=10, color=SOFT)
    pixel = (view[2] - view[0]) / axes.get_window_extent().width  # [m]
    _docks(axes, scene)
    _draw_course(axes, scene, pixel)
    for item in sorted(scene.objects, key=lambda item: -item.size):
        radius = max(item.size / 2.0, 4.5 * pixel)
        axes.add_patch(Circle((item.x, item.y), radius, fc=item.color, ec=INK, lw=0.8, zorder=3))
    for number, (x, y, yaw) in enumerate(scene.waypoints, start=1):
        _waypoint(axes, x, y, yaw, str(number) if len(scene.waypoints) > 1 else "goal", 13.0 * pixel)
    for boat in scene.boats:
        _boat(axes, boat, max(1.0, 24.0 * pixel / _HULL_LENGTH))
    _scale_bar(axes, view)
    label(axes, list(_things(scene, pixel)), pixel)


def _docks(axes: Axes, scene: MapScene) -> None:
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    for dock in scene.docks:
        square, turn = dock.block * corners, turn_matrix(dock.yaw)
        for cell in dock.cells:
            patch = Polygon(square @ turn.T + cell, facecolor="#9aa3ab", edgecolor="#5d666e", linewidth=0.6, zorder=2)
            axes.add_patch(patch)


def _waypoint(axes: Axes, x: float, y: float, yaw: float, label: str, reach: float) -> None:
    ahead = (x + 1.9 * reach * math.cos(yaw), y + 1.9 * reach * math.sin(yaw))
    draw_arrow(axes, (x, y), ahead, "#7a2e8e", linewidth=1.3, mutation_scale=10)
    axes.plot([x], [y], marker="D", markersize=13, color="white", markeredgecolor="#7a2e8e", zorder=4.1)
    small = 6 if len(label) > 2 else 8
    write(axes, x, y, label, size=small, color="#7a2e8e", ha="center", va="center", zorder=4.2, weight="bold")


def _boat(axes: Axes, boat: MapBoat, scale: float) -> None:
    """A hull's outline, bow forward, and an arrow along its heading."""
    bow, side = _HULL_LENGTH / 2.0, _HULL_BEAM / 2.0
    hull = np.array([[-bow, -side], [0.45 * bow, -side], [bow, 0.0], [0.45 * bow, side], [-bow, side]])
    turn, place = turn_matrix(boat.yaw), np.array([boat.x, boat.y])
    outline = scale * hull @ turn.T + place
    tip = place + scale * 2.2 * bow * turn[:, 0]
    draw_arrow(axes, place, tip, INK, zorder=4.9, linewidth=1.4, mutation_scale=11)
    axes.add_patch(Polygon(outline, facecolor=boat.color, edgecolor=INK, linewidth=1.1, zorder=5))


def _scale_bar(axes: Axes, view: Box) -> None:
    width, height = view[2] - view[0], view[3] - view[1]
    length = nice_length(width / 5.0)
    x, y = view[0] + 0.025 * width, view[1] + 0.03 * height
    for part, color in ((0.0, INK), (0.5, "white")):
        corner = (x + part * length, y)
        axes.add_patch(Rectangle(corner, length / 2, 0.008 * height, facecolor=color, edgecolor=INK, lw=0.8, zorder=6))
    write(axes, x + length / 2, y + 0.014 * height, f"{length:g} m", size=9, ha="center", va="bottom", zorder=6)


def _things(scene: MapScene, pixel: float) -> Iterator[Thing]:
    """Things of the plan that labels keep clear of: boats with the tips of their arrows first, objects last."""
    reach = max(_HULL_LENGTH / 2.0, 12.0 * pixel)
    for boat in scene.boats:
        yield Thing(boat.name, boat.x, boat.y, 1.12 * reach, must=True)
        tip = 1.7 * reach
        yield Thing("", boat.x + tip * math.cos(boat.yaw), boat.y + tip * math.sin(boat.yaw), 8.0 * pixel)
    for x, y, yaw in scene.waypoints:
        yield Thing("", x, y, 10.0 * pixel)
        yield Thing("", x + 20.0 * pixel * math.cos(yaw), y + 20.0 * pixel * math.sin(yaw), 6.0 * pixel)
    yield from _course_things(scene, pixel)
    for dock in scene.docks:
        x, y = dock.cells.mean(axis=0).tolist()
        beside = 0.5 * (float(np.max(np.ptp(dock.cells, axis=0))) + dock.block) if scene.placards else 0.0
        yield Thing(dock.name.split("/")[0], x, y, beside, must=True)
    for item, name in zip(scene.objects, _object_names(scene, pixel), strict=True):
        yield Thing(name, item.x, item.y, max(item.size / 2.0, 4.5 * pixel))


def _object_names(scene: MapScene, pixel: float) -> list[str]:
    """Label of each object: its own name, or that of a course too small to see its parts."""
    groups: dict[str, list[tuple[float, float]]] = {}
    for item in scene.objects:
        groups.setdefault(item.name.split("/")[0], []).append((item.x, item.y))
    small = {
        group
        for group, spots in groups.items()
        if len(spots) > 1 and np.max(np.ptp(spots, axis=0)) < _SMALL_COURSE * pixel
    }
    written = {dock.name.split("/")[0] for dock in scene.docks} | {beacon.name for beacon in scene.course.beacons}
    names = []
    for item in scene.objects:
        group, _, part = item.name.partition("/")
        shared = "" if group in written else group
        names.append(shared if group in small else part.split("/")[-1] or group)
        written |= {group} & small
    return names


def ground(axes: Axes, scene: MapScene, view: Box) -> None:
    """Water, land and the frame of the axes."""
    axes.set_facecolor(_WATER)
    axes.set_xlim(view[0], view[2])
    axes.set_ylim(view[1], view[3])
    axes.set_aspect("equal")
    for side in axes.spines.values():
        side.set_color(SOFT)
    if not scene.shore:
        return
    rings = [Outline(np.vstack([ring, ring[:1]]), closed=True) for ring in scene.shore]
    land = PathPatch(Outline.make_compound_path(*rings), facecolor=_LAND, edgecolor=_SHORE, linewidth=1.1, zorder=0.5)
    axes.add_patch(land)


Row = tuple[Any, Any, Any, str]
"""Row of the legend: marker, colour of its face, colour of its edge, text."""


def _draw_course(axes: Axes, scene: MapScene, pixel: float) -> None:
    """Draw what the task lays out into `axes`, whose pixels are `pixel` [m] wide."""
    course = scene.course
    for animal in course.animals:
        _animal(axes, animal, pixel)
    for path in course.paths:
        _path(axes, path)
    for bay in course.bays:
        _bay(axes, bay)
    for beacon in course.beacons:
        _beacon(axes, beacon)
    for gate in course.gates:
        _gate(axes, gate, pixel)
    colors = {item.name: item.color for item in scene.objects}
    for showing in course.showings:
        face = (*colors.get(showing.name, (0.5, 0.5, 0.5)), 0.45)
        axes.plot([showing.x], [showing.y], "o", ms=8, color=face, mec=INK, mew=1.0, zorder=3)
    for placard in _placards_apart(scene.placards, pixel):
        _placard(axes, placard)
    for light in course.lights:
        _lamps(axes, light.x, light.y, light.colors, pixel)


def _course_things(scene: MapScene, pixel: float) -> Iterator[Thing]:
    """Things of the course for the labels: names of bays and beacons, and places that names must not cover."""
    course = scene.course
    for gate in course.gates:
        yield from _gate_things(gate, pixel)
    for bay in course.bays:
        yield from _bay_things(bay, pixel)
    for placard in _placards_apart(scene.placards, pixel):
        yield Thing("", placard.x, placard.y, 9.0 * pixel)
    for beacon in course.beacons:
        yield Thing(beacon.name, beacon.x, beacon.y, 9.0 * pixel, must=True)
    for light in course.lights:
        yield Thing("", light.x, light.y + _LAMPS * pixel, 14.0 * pixel)
    for showing in course.showings:
        yield Thing(f"{showing.start:g}–{showing.end:g} s", showing.x, showing.y, 6.0 * pixel)


def _gate_things(gate: GateBar, pixel: float) -> Iterator[Thing]:
    """A gate's number, then points along its bar and its arrow."""
    middle = np.array(gate.middle)
    yield _keep_off(middle, 0.6 * _DISC * pixel)
    ways = (np.array(gate.left), np.array(gate.right), middle + _reach(gate, pixel) * _along(gate))
    for end in ways:
        for share in np.linspace(0.0, 1.0, 12)[1:-1]:
            yield _keep_off(middle + share * (end - middle), 3.0 * pixel)
    yield _keep_off(ways[2], 5.0 * pixel)


def _keep_off(place: FloatArray, radius: float) -> Thing:
    """A place that names must not cover."""
    return Thing("", float(place[0]), float(place[1]), radius)


def _bay_things(bay: Bay, pixel: float) -> Iterator[Thing]:
    """A bay's name, outside of the zone to back out to, and the zone to stay in."""
    inside, outside = bay.internal[:, :2].mean(axis=0), bay.external[:, :2].mean(axis=0)
    out = (outside - inside) / max(math.dist(outside, inside), 1e-9)
    half = float(np.max((bay.external[:, :2] - outside) @ out))
    x, y = outside + out * (half + pixel * (28.0 * abs(out[0]) + 11.0 * abs(out[1])))
    yield Thing(f"{bay.name} ✓" if bay.right else bay.name, float(x), float(y), 0.0)
    yield _keep_off(inside, 8.0 * pixel)


def course_rows(scene: MapScene) -> Iterator[Row]:
    """The legend of what is there."""
    course = scene.course
    if course.gates:
        yield (r"$\rightarrow$", _GATE, _GATE, "gate, its number and direction")
    if course.bays:
        yield ("s", "#d5ecd8", _RIGHT, "bay to dock in")
        if not all(bay.right for bay in course.bays):
            yield ("s", "#e6e9eb", _WRONG, "other bay")
        yield ("s", "none", _RIGHT, "dashed: back out to this line")
    for goal, (color, turn, text) in _GOALS.items():
        reach = [animal.radius for animal in course.animals if animal.goal == goal]
        if reach:
            mark = {0: "o", 1: r"$\circlearrowleft$", -1: r"$\circlearrowright$"}[turn]
            yield (mark, "none" if turn == 0 else color, color, f"{text}, {reach[0]:g} m")
    if course.beacons:
        tolerance = course.beacons[0].radius
        yield ("x", _BEACON, _BEACON, course.beacons[0].name + (f", found within {tolerance:g} m" if tolerance else ""))
    if course.paths:
        yield (r"$\rightarrow$", _PATH, _PATH, "path of a moving object")
    if course.lights:
        yield ("o", RGB[course.lights[0].colors[0]], INK, "light buoy: its colours, in order")
    if course.showings:
        yield ("o", "none", INK, "appears in front of the boat")


def draw_arrow(
    axes: Axes, start: Sequence[float] | FloatArray, tip: Sequence[float] | FloatArray, color: str, *,
    zorder: float = 4.0, **style: float,
) -> None:  # fmt: skip
    """An arrow with a filled head; `style`: of matplotlib's `FancyArrowPatch`."""
    look = {"arrowstyle": "-|>", "color": color, "linewidth": 1.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 13}
    axes.annotate("", (tip[0], tip[1]), (start[0], start[1]), arrowprops={**look, **style}, zorder=zorder)


def _along(gate: GateBar) -> FloatArray:
    """The direction in which to cross a gate, a unit vector."""
    return np.array([math.cos(gate.yaw), math.sin(gate.yaw)])


def _reach(gate: GateBar, pixel: float) -> float:
    """Length of a gate's arrow [m]: in proportion, but long enough to be seen."""
    return max(26.0 * pixel, 0.4 * math.dist(gate.left, gate.right))


def _gate(axes: Axes, gate: GateBar, pixel: float) -> None:
    """A bar between the buoys, an arrow across it and its number."""
    axes.plot(*zip(gate.left, gate.right, strict=True), color=_GATE, linewidth=2.6, solid_capstyle="butt", zorder=2.6)
    x, y = gate.middle
    draw_arrow(axes, (x, y), gate.middle + _reach(gate, pixel) * _along(gate), _GATE)
    axes.plot([x], [y], marker="o", markersize=0.72 * _DISC, color="white", markeredgecolor=_GATE, zorder=4.1)
    write(axes, x, y, str(gate.number), size=7.5, color=_GATE, ha="center", va="center", zorder=4.2, weight="bold")


def _bay(axes: Axes, bay: Bay) -> None:
    color, order = (_RIGHT, 2.5) if bay.right else (_WRONG, 2.4)
    style: dict[str, Any] = {"edgecolor": color, "zorder": order}
    axes.add_patch(Polygon(bay.internal[:, :2], facecolor=(*to_rgb(color), 0.18), linewidth=1.6, **style))
    axes.add_patch(Polygon(bay.external[:, :2], facecolor="none", linewidth=1.3, linestyle=(0, (4, 3)), **style))


def _placards_apart(placards: Sequence[MapPlacard], pixel: float) -> Iterator[MapPlacard]:
    """Placards, those back to back moved apart until both are seen."""
    for placard in placards:
        here = np.array([placard.x, placard.y])
        apart = [here - (other.x, other.y) for other in placards if other is not placard]
        near = min(apart, key=lambda way: float(np.hypot(*way)), default=np.array([math.inf, 0.0]))
        distance = float(np.hypot(*near))
        if 0.0 < distance < 21.0 * pixel:
            here = here + near / distance * (21.0 * pixel - distance) / 2.0
        yield replace(placard, x=float(here[0]), y=float(here[1]))


def _placard(axes: Axes, placard: MapPlacard) -> None:
    """The symbol that a placard shows."""
    color, _, shape = placard.symbol.partition("_")
    mark = _SYMBOL_MARKS.get(shape, "o")
    axes.plot([placard.x], [placard.y], marker="o", markersize=13, color="white", markeredgecolor=INK, zorder=3.4)
    axes.plot([placard.x], [placard.y], marker=mark, markersize=8, color=RGB[color], mec=INK, mew=0.6, zorder=3.5)


def _lamps(axes: Axes, x: float, y: float, colors: Sequence[str], pixel: float) -> None:
    """A light buoy's colours above it, as three dots."""
    for number, color in enumerate(colors, -1):
        place = [x + number * 11.0 * pixel], [y + _LAMPS * pixel]
        axes.plot(*place, "o", markersize=7.5, color=RGB[color], mec=INK, mew=0.9, zorder=5.2)


def _animal(axes: Axes, animal: Animal, pixel: float) -> None:
    """The circle of engagement, with arrows where it is to be gone round."""
    color, turn, _ = _GOALS[animal.goal]
    style = {"linestyle": (0, (5, 3))} if turn == 0 else {}
    shade = (*to_rgb(color), 0.10 if turn == 0 else 0.05)
    axes.add_patch(Circle((animal.x, animal.y), animal.radius, fc=shade, ec=color, lw=1.6, zorder=2.2, **style))
    if turn == 0:
        return
    for angle in np.linspace(0.0, math.tau, _ARROWS, endpoint=False) + math.pi / 2.0:
        step = turn * min(1.0, 9.0 * pixel / animal.radius)
        ends = [
            (animal.x + animal.radius * math.cos(at), animal.y + animal.radius * math.sin(at))
            for at in (angle - step, angle + step)
        ]
        draw_arrow(axes, ends[0], ends[1], color, mutation_scale=16)


def _path(axes: Axes, path: Path) -> None:
    """Where something swims, with an arrow on every way; the way from its start is thin."""
    points = np.vstack([path.points, path.points[:1]]) if path.closed else path.points
    first = np.array([path.start, points[0]])
    axes.plot(*first.T, color=_PATH, linewidth=0.8, linestyle=(0, (1, 2)), zorder=2.3)
    axes.plot(*points.T, color=_PATH, linewidth=1.2, linestyle=(0, (6, 3)), zorder=2.3)
    axes.plot(*path.points.T, linestyle="", marker="o", markersize=3, color=_PATH, zorder=2.3)
    if len(path.points) > 2:  # what swims to and fro goes both ways
        for start, end in pairwise(points):
            draw_arrow(axes, start + 0.5 * (end - start), start + 0.51 * (end - start), _PATH)


def _beacon(axes: Axes, beacon: Beacon) -> None:
    axes.plot([beacon.x], [beacon.y], marker="x", markersize=12, markeredgewidth=3.0, color=_BEACON, zorder=4)
    if beacon.radius > 0.0:
        style = {"facecolor": (*to_rgb(_BEACON), 0.10), "edgecolor": _BEACON, "linewidth": 1.4}
        axes.add_patch(Circle((beacon.x, beacon.y), beacon.radius, zorder=2.3, **style))
