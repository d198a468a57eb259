"""Docks of a world: their bays, placards and holes, where they are, and their pieces of MJCF.

A fixed dock is one body. A floating one is a tree of blocks on hinges; constraints close its loops.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.docks import RGB, Cell, PlacardConfig, neighbours
from vrx_mj.config.loading import problem_at
from vrx_mj.config.objects import ObjectConfig, load_object
from vrx_mj.config.weather import WindConfig
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import ConfigError, UnknownNameError
from vrx_mj.frames import ZERO, Pose, Vector, apply, compose, inverse, rotation
from vrx_mj.mjcf.objects import PlacedDock, element_row
from vrx_mj.mjcf.parameters import NO_WIND, Rows, wind_coefficients
from vrx_mj.mjcf.pieces import Piece
from vrx_mj.mjcf.templates import Geom, Mesh, geoms, meshes
from vrx_mj.model.kinds import record_from
from vrx_mj.model.things import Block, Dock, Element, Mooring, Placard

BLOCK_MODELS = {0.5: "dock_block", 1.0: "dock_block_2x2", 1.5: "dock_block_3x3", 2.0: "dock_block_4x4_dynamic"}
"""Floating objects by the edge of the block [m] whose mass and buoyancy they give."""
_BLOCK_HEIGHT = 0.25
"""Height of the blocks' middles over the dock's origin, where they start [m]. VRX: dock_generator.erb."""
_MAX_BEND = 0.1
"""Largest angle of a hinge between two blocks [rad]. VRX: dock_generator.erb."""
_CONTACT_FREE_BLOCKS = 2
"""Blocks up to this many rows and columns away are never tested for contact with a placard's own block."""


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
    """Corners of the blocks in the world, (n, 4, 2) [m], seen from above."""
    around = dock.block / 2.0 * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    return _squares(dock)[:, None] + around @ _axes(dock)


def _squares(dock: Blocks) -> FloatArray:
    """Centres of the blocks in the world, (n, 2) [m]."""
    local = dock.block * np.asarray(dock.cells, np.float64)
    centers: FloatArray = local @ _axes(dock) + np.array(dock.pose[:2])
    return centers


def _axes(dock: Blocks) -> FloatArray:
    """The dock's x and y axes in the world, (2, 2), a row each, as they lie on the water."""
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


_Row = dict[str, Any]


def dock_piece(dock: PlacedDock) -> Piece:
    """A dock with its placards. Its names are whole, as placards have those of their object."""
    cells, edge = dock.cells, dock.config.block
    boards = [_board(dock, item) for item in dock.geometry.placards]
    needed = list(dict.fromkeys(mesh for item in dock.geometry.placards for mesh in _meshes(item)))
    values: _Row = {"name": dock.name, "block": edge, "height": _BLOCK_HEIGHT, "meshes": needed}
    if dock.config.dynamic:
        tree = block_tree(cells)
        bodies = dict(zip(tree.cells, _bodies(dock, tree), strict=True))
        values |= {
            "root": _nodes(dock, tree, boards),
            "bend": _MAX_BEND,
            "inertia": (_block(edge).inertia or ())[:3],
            "excluded": [(bodies[a], bodies[b]) for a, b in _beside(cells)] + list(_around(dock, boards, bodies)),
            "closures": [_closure(bodies, pair, tree.cells[0], edge) for pair in tree.closures],
        }
        template = "floating_dock.xml.j2"
    else:
        values |= {"cells": cells, "boards": boards}
        template = "dock.xml.j2"
    return Piece.from_template(template, {mesh.file: mesh.content for mesh in needed}, **values)


def dock_entry(dock: PlacedDock) -> Dock:
    """The record of a dock; `bodies` are those that move on their own, the root first."""
    placards = [f"{dock.parent}/{item.name}/link" for item in dock.geometry.placards]
    bodies = _bodies(dock, block_tree(dock.cells)) if dock.config.dynamic else [f"{dock.name}/dock"]
    return record_from(Dock, dock, dock.config, bodies=tuple(bodies), placards=tuple(placards))


