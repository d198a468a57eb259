"""How a hull floats at rest: the height, roll and pitch at which the water carries its weight.

They follow from the force that the run's loop takes, that of a hull's stations (`hydrostatics`) or of the model of its
own (`vessel`), at one moment, on the waves as they are then; wind, drag and thrust are left out. Three equations, of
heave, roll and pitch, are solved by Newton's method with differences for derivatives. Steps are limited, and a hull
that is too far in or out of the water for a derivative is moved by the largest step.
"""

import math

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.hydrostatics import hydrostatics
from vrx_mj.physics.kernel import allocating_kernel, kernel
from vrx_mj.physics.motion import Motion, Vector, minus, motion_at_rest, rotate, turned_rows
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.vessel import HullMeshes, VesselWork, pressure_on_vessel, vessel_work

_STEPS = 100
"""Most steps of Newton's method."""
_RISE, _TURN = 0.05, 0.02
"""Longest step [m], [rad]: a longer one could turn a laden boat so far that an end goes under."""
_SMALL = 1e-6
"""Difference for derivatives [m], [rad]."""
_EXACT = 1e-9
"""Share of the weight, and of the weight times 1 m, up to which the equations must hold."""


@kernel
def at_rest(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> Motion:
    """Return the motion of a link at rest in a pose: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    return motion_at_rest((x, y, z), turned_rows((roll, pitch, yaw)))


@kernel
def _excess(
    hull: Record, stations: Table, vessels: Table, meshes: HullMeshes | None, work: VesselWork | None, waves: Table,
    sea: Record, weight: float, com: FloatArray, pose: FloatArray, t: float,
) -> Vector:  # fmt: skip
    """Return lift less weight [N], and their torques [N m] about the boat's x and y in the horizontal plane."""
    body = at_rest(pose[0], pose[1], pose[2], pose[3], pose[4], pose[5])
    if meshes is None or work is None:
        lift = hydrostatics(hull, stations, waves, sea, body, t)
    else:
        lift = pressure_on_vessel(hull, vessels[hull.vessel], meshes, waves, sea, body, t, work)
    lx, ly, lz = rotate(body, minus(com, hull.link_com))
    tx, ty = lift.tx - ly * weight + lz * lift.fy, lift.ty + lx * weight - lz * lift.fx
    cos, sin = math.cos(pose[5]), math.sin(pose[5])
    return lift.fz - weight, cos * tx + sin * ty, cos * ty - sin * tx


@kernel
def _excess_slope(
    hull: Record, stations: Table, vessels: Table, meshes: HullMeshes | None, work: VesselWork | None, waves: Table,
    sea: Record, weight: float, com: FloatArray, pose: FloatArray, t: float, axis: int, now: Vector,
) -> Vector:  # fmt: skip
    """Return how `_excess`, which is `now`, changes with an axis of the pose."""
    pose[axis] += _SMALL
    beside = minus(_excess(hull, stations, vessels, meshes, work, waves, sea, weight, com, pose, t), now)
    pose[axis] -= _SMALL
    return beside[0] / _SMALL, beside[1] / _SMALL, beside[2] / _SMALL


@kernel
def _determinant(a: Vector, b: Vector, c: Vector) -> float:
    """Return the determinant of three columns."""
    return a[0] * (b[1] * c[2] - c[1] * b[2]) - b[0] * (a[1] * c[2] - c[1] * a[2]) + c[0] * (a[1] * b[2] - b[1] * a[2])


@allocating_kernel
def settle(
    hull: Record, stations: Table, vessels: Table, meshes: HullMeshes | None, waves: Table, sea: Record, weight: float,
    com: FloatArray, pose: FloatArray, t: float,
) -> bool:  # fmt: skip
    """Write the height, roll and pitch with which a hull floats at rest at time `t` [s] into `pose`.

    Args:
        hull: a row of `tables.HULL`.
        stations: `tables.STATION`.
        vessels: `tables.VESSEL`.
        meshes: of all vessels; None for a hull that floats on stations.
        waves: `tables.WAVE`.
        sea: a row of `tables.SEA`.
        weight: of the boat [N].
        com: its centre of mass (3,) [m], body axes from the link's origin.
        pose: (6,), of which x, y and yaw are kept, and height, roll and pitch are the first guess.
        t: time [s].

    Returns whether it floats.
    """
    work = None if meshes is None else vessel_work(meshes, waves, sea)
    for _ in range(_STEPS):
        now = _excess(hull, stations, vessels, meshes, work, waves, sea, weight, com, pose, t)
        if max(abs(now[0]), abs(now[1]), abs(now[2])) < _EXACT * weight:
            return True
        up = _excess_slope(hull, stations, vessels, meshes, work, waves, sea, weight, com, pose, t, 2, now)
        roll = _excess_slope(hull, stations, vessels, meshes, work, waves, sea, weight, com, pose, t, 3, now)
        pitch = _excess_slope(hull, stations, vessels, meshes, work, waves, sea, weight, com, pose, t, 4, now)
        whole = _determinant(up, roll, pitch)
        if up[0] > -1e-3 * weight or abs(whole) < 1e-12 * weight**3:  # in the air, or wholly under water
            pose[2] += _RISE if now[0] > 0.0 else -_RISE
            continue
        pose[2] += min(max(-_determinant(now, roll, pitch) / whole, -_RISE), _RISE)
        pose[3] += min(max(-_determinant(up, now, pitch) / whole, -_TURN), _TURN)
        pose[4] += min(max(-_determinant(up, roll, now) / whole, -_TURN), _TURN)
    return False
