"""A world in the making: pieces under their names and rows of tables, each thing after all others."""

from typing import Any

from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.weather import WindConfig
from vrx_mj.config.world import PhysicsConfig
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.docks import dock_piece, dock_rows
from vrx_mj.mjcf.objects import PlacedDock, PlacedObject, object_piece, object_rows
from vrx_mj.mjcf.parameters import Rows
from vrx_mj.mjcf.pieces import Part, Piece
from vrx_mj.mjcf.robots import boat_kind, boat_rows
from vrx_mj.model.boats import Hull
from vrx_mj.model.water import Sea


class Assembly:
    """Parts that are added to a world, and the world's rows with theirs."""

    def __init__(self, wind: WindConfig | None, physics: PhysicsConfig, sea: Sea, rows: Rows) -> None:
        """Begin with the rows of a world."""
        self.wind, self.physics, self.sea, self.rows = wind, physics, sea, rows
        self.parts: list[Part] = []
        self._kinds: dict[Any, Piece] = {}

    def add_dock(self, dock: PlacedDock) -> None:
        """Add a dock with its placards."""
        self.parts.append(Part(dock.name, dock_piece(dock), dock.pose))
        self.rows.add(dock_rows(dock, self.wind, self.physics.gravity, self.rows))

    def add_object(self, item: PlacedObject, *, asleep: bool = False) -> None:
        """Add an object; those of one model share a piece."""
        kind = (item.model, item.config.folder, asleep)
        if kind not in self._kinds:
            self._kinds[kind] = object_piece(item.config, asleep=asleep)
        self.parts.append(Part(item.name, self._kinds[kind], item.pose))
        self.rows.add(object_rows(item, self.wind, self.physics, self.rows))

    def add_boat(self, robot: Boat, boat: BoatConfig, life: int = 0) -> Hull:
        """Add a boat, which `life` boats of its name were before; its hull is returned."""
        kind = boat_kind(robot, boat.engines, boat.color)
        self.parts.append(Part(boat.name, kind.piece, boat.pose))
        self.rows.add(boat_rows(kind, boat, self.rows, self.wind, self.physics, self.sea, life))
        return self.rows.hulls[-1]
