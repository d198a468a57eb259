"""Hulls: stiffness of barges, meshes upright, heeled and trimmed, wave forces, heave, blows, contacts of shapes."""

import math
from itertools import pairwise

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.config.shapes import Shape
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.frames import rotation
from vrx_mj.mjcf import templates
from vrx_mj.mjcf.flotation import HullSheet, hull_sheet
from vrx_mj.physics.panels import panels_of, wrench_of_still_water
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.case import (
    GRAVITY,
    PHYSICS,
    Comparison,
    Outcome,
    case,
    mesh,
    only_boat,
    packaged_simulation,
    record,
    rows,
    with_boat_at,
)

_MESH_FILES = ("physics/panels.py", "mjcf/flotation.py")
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
_LENGTH, _BEAM, _DRAFT, _DENSITY, _MASS = 4.0, 2.0, 0.5, 1025.0, 4100.0
_SURGE_ADDED, _HEAVE_ADDED = 900.0, 3000.0
"""Added mass in the barge's file [kg]."""
_STIFFNESS = _DENSITY * GRAVITY * _LENGTH * _BEAM
"""C33 [N/m]."""
_PERIOD = math.tau * math.sqrt((_MASS + _HEAVE_ADDED) / _STIFFNESS)
"""Period of heave [s]."""
_DROP = 0.05
"""Height from which it is let go [m]."""
_RAISED = (0.0, 0.0, _DROP, 0.0, 0.0, 0.0)
_HULL = ("physics/panels.py", "physics/vessel.py", "runtime/loop.py")
_SHAPES = Shape(type="cylinder", radius=0.2, length=4.0), Shape(type="box", size=(0.6, 0.4, 0.31))
"""A float and a battery of the WAM-V."""
_COLUMNS = ("x", "y", "z", "a", "b", "c", "d")


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
        for (name, unit), reference, value in zip(STIFFNESSES, theirs, ours, strict=True):
            yield Comparison(f"{name}, barge of {size}", unit, reference, value)
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
        yield Comparison(f"volume, {pose}", "m3", row["volume"], wrench[2] / weight)
        yield Comparison(f"waterplane, {pose}", "m2", row["area"], (low - high) / (2 * step * weight))
        yield Comparison(f"centre of buoyancy x, {pose}", "m", row["x"], -wrench[4] / wrench[2])
        yield Comparison(f"centre of buoyancy y, {pose}", "m", row["y"], wrench[3] / wrench[2])


def _water(sim: Simulation, pose: FloatArray) -> FloatArray:
    """Force and torque (6,) of the water's pressure on the barge, held in a pose."""
    sim.set_boat(sim.boats[0], pose=pose.tolist())
    return sim.forces(sim.boats[0])["hydrostatics"]


def _contact(sim: Simulation) -> float:
    """Force with which what the barge runs into pushes it back [N]."""
    return -float(sim.forces(sim.boats[0])["contact"][0])


@case(*_HULL)
def barge_afloat() -> Outcome:
    """Stiffness of a floating barge.

    assets/validation/worlds/barge.yaml: a box of 4 x 2 x 1 m, 4100 kg, KG 0.5 m, in still water. Stiffness is the
    central difference of the forces that the simulation reports in poses 1 mm or 1 mrad aside.

    Reference: C33 = rho g A, C44 = rho g (I_T + V (KB - KG)), C55 = rho g (I_L + V (KB - KG)); weight is rho g V.
    """
    sim, step = packaged_simulation("barge"), 1e-3
    closed = box_stiffness(_LENGTH, _BEAM, _DRAFT, _DENSITY, 0.5)
    for axis, ((name, unit), reference) in enumerate(zip(STIFFNESSES, closed, strict=True), 2):
        aside = step * np.eye(6)[axis]
        slope = (_water(sim, -aside)[axis] - _water(sim, aside)[axis]) / (2.0 * step)
        yield Comparison(name, unit, reference, slope)
    yield Comparison("force at rest", "N", _MASS * GRAVITY, _water(sim, np.zeros(6))[2])


