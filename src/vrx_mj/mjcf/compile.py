"""From a world and a fleet to a `World`: pieces are rendered once for each kind, and placed under their names."""

import json
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vrx_mj.arguments import as_flag, as_seed, check_kind
from vrx_mj.config.fleet import BoatConfig, FleetConfig, Order, load_fleet
from vrx_mj.config.kinds import opener
from vrx_mj.config.loading import fault_text, problem_at
from vrx_mj.config.wording import ros_names_note
from vrx_mj.config.world import WorldConfig, load_world
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import CompileError, ConfigError, Problem, UnknownNameError, VrxWarning, first_names
from vrx_mj.foreign import budget
from vrx_mj.mjcf.afloat import boats_afloat
from vrx_mj.mjcf.assembly import Assembly
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.build import build_boat
from vrx_mj.mjcf.docks import check_docks
from vrx_mj.mjcf.hulls import warn_if_rough, warn_if_uncovered
from vrx_mj.mjcf.objects import PlacedObject, parked_balls, place_docks, place_fields, place_objects
from vrx_mj.mjcf.parameters import Rows, current_parameters, sea_parameters
from vrx_mj.mjcf.pieces import Part, Piece, Pieces
from vrx_mj.mjcf.robots import boat_kind, reweighed_piece, stiffness
from vrx_mj.mjcf.scene import marker_rows, scene_parameters, scene_values
from vrx_mj.mjcf.tasks import Touch, task_parameters, touches_of
from vrx_mj.mjcf.terrain import shoreline, terrain_piece
from vrx_mj.mjcf.wind import air_parameters, newcomer_wind, own_load, warn_if_unmoved, warn_if_unpushed, wind_parameters
from vrx_mj.mjcf.world import World
from vrx_mj.model.boats import Spawn
from vrx_mj.model.kinds import record_from
from vrx_mj.model.numbers import with_numbers
from vrx_mj.model.tasks import Goal, Task, parts_of
from vrx_mj.model.things import Georeference
from vrx_mj.model.world import FORMAT, Parameters, checked_parameters, tree_of
from vrx_mj.signals import delays_exit

_STIFF = 2.0
"""Share of a boat's velocity that drag may take in a step."""

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
        self.kinds: dict[Order, Boat] = {}
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
            warnings.warn(note, VrxWarning, stacklevel=3)
        check_docks(self.config, self.docks)
        if self.config.terrain:
            land = terrain_piece(self.config.terrain, self.config.folder)
            self.parts.append(Part("terrain", land, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
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
            text = "without its task, which scores a boat that is there from the start: the fleet has no boats"
            warnings.warn(f"world {self.config.name}: {text}", VrxWarning, stacklevel=4)
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

    def _build(self, boat: BoatConfig) -> Boat:
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


def _warn_if_stiff(boat: Boat, timestep: float) -> None:
    share = stiffness(boat, timestep)
    if share > _STIFF:
        text = f"robot {boat.name}: its linear drag removes {share:.3g} times its velocity in a step of {timestep:g} s"
        text += f"; beyond {_STIFF:g} it diverges: check `drag_linear`, or use a shorter timestep"
        warnings.warn(text, VrxWarning, stacklevel=5)
