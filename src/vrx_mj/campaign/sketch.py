"""A world as the page's maps draw it: plain data, from what the compiler made. Lengths in m, world frame."""

from typing import Any

from vrx_mj.draw.course import Bay, Course
from vrx_mj.draw.map import map_of
from vrx_mj.mjcf.world import World

__all__ = ["sketch_of"]

Row = dict[str, Any]


def sketch_of(world: World) -> Row:
    """Shore, docks, objects, boats at their start, and what the task lays out."""
    scene = map_of(world)
    task = world.tree.get("task")
    shown = {showing.name: (showing.x, showing.y) for showing in scene.course.showings}
    spots = {item.name: shown.get(item.name, (item.x, item.y)) for item in scene.objects}
    return {
        "name": world.name,
        "description": world.tree["description"],
        "task": None if task is None else {"type": task["type"], "name": task["name"]},
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
