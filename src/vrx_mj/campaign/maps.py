"""Maps of a page as SVG: the sketch of a world with the tracks of all that sailed there."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from shapely import MultiPoint, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from vrx_mj.campaign.results import Result
from vrx_mj.draw.course import Bay, Course
from vrx_mj.draw.map_scene import map_of
from vrx_mj.mjcf.world import World

__all__ = ["COLORS", "Drawing", "draw", "sketch_of"]

COLORS = ("#d1495b", "#00798c", "#6a4c93", "#c2571a", "#3f7d20", "#30638e", "#a8760b", "#8d5a97")
"""Of the controllers' tracks, in their order."""
SHAPE = 1.5
"""Width by height of a map."""
PIXELS = 720.0
"""Width of a map when it is shown large [px]: sizes that must stay visible go by it."""
MOST_POINTS = 1500
"""Points of all tracks of a map together, at most."""
BEND = 1.0
"""Of the shore, what is smaller than this is left out [m]."""
NEAR = 40.0
"""An object that is farther from everything that matters [m] does not widen a map."""
Box = tuple[float, float, float, float]
Spot = tuple[float, float]
Line = Sequence[Sequence[float]]


@dataclass(frozen=True)
class Drawing:
    """A map as the parts of an SVG."""

    view: str
    """The `viewBox`."""
    marks: str
    """What is there before anybody sails."""
    tracks: str


def draw(sketch: Mapping[str, Any], results: Sequence[Result], controllers: Sequence[str]) -> Drawing:
    """The map of a world with the tracks of these trials. Its y axis points south, as in all SVG."""
    tracks = [(result, line) for result in results for line in result.tracks.values() if line]
    view = _view(sketch, [line for _, line in tracks])
    pixel = (view[2] - view[0]) / PIXELS
    stride = 1 + sum(len(line) for _, line in tracks) // MOST_POINTS
    west, south, east, north = view
    return Drawing(
        f"{west:.1f} {-north:.1f} {east - west:.1f} {north - south:.1f}",
        "".join(_marks(sketch, view, pixel)),
        "".join(_track(result, line, stride, pixel, controllers) for result, line in tracks),
    )


def _view(sketch: Mapping[str, Any], tracks: Iterable[Line]) -> Box:
    """What matters: the boats, the task, where they went, and objects not far from these."""
    spots: list[Sequence[float]] = [(boat["x"], boat["y"]) for boat in sketch["boats"]]
    spots += [place[:2] for place in sketch["waypoints"]] + sketch["beacons"]
    spots += [spot for gate in sketch["gates"] for spot in (gate["left"], gate["right"])]
    spots += [spot for bay in sketch["bays"] for spot in bay["corners"]]
    for circle in sketch["circles"]:
        x, y, radius = circle["x"], circle["y"], circle["radius"]
        spots += [(x - radius, y - radius), (x + radius, y + radius)]
    spots += [spot for line in tracks for spot in line]
    things: list[Sequence[float]] = [item["spot"] for item in sketch["objects"]]
    things += [cell for dock in sketch["docks"] for cell in dock["cells"]]
    if not spots:
        return _framed(things or [(0.0, 0.0)])
    company = MultiPoint(spots)
    return _framed([*spots, *(spot for spot in things if company.distance(Point(spot)) < NEAR)])


def _framed(spots: Sequence[Sequence[float]]) -> Box:
    """West, south, east and north of a frame of the right shape round these places, with a margin."""
    xs, ys = [spot[0] for spot in spots], [spot[1] for spot in spots]
    width, height = max(1.12 * (max(xs) - min(xs)) + 6.0, 30.0), max(1.12 * (max(ys) - min(ys)) + 6.0, 20.0)
    width, height = max(width, SHAPE * height), max(height, width / SHAPE)
    x, y = (min(xs) + max(xs)) / 2.0, (min(ys) + max(ys)) / 2.0
    return (x - width / 2, y - height / 2, x + width / 2, y + height / 2)


def _marks(sketch: Mapping[str, Any], view: Box, pixel: float) -> Iterator[str]:
    yield from _shore(sketch["shore"], view)
    yield _scale(view, pixel)
    yield from _zones(sketch)
    yield from _things(sketch, pixel)


def _zones(sketch: Mapping[str, Any]) -> Iterator[str]:
    """Docks, bays, and the circles round animals."""
    for dock in sketch["docks"]:
        cells = "".join(_square(x, y, dock["cell"] / 2.0, dock["yaw"]) for x, y in dock["cells"])
        yield f'<path class="dock" d="{cells}"><title>{escape(dock["name"])}</title></path>'
    for bay in sketch["bays"]:
        kind = "bay allowed" if bay["allowed"] else "bay"
        yield f'<path class="{kind}" d="{_path(bay["corners"])}Z"><title>{escape(bay["told"])}</title></path>'
    for circle in sketch["circles"]:
        yield f'<circle class="ring" cx="{circle["x"]:.1f}" cy="{-circle["y"]:.1f}" r="{circle["radius"]:.1f}">'
        yield f"<title>{escape(circle['told'])}</title></circle>"
    for path in sketch["paths"]:
        yield f'<path class="swim" d="{_path(path)}"/>'


