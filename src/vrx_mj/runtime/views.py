"""The one list of all arrays that a run of the compiled loop reads and writes, and how the loop finds them.

Python hands the loop one record for each run, with the address and the shape of every array; `views` turns it into a
tuple of arrays. So a call costs the same whatever a run consists of, the rows of a batch are records of one table, and
whatever only passes arrays on does not list them. Whoever makes a record keeps its arrays alive.
"""

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.extending import intrinsic

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.model import tables
from vrx_mj.physics.free_body import FREE_BODY, SOLVE_WORK
from vrx_mj.physics.raft import RAFT_WORK
from vrx_mj.physics.tables import Table
from vrx_mj.runtime.proximity import BROADPHASE, MOVER, OBSTACLE
from vrx_mj.runtime.timing import CLOCK

PARAMETER, STATE, OWN = "parameter", "state", "own"
"""What an array is: the same for all runs of a world; part of a saved state; or else a run's own."""


class Array(NamedTuple):
    """Type of an array of the loop."""

    dtype: np.dtype[Any] = np.dtype(np.float64)
    ndim: int = 1
    use: str = PARAMETER
    rows: str = ""
    """Table of which a table of state has a row for each row."""


_Vector = Annotated[FloatArray, Array()]
_Matrix = Annotated[FloatArray, Array(ndim=2)]
_Indices = Annotated[IntArray, Array(np.dtype(np.int32))]


class Views(NamedTuple):
    """The arrays of a run: MuJoCo's, then the tables of `model.tables`, then what sensors and recorders keep."""

    qpos: _Vector
    qvel: _Vector
    xfrc_applied: _Matrix
    qfrc_applied: _Vector
    qfrc_constraint: _Vector
    qacc_smooth: _Vector
    inertia: _Vector
    """`mjData.M`, the sparse lower triangle."""
    inertia_row: _Indices
    """`mjModel.M_rowadr`."""
    dof_parent: _Indices
    """`mjModel.dof_parentid`."""
    body_root: _Indices
    """`mjModel.body_rootid`."""
    xpos: _Matrix
    xmat: _Matrix
    subtree_com: _Matrix
    cdof: _Matrix
    sensordata: _Vector
    sea: Annotated[Table, Array(tables.SEA)]
    waves: Annotated[Table, Array(tables.WAVE)]
    own_waves: _Vector
    """`physics.tables.OwnWaves`."""
    current: Annotated[Table, Array(tables.CURRENT)]
    """At most one row."""
    current_state: Annotated[Table, Array(tables.CURRENT_STATE, use=STATE, rows="current")]
    layers: Annotated[Table, Array(tables.LAYER)]
    wind: Annotated[Table, Array(tables.WIND)]
    wind_state: Annotated[Table, Array(tables.WIND_STATE, use=STATE, rows="wind")]
    gust_bands: Annotated[Table, Array(tables.GUST_BAND)]
    air: Annotated[Table, Array(tables.AIR)]
    """At most one row."""
    air_state: Annotated[Table, Array(tables.AIR_STATE, use=STATE, rows="air")]
    hulls: Annotated[Table, Array(tables.HULL)]
    windage: Annotated[Table, Array(tables.WINDAGE)]
    vessels: Annotated[Table, Array(tables.VESSEL)]
    parts: Annotated[Table, Array(tables.PART)]
    points: _Vector
    """Points of the meshes of vessels; this and the three that follow are `vessel.HullMeshes`."""
    shares: _Vector
    pairs: Annotated[IntArray, Array(np.dtype(np.uint32), ndim=2)]
    corner_shares: Annotated[FloatArray, Array(ndim=3)]
    strips: Annotated[Table, Array(tables.STRIP)]
    resistances: Annotated[Table, Array(tables.RESISTANCE)]
    memory: Annotated[Table, Array(tables.MEMORY)]
    memory_state: Annotated[Table, Array(tables.MEMORY_STATE, use=STATE)]
    diffraction: _Matrix
    """Forces of diffraction on vessels, (n, ENTRY): see `vessel.diffraction_load`."""
    drift: _Matrix
    """What the mean of the forces on vessels lacks, (n, ENTRY): see `drift.drift_load`."""
    drift_state: Annotated[Table, Array(tables.DRIFT_STATE, use=STATE)]
    stations: Annotated[Table, Array(tables.STATION)]
    thrusters: Annotated[Table, Array(tables.THRUSTER)]
    thruster_state: Annotated[Table, Array(tables.THRUSTER_STATE, use=STATE, rows="thrusters")]
    propellers: Annotated[Table, Array(tables.PROPELLER)]
    propeller_points: Annotated[Table, Array(tables.PROPELLER_POINT)]
    quadrants: Annotated[Table, Array(tables.QUADRANT)]
    sail_curves: Annotated[Table, Array(tables.SAIL_CURVE)]
    propeller_state: Annotated[Table, Array(tables.PROPELLER_STATE, use=STATE, rows="propellers")]
    floats: Annotated[Table, Array(tables.FLOAT)]
    elements: Annotated[Table, Array(tables.ELEMENT)]
    float_state: Annotated[Table, Array(tables.FLOAT_STATE, use=STATE, rows="floats")]
    element_state: Annotated[Table, Array(tables.ELEMENT_STATE, use=STATE, rows="elements")]
    followers: Annotated[Table, Array(tables.FOLLOWER)]
    waypoints: Annotated[Table, Array(tables.WAYPOINT)]
    follower_state: Annotated[Table, Array(tables.FOLLOWER_STATE, use=STATE, rows="followers")]
    blocks: Annotated[Table, Array(tables.BLOCK)]
    block_state: Annotated[Table, Array(tables.FLOAT_STATE, use=STATE, rows="blocks")]
    links: Annotated[Table, Array(tables.FLOAT)]
    link_state: Annotated[Table, Array(tables.FLOAT_STATE, use=STATE, rows="links")]
    raft_work: Annotated[Table, Array(RAFT_WORK, use=OWN)]
    moorings: Annotated[Table, Array(tables.MOORING)]
    ropes: Annotated[Table, Array(tables.ROPE)]
    free_bodies: Annotated[Table, Array(FREE_BODY)]
    """Everything that moves, where a batch steps without MuJoCo while nothing can touch; else none."""
    solve_work: Annotated[Table, Array(SOLVE_WORK, use=OWN)]
    touches: Annotated[FloatArray, Array(use=STATE)]
    """Time [s] of the last contact that each of MuJoCo's contact sensors found."""
    movers: Annotated[Table, Array(MOVER, use=OWN)]
    obstacles: Annotated[Table, Array(OBSTACLE)]
    broadphase: Annotated[Table, Array(BROADPHASE, use=OWN)]
    clocks: Annotated[Table, Array(CLOCK)]
    latched: Annotated[FloatArray, Array(ndim=3)]
    device_state: _Vector
    sampling: Annotated[IntArray, Array(np.dtype(np.int64))]
    samples: _Matrix


