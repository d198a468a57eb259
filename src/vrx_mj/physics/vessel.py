"""What water does to a hull of profile `marine` that has a model of its own: pressure, damping, added mass, waves.

Everything is about the link's origin, in body axes, with the velocity through the water nu_r = nu - nu_water (Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, 2021, 6.5 and 6.6).
"""

from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.physics.added_mass import added_mass_bias, matrix_times
from vrx_mj.physics.conditions import Conditions
from vrx_mj.physics.crossflow import crossflow_drag
from vrx_mj.physics.kernel import allocating_kernel, inlined_kernel, kernel
from vrx_mj.physics.kinematics import surface_slope
from vrx_mj.physics.lanes import WIDTH, zeros_in_lines
from vrx_mj.physics.motion import (
    Motion,
    Vector,
    Wrench,
    add,
    from_origin,
    relative_motion,
    rotated_wrench,
    scale_wrench,
    shift,
    spin_of,
    times,
    unrotate,
    velocity_at,
    velocity_of,
    zero_vector,
    zero_wrench,
)  # fmt: skip
from vrx_mj.physics.panels import CUT, panel_wrench, still_pressures
from vrx_mj.physics.radiation import diffraction_load, memory_load, memory_step
from vrx_mj.physics.tables import MATRIX, Record, Table
from vrx_mj.physics.wave_box import BOX_MEMORY, LEVELS, ROWS, heading_of, pressures_in_waves
from vrx_mj.physics.wave_columns import wave_columns
from vrx_mj.physics.waves import surface_height

_AWASH = 0.25
"""Share of its weight that the water carries of a hull about to leave it."""


class VesselWork(NamedTuple):
    """The waves, and memory for the pressures on a mesh of at most n points and k pairs of triangles."""

    pressures: FloatArray
    """(n,)"""
    wet: ByteArray
    """(n,)"""
    found: IntArray
    """(k,)"""
    cut: FloatArray
    """(CUT, k + WIDTH)"""
    polynomial: FloatArray
    """(LEVELS, ROWS, WIDTH)"""
    columns: FloatArray
    """The waves in columns."""


class HullMeshes(NamedTuple):
    """The meshes of all vessels, one after the other."""

    parts: Table
    """`tables.PART`."""
    points: FloatArray
    """Each vessel's (3, n) [m], body axes."""
    shares: FloatArray
    """Each vessel's (6, n), of `panel_mesh.Panels`."""
    pairs: IntArray
    """(k, 4)"""
    corner_shares: FloatArray
    """(k, 6, WIDTH)"""


