"""Whether anything can touch anything: while nothing can, what steps has no shapes at all.

Placing a boat's 30 collision shapes and looking for their contacts is more than half the cost of its step. Every
moving tree of bodies is bounded by a sphere about its root's middle and every static shape by a box. From their
least distance follows how far anything may move before another look is needed. A step without contacts is
bit-equal with and without shapes, so this changes no motion.
"""

import math

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import Record, Table

_MARGIN = 0.05
"""Added to every radius [m]: geoms may have a margin."""
MAX_DISTANCE = 20.0
"""Distances are found up to this [m]."""

MOVER = np.dtype(
    [("qpos", np.int64), ("middle", np.float64, (3,)), ("radius", np.float64), ("seen", np.float64, (3,))], align=True
)
"""A tree of bodies on a free joint: its address, the middle of the sphere that bounds it [m] in the root's frame, its
radius [m], and where it was at the last look, which leaves the table in the order of the spheres' west edges."""
OBSTACLE = np.dtype(
    [("center", np.float64, (3,)), ("half", np.float64, (3,)), ("axes", np.float64, (3, 3))], align=True
)
"""A box around a static shape: centre and half edges [m], and its axes in the world, a row each."""
BROADPHASE = np.dtype(
    [("clearance", np.float64), ("wait", np.int64), ("unconstrained", np.int64), ("armed", np.int64)], align=True
)
"""What the last look found: the least distance [m], and how many steps to wait for another if that was none; whether
the model without shapes is unconstrained; and whether the loop is to return at the next touch of a boat."""
_CHECK_PERIOD = 25
"""Number of steps between two checks while something is near."""


def movers(model: mujoco.MjModel) -> Table:
    """Every tree of bodies with a free joint, with a radius that holds wherever its other joints are."""
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    table = np.zeros(len(free), MOVER)
    row_of = np.full(model.nbody, -1)
    row_of[model.jnt_bodyid[free]] = np.arange(len(free))
    table["qpos"] = model.jnt_qposadr[free]
    table["seen"] = np.inf
    table["middle"] = model.body_ipos[model.jnt_bodyid[free]]
    reach = np.zeros(model.nbody)
    for body in range(1, model.nbody):
        if body != model.body_rootid[body]:
            reach[body] = reach[model.body_parentid[body]] + _length(model, body)
    geoms = _colliding(model)
    bodies = model.geom_bodyid[geoms]
    rows = row_of[model.body_rootid[bodies]]
    start = np.where((bodies == model.body_rootid[bodies])[:, None], model.body_ipos[bodies], 0.0)
    far = reach[bodies] + np.linalg.norm(model.geom_pos[geoms] - start, axis=1) + model.geom_rbound[geoms] + _MARGIN
    np.maximum.at(table["radius"], rows[rows >= 0], far[rows >= 0])
    return table


def is_unconstrained(free: mujoco.MjModel) -> bool:
    """Whether the model without shapes has nothing that binds, drives or senses.

    Then all that MuJoCo does about constraints, actuators and sensors comes to nothing in every step. A sensor of
    contacts finds none.
    """
    limited = free.jnt_limited.any() or free.dof_frictionloss.any()
    feels = (free.sensor_type != mujoco.mjtSensor.mjSENS_CONTACT).any()
    return not (free.neq or free.ntendon or free.nflex or free.nu or limited or feels)


def _length(model: mujoco.MjModel, body: int) -> float:
    """Farthest distance [m] of a body from its parent, or from a root's middle, wherever its joints are."""
    parent, way = int(model.body_parentid[body]), np.array(model.body_pos[body])
    if parent == model.body_rootid[body]:
        way -= model.body_ipos[parent]
    if not model.body_jntnum[body]:
        return float(np.linalg.norm(way))
    anchor, turned = np.array(model.jnt_pos[model.body_jntadr[body]]), np.zeros(3)
    mujoco.mju_rotVecQuat(turned, anchor, model.body_quat[body])
    return float(np.linalg.norm(way + turned) + np.linalg.norm(anchor)) + _slide(model, body)


def _slide(model: mujoco.MjModel, body: int) -> float:
    """How far [m] a body may slide on its joint: without limits anywhere. Limits are soft, and so count for more."""
    joint = model.body_jntadr[body]
    if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_SLIDE:
        return 0.0
    return 1.2 * float(np.abs(model.jnt_range[joint]).max()) if model.jnt_limited[joint] else np.inf


