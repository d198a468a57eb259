"""Boats that would start on land, on docks or on one another: refused with the distance, or moved to free water.

Seen from above a boat is the rectangle around what its base link carries. Where a fleet's origin puts boats ashore,
another one at which all are in free water is suggested.
"""

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely

from vrx_mj.arrays import FloatArray
from vrx_mj.config.fleet import BoatConfig, FleetConfig, Order, far_from_all
from vrx_mj.config.loading import problem_at
from vrx_mj.config.world import WorldConfig
from vrx_mj.errors import ConfigError, VrxError, warn
from vrx_mj.frames import Pose
from vrx_mj.mjcf.boats import Boat
from vrx_mj.mjcf.docks import block_corners
from vrx_mj.mjcf.flotation import boat_box
from vrx_mj.mjcf.objects import PlacedDock, PlacedObject
from vrx_mj.mjcf.terrain import area_of, land_area

_Area = Any
"""A shapely polygon in the world [m]."""
_Frame = tuple[float, float, float]
"""x, y [m] and yaw [rad] in the world."""
_Place = tuple[float, float]
"""x, y [m] in the world."""

FARTHEST_ORIGIN = 300.0
"""Largest distance of a suggested origin from the wanted place [m]."""
_ORIGIN_STEP = 2
"""Distance between the places tried [m]; their coordinates are whole numbers."""
_TURNS = (0, 1, -1, 2, -2, 3, -3, 4)
"""Eighths of a turn that are tried, the fleet's own heading first."""
_FLEET_MARGIN = 1.0
"""Width of the free water around each boat and around the fleet [m]."""
_ORIGIN_CHUNK = 500
"""Number of places tried in one call of shapely."""
_RANGE = 2000.0
"""Half the side of the square of water that is searched [m]."""
_MIN_SIZE = 0.5
"""Least length and beam that a boat counts with [m]: two boats then never share an origin."""
_MARGIN = 0.5
"""Width of the free water around a boat that is moved [m]."""
_PLACE_STEP = 0.5
"""Distance between the places tried for it [m]."""
_MAX_DIRECTIONS = 120
"""Largest number of directions tried at one distance."""
_PLACE_CHUNK = 250
"""Number of places tried in one call of shapely: most boats need no more."""
_MAX_SHIFT = 200.0
"""Largest distance by which a boat is moved [m]."""
_CLEARANCE = 1.0
"""Distance from an object's origin to keep in addition to the margin [m]."""
_ADVICE = "move it, or let `--nudge` (in Python `nudge=True`) move it to the nearest free place"
"""Advice on a boat that is not afloat, in messages."""
_LAND = "land"
"""Name of the ground in messages."""


def free_origin(
    corners: FloatArray, frame: _Frame, land: _Area, taken: _Area, *, water: _Place, middle: _Place | None = None
) -> _Frame | None:
    """The frame that has all boats in one free water, their middle as near as can be to where it is to be.

    None where nothing within `FARTHEST_ORIGIN` is free.

    Args:
        corners: outlines of the boats in the world (n, 4, 2) [m], as their present frame places them.
        frame: that present frame.
        land: what no boat may be on, and what may not be between them.
        taken: what else no boat may be on, as docks and buoys.
        water: a place [m] in the water that is meant, or near it.
        middle: where the middle of the boats is to be [m]; None: where it is.
    """
    outlines = shapely.buffer(shapely.polygons(corners), _FLEET_MARGIN, join_style="mitre")
    pairs = shapely.STRtree(shapely.polygons(corners)).query(shapely.polygons(corners), predicate="intersects")
    if pairs.shape[1] > len(corners):
        return None  # boats are on one another wherever they are
    inside = _water(water, land)
    shapely.prepare(inside)
    shapely.prepare(taken)
    own = _rotate(shapely.get_coordinates(outlines) - frame[:2], -frame[2])
    centre = _rotate(corners.reshape(-1, 2) - frame[:2], -frame[2]).mean(axis=0)
    goal = np.array(frame[:2]) + _rotate(centre, frame[2]) if middle is None else np.array(middle)
    around = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(own)))
    for turn in _TURNS:
        yaw = round(math.remainder(frame[2] + turn * math.pi / 4, 2 * math.pi), 2)
        boats, hull = _rotate(own, yaw).reshape(len(corners), -1, 2), _rotate(around, yaw)
        for places in _places(goal - _rotate(centre, yaw)):
            roomy = places[shapely.contains(inside, shapely.polygons(hull + places[:, None]))]
            for place in roomy:
                if not shapely.intersects(taken, shapely.polygons(boats + place)).any():
                    return float(place[0]), float(place[1]), yaw
    return None