@allocating_kernel
def vessel_work(meshes: HullMeshes, waves: Table, sea: Record) -> VesselWork:
    """Return memory for any of the meshes in a sea."""
    points, pairs = meshes.points.size // 3, len(meshes.pairs)
    wet, found, cut = (
        np.empty(points, np.uint8),
        np.empty(pairs, np.uint32),
        zeros_in_lines(CUT, pairs // WIDTH * WIDTH + WIDTH),
    )
    polynomial = np.zeros((LEVELS, ROWS, WIDTH))
    columns = wave_columns(waves, sea, BOX_MEMORY + 2 * meshes.parts.size)
    return VesselWork(zeros_in_lines(1, points)[0], wet, found, cut, polynomial, columns)


@kernel
def wet_share(vessel: Record, sea: Record, pressure: Wrench) -> float:
    """Return the share 0..1 of its other forces that the water keeps of a hull that leaves it.

    `pressure` is the wrench of `pressure_on_vessel`: below a quarter of the weight, the others fade out.
    """
    return float(min(max(pressure.fz / (_AWASH * vessel.displacement * sea.gravity), 0.0), 1.0))


@inlined_kernel
def drag_on_vessel(hull: Record, vessel: Record, strips: Table, now: Conditions) -> Wrench:
    """Return damping, and drag of the flow across the hull: world axes, about `hull.link_com`."""
    own = strips[vessel.strip_start : vessel.strip_start + vessel.strip_count]
    drag = add(_damping_of_vessel(vessel, now.through), crossflow_drag(own, now.through_level))
    return _at_link_com(scale_wrench(drag, now.wet), hull, now.body)


@inlined_kernel
def bias_on_vessel(hull: Record, vessel: Record, now: Conditions) -> Wrench:
    """Return the added mass' force at zero acceleration: world axes, about `hull.link_com`."""
    if vessel.diffraction_frequencies > 0:  # in which is what the water's acceleration does
        bias = added_mass_bias(vessel, relative_motion(now.body, now.water.stream), zero_vector(), zero_vector())
    else:
        orbital, turning = now.water.orbital, now.water.turning
        rate = turning.dp, turning.dq, 0.0
        bias = added_mass_bias(vessel, now.through_level, (orbital.du, orbital.dv, orbital.dw), rate)
    return _at_link_com(scale_wrench(bias, now.wet), hull, now.body)


@inlined_kernel
def radiation_on_vessel(hull: Record, vessel: Record, memory: Table, state: Table, now: Conditions) -> Wrench:
    """Advance the hull's memory, and return the force of the waves that it made: world axes, about `hull.link_com`.

    A hull with a table of diffraction makes waves by its motion through the current; one without by its motion through
    the water that the waves move.

    Args:
        hull: a row of `tables.HULL`.
        vessel: its row of `tables.VESSEL`.
        memory: `tables.MEMORY`.
        state: `tables.MEMORY_STATE`.
        now: surroundings and motion of the hull.
    """
    through = now.through
    if vessel.diffraction_frequencies > 0:
        through = relative_motion(now.body, now.water.stream)
    rows = memory[vessel.memory_start : vessel.memory_start + vessel.memory_count]
    own = state[hull.memory_start : hull.memory_start + vessel.memory_count]
    memory_step(rows, own, through, now.dt)
    return _at_link_com(scale_wrench(memory_load(rows, own), now.wet), hull, now.body)


@inlined_kernel
def diffraction_on_vessel(
    hull: Record, vessel: Record, table: FloatArray, waves: Table, sea: Record, now: Conditions
) -> Wrench:
    """Return the force of the waves that a hull scatters: world axes, about `hull.link_com`.

    `table` has the forces on all vessels, (n, 12).
    """
    frequencies, angles = vessel.diffraction_frequencies, vessel.diffraction_angles
    if frequencies == 0:
        return zero_wrench()
    first = vessel.diffraction_start
    entries = table[first : first + frequencies * angles].reshape((frequencies, angles, 12))
    load = diffraction_load(entries, vessel.diffraction_step, waves, sea, now.body, heading_of(now.body), now.time)
    return scale_wrench(from_origin(load, now.body, hull.link_com), now.wet)


@kernel
def _at_link_com(wrench: Wrench, hull: Record, body: Motion) -> Wrench:
    """Return a wrench of body axes about the link's origin in world axes, about `hull.link_com`."""
    return from_origin(rotated_wrench(body, wrench), body, hull.link_com)


@inlined_kernel
def pressure_on_vessel(
    hull: Record, vessel: Record, meshes: HullMeshes, waves: Table, sea: Record, body: Motion, t: float,
    work: VesselWork,
) -> Wrench:  # fmt: skip
    """Return the pressure of still water and undisturbed waves (Froude-Krylov): world axes, about `hull.link_com`.

    Args:
        hull: a row of `tables.HULL`.
        vessel: its row of `tables.VESSEL`.
        meshes: of all vessels.
        waves: `tables.WAVE`.
        sea: a row of `tables.SEA`.
        body: motion of the link.
        t: time [s].
        work: memory.
    """
    if vessel.hydrostatics == MATRIX:
        return _at_link_com(restoring_of_vessel(vessel, waves, sea, body, t), hull, body)
    return _at_link_com(_pressure_on_mesh(vessel, meshes, waves, sea, body, t, work), hull, body)


@kernel
def _pressure_on_mesh(
    vessel: Record, meshes: HullMeshes, waves: Table, sea: Record, body: Motion, t: float, work: VesselWork
) -> Wrench:
    """Return hydrostatic and Froude-Krylov pressure on a hull's mesh: body axes, about the link's origin."""
    start, count = vessel.point_start, vessel.point_count
    points = meshes.points[3 * start : 3 * (start + count)].reshape((3, count))
    shares = meshes.shares[6 * start : 6 * (start + count)].reshape((6, count))
    pressures = work.pressures[:count]
    if waves.size > 0:
        parts = meshes.parts[vessel.part_start : vessel.part_start + vessel.part_count]
        pressures_in_waves(vessel, parts, points, work.columns, sea, body, t, work.polynomial, pressures)
    else:
        up = body.r20, body.r21, body.r22
        still_pressures(points, up, body.z - sea.level, sea.density * sea.gravity, pressures)
    first, last = vessel.pair_start, vessel.pair_start + vessel.pair_count
    pairs, corner_shares = meshes.pairs[first:last], meshes.corner_shares[first:last]
    return panel_wrench(shares, pairs, corner_shares, pressures, work.wet, work.found, work.cut)


@kernel
def restoring_of_vessel(vessel: Record, waves: Table, sea: Record, body: Motion, t: float) -> Wrench:
    """Return W n - G d of a hull with a stiffness, on the plane that the surface is at the link's origin.

    W is the weight that it carries at rest, n the plane's normal, and d = (0, 0, rise, n_y, -n_x, 0) in body axes: the
    angles of small heel and trim against the plane. The water does not pull: once less than half of W is left, the
    moments go with what is, and out of the water there is nothing.
    """
    height = sea.level + surface_height(waves, sea, body.x, body.y, t)
    east, north = surface_slope(waves, sea, body.x, body.y, t)
    long = np.sqrt(1.0 + east * east + north * north)
    normal = unrotate(body, (-east / long, -north / long, 1.0 / long))
    x, y, _ = normal
    rise = (body.z - height) / long + vessel.waterline
    g = vessel.restoring
    weight, b = vessel.displacement * sea.gravity, vessel.buoyancy
    lift = -g[2, 2] * rise - g[2, 3] * y + g[2, 4] * x
    carried = shift(Wrench(*times(weight, normal), *zero_vector()), (b[0], b[1], b[2]))
    heel, trim = -g[3, 2] * rise - g[3, 3] * y + g[3, 4] * x, -g[4, 2] * rise - g[4, 3] * y + g[4, 4] * x
    whole, left = add(carried, Wrench(*times(lift, normal), heel, trim, 0.0)), (weight + lift) / weight
    if left >= 0.5:
        return whole
    force, turn = max(weight + lift, 0.0), 2.0 * max(left, 0.0)
    return Wrench(*times(force, normal), *times(turn, whole[3:]))


@kernel
def _damping_of_vessel(vessel: Record, through: Motion) -> Wrench:
    """Return linear damping, and quadratic damping of the motion of `vessel.point`, through the water."""
    d, q, c = vessel.damping, vessel.damping_quadratic, vessel.point
    velocity, spin = velocity_of(through), spin_of(through)
    linear = Wrench(*matrix_times(d, 0, velocity, spin), *matrix_times(d, 3, velocity, spin))
    quadratic = Wrench(*_quadratic_drag(q, velocity_at(through, c)), *_quadratic_drag(q[3:], spin))
    return add(scale_wrench(linear, -1.0), shift(quadratic, (c[0], c[1], c[2])))


@kernel
def _quadratic_drag(q: FloatArray, v: Vector) -> Vector:
    """Return -q |v| v along each of three axes."""
    return -q[0] * abs(v[0]) * v[0], -q[1] * abs(v[1]) * v[1], -q[2] * abs(v[2]) * v[2]