@case("physics/panels.py", "physics/wave_box.py", "physics/vessel.py")
def froude_krylov() -> Outcome:
    """Wave forces on a fixed barge.

    assets/validation/worlds/barge.yaml with a regular wave of 3 s and an amplitude of 1 cm from ahead and from the
    side; the barge is reset before each of 60 samples over a period. Forces are first harmonics per metre of
    wave amplitude.

    Reference: Airy's pressure rho g a e^(k z) cos(k x - omega t) integrated over the box, per metre: heave rho g A
    e^(-k d) sin(k l / 2) / (k l / 2), the ends 2 rho g b sin(k l / 2) (1 - e^(-k d)) / k.
    """
    k, height = (math.tau / 3.0) ** 2 / GRAVITY, 0.02
    deep, samples = math.exp(-k * _DRAFT), np.arange(60)
    for axis, wave, motion, along, across in (
        (0, "head", "surge", _LENGTH, _BEAM),
        (1, "beam", "sway", _BEAM, _LENGTH),
    ):
        heave = _STIFFNESS * deep * (math.sin(0.5 * k * along) / (0.5 * k * along))
        push = 2.0 * _DENSITY * GRAVITY * across * math.sin(0.5 * k * along) * (1.0 - deep) / k
        sea = {"model": "regular", "height": height, "period": 3.0, "direction": [1.0 - axis, float(axis)]}
        sim = packaged_simulation("barge", sea=sea)
        times, forces = record(sim, lambda sim: _water(sim, np.zeros(6))[:3], 59, 0.05)
        times += sim.timestep  # a force is that of the time at which its step ends
        amplitude = 2.0 / 60.0 * np.abs(np.exp(2j * math.pi * samples / 60) @ forces) / (0.5 * height)
        yield Comparison(f"heave, {wave} wave", "N/m", heave, amplitude[2])
        yield Comparison(f"{motion}, {wave} wave", "N/m", push, amplitude[axis])
        phase = math.tau / 3.0 * times
        lines = (
            Series("closed forms", times, 0.5 * height * heave * np.cos(phase), reference=True),
            Series("", times, -0.5 * height * push * np.sin(phase), reference=True),
            Series("heave less weight", times, forces[:, 2] - _MASS * GRAVITY),
            Series(motion, times, forces[:, axis]),
        )
        yield Chart(f"Force on the fixed barge in a {wave} wave of 1 cm", "time [s]", "force [N]", lines)


@case("physics/drag.py", *_HULL)
def heave_undamped() -> Outcome:
    """Free heave without damping.

    assets/validation/worlds/barge.yaml, released 5 cm too high, for 20 periods. It has no damping, so the sum of
    kinetic energy, including added mass, and potential energy must be constant. Its means over whole periods are
    compared.

    Reference: 2 pi sqrt((m + A33) / C33), and conservation of energy.
    """
    sim = with_boat_at(packaged_simulation("barge"), _RAISED)
    count = round(20.0 * _PERIOD / sim.timestep)
    _, found = record(sim, lambda sim: (only_boat(sim).position[2], only_boat(sim).velocity[2]), count, sim.timestep)
    (z, w), times = found.T, np.arange(count + 1) * sim.timestep
    energy = 0.5 * (_MASS + _HEAVE_ADDED) * w**2 + 0.5 * _STIFFNESS * z**2
    whole = round(_PERIOD / sim.timestep)
    up = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))
    crossings = sim.timestep * (up - z[up] / (z[up + 1] - z[up]))
    yield Comparison("period", "s", _PERIOD, np.diff(crossings).mean())
    kept = energy[-whole:].mean() / energy[:whole].mean()
    yield Comparison("energy, mean of the 20th period over that of the first", "", 1.0, kept)
    first = slice(int(np.searchsorted(times, 5.0 * _PERIOD)))
    closed = _DROP * np.cos(math.tau / _PERIOD * times)
    lines = Series("closed form", times[first], closed[first], reference=True), Series("ours", times[first], z[first])
    yield Chart("Height of the barge", "time [s]", "height [m]", lines)


@case("runtime/loop.py")
def step_halved() -> Outcome:
    """Order of the scheme in time.

    assets/validation/worlds/barge.yaml, released 5 cm too high, with steps of 20, 10, 5 and 2.5 ms; the error of the
    height after 2 s.

    Reference: The closed form of free heave. The integrator is MuJoCo's semi-implicit Euler, which is of first order:
    half the step gives half the error.
    """
    until, steps, errors = 2.0, (0.02, 0.01, 0.005, 0.0025), []
    for step in steps:
        sim = with_boat_at(packaged_simulation("barge", physics={**PHYSICS, "timestep": step}), _RAISED)
        sim.step(duration=until)
        errors.append(abs(float(only_boat(sim).position[2]) - _DROP * math.cos(math.tau / _PERIOD * until)))
    for (coarse, one), (fine, other) in pairwise(zip(steps, errors, strict=True)):
        yield Comparison(f"order from {coarse:g} to {fine:g} s", "", None, math.log2(one / other))
    lines = (
        Series("order 1", np.log10(steps), np.log10(errors[0]) + np.log10(np.array(steps) / steps[0]), reference=True),
        Series("ours", np.log10(steps), np.log10(errors), kind="points"),
    )
    yield Chart("Error of the height after 2 s", "log10 of the step [s]", "log10 of it [m]", lines)


