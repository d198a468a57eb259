"""A world with one boat, object or dock more, or one less: the rest is not compiled again.

What joins comes last, in the MJCF and in every table, a boat with the ball of its shooter after it. So the others keep
their order, and MuJoCo gives them the same numbers.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import compress
from typing import Any

import numpy as np
from pydantic import ValidationError

from vrx_mj.arguments import as_text, check_name
from vrx_mj.arrays import BoolArray
from vrx_mj.config.docks import DockPlacement
from vrx_mj.config.fleet import BoatConfig, joining_boat
from vrx_mj.config.loading import fault_text, joining
from vrx_mj.config.objects import MOST_OBJECTS, Placement
from vrx_mj.config.weather import WindConfig
from vrx_mj.config.wording import ros_names_note
from vrx_mj.config.world import PhysicsConfig, SpawnConfig
from vrx_mj.errors import CommandError, CompileError, UnknownNameError, VrxWarning
from vrx_mj.mjcf import boats
from vrx_mj.mjcf.afloat import depth_in_land, outline
from vrx_mj.mjcf.assembly import Assembly
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.docks import docks_overlap
from vrx_mj.mjcf.hulls import warn_if_uncovered
from vrx_mj.mjcf.objects import PlacedDock, PlacedObject, place_docks, place_objects, spare_ball
from vrx_mj.mjcf.parameters import Rows
from vrx_mj.mjcf.pieces import owner_of
from vrx_mj.mjcf.tasks import Touch, thing_touches, touch_sensor
from vrx_mj.mjcf.templates import render
from vrx_mj.mjcf.wind import own_load, warn_if_unpushed
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Boat
from vrx_mj.model.tasks import names_in
from vrx_mj.model.things import Dock, Object
from vrx_mj.model.world import Parameters, checked_rows, linked_rows, row_columns, tree_of

_OWNED = {
    "boats": "name", "hulls": "body", "sensors": "boat", "objects": "name", "floats": "body", "links": "body",
    "docks": "name", "blocks": "body", "lights": "name", "placards": "name",
}  # fmt: skip
"""Tables whose rows belong to a boat, an object or a dock, and the name that begins with that of their owner."""
_LINES = ("moorings", "ropes")
"""Tables of lines, whose rows go with what they hold."""
_RESERVED = ("terrain", "carrier", "world")
"""Names of parts of every world."""


def with_boat(world: World, entry: Mapping[str, object]) -> World:
    """The world with another boat; `entry` is one of a fleet's `boats`, its pose in world axes [m, rad].

    A name that was there before begins its next life: `life` of its entry counts them.

    Raises:
        ConfigError: the entry is wrong.
        CommandError: something has the name already, or the boat would be on land.
        CompileError: the boat cannot be built.
    """
    spawn = {key: getattr(world.parameters.spawn, key) for key in ("robot", "arguments", "thrusters", "sensors")}
    own = {key: value for key, value in spawn.items() if value is not None}
    boat = joining_boat(entry, SpawnConfig.model_validate(own))
    _check_name(world, boat.name, "boat")
    for note in ros_names_note("boat", [boat.name]):
        warnings.warn(note, VrxWarning, stacklevel=3)
    old = world.parameters
    robot = _build(boat, old.profile)
    if old.shoreline and (depth := depth_in_land(outline(robot), boat.pose, old.shoreline)):
        x, y, *_ = boat.pose
        shore = f"{depth:.2f} m inside the shore of {old.terrain}"
        raise CommandError(f"no place for {boat.name} at ({x:g}, {y:g}): it would be on land, {shore}")
    joined = _assembly(old)
    hull = joined.add_boat(robot, boat, old.lives.get(boat.name, 0))
    warn_if_uncovered(robot.name, hull.vessel, old.sea)
    warn_if_unpushed(old.name, joined.wind, joined.physics, [(boat, own_load(robot, joined.physics))])
    for owner, shooter in joined.rows.shooters:
        if owner == boat.name:
            taken = {item.pose[:3] for item in joined.rows.objects}
            joined.add_object(spare_ball(owner, shooter, taken), asleep=True)
    return _join(world, joined, [Touch(boat.name, hull.body)], asleep=len(joined.parts) > 1)


def with_object(world: World, entry: Mapping[str, object]) -> World:
    """The world with another object; `entry` is one of a world file's `objects`, its pose in world axes [m, rad].

    An object that is made of others joins with all of them.

    Raises:
        ConfigError: the entry is wrong.
        CommandError: something has the name already, there are too many objects, or a dock of it lies on another.
    """
    placement = joining(Placement, "object", entry)
    return _with_things(world, placement.name, list(place_objects([placement])), list(place_docks([], [placement])))


def with_dock(world: World, entry: Mapping[str, object]) -> World:
    """The world with another dock; `entry` is one of a world file's `docks`; errors are those of `with_object`."""
    placement = joining(DockPlacement, "dock", entry)
    return _with_things(world, placement.name, [], list(place_docks([placement], [])))


def _with_things(world: World, name: str, objects: Sequence[PlacedObject], docks: Sequence[PlacedDock]) -> World:
    _check_name(world, name, "dock" if docks and not objects else "object")
    old = world.parameters
    if len(old.objects) + len(objects) > MOST_OBJECTS:
        raise CommandError(f"no room for {name}: a world has at most {MOST_OBJECTS} objects")
    for dock in docks:
        other = next((other for other in old.docks if docks_overlap(other, dock)), None)
        if other is not None:
            raise CommandError(f"no place for {dock.name}: it would be on the dock '{other.name}'")
    joined = _assembly(old)
    for dock in docks:
        joined.add_dock(dock)
    for item in objects:
        joined.add_object(item)
    return _join(world, joined, list(thing_touches(objects, docks)))


