"""The sea: which waves it is made of, and how high it is at a point and a time.

VRX's sea is a sum of a few cosine waves of deep water. Its surface is sampled at a fixed point
without following the horizontal motion of the water ("simple sampler"), and it grows from flat
calm at time 0. A wave's phase is zero at the origin at time 0, whatever VRX's `phase` is; a
batch may give its rows others.

Seas of many waves lie in columns, so that a processor takes several at a time: all phases, then all cosines, then all
that is summed. `elevation` gives the same bits, and `orbital_motion` too, in a third of the time. Heights are summed
in the order of the waves, motions in the fixed order of `lanes`, so no bit depends on how many a processor takes.
"""

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.constants import SPECTRUM_GRAVITY, WAVE_GRAVITY
from vrx_mj.physics.elementary import FAR, cosine, cosine_and_sine, exponential, near_cosine, near_cosine_and_sine
from vrx_mj.physics.kernel import allocating_kernel, kernel
from vrx_mj.physics.lanes import (
    WIDTH,
    Real,
    any_positive,
    broadcast,
    larger,
    load,
    product_and,
    store,
    sync_lanes,
    total,
    totals,
    zeros_in_lines,
)
from vrx_mj.physics.motion import Vector
from vrx_mj.physics.noise import Word, gamma_variates, stream_key, uniform
from vrx_mj.physics.tables import OwnWaves, Record, Table, Waves
from vrx_mj.spectra import rotated_direction

EAST: Final = 0
NORTH: Final = 1
WAVENUMBER: Final = 2
FREQUENCY: Final = 3
PHASE: Final = 4
AMPLITUDE: Final = 5
_ORBITAL: Final = 6
BOTTOM: Final = 7  # `bottom_share`
ANGLE: Final = 8  # of the direction, counter-clockwise from east [rad]
COSINE: Final = 9  # of the phase, where and when `motion_of_columns` was asked for last
SINE: Final = 10
MEMORY: Final = 11  # and all rows from here on: what a kernel writes there is gone when the next one does
_PI2: Final = math.pi * math.pi
_RISING: Final = (10.0 / 6.0 - 10.0 / _PI2, 100.0 * (1.0 / 36.0 - 1.0 / (6.0 * _PI2) - 1.0 / 120.0), 0.176)
_PHILLIPS = 0.0081
"""Phillips' constant of the Pierson-Moskowitz spectrum (1964)."""


@kernel
def bottom_share(wavenumber: float, depth: float) -> float:
    """Return e^(-2 k h): what the bed throws back of a wave at the surface; 0 in deep water."""
    return 0.0 if wavenumber * depth > 20.0 else exponential(-2.0 * wavenumber * depth)


@kernel
def decay(wavenumber: float, z: float, bottom: float) -> tuple[float, float]:
    """Return cosh(k (z + h)) / cosh(k h) and sinh(k (z + h)) / cosh(k h) for z <= 0; in deep water, both e^(k z).

    For z > 0 they are as much more than at 0 as they are less at -z: what rises and falls with the surface feels their
    slope all the way, of which Stokes' drift is made, and short waves on long ones do not grow without limit. `bottom`
    is `bottom_share`.
    """
    down = exponential(-wavenumber * abs(z))
    up, whole = bottom / down, 1.0 + bottom
    level, upright = (down + up) / whole, (down - up) / whole
    if z <= 0.0:
        return level, upright
    return 2.0 - level, 2.0 * (1.0 - bottom) / whole - upright


@kernel
def own_phase(waves: Waves, own: OwnWaves, i: int) -> float:
    """Return the phase [rad] of a wave at the origin at time 0: its own one, if there are any in `own`."""
    if own is None:
        return float(waves[i].phase)
    return float(own[1 + i] if own.size > waves.size else waves[i].phase)


@kernel
def own_size(size: float, waves: Waves, own: OwnWaves, i: int) -> float:
    """Return an amplitude of a wave times its own factors."""
    if own is None:
        return size
    k = 1 + waves.size + i
    if own.size > k:
        size *= own[k]
    return size * own[0] if own.size > 0 else size


