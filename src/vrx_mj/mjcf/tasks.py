"""A task's section, resolved in its world: `World.parameters.task`, what its boat may touch, and what holds the boat.

Names and places are looked up in the world; what is wrong is an error with its place in the file. Contact sensors find
what the base link touches, as in VRX, where engines on hinges do not count. A lock is a weld to a carrier that may
heave, roll and pitch (VRX's riser and pivot joints); switching the weld off releases the boat.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, cast

from vrx_mj.config import tasks
from vrx_mj.config.fleet import BoatConfig
from vrx_mj.config.kinds import CLASSIC, NEWER
from vrx_mj.config.loading import problem_at
from vrx_mj.config.search import kind_name
from vrx_mj.config.tasks import AnimalConfig, ChannelConfig, TaskConfig
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import ConfigError, Problem, UnknownNameError, warn
from vrx_mj.frames import Pose, Vector
from vrx_mj.mjcf.docks import dock_entry, find_dock
from vrx_mj.mjcf.objects import PlacedDock, PlacedObject, ball_name
from vrx_mj.mjcf.templates import render
from vrx_mj.mjcf.terrain import on_land
from vrx_mj.model import tasks as model
from vrx_mj.model.kinds import record_from
from vrx_mj.model.tasks import Goal, Pinger

_Row = dict[str, Any]
_Loc = tuple[str | int, ...]
_Shooter = tuple[str, str]
"""Names of a boat and of one of its ball shooters."""
_WORLD_BODY = "world"
"""The body of all that is fixed without one of its own, as MuJoCo calls it."""
_POINTS = {"big": 5.0, "small": 10.0}
"""Points of a ball in a hole, VRX's."""
_LEFT_BUOY = re.compile(r"red_bound_(\d+)")
"""Name of the left buoy of a gate."""
_PARTNERS = ("green", "white", "blue", "black")
"""First words of the right buoys of gates; a gate has one of them."""
_ANIMALS: Mapping[str, model.Habit] = {
    "crocodile": "avoid",
    "platypus": "circumnavigate_clockwise",
    "turtle": "circumnavigate_counterclockwise",
}
"""VRX's goals of animals, by the first word of their model."""


class Site:
    """A world with its boats, objects and docks, as its task sees them. What is wrong is kept until `check`."""

    def __init__(
        self,
        config: WorldConfig,
        boats: Sequence[BoatConfig],
        objects: Sequence[PlacedObject],
        docks: Sequence[PlacedDock],
        shooters: Sequence[_Shooter] = (),
    ) -> None:
        assert config.task is not None, "a world without a task"
        self.config = config
        self.task: TaskConfig = config.task
        self.boats = [boat.name for boat in boats]
        self.objects = {item.name: item for item in objects}
        self.docks = docks
        self.shooters = shooters
        self._found: list[Problem] = []

    def fault(self, loc: _Loc, message: str) -> None:
        """Keep a fault of the task at `loc`."""
        self._found.append(problem_at(self.config.section, ("task", *loc), message))

    def check(self) -> None:
        """Raise the faults.

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

    def object(self, loc: _Loc, name: str, *, floating: bool = False) -> PlacedObject | None:
        """The single object of a name, which may have to float; None if it is not there."""
        item = self.objects.get(name)
        if item is None:
            self.fault(loc, str(UnknownNameError("object", name, self.objects)))
        elif floating and item.config.kind != "floating":
            self.fault(loc, f"'{name}' is static; a floating object is needed")
        return item

    def dock(self, name: str) -> PlacedDock | None:
        """The dock of a name; None if it is not there, or has no bays."""
        try:
            dock = find_dock(self.docks, name)
            if dock.geometry.bays:
                return dock
            self.fault(("dock",), f"'{name}' has no bays")
        except UnknownNameError as error:
            self.fault(("dock",), str(error))
        return None

    def place(self, loc: _Loc, value: Vector, *, geodetic: bool) -> Goal:
        """A place on the water from [latitude, longitude, yaw from east] or [x, y, yaw from x]; m, degrees and rad."""
        first, second, yaw = value
        earth = self.config.georeference
        if geodetic:
            assert earth is not None, "checked with the world"
            x, y, _ = earth.to_enu(first, second)
            place = Goal(x=x, y=y, yaw=yaw - earth.x_from_east, latitude=first, longitude=second)
        else:
            place = Goal(x=first, y=second, yaw=yaw, **self._geodetic(first, second, 0.0))
        self._on_water(loc, place.x, place.y)
        return place

    def point(self, loc: _Loc, value: Vector) -> Pinger:
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

    def _geodetic(self, x: float, y: float, z: float) -> _Row:
        earth = self.config.georeference
        latitude, longitude = earth.to_geodetic(x, y, z)[:2] if earth else (None, None)
        return {"latitude": latitude, "longitude": longitude}

    def _on_water(self, loc: _Loc, x: float, y: float) -> None:
        terrain = self.config.terrain
        if terrain and on_land(terrain, x, y, self.config.folder):
            self.fault(loc, f"on land: x {x:.2f} m, y {y:.2f} m is inside the shore of {terrain}")


@dataclass(frozen=True)
class Touch:
    """Something that the scored boat may touch: its name among the task's rivals, and its body."""

    name: str
    body: str
    tree: bool = False
    """Whether the bodies that hang on it count, too."""


