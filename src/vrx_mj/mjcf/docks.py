"""Docks of a world: their bays, placards and holes, where they are, and how the blocks of floating ones hang together.

A floating dock is one tree of hinges; constraints close its loops.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.bays import Cell
from vrx_mj.config.docks import neighbours
from vrx_mj.config.loading import problem_at
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import ConfigError, UnknownNameError
from vrx_mj.frames import Pose, apply, rotation
from vrx_mj.mjcf.placement import PlacedDock


class Blocks(Protocol):
    """A dock in the making, or of a compiled world."""

    @property
    def pose(self) -> Pose:
        """Pose at the start [m, rad]."""

    @property
    def cells(self) -> Sequence[Cell]:
        """Row and column of each block in its drawing."""

    @property
    def block(self) -> float:
        """Edge of a block [m]."""


def find_dock(docks: Sequence[PlacedDock], name: str) -> PlacedDock:
    """The dock of a name: that of an entry of `docks`, or of the one object that has a dock in it.

    Raises:
        UnknownNameError: no dock has that name, or the object has several docks.
    """
    known = {dock.name: dock for dock in docks}
    if name in known:
        return known[name]
    inside = [dock for dock in docks if dock.parent == name]
    if len(inside) == 1:
        return inside[0]
    names = [dock.parent if [other.parent for other in docks].count(dock.parent) == 1 else dock.name for dock in docks]
    raise UnknownNameError("dock", name, names)


def docks_overlap(a: Blocks, b: Blocks) -> bool:
    """Whether any block of one dock lies, seen from above, on a block of the other at the start."""
    squares = [_squares(dock) for dock in (a, b)]
    half = [dock.block / 2.0 for dock in (a, b)]
    apart = np.linalg.norm(squares[0][:, None] - squares[1][None], axis=-1)
    near = np.argwhere(apart < np.sqrt(2.0) * sum(half))
    axes = [_axes(dock) for dock in (a, b)]
    return any(_squares_meet(squares[1][j] - squares[0][i], axes, half) for i, j in near)


def block_corners(dock: PlacedDock) -> FloatArray:
    """(n, 4, 2): corners of the blocks in the world [m], seen from above."""
    around = dock.block / 2.0 * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    corners: FloatArray = _squares(dock)[:, None] + around @ _axes(dock)
    return corners


def _squares(dock: Blocks) -> FloatArray:
    """(n, 2): centres of the blocks in the world [m]."""
    local = dock.block * np.asarray(dock.cells, np.float64)
    centers: FloatArray = local @ _axes(dock) + np.array(dock.pose[:2])
    return centers


def _axes(dock: Blocks) -> FloatArray:
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


def check_docks(config: WorldConfig, docks: Sequence[PlacedDock]) -> None:
    """Refuse docks whose blocks lie on one another at the start, drawn ones and those of objects.

    Raises:
        ConfigError: some do; with the place in the file of each that lies on one before it.
    """
    found = [
        problem_at(config.section, _place_of(dock, config), f"the dock '{dock.name}' overlaps the dock '{other.name}'")
        for index, dock in enumerate(docks)
        for other in docks[:index]
        if docks_overlap(other, dock)
    ]
    if found:
        raise ConfigError(found)


def _place_of(dock: PlacedDock, config: WorldConfig) -> tuple[str | int, ...]:
    """Path of the pose of a dock, or of the object that it came with, in its world."""
    name = dock.name.partition("/")[0]
    groups = {"docks": config.docks, "objects": config.objects}
    return next((key, i, "pose") for key, group in groups.items() for i, item in enumerate(group) if item.name == name)


@dataclass(frozen=True)
class BlockTree:
    """Blocks from the root outward, each after the one that it hangs on."""

    cells: tuple[Cell, ...]
    parents: tuple[int, ...]
    """Number of the block that each block hangs on, in the order of `cells`; -1: it is the root."""
    closures: tuple[tuple[Cell, Cell], ...]
    """Neighbours of which none hangs on the other: their shared edge closes a loop."""

    @property
    def depths(self) -> tuple[int, ...]:
        """Hinges between each block and the root."""
        depths: list[int] = []
        for parent in self.parents:
            depths.append(0 if parent < 0 else depths[parent] + 1)
        return tuple(depths)


def block_tree(cells: Sequence[Cell]) -> BlockTree:
    """The shallowest tree of blocks that are in one piece; among equal roots the one with the nearest blocks."""
    blocks = frozenset(cells)
    trees = [_tree_from(root, blocks) for root in sorted(blocks)]
    best = min(trees, key=lambda tree: (max(tree.depths), sum(tree.depths)))
    assert len(best.cells) == len(blocks), "a dock that floats is in one piece"
    hangs = {(cell, best.cells[parent]) for cell, parent in zip(best.cells, best.parents, strict=True) if parent >= 0}
    pairs = ((cell, near) for cell in sorted(blocks) for near in neighbours(cell) if near in blocks and cell < near)
    loose = tuple(pair for pair in pairs if pair not in hangs and pair[::-1] not in hangs)
    return BlockTree(best.cells, best.parents, loose)


def _tree_from(root: Cell, blocks: frozenset[Cell]) -> BlockTree:
    """Breadth first, so that every block is as near to the root as it can be."""
    order, parents, place = [root], [-1], {root: 0}
    for cell in order:
        for near in neighbours(cell):
            if near in blocks and near not in place:
                place[near] = len(order)
                order.append(near)
                parents.append(place[cell])
    return BlockTree(tuple(order), tuple(parents), ())
