"""What the water's surface does to a hull of several floats, as VRX has it.

Each float is a half cylinder, cut into stations of equal length. A station feels the water's height
above itself: how much of its section is under water gives an upward force and nothing else, so waves
push a boat only through differences between its stations. VRX classic puts its stations where their pieces of
the float are; VRX 3 lists points, which need not be in the middle of anything.
"""

import math

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Wrench, rotate
from vrx_mj.physics.tables import OwnWaves, Record, Table, Waves
from vrx_mj.physics.waves import elevations, ramp


@kernel
def section_area(radius: float, depth: float) -> float:
    """Return the area [m2] of a circle's segment of height `depth` [m], 0 at least and `radius` at most.

    A = R^2 acos((R - h) / R) - (R - h) sqrt(2 R h - h^2); half the arc cosine is asin(sqrt(h / 2 R)),
    which keeps what is small.
    """
    if depth <= 0.0:
        return 0.0
    if depth >= radius:
        return 0.5 * math.pi * radius * radius
    share = depth / (2.0 * radius)
    half_chord = 2.0 * radius * math.sqrt(share * (1.0 - share))
    return 2.0 * radius * radius * math.asin(math.sqrt(share)) - (radius - depth) * half_chord


@kernel
def station_force(hull: Record, station: Record, depth: float) -> float:
    """Return the upward force [N] on one station whose keel is `depth` [m] under water.

    Its gravity is `hull.gravity`: in VRX classic 9.815 m/s2, and not the world's 9.8 m/s2.
    """
    per_area = station.length * hull.gravity * hull.density
    return float(section_area(station.radius, depth) * per_area)


@kernel
def hydrostatics(
    hull: Record, stations: Table, waves: Waves, sea: Record, motion: Motion, t: float, own: OwnWaves = None
) -> Wrench:
    """Return the water's lift on the hull: world axes, about `hull.link_com`, at time `t` [s].

    Each station samples the sea where it is in the world. VRX's quirk is kept: a station sits at b from the
    link's origin, and there its depth is taken, but its force acts at b from the link's centre of mass.
    """
    grown = ramp(sea, t)
    mean = sea.level + hull.level - motion.z
    fz, tx, ty = 0.0, 0.0, 0.0
    last = hull.station_start + hull.station_count - 1
    for first in range(hull.station_start, last + 1, 4):
        arms = (
            rotate(motion, stations[first].position), rotate(motion, stations[min(first + 1, last)].position),
            rotate(motion, stations[min(first + 2, last)].position),
            rotate(motion, stations[min(first + 3, last)].position),
        )  # fmt: skip
        heights = elevations(waves, motion.x, motion.y, arms, t, own)
        for k in range(min(4, last + 1 - first)):
            lx, ly, lz = arms[k]
            force = station_force(hull, stations[first + k], mean + grown * heights[k] - lz)
            fz += force
            tx += ly * force
            ty -= lx * force
    return Wrench(0.0, 0.0, fz, tx, ty, 0.0)


@kernel
def greatest_lift(hull: Record, stations: Table) -> float:
    """Return the greatest force [N] with which the water can carry a hull: that of all stations wholly under water."""
    area = 0.0
    for i in range(hull.station_start, hull.station_start + hull.station_count):
        area += section_area(stations[i].radius, stations[i].radius) * stations[i].length
    return float(area * hull.gravity * hull.density)
