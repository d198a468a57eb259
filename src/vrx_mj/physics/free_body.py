"""The step of a single free body, whose mass matrix is constant in body axes.

With nu = (v, omega) of the link's origin in body axes and a = R^T dv/dt of world axes, rigid body and added mass
together have one matrix M (Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2021, 3.3):

    M (a, domega/dt) = (f, t) - (m omega x (omega x c), omega x I omega)

with the forces f and torques t about the origin, weight included, the mass m, the centre of mass c and the inertia I
about the origin. The step is MuJoCo's semi-implicit Euler: velocities first, then places, and the attitude turned by
the angle |omega| dt. What floats has a drag D that MuJoCo's step takes implicitly: M + dt D is solved then.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.elementary import cosine_and_sine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import (
    Motion,
    Vector,
    cross,
    dot,
    minus,
    motion,
    plus,
    rotate,
    spin_of,
    times,
    unrotate,
)
from vrx_mj.physics.tables import Record, Table

_f, _i = np.float64, np.int64
FREE_BODY = np.dtype(
    [*((name, _i) for name in ("body", "qpos", "dof", "float", "diagonal")), ("mass", _f), ("weight", _f),
     ("center", _f, (3,)), ("pushed", _f, (3,)), ("inertia", _f, (3, 3)), ("matrix", _f, (6, 6)),
     ("inverse", _f, (6, 6))],
    align=True,
)  # fmt: skip
"""A body on a free joint, with all that is welded to it: MuJoCo's body and addresses; its row of FLOAT, or -1; 1 where
M is diagonal; mass [kg] and weight [N]; centre of mass and the point about which it is pushed [m]; inertia about the
origin [kg m2]; M with what water adds, and its inverse."""
SOLVE_WORK = np.dtype([("rows", _f, (6, 7))])
"""Memory of an elimination."""

_Pair = tuple[Vector, Vector]


def free_body_row(rigid: FloatArray, added: FloatArray, **columns: Any) -> npt.NDArray[np.void]:
    """Return a table of one FREE_BODY.

    Args:
        rigid: (6, 6) about the origin, body axes, of the rigid body.
        added: (6, 6), what water adds; it need not be symmetric.
        columns: the other numbers.
    """
    table = np.zeros(1, FREE_BODY)
    for name, value in columns.items():
        table[name] = value
    mass = rigid[0, 0]
    table["mass"], table["inertia"] = mass, rigid[3:, 3:]
    table["center"] = np.array([rigid[5, 1], rigid[3, 2], rigid[4, 0]]) / mass
    table["matrix"] = whole = rigid + added
    table["diagonal"] = not (whole - np.diag(np.diag(whole))).any()
    table["inverse"] = np.linalg.inv(whole)
    return table


@kernel
def free_step(body: Record, qpos: FloatArray, qvel: FloatArray, pushed: FloatArray, dt: float) -> None:
    """Advance a body by a step under what pushes it: force and torque (6,) about `body.pushed`, world axes."""
    now = motion(qpos, qvel, body.qpos, body.dof)
    force, torque = _load(body, now, pushed)
    _advance(body, now, _times_inverse(body.inverse, force, torque), qpos, qvel, dt)


@kernel
def damped_step(
    body: Record, work: Table, damping: FloatArray, qpos: FloatArray, qvel: FloatArray, pushed: FloatArray, dt: float
) -> None:
    """`free_step` with `damping` dt (k, k_z, kappa) [kg, kg, kg m2] in world axes; `work` is for one to solve."""
    now = motion(qpos, qvel, body.qpos, body.dof)
    force, torque = _load(body, now, pushed)
    if body.diagonal:
        acceleration = _principal_acceleration(body, now, damping, force, torque)
    else:
        rows, up = work[0].rows, unrotate(now, (0.0, 0.0, 1.0))
        for i in range(6):
            for j in range(6):
                rows[i, j] = body.matrix[i, j]
        for i in range(3):
            for j in range(3):
                rows[i, j] += (damping[1] - damping[0]) * up[i] * up[j]
            rows[i, i] += damping[0]
            rows[i + 3, i + 3] += damping[2]
            rows[i, 6], rows[i + 3, 6] = force[i], torque[i]
        acceleration = _solution(rows)
    _advance(body, now, acceleration, qpos, qvel, dt)


@kernel
def _principal_acceleration(body: Record, now: Motion, damping: FloatArray, force: Vector, torque: Vector) -> _Pair:
    """Return the accelerations of a body whose frame is its principal one."""
    (x, y, z), (p, q, r), a = rotate(now, force), torque, body.matrix
    across, up, turning = a[0, 0] + damping[0], a[0, 0] + damping[1], damping[2]
    turn = p / (a[3, 3] + turning), q / (a[4, 4] + turning), r / (a[5, 5] + turning)
    return unrotate(now, (x / across, y / across, z / up)), turn


@kernel
def _load(body: Record, now: Motion, pushed: FloatArray) -> _Pair:
    """Return force and torque about the origin, body axes, with weight and what turns the momentum."""
    push, weight = unrotate(now, pushed), unrotate(now, (0.0, 0.0, -body.weight))
    torque = plus(unrotate(now, pushed[3:]), plus(cross(body.pushed, push), cross(body.center, weight)))
    spin, inertia = spin_of(now), body.inertia
    carried = times(body.mass, cross(spin, cross(spin, body.center)))
    momentum = dot(inertia[0], spin), dot(inertia[1], spin), dot(inertia[2], spin)
    return minus(plus(push, weight), carried), minus(torque, cross(spin, momentum))


@kernel
def _times_inverse(a: FloatArray, v: Vector, w: Vector) -> _Pair:
    """Return a (6, 6) times (v, w)."""
    return (
        (dot(a[0], v) + dot(a[0, 3:], w), dot(a[1], v) + dot(a[1, 3:], w), dot(a[2], v) + dot(a[2, 3:], w)),
        (dot(a[3], v) + dot(a[3, 3:], w), dot(a[4], v) + dot(a[4, 3:], w), dot(a[5], v) + dot(a[5, 3:], w)),
    )


@kernel
def _solution(rows: FloatArray) -> _Pair:
    """Return the solution of six equations, (6, 7), of a positive definite matrix."""
    for k in range(6):
        for i in range(k + 1, 6):
            share = rows[i, k] / rows[k, k]
            for j in range(k + 1, 7):
                rows[i, j] -= share * rows[k, j]
    for k in range(5, -1, -1):
        for j in range(k + 1, 6):
            rows[k, 6] -= rows[k, j] * rows[j, 6]
        rows[k, 6] /= rows[k, k]
    return (rows[0, 6], rows[1, 6], rows[2, 6]), (rows[3, 6], rows[4, 6], rows[5, 6])


@kernel
def _advance(body: Record, now: Motion, acceleration: _Pair, qpos: FloatArray, qvel: FloatArray, dt: float) -> None:
    """Integrate velocities, then the place with them."""
    at, dof = body.qpos, body.dof
    straight, (p, q, r) = rotate(now, acceleration[0]), plus(spin_of(now), times(dt, acceleration[1]))
    for k in range(3):
        qvel[dof + k] += dt * straight[k]
        qpos[at + k] += dt * qvel[dof + k]
    qvel[dof + 3], qvel[dof + 4], qvel[dof + 5] = p, q, r
    rate = math.sqrt(p * p + q * q + r * r)
    cos, sin = cosine_and_sine(0.5 * dt * rate)
    share = sin / rate if rate > 0.0 else 0.0
    x, y, z = share * p, share * q, share * r
    qw, qx, qy, qz = qpos[at + 3], qpos[at + 4], qpos[at + 5], qpos[at + 6]
    scale = 1.0 / math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
    qpos[at + 3] = scale * (qw * cos - qx * x - qy * y - qz * z)
    qpos[at + 4] = scale * (qw * x + qx * cos + qy * z - qz * y)
    qpos[at + 5] = scale * (qw * y - qx * z + qy * cos + qz * x)
    qpos[at + 6] = scale * (qw * z + qx * y - qy * x + qz * cos)


@kernel
def step_free_bodies(
    bodies: Table, work: Table, held: Table, damping: FloatArray, qpos: FloatArray, qvel: FloatArray,
    xfrc_applied: FloatArray, dt: float,
) -> None:  # fmt: skip
    """Advance all bodies by a step; `held` is FLOAT_STATE, whose held bodies stay, and `damping` has its rows."""
    for i in range(bodies.size):
        body = bodies[i]
        pushed = xfrc_applied[body.body]
        if body.float < 0:
            free_step(body, qpos, qvel, pushed, dt)
        elif held[body.float].held == 0:
            damped_step(body, work, damping[body.float], qpos, qvel, pushed, dt)
