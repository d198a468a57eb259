"""What water does to a hull of profile `marine` that has a model of its own: pressure, damping, added mass, waves.

Everything is about the link's origin, in body axes, with the velocity through the water nu_r = nu - nu_water (Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, 2021, 6.5 and 6.6).

A hull also feels the waves that it makes and scatters.

Radiation: a hull that moves with nu feels -A(inf) d(nu)/dt - mu. The first part is in the inertia (`added_mass`), and
mu_i = sum over j of the integral of K_ij(t - s) nu_j(s) ds. A sum of damped oscillations stands for the kernel,
K_ij(t) = sum over k of Re(r_ijk e^(p_k t)) with Re p_k < 0, so that every motion and pole has one complex number x of
memory, dx/dt = p x + nu_j, and mu_i = sum Re(r_ijk x_jk). With a velocity that is constant over a step this is advanced
exactly, at any length of the step.

Diffraction: the force F(omega, beta) per metre of a wave that meets the hull, held in its place, at an angle beta, as
boundary element codes give it, besides that of the undisturbed wave's pressure (Froude-Krylov).
"""

import math
from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray, IntArray
from vrx_mj.physics.conditions import Conditions
from vrx_mj.physics.drag import added_mass_bias, crossflow_drag, matrix_times, resistance_at
from vrx_mj.physics.drift import ENTRY, place_waves, weighted_sum, weights_of
from vrx_mj.physics.elementary import cosine_and_sine, exponential, near_cosine_and_sine
from vrx_mj.physics.kernel import allocating_kernel, inlined_kernel, kernel
from vrx_mj.physics.kinematics import orbital_motion, orbital_turning, reach_of, surface_plane, turned_with
from vrx_mj.physics.lanes import WIDTH, broadcast, load, product_and, store, zeros_in_lines
from vrx_mj.physics.motion import (
    Level,
    Motion,
    Vector,
    Wrench,
    add,
    from_origin,
    minus,
    motion_at_rest,
    place_of,
    plus,
    relative_motion,
    rotated_wrench,
    scale_wrench,
    shift,
    spin_of,
    times,
    turned_rows,
    unrotate,
    velocity_at,
    velocity_of,
    with_velocity,
    zero_vector,
    zero_wrench,
)
from vrx_mj.physics.panels import CUT, panel_wrench, still_pressures
from vrx_mj.physics.tables import MATRIX, OwnWaves, Record, Table, Waves
from vrx_mj.physics.wave_box import BOX_MEMORY, LEVELS, ROWS, heading_of, pressures_in_waves
from vrx_mj.physics.waves import (
    AMPLITUDE,
    EAST,
    FREQUENCY,
    MEMORY,
    NORTH,
    PHASE,
    WAVENUMBER,
    ramp,
    wave_columns,
)

_FIRST = 12  # of the six velocities among the fields of a `Motion`
_PHASES = 4
"""Phases of a period over which means are taken: they tell the mean and the first harmonic from second ones."""
_AWASH = 0.25
"""Share of its weight that the water carries of a hull about to leave it."""


@kernel
def memory_step(memory: Table, state: Table, motion: Motion, dt: float) -> None:
    """Advance the memory of one hull by `dt` [s] in which it moves with the velocity of `motion`, exactly.

    x' = e^(p dt) x + (e^(p dt) - 1) / p nu.

    Args:
        memory: rows of `tables.MEMORY`.
        state: as many rows of `tables.MEMORY_STATE`.
        motion: the link's, through what its water is at rest in.
        dt: length of the step [s].
    """
    p = q = c = s = real_share = imaginary_share = 0.0
    for i in range(memory.size):
        one, own = memory[i], state[i]
        if one.pole[0] != p or one.pole[1] != q:  # rows of one pole lie together
            p, q = one.pole[0], one.pole[1]
            cos, sin = cosine_and_sine(q * dt)
            decay, size = exponential(p * dt), 1.0 / (p * p + q * q)
            c, s = decay * cos, decay * sin
            real_share, imaginary_share = ((c - 1.0) * p + s * q) * size, (s * p - (c - 1.0) * q) * size
        speed = motion[_FIRST + one.motion]
        real, imaginary = own.real, own.imaginary
        own.real = c * real - s * imaginary + real_share * speed
        own.imaginary = s * real + c * imaginary + imaginary_share * speed


@kernel
def memory_load(memory: Table, state: Table) -> Wrench:
    """Return -mu, the force of the waves that a hull made before: body axes, about the link's origin."""
    total = zero_wrench()
    for i in range(memory.size):
        one, own = memory[i], state[i]
        total = add(total, scale_wrench(_real_part(one.residue, one.residue_imaginary, own.real, own.imaginary), -1.0))
    return total


