"""Floating docks: blocks that hang together by hinges, each afloat on its own. A raft is the tree of a dock's blocks.

Every block has VRX's buoyancy and drag (`flotation`). Its drag, up to 1000 1/s, is too stiff for an explicit force,
and what a block feels at the end of a step depends on all hinges and contacts. So it is implicit in MuJoCo's own
equation of motion: with D = J^T diag(k, k, k_z, kappa, kappa, kappa) J, where J gives a block's velocity and angular
velocity,
    (M + dt D) (v' - v) = dt (f - D v),      the same as      M (v' - v) = dt (f - D v'),
whatever else f holds. `block_load` gives buoyancy and drag at v, `raft_drag` the entries of dt D. Only the small
torque of drag whose centre is not the block's own stays explicit. The springs of a mooring are implicit likewise, with
c + dt s for damping c and stiffness s.

Poses come from `qpos` and `qvel` by forward kinematics. Vectors are in world axes; D is that of motions about the
origin of the root's frame, a velocity and an angular velocity: block matrices simply add up there.
"""

import math

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.drag import row_times
from vrx_mj.physics.flotation import Sums, sums_wrench, water_rise, wet_sums
from vrx_mj.physics.kernel import allocating_kernel, expanded_kernel, kernel
from vrx_mj.physics.kinematics import half_step_back, orbital_motion
from vrx_mj.physics.motion import (
    Arrow,
    Level,
    Motion,
    Vector,
    Wrench,
    add,
    cross,
    minus,
    motion,
    motion_at_rest,
    place_of,
    plus,
    position_of,
    rotate,
    spin_of,
    times,
    unrotate,
    velocity_at,
    velocity_of,
    with_velocity,
    zero_wrench,
)  # fmt: skip
from vrx_mj.physics.tables import Record, Table, Views, Waves
from vrx_mj.physics.waves import surface_height
from vrx_mj.physics.wind import wind_load

_f = np.float64
RAFT_WORK = np.dtype(
    [
        ("frame", _f, (18,)),  # the block's frame and how that moves: a Motion
        ("axis", _f, (6,)),  # velocity of what hangs on the hinge at 1 rad/s: linear at the root's origin, angular
        ("drag", _f, (6, 6)),  # dt D of the block and of all that hangs on it
    ],
    align=True,
)
"""What one step has to know of a block between its kernels; nothing of it is kept for the next."""


@expanded_kernel
def block_load(
    index: int, a: Views, waves: Waves, stream: Level | None, air: Level, time: float,
    dt: float,
) -> Wrench:  # fmt: skip
    """Return buoyancy, drag and wind on a block at its present velocity, about its centre of mass.

    `stream` is the current [m/s], east and north; None in VRX's profiles, whose water is at rest. Where the water moves
    (`sea.moving`) drag is that of the velocity through it, and buoyancy leans with the surface; the wind is then the
    apparent one.

    The blocks that it hangs on come before it. Its row of `work` gets its frame, its hinge's axis and its own drag.
    """
    block, work, sea = a.blocks[index], a.raft_work, a.sea[0]
    frame = _frame(index, a.blocks, work, a.qpos, a.qvel)
    for k in range(18):
        work[index].frame[k] = frame[k]
    body = _motion_at(frame, block.offset)
    height = surface_height(waves, sea, body.x, body.y, time, a.own_waves)
    rise = water_rise(a.block_state[index], height, dt)
    velocity = rotate(body, velocity_of(body))
    sums = _sums_of_step(block, a.elements, a.element_state, body, height, velocity[2] - rise, dt)
    own = work[index].drag
    own[:, :] = 0.0
    _add_drag(own, minus(position_of(body), work[_root(a.blocks, index)].frame), dt * sums.k, dt * sums.kz)
    for k in range(3, 6):
        own[k, k] += dt * sums.kappa
    east, north, lean, breeze = 0.0, 0.0, zero_wrench(), air
    if stream is not None:
        east, north = stream
        if sea.moving != 0:
            past = half_step_back(body, (0.0, 0.0, 0.0), -dt)
            orbital = orbital_motion(waves, sea, body.x, body.y, body.z, time, past=past)
            east, north = east + orbital.u, north + orbital.v
            lift = sums.lift / block.gravity
            breeze = air[0] - velocity[0], air[1] - velocity[1]
            lean = Wrench(lift * orbital.du, lift * orbital.dv, 0.0, 0.0, 0.0, 0.0)
    slip = (velocity[0] - east, velocity[1] - north, velocity[2] - rise)
    pushes = add(sums_wrench(sums, slip, rotate(body, spin_of(body))), wind_load(block.wind, body, breeze))
    return add(pushes, lean)


