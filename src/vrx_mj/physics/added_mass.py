"""The water that a hull carries along, with all 36 coefficients: inertia, and Coriolis and centripetal forces.

With nu_r = (v, w) the velocity of the link's origin through the water and the angular velocity, body axes, and M_A
= [[A11, A12], [A21, A22]] about that origin, the force is -M_A d(nu_r)/dt - C_A(nu_r) nu_r (Fossen, 2021, 6.4). Of the
derivative, the part of the origin's acceleration a and of dw/dt goes into the inertia; the rest is known before a step:
d(nu_r)/dt = [R^T (a - a_water) - w x v; dw/dt].
"""

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import (
    Motion,
    Vector,
    Wrench,
    cross,
    minus,
    plus,
    spin_of,
    unrotate,
    velocity_of,
    zero_vector,
)
from vrx_mj.physics.tables import Record


@kernel
def added_inertia_of_vessel(vessel: Record, m: Motion, out: FloatArray) -> None:
    """Write the added mass into `out`, (6, 6), in the coordinates of MuJoCo's free joint.

    Those are the world acceleration of the link's origin and the angular acceleration in body axes: T M_A T^T with T
    the rotation for the first three, and one for the others.
    """
    a = vessel.added_mass
    rows = m[3:6], m[6:9], m[9:12]
    for i in range(3):
        p = rows[i]
        for j in range(3):
            total = 0.0
            for k in range(3):
                q = rows[j]
                total += p[k] * (a[k, 0] * q[0] + a[k, 1] * q[1] + a[k, 2] * q[2])
            out[i, j] = total
            out[i, j + 3] = out[j + 3, i] = p[0] * a[0, j + 3] + p[1] * a[1, j + 3] + p[2] * a[2, j + 3]
            out[i + 3, j + 3] = a[i + 3, j + 3]


@kernel
def matrix_times(a: FloatArray, row: int, v: Vector, w: Vector) -> Vector:
    """Return three rows, from `row` on, of a (6, 6) times (v, w)."""
    return _row_times(a[row], v, w), _row_times(a[row + 1], v, w), _row_times(a[row + 2], v, w)


@kernel
def _row_times(row: FloatArray, v: Vector, w: Vector) -> float:
    return float(row[0] * v[0] + row[1] * v[1] + row[2] * v[2] + row[3] * w[0] + row[4] * w[1] + row[5] * w[2])


@kernel
def added_mass_bias(vessel: Record, through: Motion, water: Vector, turning: Vector) -> Wrench:
    """Return the force of the added mass at no acceleration: body axes, about the link's origin.

    M_A [w x v + R^T a_water; R^T alpha_water] - [w x p; v x p + w x l], with (p, l) = M_A nu_r. Without `vessel.munk`,
    v x A11 v is left out, which turns a boat across the stream (Munk, 1924). The water's acceleration is that of a body
    that goes and turns with it at the centre of buoyancy; its angular velocity is left out of nu_r here.

    Args:
        vessel: a row of `tables.VESSEL`.
        through: the link's motion through the water.
        water: acceleration of the undisturbed water at `vessel.buoyancy` [m/s2], world axes.
        turning: angular acceleration of the undisturbed water [rad/s2], world axes.
    """
    a, v, w, spin = vessel.added_mass, velocity_of(through), spin_of(through), unrotate(through, turning)
    rate = minus(plus(cross(w, v), unrotate(through, water)), cross(spin, vessel.buoyancy))
    p, moment = matrix_times(a, 0, v, w), matrix_times(a, 3, v, w)
    munk = p if vessel.munk != 0 else matrix_times(a, 0, zero_vector(), w)
    torque = minus(matrix_times(a, 3, rate, spin), cross(v, munk))
    return Wrench(*minus(matrix_times(a, 0, rate, spin), cross(w, p)), *minus(torque, cross(w, moment)))