@kernel
def _real_part(real: FloatArray, imaginary: FloatArray, c: float, s: float) -> Wrench:
    """Return the real part of six complex numbers, (6,) each, times c + i s."""
    force = minus(times(c, real), times(s, imaginary))
    return Wrench(*force, *minus(times(c, real[3:]), times(s, imaginary[3:])))


@kernel
def diffraction_load(
    table: FloatArray, row: int, step: float, columns: Waves, sea: Record, body: Motion, heading: Level,
    t: float,
) -> Wrench:  # fmt: skip
    """Return the force of the waves that a hull scatters: world axes, about the link's origin.

    Between the table's entries it is linear in frequency and angle. A wave beyond the last frequency exerts none.

    Args:
        table: (frequencies x angles, ENTRY), at multiples of `step` from 0 on and at even angles from 0 to a full
            turn: real part of the force [N/m] and torque [N] in body axes per metre of a wave's amplitude, and twice 0;
            imaginary part likewise.
        row: number of angles.
        step: between frequencies [rad/s].
        columns: `wave_columns`, whose memory is used.
        sea: a row of `tables.SEA`.
        body: motion of the link.
        heading: cosine and sine of the hull's.
        t: time [s].
    """
    last = len(table) // row - 1
    place_waves(columns, row - 1, 1.0 / step, float(last), heading)
    place, turn, height, later = columns[MEMORY], columns[MEMORY + 1], columns[MEMORY + 2], columns[MEMORY + 3]
    for i in range(0, place.size, WIDTH):
        along = load(columns[WAVENUMBER], i) * (load(columns[EAST], i) * body.x + load(columns[NORTH], i) * body.y)
        c, s = near_cosine_and_sine(along - load(columns[FREQUENCY], i) * t + load(columns[PHASE], i))
        store(height, i, c * load(columns[AMPLITUDE], i))
        store(later, i, s * load(columns[AMPLITUDE], i))
    total = broadcast(0.0)
    for i in range(place.size):
        if place[i] < last:
            low, near = int(place[i]), int(turn[i])
            start, weights = ENTRY * (low * row + near), weights_of(place[i] - low, turn[i] - near)
            total = product_and(weighted_sum(table, start, row, weights), height[i], total)
            total = product_and(weighted_sum(table, start + WIDTH, row, weights), -later[i], total)
    store(place, 0, total)
    force = Wrench(place[0], place[1], place[2], place[3], place[4], place[5])
    return scale_wrench(rotated_wrench(body, force), ramp(sea, t))


class VesselWork(NamedTuple):
    """The waves, and memory for the pressures on a mesh of at most n points and k pairs of triangles."""

    pressures: FloatArray
    """Pressure at each point, (n,)."""
    wet: ByteArray
    """Whether each point is wet, (n,)."""
    found: IntArray
    """(k,)"""
    cut: FloatArray
    """(CUT, k + WIDTH)"""
    polynomial: FloatArray
    """(LEVELS, ROWS, WIDTH)"""
    columns: FloatArray
    """The waves in columns."""