def dock_rows(dock: PlacedDock, wind: WindConfig | None, gravity: float, tables: Rows) -> Rows:
    """The rows that a dock adds at the ends of a world's tables."""
    placards = [
        Placard(
            name=f"{dock.parent}/{item.name}",
            body=f"{dock.parent}/{item.name}/link",
            geoms={shape: tuple(str(geom.name) for geom in _symbol(dock, item, shape)) for shape in item.shapes},
            symbol=item.symbol,
        )
        for item in dock.geometry.placards
    ]
    rows = Rows(docks=[dock_entry(dock)], placards=placards)
    if dock.config.dynamic:
        first = len(tables.blocks)
        blocks, elements = _block_rows(dock, wind, gravity, first, len(tables.elements))
        rows.add(Rows(blocks=blocks, elements=elements, moorings=_moorings(dock, first)))
    return rows


def _block_rows(
    dock: PlacedDock, wind: WindConfig | None, gravity: float, first: int, first_element: int
) -> tuple[list[Block], list[Element]]:
    """Rows of a floating dock's blocks, each after the one that it hangs on, and those of their buoyancy elements.

    `first` and `first_element` are the numbers that they get. Wind on a dock acts on its root, as VRX's on one link.
    """
    tree, edge = block_tree(dock.cells), dock.config.block
    config = _block(edge)
    buoyancy = config.buoyancy
    assert buoyancy is not None, "a block without buoyancy"
    assert config.mass is not None, "a block without mass"
    listed = wind_coefficients(wind, dock.name, dock.parent) or NO_WIND
    rows: list[Block] = []
    elements: list[Element] = []
    for index, body in enumerate(_bodies(dock, tree)):
        position, anchor, axis = _hinge(tree, index, edge)
        block = record_from(
            Block,
            config,
            buoyancy,
            body=body,
            parent=first + tree.parents[index] if index else -1,
            depth=tree.depths[index],
            position=position,
            anchor=anchor,
            axis=axis,
            offset=_center(tree.cells[0], edge) if index == 0 else ZERO,
            density=buoyancy.fluid_density,
            gravity=gravity,
            level=buoyancy.fluid_level,
            element_start=first_element + len(elements),
            element_count=len(buoyancy.elements),
            wind=listed if index == 0 else NO_WIND,
        )
        rows.append(block)
        # VRX's 2 x 2 block has its mass and its collision box beside its buoyancy; a dock's blocks have them in line
        middles = [element.model_copy(update={"pose": (0.0, 0.0, *element.pose[2:])}) for element in buoyancy.elements]
        elements += map(element_row, middles)
    return rows, elements


def _moorings(dock: PlacedDock, first: int) -> list[Mooring]:
    """A floating dock's lines, each from a corner to where that is at the start; `first` is its first block's row."""
    mooring = dock.config.mooring
    if mooring is None:
        return []
    tree, edge = block_tree(dock.cells), dock.config.block
    turn, rows = rotation(*dock.pose[3:]), list[Mooring]()
    for sx, sy in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        cell = max(dock.cells, key=lambda cell: (sx * cell[0] + sy * cell[1], sx * cell[0]))
        index = tree.cells.index(cell)
        corner = (edge * (cell[0] + sx / 2), edge * (cell[1] + sy / 2), _BLOCK_HEIGHT)
        there = apply(turn, corner)
        origin = ZERO if index == 0 else _center(cell, edge)
        line = record_from(
            Mooring,
            mooring,
            block=first + index,
            point=(corner[0] - origin[0], corner[1] - origin[1], corner[2] - origin[2]),
            anchor=(dock.pose[0] + there[0], dock.pose[1] + there[1]),
        )
        rows.append(line)
    return rows


def _block(edge: float) -> ObjectConfig:
    return load_object(BLOCK_MODELS[edge])


def _center(cell: Cell, edge: float) -> Vector:
    """Middle of a block in the dock's frame [m]."""
    return edge * cell[0], edge * cell[1], _BLOCK_HEIGHT


def _bodies(dock: PlacedDock, tree: BlockTree) -> list[str]:
    """Bodies of the blocks; that of the root has the frame of the dock."""
    return [f"{dock.name}/dock", *(f"{dock.name}/dock_block_{i}_{j}" for i, j in tree.cells[1:])]


