"""The tables of the compiled loop: a column for each number of a world's dataclasses, and what a run adds to them.

SI units; the fields of the dataclasses have units and meanings. "Body axes" are forward, left, up, fixed to the link;
"world axes" are east, north, up. `qpos` and `dof` are the addresses of a free joint (or, for an engine, of its hinge)
in MuJoCo's `qpos` and `qvel`; `body` is a body's number. `..._start` and `..._count` are consecutive rows of a table.

Tables of the hulls' own models in profile `marine` are here as well.
"""

import functools
import itertools
from collections.abc import Iterable, Sequence
from types import UnionType
from typing import Annotated, Any, NamedTuple, TypeVar, Union, get_args, get_origin

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.model.boats import (
    Diffraction,
    Drift,
    Hull,
    Memory,
    Propeller,
    ResistancePoint,
    SailPoint,
    Station,
    Strip,
    Thruster,
    ThrustPoint,
    Vessel,
)
from vrx_mj.model.kinds import Parts
from vrx_mj.model.things import Block, Element, Float, Follower, Mooring, PathPoint, Rope
from vrx_mj.model.water import Air, Current, Layer, Sea, Wave, Wind
from vrx_mj.physics.drift import ENTRY
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.physics.panels import Panels, Part, panels_of
from vrx_mj.physics.tables import Table
from vrx_mj.physics.vessel import HullMeshes
from vrx_mj.physics.wave_box import LEVELS, ROWS, SHALLOW_LEVELS, SLENDER_ROWS
from vrx_mj.physics.wind import WindageRow

_Column = tuple[type, tuple[int, ...]]
_i, _u, _f = np.int64, np.uint64, np.float64
_JOINT = {"body": _i, "qpos": _i, "dof": _i}
_T = TypeVar("_T")


def form(kind: Any) -> _Column | None:
    """Type and shape of the column for values of a kind; None for what is no number, or a list of any length."""
    own, inner = get_origin(kind), get_args(kind)
    if own in {Annotated, Union, UnionType}:
        return form(inner[0])
    if own is tuple and inner[-1] is not ...:
        parts = [form(part) for part in inner]
        return (parts[0][0], (len(parts), *parts[0][1])) if parts[0] else None
    return {float: (_f, ()), int: (_i, ())}.get(kind)


def _record(*kinds: Any, **more: Any) -> np.dtype[np.void]:
    """Records of the numbers of a dataclass, or of the parts of a tuple, and of more columns."""
    columns: dict[str, Any] = {}
    for kind in kinds:
        marks = [mark for mark in getattr(kind, "__metadata__", ()) if isinstance(mark, Parts)]
        named = zip(marks[0].names, get_args(get_args(kind)[0]), strict=True) if marks else kind.__annotations__.items()
        columns |= {name: own for name, of in named if (own := form(of))}
    columns |= {name: own if isinstance(own, tuple) else (own, ()) for name, own in more.items()}
    return np.dtype([(name, *own) for name, own in columns.items()], align=True)


def _rows(*names: str) -> dict[str, type[np.int64]]:
    """Columns of what a row has in other tables."""
    return {f"{name}_{column}": _i for name in names for column in ("start", "count")}


WAVE = _record(
    Wave,
    phase=_f,  # at the origin at time 0 [rad]: 0 in VRX's seas, unless a batch varies it
)
SEA = _record(Sea)
CURRENT = _record(
    Current,
    key=_u,  # of its stream of random numbers
)
LAYER = _record(Layer)
WIND = _record(Wind, key=_u)
AIR = _record(Air, key=_u)
GUST_BAND = _record(
    frequency=_f,  # angular [rad/s]
    phase=_f,  # at time 0 [rad]
)
HULL = _record(
    Hull,
    **_JOINT,
    **_rows("windage"),  # by the angle of the wind; none: it has the coefficients `wind`
    windage_height=_f,  # of the point where the wind acts, over the link's origin [m]
    windage_offset=_f,  # of that point ahead of the link's origin [m]
    spread=(_f, (2,)),  # second moments of its waterplane over the area, along and across [m2]
    vessel=_i,  # row of VESSEL; -1: stations carry it, and it has its own added mass and drag
    memory_start=_i,  # its rows of MEMORY_STATE, as many as its vessel has of MEMORY
    drift_state=_i,  # its row of DRIFT_STATE; -1: it has none
)
PART = _record(Part)
VESSEL = _record(
    Vessel,
    **_rows(
        "point", "pair", "part", "strip", "memory", "diffraction", "drift"
    ),  # pairs count points from the mesh's first
    **_rows("resistance"),  # by rising speed; none: damping in surge
    half=(_f, (3,)),  # half sides of the box of a part [m]
    wave_rows=_i,  # nodes of that box for the waves, across and over the depth
    wave_levels=_i,
    diffraction_frequencies=_i,  # 0: it has none, and feels the water's acceleration with its added mass
    diffraction_angles=_i,  # from 0 to a full turn
    diffraction_step=_f,  # between its frequencies [rad/s]
    drift_angles=_i,  # from 0 to a full turn
    drift_step=_f,  # between its frequencies [rad/s]
)
STRIP = _record(Strip)
RESISTANCE = _record(ResistancePoint)
MEMORY = _record(Memory)
WINDAGE = _record(WindageRow)
STATION = _record(Station)
THRUSTER = _record(
    Thruster,
    **_JOINT,  # the engine's body, the hull's own when it has no hinge; -1: no hinge
    gain=_f,  # factor of its force: 1, unless a batch varies it
    measured=_i,  # row of PROPELLER, and of its state; -1: `mapping` gives the force
    **_rows("curve"),  # a sail's, by rising angle
    sheeted=_i,  # 1: a sheet lets the boom of a sail to lee by its angle; 0: it goes to that
)
SAIL_CURVE = _record(SailPoint)
PROPELLER = _record(
    Propeller,
    full_ahead=_f,  # largest thrust at rest [N]
    full_astern=_f,  # [N], at most 0
    **_rows("point"),  # by rising command
    **_rows("quadrant"),  # at even angles of advance, from -pi to pi; none: thrust goes with `vanishing_speed`
)
QUADRANT = _record(
    thrust=_f,  # C_T*
    torque=_f,  # C_Q*
)
PROPELLER_POINT = _record(ThrustPoint)
FLOAT = _record(Float, **_JOINT)
ELEMENT = _record(Element)
BLOCK = _record(Block, **_JOINT)
MOORING = _record(Mooring)
ROPE = _record(Rope)
FOLLOWER = _record(Follower)
WAYPOINT = _record(PathPoint)

