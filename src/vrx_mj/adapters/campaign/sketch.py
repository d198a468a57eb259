"""A world as the page's maps draw it: plain data, from what the compiler made. Lengths in m, world frame."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from vrx_mj.adapters.map import DOCK_CELL, map_of
from vrx_mj.compiler.world import World

__all__ = ["sketch_of"]

Row = dict[str, Any]


def sketch_of(world: World) -> Row:
    """Shore, docks, objects, boats at their start, and what the task is about."""
    scene = map_of(world)
    task = world.parameters.get("task")
    shown = _shown(task or {}, world)
    return {
        "name": world.name,
        "description": world.parameters["description"],
        "task": None if task is None else {"type": task["type"], "name": task["name"]},
        "shore": [_points(ring) for ring in scene.shore],
        "docks": [{"name": dock.name, "cells": _points(dock.cells), "yaw": dock.yaw} for dock in scene.docks],
        "cell": DOCK_CELL,
        "objects": [
            {
                "name": item.name,
                **shown.get(item.name, {"x": item.x, "y": item.y}),
                "color": _hex(item.color),
                "size": item.size,
            }
            for item in scene.objects
        ],
        "boats": [{"name": boat.name, "x": boat.x, "y": boat.y, "yaw": boat.yaw} for boat in scene.boats],
        "waypoints": [list(place) for place in scene.waypoints] or list(_places(task or {})),
        "gates": list(_gates(task or {}, world)),
        "bays": list(_bays(task or {}, world)),
        "circles": list(_circles(task or {}, world)),
        "pinger": _pinger(task or {}),
    }


def _points(points: Any) -> list[list[float]]:
    return [[round(float(x), 2), round(float(y), 2)] for x, y in points]


def _hex(color: tuple[float, float, float]) -> str:
    return "#" + "".join(f"{round(255 * min(max(share, 0.0), 1.0)):02x}" for share in color)


def _places(task: Mapping[str, Any]) -> Iterator[list[float]]:
    """The task's goal or waypoints."""
    goal = task.get("goal")
    for place in [goal] if goal else task.get("waypoints") or ():
        yield [place["x"], place["y"], place["yaw"]]


def _shown(task: Mapping[str, Any], world: World) -> dict[str, Row]:
    """Where the objects of a perception task appear, which lie elsewhere at first: east and north by name."""
    starts = {boat["name"]: boat["pose"] for boat in world.parameters["boats"]}
    spots = {item["name"]: _turned(item["pose"], starts[task["boat"]]) for item in task.get("objects") or ()}
    return {name: {"x": x, "y": y} for name, (x, y) in spots.items()}


def _gates(task: Mapping[str, Any], world: World) -> Iterator[list[float]]:
    """Left and right buoy of each gate: x, y, x, y."""
    spots = {item["name"]: item["pose"][:2] for item in world.parameters["objects"]}
    channel = task.get("channel") or task
    for gate in channel.get("gates") or ():
        if gate["left"] in spots and gate["right"] in spots:
            yield [*spots[gate["left"]], *spots[gate["right"]]]


def _bays(task: Mapping[str, Any], world: World) -> Iterator[Row]:
    """Where a boat counts as docked: the corners of each bay's inner zone, from above."""
    docks = {dock["name"]: dock["pose"] for dock in world.parameters["docks"]}
    docks |= task.get("fixed") or {}
    pose = docks.get(task.get("anchor", ""))
    if pose is None:
        return
    for bay in task["bays"]:
        (x, y, _), (length, width, _) = bay["internal"]["center"], bay["internal"]["size"]
        spots = [(x + i * length / 2, y + j * width / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        told = f"{bay['name']}: {bay['symbol'] or 'no symbol'}".replace("_", " ")
        corners = [_turned(spot, pose) for spot in spots]
        yield {"corners": _points(corners), "allowed": bool(bay["dock_allowed"]), "told": told}


def _turned(spot: Sequence[float], pose: Sequence[float]) -> tuple[float, float]:
    """A place in the frame of a pose, in the world's."""
    c, s = math.cos(pose[5]), math.sin(pose[5])
    return pose[0] + c * spot[0] - s * spot[1], pose[1] + s * spot[0] + c * spot[1]


def _circles(task: Mapping[str, Any], world: World) -> Iterator[Row]:
    """The circle round each animal in which the boat engages it."""
    spots = {item["name"]: item["pose"][:2] for item in world.parameters["objects"]}
    for animal in task.get("animals") or ():
        if animal["name"] in spots:
            x, y = spots[animal["name"]]
            yield {"x": x, "y": y, "radius": task["engagement_distance"], "goal": animal["goal"]}


def _pinger(task: Mapping[str, Any]) -> list[float] | None:
    """Where the beacon is, if it stays there."""
    pinger = task.get("pinger")
    return [pinger["x"], pinger["y"]] if isinstance(pinger, Mapping) else None