@case("physics/drag.py", "runtime/loop.py")
def added_mass_impact() -> Outcome:
    """Impact with added mass.

    assets/validation/worlds/barge.yaml, which runs into a fixed quay at 0.2 and 0.5 m/s without drag. The impulse
    is the sum of the contact force over the steps; e is the ratio of the speeds after and before.

    Reference: The change of momentum of the boat and of the water that moves with it: (m + A11) (1 + e) v. If added
    mass were only a force, it would be missing from the impact.
    """
    quay = {"name": "quay", "pose": [4, 0, 0, 0, 0, 0], "layout": "XXX\nXXX\nXXX\n"}
    series = []
    for speed in (0.2, 0.5):
        sim = with_boat_at(packaged_simulation("barge", docks=[quay]), [0.0] * 6, (speed, 0, 0, 0, 0, 0))
        count = round(20.0 / sim.timestep)
        _, found = record(sim, lambda sim: (_contact(sim), only_boat(sim).velocity[0]), count, sim.timestep)
        forces, back = found[:-1, 0].tolist(), -found[-1, 1]
        impulse = sim.timestep * sum(forces)
        reference = (_MASS + _SURGE_ADDED) * (speed + back)
        yield Comparison(f"impulse at {speed:g} m/s, e {back / speed:.3f}", "N s", reference, impulse)
        first = max(int(np.flatnonzero(forces)[0]) - 10, 0)
        sums = sim.timestep * np.cumsum(forces)[first : first + 70]
        times = sim.timestep * np.arange(71)
        series.append(Series("change of momentum", times[[0, 70]], [reference] * 2, reference=True))
        series.append(Series(f"{speed:g} m/s", times[:70], sums))
    yield Chart("Impulse of the quay so far", "time [s]", "impulse [N s]", series)


@case("physics/flotation.py", "physics/afloat.py", "runtime/loop.py", quick=False)
def float_contact() -> Outcome:
    """Impact on a buoy, by timestep.

    assets/validation/worlds/barge.yaml, without damping, which runs at 1 m/s into a marker buoy without mooring.
    The impulse is the sum of the contact force over 4 s, at steps of 20, 10 and 5 ms.

    Reference: The same run at a step of 0.5 ms. The drag of a floating object is part of its inertia, so the impact on
    a light buoy does not depend on the step.
    """
    buoy = {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [3.6, 0, 0, 0, 0, 0], "mooring": None}
    steps, impulses, series = (0.0005, 0.02, 0.01, 0.005), [], []
    for step in steps:
        sim = packaged_simulation("barge", objects=[buoy], physics={**PHYSICS, "timestep": step})
        sim.step(duration=1.0)
        with_boat_at(sim, [0.0] * 6, (1.0, 0, 0, 0, 0, 0))
        _, forces = record(sim, _contact, round(4.0 / step) - 1, step)
        pushes = (step * forces).tolist()
        impulses.append(sum(pushes))
        times = step * np.arange(len(pushes))
        label = f"{1000.0 * step:g} ms"
        series.append(Series(label, times, np.cumsum(pushes), reference=step == steps[0]))
    for step, impulse in zip(steps[1:], impulses[1:], strict=True):
        yield Comparison(f"impulse with steps of {1000.0 * step:g} ms", "N s", impulses[0], impulse)
    yield Chart("Impulse on the barge so far", "time [s]", "impulse [N s]", series)


@case("mjcf/templates.py", table="contacts")
def contacts() -> Outcome:
    """Contacts of a float with a box.

    A float of the WAM-V and a box of the size of its battery, as in worlds, in 100 attitudes, 10 mm beyond their
    first contact. Contacts are those of the installed MuJoCo; versions 4.0.0 and 4.0.1 differ in contacts of
    cylinders. The prism of 64 sides that represents a cylinder in worlds lacks 0.24 mm.
    """
    spec = mujoco.MjSpec()
    for each in templates.meshes(_SHAPES):
        spec.assets[each.file] = each.content
        spec.add_mesh(name=each.name, file=each.file, scale=each.scale)
    for geom in templates.geoms(_SHAPES):
        body = spec.worldbody.add_body()
        body.add_freejoint()
        kind = getattr(mujoco.mjtGeom, f"mjGEOM_{geom.type.upper()}")
        body.add_geom(type=kind, size=[*geom.size, 0.0, 0.0, 0.0][:3], meshname=geom.mesh or "")
    model, off = spec.compile(), []
    data = mujoco.MjData(model)
    for row in rows("contacts"):
        data.qpos[:7], data.qpos[10:] = [row[column] for column in _COLUMNS], [row[f"box_{axis}"] for axis in "abcd"]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        off.append(abs(row["depth"] + min(float(contact.dist) for contact in data.contact)))
    yield Comparison("greatest difference of depth", "mm", None, 1e3 * max(off))