Work = VesselWork | None
"""What a step in profile marine works with; None in VRX's profiles."""


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
def vessel_work(meshes: HullMeshes, waves: Table, sea: Record, own: OwnWaves = None) -> VesselWork:
    """Return memory for any of the meshes in a sea."""
    points, pairs = meshes.points.size // 3, len(meshes.pairs)
    wet, found, cut = (
        np.empty(points, np.uint8),
        np.empty(pairs, np.uint32),
        zeros_in_lines(CUT, pairs // WIDTH * WIDTH + WIDTH),
    )
    polynomial = np.zeros((LEVELS, ROWS, WIDTH))
    columns = wave_columns(waves, sea, BOX_MEMORY + 2 * meshes.parts.size, own)
    return VesselWork(zeros_in_lines(1, points)[0], wet, found, cut, polynomial, columns)


@kernel
def wet_share(vessel: Record, sea: Record, pressure: Wrench) -> float:
    """Return the share 0..1 of its other forces that the water keeps of a hull that leaves it.

    `pressure` is the wrench of `pressure_on_vessel`: below a quarter of the weight, the others fade out.
    """
    return float(min(max(pressure.fz / (_AWASH * vessel.displacement * sea.gravity), 0.0), 1.0))


@inlined_kernel
def drag_on_vessel(hull: Record, vessel: Record, strips: Table, resistances: Table, now: Conditions) -> Wrench:
    """Return damping, resistance, and drag of the flow across the hull: world axes, about `hull.link_com`.

    Damping acts on the hull's rotation against the water that waves turn; with a table of diffraction, which has the
    moments of that water, on the hull's own.
    """
    own = strips[vessel.strip_start : vessel.strip_start + vessel.strip_count]
    through = now.through
    if vessel.diffraction_frequencies > 0:
        through = now.through_level
    drag = add(_damping_of_vessel(vessel, resistances, through), crossflow_drag(own, now.through_level))
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
def diffraction_on_vessel(hull: Record, vessel: Record, table: FloatArray, sea: Record, now: Conditions) -> Wrench:
    """Return the force of the waves that a hull scatters: world axes, about `hull.link_com`.

    `table` has the forces on all vessels, (n, ENTRY).
    """
    frequencies, angles = vessel.diffraction_frequencies, vessel.diffraction_angles
    if frequencies == 0:
        return zero_wrench()
    first = vessel.diffraction_start
    entries, heading = table[first : first + frequencies * angles], heading_of(now.body)
    load = diffraction_load(entries, angles, vessel.diffraction_step, now.waves, sea, now.body, heading, now.time)
    return scale_wrench(from_origin(load, now.body, hull.link_com), now.wet)


@kernel
def _at_link_com(wrench: Wrench, hull: Record, body: Motion) -> Wrench:
    """Return a wrench of body axes about the link's origin in world axes, about `hull.link_com`."""
    return from_origin(rotated_wrench(body, wrench), body, hull.link_com)


@inlined_kernel
def pressure_on_vessel(
    hull: Record, vessel: Record, meshes: HullMeshes, waves: Table, sea: Record, body: Motion, t: float,
    work: VesselWork, own: OwnWaves = None,
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
        own: what is the run's own of `waves`; it is in the columns of `work` already.
    """
    if vessel.hydrostatics == MATRIX:
        return _at_link_com(restoring_of_vessel(vessel, waves, sea, body, t, own), hull, body)
    return _at_link_com(_pressure_on_mesh(vessel, meshes, waves, sea, body, t, work), hull, body)


@kernel
def _pressure_on_mesh(
    vessel: Record, meshes: HullMeshes, waves: Table, sea: Record, body: Motion, t: float, work: VesselWork
) -> Wrench:
    """Return hydrostatic and Froude-Krylov pressure on a hull's mesh: body axes, about the link's origin."""
    start, count = vessel.point_start, vessel.point_count
    points, shares = meshes.points[3 * start : 3 * (start + count)], meshes.shares[6 * start : 6 * (start + count)]
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


@allocating_kernel
def load_harmonics(
    vessel: Record, meshes: HullMeshes, waves: Table, sea: Record, rest: float, motions: FloatArray,
    velocities: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Write mean and first harmonic of the water's forces on a moving hull into `out`, (n, 5, 6).

    They are those of pressure, damping and added mass; memory and diffraction are not in them. Rows of `out` are the
    mean, and the real and the imaginary part of F in Re(F e^(-i omega t)), in world axes about the moving origin of the
    link, and of the velocity through the water in body axes.

    Args:
        vessel: a row of `tables.VESSEL`.
        meshes: of this vessel alone.
        waves: n waves, `tables.WAVE`, each alone.
        sea: a row of `tables.SEA`.
        rest: height of the link's origin at rest [m].
        motions: (n, 12) real and imaginary parts of its motion X, Re(X e^(-i omega t)): translations [m], and small
            turns [rad].
        velocities: (n, 3) level velocities [m/s] about which it moves, at the frequency of encounter.
        out: result.
    """
    out[:] = 0.0
    for i in range(waves.size):
        own, u, v = waves[i : i + 1], velocities[i, 0], velocities[i, 1]
        omega = waves[i].frequency - waves[i].wavenumber * (waves[i].direction[0] * u + waves[i].direction[1] * v)
        work = vessel_work(meshes, own, sea)
        for n in range(_PHASES):
            angle = 2.0 * math.pi * n / _PHASES
            c, s = math.cos(angle), math.sin(angle)
            even, odd = motions[i, :6], motions[i, 6:]
            x, turn = plus(times(c, even), times(s, odd)), plus(times(c, even[3:]), times(s, odd[3:]))
            speed, rate = minus(times(c, odd), times(s, even)), minus(times(c, odd[3:]), times(s, even[3:]))
            moved = plus(times(omega, speed), (u, v, 0.0))
            body = _swinging((x[0], x[1], rest + x[2]), turn, moved, times(omega, rate))
            gained = times(-omega * omega, x), times(-omega * omega, turn)
            load, through = _loads_of_water(vessel, meshes, own, sea, body, gained, angle / waves[i].frequency, work)
            for k in range(6):
                out[i, 0, k] += load[k] / _PHASES
                out[i, 1, k] += 2.0 * c * load[k] / _PHASES
                out[i, 2, k] += 2.0 * s * load[k] / _PHASES
                out[i, 3, k] += 2.0 * c * through[_FIRST + k] / _PHASES
                out[i, 4, k] += 2.0 * s * through[_FIRST + k] / _PHASES


@kernel
def _swinging(place: Vector, turn: Vector, speed: Vector, rate: Vector) -> Motion:
    """Return the motion of a link at roll, pitch and yaw [rad] and their rates, with a velocity in world axes."""
    (cr, sr), (cp, sp) = (math.cos(turn[0]), math.sin(turn[0])), (math.cos(turn[1]), math.sin(turn[1]))
    spin = rate[0] - sp * rate[2], cr * rate[1] + cp * sr * rate[2], cr * cp * rate[2] - sr * rate[1]
    body = motion_at_rest(place, turned_rows(turn))
    return with_velocity(body, unrotate(body, speed), spin)


@kernel
def _loads_of_water(
    vessel: Record, meshes: HullMeshes, waves: Table, sea: Record, body: Motion, gained: tuple[Vector, Vector],
    time: float, work: VesselWork,
) -> tuple[Wrench, Motion]:  # fmt: skip
    """Return pressure, damping and added mass' force in world axes, and the motion through the water.

    `gained` is the acceleration of the link's origin, world axes, and the angular one, body axes.
    """
    reach = reach_of(vessel, heading_of(body))
    x, y, z = place_of(body, vessel.buoyancy)
    orbital = orbital_motion(waves, sea, x, y, z, time, reach)
    level, bias = relative_motion(body, orbital[:3]), zero_wrench()
    if vessel.diffraction_frequencies > 0:
        through = level
        bias = added_mass_bias(vessel, body, zero_vector(), zero_vector())
    else:
        turning = orbital_turning(waves, sea, reach, x, y, z, time)
        through = turned_with(level, turning, vessel.buoyancy)
        bias = added_mass_bias(vessel, level, orbital[3:], (turning.dp, turning.dq, 0.0))
    d, a, slip, spin = vessel.damping, vessel.added_mass, velocity_of(through), spin_of(through)
    damped = Wrench(*matrix_times(d, 0, slip, spin), *matrix_times(d, 3, slip, spin))
    fast = unrotate(body, gained[0])
    carried = Wrench(*matrix_times(a, 0, fast, gained[1]), *matrix_times(a, 3, fast, gained[1]))
    if vessel.hydrostatics == MATRIX:
        pressed = restoring_of_vessel(vessel, waves, sea, body, time)
    else:
        pressed = _pressure_on_mesh(vessel, meshes, waves, sea, body, time, work)
    load = add(add(pressed, bias), scale_wrench(add(damped, carried), -1.0))
    return rotated_wrench(body, load), through


@kernel
def restoring_of_vessel(
    vessel: Record, waves: Table, sea: Record, body: Motion, t: float, own: OwnWaves = None
) -> Wrench:
    """Return W n - G d of a hull with a stiffness, on the plane that fits the surface best over its waterplane.

    W is the weight that it carries at rest, n the plane's normal, and d = (0, 0, rise, n_y, -n_x, 0) in body axes: the
    angles of small heel and trim against the plane. The water does not pull: once less than half of W is left, the
    moments go with what is, and out of the water there is nothing.
    """
    rise, east, north = surface_plane(waves, sea, reach_of(vessel, heading_of(body)), body.x, body.y, t, own)
    height = sea.level + rise
    long = math.sqrt(1.0 + east * east + north * north)
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
def _damping_of_vessel(vessel: Record, resistances: Table, through: Motion) -> Wrench:
    """Return linear damping, and quadratic damping and resistance of the motion of `vessel.point`, through the water.

    `resistances` are `tables.RESISTANCE`, in which the vessel may have rows.
    """
    d, q, c = vessel.damping, vessel.damping_quadratic, vessel.point
    velocity, spin = velocity_of(through), spin_of(through)
    linear = Wrench(*matrix_times(d, 0, velocity, spin), *matrix_times(d, 3, velocity, spin))
    at_point = velocity_at(through, c)
    quadratic = Wrench(*_quadratic_drag(q, at_point), *_quadratic_drag(q[3:], spin))
    if vessel.resistance_count > 0:
        curve = resistances[vessel.resistance_start : vessel.resistance_start + vessel.resistance_count]
        resists = Wrench(-resistance_at(curve, at_point[0]), 0.0, 0.0, *zero_vector())
        quadratic = add(quadratic, resists)
    return add(scale_wrench(linear, -1.0), shift(quadratic, (c[0], c[1], c[2])))


@kernel
def _quadratic_drag(q: FloatArray, v: Vector) -> Vector:
    """Return -q |v| v along each of three axes."""
    return -q[0] * abs(v[0]) * v[0], -q[1] * abs(v[1]) * v[1], -q[2] * abs(v[2]) * v[2]
