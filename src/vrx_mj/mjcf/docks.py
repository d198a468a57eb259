"""Docks of a world: their bays, placards and holes, and where they are."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.bays import Box
from vrx_mj.errors import UnknownNameError
from vrx_mj.frames import apply, rotation
from vrx_mj.mjcf.placement import PlacedDock
from vrx_mj.model import tasks

__all__ = ["block_corners", "dock_zones", "docks_overlap", "find_dock"]

Row = dict[str, Any]


def find_dock(docks: Sequence[PlacedDock], name: str) -> PlacedDock:
    """The dock of a name: that of an entry of `docks`, or of the one object that has a dock in it.

    Raises:
        UnknownNameError: there is none, or the object has several docks and none is meant.
    """
    known = {dock.name: dock for dock in docks}
    if name in known:
        return known[name]
    inside = [dock for dock in docks if dock.parent == name]
    if len(inside) == 1:
        return inside[0]
    names = [dock.parent if [other.parent for other in docks].count(dock.parent) == 1 else dock.name for dock in docks]
    raise UnknownNameError("dock", name, names)


def dock_zones(dock: PlacedDock) -> Row:
    """Everything about a dock that a task wants to know, as plain data; places in the dock's frame, m and rad.

    The dock's frame has its origin on the water in the middle of the drawing's first cell, x down the page, y to the
    right. It is where `anchor` stands: a static dock stays at `pose`, a dynamic one carries its frame with it, fixed to
    its root block (`vrx_mj.mjcf.trees`).

    - anchor: name of the dock, under which its frame is found while it floats; pose: where it is at the start;
      dynamic: whether it floats
    - bays: in their order, each {name, placard, symbol, internal: {center, size}, external: {center, size}}; `placard`
      is the full name of the bay's placard and `symbol` what that shows at the start, None where it has none
    - placards: {name, pose, symbol, shapes}, `name` as in `World.parameters.placards`
    - holes: {bay, size, center, box}, `bay` the name of its bay and `size` big or small
    """
    berths = dock.berths
    full = {placard.name: f"{dock.parent}/{placard.name}" for placard in berths.placards}
    symbols = {placard.name: placard.symbol for placard in berths.placards}
    return {
        "anchor": dock.name,
        "pose": list(dock.pose),
        "dynamic": dock.config.dynamic,
        "bays": [
            {
                "name": bay.name,
                "placard": full[bay.placard] if bay.placard else None,
                "symbol": symbols[bay.placard] if bay.placard else None,
                "internal": _box(bay.internal),
                "external": _box(bay.external),
            }
            for bay in berths.bays
        ],
        "placards": [
            {"name": full[item.name], "pose": list(item.pose), "symbol": item.symbol, "shapes": list(item.shapes)}
            for item in berths.placards
        ],
        "holes": [
            {"bay": berths.bays[hole.bay - 1].name, **hole.model_dump(include={"size", "center", "box"})}
            for hole in berths.holes
        ],
    }


def _box(box: Box) -> tasks.Box:
    return tasks.Box(center=box.center, size=box.size)


def docks_overlap(a: PlacedDock, b: PlacedDock) -> bool:
    """Whether any block of one dock lies, seen from above, on a block of the other at the start."""
    squares = [_squares(dock) for dock in (a, b)]
    half = [dock.config.block / 2.0 for dock in (a, b)]
    apart = np.linalg.norm(squares[0][:, None] - squares[1][None], axis=-1)
    near = np.argwhere(apart < np.sqrt(2.0) * sum(half))
    axes = [_axes(dock) for dock in (a, b)]
    return any(_squares_meet(squares[1][j] - squares[0][i], axes, half) for i, j in near)


def block_corners(dock: PlacedDock) -> FloatArray:
    """(n, 4, 2): corners of the blocks in the world [m], seen from above."""
    around = dock.config.block / 2.0 * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    corners: FloatArray = _squares(dock)[:, None] + around @ _axes(dock)
    return corners


def _squares(dock: PlacedDock) -> FloatArray:
    """(n, 2): centres of the blocks in the world [m]."""
    local = dock.config.block * np.asarray(dock.layout.cells, np.float64)
    centers: FloatArray = local @ _axes(dock) + np.array(dock.pose[:2])
    return centers


def _axes(dock: PlacedDock) -> FloatArray:
    """(2, 2): the dock's x and y axes in the world, a row each, as they lie on the water."""
    turn = rotation(*dock.pose[3:])
    return np.array([apply(turn, (1.0, 0.0, 0.0))[:2], apply(turn, (0.0, 1.0, 0.0))[:2]])


def _squares_meet(apart: FloatArray, axes: Sequence[FloatArray], half: Sequence[float]) -> bool:
    """Whether two squares whose middles are `apart` have points in common: no axis of either separates them."""
    for axis in np.concatenate(axes):
        reach = sum(edge * np.abs(own @ axis).sum() for edge, own in zip(half, axes, strict=True))
        if abs(float(apart @ axis)) >= reach - 1e-9:
            return False
    return True
