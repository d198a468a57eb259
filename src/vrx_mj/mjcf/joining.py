"""A world with one boat more, or one less: pieces and rows are added or dropped, and the rest is not compiled again.

A boat that joins comes last, in the MJCF and in every table, with the ball of its shooter after it. So the others keep
their order, and MuJoCo gives them the same numbers.
"""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from vrx_mj.arguments import check_name
from vrx_mj.arrays import BoolArray
from vrx_mj.config.fleet import BoatConfig, joining_boat
from vrx_mj.config.wording import ros_names_note
from vrx_mj.config.world import PhysicsConfig, SpawnConfig, WindConfig
from vrx_mj.errors import CommandError, CompileError, UnknownNameError, VrxWarning
from vrx_mj.mjcf.afloat import depth_in_land
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.objects import object_piece, object_rows, spare_ball
from vrx_mj.mjcf.parameters import Rows
from vrx_mj.mjcf.pieces import Part
from vrx_mj.mjcf.robots import Fitted, boat_rows, fitted
from vrx_mj.mjcf.tasks import Touch, touch_sensor
from vrx_mj.mjcf.wind import warn_if_unpushed
from vrx_mj.mjcf.world import World, joined_world
from vrx_mj.model.afloat import Float
from vrx_mj.model.boats import Hull
from vrx_mj.model.world import Parameters, checked_rows, tree_of

__all__ = ["staying", "with_boat", "without_boat"]

OWNED = {
    "boats": "name", "hulls": "body", "sensors": "boat", "objects": "name", "floats": "body",
}  # fmt: skip
"""Tables whose rows belong to a boat, or to nobody, and the name that begins with that of the boat."""
REFERENCES = {
    "hulls": {"station_start": "stations", "thruster_start": "thrusters"},
    "thrusters": {"hull": "hulls", "race": "thrusters"},
    "floats": {"element_start": "elements"},
    "blocks": {"element_start": "elements"},
}
"""By table the columns that are numbers of rows, and the tables of those; a number below 0 refers to none."""


def with_boat(world: World, entry: Mapping[str, object], folder: Path | None = None) -> World:
    """The world with another boat; `entry` is one of a fleet's `boats`, its pose in world axes [m, rad].

    Paths in it start in `folder`, by default the current one.

    A name that was there before begins its next life: `life` of its entry counts them.

    Raises:
        ConfigError: the entry is wrong.
        CommandError: something has the name already, or the boat would be on land.
        CompileError: the boat cannot be built.
    """
    spawn = {key: getattr(world.parameters.spawn, key) for key in ("robot", "thrusters", "sensors")}
    own = {key: value for key, value in spawn.items() if value is not None}
    boat = joining_boat(entry, SpawnConfig.model_validate(own), folder)
    _check_name(world, boat.name)
    for note in ros_names_note("boat", [boat.name]):
        warnings.warn(note, VrxWarning, stacklevel=3)
    old = world.parameters
    fit = fitted(_built(boat, old.profile), boat.engines, boat.color)
    _check_shore(old, boat, fit)
    wind, physics = _conditions(old)
    rows = boat_rows(fit, boat, Rows.of(old), wind, physics, old.lives.get(boat.name, 0))
    warn_if_unpushed(old.name, wind, physics, [(boat, fit.boat.wind)])
    balls = list(_with_balls(old, rows, wind, physics))
    pieces = world.pieces.with_parts([Part.placed(boat.name, fit.piece, boat.pose), *balls], asleep=bool(balls))
    new: dict[str, Any] = {table: (*getattr(old, table), *own) for table, own in checked_rows(rows.tables).items()}
    if task := old.task:
        new["task"] = replace(task, rivals=(*task.rivals, boat.name))
        scored = old.hulls[world.boats.index(task.boat)].body
        sensor = touch_sensor(Touch(boat.name, rows.hulls[0].body), scored)
        pieces = replace(pieces, touches={**pieces.touches, boat.name: sensor})
    return joined_world(pieces, replace(old, **new))


def without_boat(world: World, name: str) -> World:
    """The world without a boat.

    Raises:
        UnknownNameError: no boat has that name.
        CommandError: it is the boat that the world's task scores.
    """
    check_name("boat", name, world.boats)
    old = world.parameters
    if old.task and old.task.boat == name:
        raise CommandError(f"{name} cannot be removed: it is the boat that the task '{old.task.name}' scores")
    stay = staying(old, name)
    task = old.task and replace(old.task, rivals=tuple(compress(old.task.rivals, stay["rivals"])))
    lives = {**old.lives, name: old.boats[world.boats.index(name)].life + 1}
    return joined_world(world.pieces.without(name), replace(old, **_kept(old, stay), task=task, lives=lives))


