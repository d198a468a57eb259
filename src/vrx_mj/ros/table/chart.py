"""`/vrx_mj/world`: what a world looks like from above and how its boats are driven, for programs that show it."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from functools import lru_cache
from typing import Any
from weakref import WeakKeyDictionary

from vrx_mj.draw.map import map_of
from vrx_mj.drive.helm.engines import engines_of
from vrx_mj.mjcf.world import World
from vrx_mj.ros.messages import Message, new
from vrx_mj.ros.offer import Output
from vrx_mj.ros.table.host import Host
from vrx_mj.runtime.simulation import Simulation

__all__ = ["WORLD", "chart_output"]

WORLD = "/vrx_mj/world"
Row = dict[str, Any]
Place = tuple[float, float, float]
_grounds: WeakKeyDictionary[Simulation, Row] = WeakKeyDictionary()


def chart_output(host: Host) -> Output:
    """The topic: std_msgs/String with a JSON object, told again when boats come or go and when the task shows its goal.

    Lengths in m, angles in rad, world frame: `name`, `cmd_vel` (what it commands: thrust or velocity), `shore` (rings,
    the land on their left), `docks`, `objects`, `course` (places that the task names, x, y and heading) and `boats`,
    each with its engines as `drive.helm` has them. Nothing in it is hidden from a team by its task.
    """

    @lru_cache(maxsize=1)
    def told(course: tuple[Place, ...]) -> Message:
        world = host.sim.world
        boats = {boat: {"engines": [asdict(engine) for engine in engines_of(world, boat)]} for boat in host.sim.boats}
        text = json.dumps({**_ground(host), "course": course, "boats": boats}, separators=(",", ":"))
        return new("std_msgs/String", data=text)

    return Output(WORLD, "std_msgs/String", lambda: told(_course(host)), latched=True)


def _course(host: Host) -> tuple[Place, ...]:
    """What the task tells a team now of where it is to go."""
    task = host.sim.task or {}
    if task.get("type") == "acoustic_tracking":
        return ()  # its goal is the beacon, which is to be found
    places = task.get("waypoints") or ([task["goal"]] if task.get("goal") else [])
    return tuple((float(place["x"]), float(place["y"]), float(place.get("yaw", 0.0))) for place in places)


def _ground(host: Host) -> Row:
    """What boats that come and go do not change; drawn up once for a simulation, which takes a tenth of a second."""
    if host.sim not in _grounds:
        _grounds[host.sim] = _still(host.sim.world)
    return {"cmd_vel": host.cmd_vel, **_grounds[host.sim]}


def _still(world: World) -> Row:
    scene = map_of(world)
    return {
        "name": world.name,
        "shore": [_points(ring) for ring in scene.shore],
        "docks": [
            {"name": dock.name, "cells": _points(dock.cells), "yaw": dock.yaw, "cell": dock.block}
            for dock in scene.docks
        ],
        "objects": [
            {"name": item.name, "x": item.x, "y": item.y, "color": _hex(item.color), "size": item.size}
            for item in scene.objects
        ],
    }


def _points(points: Any) -> list[list[float]]:
    return [[round(float(x), 2), round(float(y), 2)] for x, y in points]


def _hex(color: Sequence[float]) -> str:
    return "#" + "".join(f"{round(255 * min(max(share, 0.0), 1.0)):02x}" for share in color)
