"""Steering clear of buoys: the course nearest to the wanted one that passes them at a distance.

Courses are tried every few degrees, and each is charged for what it passes too near, the more the nearer that is (a
polar histogram without the grid: Borenstein and Koren, The vector field histogram, 1991).
"""

import math
from collections.abc import Sequence

from vrx_mj.control.guidance import Point

__all__ = ["clear_course"]

STEP = math.radians(5.0)
"""Between the courses tried [rad]."""
MOST = 26
"""So many steps to either side are tried: 130 degrees."""
CHARGE = 6.0
"""What it costs to go straight through something near, in radians of turning away."""
AGAIN = 0.15
"""Bonus [rad] of keeping to the side that was chosen before, so that the boat does not waver in front of a buoy."""


def clear_course(
    here: Point, wanted: float, discs: Sequence[tuple[Point, float]], *, reach: float, before: float | None = None
) -> float:
    """The course [rad] to steer from `here` for a wanted one, past discs of centre and radius [m].

    Discs whose centre is further off than `reach` [m] are left for later. `before` is what was steered last.
    """
    near = [(centre, radius) for centre, radius in discs if math.dist(here, centre) < reach + radius]
    if not near:
        return wanted

    def cost(step: int) -> float:
        course = wanted + step * STEP
        charge = sum(_charge(here, course, centre, radius, reach) for centre, radius in near)
        kept = before is None or abs(math.remainder(course - before, math.tau)) < 2.5 * STEP
        return abs(step) * STEP + charge + (0.0 if kept else AGAIN)

    best = min(sorted(range(-MOST, MOST + 1), key=abs), key=cost)
    return math.remainder(wanted + best * STEP, math.tau)


def _charge(here: Point, course: float, centre: Point, radius: float, reach: float) -> float:
    """What passing a disc on a course costs [rad]: nothing outside of it, most through the middle of what is near."""
    east, north = centre[0] - here[0], centre[1] - here[1]
    along = east * math.cos(course) + north * math.sin(course)
    across = abs(north * math.cos(course) - east * math.sin(course))
    if along <= 0.0 or across >= radius:
        return 0.0
    nearness = max(0.0, 1.0 - max(0.0, along - radius) / reach)
    return CHARGE * (0.15 + 0.85 * nearness) * (1.0 - across / radius)