def _things(sketch: Mapping[str, Any], pixel: float) -> Iterator[str]:
    """Gates, buoys, goals, and the boats where they start."""
    for number, gate in enumerate(sketch["gates"], start=1):
        yield _gate(gate, number, pixel)
    for item in sketch["objects"]:
        radius = max(item["size"] / 2.0, 3.0 * pixel)
        place = f'cx="{item["spot"][0]:.1f}" cy="{-item["spot"][1]:.1f}" r="{radius:.2f}"'
        yield f'<circle class="thing" {place} fill="{item["color"]}"><title>{escape(item["name"])}</title></circle>'
    for number, (x, y, yaw) in enumerate(sketch["waypoints"], start=1):
        yield _waypoint(x, y, yaw, str(number) if len(sketch["waypoints"]) > 1 else "", pixel)
    for x, y in sketch["beacons"]:
        yield f'<path class="beacon" d="{_cross(x, y, 6.0 * pixel)}"><title>beacon</title></path>'
    for boat in sketch["boats"]:
        yield _boat(boat, pixel)


def _shore(rings: Sequence[Line], view: Box) -> Iterator[str]:
    """The land inside the frame; rings have it on their left."""
    frame = box(*view)
    ordered = sorted(rings, key=lambda ring: -float(Polygon(ring).area))
    land: BaseGeometry = frame if ordered and _clockwise(ordered[0]) else Polygon()
    for ring in ordered:
        inside = Polygon(ring).buffer(0).intersection(frame)
        land = land.difference(inside) if _clockwise(ring) else land.union(inside)
    if not land.is_empty:
        yield f'<path class="land" d="{_outline(land.simplify(BEND))}"/>'


def _clockwise(ring: Line) -> bool:
    return sum(x * w - z * y for (x, y), (z, w) in zip(ring, [*ring[1:], ring[0]], strict=True)) < 0.0


def _outline(shape: BaseGeometry) -> str:
    parts = getattr(shape, "geoms", [shape])
    rings = [ring for part in parts if part.geom_type == "Polygon" for ring in (part.exterior, *part.interiors)]
    return "".join(f"{_path(ring.coords)}Z" for ring in rings)


def _path(points: Iterable[Sequence[float]]) -> str:
    return "M" + "L".join(f"{point[0]:.1f} {-point[1]:.1f}" for point in points)


def _square(x: float, y: float, half: float, yaw: float) -> str:
    c, s = half * math.cos(yaw), half * math.sin(yaw)
    return _path([(x - c + s, y - s - c), (x + c + s, y + s - c), (x + c - s, y + s + c), (x - c - s, y - s + c)]) + "Z"


def _gate(gate: Mapping[str, Any], number: int, pixel: float) -> str:
    """A line between its buoys, an arrow the way it counts, and its number."""
    (x1, y1), (x2, y2), yaw = gate["left"], gate["right"], gate["yaw"]
    x, y = (x1 + x2) / 2, (y1 + y2) / 2
    line = f'<path class="gate" d="{_path([(x1, y1), (x2, y2)])}"/>'
    arrow = f'<path class="arrow" d="{_arrow(x, y, yaw, 9.0 * pixel)}"/>'
    off = 14.0 * pixel
    return line + arrow + _text((x - off * math.cos(yaw), y - off * math.sin(yaw)), str(number), "number", 11.0 * pixel)


def _waypoint(x: float, y: float, yaw: float, number: str, pixel: float) -> str:
    reach = 18.0 * pixel
    tip = (x + reach * math.cos(yaw), y + reach * math.sin(yaw))
    stem = f'<path class="heading" d="{_path([(x, y), tip])}"/>'
    disc = f'<circle class="goal" cx="{x:.1f}" cy="{-y:.1f}" r="{7.0 * pixel:.2f}"/>'
    return stem + disc + (_text((x, y - 3.6 * pixel), number, "inside", 10.0 * pixel) if number else "")


def _boat(boat: Mapping[str, Any], pixel: float) -> str:
    shape = _arrow(boat["x"], boat["y"], boat["yaw"], 9.0 * pixel)
    return f'<path class="boat" d="{shape}"><title>{escape(boat["name"])} at the start</title></path>'


