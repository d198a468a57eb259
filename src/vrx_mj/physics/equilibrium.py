"""How a hull floats at rest: the height, roll and pitch at which the water carries its weight.

The lift is that of `hydrostatics` at one moment, on the waves as they stand then; wind, drag and thrust are left out.
Three equations, of heave, roll and pitch, are solved by Newton's method with differences for derivatives. Steps are
limited, and a hull that is too far in or out of the water for a derivative is moved by the largest step.
"""

import math

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.hydrostatics import hydrostatics, section_area
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Vector, rotate
from vrx_mj.physics.tables import Record, Table

__all__ = ["at_rest", "greatest_lift", "settle"]

STEPS = 100
"""Of Newton's method, at most."""
RISE, TURN = 0.05, 0.02
"""Of one step, at most [m], [rad]: a longer one could turn a laden boat so far that an end goes under."""
SMALL = 1e-6
"""Difference for derivatives [m], [rad]."""
EXACT = 1e-9
"""Share of the weight, and of the weight times 1 m, up to which the equations must hold."""


@kernel
def greatest_lift(hull: Record, stations: Table) -> float:
    """Return the greatest force [N] with which the water can carry a hull: that of all stations wholly under water."""
    area = 0.0
    for i in range(hull.station_start, hull.station_start + hull.station_count):
        area += section_area(stations[i].radius, stations[i].radius) * stations[i].length
    return float(area * hull.gravity * hull.density)


@kernel
def at_rest(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> Motion:
    """Return the motion of a link that stands still in a pose: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return Motion(
        x, y, z, cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,
        sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, -sp, cp * sr, cp * cr,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip


@kernel
def _excess(
    hull: Record, stations: Table, waves: Table, sea: Record, weight: float, com: FloatArray, pose: FloatArray, t: float
) -> Vector:
    """Return lift less weight [N], and their torques [N m] about the boat's x and y in the horizontal plane."""
    body = at_rest(pose[0], pose[1], pose[2], pose[3], pose[4], pose[5])
    lift = hydrostatics(hull, stations, waves, sea, body, t)
    point = hull.link_com
    lx, ly, _ = rotate(body, com[0] - point[0], com[1] - point[1], com[2] - point[2])
    tx, ty = lift.tx - ly * weight, lift.ty + lx * weight
    cos, sin = math.cos(pose[5]), math.sin(pose[5])
    return lift.fz - weight, cos * tx + sin * ty, cos * ty - sin * tx


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
    for _ in range(STEPS):
        f, m, n = _excess(hull, stations, waves, sea, weight, com, pose, t)
        if abs(f) < EXACT * weight and abs(m) < EXACT * weight and abs(n) < EXACT * weight:
            return True
        pose[2] += SMALL
        fz, mz, nz = _excess(hull, stations, waves, sea, weight, com, pose, t)
        pose[2] -= SMALL
        pose[3] += SMALL
        fr, mr, nr = _excess(hull, stations, waves, sea, weight, com, pose, t)
        pose[3] -= SMALL
        pose[4] += SMALL
        fp, mp, np_ = _excess(hull, stations, waves, sea, weight, com, pose, t)
        pose[4] -= SMALL
        fz, mz, nz = (fz - f) / SMALL, (mz - m) / SMALL, (nz - n) / SMALL
        fr, mr, nr = (fr - f) / SMALL, (mr - m) / SMALL, (nr - n) / SMALL
        fp, mp, np_ = (fp - f) / SMALL, (mp - m) / SMALL, (np_ - n) / SMALL
        det = fz * (mr * np_ - mp * nr) - fr * (mz * np_ - mp * nz) + fp * (mz * nr - mr * nz)
        if fz > -1e-3 * weight or abs(det) < 1e-12 * weight**3:  # in the air, or wholly under water
            pose[2] += RISE if f > 0.0 else -RISE
            continue
        dz = -(f * (mr * np_ - mp * nr) - fr * (m * np_ - mp * n) + fp * (m * nr - mr * n)) / det
        dr = -(fz * (m * np_ - mp * n) - f * (mz * np_ - mp * nz) + fp * (mz * n - m * nz)) / det
        dp = -(fz * (mr * n - m * nr) - fr * (mz * n - m * nz) + f * (mz * nr - mr * nz)) / det
        pose[2] += min(max(dz, -RISE), RISE)
        pose[3] += min(max(dr, -TURN), TURN)
        pose[4] += min(max(dp, -TURN), TURN)
    return False