def touch_sensor(touch: Touch, scored: str) -> str:
    """The element of the sensor of what the base link `scored` touches."""
    return "\n    " + render("touch.xml.j2", touch=touch, scored=scored)


def touches_of(
    boat: str,
    links: Mapping[str, str],
    objects: Sequence[PlacedObject],
    docks: Sequence[PlacedDock],
    *,
    terrain: bool,
) -> list[Touch]:
    """All that can collide with a boat; `links` are the base links of all boats by their names."""
    shore = [Touch("terrain", _WORLD_BODY)] if terrain else []
    return [*thing_touches(objects, docks), *shore, *(Touch(*item) for item in links.items() if item[0] != boat)]


def thing_touches(objects: Sequence[PlacedObject], docks: Sequence[PlacedDock]) -> Iterator[Touch]:
    """Objects and docks that a boat may touch."""
    for item in objects:
        links = item.config.links
        if item.config.collisions or any(link.collisions for link in links):
            yield Touch(item.name, f"{item.name}/{item.config.link}", tree=bool(links))
    for dock in docks:
        yield Touch(dock.name, dock_entry(dock).bodies[0], tree=True)


def task_parameters(
    config: WorldConfig,
    boats: Sequence[BoatConfig],
    objects: Sequence[PlacedObject],
    docks: Sequence[PlacedDock],
    shooters: Sequence[_Shooter] = (),
) -> model.Task | None:
    """The task of a world, resolved; None if it has none. What the boat may touch is added by who builds it.

    Raises:
        ConfigError: it names what is not there, or leads ashore; with every place in the file.
    """
    task = config.task
    if task is None:
        return None
    site = Site(config, boats, objects, docks, shooters)
    kind = model.TASKS[_type(task)]
    own = (each.name for each in fields(kind))
    found = record_from(kind, task, **{key: _RESOLVERS[key](task, site) for key in own if key in _RESOLVERS})
    _check_copied_names(found, site)
    site.check()
    return cast(model.Task, found)


def _check_copied_names(task: model.TaskBase, site: Site) -> None:
    """Find faults in names that were copied from the file; resolvers look up the others."""
    known = {
        model.THING: [*site.objects, *(dock.name for dock in site.docks)],
        model.BOAT: site.boats,
    }
    for place, kind, name in model.names_in(task):
        loc = tuple(int(part) if part.isdecimal() else part for part in re.findall(r"\w+", place))
        if loc[0] not in _RESOLVERS and kind in known and name not in known[kind]:
            site.fault(loc, str(UnknownNameError(kind, name, known[kind])))


def _type(task: TaskConfig) -> str:
    return "stationkeeping" if task.type == "station_keeping" else task.type