def _join(world: World, joined: Assembly, touches: Sequence[Touch], *, asleep: bool = False) -> World:
    """The world with what joined after all others; `touches` are those that a task's boat may have with it."""
    old = world.parameters
    try:
        checked = checked_rows({table: own[len(getattr(old, table)) :] for table, own in joined.rows.tables.items()})
    except ValidationError as error:
        raise CompileError(f"invalid {joined.parts[0].name}: {fault_text(error)}") from None
    new: dict[str, Any] = {table: (*getattr(old, table), *own) for table, own in checked.items()}
    sensors = ""
    if task := old.task:
        new["task"] = replace(task, rivals=(*task.rivals, *(touch.name for touch in touches)))
        scored = old.hulls[world.boats.index(task.boat)].body
        sensors = "".join(touch_sensor(touch, scored) for touch in touches)
    option = render("option.xml.j2", asleep=True, timestep=old.timestep, gravity=old.gravity) if asleep else ""
    return World(world.pieces.with_parts(joined.parts, option=option, touches=sensors), replace(old, **new))


def _things(world: Parameters) -> tuple[str, ...]:
    """Names of all that `without` takes: boats, objects and docks, without their parts."""
    named: tuple[Boat | Object | Dock, ...] = (*world.boats, *world.objects, *world.docks)
    return tuple(dict.fromkeys(owner_of(item.name) for item in named))


def without(world: World, name: str) -> World:
    """The world without a boat, an object or a dock; an object goes with all that it is made of.

    Raises:
        UnknownNameError: nothing has that name.
        CommandError: the task needs it, it is a part of another object, or the name is not text.
    """
    old = world.parameters
    parts = {item.name for item in old.objects} | {dock.name for dock in old.docks}
    if as_text("name", name) in parts - {*_things(old)}:
        raise CommandError(
            f"{name} cannot be removed: it is a part of {owner_of(name)}, which can only be removed as a whole"
        )
    check_name("boat, object or dock", name, _things(old))
    if old.task and old.task.boat == name:
        raise CommandError(f"{name} cannot be removed: it is the boat that the task '{old.task.name}' scores")
    if old.task and name in (owner_of(thing) for *_, thing in names_in(old.task)):
        raise CommandError(f"{name} cannot be removed: the task '{old.task.name}' needs it")
    stay = staying(old, name)
    new: dict[str, Any] = _remaining_rows(old, stay)
    if task := old.task:
        fixed = {thing: pose for thing, pose in task.fixed.items() if owner_of(thing) != name}
        new["task"] = replace(task, rivals=tuple(compress(task.rivals, stay["rivals"])), fixed=fixed)
    if name in world.boats:
        new["lives"] = {**old.lives, name: old.boats[world.boats.index(name)].life + 1}
    return World(world.pieces.without(name), replace(old, **new))


def _check_name(world: World, name: str, kind: str) -> None:
    taken = {owner_of(dock.name): "a dock" for dock in world.parameters.docks}
    taken |= {owner_of(item.name): "an object" for item in world.parameters.objects}
    taken |= dict.fromkeys(world.boats, "a boat")
    taken |= dict.fromkeys(_RESERVED, "a part")
    if name in taken:
        raise CommandError(f"invalid {kind} name '{name}': {taken[name]} of world {world.name} has this name")


def _assembly(world: Parameters) -> Assembly:
    """A world's rows, with the wind and the physics as what joins later meets them."""
    blowing = {"mean_velocity": abs(world.wind.mean), "var_gain": world.wind.gain}
    physics = {"profile": world.profile, "gravity": world.gravity, "quirks": world.spawn.quirks}
    wind = WindConfig.model_validate({"objects": tree_of(world.spawn.wind), **blowing})
    return Assembly(wind, PhysicsConfig.model_validate(physics), world.sea, Rows.of(world))


def _build(boat: BoatConfig, profile: str) -> boats.Boat:
    try:
        return build_boat(replace(boat.order, profile=profile))
    except UnknownNameError as error:
        raise CompileError(f"boat {boat.name}: {error}") from error


def staying(world: Parameters, left: str) -> dict[str, BoolArray]:
    """Which rows of each table stay when a boat, an object or a dock leaves with all that is its own."""
    owners = {
        table: [owner_of(getattr(row, _OWNED[table])) if table in _OWNED else "" for row in rows]
        for table, rows in Rows.of(world).tables.items()
    }
    for table, number, _, mark, rows in linked_rows(world):
        if mark.owned:
            owners[mark.table][rows.start : rows.stop] = [owners[table][number]] * len(rows)
        elif table in _LINES:
            owners[table][number] = owners[mark.table][rows.start]
    owners["rivals"] = [owner_of(rival) for rival in (world.task.rivals if world.task else ())]
    return {table: np.array([name != left for name in names], np.bool_) for table, names in owners.items()}


def _remaining_rows(world: Parameters, stay: Mapping[str, BoolArray]) -> dict[str, Any]:
    """The rows that stay, by table, with the new numbers of the rows that they refer to."""
    numbers = {table: [0, *np.cumsum(kept).tolist()] for table, kept in stay.items()}
    tables = {table: tuple(compress(getattr(world, table), kept)) for table, kept in stay.items() if table != "rivals"}
    for table, columns in row_columns().items():
        rows = []
        for row in tables[table]:
            old = {column: (mark.table, getattr(row, column)) for column, mark in columns.items()}
            rows.append(replace(row, **{column: numbers[to][at] for column, (to, at) in old.items() if at >= 0}))
        tables[table] = tuple(rows)
    return tables
