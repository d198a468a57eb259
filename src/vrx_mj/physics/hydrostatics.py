"""What the water's surface does to a hull of several floats, as VRX has it.

Each float is a half cylinder, cut into stations of equal length. A station feels the water's height
above itself: how much of its section is under water gives an upward force and nothing else, so waves
push a boat only through differences between its stations. VRX classic puts its stations where their pieces of
the float are; VRX 3 lists points, which need not be in the middle of anything.

How a hull floats at rest, the height, roll and pitch at which the water carries its weight, follows from the same lift
at one moment, on the waves as they are then; wind, drag and thrust are left out. Three equations, of heave, roll and
pitch, are solved by Newton's method with differences for derivatives. Steps are limited, and a hull that is too far in
or out of the water for a derivative is moved by the largest step.
"""

import math

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Vector, Wrench, minus, motion_at_rest, rotate, turned_rows
from vrx_mj.physics.tables import OwnWaves, Record, Table, Waves
from vrx_mj.physics.waves import elevations, ramp

_STEPS = 100
"""Most steps of Newton's method."""
_RISE, _TURN = 0.05, 0.02
"""Longest step [m], [rad]: a longer one could turn a laden boat so far that an end goes under."""
_SMALL = 1e-6
"""Difference for derivatives [m], [rad]."""
_EXACT = 1e-9
"""Share of the weight, and of the weight times 1 m, up to which the equations must hold."""


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


@kernel
def at_rest(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> Motion:
    """Return the motion of a link at rest in a pose: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    return motion_at_rest((x, y, z), turned_rows((roll, pitch, yaw)))


@kernel
def _excess(
    hull: Record, stations: Table, waves: Table, sea: Record, weight: float, com: FloatArray, pose: FloatArray, t: float
) -> Vector:
    """Return lift less weight [N], and their torques [N m] about the boat's x and y in the horizontal plane."""
    body = at_rest(pose[0], pose[1], pose[2], pose[3], pose[4], pose[5])
    lift = hydrostatics(hull, stations, waves, sea, body, t)
    lx, ly, _ = rotate(body, minus(com, hull.link_com))
    tx, ty = lift.tx - ly * weight, lift.ty + lx * weight
    cos, sin = math.cos(pose[5]), math.sin(pose[5])
    return lift.fz - weight, cos * tx + sin * ty, cos * ty - sin * tx


@kernel
def _excess_slope(
    hull: Record, stations: Table, waves: Table, sea: Record, weight: float, com: FloatArray, pose: FloatArray,
    t: float, axis: int, now: Vector,
) -> Vector:  # fmt: skip
    """Return how `_excess`, which is `now`, changes with an axis of the pose."""
    pose[axis] += _SMALL
    beside = minus(_excess(hull, stations, waves, sea, weight, com, pose, t), now)
    pose[axis] -= _SMALL
    return beside[0] / _SMALL, beside[1] / _SMALL, beside[2] / _SMALL


@kernel
def _determinant(a: Vector, b: Vector, c: Vector) -> float:
    """Return the determinant of three columns."""
    return a[0] * (b[1] * c[2] - c[1] * b[2]) - b[0] * (a[1] * c[2] - c[1] * a[2]) + c[0] * (a[1] * b[2] - b[1] * a[2])


@kernel
def settle(
    hull: Record, stations: Table, waves: Table, sea: Record, weight: float, com: FloatArray, pose: FloatArray, t: float
) -> bool:
    """Write the height, roll and pitch with which a hull floats at rest at time `t` [s] into `pose`.

    Args:
        hull: a row of `tables.HULL`.
        stations: `tables.STATION`.
        waves: `tables.WAVE`.
        sea: a row of `tables.SEA`.
        weight: of the boat [N].
        com: its centre of mass (3,) [m], body axes from the link's origin.
        pose: (6,), of which x, y and yaw are kept, and height, roll and pitch are the first guess.
        t: time [s].

    Returns whether it floats.
    """
    for _ in range(_STEPS):
        now = _excess(hull, stations, waves, sea, weight, com, pose, t)
        if max(abs(now[0]), abs(now[1]), abs(now[2])) < _EXACT * weight:
            return True
        up = _excess_slope(hull, stations, waves, sea, weight, com, pose, t, 2, now)
        roll = _excess_slope(hull, stations, waves, sea, weight, com, pose, t, 3, now)
        pitch = _excess_slope(hull, stations, waves, sea, weight, com, pose, t, 4, now)
        whole = _determinant(up, roll, pitch)
        if up[0] > -1e-3 * weight or abs(whole) < 1e-12 * weight**3:  # in the air, or wholly under water
            pose[2] += _RISE if now[0] > 0.0 else -_RISE
            continue
        pose[2] += min(max(-_determinant(now, roll, pitch) / whole, -_RISE), _RISE)
        pose[3] += min(max(-_determinant(up, now, pitch) / whole, -_TURN), _TURN)
        pose[4] += min(max(-_determinant(up, roll, now) / whole, -_TURN), _TURN)
    return False
