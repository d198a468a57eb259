"""A world with one boat more, or one less: pieces and rows are added or dropped, and the rest is not compiled again.

A boat that joins comes last, in the MJCF and in every table, with the ball of its shooter after it. So the others keep
their order, and MuJoCo gives them the same numbers.
"""

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from vrx_mj.arguments import check_name
from vrx_mj.config.fleet import BoatConfig, joining_boat
from vrx_mj.config.wording import ros_names_note
from vrx_mj.config.world import PhysicsConfig, SpawnConfig, WindConfig
from vrx_mj.errors import CommandError, CompileError, UnknownNameError, VrxWarning
from vrx_mj.mjcf.afloat import depth_in_land
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.fitting import Fitted, boat_rows, fitted
from vrx_mj.mjcf.objects import object_piece, object_rows
from vrx_mj.mjcf.parameters import Rows
from vrx_mj.mjcf.pieces import Part
from vrx_mj.mjcf.scored import Touch, touch_sensor
from vrx_mj.mjcf.shooters import ball_name, ball_names, spare_ball
from vrx_mj.mjcf.wind import warn_if_unpushed
from vrx_mj.mjcf.world import World, joined_world
from vrx_mj.model.afloat import Block, Float
from vrx_mj.model.world import Parameters, checked_rows, tree_of

__all__ = ["with_boat", "without_boat"]

AnyRow = TypeVar("AnyRow")
Wet = TypeVar("Wet", Float, Block)


def with_boat(world: World, said: Mapping[str, object], folder: Path | None = None) -> World:
    """The world with another boat; `said` is an entry of a fleet's `boats`, its pose in world axes [m, rad].

    Paths in it start in `folder`, by default the current one.

    A name that was there before begins its next life: `life` of its entry counts them.

    Raises:
        ConfigError: what is said of the boat is wrong.
        CommandError: something has the name already, or the boat would stand on land.
        CompileError: the boat cannot be built.
    """
    spawn = {key: getattr(world.parameters.spawn, key) for key in ("robot", "thrusters", "sensors")}
    own = {key: value for key, value in spawn.items() if value is not None}
    boat = joining_boat(said, SpawnConfig.model_validate(own), folder)
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
    balls = {ball_name(name, sensor.name) for sensor in old.sensors if sensor.boat == name}
    balls &= ball_names(old)
    return joined_world(world.pieces.without({name, *balls}), _rows_without(world, name, balls))


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


def _rows_without(world: World, name: str, balls: AbstractSet[str]) -> Parameters:
    """The parameters of a world without a boat and its balls."""
    old, index = world.parameters, world.boats.index(name)
    hull = old.hulls[index]
    stations, thrusters = (hull.station_start, hull.station_count), (hull.thruster_start, hull.thruster_count)
    floating = [item.name for item in old.objects if item.kind == "floating"]
    lost = [row for item, row in zip(floating, old.floats, strict=True) if item in balls]
    spans = [(row.element_start, row.element_count) for row in lost]
    kept = (row for row in old.hulls if row is not hull)
    return replace(
        old,
        boats=tuple(row for row in old.boats if row.name != name),
        sensors=tuple(row for row in old.sensors if row.boat != name),
        objects=tuple(row for row in old.objects if row.name not in balls),
        stations=_without(old.stations, [stations]),
        elements=_without(old.elements, spans),
        lives={**old.lives, name: old.boats[index].life + 1},
        hulls=tuple(
            replace(
                row,
                station_start=_down(row.station_start, *stations),
                thruster_start=_down(row.thruster_start, *thrusters),
            )
            for row in kept
        ),
        thrusters=tuple(
            replace(row, hull=row.hull - (row.hull > index), race=_down(row.race, *thrusters))
            for row in _without(old.thrusters, [thrusters])
        ),
        floats=tuple(_shifted(row, spans) for row in old.floats if row not in lost),
        blocks=tuple(_shifted(row, spans) for row in old.blocks),
        task=old.task and replace(old.task, rivals=tuple(rival for rival in old.task.rivals if rival != name)),
    )


def _without(rows: Sequence[AnyRow], spans: Iterable[tuple[int, int]]) -> tuple[AnyRow, ...]:
    """The rows but for those of spans, each a start and a count."""
    gone = {row for start, count in spans for row in range(start, start + count)}
    return tuple(row for number, row in enumerate(rows) if number not in gone)


def _shifted(row: Wet, spans: Sequence[tuple[int, int]]) -> Wet:
    """A row whose elements begin earlier by as many as are gone before them."""
    start = row.element_start
    for span in reversed(spans):
        start = _down(start, *span)
    return replace(row, element_start=start)


def _down(number: int, start: int, count: int) -> int:
    return number - count if number >= start + count else number
