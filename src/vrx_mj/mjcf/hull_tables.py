"""Tables of the models of hulls in profile `marine`, as the kernels read them."""

import functools
import itertools
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray
from vrx_mj.model import tables
from vrx_mj.model.boats import Vessel
from vrx_mj.physics.drift import ENTRY
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.physics.panels import Panels, panels_of
from vrx_mj.physics.tables import Table
from vrx_mj.physics.vessel import HullMeshes
from vrx_mj.physics.wave_box import LEVELS, ROWS, SHALLOW_LEVELS, SLENDER_ROWS

_T = TypeVar("_T")


class HullTables(NamedTuple):
    """Models of hulls; what each has in other tables follows that of the one before."""

    vessels: Table
    """`tables.VESSEL`"""
    strips: Table
    """`tables.STRIP`"""
    memory: Table
    """`tables.MEMORY`"""
    resistances: Table
    """`tables.RESISTANCE`"""
    diffraction: FloatArray
    """Forces of waves on vessels, (n, ENTRY): see `vessel.diffraction_load`."""
    drift: FloatArray
    """What the mean of the forces on vessels lacks, (n, ENTRY): see `drift.drift_load`."""
    meshes: HullMeshes
    """Meshes of all vessels."""


def hull_tables(kinds: Sequence[Vessel]) -> HullTables:
    """Return the tables of kinds of hulls."""
    meshes = [_mesh(kind) for kind in kinds]
    waves, means = [_diffraction(kind) for kind in kinds], [_drift(kind) for kind in kinds]
    rows: dict[str, list[Any]] = {
        "point": [mesh.points.T for mesh in meshes], "pair": [mesh.pairs for mesh in meshes],
        "part": [mesh.parts for mesh in meshes], "strip": [kind.strips for kind in kinds],
        "memory": [kind.memory for kind in kinds], "diffraction": [own.reshape(-1, ENTRY) for own in waves],
        "resistance": [kind.resistance for kind in kinds], "drift": [own.reshape(-1, ENTRY) for own in means],
    }  # fmt: skip
    columns: dict[str, Any] = {f"{name}_start": starts(own)[:-1] for name, own in rows.items()}
    columns |= {f"{name}_count": list(map(len, own)) for name, own in rows.items()}
    vessels = tables.table_of(
        tables.VESSEL,
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
        tables.table_of(tables.STRIP, flat(rows["strip"])),
        tables.table_of(tables.MEMORY, flat(rows["memory"])),
        np.array(flat(rows["resistance"]), tables.RESISTANCE),
        _in_lines(rows["diffraction"]).reshape(-1, ENTRY),
        _in_lines(rows["drift"]).reshape(-1, ENTRY),
        HullMeshes(
            tables.table_of(tables.PART, flat(rows["part"])),
            _in_lines([mesh.points for mesh in meshes]),
            _in_lines([mesh.shares for mesh in meshes]),
            np.concatenate([np.zeros((0, 4), np.uint32), *(mesh.pairs for mesh in meshes)]),
            _in_lines([mesh.corner_shares for mesh in meshes]).reshape(-1, 6, WIDTH),
        ),
    )


def _diffraction(kind: Vessel) -> FloatArray:
    """Forces of waves on a hull, (frequencies, angles, ENTRY), up to a full turn."""
    found = np.zeros((0, 0, ENTRY))
    if kind.diffraction:
        forces = _around(kind.diffraction.forces)
        found = np.zeros((*forces.shape[:2], ENTRY))
        found[:, :, :6], found[:, :, WIDTH : WIDTH + 6] = forces[:, :, :6], forces[:, :, 6:]
    return found


def _drift(kind: Vessel) -> FloatArray:
    """What the forces on a hull lack, (frequencies, angles, ENTRY), up to a full turn."""
    if not kind.drift:
        return np.zeros((0, 0, ENTRY))
    forces = _around(kind.drift.forces)
    return np.pad(forces, ((0, 0), (0, 0), (0, ENTRY - forces.shape[2])))


def _around(values: npt.ArrayLike) -> FloatArray:
    """Values (frequencies, angles, n) with those of the first angle once more at the end."""
    return np.asarray(np.pad(values, ((0, 0), (0, 1), (0, 0)), mode="wrap"), np.float64)


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
