"""Docks that lie on one another, which no world can have."""

from collections.abc import Sequence

from vrx_mj.config.loading import problem_at
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import ConfigError
from vrx_mj.mjcf.docks import docks_overlap
from vrx_mj.mjcf.placement import PlacedDock

__all__ = ["check_docks"]


def check_docks(config: WorldConfig, docks: Sequence[PlacedDock]) -> None:
    """Tell of docks whose blocks lie on one another at the start, drawn ones and those of objects.

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
