"""Objects of a world file: single things with a name and a pose, their pieces of MJCF and their rows of tables.

Every ball shooter has a ball, parked far under water until it is fired, and used again for every shot. A parked ball
sleeps, in MuJoCo's sense: it takes no part in a step until its pose is changed. Nothing else ever falls asleep, as the
tolerance is 0.

The objects of a field are at points drawn from a seed, one by one, each where there is room for it. VRX's
generate_avoid_obstacles_buoys.py means to keep its points 5 m apart and does not; its field is kept as it is, in the
catalogue, and a new one is made here.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.config.docks import Cell, DockGeometry, DockPlacement, dock_geometry
from vrx_mj.config.kinds import MARINE, NEWER
from vrx_mj.config.layouts import is_clear
from vrx_mj.config.objects import (
    FieldConfig,
    LinkConfig,
    ObjectConfig,
    PathConfig,
    Placement,
    RopeConfig,
    link_order,
    load_object,
    path_points,
)
from vrx_mj.config.search import kind_name
from vrx_mj.config.shapes import BuoyancyConfig, BuoyancyElement
from vrx_mj.config.weather import WindConfig
from vrx_mj.config.world import PhysicsConfig, WorldConfig
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.errors import CompileError
from vrx_mj.frames import IDENTITY, ZERO, Pose, Vector, apply, compose, inverse, rotation
from vrx_mj.mjcf.parameters import NO_WIND, PROFILES, Rows
from vrx_mj.mjcf.pieces import Piece
from vrx_mj.mjcf.templates import geoms, meshes
from vrx_mj.mjcf.terrain import land_distance
from vrx_mj.model.kinds import record_from
from vrx_mj.model.things import Element, Float, Follower, Light, Object, PathPoint, Rope
from vrx_mj.model.world import Parameters
from vrx_mj.physics.noise import stream_key, uniform

_DEFAULT_ROPE = RopeConfig()
"""Rope of an object in a world with current, unless it gives another, or swims."""
_TRIES = 1000
"""Number of places tried for an object before the field counts as full."""
BALL = "blue_projectile"
"""The object that shooters shoot; VRX's."""
DEPTH = 200.0
"""Depth of a parked ball under the mean surface [m]: below any ground, and out of sight of cameras and lidars."""
SPACING = 25.0
"""Distance between parked balls [m]: more than the distance at which the stepping loop looks for contacts."""
_COLUMNS = 32
"""Number of columns of the grid of parked balls."""
_SHAPE_CODES = {"box": 0, "sphere": 1, "cylinder": 2}
"""Codes of shapes in the runtime's tables."""
DENSITY = 997.0
"""Density of the water [kg/m3] in profile vrx3, where an object's file gives none. VRX 3's PolyhedraBuoyancyDrag.cc."""
_ROPE_STIFFNESS = 10.0
"""Default stiffness of ropes for each kg of what they hold [N/m]: its period is 2 s."""
_TRAJECTORY_PROFILE = NEWER
"""The profile whose worlds use Gazebo's TrajectoryFollower."""


@dataclass(frozen=True)
class PlacedObject:
    """One body of the catalogue, floating or static, somewhere in the world."""

    name: str
    """Name in the world; a part of a course carries the course's name: `course/red_bound_0`."""
    model: str
    config: ObjectConfig
    pose: Pose
    path: PathConfig | None = None
    """Path along which it swims."""
    mooring: RopeConfig | None = None
    """Rope that holds it in worlds with current."""


@dataclass(frozen=True)
class PlacedDock:
    """One dock, somewhere in the world."""

    name: str
    """Name in the world; one of a composite object carries the object's name: `robotx_dock_2022/base`."""
    pose: Pose
    config: DockPlacement
    """Its entry in its file; `symbols` are those of the object that it came with, if that gives any."""
    parent: str
    """Prefix of its placards' names: its object's name, or its own if it is a world's."""

    @property
    def cells(self) -> tuple[Cell, ...]:
        """Row and column of each block in its drawing."""
        return self.config.cells

    @property
    def block(self) -> float:
        """Edge of a block [m]."""
        return self.config.block

    @property
    def geometry(self) -> DockGeometry:
        """The dock's bays, placards and holes, in its own frame."""
        return dock_geometry(self.config)


def place_objects(
    placements: Sequence[Placement], at: Pose = IDENTITY, prefix: str = "", mooring: RopeConfig | None = _DEFAULT_ROPE
) -> Iterator[PlacedObject]:
    """Every single object of the placements, courses taken apart; `mooring` is that of objects that give none."""
    for item in placements:
        config = item.config
        pose = compose(at, item.pose)
        name = prefix + item.name
        if config.kind == "composite":
            yield from place_objects(config.objects, pose, f"{name}/", _rope(item, mooring))
        else:
            path = item.path if "path" in item.model_fields_set else config.path
            yield PlacedObject(name, item.model, config, pose, path, None if path else _rope(item, mooring))