def _water(near: _Place, land: _Area) -> _Area:
    """The connected water at a place, or nearest to it."""
    x, y = near
    waters = shapely.get_parts(shapely.difference(shapely.box(x - _RANGE, y - _RANGE, x + _RANGE, y + _RANGE), land))
    if len(waters) == 0:
        return shapely.Polygon()
    return waters[int(np.argmin(shapely.distance(waters, shapely.Point(near))))]


def _rotate(points: FloatArray, angle: float) -> FloatArray:
    cos, sin = math.cos(angle), math.sin(angle)
    turned: FloatArray = points @ np.array([[cos, sin], [-sin, cos]])
    return turned


def _places(near: FloatArray) -> Iterator[FloatArray]:
    """Places (n, 2) [m] around one, the nearest first."""
    reach = np.arange(-FARTHEST_ORIGIN, FARTHEST_ORIGIN + _ORIGIN_STEP / 2, _ORIGIN_STEP)
    grid = np.stack(np.meshgrid(np.round(near[0]) + reach, np.round(near[1]) + reach), axis=-1).reshape(-1, 2)
    distance = np.hypot(*(grid - near).T)
    order = np.argsort(distance, kind="stable")
    grid = grid[order[: int(np.count_nonzero(distance <= FARTHEST_ORIGIN))]]
    return iter(np.array_split(grid, math.ceil(len(grid) / _ORIGIN_CHUNK)))


class _Thing(NamedTuple):
    """Land or a dock."""

    on: str
    inside: str
    area: _Area


def boats_afloat(
    config: WorldConfig,
    fleet: FleetConfig,
    docks: Sequence[PlacedDock],
    objects: Sequence[PlacedObject],
    built: Callable[[BoatConfig], Boat],
    *,
    nudge: bool,
) -> tuple[BoatConfig, ...]:
    """The boats of a fleet in a world, none of them on land, on a dock or on another.

    With `nudge` those that are get the nearest free place, each with a warning; free ones stay where they are.
    Without a fleet a world's spawn pose on land or on a dock is warned of, and stays.

    Raises:
        ConfigError: some are, and `nudge` is not asked for or finds no place; with the place in the file of each.
    """
    located = fleet.boats_in(config)
    boats = [boat for boat, _ in located]
    areas = _areas(boats, built)
    things = _things(config, docks)
    found = _faults(boats, areas, things)
    buoys = shapely.buffer(shapely.points([item.pose[:2] for item in objects]), _CLEARANCE) if objects else []
    if far := far_from_all(fleet, located, config):
        spawn = config.spawn.pose[:2]
        better = _better_origin(fleet.frame(config), areas, things, buoys, water=spawn, middle=spawn)
        warn(f"{far}; {better or 'give it another origin'}", 4)
    if found and nudge:
        places = _free_places(areas, found, things, buoys)
        boats = [_move_boat(boat, places[i], found[i]) if places.get(i) else boat for i, boat in enumerate(boats)]
        found = {i: text for i, text in found.items() if places[i] is None}
    if found and fleet.is_empty:
        warn(f"world {config.name}: {found[0]}, at the spawn pose", 4)
    elif found:
        advice = f"no free place within {_MAX_SHIFT:g} m" if nudge else _ADVICE
        texts = {i: f"{found[i]}; {advice}" for i in sorted(found)}
        if len(boats) > 1 and (fleet.layout or fleet.origin != "world"):
            frame = fleet.frame(config)
            better = _better_origin(frame, areas, things, buoys, water=frame[:2])
            texts[min(texts)] += f"; {better}" if better else ""
        raise ConfigError([problem_at(fleet.section, located[i][1].where, text) for i, text in texts.items()])
    return tuple(boats)


