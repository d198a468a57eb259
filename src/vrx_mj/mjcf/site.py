"""The site of a task: its names and places looked up in the world, and told with their place in the file if wrong."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.loading import problem_at
from vrx_mj.config.tasks import TaskConfig
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import ConfigError, Problem, UnknownNameError
from vrx_mj.mjcf.docks import find_dock
from vrx_mj.mjcf.placement import PlacedDock, PlacedObject
from vrx_mj.mjcf.terrain import on_land
from vrx_mj.model.tasks import Goal, Pinger

__all__ = ["Loc", "Row", "Site", "listed", "model_of"]

Row = dict[str, Any]
Loc = tuple[str | int, ...]


class Site:
    """A world with its boats, objects and docks, as its task sees them. What is wrong is kept until `check`."""

    def __init__(
        self,
        config: WorldConfig,
        boats: Sequence[BoatConfig],
        objects: Sequence[PlacedObject],
        docks: Sequence[PlacedDock],
    ) -> None:
        assert config.task is not None, "a world without a task"
        self.config = config
        self.task: TaskConfig = config.task
        self.boats = [boat.name for boat in boats]
        self.objects = {item.name: item for item in objects}
        self.docks = docks
        self._found: list[Problem] = []

    def fault(self, loc: Loc, message: str) -> None:
        """Something is wrong with what the task says at `loc`."""
        problem = problem_at(self.task.section, loc, message)
        self._found.append(replace(problem, key=f"task.{problem.key}" if problem.key else "task"))

    def check(self) -> None:
        """Tell all that is wrong.

        Raises:
            ConfigError: something is.
        """
        if self._found:
            raise ConfigError(dict.fromkeys(self._found))

    def boat(self) -> str:
        """Name of the boat that is scored: the named one, or the fleet's first."""
        name = self.task.boat
        if name is not None and name not in self.boats:
            self.fault(("boat",), str(UnknownNameError("boat", name, self.boats)))
        return name or self.boats[0]

    def object(self, loc: Loc, name: str, *, floating: bool = False) -> PlacedObject | None:
        """The single object of a name, which may have to float; None if it is not there."""
        item = self.objects.get(name)
        if item is None:
            self.fault(loc, str(UnknownNameError("object", name, self.objects)))
        elif floating and item.config.kind != "floating":
            self.fault(loc, f"'{name}' is static; a floating object is needed")
        return item

    def dock(self, loc: Loc, name: str) -> PlacedDock | None:
        """The dock of a name, which has bays; None if it is not there."""
        try:
            dock = find_dock(self.docks, name)
        except UnknownNameError as error:
            self.fault(loc, str(error))
            return None
        if not dock.berths.bays:
            self.fault(loc, f"'{name}' has no bays")
            return None
        return dock

    def place(self, loc: Loc, value: tuple[float, float, float], *, geodetic: bool) -> Goal:
        """A place on the water from [latitude, longitude, yaw] or [x, y, yaw], both ways; m, degrees and rad."""
        first, second, yaw = value
        earth = self.config.georeference
        if geodetic:
            assert earth is not None, "checked with the world"
            x, y, _ = earth.to_enu(first, second)
            place = Goal(x=x, y=y, yaw=yaw, latitude=first, longitude=second)
        else:
            place = Goal(x=first, y=second, yaw=yaw, **self._geodetic(first, second, 0.0))
        self._on_water(loc, place.x, place.y)
        return place

    def point(self, loc: Loc, value: tuple[float, float, float]) -> Pinger:
        """A point x, y, z [m] in or over the water, with its latitude and longitude [degrees]."""
        x, y, z = value
        self._on_water(loc, x, y)
        return Pinger(x=x, y=y, z=z, **self._geodetic(x, y, z))

    def parts(self, course: str | None) -> list[str]:
        """Names of the single objects of a course, without its own; of the whole world if it is None."""
        prefix = f"{course}/" if course else ""
        return [name.removeprefix(prefix) for name in self.objects if name.startswith(prefix)]

    def courses(self) -> list[str]:
        """Names of the objects that are made of others."""
        return list(dict.fromkeys(name.rpartition("/")[0] for name in self.objects if "/" in name))

    def _geodetic(self, x: float, y: float, z: float) -> Row:
        earth = self.config.georeference
        latitude, longitude = earth.to_geodetic(x, y, z)[:2] if earth else (None, None)
        return {"latitude": latitude, "longitude": longitude}

    def _on_water(self, loc: Loc, x: float, y: float) -> None:
        terrain = self.config.terrain
        if terrain and on_land(terrain, x, y, self.config.folder):
            self.fault(loc, f"on land: x {x:.2f} m, y {y:.2f} m is inside the shore of {terrain}")


def model_of(item: PlacedObject) -> str:
    """Name of an object's model, without the folder of its file."""
    return Path(item.model).stem


def listed(names: Iterable[str]) -> str:
    """Names in a message."""
    return ", ".join(names) or "none"
