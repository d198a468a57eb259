"""Links that hang together by joints: how each moves, and the drag of water on all of them in MuJoCo's own inertia.

A link has the buoyancy and drag of `flotation`, at its present velocity. What it feels at the end of a step depends on
all joints and contacts, so that its drag is implicit in MuJoCo's own equation of motion, as that of a dock's blocks
(`raft`): with D = J^T diag(k, k, k_z, kappa, kappa, kappa) J, where J gives the velocity of the link's origin and its
angular velocity,
    (M + dt D) (v' - v) = dt (f - D v),      the same as      M (v' - v) = dt (f - D v'),
whatever else f holds. Only the small torque of drag whose centre is not the link's origin stays explicit.

Joints may be of any type: J comes from MuJoCo's motion axes `cdof`, of rotation and velocity at the centre of mass of
the whole tree.
"""

from numba.np.unsafe.ndarray import to_fixed_tuple

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import (
    Motion,
    Vector,
    dot,
    minus,
    motion_at_rest,
    plus,
    times,
    unrotate,
    with_velocity,
    zero_vector,
)


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