def _better_origin(
    frame: _Frame,
    areas: FloatArray,
    things: Sequence[_Thing],
    buoys: Sequence[_Area],
    *,
    water: _Place,
    middle: _Place | None = None,
) -> str:
    """The origin that `free_origin` finds, as advice; empty without one."""
    land = next((thing.area for thing in things if thing.on == _LAND), shapely.Polygon())
    taken = shapely.union_all([*(thing.area for thing in things if thing.on != _LAND), *buoys])
    corners = np.array([shapely.get_coordinates(area)[:4] for area in areas])
    origin = free_origin(corners, frame, land, taken, water=water, middle=middle)
    if origin is None:
        return ""
    x, y, yaw = origin
    return f"`origin: [{x:g}, {y:g}, {yaw:g}]` moves the whole fleet to free water"


def depth_in_land(corners: FloatArray, pose: Pose, shore: Sequence[Sequence[Sequence[float]]]) -> float:
    """How far [m] from the shore, rings of points (x, y), a boat of an outline would be on land; 0 in free water."""
    area, land = shapely.Polygon(_corners_at(corners, pose)), area_of(shore)
    return _depth(area, land) if shapely.intersects(area, land) else 0.0


def _areas(boats: Sequence[BoatConfig], built: Callable[[BoatConfig], Boat]) -> FloatArray:
    """Rectangles of the boats, (n,) polygons; boats of one kind have one size."""
    sizes: dict[Order, FloatArray] = {}
    corners = np.empty((len(boats), 4, 2))
    for index, boat in enumerate(boats):
        if boat.order not in sizes:
            sizes[boat.order] = outline(built(boat))
        corners[index] = _corners_at(sizes[boat.order], boat.pose)
    return np.asarray(shapely.polygons(corners))


def _corners_at(corners: FloatArray, pose: Pose) -> FloatArray:
    return _rotate(corners, pose[5]) + pose[:2]


def outline(boat: Boat) -> FloatArray:
    """Corners (4, 2) of a boat seen from above, in its own axes [m]; a small square if nobody knows its shape."""
    try:
        (back, right, _), (front, left, _) = boat_box(boat)
    except VrxError:
        back = right = front = left = 0.0
    half = _MIN_SIZE / 2
    back, front, right, left = min(back, -half), max(front, half), min(right, -half), max(left, half)
    return np.array([(front, left), (back, left), (back, right), (front, right)])


def _things(config: WorldConfig, docks: Sequence[PlacedDock]) -> list[_Thing]:
    found = []
    if config.terrain:
        land = land_area(config.terrain, config.folder)
        found.append(_Thing(_LAND, f"the shore of {config.terrain}", land))
    for dock in docks:
        blocks = shapely.union_all(shapely.polygons(block_corners(dock)))
        found.append(_Thing(f"the dock '{dock.name}'", "it", blocks))
    for thing in found:
        shapely.prepare(thing.area)
    return found