@kernel
def moor(line: Record, blocks: Table, work: Table, dt: float) -> Wrench:
    """Return the pull of a mooring line on its block, about the block's centre of mass, and add to the block's drag."""
    block, own = blocks[line.block], work[line.block]
    frame = _motion_of(own.frame)
    end = _motion_at(frame, line.point)
    velocity = rotate(end, velocity_of(end))
    damping = line.damping + dt * line.stiffness
    fx = -line.stiffness * (end.x - line.anchor[0]) - damping * velocity[0]
    fy = -line.stiffness * (end.y - line.anchor[1]) - damping * velocity[1]
    origin = work[_root(blocks, line.block)].frame
    _add_drag(own.drag, minus(position_of(end), origin), dt * damping, 0.0)
    x, y, z = minus(position_of(end), place_of(frame, block.offset))
    return Wrench(fx, fy, 0.0, -z * fy, z * fx, x * fy - y * fx)


@allocating_kernel
def raft_drag(blocks: Table, work: Table, inertia: FloatArray, inertia_row: IntArray) -> None:
    """Add dt D to MuJoCo's sparse lower inertia.

    The row of a degree of freedom holds the columns of those that it hangs on, in order: six of the root, then one for
    each hinge on the way.
    """
    force = np.empty(6)
    for index in range(blocks.size - 1, -1, -1):
        block, drag = blocks[index], work[index].drag
        if block.parent < 0:
            _add_root(inertia, inertia_row, block.dof, drag, work[index].frame)
            continue
        above_it, axis = work[block.parent].drag, work[index].axis
        for i in range(6):
            force[i] = row_times(drag[i], axis, axis[3:])
            for j in range(6):
                above_it[i, j] += drag[i, j]
        start = inertia_row[block.dof]
        above = index
        while blocks[above].parent >= 0:
            inertia[start + 5 + blocks[above].depth] += row_times(work[above].axis, force, force[3:])
            above = blocks[above].parent
        for k in range(3):
            inertia[start + k] += force[k]
            inertia[start + 3 + k] += _along(work[above].frame, k, force)


@allocating_kernel
def _add_root(inertia: FloatArray, inertia_row: IntArray, dof: int, drag: FloatArray, frame: FloatArray) -> None:
    """Add a matrix to the block of a free joint: three velocities in world axes, three rates in body axes."""
    column = np.empty(6)
    for i in range(3):
        for j in range(i + 1):
            inertia[inertia_row[dof + i] + j] += drag[i, j]
        for k in range(6):
            column[k] = drag[k, 3] * frame[3 + i] + drag[k, 4] * frame[6 + i] + drag[k, 5] * frame[9 + i]
        for j in range(3):
            inertia[inertia_row[dof + 3 + i] + j] += column[j]
        for j in range(i + 1):
            inertia[inertia_row[dof + 3 + i] + 3 + j] += _along(frame, j, column)


@kernel
def _along(frame: FloatArray, k: int, moment: FloatArray) -> float:
    """Return the share of a moment, the last three of `moment`, about axis k of a frame."""
    return float(frame[3 + k] * moment[3] + frame[6 + k] * moment[4] + frame[9 + k] * moment[5])


@kernel
def _root(blocks: Table, index: int) -> int:
    while blocks[index].parent >= 0:
        index = blocks[index].parent
    return index