def _fixed_poses(_task: TaskConfig, site: Site) -> dict[str, Pose]:
    """Poses of the objects and docks that never move."""
    still = {item.name: item.pose for item in site.objects.values() if item.config.kind == "static"}
    return still | {dock.name: dock.pose for dock in site.docks if not dock.config.dynamic}


def _goal(task: tasks.GoalConfig, site: Site) -> Goal:
    if task.goal:
        return site.place(("goal",), task.goal, geodetic=True)
    assert task.goal_cart is not None, "checked with the task"
    return site.place(("goal_cart",), task.goal_cart, geodetic=False)


def _waypoints(task: tasks.WayfindingTask, site: Site) -> tuple[Goal, ...]:
    key = "waypoints" if task.waypoints else "waypoints_cart"
    places = enumerate(getattr(task, key))
    return tuple(site.place((key, index), place, geodetic=bool(task.waypoints)) for index, place in places)


def _shown_objects(task: tasks.PerceptionTask, site: Site) -> tuple[model.ShownObject, ...]:
    rows = []
    for index, item in enumerate(task.objects):
        thing = site.object(("objects", index, "name"), item.name, floating=True)
        kind = item.type or (kind_name(thing.model) if thing else "")
        rows.append(record_from(model.ShownObject, item, type=kind, stash=thing.pose if thing else item.pose))
    return tuple(rows)


def _gates(site: Site, at: _Loc, channel: ChannelConfig) -> tuple[model.Gate, ...]:
    """The gates of a channel, whose section is at `at`, by the full names of their buoys."""
    course = channel.course
    parts = site.parts(course)
    known = ", ".join(parts) or "none"
    if course is not None and not parts:
        site.fault((*at, "course"), str(UnknownNameError("course", course, site.courses())))
        return ()
    owner = f"course '{course}'" if course else "the world"
    for index, gate in enumerate(channel.gates):
        for name in (side for side in gate if side not in parts):
            site.fault((*at, "gates", index), f"{owner} has no buoy '{name}'; known: {known}")
    pairs = channel.gates or _red_right(parts)
    if not pairs:
        text = f"{owner} has no red_bound_i with a partner i, one of {', '.join(_PARTNERS)}; known: {known}"
        site.fault((*at, "gates"), text)
    lone = [name for name in parts if _LEFT_BUOY.fullmatch(name) and all(name != left for left, _ in pairs)]
    if lone and not channel.gates:
        warn(f"{owner}: ignored for lack of a partner: {', '.join(lone)}", 2)
    prefix = f"{course}/" if course else ""
    return tuple(model.Gate(left=prefix + left, right=prefix + right) for left, right in pairs)


