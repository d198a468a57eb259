"""The waves that a hull makes and scatters: memory of its motion (Cummins, 1962), and diffraction of the sea.

Radiation: a hull that moves with nu feels -A(inf) d(nu)/dt - mu. The first part is in the inertia (`added_mass`), and
mu_i = sum over j of the integral of K_ij(t - s) nu_j(s) ds. A sum of damped oscillations stands for the kernel,
K_ij(t) = sum over k of Re(r_ijk e^(p_k t)) with Re p_k < 0, so that every motion and pole has one complex number x of
memory, dx/dt = p x + nu_j, and mu_i = sum Re(r_ijk x_jk). With a velocity that is constant over a step this is advanced
exactly, at any length of the step.

Diffraction: the force F(omega, beta) per metre of a wave that meets the hull, held in its place, at an angle beta, as
boundary element codes give it, besides that of the undisturbed wave's pressure (Froude-Krylov).

All about the link's origin; memory in body axes, diffraction in level axes in the hull's heading.
"""

import math

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.elementary import cosine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Wrench, add, minus, scale_wrench, times, zero_wrench
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import ramp, wave_phase

_QUARTER = 0.5 * math.pi
_FIRST = 12  # of the six velocities among the fields of a `Motion`


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
    for i in range(memory.size):
        one, own = memory[i], state[i]
        p, q = one.pole[0], one.pole[1]
        decay = math.exp(p * dt)
        c, s = decay * math.cos(q * dt), decay * math.sin(q * dt)
        share = motion[_FIRST + one.motion] / (p * p + q * q)
        real, imaginary = own.real, own.imaginary
        own.real = c * real - s * imaginary + ((c - 1.0) * p + s * q) * share
        own.imaginary = s * real + c * imaginary + (s * p - (c - 1.0) * q) * share


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
def _entry(table: FloatArray, weight: float, c: float, s: float, total: Wrench) -> Wrench:
    """Return a total and the weighted force of one entry of the table at a phase: Re(F e^(i theta))."""
    return add(total, scale_wrench(_real_part(table, table[6:], c, s), weight))


@kernel
def _add_scattered(table: FloatArray, place: float, angle: float, c: float, s: float, total: Wrench) -> Wrench:
    """Return a total and the force of one wave, in the hull's heading.

    Args:
        table: as that of `diffraction_load`.
        place: frequency in steps of the table, inside it.
        angle: off the hull's heading, toward which the wave travels [rad], -pi to pi.
        c: height of the wave [m] at the hull.
        s: the same a quarter of a period later.
        total: force so far.
    """
    angles = table.shape[1]
    turn = angle * angles / (2.0 * math.pi)
    if turn < 0.0:
        turn += angles
    low, near = int(place), int(turn)
    up, on = place - low, turn - near
    near = near % angles
    far = (near + 1) % angles
    total = _entry(table[low, near], (1.0 - up) * (1.0 - on), c, s, total)
    total = _entry(table[low, far], (1.0 - up) * on, c, s, total)
    total = _entry(table[low + 1, near], up * (1.0 - on), c, s, total)
    return _entry(table[low + 1, far], up * on, c, s, total)


@kernel
def diffraction_load(
    table: FloatArray, step: float, waves: Table, sea: Record, body: Motion, heading: tuple[float, float], t: float
) -> Wrench:
    """Return the force of the waves that a hull scatters: world axes, about the link's origin.

    Between the table's entries it is linear in frequency and angle. A wave beyond the last frequency exerts none.

    Args:
        table: (frequencies, angles, 12): real and imaginary part of the force [N/m] and torque [N] per metre of a
            wave's amplitude, at multiples of `step` from 0 on and at even angles over the circle.
        step: between frequencies [rad/s].
        waves: `tables.WAVE`.
        sea: a row of `tables.SEA`.
        body: motion of the link.
        heading: cosine and sine of the hull's.
        t: time [s].
    """
    cos, sin = heading
    total, last = zero_wrench(), table.shape[0] - 1
    for i in range(waves.size):
        wave = waves[i]
        place = wave.frequency / step
        if place < last:
            east, north = wave.direction[0], wave.direction[1]
            angle = math.atan2(north * cos - east * sin, east * cos + north * sin)
            theta = wave_phase(wave, body.x, body.y, t)
            height, later = wave.amplitude * cosine(theta), wave.amplitude * cosine(theta - _QUARTER)
            total = _add_scattered(table, place, angle, height, later, total)
    (x, y, z), (k, m, n) = total[:3], total[3:]
    turned = Wrench(cos * x - sin * y, sin * x + cos * y, z, cos * k - sin * m, sin * k + cos * m, n)
    return scale_wrench(turned, ramp(sea, t))