@kernel
def _frame(index: int, blocks: Table, work: Table, qpos: FloatArray, qvel: FloatArray) -> Motion:
    """Return the frame of a block and its motion; the hinge's axis goes to `work`."""
    block = blocks[index]
    if block.parent < 0:
        return motion(qpos, qvel, block.qpos, block.dof)
    parent = _motion_of(work[block.parent].frame)
    angle, rate = qpos[block.qpos], qvel[block.dof]
    hinge = _motion_at(parent, plus(block.position, block.anchor))
    turned = _frame_about(hinge, block.axis, math.sin(angle), math.cos(angle), rate)
    frame = _motion_at(turned, times(-1.0, block.anchor))
    axis, origin = rotate(parent, block.axis), work[_root(blocks, index)].frame
    column = work[index].axis
    column[0], column[1], column[2] = cross(minus(position_of(hinge), origin), axis)
    column[3], column[4], column[5] = axis
    return frame


@kernel
def _frame_about(hinge: Motion, axis: FloatArray, sin: float, cos: float, rate: float) -> Motion:
    """Return a frame turned about one of its own axes, a unit vector: v cos + (a x v) sin + a (a.v) (1 - cos)."""
    x, y, z = axis[0], axis[1], axis[2]
    c = 1.0 - cos
    a = rotate(hinge, (cos + x * x * c, z * sin + x * y * c, -y * sin + x * z * c))
    b = rotate(hinge, (-z * sin + x * y * c, cos + y * y * c, x * sin + y * z * c))
    d = rotate(hinge, (y * sin + x * z * c, -x * sin + y * z * c, cos + z * z * c))
    velocity, spin = rotate(hinge, velocity_of(hinge)), rotate(hinge, plus(spin_of(hinge), times(rate, axis)))
    rows = (a[0], b[0], d[0], a[1], b[1], d[1], a[2], b[2], d[2])
    frame = motion_at_rest(position_of(hinge), rows)
    return with_velocity(frame, unrotate(frame, velocity), unrotate(frame, spin))


@kernel
def _motion_at(m: Motion, point: Arrow) -> Motion:
    """Return the motion of a frame's parallel at a point of it [m], body axes."""
    return Motion(*place_of(m, point), *m[3:12], *velocity_at(m, point), *spin_of(m))


@kernel
def _motion_of(frame: FloatArray) -> Motion:
    return Motion(*to_fixed_tuple(frame, 18))


@kernel
def _sums_of_step(
    block: Record, elements: Table, water: Table, body: Motion, height: float, slip: float, dt: float
) -> Sums:
    """Return what the wet elements add up to; those that would pull down at the end of the step, alone, let go.

    `slip` is the block's upward velocity relative to the water [m/s].
    """
    lowest = -math.inf
    center = (0.0, 0.0, 0.0)
    for _ in range(block.element_count + 1):
        sums = wet_sums(block, elements, water, body, center, height + block.level, lowest, block.gravity)
        end = (slip + dt * (sums.lift / block.mass - block.gravity)) / (1.0 + dt * sums.kz / block.mass)
        if end <= sums.limit:
            break
        lowest = sums.limit
    return sums


@kernel
def _add_drag(matrix: FloatArray, point: Vector, k: float, kz: float) -> None:
    """Add J^T diag(k, k, kz) J of a point's velocity to a matrix of motions about the origin."""
    x, y, z = point
    matrix[0, 0] += k
    matrix[1, 1] += k
    matrix[2, 2] += kz
    _add_pair(matrix, 0, 4, k * z)
    _add_pair(matrix, 0, 5, -k * y)
    _add_pair(matrix, 1, 3, -k * z)
    _add_pair(matrix, 1, 5, k * x)
    _add_pair(matrix, 2, 3, kz * y)
    _add_pair(matrix, 2, 4, -kz * x)
    matrix[3, 3] += k * z * z + kz * y * y
    matrix[4, 4] += k * z * z + kz * x * x
    matrix[5, 5] += k * (x * x + y * y)
    _add_pair(matrix, 3, 4, -kz * x * y)
    _add_pair(matrix, 3, 5, -k * x * z)
    _add_pair(matrix, 4, 5, -k * y * z)


@kernel
def _add_pair(matrix: FloatArray, i: int, j: int, value: float) -> None:
    """Add to a symmetric matrix off its diagonal."""
    matrix[i, j] += value
    matrix[j, i] += value
