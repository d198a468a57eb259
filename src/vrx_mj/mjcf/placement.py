"""From the entries of a world file to single things with a name and a pose in the world."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from vrx_mj.config.docks import Berths, DockLayout, DockPlacement, berths, load_dock
from vrx_mj.config.objects import ObjectConfig, PathConfig, Placement, load_object
from vrx_mj.frames import Pose, compose

ORIGIN: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class PlacedObject:
    """One body of the catalogue, floating or static, somewhere in the world."""

    name: str
    """Name in the world; a part of a course carries the course's name: `course/red_bound_0`."""
    model: str
    config: ObjectConfig
    pose: Pose
    path: PathConfig | None = None
    """Along which it swims."""


@dataclass(frozen=True)
class PlacedDock:
    """One dock, somewhere in the world."""

    name: str
    """Name in the world; one of a composite object carries the object's name: `robotx_dock_2022/base`."""
    layout: DockLayout
    pose: Pose
    config: DockPlacement
    """Its entry in its file; `symbols` are those of the object that it came with, if that gives any."""
    parent: str
    """What its placards' names start with: its object's name, or its own if it is a world's."""

    @property
    def berths(self) -> Berths:
        """Its bays, placards and holes, in its own frame."""
        return berths(self.config, self.layout.cells)


def place_objects(placements: Sequence[Placement], at: Pose = ORIGIN, prefix: str = "") -> Iterator[PlacedObject]:
    """Every single object of the placements, courses taken apart."""
    for item in placements:
        config = load_object(item.model, item.folder)
        pose = compose(at, item.pose)
        name = prefix + item.name
        if config.kind == "composite":
            yield from place_objects(config.objects, pose, f"{name}/")
        else:
            path = item.path if "path" in item.model_fields_set else config.path
            yield PlacedObject(name, item.model, config, pose, path)


def place_docks(
    docks: Sequence[DockPlacement], placements: Sequence[Placement], at: Pose = ORIGIN, prefix: str = ""
) -> Iterator[PlacedDock]:
    """Every dock: those of the world itself, then those inside its composite objects."""
    for dock in docks:
        layout = load_dock(dock.layout, dock.folder)
        yield PlacedDock(prefix + dock.name, layout, compose(at, dock.pose), dock, prefix[:-1] or dock.name)
    for item in placements:
        config = load_object(item.model, item.folder)
        if config.kind == "composite":
            inner, name = compose(at, item.pose), f"{prefix}{item.name}/"
            yield from place_docks(_shown(config.docks, item.symbols), config.objects, inner, name)


def _shown(docks: Sequence[DockPlacement], symbols: Sequence[str]) -> list[DockPlacement]:
    """An object's docks with symbols on their placards, as far as there are any."""
    shown = []
    for dock in docks:
        count = len(berths(dock, load_dock(dock.layout, dock.folder).cells).placards) if symbols else 0
        own, symbols = symbols[:count], symbols[count:]
        shown.append(dock.model_copy(update={"symbols": (*own, *dock.symbols[len(own) :])}) if own else dock)
    return shown
