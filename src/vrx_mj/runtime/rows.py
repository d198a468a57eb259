"""Kernels over the rows of a batch: each row is a world of its own, advanced by the same `advance` as a `Simulation`.

A row has its `MjData` and its part of every table that changes. Tables are stacks, (n, count) records or numbers; those
of which all rows have the same are (1, count).
"""

from typing import Any

import numpy as np
from numba import carray, types
from numba.core import cgutils
from numba.extending import intrinsic

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.libmujoco import c_function
from vrx_mj.physics.kernel import allocating_kernel, kernel
from vrx_mj.physics.motion import motion
from vrx_mj.physics.tables import Record, Table
from vrx_mj.runtime.loop import advance

__all__ = ["FEATURES", "ROW", "advance_rows", "observe_rows", "reset_rows", "write_rows"]


_a = np.int64
ROW = np.dtype(
    [
        ("model", _a), ("quiet", _a), ("data", _a),  # addresses of MuJoCo's objects, and of the data's arrays:
        ("qpos", _a), ("qvel", _a), ("xfrc_applied", _a), ("qfrc_applied", _a), ("qfrc_constraint", _a),
        ("inertia", _a),
    ],
    align=True,
)  # fmt: skip
FEATURES = 13
"""Of a boat: position (3) [m, ENU], quaternion (4), velocity (3) [m/s] and angular velocity (3) [rad/s], body axes."""

mj_reset_data = c_function("mj_resetData", types.void, types.uintp, types.uintp)
mj_forward = c_function("mj_forward", types.void, types.uintp, types.uintp)


@intrinsic  # type: ignore[untyped-decorator]
def _pointer(_context: Any, address: Any) -> Any:
    """An address as a pointer that `carray` takes."""

    def generate(_target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(address), generate


@allocating_kernel
def _of(stack: Any, row: int) -> Any:
    """A row's part of a stack."""
    return stack[row] if stack.shape[0] > 1 else stack[0]


@allocating_kernel
def _numbers(address: int, size: int) -> FloatArray:
    """The array of numbers at an address."""
    return carray(_pointer(address), (size,), np.float64)  # type: ignore[no-any-return]


# fmt: off
@allocating_kernel
def advance_rows(
    first: int, last: int, rows: Table, bodies: int, inertia_size: int, inertia_row: IntArray, qpos: FloatArray,
    qvel: FloatArray, time: FloatArray, done: IntArray, going: BoolArray, sea: Table, waves: Table, wind: Table,
    wind_state: Table, hulls: Table, stations: Table, thrusters: Table, thruster_state: Table, floats: Table,
    elements: Table, float_state: Table, element_state: Table, followers: Table, waypoints: Table,
    follower_state: Table, blocks: Table, block_state: Table, raft_work: Table, moorings: Table, movers: Table,
    obstacles: Table, look: Table, clocks: Table, moments: FloatArray, marks: FloatArray, touches: FloatArray,
    sampling: IntArray, samples: FloatArray, dt: float, steps: int,
) -> None:
    """Advance the rows from `first` up to `last` by `steps` physics steps of `dt` [s].

    `done` holds the steps done of each row, -1 where it has diverged; such a row stands, as one does that is not
    `going`. `qpos` and `qvel`, (n, nq) and (n, nv), and `time` [s], (n,), follow.
    """
    for i in range(first, last):
        if done[i] < 0 or not going[i]:
            continue
        row = rows[i]
        own_qpos, own_qvel = _numbers(row.qpos, qpos.shape[1]), _numbers(row.qvel, qvel.shape[1])
        pushes = carray(_pointer(row.xfrc_applied), (bodies, 6), np.float64)
        done[i] = advance(
            row.model, row.quiet, row.data, own_qpos, own_qvel, pushes, _numbers(row.qfrc_applied, qvel.shape[1]),
            _numbers(row.qfrc_constraint, qvel.shape[1]),
            _numbers(row.inertia, inertia_size), inertia_row,
            sea, _of(waves, i), _of(wind, i), wind_state[i], _of(hulls, i), stations, _of(thrusters, i),
            thruster_state[i], floats, elements, float_state[i], element_state[i], followers,
            waypoints, follower_state[i], blocks, block_state[i], raft_work[i], moorings,
            movers[i], obstacles, look[i], clocks, moments, marks, touches, touches,
            sampling, samples, time[i], dt, steps,
        )
        for _ in range(steps):  # as MuJoCo adds it up
            time[i] += dt
        qpos[i], qvel[i] = own_qpos, own_qvel
# fmt: on


@allocating_kernel
def reset_rows(which: IntArray, rows: Table, qpos: FloatArray, qvel: FloatArray) -> None:
    """Bring MuJoCo's part of some rows back to the start."""
    for i in which:
        mj_reset_data(rows[i].model, rows[i].data)
        mj_forward(rows[i].model, rows[i].data)
        qpos[i], qvel[i] = _numbers(rows[i].qpos, qpos.shape[1]), _numbers(rows[i].qvel, qvel.shape[1])


@allocating_kernel
def write_rows(which: IntArray, rows: Table, qpos: FloatArray, qvel: FloatArray) -> None:
    """Have MuJoCo's part of some rows take over what `qpos` and `qvel` say."""
    for i in which:
        own_qpos, own_qvel = _numbers(rows[i].qpos, qpos.shape[1]), _numbers(rows[i].qvel, qvel.shape[1])
        own_qpos[:], own_qvel[:] = qpos[i], qvel[i]
        mj_forward(rows[i].model, rows[i].data)


@kernel
def observe_rows(first: int, last: int, hulls: Table, qpos: FloatArray, qvel: FloatArray, features: FloatArray) -> None:
    """Write what is seen of every boat of the rows from `first` up to `last` to `features`, (n, boats, FEATURES)."""
    for i in range(first, last):
        for k in range(hulls.shape[1]):
            _observe(hulls[0, k], qpos[i], qvel[i], features[i, k])


@kernel
def _observe(hull: Record, qpos: FloatArray, qvel: FloatArray, out: FloatArray) -> None:
    body = motion(qpos, qvel, hull.qpos, hull.dof)
    for k in range(7):
        out[k] = qpos[hull.qpos + k]
    out[7], out[8], out[9] = body.u, body.v, body.w
    out[10], out[11], out[12] = body.p, body.q, body.r
