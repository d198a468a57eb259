"""The boats of a fleet in its own frame: which are numbered, and what its `boats` change about them or add."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from vrx_mj.config.layouts import HEIGHT, Layout, headings, spots, square
from vrx_mj.config.poses import Pose

if TYPE_CHECKING:
    from vrx_mj.config.fleet import BoatEntry, FleetConfig

__all__ = ["Loc", "Slot", "fleet_faults", "room_faults", "slots"]

RADIUS = 20.0
"""Of a circle whose file says none [m]: that of the published guide's ring."""
SPACING = 10.0
"""Of neighbours whose file says none [m]: twice the length of a WAM-V."""

KEYS = {
    "radius": ("circle",),
    "start_angle": ("circle",),
    "spacing": ("line", "column", "wedge", "grid", "random"),
    "size": ("random",),
    "seed": ("random",),
    "heading": ("circle", "line", "column", "wedge", "grid", "random"),
}
"""With which layouts a key goes."""

Loc = tuple[str | int, ...]
Fault = tuple[Loc, str]


class Slot(NamedTuple):
    """A boat in the fleet's frame."""

    name: str
    pose: Pose
    entry: BoatEntry | None
    where: Loc
    """What puts the boat where it is."""
    own: Loc
    """What says something about this boat alone; () if nothing does."""


def slots(fleet: FleetConfig, seed: int) -> list[Slot]:
    """Numbered boats with what `boats` changes about them, then the boats that it adds; `seed` is the world's."""
    found = [
        Slot(f"wamv{i + 1}", pose, None, ("positions", i) if i < len(fleet.positions) else (), ())
        for i, pose in enumerate(_numbered(fleet, seed))
    ]
    count = len(found)
    for index, entry in enumerate(fleet.boats):
        own: Loc = ("boats", index)
        at = _slot_of(entry, index, count)
        if at is not None:
            name, pose, _, where, _ = found[at]
            found[at] = Slot(entry.name or name, entry.pose or pose, entry, own if entry.pose else where, own)
        elif entry.pose is not None:
            found.append(Slot(entry.name or f"wamv{len(found) + 1}", entry.pose, entry, own, own))
    return found


def _numbered(fleet: FleetConfig, seed: int) -> list[Pose]:
    """Poses of the numbered boats in the fleet's frame: their positions, and the layout's for those without one."""
    given = [position.pose_in(fleet.headings or "math") for position in fleet.positions]
    count = _count(fleet)
    if count == len(given):
        return given
    layout = _layout(fleet, seed)
    places = spots(layout, count)
    turns = headings(layout, places)
    placed = [(x, y, HEIGHT, 0.0, 0.0, turn) for (x, y), turn in zip(places, turns, strict=True)]
    return [*given, *placed[len(given) :]]


def _layout(fleet: FleetConfig, seed: int) -> Layout:
    heading = fleet.heading
    if isinstance(heading, float | int):
        heading = math.radians(90.0 - heading if fleet.headings == "compass" else heading)
    return Layout(
        name=fleet.layout or "line",
        radius=fleet.radius or RADIUS,
        spacing=fleet.spacing or SPACING,
        start_angle=math.radians(fleet.start_angle or 0.0),
        heading=heading,
        size=fleet.size,
        seed=seed if fleet.seed is None else fleet.seed,
    )


def _count(fleet: FleetConfig) -> int:
    """How many boats are numbered: those with positions, and those that a layout places beside them."""
    if fleet.positions:
        return (fleet.layout and fleet.usv_count) or len(fleet.positions)
    if fleet.layout or not any(entry.pose for entry in fleet.boats):
        return fleet.usv_count or 0
    return 0


def _slot_of(entry: BoatEntry, index: int, count: int) -> int | None:
    """Which numbered boat an entry is about: that of its name, or else of its place; None: a new one."""
    number = (entry.name or "").removeprefix("wamv")
    if entry.name and entry.name.startswith("wamv") and number.isdecimal() and 1 <= int(number) <= count:
        return int(number) - 1
    return index if index < count and (entry.name is None or entry.pose is None) else None


def fleet_faults(fleet: FleetConfig) -> list[Fault]:
    """What does not go together in a fleet's file."""
    return [*_count_faults(fleet), *_layout_faults(fleet)] or _entry_faults(fleet)


def _count_faults(fleet: FleetConfig) -> Iterator[Fault]:
    given, placed = fleet.usv_count, len(fleet.positions)
    if given is not None and (given < placed or (given != placed and placed and not fleet.layout)):
        yield ("usv_count",), f"{given}, but `positions` has {placed}"
    alone = not fleet.positions and not fleet.layout and any(entry.pose for entry in fleet.boats)
    if given is not None and alone and given != len(fleet.boats):
        yield ("usv_count",), f"{given}, but `boats` has {len(fleet.boats)}"
    if fleet.layout and given is None and not placed:
        yield ("usv_count",), f"required for layout {fleet.layout} without positions"


def _layout_faults(fleet: FleetConfig) -> Iterator[Fault]:
    for key, layouts in KEYS.items():
        if getattr(fleet, key) is not None and fleet.layout not in layouts:
            words = " or ".join(filter(None, (", ".join(layouts[:-1]), layouts[-1])))
            yield (key,), f"allowed only for layout {words}, got {fleet.layout or 'no layout'}"


def _entry_faults(fleet: FleetConfig) -> list[Fault]:
    count, taken = _count(fleet), set()
    found: list[Fault] = []
    for index, entry in enumerate(fleet.boats):
        slot = _slot_of(entry, index, count)
        if slot is None and entry.pose is None:
            found.append((("boats", index, "pose"), f"required: this boat is not one of the {count} placed ones"))
        elif slot in taken:
            found.append((("boats", index), f"duplicate entry for wamv{(slot or 0) + 1}"))
        if slot is not None:
            taken.add(slot)
    return found


def room_faults(fleet: FleetConfig, seed: int) -> Iterator[Fault]:
    """A random layout whose square is full before all its boats have a place."""
    if fleet.layout != "random":
        return
    count, layout = _count(fleet), _layout(fleet, seed)
    done = len(spots(layout, count))
    if done < count:
        edge, enough = square(layout, count), math.ceil(square(replace(layout, size=None), count))
        text = f"{done} of {count} boats fit in {edge:g} m x {edge:g} m, {layout.spacing:g} m apart"
        yield ("size",) if fleet.size else ("layout",), f"{text}; use {enough} m or more, or a smaller spacing"
