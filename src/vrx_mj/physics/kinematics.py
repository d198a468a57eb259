"""The water under the waves: how it moves and how it presses, by linear theory.

Velocities and accelerations decay below the mean level and go on above it (`waves.decay`), which keeps the Stokes
drift of waves; the pressure is stretched to the surface (Wheeler, 1970), so that it is the air's there. The harmonics
of a Stokes wave are components like others. What `ramp` does to the surface it does to all of these.
"""

import math
from typing import NamedTuple

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.elementary import cosine, cosine_and_sine
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import (
    Arrow,
    Level,
    Motion,
    Vector,
    cross,
    minus,
    plus,
    rotate,
    spin_of,
    unrotate,
    velocity_at,
    velocity_of,
    with_velocity,
)
from vrx_mj.physics.tables import OwnWaves, Record, Table, Waves
from vrx_mj.physics.waves import (
    bottom_share,
    decay,
    earlier,
    elevation,
    mean_share,
    motion_of_columns,
    own_phase,
    own_size,
    phase_gained,
    phase_since,
    ramp,
    slope_share,
    spread_squared,
    turning_of_columns,
    wave_phase,
)

_QUARTER = 0.5 * math.pi
_POINT = (0.0, 0.0, 0.0)


class Orbital(NamedTuple):
    """Velocity [m/s] and acceleration [m/s2] of the water at a point, world axes."""

    u: float
    v: float
    w: float
    du: float
    dv: float
    dw: float


class Turning(NamedTuple):
    """Angular velocity [rad/s] about the world's x and y with which water that is level at rest turns, and its rate."""

    p: float
    q: float
    dp: float
    dq: float


@kernel
def surface_slope(waves: Table, sea: Record, x: float, y: float, t: float) -> Level:
    """Return the slope of the surface toward east and north at (x, y) [m] and time `t` [s]."""
    east, north = 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        rise = wave.amplitude * wave.wavenumber * cosine(wave_phase(wave, x, y, t) + _QUARTER)
        east += wave.direction[0] * rise
        north += wave.direction[1] * rise
    grown = ramp(sea, t)
    return grown * east, grown * north


@kernel
def surface_plane(
    waves: Table, sea: Record, reach: Vector, x: float, y: float, t: float, own: OwnWaves = None
) -> Vector:
    """Return height [m] and slopes toward east and north of the plane that fits the grown sea best over a waterplane.

    `reach` is that of `orbital_turning`, and (x, y) [m] the waterplane's middle.
    """
    height, east, north = 0.0, 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        k_east, k_north = wave.wavenumber * wave.direction[0], wave.wavenumber * wave.direction[1]
        cos, sin = cosine_and_sine(phase_gained(wave, x, y, t) + own_phase(waves, own, i))
        s, amplitude = spread_squared(reach, k_east, k_north), own_size(wave.amplitude, waves, own, i)
        height += amplitude * mean_share(s) * cos
        rise = amplitude * slope_share(s) * sin
        east -= k_east * rise
        north -= k_north * rise
    grown = ramp(sea, t)
    return grown * height, grown * east, grown * north


@kernel
def orbital_motion(
    waves: Waves, sea: Record, x: float, y: float, z: float, t: float, reach: Vector = _POINT, past: Vector = _POINT
) -> Orbital:
    """Return how the waves move the water at (x, y, z) [m, world] and time `t` [s]; the current is not in it.

    With theta = k (d . x) - omega t + phase and U the amplitude of the horizontal velocity at the mean level:
    u = U cosh(k (z + h)) / cosh(k h) cos(theta) d, w = U sinh(k (z + h)) / cosh(k h) sin(theta) up to z = 0.
    With the `reach` of `orbital_turning` it is the mean over a hull's waterplane. The velocity is that of a place and a
    time which lie `past` [m, m, s] back, as `half_step_back` has them.
    """
    depth = min(max(z - sea.level, -sea.depth), sea.depth)
    grown = ramp(sea, t)
    if waves.ndim == 2:
        u, v, w, du, dv, dw = motion_of_columns(waves, reach, past, x, y, depth, t)
        return Orbital(grown * u, grown * v, grown * w, grown * du, grown * dv, grown * dw)
    u, v, w, du, dv, dw = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        cos, sin = cosine_and_sine(wave_phase(wave, x, y, t))
        level, upright = decay(wave.wavenumber, depth, bottom_share(wave.wavenumber, sea.depth))
        east, north, f = wave.wavenumber * wave.direction[0], wave.wavenumber * wave.direction[1], wave.frequency
        size = wave.orbital * mean_share(spread_squared(reach, east, north))
        level, upright = size * level, size * upright
        before, later = earlier(cos, sin, phase_since(past, east, north, f))
        c, s = level * before, level * sin
        u += wave.direction[0] * c
        v += wave.direction[1] * c
        w += upright * later
        du += wave.direction[0] * (f * s)
        dv += wave.direction[1] * (f * s)
        dw -= f * (upright * cos)
    return Orbital(grown * u, grown * v, grown * w, grown * du, grown * dv, grown * dw)


