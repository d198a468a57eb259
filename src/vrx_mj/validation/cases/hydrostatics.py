"""Hulls in still water: stiffness of barges, and meshes upright, heeled and trimmed."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.frames import rotation
from vrx_mj.mjcf.hull_sheet import HullSheet, hull_sheet
from vrx_mj.physics.panel_mesh import panels_of
from vrx_mj.physics.panels import wrench_of_still_water
from vrx_mj.validation.reference import mesh, rows
from vrx_mj.validation.rows import Outcome, case, near
from vrx_mj.validation.setups import GRAVITY

_MESH_FILES = ("physics/panels.py", "mjcf/hull_sheet.py")
STIFFNESSES = (("C33, heave", "N/m"), ("C44, roll", "N m/rad"), ("C55, pitch", "N m/rad"))
"""Names and units of what `box_stiffness` returns."""
_Mesh = tuple[FloatArray, IntArray]
_Barge = tuple[float, float, float, float, float]
_BARGES: tuple[_Barge, ...] = ((4.0, 2.0, 0.5, 1025.0, 0.5), (10.0, 4.0, 1.0, 1000.0, 1.5))
"""Length, beam, draft [m], density of the water [kg/m3], and height of the centre of mass over the keel [m]."""
_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)])
_FACES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
     (1, 5, 7), (1, 7, 3)], np.int64
)  # fmt: skip


def _box_sheet(length: float, beam: float, draft: float, density: float, kg: float) -> HullSheet:
    """The hydrostatics of a box by its mesh, which is three drafts high; its keel is at z = 0."""
    corners = (_CORNERS * (length, beam, 3.0 * draft))[_FACES]
    return hull_sheet(corners, density * length * beam * draft, (0.0, 0.0, kg), density, GRAVITY)


def box_stiffness(length: float, beam: float, draft: float, density: float, kg: float) -> tuple[float, float, float]:
    """C33 [N/m], C44 and C55 [N m/rad] of a box in closed form."""
    weight, volume, lever = density * GRAVITY, length * beam * draft, 0.5 * draft - kg
    across, along = length * beam**3 / 12.0, beam * length**3 / 12.0
    return weight * length * beam, weight * (across + volume * lever), weight * (along + volume * lever)


def _pressed_stiffness(length: float, beam: float, draft: float, density: float, kg: float) -> tuple[float, ...]:
    """C33, C44 and C55 of the box's mesh, by the water's pressure about its centre of mass."""
    hull, step = (_CORNERS * (length, beam, 3.0 * draft) - (0.0, 0.0, kg), _FACES), 1e-4
    moves = ((0.0, 0.0, step), (math.degrees(step), 0.0, 0.0), (0.0, math.degrees(step), 0.0))

    def wrench(side: float, heel: float, trim: float, rise: float) -> FloatArray:
        return _still_wrench(hull, side * heel, side * trim, kg - draft + side * rise, density * GRAVITY)

    pairs = ((wrench(-1.0, *move)[axis], wrench(1.0, *move)[axis]) for axis, move in enumerate(moves, 2))
    return tuple(float(low - high) / (2.0 * step) for low, high in pairs)


@case(*_MESH_FILES)
def barges() -> Outcome:
    """Stiffness of barges.

    Two boxes as meshes of twelve triangles, at their drafts in still water; stiffness is the central difference of
    force and torque of the water's pressure on the mesh, about the centre of mass.

    Reference: C33 = rho g A, C44 = rho g (I_T + V (KB - KG)), C55 = rho g (I_L + V (KB - KG)); arms of a wall-sided
    hull: GZ = sin(phi) (GM + BM tan^2(phi) / 2).
    """
    for barge in _BARGES:
        length, beam, draft, *_ = barge
        size = f"{length:g} x {beam:g} x {draft:g} m"
        theirs, ours = box_stiffness(*barge), _pressed_stiffness(*barge)
        yield from (
            near(f"{name}, barge of {size}", unit, reference, value, relative=1e-3)
            for (name, unit), reference, value in zip(STIFFNESSES, theirs, ours, strict=True)
        )
    yield _righting_arms()


def _righting_arms() -> Chart:
    """GZ of the first barge by its mesh, and of a wall-sided hull in closed form until the keel comes out."""
    sheet = _box_sheet(*_BARGES[0])
    heel, arm = zip(*((heel, arm) for heel, arm in sheet.righting_arms if heel <= 60.0), strict=True)
    angles = np.linspace(0.0, 26.0, 60)  # the keel comes out of the water at 26.6 degrees
    phi = np.radians(angles)
    wall = np.sin(phi) * (sheet.gm[0] + 0.5 * sheet.bm[0] * np.tan(phi) ** 2)
    lines = Series("wall-sided, closed form", angles, wall, reference=True), Series("mesh", heel, arm, kind="points")
    return Chart("Righting arm of the barge of 4 x 2 x 0.5 m", "heel [degrees]", "GZ [m]", lines)


def _still_wrench(hull: _Mesh, heel: float, trim: float, height: float, weight: float) -> FloatArray:
    """Force [N] and torque [N m] (6,) of still water on a mesh about its origin, world axes; angles in degrees."""
    vertices, triangles = hull
    turn = np.array(rotation(math.radians(heel), math.radians(trim), 0.0))
    found = wrench_of_still_water(panels_of(vertices, triangles), turn[2], height, weight)
    return np.concatenate((turn @ found[:3], turn @ found[3:]))


@case(*_MESH_FILES, table="hydrostatics")
def meshes() -> Outcome:
    """Meshes upright, heeled and trimmed.

    Three closed meshes, a barge, a sphere and a Wigley hull, fixed at the water's height upright, heeled by 20 and
    trimmed by 5 degrees. Volume and centre are those of the water's pressure on the mesh. The band of the centre is
    0.05 % of the hull's length.
    """
    weight, step = 1000.0 * GRAVITY, 1e-5
    for row in rows("hydrostatics"):
        hull, heel, trim = mesh(row["mesh"]), row["heel"], row["trim"]
        wrench = _still_wrench(hull, heel, trim, 0.0, weight)
        low, high = (_still_wrench(hull, heel, trim, height, weight)[2] for height in (-step, step))
        pose = f"{row['mesh']}, heel {heel:g}, trim {trim:g} degrees"
        size = float(np.ptp(hull[0], axis=0).max())
        yield near(f"volume, {pose}", "m3", row["volume"], wrench[2] / weight, relative=5e-3)
        yield near(f"waterplane, {pose}", "m2", row["area"], (low - high) / (2 * step * weight), relative=5e-3)
        yield near(f"centre of buoyancy x, {pose}", "m", row["x"], -wrench[4] / wrench[2], absolute=5e-4 * size)
        yield near(f"centre of buoyancy y, {pose}", "m", row["y"], wrench[3] / wrench[2], absolute=5e-4 * size)
