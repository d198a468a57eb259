"""What still water does to a moving hull: drag, added mass, cross-flow drag and measured resistance.

VRX's force on the link's centre of mass, in body axes, is -D(nu) nu - M_A d(nu)/dt, with diagonal D and
M_A and with nu = (u, v, w, p, q, r) the velocity of the link's *origin* and the angular velocity. VRX
adds no Coriolis term, and d(nu)/dt is that of the body components. VRX takes it from the last two steps;
here M_A goes into the inertia, to which VRX's scheme converges where it does not diverge.

VRX 3 pushes at the link's origin instead, and its M_A acts on the world acceleration of that origin, resolved in body
axes: `drag` is then about the origin, there is no `added_bias`, and `added_inertia` is exact. `drag_on_hull` and
`bias_on_hull` choose by the profile of a hull's row.

Profile `marine` has all 36 coefficients of added mass, with Coriolis and centripetal forces:

With nu_r = (v, w) the velocity of the link's origin through the water and the angular velocity, body axes, and M_A
= [[A11, A12], [A21, A22]] about that origin, the force is -M_A d(nu_r)/dt - C_A(nu_r) nu_r (Fossen, 2021, 6.4). Of the
derivative, the part of the origin's acceleration a and of dw/dt goes into the inertia; the rest is known before a step:
d(nu_r)/dt = [R^T (a - a_water) - w x v; dw/dt].

Cross-flow drag is summed over strips along the hull (ITTC; Fossen 2021, 6.7).

A strip of the lateral area T dx moves across the water with v + x r - z p, and has the drag of a cylinder:

    Y = -rho / 2 sum C_d T dx |v + x r - z p| (v + x r - z p)

which acts at the strip, hence the moments -z Y_i of roll and x Y_i of yaw. A skeg is a wing that does not turn: its
normal force, rho / 2 A f U^2 sin(alpha) of the MMG standard method (`thrust.normal_slope`), has U times the velocity
across in the place of the square.

Resistance is a curve over speed, as a towing tank measures it (ITTC 7.5-02-02-01).
"""

import math

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import (
    Arrow,
    Motion,
    Vector,
    Wrench,
    cross,
    each_times,
    from_origin,
    minus,
    plus,
    rotate,
    rotated_wrench,
    spin_of,
    unrotate,
    velocity_of,
    zero_vector,
    zero_wrench,
)
from vrx_mj.physics.tables import VRX, VRX3, Record, Table


@kernel
def drag(hull: Record, motion: Motion) -> Wrench:
    """Return linear and quadratic drag on velocity over ground: world axes, about where it pushes.

    That is `hull.link_com` in VRX classic and the link's origin in VRX 3.
    """
    force, torque = _resistance(hull, 0, velocity_of(motion)), _resistance(hull, 3, spin_of(motion))
    return rotated_wrench(motion, Wrench(*force, *torque))


@kernel
def _resistance(hull: Record, axis: int, v: Vector) -> Vector:
    """Return -(D + D_q |v|) v along three axes, of which `axis` is the first."""
    d, dd = hull.drag_linear[axis : axis + 3], hull.drag_quadratic[axis : axis + 3]
    return (
        -(d[0] + dd[0] * abs(v[0])) * v[0],
        -(d[1] + dd[1] * abs(v[1])) * v[1],
        -(d[2] + dd[2] * abs(v[2])) * v[2],
    )


@kernel
def added_inertia(hull: Record, motion: Motion, out: FloatArray) -> None:
    """Write the added mass into `out`, (6, 6), in the coordinates of MuJoCo's free joint.

    Those are the world acceleration a of the link's origin and the body-axis angular acceleration.
    With A and B the linear and the angular half of the diagonal M_A, a force
    -R A (R^T a - omega x v) and a torque -B d(omega)/dt give the block diagonal [R A R^T, B]; the rest
    of the force is `added_bias`.

    As the force acts at c = `hull.link_com` and not at the origin, its torque about the origin has a
    part -c x A R^T a that no symmetric inertia can hold: `added_moment`. A symmetric form that keeps
    half of it would no longer be positive for every M_A.
    """
    a, rows = hull.added_mass, (motion[3:6], motion[6:9], motion[9:12])
    for i in range(3):
        for j in range(3):
            p, q = rows[i], rows[j]
            out[i, j] = a[0] * p[0] * q[0] + a[1] * p[1] * q[1] + a[2] * p[2] * q[2]
            out[i, j + 3] = out[i + 3, j] = out[i + 3, j + 3] = 0.0
        out[i + 3, i + 3] = a[i + 3]