def _rope(item: Placement, mooring: RopeConfig | None) -> RopeConfig | None:
    return item.mooring if "mooring" in item.model_fields_set else mooring


def place_docks(
    docks: Sequence[DockPlacement], placements: Sequence[Placement], at: Pose = IDENTITY, prefix: str = ""
) -> Iterator[PlacedDock]:
    """Every dock: those of the world itself, then those inside its composite objects."""
    for dock in docks:
        yield PlacedDock(prefix + dock.name, compose(at, dock.pose), dock, prefix[:-1] or dock.name)
    for item in placements:
        config = item.config
        if config.kind == "composite":
            inner, name = compose(at, item.pose), f"{prefix}{item.name}/"
            yield from place_docks(_with_symbols(config.docks, item.symbols), config.objects, inner, name)


def _with_symbols(docks: Sequence[DockPlacement], symbols: Sequence[str]) -> list[DockPlacement]:
    """An object's docks with symbols on their placards, as far as there are any."""
    shown = []
    for dock in docks:
        count = len(dock_geometry(dock).placards) if symbols else 0
        own, symbols = symbols[:count], symbols[count:]
        shown.append(dock.model_copy(update={"symbols": (*own, *dock.symbols[len(own) :])}) if own else dock)
    return shown


def place_fields(
    config: WorldConfig,
    boats: Sequence[tuple[float, float]],
    objects: Sequence[PlacedObject],
    docks: Sequence[PlacedDock],
) -> Iterator[PlacedObject]:
    """The objects of a world's fields, among boats at (x, y) [m], other objects and docks.

    Raises:
        CompileError: a field is full before all its objects have a place.
    """
    taken = np.array([*boats, *(item.pose[:2] for item in objects)], np.float64).reshape(-1, 2)
    ground = _Ground(config, docks)
    for field in config.fields:
        placed = list(_field(field, config, taken, ground))
        taken = np.concatenate([taken, [item.pose[:2] for item in placed]])
        yield from placed


def _field(field: FieldConfig, config: WorldConfig, taken: FloatArray, ground: "_Ground") -> Iterator[PlacedObject]:
    key = np.uint64(stream_key(config.seed if field.seed is None else field.seed, "field", field.name))
    wanted = [(kind, index) for kind in field.objects for index in range(kind.count)]
    counter = 0
    for done, (kind, index) in enumerate(wanted):
        for _ in range(_TRIES):
            x, y = (c + field.size * (uniform(key, np.uint64(counter + i)) - 0.5) for i, c in enumerate(field.center))
            counter += 2
            if is_clear(taken, x, y, field.min_distance) and ground.clear(x, y, field.min_distance):
                break
        else:
            raise CompileError(_full(field, config.name, done, len(wanted)))
        taken = np.concatenate([taken, [(x, y)]])
        model = load_object(kind.model, kind.folder)
        name = f"{field.name}/{kind.stem}_{index}"
        yield PlacedObject(name, kind.model, model, (x, y, 0.0, 0.0, 0.0, 0.0), model.path, _DEFAULT_ROPE)


def _full(field: FieldConfig, world: str, done: int, wanted: int) -> str:
    square = f"{field.size:g} m x {field.size:g} m around ({field.center[0]:g}, {field.center[1]:g})"
    return (
        f"world {world}: the field {field.name} is full: {done} of its {wanted} objects fit in {square}, "
        f"{field.min_distance:g} m from each other, boats, other objects, docks and the shore ({_TRIES} places were "
        "tried for the next one)"
    )


class _Ground:
    """Docks and land: what does not float away."""

    def __init__(self, config: WorldConfig, docks: Sequence[PlacedDock]) -> None:
        self._terrain, self._folder = config.terrain, config.folder
        self._blocks = [(dock.config.block / 2.0, _middles(dock)) for dock in docks]

    def clear(self, x: float, y: float, distance: float) -> bool:
        """Whether (x, y) is in the water and so far [m] from the shore and from docks, whose blocks count as discs."""
        if not all(is_clear(middles, x, y, distance + 2.0**0.5 * half) for half, middles in self._blocks):
            return False
        gap = land_distance(self._terrain, x, y, self._folder) if self._terrain else math.inf
        return gap > 0.0 and gap >= distance


def _middles(dock: PlacedDock) -> FloatArray:
    """Middles of a dock's blocks (n, 2) [m, world]."""
    edge = dock.config.block
    local = [(edge * i, edge * j, 0.0, 0.0, 0.0, 0.0) for i, j in dock.cells]
    return np.array([compose(dock.pose, pose)[:2] for pose in local], np.float64).reshape(-1, 2)