def _faults(boats: Sequence[BoatConfig], areas: FloatArray, things: Sequence[_Thing]) -> dict[int, str]:
    """Faults by the number of the boat; of boats on one another the first stays."""
    found: dict[int, str] = {}
    for thing in things:
        for i in np.flatnonzero(shapely.intersects(areas, thing.area)).tolist():
            depth = _depth(areas[i], thing.area)
            found.setdefault(i, f"'{boats[i].name}' is on {thing.on}, {depth:.2f} m inside {thing.inside}")
    pairs = shapely.STRtree(areas).query(areas, predicate="intersects").T.tolist()
    for later, earlier in sorted(pair for pair in pairs if pair[1] < pair[0]):
        if later in found or earlier in found:
            continue
        apart = math.dist(boats[later].pose[:2], boats[earlier].pose[:2])
        text = f"{_depth(areas[later], areas[earlier]):.2f} m inside it, with {apart:.2f} m between their origins"
        found[later] = f"'{boats[later].name}' is on '{boats[earlier].name}', {text}"
    return found


def _depth(area: _Area, thing: _Area) -> float:
    """Distance [m] from the edge of a thing to the farthest point of a boat inside of it, on a lattice of 9 x 5."""
    a, b, _, d = shapely.get_coordinates(area)[:4]
    along, across = np.meshgrid(np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 5))
    lattice = shapely.points(a + along.reshape(-1, 1) * (b - a) + across.reshape(-1, 1) * (d - a))
    meeting = shapely.points(shapely.get_coordinates(shapely.intersection(area, thing)))
    inside = np.concatenate([lattice[shapely.intersects(thing, lattice)], meeting])
    return float(np.max(shapely.distance(inside, shapely.boundary(thing)), initial=0.0))


def _free_places(
    areas: FloatArray, found: Mapping[int, str], things: Sequence[_Thing], buoys: Sequence[_Area]
) -> dict[int, tuple[float, float] | None]:  # fmt: skip
    """Displacement (x, y) [m] that brings each boat at fault into free water, in their order; None without room."""
    taken = [*(area for i, area in enumerate(areas) if i not in found), *buoys]
    moves: dict[int, tuple[float, float] | None] = {}
    for i in sorted(found):
        moves[i] = move = _free_place(areas[i], things, shapely.STRtree(taken))
        taken.append(areas[i] if move is None else shapely.transform(areas[i], lambda points, by=move: points + by))
    return moves


def _free_place(area: _Area, things: Sequence[_Thing], taken: shapely.STRtree) -> tuple[float, float] | None:
    """The least move [m] that brings a boat into free water, with some around it."""
    outline = shapely.get_coordinates(shapely.buffer(area, _MARGIN, join_style="mitre"))
    for moves in _moves():
        places = shapely.polygons(outline + moves[:, None])
        free = np.ones(len(moves), np.bool_)
        for thing in things:
            free &= ~shapely.intersects(places, thing.area)
        free[taken.query(places, predicate="intersects")[0]] = False
        if free.any():
            x, y = moves[np.argmax(free)].tolist()
            return x, y
    return None


@functools.cache
def _moves() -> tuple[FloatArray, ...]:
    """The moves that are tried (n, 2) [m], the least first, in groups of about `_PLACE_CHUNK`."""
    rings = []
    for distance in np.arange(_PLACE_STEP, _MAX_SHIFT + _PLACE_STEP / 2, _PLACE_STEP):
        count = min(math.ceil(2 * math.pi * distance / _PLACE_STEP), _MAX_DIRECTIONS)
        angles = 2 * math.pi * np.arange(count) / count
        rings.append(distance * np.column_stack([np.cos(angles), np.sin(angles)]))
    moves = np.concatenate(rings)
    return tuple(np.array_split(moves, len(moves) // _PLACE_CHUNK))


def _move_boat(boat: BoatConfig, move: tuple[float, float] | None, fault: str) -> BoatConfig:
    assert move is not None, "asked for"
    x, y = boat.pose[0] + move[0], boat.pose[1] + move[1]
    text = f"'{boat.name}' moved {math.hypot(*move):.2f} m to x {x:.2f}, y {y:.2f}: it was {fault.partition(' is ')[2]}"
    warn(text, 5)
    return boat.model_copy(update={"pose": (x, y, *boat.pose[2:])})