def _check_name(world: World, name: str) -> None:
    taken = {dock.name: "a dock" for dock in world.parameters.docks}
    taken |= {item.name.partition("/")[0]: "an object" for item in world.parameters.objects}
    taken |= dict.fromkeys(world.boats, "a boat")
    taken |= dict.fromkeys(("terrain", "carrier"), "a part")
    if name in taken:
        raise CommandError(f"invalid boat name '{name}': {taken[name]} of world {world.name} has this name")


def _with_balls(old: Parameters, rows: Rows, wind: WindConfig, physics: PhysicsConfig) -> Iterator[Part]:
    """The parts of a boat's balls, one for each ball shooter; their rows are added to those of the boat."""
    for boat, shooter in rows.shooters:
        tables = Rows.of(old)
        tables.add(rows)
        ball = spare_ball(boat, shooter, {item.pose[:3] for item in tables.objects})
        rows.add(object_rows(ball, wind, physics, tables))
        yield Part.placed(ball.name, object_piece(ball.config, asleep=True), ball.pose)


def _conditions(world: Parameters) -> tuple[WindConfig, PhysicsConfig]:
    """The wind and the physics of a world, as boats that join later meet them."""
    blowing = {"mean_velocity": abs(world.wind.mean), "var_gain": world.wind.gain}
    physics = {"profile": world.profile, "gravity": world.gravity, "quirks": world.spawn.quirks}
    wind = WindConfig.model_validate({"objects": tree_of(world.spawn.wind), **blowing})
    return wind, PhysicsConfig.model_validate(physics)


def _check_shore(world: Parameters, boat: BoatConfig, fit: Fitted) -> None:
    if world.shoreline and (depth := depth_in_land(fit.outline, boat.pose, world.shoreline)):
        x, y, *_ = boat.pose
        shore = f"{depth:.2f} m inside the shore of {world.terrain}"
        raise CommandError(f"no place for {boat.name} at ({x:g}, {y:g}): it would be on land, {shore}")


def _built(boat: BoatConfig, profile: str) -> Boat:
    try:
        return build_boat(replace(boat.order, profile=profile))
    except UnknownNameError as error:
        raise CompileError(f"boat {boat.name}: {error}") from error


def staying(world: Parameters, left: str) -> dict[str, BoolArray]:
    """Which rows of each table stay when a boat leaves with its balls, whose names start with its own."""
    stay = {
        table: np.array([getattr(row, name).partition("/")[0] != left for row in getattr(world, table)], np.bool_)
        for table, name in OWNED.items()
    }
    stay["thrusters"] = _parts_staying(world.hulls, "thruster", stay["hulls"], len(world.thrusters))
    stay["stations"] = _parts_staying(world.hulls, "station", stay["hulls"], len(world.stations))
    stay["elements"] = _parts_staying(world.floats, "element", stay["floats"], len(world.elements))
    stay["rivals"] = np.array([rival != left for rival in (world.task.rivals if world.task else ())], np.bool_)
    return stay


def _parts_staying(rows: Sequence[Hull | Float], part: str, stay: BoolArray, count: int) -> BoolArray:
    """Which rows of a table stay: all but those that rows of another one have who leave."""
    kept = np.ones(count, np.bool_)
    for row in compress(rows, ~stay):
        start = getattr(row, f"{part}_start")
        kept[start : start + getattr(row, f"{part}_count")] = False
    return kept


def _kept(world: Parameters, stay: Mapping[str, BoolArray]) -> dict[str, Any]:
    """The rows that stay, by table, with the new numbers of the rows that they refer to."""
    numbers = {table: [0, *np.cumsum(kept).tolist()] for table, kept in stay.items()}
    tables = {table: tuple(compress(getattr(world, table), kept)) for table, kept in stay.items() if table != "rivals"}
    for table, targets in REFERENCES.items():
        tables[table] = tuple(
            replace(row, **{key: numbers[to][at] for key, to in targets.items() if (at := getattr(row, key)) >= 0})
            for row in tables.get(table, getattr(world, table))
        )
    return tables
