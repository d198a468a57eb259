"""From a world and a fleet to a `World`, and worlds with one boat, object or dock more or less.

Pieces are rendered once for each kind and placed under their names. What joins a compiled world comes last, in the
MJCF and in every table, a boat with the ball of its shooter after it. So the others keep their order and their numbers
in MuJoCo, and are not compiled again.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from vrx_mj.arguments import as_flag, as_seed, as_text, check_kind, check_name
from vrx_mj.arrays import BoolArray
from vrx_mj.config.docks import DockPlacement
from vrx_mj.config.fleet import BoatConfig, FleetConfig, Order, joining_boat, load_fleet
from vrx_mj.config.kinds import opener
from vrx_mj.config.loading import fault_text, joining, problem_at
from vrx_mj.config.objects import MOST_OBJECTS, Placement
from vrx_mj.config.tree import ros_names_note
from vrx_mj.config.weather import WindConfig
from vrx_mj.config.world import PhysicsConfig, SpawnConfig, WorldConfig, load_world
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import CommandError, CompileError, ConfigError, Problem, UnknownNameError, first_names, warn
from vrx_mj.foreign import budget
from vrx_mj.frames import IDENTITY
from vrx_mj.mjcf import boats
from vrx_mj.mjcf.afloat import boats_afloat, depth_in_land, outline
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.docks import check_docks, dock_piece, dock_rows, docks_overlap
from vrx_mj.mjcf.hulls import warn_if_rough, warn_if_uncovered
from vrx_mj.mjcf.objects import (
    PlacedDock,
    PlacedObject,
    object_piece,
    object_rows,
    parked_balls,
    place_docks,
    place_fields,
    place_objects,
    spare_ball,
)
from vrx_mj.mjcf.parameters import (
    Rows,
    air_parameters,
    current_parameters,
    newcomer_wind,
    own_load,
    sea_parameters,
    warn_if_unmoved,
    warn_if_unpushed,
    wind_parameters,
)
from vrx_mj.mjcf.pieces import Part, Piece, Pieces, owner_of
from vrx_mj.mjcf.robots import boat_kind, boat_rows, drag_share, reweighed_piece
from vrx_mj.mjcf.scene import marker_rows, scene_parameters, scene_values
from vrx_mj.mjcf.tasks import Touch, task_parameters, thing_touches, touch_sensor, touches_of
from vrx_mj.mjcf.templates import render
from vrx_mj.mjcf.terrain import shoreline, terrain_piece
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Boat, Hull, Spawn
from vrx_mj.model.kinds import record_from
from vrx_mj.model.numbers import with_numbers
from vrx_mj.model.tasks import Goal, Task, names_in, parts_of
from vrx_mj.model.things import Dock, Georeference, Object
from vrx_mj.model.water import Sea
from vrx_mj.model.world import FORMAT, Parameters, checked_parameters, checked_rows, linked_rows, row_columns, tree_of
from vrx_mj.signals import delays_exit

_STIFF_DRAG = 2.0
"""Share of a boat's velocity that drag may take in a step."""
_OWNED = {
    "boats": "name", "hulls": "body", "sensors": "boat", "objects": "name", "floats": "body", "links": "body",
    "docks": "name", "blocks": "body", "lights": "name", "placards": "name",
}  # fmt: skip
"""Tables whose rows belong to a boat, an object or a dock, and the name that begins with that of their owner."""
_LINES = ("moorings", "ropes")
"""Tables of lines, whose rows go with what they hold."""
_RESERVED = ("terrain", "carrier", "world")
"""Names of parts of every world."""


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

    def add_boat(self, robot: boats.Boat, boat: BoatConfig, life: int = 0) -> Hull:
        """Add a boat, which `life` boats of its name were before; its hull is returned."""
        kind = boat_kind(robot, boat.engines, boat.color)
        self.parts.append(Part(boat.name, kind.piece, boat.pose))
        self.rows.add(boat_rows(kind, boat, self.rows, self.wind, self.physics, self.sea, life))
        return self.rows.hulls[-1]


Source = str | Path | Mapping[str, Any]