def obstacles(model: mujoco.MjModel) -> Table:
    """A box for every shape that hangs on the world; one that can move there is everywhere."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    free = set(model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE])
    fixed = [geom for geom in _colliding(model) if model.body_rootid[model.geom_bodyid[geom]] not in free]
    table = np.zeros(len(fixed), OBSTACLE)
    for row, geom in enumerate(fixed):
        turn = data.geom_xmat[geom].reshape(3, 3)
        table["center"][row] = data.geom_xpos[geom] + turn @ model.geom_aabb[geom, :3]
        table["half"][row] = model.geom_aabb[geom, 3:]
        table["axes"][row] = turn.T
        moves = model.body_weldid[model.geom_bodyid[geom]] != 0
        if moves or model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            table["half"][row] = np.inf
    return table


def _colliding(model: mujoco.MjModel) -> IntArray:
    return np.flatnonzero((model.geom_contype != 0) | (model.geom_conaffinity != 0))


@kernel
def contact_free(movers: Table, obstacles: Table, qpos: FloatArray, broadphase: Record) -> bool:
    """Whether nothing can touch anything at `qpos`; `broadphase`, a row of BROADPHASE, is kept between calls."""
    if broadphase.wait > 0:
        broadphase.wait -= 1
        return False
    moved = 0.0
    for mover in movers:
        x, y, z = _middle(mover, qpos)
        dx, dy, dz = x - mover.seen[0], y - mover.seen[1], z - mover.seen[2]
        moved = max(moved, dx * dx + dy * dy + dz * dz)
    if broadphase.clearance > 0.0 and 4.0 * moved < broadphase.clearance * broadphase.clearance:
        return True
    for mover in movers:
        mover.seen[0], mover.seen[1], mover.seen[2] = _middle(mover, qpos)
    broadphase.clearance = min(_from_each_other(movers), _from_obstacles(movers, obstacles))
    broadphase.wait = 0 if broadphase.clearance > 0.0 else _CHECK_PERIOD
    return bool(broadphase.clearance > 0.0)


@kernel
def _middle(mover: Record, qpos: FloatArray) -> tuple[float, float, float]:
    """Return where the middle of a mover's sphere is [m]."""
    at, (x, y, z) = mover.qpos, (mover.middle[0], mover.middle[1], mover.middle[2])
    qw, qx, qy, qz = qpos[at + 3], qpos[at + 4], qpos[at + 5], qpos[at + 6]
    s = 2.0 / (qw * qw + qx * qx + qy * qy + qz * qz)
    cx, cy, cz = qy * z - qz * y, qz * x - qx * z, qx * y - qy * x
    return (
        qpos[at] + x + s * (qw * cx + qy * cz - qz * cy),
        qpos[at + 1] + y + s * (qw * cy + qz * cx - qx * cz),
        qpos[at + 2] + z + s * (qw * cz + qx * cy - qy * cx),
    )


@kernel
def _from_each_other(movers: Table) -> float:
    """Return the least distance [m] between the movers' spheres, at most `MAX_DISTANCE`; rows go from west to east."""
    least = MAX_DISTANCE
    for i in range(1, movers.size):
        at = i
        while at > 0 and _west_edge(movers[at - 1]) > _west_edge(movers[at]):
            _swap(movers[at - 1], movers[at])
            at -= 1
    for n in range(movers.size):
        a = movers[n]
        for m in range(n + 1, movers.size):
            b = movers[m]
            if _west_edge(b) > a.seen[0] + a.radius + least:
                break
            dx, dy, dz = a.seen[0] - b.seen[0], a.seen[1] - b.seen[1], a.seen[2] - b.seen[2]
            least = min(least, math.sqrt(dx * dx + dy * dy + dz * dz) - a.radius - b.radius)
            if least <= 0.0:
                return float(least)
    return float(least)


@kernel
def _west_edge(mover: Record) -> float:
    return float(mover.seen[0] - mover.radius)


@kernel
def _swap(a: Record, b: Record) -> None:
    a.qpos, b.qpos = b.qpos, a.qpos
    a.radius, b.radius = b.radius, a.radius
    for k in range(3):
        a.middle[k], b.middle[k] = b.middle[k], a.middle[k]
        a.seen[k], b.seen[k] = b.seen[k], a.seen[k]


@kernel
def _from_obstacles(movers: Table, obstacles: Table) -> float:
    """Return the least distance [m] between a mover's sphere and a static box; `MAX_DISTANCE` at most."""
    least = MAX_DISTANCE
    for mover in movers:
        for box in obstacles:
            square = 0.0
            dx, dy, dz = (
                mover.seen[0] - box.center[0],
                mover.seen[1] - box.center[1],
                mover.seen[2] - box.center[2],
            )
            for k in range(3):
                along = box.axes[k, 0] * dx + box.axes[k, 1] * dy + box.axes[k, 2] * dz
                gap = max(0.0, abs(along) - box.half[k])
                square += gap * gap
            least = min(least, math.sqrt(square) - mover.radius)
            if least <= 0.0:
                return float(least)
    return float(least)


@kernel
def touch_begins(broadphase: Record, free: bool, hulls: Table, qfrc_constraint: FloatArray) -> bool:
    """Whether a constraint pushes a boat, a contact or what holds it, if `broadphase` is armed; disarm it then.

    `qfrc_constraint` is MuJoCo's, of the step that was just made.
    """
    if broadphase.armed == 0 or free:
        return False
    for i in range(hulls.size):
        for k in range(hulls[i].dof, hulls[i].dof + 6):
            if qfrc_constraint[k] != 0.0:
                broadphase.armed = 0
                return True
    return False