def ball_name(boat: str, shooter: str) -> str:
    """Name of a shooter's ball among the objects of a world."""
    return f"{boat}/{shooter}"


def ball_names(world: Parameters) -> frozenset[str]:
    """Names of the balls among the objects of a compiled world."""
    shooters = (sensor for sensor in world.sensors if sensor.type == "ball_shooter")
    return frozenset(ball_name(sensor.boat, sensor.name) for sensor in shooters)


def parked_balls(shooters: Sequence[tuple[str, str]]) -> list[PlacedObject]:
    """The balls of shooters, each given as (boat, sensor), where they wait: on a grid around the world's origin."""
    config = load_object(BALL)
    left = SPACING * (min(len(shooters), _COLUMNS) - 1) / 2.0
    return [
        PlacedObject(
            ball_name(boat, shooter),
            BALL,
            config,
            (SPACING * (index % _COLUMNS) - left, SPACING * (index // _COLUMNS), -DEPTH, 0.0, 0.0, 0.0),
        )
        for index, (boat, shooter) in enumerate(shooters)
    ]


def spare_ball(boat: str, shooter: str, taken: AbstractSet[tuple[float, ...]]) -> PlacedObject:
    """The ball of a shooter that comes later: south of the grid, at the first place [m] that is not `taken`."""
    index = 0
    while (place := (SPACING * (index % _COLUMNS), -SPACING * (1 + index // _COLUMNS), -DEPTH)) in taken:
        index += 1
    return PlacedObject(ball_name(boat, shooter), BALL, load_object(BALL), (*place, 0.0, 0.0, 0.0))


def object_piece(config: ObjectConfig, *, asleep: bool = False) -> Piece:
    """One floating or static object; asleep, it takes no part in a step until its pose is changed.

    The body carries the name of the object's link. Collision geoms are in group 3, visual ones, which neither
    collide nor weigh, in group 2. Mass, centre of mass and inertia are the configuration's, never the geoms'.
    """
    parts: tuple[ObjectConfig | LinkConfig, ...] = (config, *config.links)
    collisions = (shape for part in parts for shape in part.collisions)
    needed = meshes([*collisions, *(shape for part in parts for shape in part.visuals)])
    solid = [config.link] if config.collisions else []
    solid += [link.name for link in config.links if link.collisions]
    values = {
        "object": config,
        "meshes": needed,
        "collisions": geoms(config.collisions),
        "visuals": geoms(config.visuals),
        "branches": _branches(config, config.link, (0.0,) * 6),
        "apart": list(combinations(solid, 2)) if config.links else [],
        "asleep": asleep,
    }
    return Piece.from_template("object.xml.j2", {item.file: item.content for item in needed}, **values)


def _branches(config: ObjectConfig, name: str, pose: Pose) -> list[dict[str, object]]:
    """The links that hang on the one of a name, whose pose in the object is given, for the template."""
    links, found = {link.name: link for link in config.links}, list[dict[str, object]]()
    for joint in (joint for joint in config.joints if joint.parent == name):
        link, turn = links[joint.child], rotation(*joint.pose[3:])
        branch = {
            "link": link,
            "pose": compose(inverse(pose), link.pose),
            "joint": joint,
            "place": joint.pose[:3],
            "type": "slide" if joint.type == "prismatic" else "hinge",
            "axes": [(apply(turn, axis.xyz), axis) for axis in joint.axes],
            "collisions": geoms(link.collisions),
            "visuals": geoms(link.visuals),
            "branches": _branches(config, link.name, link.pose),
        }
        found.append(branch)
    return found


def object_rows(item: PlacedObject, wind: WindConfig | None, physics: PhysicsConfig, tables: Rows) -> Rows:
    """The rows that an object adds at the ends of a world's tables."""
    config, body = item.config, f"{item.name}/{item.config.link}"
    floats = config.kind == "floating"
    kind: Literal["floating", "static"] = "floating" if floats else "static"
    links = tuple(f"{item.name}/{name}" for name in link_order(config.link, config.joints))
    own = Object(name=item.name, model=kind_name(item.model), kind=kind, body=body, pose=item.pose, links=links)
    rows, start = Rows(objects=[own]), len(tables.elements)
    if (light := config.light) is not None:
        panels = tuple(f"{item.name}/{panel}" for panel in light.panels)
        rows.lights.append(Light(name=item.name, body=body, geoms=panels, pattern=light.pattern))
    blown = _blown_links(item, wind)
    if floats:
        follower = -1
        if item.path is not None:
            follower = len(tables.followers)
            row, points = follower_row(item, physics.profile, len(tables.path_points))
            rows.followers.append(row)
            rows.path_points.extend(points)
        if item.mooring is not None and physics.profile == MARINE:
            rows.ropes.append(_rope_row(item, item.mooring, len(tables.floats)))
        wet = None if config.links else config.buoyancy  # with links, water and wind act on their rows
        push = NO_WIND if config.links else blown[config.link]
        rows.floats.append(_float_row(config, config.link, wet, item, push, physics, start, follower))
        rows.elements.extend(map(element_row, wet.elements if wet else ()))
    parts: list[tuple[str, ObjectConfig | LinkConfig]] = [(link.name, link) for link in config.links]
    if parts and floats:
        parts.insert(0, (config.link, config))
    for name, part in parts:
        first = start + len(rows.elements)
        rows.links.append(_float_row(part, name, part.buoyancy, item, blown[name], physics, first, -1))
        rows.elements.extend(map(element_row, part.buoyancy.elements if part.buoyancy else ()))
    return rows


def _blown_links(item: PlacedObject, wind: WindConfig | None) -> Mapping[str, Vector]:
    """Coefficients of the wind by link: an entry acts on the link that it names, or else on the object's own."""
    links = [item.config.link, *(link.name for link in item.config.links)]
    blown = dict.fromkeys(links, NO_WIND)
    for one in reversed((wind.objects if wind else None) or ()):
        if one.model in (item.name, item.model):
            blown[one.link if one.link in links else item.config.link] = one.coefficients
    return blown


def follower_row(item: PlacedObject, profile: str, start: int) -> tuple[Follower, list[PathPoint]]:
    """The row of a thing with a path in `FOLLOWER`, and those of its waypoints, which begin at row `start`."""
    path = item.path
    assert path is not None, f"{item.name} follows no path"
    points = path_points(path, item.pose)
    turns_first = profile == _TRAJECTORY_PROFILE if path.turns_first is None else path.turns_first
    row = record_from(
        Follower,
        path,
        tolerance=math.radians(path.bearing_tolerance),
        reach=path.range_tolerance,
        turns_first=1 if turns_first else 0,
        loop=1 if path.loop else 0,
        waypoint_start=start,
        waypoint_count=len(points),
    )
    return row, [PathPoint(position=(point[0], point[1])) for point in points]


def _float_row(
    part: ObjectConfig | LinkConfig,
    link: str,
    buoyancy: BuoyancyConfig | None,
    item: PlacedObject,
    blown: Vector,
    physics: PhysicsConfig,
    start: int,
    follower: int,
) -> Float:
    """The row of a link, whose elements begin at row `start`."""
    assert part.mass is not None, f"{item.model} has no mass"
    assert part.inertia is not None, f"{item.model} has no inertia"
    silent = buoyancy is None or "fluid_density" not in buoyancy.model_fields_set
    density = buoyancy.fluid_density if buoyancy else WATER_DENSITY
    return record_from(
        Float,
        part,
        body=f"{item.name}/{link}",
        com=part.center_of_mass,
        density=DENSITY if physics.profile == NEWER and silent else density,
        gravity=physics.gravity,
        level=buoyancy.fluid_level if buoyancy else 0.0,
        linear_drag=buoyancy.linear_drag if buoyancy else 0.0,
        angular_drag=buoyancy.angular_drag if buoyancy else 0.0,
        profile=PROFILES[physics.profile],
        wind=blown,
        element_start=start,
        element_count=len(buoyancy.elements) if buoyancy else 0,
        follower=follower,
    )


def _rope_row(item: PlacedObject, rope: RopeConfig, number: int) -> Rope:
    """The rope of the floating object of row `number`, whose anchor is under its centre of mass."""
    mass = item.config.whole_mass
    stiffness = _ROPE_STIFFNESS * mass if rope.stiffness is None else rope.stiffness
    x, y, *_ = compose(item.pose, (*item.config.center_of_mass, 0.0, 0.0, 0.0))
    return record_from(
        Rope,
        rope,
        float=number,
        anchor=(x, y),
        stiffness=stiffness,
        damping=2.0 * math.sqrt(stiffness * mass) if rope.damping is None else rope.damping,
    )


def element_row(element: BuoyancyElement) -> Element:
    """A buoyancy element: dimensions, pose in the link, full volume [m3] and VRX's mean dimension [m]."""
    a, b, c = element.size or ZERO
    r, length = element.radius or 0.0, element.length or 0.0
    size, mean = {
        "box": ((a, b, c), (a + b + c) / 3.0),
        "sphere": ((r, 0.0, 0.0), 2.0 * r),
        "cylinder": ((r, length, 0.0), (2.0 * r + length) / 2.0),
    }[element.type]
    return Element(
        shape=_SHAPE_CODES[element.type],
        size=size,
        position=element.pose[:3],
        rotation=rotation(*element.pose[3:]),
        volume=element.volume,
        mean_dimension=mean,
    )