def _red_right(parts: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of red buoys and their partners, in the order of their numbers."""
    numbers = sorted((int(match[1]), match[1]) for match in map(_LEFT_BUOY.fullmatch, parts) if match)
    partners = {i: [name for color in _PARTNERS if (name := f"{color}_bound_{i}") in parts] for _, i in numbers}
    return [(f"red_bound_{i}", partners[i][0]) for _, i in numbers if partners[i]]


def _light_buoy(task: tasks.DockTask, site: Site) -> str | None:
    buoy = site.object(("light_buoy",), task.light_buoy) if task.light_buoy is not None else None
    if buoy and buoy.config.light is None:
        site.fault(("light_buoy",), f"'{task.light_buoy}' has no `light`")
    return task.light_buoy


def _bays(task: tasks.DockTask, site: Site) -> tuple[model.Bay, ...]:
    """The dock's bays with what the task gives for them, in their order."""
    dock = site.dock(task.dock)
    known = dock.geometry.bays if dock else ()
    if dock and len(task.bays) != len(known):
        names = ", ".join(bay.name for bay in known)
        site.fault(("bays",), f"'{task.dock}' has {len(known)} bays, {names}; got {len(task.bays)}")
        return ()
    rows = []
    for index, (its, bay) in enumerate(zip(known, task.bays, strict=False)):
        if bay.name not in {None, its.name}:
            site.fault(("bays", index, "name"), f"this bay of '{task.dock}' is '{its.name}', not '{bay.name}'")
        internal, external = (record_from(model.Box, zone) for zone in (its.internal, its.external))
        placard = f"{dock.parent}/{its.placard}" if dock and its.placard else None
        row = record_from(model.Bay, bay, name=its.name, placard=placard, internal=internal, external=external)
        rows.append(row)
    return tuple(rows)


def _holes(task: tasks.DockTask, site: Site) -> tuple[model.Hole, ...]:
    """The holes that count, with their points."""
    dock = site.dock(task.dock)
    if dock is None:
        return ()
    known = {
        (hole.bay, hole.size): {**hole.model_dump(), "bay": dock.geometry.bays[hole.bay - 1].name}
        for hole in dock.geometry.holes
    }
    if task.targets is None:
        counts = task.type == "scan_dock_deliver"
        return tuple(model.Hole(**hole, points=_POINTS[hole["size"]]) for hole in known.values()) if counts else ()
    for index, target in enumerate(task.targets):
        if (target.bay, target.size) not in known:
            site.fault(("targets", index), f"bay {target.bay} of '{task.dock}' has no {target.size} hole")
    there = (target for target in task.targets if (target.bay, target.size) in known)
    return tuple(model.Hole(**known[target.bay, target.size], points=target.points) for target in there)


def _animals(task: tasks.WildlifeTask, site: Site) -> tuple[model.Animal, ...]:
    all_of_them = [AnimalConfig(name=name) for name, item in site.objects.items() if _habit(kind_name(item.model))]
    animals = []
    for index, animal in enumerate(task.animals or all_of_them):
        thing = site.object(("animals", index, "name"), animal.name, floating=True)
        kind = kind_name(thing.model) if thing else ""
        goal = animal.goal or _habit(kind)
        if thing and goal is None:
            text = f"required for the model {kind}; only {', '.join(_ANIMALS)} have goals of their own"
            site.fault(("animals", index, "goal"), text)
        animals.append(model.Animal(name=animal.name, model=kind, goal=goal or "avoid"))
    if not animals:
        site.fault(("animals",), f"the world has no animals; models of animals start with {', '.join(_ANIMALS)}")
    return tuple(animals)


def _habit(kind: str) -> model.Habit | None:
    """The goal of an animal's model."""
    return _ANIMALS.get(kind.partition("_")[0])


def _pinger(task: tasks.GymkhanaTask | tasks.AcousticPerceptionTask | tasks.AcousticTrackingTask, site: Site) -> object:
    """A point, or the name of what carries the beacon."""
    if isinstance(task, tasks.AcousticTrackingTask):
        site.object(("pinger",), task.pinger, floating=True)
        return task.pinger
    return site.point(("pinger",), task.pinger)


_RESOLVERS: Mapping[str, Callable[[Any, Site], object]] = {
    "type": lambda task, _: _type(task),
    "name": lambda task, _: task.name or task.type,
    "boat": lambda _, site: site.boat(),
    "profile": lambda _, site: NEWER if site.config.physics.profile == NEWER else CLASSIC,
    "durations": lambda task, _: (task.initial_state_duration, task.ready_state_duration, task.running_state_duration),
    "fixed": _fixed_poses,
    "rivals": lambda *_: (),
    "goal": _goal,
    "waypoints": _waypoints,
    "objects": _shown_objects,
    "gates": lambda task, site: _gates(site, (), task),
    "channel": lambda task, site: record_from(
        model.Channel, task.channel, gates=_gates(site, ("channel",), task.channel)
    ),
    "pinger": _pinger,
    "animals": _animals,
    "anchor": lambda task, site: dock.name if (dock := site.dock(task.dock)) else "",
    "bays": _bays,
    "holes": _holes,
    "balls": lambda _, site: tuple(ball_name(*shooter) for shooter in site.shooters if shooter[0] == site.boat()),
    "light_buoy": _light_buoy,
}
"""Functions that find a field of a compiled task in the world; a field without one is copied from the file."""