@allocating_kernel
def row_waves(waves: Table, own: FloatArray) -> Table:
    """Return waves with what is a row's own in one table: the loop for few waves is faster by a sixth with one."""
    if own.size == 0:
        return waves
    whole = waves.copy()
    for i in range(waves.size):
        whole[i].phase, whole[i].amplitude = own_phase(waves, own, i), own_size(waves[i].amplitude, waves, own, i)
        whole[i].orbital = own_size(waves[i].orbital, waves, own, i)
    return whole


@allocating_kernel
def wave_columns(waves: Table, sea: Record, memory: int, own: OwnWaves = None) -> FloatArray:
    """Return the columns of waves, (rows, n): filled up to whole lanes with waves of no height.

    `memory` is the number of rows from `MEMORY` on, at least four.
    """
    columns = zeros_in_lines(MEMORY + memory, (max(waves.size, 1) + WIDTH - 1) // WIDTH * WIDTH)
    for i in range(waves.size):
        wave = waves[i]
        columns[EAST, i], columns[NORTH, i] = wave.direction[0], wave.direction[1]
        columns[ANGLE, i] = math.atan2(wave.direction[1], wave.direction[0])
        columns[WAVENUMBER, i], columns[FREQUENCY, i] = wave.wavenumber, wave.frequency
        columns[PHASE, i], columns[AMPLITUDE, i] = own_phase(waves, own, i), own_size(wave.amplitude, waves, own, i)
        columns[_ORBITAL, i] = own_size(wave.orbital, waves, own, i)
        columns[BOTTOM, i] = bottom_share(wave.wavenumber, sea.depth)
    return columns


@allocating_kernel
def row_columns(waves: Table, sea: Table, like: FloatArray) -> FloatArray:
    """Return `wave_columns`, each of a shape, of rows with waves (rows, n) in a sea, (1, 1), or seas, (rows, 1)."""
    columns = np.empty((len(waves), like.shape[0], like.shape[1]))
    for i in range(len(waves)):
        columns[i] = wave_columns(waves[i], sea[i if len(sea) > 1 else 0, 0], like.shape[0] - MEMORY)
    return columns


@kernel
def mean_share(s: Real) -> Real:
    """Return what is left of a wave's height in its mean over a waterplane, whose `s` is that of `orbital_turning`.

    Over a line of length L it is sin a / a with a = k L / 2 and s = a^2 / 10, for which
    (1 - a^2 / pi^2) / (1 + c_1 s + c_2 s^2 + c_3 s^3) stands: c_1 and c_2 are of its series up to a^4, and its zero is
    that of a line as long as the wave; c_3 makes its least value -0.217 at a = 4.49. Up to L = 1.4 wave lengths it is
    0.006 off at most.
    """
    c = _RISING
    return (s * (-10.0 / _PI2) + 1.0) / (s * (s * (s * c[2] + c[1]) + c[0]) + 1.0)


@kernel
def spread_squared(reach: Vector, east: Real, north: Real) -> Real:
    """Return the `s` of `orbital_turning` of a wave, whose wavenumber's components [rad/m] are given."""
    return east * east * reach[0] + east * north * reach[1] + north * north * reach[2]


@kernel
def slope_share(s: Real) -> Real:
    """Return what is left of a wave's slope in that of the straight line that fits best: `orbital_turning`."""
    return 1.0 / (s * (s * (9.0 / 14.0) + 1.0) + 1.0)


@kernel
def phase_since(past: Vector, east: Real, north: Real, frequency: Real) -> Real:
    """Return by how much a wave's phase [rad] was more at a place and time `past` [m, m, s] before those now.

    `east` and `north` are the components of its wavenumber [rad/m].
    """
    return frequency * past[2] - (east * past[0] + north * past[1])


@kernel
def earlier(cos: Real, sin: Real, angle: Real) -> tuple[Real, Real]:
    """Return cosine and sine of a phase that is more by a small angle [rad], up to its square."""
    half = angle * 0.5
    return cos - angle * (half * cos + sin), sin - angle * (half * sin - cos)


@kernel
def elevation_of_columns(columns: Waves, x: float, y: float, t: float) -> float:
    """Return `elevation` at (x, y) [m] and time `t` [s]."""
    east, north, wavenumber = columns[EAST], columns[NORTH], columns[WAVENUMBER]
    frequency, phase, amplitude, part = columns[FREQUENCY], columns[PHASE], columns[AMPLITUDE], columns[MEMORY]
    far = 0
    sync_lanes()
    for i in range(part.size):
        angle = wavenumber[i] * (east[i] * x + north[i] * y) - frequency[i] * t + phase[i]
        far |= not abs(angle) < FAR
        part[i] = amplitude[i] * near_cosine(angle)
    sync_lanes()
    if far:
        for i in range(part.size):
            angle = wavenumber[i] * (east[i] * x + north[i] * y) - frequency[i] * t + phase[i]
            part[i] = amplitude[i] * cosine(angle)
        sync_lanes()
    height = 0.0
    for i in range(part.size):
        height += part[i]
    return height


@kernel
def motion_of_columns(
    columns: Waves, reach: Vector, past: Vector, x: float, y: float, z: float, t: float
) -> tuple[float, ...]:
    """Return the six sums of `orbital_motion` at (x, y) [m], `z` [m] over the mean level, and time `t` [s]."""
    _write_phases(columns, x, y, t)
    east, north, wavenumber, frequency = columns[EAST], columns[NORTH], columns[WAVENUMBER], columns[FREQUENCY]
    cos, sin, above = columns[COSINE], columns[SINE], columns[MEMORY]
    orbital, bottom = columns[_ORBITAL], columns[BOTTOM]
    side = 1.0 if z <= 0.0 else -1.0
    u = v = w = du = dv = dw = broadcast(0.0)
    for i in range(0, cos.size, WIDTH):
        own, f, bed, k = load(orbital, i), load(frequency, i), load(bottom, i), load(wavenumber, i)
        down = exponential(k * (-abs(z)))
        level, upright, still = down, down, broadcast(1.0)
        if any_positive(bed):
            up, whole = bed / down, bed + 1.0
            level, upright, still = (down + up) / whole, (down - up) / whole, (1.0 - bed) / whole
        level, upright = own * (level * side + (1.0 - side)), own * (upright * side + still * (1.0 - side))
        store(above, i, upright)
        along, across = k * load(east, i), k * load(north, i)
        share = mean_share(spread_squared(reach, along, across))
        level, upright, c, s = level * share, upright * share, load(cos, i), load(sin, i)
        before, later = earlier(c, s, phase_since(past, along, across, f))
        moved, gained = level * before, level * s * f
        u = product_and(load(east, i), moved, u)
        v = product_and(load(north, i), moved, v)
        w = product_and(upright, later, w)
        du = product_and(load(east, i), gained, du)
        dv = product_and(load(north, i), gained, dv)
        dw = product_and(f, upright * c, dw)
    sums = columns[MEMORY + 1]
    store(sums, 0, totals(u, v, w, du, dv, dw, 0.0, 0.0))
    return sums[0], sums[1], sums[2], sums[3], sums[4], -sums[5]


@kernel
def _write_phases(columns: Waves, x: float, y: float, t: float) -> None:
    """Write cosines and sines of the waves' phases at (x, y) [m] and time `t` [s] into the columns."""
    east, north, wavenumber = columns[EAST], columns[NORTH], columns[WAVENUMBER]
    frequency, phase, most = columns[FREQUENCY], columns[PHASE], broadcast(0.0)
    cos, sin = columns[COSINE], columns[SINE]
    for i in range(0, cos.size, WIDTH):
        along = load(wavenumber, i) * (load(east, i) * x + load(north, i) * y)
        angle = along - load(frequency, i) * t + load(phase, i)
        c, s = near_cosine_and_sine(angle)
        store(cos, i, c)
        store(sin, i, s)
        most = larger(larger(angle, 0.0 - angle), most)
    if total(most) > FAR:
        for i in range(cos.size):
            angle = wavenumber[i] * (east[i] * x + north[i] * y) - frequency[i] * t + phase[i]
            cos[i], sin[i] = cosine_and_sine(angle)


@kernel
def turning_of_columns(columns: Waves, reach: Vector, past: Vector) -> tuple[float, ...]:
    """Return the four sums of `orbital_turning`, where and when `motion_of_columns` was asked for last."""
    east, north, wavenumber, frequency = columns[EAST], columns[NORTH], columns[WAVENUMBER], columns[FREQUENCY]
    cos, sin, above = columns[COSINE], columns[SINE], columns[MEMORY]
    p = q = dp = dq = broadcast(0.0)
    for i in range(0, cos.size, WIDTH):
        k, f = load(wavenumber, i), load(frequency, i)
        along, across = k * load(east, i), k * load(north, i)
        rise = load(above, i) * slope_share(spread_squared(reach, along, across))
        before, _ = earlier(load(cos, i), load(sin, i), phase_since(past, along, across, f))
        c, s = rise * before, rise * load(sin, i) * f
        p = product_and(across, c, p)
        q = product_and(along, c, q)
        dp = product_and(across, s, dp)
        dq = product_and(along, s, dq)
    sums = columns[MEMORY + 1]
    store(sums, 0, totals(p, q, dp, dq, 0.0, 0.0, 0.0, 0.0))
    return sums[0], -sums[1], sums[2], -sums[3]


_Component = dict[str, Any]
"""A row of `tables.WAVE`."""


def pms_components(
    number: int,
    scale: float,
    angle: float,
    steepness: float,
    gain: float,
    period: float,
    direction: Sequence[float],
) -> list[_Component]:
    """Return up to three waves that sample the Pierson-Moskowitz spectrum, as VRX does.

    `period` [s] is that of the spectrum's peak; the angular frequencies are the peak's times
    `scale` to the power -1, 0 and 1, so the first wave is the longest. Each is turned by `angle`
    [rad] from the next one, counter-clockwise with frequency. `gain` multiplies the amplitudes:
    `gain` 1 is not a calibrated sea: the significant height depends on `scale`.
    """
    peak = 2.0 * math.pi / period
    widths = (peak * (1.0 - 1.0 / scale), peak * (scale - 1.0 / scale) / 2.0, peak * (scale - 1.0))
    if number > len(widths):
        raise ValueError(f"the model has at most {len(widths)} waves, not {number}")
    rows = []
    for index in range(number):
        order = index - 1
        frequency = peak * scale**order
        density = _PHILLIPS * SPECTRUM_GRAVITY**2 / frequency**5 * math.exp(-1.25 * (peak / frequency) ** 4)
        amplitude = gain * math.sqrt(2.0 * density * widths[index])
        towards = rotated_direction(direction, order * angle)
        rows.append(_component(amplitude, frequency, towards, steepness / number))
    return rows


def cwr_components(
    number: int,
    scale: float,
    angle: float,
    steepness: float,
    amplitude: float,
    period: float,
    direction: Sequence[float],
) -> list[_Component]:
    """Return waves that all have the same ratio of length to amplitude, VRX's model "CWR".

    `period` [s] and `amplitude` [m] are those of the middle wave; lengths and amplitudes are its own
    times powers of `scale`, so the first wave is the shortest. Each is turned by `angle` [rad] from
    the next one, counter-clockwise with length.
    """
    middle = (2.0 * math.pi / period) ** 2 / WAVE_GRAVITY
    rows = []
    for order in range(-(number // 2), number - number // 2):
        size = scale**order
        frequency = math.sqrt(WAVE_GRAVITY * middle / size)
        towards = rotated_direction(direction, order * angle)
        rows.append(_component(size * amplitude, frequency, towards, steepness / number))
    return rows


def _component(amplitude: float, frequency: float, direction: tuple[float, float], steepness: float) -> _Component:
    """Return the row of a deep-water wave; `steepness` is a k q as long as q stays below 1."""
    wavenumber = frequency**2 / WAVE_GRAVITY
    factor = min(1.0, steepness / (amplitude * wavenumber)) if amplitude else 0.0
    return {
        "amplitude": amplitude,
        "wavenumber": wavenumber,
        "frequency": frequency,
        "direction": direction,
        "steepness": factor,
    }


def random_phases(seed: int, number: int, *names: str) -> FloatArray:
    """Return the phases (number,) [rad] that a run's seed gives to waves, even over a full turn.

    `names` are those of their stream, by default the one of a sea's waves.
    """
    phases = np.empty(number)
    write_phases(np.uint64(stream_key(seed, *(names or ("waves",)))), phases)
    return phases


@kernel
def write_phases(key: Word, out: FloatArray) -> None:
    """Write the first phases [rad] of a stream of noise."""
    for i in range(out.size):
        out[i] = 2.0 * math.pi * uniform(key, np.uint64(i))


def random_heights(seed: int, shapes: FloatArray) -> FloatArray:
    """Return factors (n,) [1] by which a run's seed makes waves higher than in the mean over seeds.

    Their squares are of Gamma distributions of mean 1 and `shapes` (n,) [1]; of shape 0 they are 1.
    """
    energies = np.empty(len(shapes))
    gamma_variates(np.uint64(stream_key(seed, "wave energies")), np.ascontiguousarray(shapes), energies)
    return np.asarray(np.sqrt(energies))


@kernel
def ramp(sea: Record, t: float) -> float:
    """Return the share 1 - exp(-t / tau) to which the sea has grown by time `t` [s]; 1 for tau <= 0.

    It is flat calm before time 0.
    """
    if sea.tau <= 0.0 or t >= 40.0 * sea.tau:  # then the exponential is lost beside 1
        return 1.0
    return 1.0 - math.exp(-max(t, 0.0) / sea.tau)


@kernel
def wave_phase(wave: Record, x: float, y: float, t: float) -> float:
    """Return the phase [rad] of a row of `tables.WAVE` at (x, y) [m] and time `t` [s]; a crest has 0."""
    return phase_gained(wave, x, y, t) + float(wave.phase)


@kernel
def phase_gained(wave: Record, x: float, y: float, t: float) -> float:
    """Return by how much a wave's phase [rad] is more than at the origin at time 0."""
    along = wave.direction[0] * x + wave.direction[1] * y
    return float(wave.wavenumber * along - wave.frequency * t)


@kernel
def elevation(waves: Waves, x: float, y: float, t: float, own: OwnWaves = None) -> float:
    """Return the height [m] of the grown sea above its mean level at (x, y) [m] and time `t` [s]."""
    if waves.ndim == 2:
        return elevation_of_columns(waves, x, y, t)
    height = 0.0
    for i in range(waves.size):
        wave = waves[i]
        phase = phase_gained(wave, x, y, t) + own_phase(waves, own, i)
        height += own_size(wave.amplitude, waves, own, i) * cosine(phase)
    return height


@kernel
def elevations(
    waves: Waves, x: float, y: float, arms: tuple[Vector, Vector, Vector, Vector], t: float, own: OwnWaves = None
) -> tuple[float, float, float, float]:
    """Return `elevation` at four points, which are `arms` from (x, y) [m], to the bit; each wave is read once for all.

    Waves in columns are read for each point: their cosines are written into the columns.
    """
    (ax, ay, _), (bx, by, _), (cx, cy, _), (dx, dy, _) = arms
    ax, ay, bx, by, cx, cy, dx, dy = x + ax, y + ay, x + bx, y + by, x + cx, y + cy, x + dx, y + dy
    if waves.ndim == 2:
        a, b = elevation_of_columns(waves, ax, ay, t), elevation_of_columns(waves, bx, by, t)
        return a, b, elevation_of_columns(waves, cx, cy, t), elevation_of_columns(waves, dx, dy, t)
    a, b, c, d, far = 0.0, 0.0, 0.0, 0.0, False
    for i in range(waves.size):
        wave, phase, size = waves[i], own_phase(waves, own, i), own_size(waves[i].amplitude, waves, own, i)
        at_a, at_b = phase_gained(wave, ax, ay, t) + phase, phase_gained(wave, bx, by, t) + phase
        at_c, at_d = phase_gained(wave, cx, cy, t) + phase, phase_gained(wave, dx, dy, t) + phase
        far |= not (abs(at_a) < FAR and abs(at_b) < FAR and abs(at_c) < FAR and abs(at_d) < FAR)
        a += size * near_cosine(at_a)
        b += size * near_cosine(at_b)
        c += size * near_cosine(at_c)
        d += size * near_cosine(at_d)
    if far:
        a, b = elevation(waves, ax, ay, t, own), elevation(waves, bx, by, t, own)
        c, d = elevation(waves, cx, cy, t, own), elevation(waves, dx, dy, t, own)
    return a, b, c, d


@kernel
def surface_height(waves: Waves, sea: Record, x: float, y: float, t: float, own: OwnWaves = None) -> float:
    """Return the height [m] of the water's surface in the world at (x, y) [m] and time `t` [s].

    eta = level + ramp(t) sum a cos(k (d . x) - omega t): VRX's "simple sampler", the one its forces use.
    """
    return float(sea.level + ramp(sea, t) * elevation(waves, x, y, t, own))


@allocating_kernel
def surface_heights(
    waves: Table,
    sea: Record,
    x: FloatArray,
    y: FloatArray,
    t: FloatArray,
    out: FloatArray,
) -> None:
    """Write `surface_height` at each (x, y, t) into `out`; all four are (n,)."""
    columns = wave_columns(waves, sea, 4)
    for i in range(out.size):
        out[i] = surface_height(columns, sea, x[i], y[i], t[i])


@kernel
def stretch_waves(waves: Table, sea: Record, change: Record, drawn: OwnWaves, out: Table) -> None:
    """Write the waves of a sea that differs from `waves` by `change` into `out`; `sea` and `change` are as below.

    Angular frequencies go from w to (p / f) (w / p)^b, with the peak's p, the period's factor f and the band's factor
    b, so that the same energy lies in a band of another width; wavenumbers follow from the dispersion of deep water.
    Directions keep a share of their angles from the sea's own, which turns.

    Args:
        waves: `tables.WAVE` of the world.
        sea: peak [rad/s], direction (2,) and gravity [m/s2] of the world's sea.
        change: factors of `period`, `band` and `spread`, and `turn` [rad].
        drawn: phases and factors of heights.
        out: `tables.WAVE`.
    """
    for i in range(waves.size):
        wave, own = waves[i], out[i]
        own.amplitude, own.phase = own_size(wave.amplitude, waves, drawn, i), own_phase(waves, drawn, i)
        own.steepness, own.energy_shape = wave.steepness, wave.energy_shape
        own.orbital = own_size(wave.orbital, waves, drawn, i)
        own.frequency, own.wavenumber = wave.frequency, wave.wavenumber
        if change.period != 1.0 or change.band != 1.0:
            own.frequency = sea.peak / change.period * (wave.frequency / sea.peak) ** change.band
            own.wavenumber = own.frequency**2 / sea.gravity
            own.orbital = own.amplitude * own.frequency
        east, north = wave.direction[0], wave.direction[1]
        if change.turn != 0.0 or change.spread != 1.0:
            x, y = sea.direction[0], sea.direction[1]
            off = math.atan2(x * north - y * east, x * east + y * north)
            angle = math.atan2(y, x) + change.turn + change.spread * off
            east, north = math.cos(angle), math.sin(angle)
        own.direction[0], own.direction[1] = east, north
