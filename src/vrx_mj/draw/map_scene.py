"""What a map of a world shows, as plain data."""

import colorsys
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.arguments import check_kind
from vrx_mj.arrays import FloatArray
from vrx_mj.draw.colors import boat_color, hex_color
from vrx_mj.draw.course import Course, course_of, symbols_of
from vrx_mj.mjcf.objects import BALL
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Boat, boat_label
from vrx_mj.model.site import Dock, Object
from vrx_mj.model.water import Sea, Wind

if TYPE_CHECKING:
    import mujoco

Rgb = tuple[float, float, float]

_NO_FLEET = "single"
"""What the compiler calls the one boat of a world without a fleet."""
_DOCK_CELL = 2.0
"""Edge of a dock's cell [m] (VRX's dock_block)."""
_EMPTY = Course()


@dataclass(frozen=True)
class MapDock:
    """A dock: the centres of its cells (n, 2) [m] in the world frame, its yaw [rad] and the edge of a cell [m]."""

    name: str
    cells: FloatArray
    yaw: float
    block: float = _DOCK_CELL


@dataclass(frozen=True)
class MapObject:
    """A buoy, a post, ... at (x, y) [m]; `size` is its width as seen from above [m]."""

    name: str
    model: str
    x: float
    y: float
    color: Rgb
    size: float
    floating: bool = True


@dataclass(frozen=True)
class MapPlacard:
    """A placard at (x, y) [m] and its symbol, such as `red_circle`."""

    name: str
    x: float
    y: float
    symbol: str


@dataclass(frozen=True)
class MapBoat:
    """A boat at (x, y) [m] that heads to `yaw` [rad]; any colour matplotlib knows."""

    name: str
    x: float
    y: float
    yaw: float
    color: str | Rgb


@dataclass(frozen=True)
class MapScene:
    """All that a map shows. Lengths in m, world frame."""

    title: str
    shore: tuple[FloatArray, ...] = ()
    """Rings (n, 2), the land on their left."""
    docks: tuple[MapDock, ...] = ()
    objects: tuple[MapObject, ...] = ()
    boats: tuple[MapBoat, ...] = ()
    waypoints: tuple[tuple[float, float, float], ...] = ()
    """Places x, y and headings [rad], in their order."""
    wind: Wind | None = None
    sea: Sea | None = None
    """Wind and waves, where there are any."""
    placards: tuple[MapPlacard, ...] = ()
    course: Course = _EMPTY
    """What the task lays out."""
    x_from_east: float = 0.0
    """Direction of the x axis [rad], counter-clockwise from east."""


def map_of(world: World) -> MapScene:
    """The map of a compiled world at its start; CommandError if it is not one."""
    check_kind("map_of", world, World, "a World, as compile_world returns it")
    values = world.parameters
    fleet = f" with {values.fleet}" if values.fleet not in {"", _NO_FLEET} else ""
    wind, sea = values.wind, values.sea
    model = _model(world)
    shown = world.parameters.objects if model is not None else ()  # the MJCF holds their colours and widths
    return MapScene(
        title=f"{values.name}{fleet}",
        shore=tuple(np.asarray(ring, dtype=np.float64) for ring in values.shoreline),
        docks=tuple(_dock(dock) for dock in values.docks),
        objects=tuple(_object(model, item) for item in shown if item.model != BALL),
        boats=tuple(_boat(boat, i) for i, boat in enumerate(values.boats)),
        waypoints=values.waypoints,
        wind=wind if wind.mean > 0.0 else None,
        sea=sea if sea.waves else None,
        placards=tuple(_placards(world, model)),
        course=course_of(values),
        x_from_east=values.x_from_east,
    )


def _model(world: World) -> "mujoco.MjModel | None":
    """MuJoCo's model of the world, which has the looks of things and where placards hang; None where it has neither."""
    import mujoco

    if not world.parameters.objects and not world.parameters.placards:
        return None
    return mujoco.MjModel.from_xml_string(world.mjcf, assets=dict(world.assets))


def _dock(dock: Dock) -> MapDock:
    x, y, *_, yaw = dock.pose
    local = dock.block * np.asarray(dock.cells, dtype=np.float64).reshape(-1, 2)
    return MapDock(dock.name, local @ turn_matrix(yaw).T + [x, y], yaw, dock.block)


def turn_matrix(yaw: float) -> FloatArray:
    """The rotation (2, 2) by an angle [rad]."""
    return np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])


def _boat(boat: Boat, index: int) -> MapBoat:
    x, y, *_, yaw = boat.pose
    return MapBoat(boat_label(boat.name, boat.robot), x, y, yaw, hex_color(boat_color(index, boat.color)))


def _placards(world: World, model: "mujoco.MjModel | None") -> Iterator[MapPlacard]:
    import mujoco

    rows = world.parameters.placards
    if model is None or not rows:
        return
    data, symbols = mujoco.MjData(model), symbols_of(world.parameters)
    mujoco.mj_kinematics(model, data)
    for row in rows:
        x, y, _ = data.body(row.body).xpos.tolist()
        yield MapPlacard(row.name, x, y, symbols[row.name])


def _object(model: "mujoco.MjModel", item: Object) -> MapObject:
    color, size = _look(model, model.body(item.body).id)
    x, y = item.pose[:2]
    return MapObject(item.name, item.model, x, y, color, size, item.kind == "floating")


def _look(model: "mujoco.MjModel", body: int) -> tuple[Rgb, float]:
    """The colour that shows most of a body, vivid ones first, and the body's width [m]."""
    first, count = model.body_geomadr[body], model.body_geomnum[body]
    seen = [i for i in range(first, first + count) if model.geom_group[i] < 3 and model.geom_rgba[i, 3] > 0.1]
    shares: dict[Rgb, float] = {}
    width = 0.5
    for i in seen:
        half = model.geom_aabb[i, 3:]
        red, green, blue = (float(share) for share in model.geom_rgba[i, :3])
        color = (red, green, blue)
        vivid = 0.2 + colorsys.rgb_to_hsv(*color)[1]
        shares[color] = shares.get(color, 0.0) + vivid * float(
            half[0] * half[1] + half[1] * half[2] + half[2] * half[0]
        )
        width = max(width, 2.0 * float(sorted(half)[1]))
    return max(shares, key=lambda color: shares[color], default=(0.5, 0.5, 0.5)), width


def object_color(item: MapObject) -> str:
    """The colour of an object as `#rrggbb`."""
    return hex_color(round(255 * min(max(share, 0.0), 1.0)) for share in item.color)


def ground_of(scene: MapScene) -> dict[str, object]:
    """The shore and the docks for JSON."""
    docks = [
        {"name": dock.name, "cells": rounded(dock.cells), "yaw": dock.yaw, "cell": dock.block} for dock in scene.docks
    ]
    return {"shore": [rounded(ring) for ring in scene.shore], "docks": docks}


def rounded(points: Iterable[Sequence[float]] | FloatArray) -> list[list[float]]:
    """Points [m] to a centimetre."""
    return [[round(float(x), 2), round(float(y), 2)] for x, y in points]
