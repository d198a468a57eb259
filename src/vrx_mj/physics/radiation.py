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
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Wrench
from vrx_mj.physics.tables import Record, Table
from vrx_mj.physics.waves import cosine, ramp

__all__ = ["diffraction_load", "memory_load", "memory_step"]

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
    x, y, z, k, m, n = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(memory.size):
        a, b, r, s = state[i].real, state[i].imaginary, memory[i].residue, memory[i].residue_imaginary
        x -= r[0] * a - s[0] * b
        y -= r[1] * a - s[1] * b
        z -= r[2] * a - s[2] * b
        k -= r[3] * a - s[3] * b
        m -= r[4] * a - s[4] * b
        n -= r[5] * a - s[5] * b
    return Wrench(x, y, z, k, m, n)


@kernel
def _corner(table: FloatArray, weight: float, c: float, s: float) -> Wrench:
    """Return the weighted force of one entry of the table at a phase: Re(F e^(i theta))."""
    return Wrench(
        weight * (c * table[0] - s * table[6]),
        weight * (c * table[1] - s * table[7]),
        weight * (c * table[2] - s * table[8]),
        weight * (c * table[3] - s * table[9]),
        weight * (c * table[4] - s * table[10]),
        weight * (c * table[5] - s * table[11]),
    )


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
    angles = table.shape[1]
    spacing = 2.0 * math.pi / angles
    fx, fy, fz, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        place = wave.frequency / step
        low = int(place)
        if low + 1 >= table.shape[0]:
            continue
        east, north = wave.direction[0], wave.direction[1]
        turn = math.atan2(north * cos - east * sin, east * cos + north * sin) / spacing
        if turn < 0.0:
            turn += angles
        near = int(turn)
        up, on = place - low, turn - near
        near = near % angles
        far = (near + 1) % angles
        theta = wave.wavenumber * (east * body.x + north * body.y) - wave.frequency * t + wave.phase
        c, s = wave.amplitude * cosine(theta), wave.amplitude * cosine(theta - _QUARTER)
        p = _corner(table[low, near], (1.0 - up) * (1.0 - on), c, s)
        q = _corner(table[low, far], (1.0 - up) * on, c, s)
        v = _corner(table[low + 1, near], up * (1.0 - on), c, s)
        w = _corner(table[low + 1, far], up * on, c, s)
        fx += p.fx + q.fx + v.fx + w.fx
        fy += p.fy + q.fy + v.fy + w.fy
        fz += p.fz + q.fz + v.fz + w.fz
        tx += p.tx + q.tx + v.tx + w.tx
        ty += p.ty + q.ty + v.ty + w.ty
        tz += p.tz + q.tz + v.tz + w.tz
    grown = ramp(sea, t)
    return Wrench(
        grown * (cos * fx - sin * fy),
        grown * (sin * fx + cos * fy),
        grown * fz,
        grown * (cos * tx - sin * ty),
        grown * (sin * tx + cos * ty),
        grown * tz,
    )
