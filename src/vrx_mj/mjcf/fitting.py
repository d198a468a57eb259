"""A boat as a piece of a world and as rows of the runtime's tables, made once for each kind."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, TypeVar

from vrx_mj.arrays import FloatArray
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.profiles import CLASSIC
from vrx_mj.config.world import PhysicsConfig, WindConfig
from vrx_mj.constants import HULL_GRAVITY
from vrx_mj.mjcf.afloat import outline
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.masses import Engines
from vrx_mj.mjcf.parameters import PROFILES, Rows
from vrx_mj.mjcf.pieces import PREFIX, Piece
from vrx_mj.mjcf.robots import Color, hull_row, robot_piece, sensor_rows, station_rows, thruster_rows
from vrx_mj.mjcf.wind import boat_wind
from vrx_mj.model.boats import Boat as Entry
from vrx_mj.model.boats import Hull, Sensor, Station, Thruster

__all__ = ["Fitted", "boat_rows", "fitted"]

Named = TypeVar("Named", Hull, Thruster, Sensor)

SAME = tuple(own.name for own in fields(Entry) if own.name in BoatConfig.model_fields)
"""Fields of a boat that a fleet gives and a compiled world has as they are."""
KEPT = 32
"""Kinds of boats that are kept: making one takes 0.1 s."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """What all boats of a kind have in common; names start with `PREFIX`."""

    boat: Boat
    piece: Piece
    hull: Hull
    stations: Sequence[Station]
    thrusters: Sequence[Thruster]
    sensors: Sequence[Sensor]

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
    fit: Fitted, boat: BoatConfig, tables: Rows, wind: WindConfig | None, physics: PhysicsConfig, life: int = 0
) -> Rows:
    """The rows that a boat adds at the ends of a world's tables; `life` is the number of boats of its name before."""
    hull, start = len(tables.hulls), len(tables.thrusters)
    row = replace(
        _named(fit.hull, boat.name),
        wind=boat_wind(wind, physics, boat.name, boat.robot, own=fit.boat.wind),
        profile=PROFILES[physics.profile],
        # VRX 3's water weighs what the world's gravity makes it weigh
        gravity=HULL_GRAVITY if physics.profile == CLASSIC else physics.gravity,
        station_start=len(tables.stations),
        station_count=len(fit.stations),
        thruster_start=start,
    )
    return Rows(
        hulls=[row],
        stations=[*fit.stations],
        thrusters=[
            replace(_named(item, boat.name), hull=hull, race=item.race + start if item.race >= 0 else -1)
            for item in fit.thrusters
        ],
        sensors=[replace(_named(sensor, boat.name), boat=boat.name) for sensor in fit.sensors],
        boats=[Entry(life=life, **{key: getattr(boat, key) for key in SAME})],
    )


def _named(row: Named, boat: str) -> Named:
    """A row in which names begin with the boat's."""
    texts = ((key, value) for key, value in vars(row).items() if isinstance(value, str))
    named: dict[str, Any] = {key: value.replace(PREFIX, f"{boat}/") for key, value in texts}
    return replace(row, **named)
