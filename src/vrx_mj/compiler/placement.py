"""From the entries of a world file to single things with a name and a pose in the world."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from vrx_mj.config.docks import DockLayout, load_dock
from vrx_mj.config.objects import DockPlacement, ObjectConfig, Placement, load_object
from vrx_mj.config.poses import Pose, compose

ORIGIN: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class PlacedObject:
    """One body of the catalogue, floating or static, somewhere in the world."""

    name: str
    """Name in the world; a part of a course carries the course's name: `course/red_bound_0`."""
    model: str
    config: ObjectConfig
    pose: Pose


@dataclass(frozen=True)
class PlacedDock:
    """One static dock, somewhere in the world."""

    name: str
    layout: DockLayout
    pose: Pose


def place_objects(placements: Sequence[Placement], at: Pose = ORIGIN, prefix: str = "") -> Iterator[PlacedObject]:
    """Every single object of the placements, courses taken apart."""
    for item in placements:
        config = load_object(item.model, item.folder)
        pose = compose(at, item.pose)
        name = prefix + item.name
        if config.kind == "composite":
            yield from place_objects(config.objects, pose, f"{name}/")
        else:
            yield PlacedObject(name, item.model, config, pose)


def place_docks(
    docks: Sequence[DockPlacement], placements: Sequence[Placement], at: Pose = ORIGIN, prefix: str = ""
) -> Iterator[PlacedDock]:
    """Every dock: those of the world itself, then those inside its composite objects."""
    for dock in docks:
        yield PlacedDock(prefix + dock.name, load_dock(dock.layout, dock.folder), compose(at, dock.pose))
    for item in placements:
        config = load_object(item.model, item.folder)
        if config.kind == "composite":
            inner, name = compose(at, item.pose), f"{prefix}{item.name}/"
            yield from place_docks(config.docks, config.objects, inner, name)