MEMORY_STATE = _record(
    real=_f,  # [m], [rad]
    imaginary=_f,
)
DRIFT_STATE = _record(
    left=_i,  # steps for which the force holds, and one more; 0 until it was computed once
    u=_f,  # slow velocity through the water, ahead [m/s]
    v=_f,  # to the left [m/s]
    surge=_f,  # force that holds, in the hull's heading [N]
    sway=_f,
    yaw=_f,  # moment about the link's origin [N m]
)
THRUSTER_STATE = _record(
    command=_f,
    expires=_f,  # time up to which the command holds [s]
    angle_target=_f,  # [rad]
    angle=_f,  # steering angle [rad]
    rate=_f,  # [rad/s]
    thrust=_f,  # applied in the last step [N]
    applied=_f,  # the command that `thrust` belongs to; of a sail, the force along its chord [N]
    fresh=_i,  # 0 until `thrust` has been computed once
)
PROPELLER_STATE = _record(
    thrust=_f,  # at rest, after the lag [N]
    energy=_f,  # electric, drawn so far [J]
)
FLOAT_STATE = _record(
    height=_f,  # `surface_height` at the link origin in the step before [m]; VRX starts with `FLOAT.level`
    held=_i,  # 1: it is kept where it is, out of the water's reach
)
FOLLOWER_STATE = _record(
    target=_i,  # which of its waypoints it is bound for, from 0
)
ELEMENT_STATE = _record(
    height=_f,  # `surface_height` at the element in the step before [m]; 0 where the link's counts
    rise=_f,  # vertical velocity of the water there [m/s]; 0 where the link's counts
)
CURRENT_STATE = _record(
    east=_f,  # random part [m/s]
    north=_f,
    counter=_u,  # steps so far
)
AIR_STATE = _record(
    deviation=_f,  # random part of the direction [rad]
    angle=_f,  # by which the wind blows off `WIND.direction` [rad], counter-clockwise
    counter=_u,  # steps so far
)
WIND_STATE = _record(
    gust=_f,  # deviation from the mean speed [m/s]
    speed=_f,  # mean + gust [m/s]; may be negative
    counter=_u,  # random numbers drawn so far
)


def table_of(dtype: np.dtype[np.void], rows: Sequence[object], **columns: npt.ArrayLike) -> Table:
    """Return a table of `rows`: their attributes by the names of its columns, but for those that are given as arrays.

    Raises:
        AttributeError: a row has no attribute of a column's name.
        ValueError: a value does not have the shape of its column.
    """
    filled = np.zeros(len(rows), dtype)
    for name in dtype.names or () if rows else ():
        values = np.asarray(columns[name] if name in columns else [getattr(row, name) for row in rows])
        if values.shape != filled[name].shape:
            raise ValueError(f"{name} has shape {values.shape}, not {filled[name].shape}")
        filled[name] = values
    return filled


class HullTables(NamedTuple):
    """Models of hulls; what each has in other tables follows that of the one before."""

    vessels: Table
    """`VESSEL`"""
    strips: Table
    """`STRIP`"""
    memory: Table
    """`MEMORY`"""
    resistances: Table
    """`RESISTANCE`"""
    diffraction: FloatArray
    """Forces of waves on vessels, (n, ENTRY): see `vessel.diffraction_load`."""
    drift: FloatArray
    """What the mean of the forces on vessels lacks, (n, ENTRY): see `drift.drift_load`."""
    meshes: HullMeshes
    """Meshes of all vessels."""


