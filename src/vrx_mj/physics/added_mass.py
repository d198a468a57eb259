"""The water that a hull carries along, with all 36 coefficients: inertia, and Coriolis and centripetal forces.

With nu_r = (v, w) the velocity of the link's origin through the water and the angular velocity, body axes, and M_A
= [[A11, A12], [A21, A22]] about that origin, the force is -M_A d(nu_r)/dt - C_A(nu_r) nu_r (Fossen, 2021, 6.4). Of the
derivative, the part of the origin's acceleration a and of dw/dt goes into the inertia; the rest is known before a step:
d(nu_r)/dt = [R^T (a - a_water) - w x v; dw/dt].
"""

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Vector, Wrench, cross, unrotate
from vrx_mj.physics.tables import Record


@kernel
def added_inertia_of_vessel(vessel: Record, m: Motion, out: FloatArray) -> None:
    """Write the added mass into `out`, (6, 6), in the coordinates of MuJoCo's free joint.

    Those are the world acceleration of the link's origin and the angular acceleration in body axes: T M_A T^T with T
    the rotation for the first three, and one for the others.
    """
    a = vessel.added_mass
    rows = ((m.r00, m.r01, m.r02), (m.r10, m.r11, m.r12), (m.r20, m.r21, m.r22))
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
    x, y, z = a[row], a[row + 1], a[row + 2]
    return (
        x[0] * v[0] + x[1] * v[1] + x[2] * v[2] + x[3] * w[0] + x[4] * w[1] + x[5] * w[2],
        y[0] * v[0] + y[1] * v[1] + y[2] * v[2] + y[3] * w[0] + y[4] * w[1] + y[5] * w[2],
        z[0] * v[0] + z[1] * v[1] + z[2] * v[2] + z[3] * w[0] + z[4] * w[1] + z[5] * w[2],
    )


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
    m, a = through, vessel.added_mass
    v, w, none = (m.u, m.v, m.w), (m.p, m.q, m.r), (0.0, 0.0, 0.0)
    turned, carried, spin = cross(w, v), unrotate(m, *water), unrotate(m, *turning)
    arm = cross(spin, (vessel.buoyancy[0], vessel.buoyancy[1], vessel.buoyancy[2]))
    rate = turned[0] + carried[0] - arm[0], turned[1] + carried[1] - arm[1], turned[2] + carried[2] - arm[2]
    force, torque = matrix_times(a, 0, rate, spin), matrix_times(a, 3, rate, spin)
    p, moment = matrix_times(a, 0, v, w), matrix_times(a, 3, v, w)
    munk = p if vessel.munk != 0 else matrix_times(a, 0, none, w)
    centripetal, across, around = cross(w, p), cross(v, munk), cross(w, moment)
    return Wrench(
        force[0] - centripetal[0],
        force[1] - centripetal[1],
        force[2] - centripetal[2],
        torque[0] - across[0] - around[0],
        torque[1] - across[1] - around[1],
        torque[2] - across[2] - around[2],
    )