@kernel
def added_bias(hull: Record, motion: Motion) -> Wrench:
    """Return A (omega x v), the added mass' force at zero acceleration: world axes, about `hull.link_com`.

    d/dt of the body components of a velocity is R^T a - omega x v; the first part is in `added_inertia`.
    """
    force = each_times(hull.added_mass, cross(spin_of(motion), velocity_of(motion)))
    return rotated_wrench(motion, Wrench(*force, *zero_vector()))


@kernel
def added_moment(hull: Record, motion: Motion, acceleration: Vector) -> Vector:
    """Return the torque -c x A R^T a [N m], world axes, which `added_inertia` leaves out.

    `acceleration` a [m/s2] is the link origin's, world axes.
    """
    force = each_times(hull.added_mass, unrotate(motion, acceleration))
    return rotate(motion, cross(force, hull.link_com))


@kernel
def has_added_moment(hull: Record) -> bool:
    """Whether a hull gets its `added_moment`: in VRX classic, and with added mass in surge or sway.

    VRX's boats have some in heave only, above whose c it would be zero, or 0.0004 kg m times the acceleration with
    sensors on board: they go without.
    """
    return bool(hull.profile == VRX and (hull.added_mass[0] != 0.0 or hull.added_mass[1] != 0.0))


@kernel
def drag_on_hull(hull: Record, motion: Motion) -> Wrench:
    """Return `drag`: world axes, about `hull.link_com`."""
    wrench = drag(hull, motion)
    if hull.profile == VRX3:
        return from_origin(wrench, motion, hull.link_com)
    return wrench


@kernel
def bias_on_hull(hull: Record, motion: Motion) -> Wrench:
    """Return the added mass' force at zero acceleration: world axes, about `hull.link_com`."""
    if hull.profile == VRX3:
        return zero_wrench()
    return added_bias(hull, motion)


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
    return row_times(a[row], v, w), row_times(a[row + 1], v, w), row_times(a[row + 2], v, w)


@kernel
def row_times(row: FloatArray, v: Arrow, w: Arrow) -> float:
    """Return the product of six numbers with (v, w)."""
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


@kernel
def crossflow_drag(strips: Table, through: Motion) -> Wrench:
    """Return the forces on strips and skegs, `tables.STRIP`, about the link's origin in body axes.

    `through` is the link's motion through the water, of its origin.
    """
    fy, tx, tz = 0.0, 0.0, 0.0
    for i in range(strips.size):
        strip = strips[i]
        across = through.v + strip.x * through.r - strip.z * through.p
        force = -strip.drag * abs(across) * across
        if strip.lift > 0.0:
            force -= strip.lift * math.hypot(through.u + through.q * strip.z, across) * across
        fy += force
        tx -= strip.z * force
        tz += strip.x * force
    return Wrench(0.0, fy, 0.0, tx, 0.0, tz)


@kernel
def resistance_at(curve: Table, speed: float) -> float:
    """Return the resistance [N] against a speed ahead [m/s], below 0 astern, where it is the same.

    Between the rows of `tables.RESISTANCE` are straight lines; beyond the last it goes with the square of the speed.
    """
    size, last = abs(speed), curve[curve.size - 1]
    if size >= last.speed:
        return float(last.force * (size / last.speed) ** 2 * math.copysign(1.0, speed))
    row = 1
    while curve[row].speed <= size:
        row += 1
    below, above = curve[row - 1], curve[row]
    up = (size - below.speed) / (above.speed - below.speed)
    return math.copysign(below.force + up * (above.force - below.force), speed)
