"""Guidance: where to go and how fast, as pure functions of places."""

import math
from collections.abc import Sequence
from itertools import permutations

__all__ = ["Point", "approach_speed", "around", "best_order", "clear_of", "orbit", "wrapped"]

Point = tuple[float, float]
"""East and north [m]."""
BRUTE = 7
"""So many places are put in order by trying all orders."""
MARGIN = 0.1
"""Beyond the rim of a disc [m]."""


def wrapped(angle: float) -> float:
    """The angle [rad] within half a turn either way."""
    return math.remainder(angle, math.tau)


def approach_speed(distance: float, rate: float, braking: float) -> float:
    """The speed [m/s] at a distance [m] from where the boat is to stop.

    Near by it is proportional to the distance, `rate` [1/s]; from where that would be braking harder than `braking`
    [m/s2], it is the speed that braking evenly brings to nothing.
    """
    if distance <= braking / rate**2:
        return rate * distance
    return math.sqrt(braking * (2.0 * distance - braking / rate**2))


def orbit(offset: Point, radius: float, sense: float, width: float) -> Point:
    """The direction, a unit vector, that leads from `offset` [m] from a centre into a circle around it and along it.

    `sense` 1 goes counter-clockwise, -1 clockwise. A vector field: `width` [m] off the circle the course is 45 degrees
    towards it (Nelson et al., Vector field path following for miniature air vehicles, 2007).
    """
    away = math.hypot(*offset)
    out = (offset[0] / away, offset[1] / away) if away > 1e-9 else (1.0, 0.0)
    along = (-sense * out[1], sense * out[0])
    inward = math.atan((away - radius) / width)
    cos, sin = math.cos(inward), math.sin(inward)
    return along[0] * cos - out[0] * sin, along[1] * cos - out[1] * sin


def around(start: Point, goal: Point, discs: Sequence[tuple[Point, float]]) -> Point:
    """Where to steer for from `start` on the way to `goal`, clear of discs, given by centre and radius [m].

    The first disc in the way is passed along its tangent, on the side that is nearer; who is inside goes straight out.
    """
    gap = (goal[0] - start[0], goal[1] - start[1])
    length = math.hypot(*gap)
    if length < 1e-9:
        return goal
    ahead = (gap[0] / length, gap[1] / length)
    found = [(_entry(start, ahead, length, centre, radius), centre, radius) for centre, radius in discs]
    hits = [(entry, centre, radius) for entry, centre, radius in found if entry is not None]
    if not hits:
        return goal
    _, centre, radius = min(hits)
    return _tangent(start, ahead, centre, radius)


def clear_of(place: Point, discs: Sequence[tuple[Point, float]]) -> Point:
    """The place, or where discs of a centre and a radius [m] leave off that it lies in, straight out of each."""
    for centre, radius in discs:
        dx, dy = place[0] - centre[0], place[1] - centre[1]
        away = math.hypot(dx, dy)
        if away < radius:
            east, north = (dx / away, dy / away) if away > 1e-9 else (1.0, 0.0)
            place = (centre[0] + (radius + MARGIN) * east, centre[1] + (radius + MARGIN) * north)
    return place


def best_order(start: Point, places: Sequence[Point]) -> list[int]:
    """The order that makes the way from `start` through all places shortest; of many places, the nearest is next."""
    if len(places) <= BRUTE:
        orders = permutations(range(len(places)))
        return list(min(orders, key=lambda order: _length(start, [places[number] for number in order])))
    left, order, here = set(range(len(places))), [], start
    while left:
        nearest = min(sorted(left), key=lambda number: math.dist(here, places[number]))
        left.remove(nearest)
        order.append(nearest)
        here = places[nearest]
    return order


def _length(start: Point, places: Sequence[Point]) -> float:
    return sum(math.dist(one, other) for one, other in zip([start, *places], places, strict=False))


def _entry(start: Point, ahead: Point, length: float, centre: Point, radius: float) -> float | None:
    """How far along the way [m] a disc is entered; None if it is not in the way."""
    dx, dy = centre[0] - start[0], centre[1] - start[1]
    along, across = dx * ahead[0] + dy * ahead[1], ahead[0] * dy - ahead[1] * dx
    if abs(across) >= radius:
        return None
    half = math.sqrt(radius * radius - across * across)
    if along + half <= 0.0 or along - half >= length:
        return None
    return along - half


def _tangent(start: Point, ahead: Point, centre: Point, radius: float) -> Point:
    """A place on the tangent from `start` to a disc, level with its centre; from inside it, straight out."""
    dx, dy = centre[0] - start[0], centre[1] - start[1]
    away = math.hypot(dx, dy)
    if away <= radius:
        scale = radius / max(away, 1e-9)
        return start[0] - dx * scale, start[1] - dy * scale
    side = 1.0 if ahead[0] * dy - ahead[1] * dx < 0.0 else -1.0  # a centre to starboard is passed to port of it
    turn = math.atan2(dy, dx) + side * math.asin(radius / away)
    reach = math.sqrt(away * away - radius * radius)
    return start[0] + reach * math.cos(turn), start[1] + reach * math.sin(turn)