def _hinge(tree: BlockTree, index: int, edge: float) -> tuple[Vector, Vector, Vector]:
    """Where a block's frame is in the frame of the one it hangs on, and the hinge's point and axis in its own."""
    if index == 0:
        return ZERO, ZERO, (1.0, 0.0, 0.0)
    cell, parent = tree.cells[index], tree.cells[tree.parents[index]]
    origin = ZERO if tree.parents[index] == 0 else _center(parent, edge)
    x, y, z = (a - b for a, b in zip(_center(cell, edge), origin, strict=True))
    di, dj = parent[0] - cell[0], parent[1] - cell[1]
    return (x, y, z), (edge * di / 2, edge * dj / 2, 0.0), (float(abs(dj)), float(abs(di)), 0.0)


def _nodes(dock: PlacedDock, tree: BlockTree, boards: Sequence[_Row]) -> _Row:
    """The root's block for the template, with those that hang on it."""
    edge, rows = dock.config.block, _block_rows(dock, None, 0.0, 0, 0)[0]
    nodes: list[_Row] = []
    for cell, row in zip(tree.cells, rows, strict=True):
        x, y, z = _center(cell, edge) if nodes else ZERO
        own = [board for board in boards if board["block"] == cell]
        for board in own:  # in the frame of the block that carries it
            ahead, left, up, *turn = board["pose"]
            board["pose"] = (ahead - x, left - y, up - z, *turn)
        geom = f"{dock.name}/dock_block_{cell[0]}_{cell[1]}"
        node = {"row": row, "geom": geom, "boards": own, "blocks": []}
        if nodes:
            nodes[row.parent]["blocks"].append(node)
        nodes.append(node)
    return nodes[0]


def _board(dock: PlacedDock, item: PlacardConfig) -> _Row:
    """A placard for the template, in the frame of the dock."""
    model = load_object(item.model)
    cells, edge = dock.cells, dock.config.block
    nearest = min(cells, key=lambda cell: math.dist(_center(cell, edge)[:2], item.pose[:2]))
    symbols = [geom for shape in item.shapes for geom in _symbol(dock, item, shape)]
    return {
        "body": f"{dock.parent}/{item.name}/link",
        "pose": item.pose,
        "block": item.block or nearest,
        "geoms": [*geoms(model.collisions), *geoms(model.visuals), *symbols],
    }


def _symbol(dock: PlacedDock, item: PlacardConfig, shape: str) -> list[Geom]:
    """The geoms of a shape on a board, seen if it is the one to show."""
    color, wanted = item.symbol.split("_")
    rgba = (*RGB[color], 1.0 if shape == wanted else 0.0)
    place = compose(inverse(item.pose), item.symbol_pose)  # in the frame of its board
    visuals = load_object(f"symbol_{shape}").visuals
    parts = geoms(part.model_copy(update={"pose": compose(place, part.pose)}) for part in visuals)
    name = f"{dock.parent}/{item.name}/{shape}"
    return [replace(geom, name=f"{name}{number}", rgba=rgba) for number, geom in enumerate(parts, 1)]


def _meshes(item: PlacardConfig) -> list[Mesh]:
    model = load_object(item.model)
    symbols = [part for shape in item.shapes for part in load_object(f"symbol_{shape}").visuals]
    return meshes([*model.collisions, *model.visuals, *symbols])


def _beside(cells: Sequence[Cell]) -> Iterator[tuple[Cell, Cell]]:
    """Pairs of blocks that share an edge or a corner."""
    there = frozenset(cells)
    for i, j in cells:
        after = (i, j + 1), (i + 1, j - 1), (i + 1, j), (i + 1, j + 1)
        yield from (((i, j), near) for near in after if near in there)


def _around(dock: PlacedDock, boards: Sequence[_Row], bodies: Mapping[Cell, str]) -> Iterator[tuple[str, str]]:
    """Pairs of a placard and a block that is near its own."""
    for board in boards:
        row, column = board["block"]
        for (i, j), body in bodies.items():
            if max(abs(i - row), abs(j - column)) <= _CONTACT_FREE_BLOCKS and (i, j) != (row, column):
                yield board["body"], body


def _closure(bodies: Mapping[Cell, str], pair: tuple[Cell, Cell], root: Cell, edge: float) -> _Row:
    """Two points that two blocks share: the ends of an edge, in the frame of the first."""
    (i, j), (k, m) = pair
    x, y, z = _center((i, j), edge) if (i, j) == root else ZERO
    half = edge / 2
    ends = [(x + half * (k - i + s * (m - j)), y + half * (m - j + s * (k - i)), z) for s in (-1.0, 1.0)]
    return {"first": bodies[i, j], "second": bodies[k, m], "ends": ends}