ARRAYS: Mapping[str, Array] = {
    name: hint.__metadata__[0] for name, hint in get_type_hints(Views, include_extras=True).items()
}
"""Types of the arrays of a run by name, in the order of `Views`."""

RUN = np.dtype(
    [(name, np.int64) for name in ("model", "contact_free", "data")]
    + [(name, np.int64, (1 + array.ndim,)) for name, array in ARRAYS.items()]
)
"""A run: the addresses of its MuJoCo model, of the model without collision shapes and of its data; and of each array
the address, then the shape."""


def point(run: Table, **arrays: npt.NDArray[np.generic]) -> None:
    """Write where these arrays are into a table of one run."""
    for name, array in arrays.items():
        _check(name, array, ARRAYS[name].ndim)
        run[name][0] = (array.ctypes.data, *array.shape)


def point_rows(runs: Table, **stacks: npt.NDArray[np.generic]) -> None:
    """Write where the parts of these stacks, (n, ...) or (1, ...) for all rows, are into a table of n runs."""
    for name, stack in stacks.items():
        _check(name, stack, 1 + ARRAYS[name].ndim)
        steps = np.arange(len(runs)) * stack.strides[0] if len(stack) > 1 else 0
        runs[name][:, 0] = stack.ctypes.data + steps
        runs[name][:, 1:] = stack.shape[1:]


def _check(name: str, array: npt.NDArray[np.generic], ndim: int) -> None:
    assert array.dtype == ARRAYS[name].dtype, (name, array.dtype)
    assert array.ndim == ndim, (name, array.shape)
    assert array.flags.c_contiguous, name


@intrinsic  # type: ignore[untyped-decorator]
def views(_context: Any, run: Any) -> Any:
    """The arrays of a run, a row of RUN, as `Views`; `own_waves` is None, for loops that merged it into their waves."""
    return _views(run, "own_waves")


@intrinsic  # type: ignore[untyped-decorator]
def row_views(_context: Any, run: Any) -> Any:
    """All arrays of a run."""
    return _views(run)


def _views(run: Any, *without: str) -> Any:
    """Signature and code of an intrinsic that makes `Views`."""
    kinds = [
        types.none if name in without else types.Array(from_dtype(array.dtype), array.ndim, "C")
        for name, array in ARRAYS.items()
    ]
    word = ir.IntType(64)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from numba.np.arrayobj import populate_array  # takes a while, and kernels from the cache do without

        found = []
        for name, kind in zip(ARRAYS, kinds, strict=True):
            if name in without:
                found.append(context.get_dummy_value())
                continue
            start = run.offset(name)
            address, *shape = (
                builder.load(cgutils.get_record_member(builder, arguments[0], start + 8 * k, word))
                for k in range(1 + kind.ndim)
            )
            array = context.make_array(kind)(context, builder)
            size = context.get_abi_sizeof(context.get_data_type(kind.dtype))
            strides = [ir.Constant(word, size)]
            for length in reversed(shape[1:]):
                strides.insert(0, builder.mul(strides[0], length))
            data = builder.inttoptr(address, array.data.type)
            itemsize = context.get_constant(types.intp, size)
            populate_array(array, data=data, shape=shape, strides=strides, itemsize=itemsize, meminfo=None)
            found.append(array._getvalue())
        return context.make_tuple(builder, signature.return_type, found)

    return types.NamedTuple(kinds, Views)(run), generate
