"""Maps of a campaign's page: what is in a world, and the numbers of the template that draws it with all tracks."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from shapely import LinearRing, MultiPoint, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from vrx_mj.campaign.results import Result
from vrx_mj.draw.course import Bay, Course, nice_length
from vrx_mj.draw.map_scene import ground_of, map_of, object_color, rounded
from vrx_mj.mjcf.world import World

_SHAPE = 1.5
"""Width by height of a map."""
_PIXELS = 720.0
"""Width of a map when it is shown large [px]: sizes that must stay visible go by it."""
_MOST_POINTS = 1500
"""Points of all tracks of a map together, at most."""
_BEND = 1.0
"""Details of the shore that are smaller than this are left out [m]."""
_NEAR = 40.0
"""An object that is farther from everything that matters [m] does not widen a map."""
_Box = tuple[float, float, float, float]
_Spot = tuple[float, float]
_Line = Sequence[Sequence[float]]
_Values = dict[str, Any]


def map_values(sketch: _Values, results: Sequence[Result], controllers: Sequence[str]) -> _Values:
    """What the template of a map takes: the frame, the land in it, a scale bar, and the tracks of these trials."""
    tracks = [(result, line) for result in results for line in result.tracks.values() if line]
    west, south, east, north = view = _view(sketch, [line for _, line in tracks])
    pixel, stride = (east - west) / _PIXELS, 1 + sum(len(line) for _, line in tracks) // _MOST_POINTS
    length = nice_length((east - west) / 4.0)
    x, y = west + 14.0 * pixel, south + 16.0 * pixel
    return {
        "west": west, "north": north, "width": east - west, "height": north - south, "pixel": pixel,
        "land": _land(sketch["shore"], view),
        "bar": [(x, y + 4.0 * pixel), (x, y), (x + length, y), (x + length, y + 4.0 * pixel)],
        "bar_label": (x + length / 2, y + 5.0 * pixel),
        "bar_length": length,
        "tracks": [_track(result, line, stride, controllers) for result, line in tracks],
    }  # fmt: skip


def _track(result: Result, line: _Line, stride: int, controllers: Sequence[str]) -> _Values:
    """A boat's way; the template ends it with a dot, or a cross where the trial failed."""
    cell, number = result.cell, controllers.index(result.cell.controller)
    points = [*line[:-1:stride], line[-1]]
    return {
        "controller": cell.controller, "seed": cell.seed, "failed": result.has_failed, "points": points,
        "index": number,
    }  # fmt: skip


def _view(sketch: _Values, tracks: Iterable[_Line]) -> _Box:
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
        return _frame(things or [(0.0, 0.0)])
    center = MultiPoint(spots)
    return _frame([*spots, *(spot for spot in things if center.distance(Point(spot)) < _NEAR)])


def _frame(spots: Sequence[Sequence[float]]) -> _Box:
    """West, south, east and north of a frame of the right shape round these places, with a margin."""
    xs, ys = [spot[0] for spot in spots], [spot[1] for spot in spots]
    width, height = max(1.12 * (max(xs) - min(xs)) + 6.0, 30.0), max(1.12 * (max(ys) - min(ys)) + 6.0, 20.0)
    width, height = max(width, _SHAPE * height), max(height, width / _SHAPE)
    x, y = (min(xs) + max(xs)) / 2.0, (min(ys) + max(ys)) / 2.0
    return (x - width / 2, y - height / 2, x + width / 2, y + height / 2)


def _land(rings: Sequence[_Line], view: _Box) -> str:
    """The land inside the frame as the path of an SVG; rings have it on their left."""
    frame = box(*view)
    ordered = sorted(rings, key=lambda ring: -float(Polygon(ring).area))
    land: BaseGeometry = frame if ordered and _clockwise(ordered[0]) else Polygon()
    for ring in ordered:
        inside = Polygon(ring).buffer(0).intersection(frame)
        land = land.difference(inside) if _clockwise(ring) else land.union(inside)
    return "" if land.is_empty else _outline(land.simplify(_BEND))