def hull_tables(kinds: Sequence[Vessel]) -> HullTables:
    """Return the tables of kinds of hulls."""
    meshes = [_mesh(kind) for kind in kinds]
    waves, means = [_entries(kind.diffraction, 2) for kind in kinds], [_entries(kind.drift, 1) for kind in kinds]
    rows: dict[str, list[Any]] = {
        "point": [mesh.points.T for mesh in meshes], "pair": [mesh.pairs for mesh in meshes],
        "part": [mesh.parts for mesh in meshes], "strip": [kind.strips for kind in kinds],
        "memory": [kind.memory for kind in kinds], "diffraction": [own.reshape(-1, ENTRY) for own in waves],
        "resistance": [kind.resistance for kind in kinds], "drift": [own.reshape(-1, ENTRY) for own in means],
    }  # fmt: skip
    columns: dict[str, Any] = {f"{name}_start": starts(own)[:-1] for name, own in rows.items()}
    columns |= {f"{name}_count": list(map(len, own)) for name, own in rows.items()}
    vessels = table_of(
        VESSEL,
        kinds,
        **columns,
        half=[mesh.half for mesh in meshes],
        wave_rows=[SLENDER_ROWS if mesh.is_slender else ROWS for mesh in meshes],
        wave_levels=[SHALLOW_LEVELS if mesh.is_shallow else LEVELS for mesh in meshes],
        diffraction_frequencies=[own.shape[0] for own in waves],
        diffraction_angles=[own.shape[1] for own in waves],
        diffraction_step=[kind.diffraction.step if kind.diffraction else 0.0 for kind in kinds],
        drift_angles=[own.shape[1] for own in means],
        drift_step=[kind.drift.step if kind.drift else 0.0 for kind in kinds],
    )
    return HullTables(
        vessels,
        table_of(STRIP, flat(rows["strip"])),
        table_of(MEMORY, flat(rows["memory"])),
        np.array(flat(rows["resistance"]), RESISTANCE),
        _in_lines(rows["diffraction"]).reshape(-1, ENTRY),
        _in_lines(rows["drift"]).reshape(-1, ENTRY),
        HullMeshes(
            table_of(PART, flat(rows["part"])),
            _in_lines([mesh.points for mesh in meshes]),
            _in_lines([mesh.shares for mesh in meshes]),
            np.concatenate([np.zeros((0, 4), np.uint32), *(mesh.pairs for mesh in meshes)]),
            _in_lines([mesh.corner_shares for mesh in meshes]).reshape(-1, 6, WIDTH),
        ),
    )


def _entries(own: Diffraction | Drift | None, parts: int) -> FloatArray:
    """Forces by frequency and angle up to a full turn, (frequencies, angles, ENTRY), in so many parts of one width."""
    if own is None:
        return np.zeros((0, 0, ENTRY))
    around = np.pad(np.array(own.forces), ((0, 0), (0, 1), (0, 0)), mode="wrap")
    room = ENTRY // parts
    pieces = np.split(around, parts, axis=2)
    return np.concatenate([np.pad(piece, ((0, 0), (0, 0), (0, room - piece.shape[2]))) for piece in pieces], axis=2)


def starts(lists: Iterable[Sequence[object]]) -> list[int]:
    """Where each of some lists begins that lie one after another, and where the last one ends."""
    return list(itertools.accumulate(map(len, lists), initial=0))


def flat(lists: Iterable[Sequence[_T]]) -> list[_T]:
    """Lists one after another."""
    return list(itertools.chain.from_iterable(lists))


def nested_tuples(values: npt.NDArray[Any]) -> Any:
    """Numbers of an array as tuples in each other, as records have them."""
    return tuple(map(nested_tuples, values)) if values.ndim > 1 else tuple(values.tolist())


@functools.lru_cache(maxsize=32)
def _mesh(kind: Vessel) -> Panels:
    """The mesh of a hull's model: the loop's arrays are made anew with every boat that comes or goes."""
    vertices, triangles = np.array(kind.vertices, np.float64), np.array(kind.triangles, np.int64)
    return panels_of(vertices.reshape(-1, 3), triangles.reshape(-1, 3))


def _in_lines(parts: Sequence[FloatArray]) -> FloatArray:
    """The numbers of arrays one after another, from where a line of the cache begins: `lanes.zeros_in_lines`."""
    numbers = np.concatenate([np.zeros(0), *map(np.ravel, parts)])
    room = np.empty(numbers.size + WIDTH)
    start = -(room.ctypes.data // room.itemsize) % WIDTH
    lines = room[start : start + numbers.size]
    lines[:] = numbers
    return lines
