"""Floating objects in water that moves: buoyancy square to the surface, and drag on the velocity through the water.

The water around a small body presses as if it were at rest in a frame that falls with it: with the acceleration a of
the water, by Euler's equation, its pressure falls along a - g, with g downward. So the body floats as in still water
whose plane is square to that apparent gravity and goes through the surface above the body; in linear waves that is the
surface's own plane. `flotation` computes there, in axes that are turned accordingly, with the water's velocity taken
off; its result is turned back.

A mooring is a rope to an anchor, which pulls beyond its length.

Links on joints have the buoyancy and drag of `flotation`, at their present velocity. What a link feels at the end of a
step depends on all joints and contacts, so its drag is implicit in MuJoCo's own equation of motion, as that of a dock's
blocks (`raft`): with D = J^T diag(k, k, k_z, kappa, kappa, kappa) J, where J gives the velocity of the link's origin
and its angular velocity,
    (M + dt D) (v' - v) = dt (f - D v),      the same as      M (v' - v) = dt (f - D v'),
whatever else f holds. Only the small torque of drag whose centre is not the link's origin stays explicit.

Joints may be of any type: J comes from MuJoCo's motion axes `cdof`, of rotation and velocity at the centre of mass of
the whole tree.
"""

import math

from numba.np.unsafe.ndarray import to_fixed_tuple

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.flotation import Flotation, flotation_under
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.kinematics import Orbital
from vrx_mj.physics.motion import (
    Motion,
    Vector,
    Wrench,
    dot,
    minus,
    motion_at_rest,
    place_of,
    plus,
    relative_motion,
    rotate,
    rotated_wrench,
    spin_of,
    times,
    unrotate,
    velocity_of,
    with_velocity,
    zero_vector,
    zero_wrench,
)
from vrx_mj.physics.tables import Record, Table


@kernel
def apparent_gravity(gravity: float, water: Orbital) -> Vector:
    """Return the vector against which still water would press as the moving water does [m/s2], world axes: upward."""
    return water.du, water.dv, max(gravity + water.dw, 0.1 * gravity)


@kernel
def _level_axes(up: Vector) -> Motion:
    """Return axes at rest whose z is `up`, which is above the horizon, turned from the world's as little as can be."""
    length = math.sqrt(dot(up, up))
    x, y, z = up[0] / length, up[1] / length, up[2] / length
    share = 1.0 / (1.0 + z)
    cross = -share * x * y
    rows = (1.0 - share * x * x, cross, x, cross, 1.0 - share * y * y, y, -x, -y, z)
    return motion_at_rest(zero_vector(), rows)


@kernel
def _seen_from(axes: Motion, m: Motion, height: float) -> Motion:
    """Return a motion in level axes whose origin is on the surface, `height` [m] high, above the link's."""
    a = unrotate(axes, (m.r00, m.r10, m.r20))
    b = unrotate(axes, (m.r01, m.r11, m.r21))
    c = unrotate(axes, (m.r02, m.r12, m.r22))
    place = unrotate(axes, (0.0, 0.0, m.z - height))
    return Motion(*place, a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2], *m[12:])


@kernel
def flotation_in_waves(
    body: Record, elements: Table, motion: Motion, height: float, stream: Vector, water: Orbital, dt: float,
    external: Wrench,
) -> Flotation:  # fmt: skip
    """Return buoyancy and drag at the end of a step: world axes, about the link's centre of mass, without weight.

    Args:
        body: a row of `tables.FLOAT`.
        elements: `tables.ELEMENT`.
        motion: of the link.
        height: of the surface at the link's origin [m].
        stream: the current there [m/s], world axes.
        water: how the waves move the water there.
        dt: step [s].
        external: every other wrench on the link but weight, world axes about its centre of mass.
    """
    up = apparent_gravity(body.gravity, water)
    axes = _level_axes(up)
    level = _seen_from(axes, relative_motion(motion, plus(stream, water[:3])), height)
    weight = body.mass * body.gravity
    fx, fy, fz = plus(unrotate(axes, external[:3]), unrotate(axes, (0.0, 0.0, -weight)))
    beside = Wrench(fx, fy, fz + weight, *unrotate(axes, external[3:]))
    found = flotation_under(math.sqrt(dot(up, up)), body, elements, None, level, 0.0, 0.0, dt, beside)
    wrench, acceleration = rotated_wrench(axes, found.wrench), rotate(axes, found.acceleration)
    return Flotation(wrench, found.sums, acceleration, rotate(axes, found.turning))