def _clockwise(ring: _Line) -> bool:
    return not LinearRing(ring).is_ccw


def _outline(shape: BaseGeometry) -> str:
    parts = getattr(shape, "geoms", [shape])
    rings = [ring for part in parts if part.geom_type == "Polygon" for ring in (part.exterior, *part.interiors)]
    return "".join(f"{path(ring.coords)}Z" for ring in rings)


def path(points: Iterable[Sequence[float]]) -> str:
    """Places as the path of an SVG."""
    return "M" + "L".join(f"{point[0]:.1f} {-point[1]:.1f}" for point in points)


def _square(x: float, y: float, half: float, yaw: float) -> list[_Spot]:
    """Corners of a square, whose edges are twice `half`."""
    c, s = half * math.cos(yaw), half * math.sin(yaw)
    return [(x - c + s, y - s - c), (x + c + s, y + s - c), (x + c - s, y + s + c), (x - c - s, y - s + c)]


def _arrow(x: float, y: float, yaw: float, reach: float) -> list[_Spot]:
    """Corners of the head of an arrow round a place."""
    return [_ahead(x, y, yaw + turn, share * reach) for turn, share in ((0.0, 1.0), (2.55, 0.8), (-2.55, 0.8))]


def _ahead(x: float, y: float, yaw: float, distance: float) -> _Spot:
    """The place at a distance in a direction."""
    return x + distance * math.cos(yaw), y + distance * math.sin(yaw)


def _cross(x: float, y: float, reach: float) -> str:
    """Two strokes through a place as the path of an SVG."""
    return path([(x - reach, y - reach), (x + reach, y + reach)]) + path(
        [(x - reach, y + reach), (x + reach, y - reach)]
    )


SHAPES = {"square": _square, "arrow": _arrow, "ahead": _ahead, "cross": _cross}
"""Functions of the template of a map."""


def sketch_of(world: World) -> _Values:
    """Shore, docks, objects, boats at their start, and what the task lays out."""
    scene = map_of(world)
    task = world.parameters.task
    shown = {showing.name: (showing.x, showing.y) for showing in scene.course.showings}
    spots = {item.name: shown.get(item.name, (item.x, item.y)) for item in scene.objects}
    return {
        "name": world.name,
        "description": world.parameters.description,
        "task": None if task is None else {"type": task.type, "name": task.name},
        **ground_of(scene),
        "objects": [
            {"name": item.name, "spot": list(spots[item.name]), "color": object_color(item), "size": item.size}
            for item in scene.objects
        ],
        "boats": [{"name": boat.name, "x": boat.x, "y": boat.y, "yaw": boat.yaw} for boat in scene.boats],
        "waypoints": [list(place) for place in scene.waypoints],
        **_laid_out(scene.course),
    }


def _laid_out(course: Course) -> _Values:
    animals = [(item.x, item.y, item.radius, f"{item.name}: {item.goal}") for item in course.animals]
    beacons = [(item.x, item.y, item.radius, item.name) for item in course.beacons]
    return {
        "gates": [{"left": list(gate.left), "right": list(gate.right), "yaw": gate.yaw} for gate in course.gates],
        "bays": [_bay(bay) for bay in course.bays],
        "paths": [
            rounded([path.start, *path.points, *(path.points[:1] if path.closed else ())]) for path in course.paths
        ],
        "circles": [_circle(*row) for row in animals + beacons if row[2] > 0.0],
        "beacons": [[item.x, item.y] for item in course.beacons],
    }


def _bay(bay: Bay) -> _Values:
    title = f"{bay.name}: {bay.symbol or 'no symbol'}".replace("_", " ")
    return {"corners": rounded(bay.internal[:, :2]), "allowed": bay.right, "title": title}


def _circle(x: float, y: float, radius: float, title: str) -> _Values:
    return {"x": x, "y": y, "radius": radius, "title": title.replace("_", " ")}