def _arrow(x: float, y: float, yaw: float, reach: float) -> str:
    turns = ((0.0, 1.0), (2.55, 0.8), (-2.55, 0.8))
    return _path([(x + r * reach * math.cos(yaw + a), y + r * reach * math.sin(yaw + a)) for a, r in turns]) + "Z"


def _cross(x: float, y: float, reach: float) -> str:
    return _path([(x - reach, y - reach), (x + reach, y + reach)]) + _path(
        [(x - reach, y + reach), (x + reach, y - reach)]
    )


def _scale(view: Box, pixel: float) -> str:
    """A bar of a round length at the lower left."""
    most = (view[2] - view[0]) / 4.0
    power = 10.0 ** math.floor(math.log10(most))
    length = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most)
    x, y = view[0] + 14.0 * pixel, view[1] + 16.0 * pixel
    bar = _path([(x, y + 4.0 * pixel), (x, y), (x + length, y), (x + length, y + 4.0 * pixel)])
    return f'<path class="bar" d="{bar}"/>' + _text(
        (x + length / 2, y + 5.0 * pixel), f"{length:g} m", "unit", 11.0 * pixel
    )


def _text(spot: Spot, text: str, kind: str, size: float) -> str:
    place = f'x="{spot[0]:.1f}" y="{-spot[1]:.1f}" font-size="{size:.2f}"'
    return f'<text class="{kind}" {place}>{escape(text)}</text>'


def _track(result: Result, line: Line, stride: int, pixel: float, controllers: Sequence[str]) -> str:
    """A boat's way, and a dot, or a cross for a trial that failed, where it ended."""
    number = controllers.index(result.cell.controller)
    points = [*line[:-1:stride], line[-1]]
    x, y = points[-1]
    told = f"{result.cell.controller}, seed {result.cell.seed}"
    attributes = f'class="track c{number % len(COLORS)}" data-c="{number}" data-s="{result.cell.seed}"'
    end = (
        f'<path d="{_cross(x, y, 5.0 * pixel)}"/>'
        if result.failed
        else f'<circle cx="{x:.1f}" cy="{-y:.1f}" r="{3.0 * pixel:.2f}"/>'
    )
    return f'<g {attributes}><title>{escape(told)}</title><path d="{_path(points)}"/>{end}</g>'


Row = dict[str, Any]


def sketch_of(world: World) -> Row:
    """Shore, docks, objects, boats at their start, and what the task lays out."""
    scene = map_of(world)
    task = world.parameters.task
    shown = {showing.name: (showing.x, showing.y) for showing in scene.course.showings}
    spots = {item.name: shown.get(item.name, (item.x, item.y)) for item in scene.objects}
    return {
        "name": world.name,
        "description": world.parameters.description,
        "task": None if task is None else {"type": task.type, "name": task.name},
        "shore": [_points(ring) for ring in scene.shore],
        "docks": [
            {"name": dock.name, "cells": _points(dock.cells), "yaw": dock.yaw, "cell": dock.block}
            for dock in scene.docks
        ],
        "objects": [
            {"name": item.name, "spot": list(spots[item.name]), "color": _hex(item.color), "size": item.size}
            for item in scene.objects
        ],
        "boats": [{"name": boat.name, "x": boat.x, "y": boat.y, "yaw": boat.yaw} for boat in scene.boats],
        "waypoints": [list(place) for place in scene.waypoints],
        **_laid_out(scene.course),
    }


def _laid_out(course: Course) -> Row:
    animals = [(item.x, item.y, item.radius, f"{item.name}: {item.goal}") for item in course.animals]
    beacons = [(item.x, item.y, item.radius, item.name) for item in course.beacons]
    return {
        "gates": [{"left": list(gate.left), "right": list(gate.right), "yaw": gate.yaw} for gate in course.gates],
        "bays": [_bay(bay) for bay in course.bays],
        "paths": [
            _points([path.start, *path.points, *(path.points[:1] if path.closed else ())]) for path in course.paths
        ],
        "circles": [_circle(*row) for row in animals + beacons if row[2] > 0.0],
        "beacons": [[item.x, item.y] for item in course.beacons],
    }


def _bay(bay: Bay) -> Row:
    told = f"{bay.name}: {bay.symbol or 'no symbol'}".replace("_", " ")
    return {"corners": _points(bay.internal[:, :2]), "allowed": bay.right, "told": told}


def _circle(x: float, y: float, radius: float, told: str) -> Row:
    return {"x": x, "y": y, "radius": radius, "told": told.replace("_", " ")}


def _points(points: Any) -> list[list[float]]:
    return [[round(float(x), 2), round(float(y), 2)] for x, y in points]


def _hex(color: tuple[float, float, float]) -> str:
    return "#" + "".join(f"{round(255 * min(max(share, 0.0), 1.0)):02x}" for share in color)