@kernel
def rope_pull(rope: Record, body: Record, motion: Motion, dt: float, damping: FloatArray) -> Wrench:
    """Return the pull of a rope on what floats [N], world axes, about its centre of mass, at which it holds it.

    It counts on the horizontal plane, and within its length it is slack. Stretched by d it pulls with
    s d + (c + dt s) d', and `damping[0]` gets dt (c + dt s) [kg] for the inertia, as for drag: so a stiff rope is
    stable on a light buoy.
    """
    lever, place = rotate(motion, body.com), place_of(motion, body.com)
    x, y = place[0] - rope.anchor[0], place[1] - rope.anchor[1]
    distance = math.sqrt(x * x + y * y)
    if distance <= rope.length:
        return zero_wrench()
    x, y = x / distance, y / distance
    velocity, spin = rotate(motion, velocity_of(motion)), rotate(motion, spin_of(motion))
    east = velocity[0] + spin[1] * lever[2] - spin[2] * lever[1]
    north = velocity[1] + spin[2] * lever[0] - spin[0] * lever[2]
    resistance = rope.damping + dt * rope.stiffness
    force = -rope.stiffness * (distance - rope.length) - resistance * (x * east + y * north)
    damping[0] += dt * resistance
    force = min(force, 0.0)
    return Wrench(force * x, force * y, 0.0, 0.0, 0.0, 0.0)


@kernel
def _axis_at(axis: FloatArray, center: FloatArray, point: FloatArray) -> Vector:
    """Return the velocity at a point [m, world] that a degree of freedom gives at 1 m/s or rad/s, world axes.

    `axis` is its row of MuJoCo's `cdof`, about the `center` of mass of the whole tree [m, world].
    """
    (x, y, z), (a, b, c) = minus(point, center), (axis[0], axis[1], axis[2])
    return axis[3] + b * z - c * y, axis[4] + c * x - a * z, axis[5] + a * y - b * x


@kernel
def link_motion(
    position: FloatArray, rotation: FloatArray, dof: int, dof_parent: IntArray, cdof: FloatArray, center: FloatArray,
    qvel: FloatArray,
) -> Motion:  # fmt: skip
    """Return the pose and velocity of a link whose own last degree of freedom is `dof`.

    `position`, (3,), and `rotation`, (9,), are MuJoCo's `xpos` and `xmat` of it.
    """
    velocity, spin = zero_vector(), zero_vector()
    while dof >= 0:
        axis, rate = cdof[dof], qvel[dof]
        velocity = plus(velocity, times(rate, _axis_at(axis, center, position)))
        spin = plus(spin, times(rate, axis))
        dof = dof_parent[dof]
    at_rest = motion_at_rest(to_fixed_tuple(position, 3), to_fixed_tuple(rotation, 9))
    return with_velocity(at_rest, unrotate(at_rest, velocity), unrotate(at_rest, spin))


@kernel
def add_link_drag(
    inertia: FloatArray, inertia_row: IntArray, position: FloatArray, dof: int, dof_parent: IntArray,
    cdof: FloatArray, center: FloatArray, damping: FloatArray,
) -> None:  # fmt: skip
    """Add dt D of a link to MuJoCo's sparse lower inertia; `damping` is dt (k, k_z, kappa) [kg, kg, kg m2].

    The row of a degree of freedom holds the columns of those that it hangs on, in order, then its own.
    """
    k, kz, kappa = damping[0], damping[1], damping[2]
    last, other = -1, dof
    while other >= 0:
        last, other = last + 1, dof_parent[other]
    while dof >= 0:
        x, y, z = _axis_at(cdof[dof], center, position)
        force, torque = (k * x, k * y, kz * z), times(kappa, cdof[dof])
        column, other = inertia_row[dof] + last, dof
        while other >= 0:
            moved = _axis_at(cdof[other], center, position)
            inertia[column] += dot(force, moved) + dot(torque, cdof[other])
            column, other = column - 1, dof_parent[other]
        last, dof = last - 1, dof_parent[dof]
