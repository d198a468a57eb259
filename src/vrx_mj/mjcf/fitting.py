"""A boat as a piece of a world and as rows of the runtime's tables, made once for each kind."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from vrx_mj.arrays import FloatArray
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.world import PhysicsConfig, WindConfig
from vrx_mj.mjcf.afloat import outline
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.masses import Engines
from vrx_mj.mjcf.parameters import Row, hull_physics
from vrx_mj.mjcf.pieces import PREFIX, Piece
from vrx_mj.mjcf.robots import Color, hull_row, robot_piece, sensor_rows, station_rows, thruster_rows
from vrx_mj.mjcf.wind import boat_wind

__all__ = ["Fitted", "boat_rows", "fitted", "renamed"]

KEPT = 32
"""Kinds of boats that are kept: making one takes 0.1 s."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """What all boats of a kind have in common; names start with `PREFIX`."""

    boat: Boat
    piece: Piece
    hull: Row
    stations: Sequence[Row]
    thrusters: Sequence[Row]
    sensors: Sequence[Row]

    @cached_property
    def outline(self) -> FloatArray:
        """Corners (4, 2) seen from above, in its own axes [m]."""
        return outline(self.boat)


_FITTED: dict[tuple[int, Engines, Color | None], Fitted] = {}
"""By the boat itself, which is held as long as its entry is, and what else makes the kind."""


def fitted(boat: Boat, engines: Engines, color: Color | None) -> Fitted:
    """A kind of boat as a piece and rows; the same object for the same boat."""
    kind = (id(boat), engines, color)
    if kind not in _FITTED:
        while len(_FITTED) >= KEPT:
            del _FITTED[next(iter(_FITTED))]
        _FITTED[kind] = Fitted(
            boat,
            robot_piece(boat, engines, color),
            hull_row(boat, engines, PREFIX),
            station_rows(boat),
            thruster_rows(boat, engines, PREFIX),
            sensor_rows(boat, PREFIX),
        )
    return _FITTED[kind]


def boat_rows(
    fit: Fitted, boat: BoatConfig, tables: Mapping[str, Sequence[Row]], wind: WindConfig | None, physics: PhysicsConfig
) -> dict[str, list[Row]]:
    """The rows that a boat adds at the ends of a world's tables, by table."""
    row, thrusters, sensors = renamed((fit.hull, fit.thrusters, fit.sensors), f"{boat.name}/")
    row |= hull_physics(physics)
    row["wind"] = boat_wind(wind, physics, boat.name, boat.robot, own=fit.boat.wind)
    row["station_start"], row["station_count"] = len(tables["stations"]), len(fit.stations)
    start = len(tables["thrusters"])
    row["thruster_start"], row["thruster_count"] = start, len(thrusters)
    for thruster in thrusters:
        thruster["hull"] = len(tables["hulls"])
        thruster["race"] += start if thruster["race"] >= 0 else 0
    return {
        "hulls": [row],
        "stations": [dict(station) for station in fit.stations],
        "thrusters": thrusters,
        "sensors": [{"boat": boat.name, **sensor} for sensor in sensors],
    }


def renamed(tree: object, prefix: str) -> Any:
    """A copy of rows in which names get their prefix."""
    if isinstance(tree, str):
        return tree.replace(PREFIX, prefix)
    if isinstance(tree, dict):
        return {key: renamed(value, prefix) for key, value in tree.items()}
    return [renamed(value, prefix) for value in tree] if isinstance(tree, list | tuple) else tree
