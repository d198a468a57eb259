"""Reading a fleet for a world: clashing names, a full square, bearings, a fleet far from everything."""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from statistics import fmean

from vrx_mj.config.base import Fault
from vrx_mj.config.fleet import BoatConfig, FleetConfig, FleetPosition, Slot, room_faults
from vrx_mj.config.layouts import Headings
from vrx_mj.config.loading import Loading, Source, document, problem_at, validate
from vrx_mj.config.objects import Placement
from vrx_mj.config.search import catalogue
from vrx_mj.config.world import FULL_TURN, WorldConfig, warn_of_degrees
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, VrxWarning

_OUTWARD = math.radians(5.0)
"""How near a heading is to outward that was meant so [rad]."""
_FAR = 300.0
"""Distance [m] from everything in a world beyond which a fleet is probably misplaced."""


def load_fleet(source: Source | None, world: WorldConfig) -> FleetConfig:
    """The fleet of a name, a path or a dict, checked in a world; None: one boat at the world's spawn pose."""
    section, stem = document(
        "fleets", {} if source is None else source, "fleet" if isinstance(source, Mapping) and source else "single"
    )
    fleet = validate(FleetConfig, section, Loading(), name=stem)
    fleet._section = section
    boats = fleet.boats_in(world)
    layouts = (((*slot.own, "thrusters"), text) for boat, slot in boats if (text := boat.layout_fault))
    found = [*_name_faults(boats, world), *layouts, *room_faults(fleet, world.seed)]
    problems = [*(problem_at(section, loc, str(message)) for loc, message in found), *_wind_problems(world, boats)]
    if problems:
        raise ConfigError(dict.fromkeys(problems))
    if not fleet.is_empty:
        if fleet.headings is None:
            _warn_of_bearings(fleet)
            _warn_of_radians(fleet)
        warn_of_degrees(f"fleet {fleet.name}", _angles(fleet))
    return fleet


def _name_faults(boats: Sequence[tuple[BoatConfig, Slot]], world: WorldConfig) -> Iterator[Fault]:
    taken = {thing.name: f"an object of world {world.name}" for thing in world.placements}
    for boat, slot in boats:
        if boat.name in taken:
            loc = (*slot.own, "name") if slot.own else slot.where
            yield loc, f"duplicate name '{boat.name}': it is the name of {taken[boat.name]}"
        taken[boat.name] = "another boat"


def _wind_problems(world: WorldConfig, boats: Sequence[tuple[BoatConfig, Slot]]) -> Iterator[Problem]:
    """Wind on things that are no boats, docks, objects of the world, nor kinds of such."""
    listed = (world.wind.objects if world.wind else None) or ()
    if not listed:
        return
    known = {name for boat, _ in boats for name in (boat.name, boat.robot)} | set(catalogue("robots"))
    known |= {*_names(world.objects, ""), *(dock.name for dock in world.docks)}
    for index, thing in enumerate(listed):
        if thing.model not in known:
            error = UnknownNameError("boat, object, dock or robot", thing.model, sorted(known))
            yield problem_at(world.section, ("wind", "objects", index, "model"), str(error))


def _names(placements: Sequence[Placement], prefix: str) -> Iterator[str]:
    for thing in placements:
        yield from (prefix + thing.name, thing.model)
        yield from _names(thing.config.objects, f"{prefix}{thing.name}/")


def far_from_all(fleet: FleetConfig, boats: Sequence[tuple[BoatConfig, Slot]], world: WorldConfig) -> str:
    """How far a fleet is from everything in a world, if that is suspicious; else empty."""
    if not boats or fleet.is_empty:
        return ""
    places = [("the spawn pose", world.spawn.pose), *((f"'{thing.name}'", thing.pose) for thing in world.placements)]
    distance, nearest = min((math.dist(boat.pose[:2], pose[:2]), name) for boat, _ in boats for name, pose in places)
    if distance <= _FAR:
        return ""
    text = f"fleet {fleet.name}: {distance:.0f} m from {nearest}, the nearest thing in world {world.name}"
    return f"{text}; more than {_FAR:.0f} m"


def _warn_of_bearings(fleet: FleetConfig) -> None:
    """Positions whose headings point away from their middle, all of them, if they are bearings, and only then."""
    places = fleet.positions
    if len(places) > 1 and _all_outward(places, "compass") and not _all_outward(places, "math"):
        text = f"fleet {fleet.name}: its headings point outward only as compass bearings, and are read as degrees"
        advice = "write `headings: compass` for bearings, or `headings: math` to keep this"
        warnings.warn(f"{text} counter-clockwise from x; {advice}", VrxWarning, stacklevel=3)


def _warn_of_radians(fleet: FleetConfig) -> None:
    """Headings in degrees that are all within a full turn in radians, the unit of poses."""
    places = [(f"positions[{i}].Y", position.Y) for i, position in enumerate(fleet.positions)]
    own = [(key, getattr(fleet, key)) for key in ("heading", "start_angle")]
    said = [(key, angle) for key, angle in (*places, *own) if isinstance(angle, float | int) and angle]
    if said and all(abs(angle) < FULL_TURN for _, angle in said):
        key, angle = said[0]
        text = f"fleet {fleet.name}: {key} {angle:g} is read as degrees, unlike the radians of poses"
        advice = f"write {math.degrees(angle):.6g} for {angle:g} rad, or `headings: math` to keep this"
        warnings.warn(f"{text}; {advice}", VrxWarning, stacklevel=3)


def _all_outward(positions: Sequence[FleetPosition], headings: Headings) -> bool:
    x0, y0 = fmean(position.x for position in positions), fmean(position.y for position in positions)
    poses = (position.pose_in(headings) for position in positions)
    turns = (math.remainder(yaw - math.atan2(y - y0, x - x0), 2 * math.pi) for x, y, *_, yaw in poses)
    return all(abs(turn) <= _OUTWARD for turn in turns)


def _angles(fleet: FleetConfig) -> list[tuple[str, Sequence[float]]]:
    origin = [("origin", fleet.origin[2:])] if isinstance(fleet.origin, tuple) else []
    return [*origin, *((entry.name or "boats", entry.pose[3:]) for entry in fleet.boats if entry.pose)]