@kernel
def orbital_turning(
    waves: Waves, sea: Record, reach: Vector, x: float, y: float, z: float, t: float, past: Vector = _POINT
) -> Turning:
    """Return how water turns that is level at rest, at (x, y, z) [m, world] and time `t` [s]: dw/dy and -dw/dx.

    It is the turn of the straight line that fits w best over a hull's waterplane. For a wave that is long against that,
    it is the slope at a point; over a line of length L it is 3 (sin a - a cos a) / a^3 of it with a = k L / 2, for
    which 1 / (1 + s + 9 / 14 s^2) with s = a^2 / 10 stands: less than 0.03 % off at L = 0.3 wave lengths, 1.4 % at 0.6.

    Args:
        waves: `tables.WAVE`, or the columns of `wave_columns` after `orbital_motion` of the same point and time.
        sea: a row of `tables.SEA`.
        reach: xx, 2 xy and yy [m2, world axes] of 0.3 times the waterplane's second moments over its area.
        x: [m]
        y: [m]
        z: [m]
        t: time [s].
        past: by how much the place and the time of the angular velocity lie back [m, m, s].
    """
    grown = ramp(sea, t)
    if waves.ndim == 2:
        p, q, dp, dq = turning_of_columns(waves, reach, past)
        return Turning(grown * p, grown * q, grown * dp, grown * dq)
    depth = min(max(z - sea.level, -sea.depth), sea.depth)
    p, q, dp, dq = 0.0, 0.0, 0.0, 0.0
    for i in range(waves.size):
        wave = waves[i]
        east, north = wave.wavenumber * wave.direction[0], wave.wavenumber * wave.direction[1]
        cos, sin = cosine_and_sine(wave_phase(wave, x, y, t))
        _, upright = decay(wave.wavenumber, depth, bottom_share(wave.wavenumber, sea.depth))
        rise = wave.orbital * upright * slope_share(spread_squared(reach, east, north))
        before, _ = earlier(cos, sin, phase_since(past, east, north, wave.frequency))
        p += north * (rise * before)
        q -= east * (rise * before)
        dp += north * (wave.frequency * (rise * sin))
        dq -= east * (wave.frequency * (rise * sin))
    return Turning(grown * p, grown * q, grown * dp, grown * dq)


@kernel
def reach_of(hull: Record, heading: Level) -> Vector:
    """Return `reach` of `orbital_turning` in a heading, its cosine and sine, for a row of `tables.HULL` or `VESSEL`."""
    cos, sin = heading
    long, wide = 0.3 * hull.spread[0], 0.3 * hull.spread[1]
    return long * cos * cos + wide * sin * sin, 2.0 * (long - wide) * cos * sin, long * sin * sin + wide * cos * cos


@kernel
def half_step_back(body: Motion, point: Arrow, dt: float) -> Vector:
    """Return how far [m] east and north of where it was half a step ago a point (3,) [m] of a link is, and that time.

    A link's velocity is that with which it came to its pose in the last step, and so that of half a step [s] before: to
    the water that carries it, it has none if the water's is of then. With a step below 0 it is that of the next step.
    """
    east, north, _ = rotate(body, velocity_at(body, point))
    return 0.5 * dt * east, 0.5 * dt * north, 0.5 * dt


@kernel
def turned_with(through: Motion, turning: Turning, point: FloatArray) -> Motion:
    """Return a motion through water that also turns, as a body about a point of the link.

    A hull that lies on a long wave as the water does has no velocity left: neither heave nor roll nor pitch.
    """
    spin = unrotate(through, (turning.p, turning.q, 0.0))
    velocity = plus(velocity_of(through), cross(spin, point))
    return with_velocity(through, velocity, minus(spin_of(through), spin))


@kernel
def water_pressure(waves: Table, sea: Record, x: float, y: float, z: float, t: float) -> float:
    """Return the water's pressure over the air's [Pa] at (x, y, z) [m, world] and time `t` [s]; 0 above the surface.

    p = rho g (sum eta_i cosh(k_i (z' + h)) / cosh(k_i h) - z), with z' = (z - eta) h / (h + eta).
    """
    grown = ramp(sea, t)
    height = grown * elevation(waves, x, y, t)
    below = z - sea.level
    if below >= height:
        return 0.0
    stretched = below - height
    if sea.depth < math.inf:
        stretched *= sea.depth / (sea.depth + height)
    dynamic = 0.0
    for i in range(waves.size):
        wave = waves[i]
        level, _ = decay(wave.wavenumber, stretched, bottom_share(wave.wavenumber, sea.depth))
        dynamic += wave.amplitude * level * cosine(wave_phase(wave, x, y, t))
    return float(max(sea.density * sea.gravity * (grown * dynamic - below), 0.0))


@kernel
def surface_slopes(waves: Table, sea: Record, x: FloatArray, y: FloatArray, t: FloatArray, out: FloatArray) -> None:
    """Write `surface_slope` at each (x, y, t), (n,), into `out`, (n, 2)."""
    for i in range(len(out)):
        out[i, 0], out[i, 1] = surface_slope(waves, sea, x[i], y[i], t[i])


@kernel
def orbital_motions(
    waves: Table, sea: Record, x: FloatArray, y: FloatArray, z: FloatArray, t: FloatArray, out: FloatArray
) -> None:
    """Write `orbital_motion` at each (x, y, z, t), (n,), into `out`, (n, 6)."""
    for i in range(len(out)):
        found = orbital_motion(waves, sea, x[i], y[i], z[i], t[i])
        for k in range(6):
            out[i, k] = found[k]


@kernel
def pressures(
    waves: Table, sea: Record, x: FloatArray, y: FloatArray, z: FloatArray, t: FloatArray, out: FloatArray
) -> None:
    """Write `water_pressure` at each (x, y, z, t), (n,), into `out`, (n,)."""
    for i in range(out.size):
        out[i] = water_pressure(waves, sea, x[i], y[i], z[i], t[i])
