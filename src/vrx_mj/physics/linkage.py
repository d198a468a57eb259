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

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Vector


@kernel
def _axis_at(cdof: FloatArray, dof: int, center: FloatArray, x: float, y: float, z: float) -> Vector:
    """Return the velocity at a point [m, world] that a degree of freedom gives at 1 m/s or rad/s, world axes.

    `center` is the point of MuJoCo's `cdof`: the centre of mass of the whole tree [m, world].
    """
    a, b, c = cdof[dof, 0], cdof[dof, 1], cdof[dof, 2]
    dx, dy, dz = x - center[0], y - center[1], z - center[2]
    return cdof[dof, 3] + b * dz - c * dy, cdof[dof, 4] + c * dx - a * dz, cdof[dof, 5] + a * dy - b * dx


@kernel
def link_motion(
    position: FloatArray, rotation: FloatArray, dof: int, dof_parent: IntArray, cdof: FloatArray, center: FloatArray,
    qvel: FloatArray,
) -> Motion:  # fmt: skip
    """Return the pose and velocity of a link whose own last degree of freedom is `dof`.

    `position`, (3,), and `rotation`, (9,), are MuJoCo's `xpos` and `xmat` of it.
    """
    x, y, z = position[0], position[1], position[2]
    vx = vy = vz = wx = wy = wz = 0.0
    while dof >= 0:
        rate = qvel[dof]
        velocity = _axis_at(cdof, dof, center, x, y, z)
        vx, vy, vz = vx + velocity[0] * rate, vy + velocity[1] * rate, vz + velocity[2] * rate
        wx, wy, wz = wx + cdof[dof, 0] * rate, wy + cdof[dof, 1] * rate, wz + cdof[dof, 2] * rate
        dof = dof_parent[dof]
    m = rotation
    return Motion(
        x, y, z, m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8],
        m[0] * vx + m[3] * vy + m[6] * vz, m[1] * vx + m[4] * vy + m[7] * vz, m[2] * vx + m[5] * vy + m[8] * vz,
        m[0] * wx + m[3] * wy + m[6] * wz, m[1] * wx + m[4] * wy + m[7] * wz, m[2] * wx + m[5] * wy + m[8] * wz,
    )  # fmt: skip


@kernel
def add_link_drag(
    inertia: FloatArray, inertia_row: IntArray, position: FloatArray, dof: int, dof_parent: IntArray,
    cdof: FloatArray, center: FloatArray, damping: FloatArray,
) -> None:  # fmt: skip
    """Add dt D of a link to MuJoCo's sparse lower inertia; `damping` is dt (k, k_z, kappa) [kg, kg, kg m2].

    The row of a degree of freedom holds the columns of those that it hangs on, in order, then its own.
    """
    x, y, z = position[0], position[1], position[2]
    k, kz, kappa = damping[0], damping[1], damping[2]
    last, other = -1, dof
    while other >= 0:
        last, other = last + 1, dof_parent[other]
    while dof >= 0:
        fx, fy, fz = _axis_at(cdof, dof, center, x, y, z)
        fx, fy, fz = k * fx, k * fy, kz * fz
        tx, ty, tz = kappa * cdof[dof, 0], kappa * cdof[dof, 1], kappa * cdof[dof, 2]
        column, other = inertia_row[dof] + last, dof
        while other >= 0:
            ux, uy, uz = _axis_at(cdof, other, center, x, y, z)
            turned = tx * cdof[other, 0] + ty * cdof[other, 1] + tz * cdof[other, 2]
            inertia[column] += fx * ux + fy * uy + fz * uz + turned
            column, other = column - 1, dof_parent[other]
        last, dof = last - 1, dof_parent[dof]
