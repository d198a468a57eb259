"""What a dock's bays, placards and holes come to, from its drawing and its file together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING

from vrx_mj.config.bays import (
    FIRST_SYMBOL,
    Bay,
    BayConfig,
    Box,
    HoleConfig,
    PlacardConfig,
    bay_zones,
    board,
    board_holes,
    find_bays,
)
from vrx_mj.config.docks import Cell, neighbours

if TYPE_CHECKING:
    from vrx_mj.config.objects import DockPlacement

__all__ = ["MAX_BLOCKS", "Berth", "Berths", "berth_faults", "berths"]

MAX_BLOCKS = 200
"""Most blocks of a dynamic dock."""

Fault = tuple[tuple[str | int, ...], str]


@dataclass(frozen=True)
class Berth:
    """A bay of a dock, in the dock's frame [m]."""

    name: str
    internal: Box
    external: Box
    placard: str | None
    """Name of its placard."""


@dataclass(frozen=True)
class Berths:
    """All that a task wants to know of a dock."""

    bays: tuple[Berth, ...]
    placards: tuple[PlacardConfig, ...]
    holes: tuple[HoleConfig, ...]


def berths(dock: DockPlacement, cells: Sequence[Cell]) -> Berths:
    """Bays, placards and holes of a dock with these blocks; `berth_faults` has found nothing."""
    found = find_bays(cells)
    listed = _listed(dock, found)
    placards = _placards(dock, listed, found)
    bays = []
    for number, (bay, place) in enumerate(listed, 1):
        zones = bay_zones(place, dock.block) if place else (bay.internal, bay.external)
        internal, external = bay.internal or zones[0], bay.external or zones[1]
        assert internal is not None, "a bay without its zone"
        assert external is not None, "a bay without the zone outside"
        shown = placards.get(number)
        bays.append(Berth(bay.name or f"bay{number}", internal, external, shown.name if shown else None))
    holes = chain.from_iterable(board_holes(number, placard) for number, placard in placards.items())
    return Berths(tuple(bays), tuple(placards.values()), dock.holes if dock.holes is not None else tuple(holes))


def berth_faults(dock: DockPlacement, cells: Sequence[Cell]) -> Iterator[Fault]:
    """What is wrong with a dock of these blocks, as (path from the dock, message)."""
    yield from _bay_faults(dock, len(find_bays(cells)))
    yield from _placard_faults(dock, cells)
    if dock.mooring and not dock.dynamic:
        yield ("mooring",), "allowed only for a floating dock; remove it, or write `dynamic: true`"
    if dock.dynamic and len(cells) > MAX_BLOCKS:
        yield ("dynamic",), f"{len(cells)} blocks; a floating dock has at most {MAX_BLOCKS}"
    elif dock.dynamic and (apart := _apart(cells)):
        row, column = apart[0] + 1, apart[1] + 1
        text = f"the block in row {row}, column {column} is not connected to the first one"
        yield ("dynamic",), f"{text}; the blocks of a floating dock must join edge to edge"


def _listed(dock: DockPlacement, found: Sequence[Bay]) -> list[tuple[BayConfig, Bay | None]]:
    """The bays that the file lists, or all of the drawing, each with its place in the drawing."""
    bays = dock.bays if dock.bays is not None else (BayConfig(),) * len(found)
    return [(bay, found[index] if index < len(found) else None) for index, bay in enumerate(bays)]


def _placards(
    dock: DockPlacement, listed: Sequence[tuple[BayConfig, Bay | None]], found: Sequence[Bay]
) -> dict[int, PlacardConfig]:
    """The placards by the number of their bay, from 1."""
    if dock.placards is not None:
        placards = dict(enumerate(dock.placards, 1))
    elif dock.bays is None:
        return {}
    else:
        placards = {
            number: board(place, dock.block, f"{dock.name}_placard{number}", bay.placard, FIRST_SYMBOL)
            for number, (bay, place) in enumerate(listed, 1)
            if place is not None and bay.placard != "none"
        }
    symbols = {number: bay.symbol for number, (bay, _) in enumerate(listed, 1) if bay.symbol}
    symbols.update(zip(placards, dock.symbols, strict=False))
    return {
        number: placard.model_copy(update={"symbol": symbols[number]}) if number in symbols else placard
        for number, placard in placards.items()
    }


def _bay_faults(dock: DockPlacement, found: int) -> Iterator[Fault]:
    for index, bay in enumerate(dock.bays or ()):
        if index < found:
            continue
        has = f"the drawing has {found} bay{'s' * (found != 1)}"
        if bay.internal is None or bay.external is None:
            yield ("bays", index), f"{has}; a further bay needs `internal` and `external`"
        elif dock.placards is None and bay.placard != "none":
            yield ("bays", index), f"{has}; a further bay needs `placard: none`, or the dock `placards`"
    names = Counter(bay.name or f"bay{number}" for number, bay in enumerate(dock.bays or (), 1))
    yield from ((("bays",), f"duplicate name '{name}' of {count} bays") for name, count in names.items() if count > 1)


def _placard_faults(dock: DockPlacement, cells: Sequence[Cell]) -> Iterator[Fault]:
    found = find_bays(cells)
    if any(fault for fault in _bay_faults(dock, len(found))):
        return
    count = len(_placards(dock, _listed(dock, found), found))
    if len(dock.symbols) > count:
        yield ("symbols",), f"{len(dock.symbols)} symbols; this dock has {count} placard{'s' * (count != 1)}"
    for index, placard in enumerate(dock.placards or ()):
        if placard.block is not None and placard.block not in cells:
            row, column = placard.block
            yield ("placards", index, "block"), f"no block in row {row}, column {column}, both counted from 0"
    names = Counter(placard.name for placard in dock.placards or ())
    yield from ((("placards",), f"duplicate name '{name}' of {n} placards") for name, n in names.items() if n > 1)
    bays = len(dock.bays) if dock.bays is not None else len(found)
    yield from (
        (("holes", index, "bay"), f"this dock has {bays} bay{'s' * (bays != 1)}, got {hole.bay}")
        for index, hole in enumerate(dock.holes or ())
        if hole.bay > bays
    )


def _apart(cells: Sequence[Cell]) -> Cell | None:
    """The first block that no way over shared edges joins with the first of all."""
    reached, fresh = {cells[0]}, [cells[0]]
    while fresh:
        fresh = list({near for cell in fresh for near in neighbours(cell)} & set(cells) - reached)
        reached |= set(fresh)
    return next((cell for cell in cells if cell not in reached), None)