@delays_exit()
def compile_world(
    world: Source,
    *,
    fleet: Source | None = None,
    seed: int | None = None,
    nudge: bool = False,
    arguments: Mapping[str, str] | None = None,
    parameters: Mapping[str, float] | None = None,
) -> World:
    """Compile a world with a fleet to MJCF and parameters.

    Args:
        world: name, path of a YAML file, or the file's contents as a mapping; or the path of a world of Gazebo
            (`.world`, `.world.xacro`, `.sdf`) or of a launch file of ROS 1, of which VRX's own are known by name;
            or a folder with one of these, as a catkin workspace.
        fleet: name, path or mapping, as for the world; by default one boat, `wamv`, at the world's spawn pose, or the
            boats of the launch file. The path of a URDF or xacro is one such boat.
        seed: seed of everything random; by default that of the world.
        nudge: whether boats that would start on land, on a dock or on another boat are moved to the nearest free
            place, each with a warning.
        arguments: arguments of the launch file, or of the xacro of the world.
        parameters: values of numbers of the compiled world by name, as `vrx_mj.parameters` lists them; the saved world
            has them, and boats that join later do not.

    Raises:
        ConfigError: a file is invalid; the error lists every mistake with file, line and key.
        CompileError: MuJoCo cannot compile what the files describe.
        ChoiceError: a folder has several launch files that open a world, or several worlds.
        CommandError: the seed is not a whole number from 0 to 2^63 - 1, another argument is of no such kind, or a
            value of `parameters` is not a number in its range.
        UnknownNameError: the world has no number of a name in `parameters`.
    """
    own = None if seed is None else as_seed(seed)
    given = {} if arguments is None else arguments
    check_kind("arguments", given, Mapping, "a mapping of text, as {'name': 'value'}")
    numbers = {} if parameters is None else parameters
    check_kind("parameters", numbers, Mapping, "a mapping of numbers, as {'wind.mean': 5.0}")
    nudged = as_flag("nudge", nudge)
    with budget():
        if opened := opener(world, given):
            world, fleet = opened(world, fleet, given)
        config = load_world(world)
        making = _Compilation(config, load_fleet(fleet, config), nudge=nudged)
        return making.world(config.seed if own is None else own, numbers)


