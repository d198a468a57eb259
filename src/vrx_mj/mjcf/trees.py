"""How the blocks of a floating dock hang together: as one tree of hinges, its loops closed by constraints."""

from collections.abc import Sequence
from dataclasses import dataclass

from vrx_mj.config.bays import Cell
from vrx_mj.config.docks import neighbours

__all__ = ["BlockTree", "block_tree"]


@dataclass(frozen=True)
class BlockTree:
    """Blocks from the root outward, each after the one that it hangs on."""

    cells: tuple[Cell, ...]
    parents: tuple[int, ...]
    """Of each block the number of the one that it hangs on, in the order of `cells`; -1: it is the root."""
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
