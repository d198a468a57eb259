"""Objects of the catalogue, and users' own: as pieces of one body or a tree of bodies, and as rows of a world's tables.

Every ball shooter has a ball, parked far under water until it is fired, and used again for every shot. A parked ball
sleeps, in MuJoCo's sense: it takes no part in a step until its pose is changed. Nothing else ever falls asleep, as the
tolerance is 0.
"""

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from itertools import combinations
from typing import Literal

from vrx_mj.config.joints import LinkConfig, link_order
from vrx_mj.config.objects import ObjectConfig, RopeConfig, load_object, path_points
from vrx_mj.config.profiles import MARINE, NEWER
from vrx_mj.config.search import kind_name
from vrx_mj.config.shapes import BuoyancyConfig, BuoyancyElement
from vrx_mj.config.wind import WindConfig
from vrx_mj.config.world import PhysicsConfig
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.frames import Pose, apply, compose, inverse, rotation
from vrx_mj.mjcf.parameters import PROFILES, Rows
from vrx_mj.mjcf.pieces import Piece
from vrx_mj.mjcf.placement import PlacedObject
from vrx_mj.mjcf.templates import geoms, meshes
from vrx_mj.mjcf.wind import NO_WIND
from vrx_mj.model.afloat import Element, Float, Follower, PathPoint, Rope
from vrx_mj.model.kinds import record_from
from vrx_mj.model.site import Light, Object
from vrx_mj.model.world import Parameters

BALL = "blue_projectile"
"""The object that shooters shoot; VRX's."""
DEPTH = 200.0
"""Depth of a parked ball under the mean surface [m]: below any ground, and out of sight of cameras and lidars."""
SPACING = 25.0
"""Between parked balls [m]: more than the distance at which the stepping loop looks for contacts."""
_COLUMNS = 32


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


_SHAPES: Mapping[str, Literal[0, 1, 2]] = {"box": 0, "sphere": 1, "cylinder": 2}
DENSITY = 997.0
"""Density of the water [kg/m3] in profile vrx3, where an object's file gives none. VRX 3's PolyhedraBuoyancyDrag.cc."""
_ROPE_STIFFNESS = 10.0
"""Default stiffness of ropes for each kg of what they hold [N/m]: its period is 2 s."""
_TURNS_FIRST = NEWER
"""The profile whose worlds use Gazebo's TrajectoryFollower."""


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


def _blown_links(item: PlacedObject, wind: WindConfig | None) -> Mapping[str, tuple[float, float, float]]:
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
    turns_first = profile == _TURNS_FIRST if path.turns_first is None else path.turns_first
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
    blown: tuple[float, float, float],
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
    a, b, c = element.size or (0.0, 0.0, 0.0)
    r, length = element.radius or 0.0, element.length or 0.0
    size, volume, mean = {
        "box": ((a, b, c), a * b * c, (a + b + c) / 3.0),
        "sphere": ((r, 0.0, 0.0), 4.0 / 3.0 * math.pi * r**3, 2.0 * r),
        "cylinder": ((r, length, 0.0), math.pi * r * r * length, (2.0 * r + length) / 2.0),
    }[element.type]
    return Element(
        shape=_SHAPES[element.type],
        size=size,
        position=element.pose[:3],
        rotation=rotation(*element.pose[3:]),
        volume=volume,
        mean_dimension=mean,
    )
