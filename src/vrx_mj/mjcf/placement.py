"""From the entries of a world file to single things with a name and a pose in the world.

The objects of a field are at points drawn from a seed, one by one, each where there is room for it. VRX's
generate_avoid_obstacles_buoys.py means to keep its points 5 m apart and does not; its field is kept as it is, in the
catalogue, and a new one is made here.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.bays import Cell
from vrx_mj.config.docks import Berths, DockPlacement, berths
from vrx_mj.config.layouts import is_clear
from vrx_mj.config.objects import FieldConfig, ObjectConfig, PathConfig, Placement, RopeConfig, load_object
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import CompileError
from vrx_mj.frames import Pose, compose
from vrx_mj.mjcf.terrain import land_distance
from vrx_mj.physics.noise import stream_key, uniform

_ORIGIN: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_DEFAULT_ROPE = RopeConfig()
"""Rope of an object in a world with current, unless it gives another, or swims."""


@dataclass(frozen=True)
class PlacedObject:
    """One body of the catalogue, floating or static, somewhere in the world."""

    name: str
    """Name in the world; a part of a course carries the course's name: `course/red_bound_0`."""
    model: str
    config: ObjectConfig
    pose: Pose
    path: PathConfig | None = None
    """Path along which it swims."""
    mooring: RopeConfig | None = None
    """Rope that holds it in worlds with current."""


@dataclass(frozen=True)
class PlacedDock:
    """One dock, somewhere in the world."""

    name: str
    """Name in the world; one of a composite object carries the object's name: `robotx_dock_2022/base`."""
    pose: Pose
    config: DockPlacement
    """Its entry in its file; `symbols` are those of the object that it came with, if that gives any."""
    parent: str
    """Prefix of its placards' names: its object's name, or its own if it is a world's."""

    @property
    def cells(self) -> tuple[Cell, ...]:
        """Row and column of each block in its drawing."""
        return self.config.cells

    @property
    def block(self) -> float:
        """Edge of a block [m]."""
        return self.config.block

    @property
    def berths(self) -> Berths:
        """Its bays, placards and holes, in its own frame."""
        return berths(self.config)


def place_objects(
    placements: Sequence[Placement], at: Pose = _ORIGIN, prefix: str = "", mooring: RopeConfig | None = _DEFAULT_ROPE
) -> Iterator[PlacedObject]:
    """Every single object of the placements, courses taken apart; `mooring` is that of objects that give none."""
    for item in placements:
        config = item.config
        pose = compose(at, item.pose)
        name = prefix + item.name
        if config.kind == "composite":
            yield from place_objects(config.objects, pose, f"{name}/", _rope(item, mooring))
        else:
            path = item.path if "path" in item.model_fields_set else config.path
            yield PlacedObject(name, item.model, config, pose, path, None if path else _rope(item, mooring))


def _rope(item: Placement, mooring: RopeConfig | None) -> RopeConfig | None:
    return item.mooring if "mooring" in item.model_fields_set else mooring


def place_docks(
    docks: Sequence[DockPlacement], placements: Sequence[Placement], at: Pose = _ORIGIN, prefix: str = ""
) -> Iterator[PlacedDock]:
    """Every dock: those of the world itself, then those inside its composite objects."""
    for dock in docks:
        yield PlacedDock(prefix + dock.name, compose(at, dock.pose), dock, prefix[:-1] or dock.name)
    for item in placements:
        config = item.config
        if config.kind == "composite":
            inner, name = compose(at, item.pose), f"{prefix}{item.name}/"
            yield from place_docks(_with_symbols(config.docks, item.symbols), config.objects, inner, name)


def _with_symbols(docks: Sequence[DockPlacement], symbols: Sequence[str]) -> list[DockPlacement]:
    """An object's docks with symbols on their placards, as far as there are any."""
    shown = []
    for dock in docks:
        count = len(berths(dock).placards) if symbols else 0
        own, symbols = symbols[:count], symbols[count:]
        shown.append(dock.model_copy(update={"symbols": (*own, *dock.symbols[len(own) :])}) if own else dock)
    return shown


_TRIES = 1000
"""Places that are tried for an object before the field is full."""


def place_fields(
    config: WorldConfig,
    boats: Sequence[tuple[float, float]],
    objects: Sequence[PlacedObject],
    docks: Sequence[PlacedDock],
) -> Iterator[PlacedObject]:
    """The objects of a world's fields, among boats at (x, y) [m], other objects and docks.

    Raises:
        CompileError: a field is full before all its objects have a place.
    """
    taken = np.array([*boats, *(item.pose[:2] for item in objects)], np.float64).reshape(-1, 2)
    ground = _Ground(config, docks)
    for field in config.fields:
        placed = list(_field(field, config, taken, ground))
        taken = np.concatenate([taken, [item.pose[:2] for item in placed]])
        yield from placed


def _field(field: FieldConfig, config: WorldConfig, taken: FloatArray, ground: "_Ground") -> Iterator[PlacedObject]:
    key = np.uint64(stream_key(config.seed if field.seed is None else field.seed, "field", field.name))
    wanted = [(kind, index) for kind in field.objects for index in range(kind.count)]
    counter = 0
    for done, (kind, index) in enumerate(wanted):
        for _ in range(_TRIES):
            x, y = (c + field.size * (uniform(key, np.uint64(counter + i)) - 0.5) for i, c in enumerate(field.center))
            counter += 2
            if is_clear(taken, x, y, field.min_distance) and ground.clear(x, y, field.min_distance):
                break
        else:
            raise CompileError(_full(field, config.name, done, len(wanted)))
        taken = np.concatenate([taken, [(x, y)]])
        model = load_object(kind.model, kind.folder)
        name = f"{field.name}/{kind.stem}_{index}"
        yield PlacedObject(name, kind.model, model, (x, y, 0.0, 0.0, 0.0, 0.0), model.path, _DEFAULT_ROPE)


def _full(field: FieldConfig, world: str, done: int, wanted: int) -> str:
    square = f"{field.size:g} m x {field.size:g} m around ({field.center[0]:g}, {field.center[1]:g})"
    return (
        f"world {world}: the field {field.name} is full: {done} of its {wanted} objects fit in {square}, "
        f"{field.min_distance:g} m from each other, boats, other objects, docks and the shore ({_TRIES} places were "
        "tried for the next one)"
    )


class _Ground:
    """Docks and land: what does not float away."""

    def __init__(self, config: WorldConfig, docks: Sequence[PlacedDock]) -> None:
        self._terrain, self._folder = config.terrain, config.folder
        self._blocks = [(dock.config.block / 2.0, _middles(dock)) for dock in docks]

    def clear(self, x: float, y: float, distance: float) -> bool:
        """Whether (x, y) is in the water and so far [m] from the shore and from docks, whose blocks count as discs."""
        if not all(is_clear(middles, x, y, distance + 2.0**0.5 * half) for half, middles in self._blocks):
            return False
        gap = land_distance(self._terrain, x, y, self._folder) if self._terrain else math.inf
        return gap > 0.0 and gap >= distance


def _middles(dock: PlacedDock) -> FloatArray:
    """Middles of a dock's blocks (n, 2) [m, world]."""
    edge = dock.config.block
    local = [(edge * i, edge * j, 0.0, 0.0, 0.0, 0.0) for i, j in dock.cells]
    return np.array([compose(dock.pose, pose)[:2] for pose in local], np.float64).reshape(-1, 2)
