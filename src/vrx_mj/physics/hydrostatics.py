"""What the water's surface does to a hull of two floats, as VRX has it.

Each float is a half cylinder, cut into stations of equal length. A station feels the water's height
above itself: how much of its section is under water gives an upward force and nothing else, so waves
push a boat only through differences between its stations.
"""

import math

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Wrench, rotate
from vrx_mj.physics.phasor import phasor
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import ramp

__all__ = ["hydrostatics", "section_area", "station_force", "station_heights"]


@kernel
def section_area(radius: float, depth: float) -> float:
    """Return the area [m2] of a circle's segment of height `depth` [m], 0 at least and `radius` at most.

    A = R^2 acos((R - h) / R) - (R - h) sqrt(2 R h - h^2).
    """
    h = min(max(depth, 0.0), radius)
    above = radius - h
    return radius * radius * math.acos(above / radius) - above * math.sqrt(h * (2.0 * radius - h))


@kernel
def station_force(hull: Record, depth: float) -> float:
    """Return the upward force [N] on one station whose keel is `depth` [m] under water.

    Its gravity is `hull.gravity`, VRX's 9.815 m/s2, and not the world's 9.8 m/s2.
    """
    if depth <= 0.0:
        return 0.0
    per_area = hull.length / hull.stations * hull.gravity * hull.density
    return float(section_area(hull.radius, depth) * per_area)


@kernel
def station_heights(
    hull: Record, waves: Table, motion: Motion, t: float, first: int
) -> tuple[float, float, float, float]:
    """Return the elevation [m] of the grown sea at two neighbouring stations of each float.

    Order: starboard `first`, starboard `first` + 1, port `first`, port `first` + 1. Stations are
    sampled where they are in the world. A wave's phase grows by a constant along a float, and by
    another from one float to the other, so three phasors serve the four points.
    """
    spacing = hull.length / hull.stations
    bx, by = (first + 0.5) * spacing - 0.5 * hull.length, -0.5 * hull.beam
    x = motion.x + motion.r00 * bx + motion.r01 * by
    y = motion.y + motion.r10 * bx + motion.r11 * by
    near, next_, far, far_next = 0.0, 0.0, 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        a, k, dx, dy = wave.amplitude, wave.wavenumber, wave.direction[0], wave.direction[1]
        c, s = phasor(k * (dx * x + dy * y) - wave.frequency * t)
        along_c, along_s = phasor(k * (dx * motion.r00 + dy * motion.r10) * spacing)
        across_c, across_s = phasor(k * (dx * motion.r01 + dy * motion.r11) * hull.beam)
        near += a * c
        next_ += a * (c * along_c - s * along_s)
        c, s = c * across_c - s * across_s, s * across_c + c * across_s
        far += a * c
        far_next += a * (c * along_c - s * along_s)
    return near, next_, far, far_next


@kernel
def hydrostatics(hull: Record, waves: Table, sea: Record, motion: Motion, t: float) -> Wrench:
    """Return the water's lift on the hull: world axes, about `hull.link_com`, at time `t` [s].

    VRX's quirk is kept: a station sits at b from the link's origin, and there its depth is taken,
    but its force acts at b from the link's centre of mass.
    """
    spacing = hull.length / hull.stations
    grown = ramp(sea, t)
    mean = sea.level + hull.level - motion.z
    fz, tx, ty = 0.0, 0.0, 0.0
    for first in range(0, hull.stations, 2):
        heights = station_heights(hull, waves, motion, t, first)
        for corner in range(4):
            station = first + corner % 2
            if station < hull.stations:
                bx = (station + 0.5) * spacing - 0.5 * hull.length
                by = (corner // 2 - 0.5) * hull.beam
                lx, ly, lz = rotate(motion, bx, by, 0.0)
                force = station_force(hull, mean + grown * heights[corner] - lz)
                fz += force
                tx += ly * force
                ty -= lx * force
    return Wrench(0.0, 0.0, fz, tx, ty, 0.0)