class _Compilation(Assembly):
    """One world in the making."""

    def __init__(self, config: WorldConfig, fleet: FleetConfig, *, nudge: bool) -> None:
        super().__init__(config.wind, config.physics, sea_parameters(config.sea, config.physics), Rows())
        self.config = config
        self.fleet, self._fleet = fleet.name, fleet
        self.kinds: dict[Order, boats.Boat] = {}
        self.objects = tuple(place_objects(config.objects))
        self.docks = tuple(place_docks(config.docks, config.objects))
        self.boats = boats_afloat(config, fleet, self.docks, self.objects, self._build, nudge=nudge)
        spots = [boat.pose[:2] for boat in self.boats]
        self.objects += tuple(place_fields(config, spots, self.objects, self.docks))
        self.balls: list[PlacedObject] = []
        self.task: Task | None = None
        self.touches: list[Touch] = []

    def world(self, seed: int, numbers: Mapping[str, float]) -> World:
        for note in ros_names_note("boat", (boat.name for boat in self.boats)):
            warn(note, 3)
        check_docks(self.config, self.docks)
        if self.config.terrain:
            land = terrain_piece(self.config.terrain, self.config.folder)
            self.parts.append(Part("terrain", land, IDENTITY))
        for dock in self.docks:
            self.add_dock(dock)
        for item in self.objects:
            self.add_object(item)
        kinds = {(robot := self._build(boat)).name: (robot, self.add_boat(robot, boat)) for boat in self.boats}
        for robot, hull in kinds.values():
            warn_if_uncovered(robot.name, hull.vessel, self.sea)
            warn_if_rough(robot, hull.vessel, self.sea, self.config.physics.timestep)
        self._check_wind()
        self.balls = parked_balls(self.rows.shooters)  # out of the way until they are fired
        for ball in self.balls:
            self.add_object(ball, asleep=True)
        self._add_task()
        parameters = self._with_masses(with_numbers(self._parameters(seed), numbers))
        self.sea = parameters.sea
        pieces = self._pieces()
        try:
            pieces.check()
        except ValueError as error:
            raise CompileError(f"MuJoCo cannot compile the {self._name()}: {error}") from error
        try:
            return World(pieces, checked_parameters(parameters))
        except ValidationError as error:
            raise CompileError(f"invalid {self._name()}: {fault_text(error)}") from None

    def _name(self) -> str:
        """The world with its robots: what is wrong with the whole may be in one of these."""
        robots = first_names(dict.fromkeys(boat.robot for boat in self.boats), 4)
        return f"world {self.config.name}" + (f" with {robots}" if robots else "")

    def _with_masses(self, parameters: Parameters) -> Parameters:
        """The world's parameters, once the pieces of its boats have the masses of their hulls."""
        hulls = {boat.name: (boat, hull) for boat, hull in zip(self.boats, parameters.hulls, strict=True)}
        for index, part in enumerate(self.parts):
            if part.name in hulls:
                boat, hull = hulls[part.name]
                kind = boat_kind(self._build(boat), boat.engines, boat.color)
                self.parts[index] = replace(part, piece=reweighed_piece(kind, boat.engines, boat.color, hull))
        rows = [
            row if row.joint else replace(row, body_com=parameters.hulls[row.hull].body_com)
            for row in parameters.thrusters
        ]
        return replace(parameters, thrusters=tuple(rows))

    def _pieces(self) -> Pieces:
        config = self.config
        sea = {
            key: tree_of(getattr(self.sea, key))
            for key in ("model", "significant_height", "period", "direction", "tau")
        }
        values = {
            "name": config.name,
            "fleet": self.fleet,
            "timestep": config.physics.timestep,
            "gravity": config.physics.gravity,
            "asleep": bool(self.balls),
            "center": [*self.boats[0].pose[:2], 0.0] if self.boats else [0.0, 0.0, 0.0],
            "water": config.sea.model != "none" or config.terrain is not None,
            "level": self.sea.level,
            "sea": json.dumps(sea).replace('"', "'"),
            **scene_values(config),
        }
        scored = self._base_links()[self.task.boat] if self.task else ""
        own = Piece.from_template("world.xml.j2", {}, **values, touches=self.touches, scored=scored)
        return Pieces(own, tuple(self.parts))

    def _add_task(self) -> None:
        """Resolve the task of the world, with what its boat may touch and what holds the boat."""
        if self.config.task is not None and not self.boats:
            text = "its task is left out: it needs a boat at the start, and the fleet has none"
            warn(f"world {self.config.name}: {text}", 4)
            return
        self.task = task_parameters(self.config, self.boats, self.objects, self.docks, self.rows.shooters)
        if self.task is None:
            return
        links, terrain = self._base_links(), self.config.terrain is not None
        self.touches = touches_of(self.task.boat, links, self.objects, self.docks, terrain=terrain)
        if self.task.locked:
            boat = next(boat for boat in self.boats if boat.name == self.task.boat)
            carrier = Piece.from_template("lock.xml.j2", {}, boat=boat.name, body=links[boat.name], pose=boat.pose)
            self.parts.append(Part("carrier", carrier))
        self.task = replace(self.task, rivals=tuple(touch.name for touch in self.touches))

    def _base_links(self) -> dict[str, str]:
        """Bodies of the boats' base links, by the boats' names."""
        return {boat.name: hull.body for boat, hull in zip(self.boats, self.rows.hulls, strict=True)}

    def _build(self, boat: BoatConfig) -> boats.Boat:
        """The boat of a fleet's entry; those of one order are built once."""
        if boat.order not in self.kinds:
            try:
                self.kinds[boat.order] = build_boat(replace(boat.order, profile=self.config.physics.profile))
            except UnknownNameError as error:
                raise ConfigError([self._problem(boat, error)]) from error
            _warn_if_stiff(self.kinds[boat.order], self.config.physics.timestep)
        return self.kinds[boat.order]

    def _check_wind(self) -> None:
        config = self.config
        warn_if_unpushed(
            config.name,
            config.wind,
            config.physics,
            [(boat, own_load(self._build(boat), config.physics)) for boat in self.boats],
        )
        names = {name for boat in self.boats for name in (boat.name, boat.robot)}
        names |= {name for item in self.objects if item.config.kind == "floating" for name in (item.name, item.model)}
        names |= {name for dock in self.docks if dock.config.dynamic for name in (dock.name, dock.parent)}
        warn_if_unmoved(config.name, config.wind, names)

    def _problem(self, boat: BoatConfig, error: UnknownNameError) -> Problem:
        """A fault of a boat, at the place that orders it: in the fleet's file, or the world's without one."""
        if self._fleet.is_empty and not self._fleet.section:
            return problem_at(self.config.section, ("spawn", "sensors"), str(error))
        own = next((slot.own for other, slot in self._fleet.boats_in(self.config) if other.name == boat.name), ())
        return problem_at(self._fleet.section, own, f"boat {boat.name}: {error}")

    def _parameters(self, seed: int) -> Parameters:
        config, earth = self.config, self.config.georeference
        goals = tuple((goal.x, goal.y, goal.yaw) for goal in parts_of(self.task, Goal))
        return record_from(
            Parameters,
            config,
            config.physics,
            format=FORMAT,
            physics_version=PHYSICS_VERSION,
            fleet=self.fleet,
            seed=seed,
            sea=self.sea,
            current=current_parameters(config.current),
            wind=wind_parameters(config.wind, config.physics.profile),
            air=air_parameters(config.wind, config.physics.profile),
            **self.rows.tables,
            spawn=record_from(Spawn, config.spawn, config.physics, wind=newcomer_wind(config.wind, config.physics)),
            task=self.task,
            waypoints=goals,
            markers=tuple(marker_rows(config.markers, goals)),
            georeference=record_from(Georeference, earth) if earth else None,
            shoreline=shoreline(config.terrain, config.folder) if config.terrain else (),
            scene=scene_parameters(config),
        )


def _warn_if_stiff(boat: boats.Boat, timestep: float) -> None:
    share = drag_share(boat, timestep)
    if share > _STIFF_DRAG:
        text = f"robot {boat.name}: its linear drag removes {share:.3g} times its velocity in a step of {timestep:g} s"
        text += f"; beyond {_STIFF_DRAG:g} it diverges: check `drag_linear`, or use a shorter timestep"
        warn(text, 5)


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
        warn(note, 3)
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
