"""Kernels over the rows of a batch: each row is a run of its own, advanced by the same `advance` as a `Simulation`.

A row has its `MjData` and its part of every table that changes.
"""

from numba import types

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.libmujoco import c_function
from vrx_mj.physics.kernel import allocating_kernel, kernel
from vrx_mj.physics.motion import motion
from vrx_mj.physics.tables import Record, Table
from vrx_mj.runtime.loop import advance
from vrx_mj.runtime.views import views

__all__ = ["FEATURES", "advance_rows", "observe_rows", "reset_rows", "write_rows"]

FEATURES = 13
"""Of a boat: position (3) [m, ENU], quaternion (4), velocity (3) [m/s] and angular velocity (3) [rad/s], body axes."""

mj_reset_data = c_function("mj_resetData", types.void, types.uintp, types.uintp)
mj_forward = c_function("mj_forward", types.void, types.uintp, types.uintp)


@allocating_kernel
def advance_rows(
    first: int, last: int, runs: Table, qpos: FloatArray, qvel: FloatArray, time: FloatArray, done: IntArray,
    going: BoolArray, dt: float, steps: int,
) -> None:  # fmt: skip
    """Advance the rows from `first` up to `last` by `steps` physics steps of `dt` [s].

    `done` holds the steps done of each row, -1 where it has diverged; such a row stands, as one does that is not
    `going`. `qpos` and `qvel`, (n, nq) and (n, nv), and `time` [s], (n,), follow.
    """
    for i in range(first, last):
        if done[i] < 0 or not going[i]:
            continue
        done[i] = advance(runs, i, time[i], dt, steps)
        for _ in range(steps):  # as MuJoCo adds it up
            time[i] += dt
        own = views(runs[i])
        qpos[i], qvel[i] = own.qpos, own.qvel


@allocating_kernel
def reset_rows(which: IntArray, runs: Table, qpos: FloatArray, qvel: FloatArray) -> None:
    """Bring MuJoCo's part of some rows back to the start."""
    for i in which:
        mj_reset_data(runs[i].model, runs[i].data)
        mj_forward(runs[i].model, runs[i].data)
        own = views(runs[i])
        qpos[i], qvel[i] = own.qpos, own.qvel


@allocating_kernel
def write_rows(which: IntArray, runs: Table, qpos: FloatArray, qvel: FloatArray) -> None:
    """Write the rows' `qpos` and `qvel` into MuJoCo's part of them."""
    for i in which:
        own = views(runs[i])
        own.qpos[:], own.qvel[:] = qpos[i], qvel[i]
        mj_forward(runs[i].model, runs[i].data)


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
