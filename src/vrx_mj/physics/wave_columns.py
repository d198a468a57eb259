"""Many waves at once: what `elevation` gives, to the bit, and `orbital_motion`, in a third of the time.

The waves lie in columns, so that a processor takes several at a time: all phases, then all cosines, then all that is
summed. Heights are summed in the order of the waves, motions in the fixed order of `lanes`, so no bit depends on how
many a processor takes.
"""

from typing import Final

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.elementary import (
    FAR,
    cosine,
    cosine_and_sine,
    exponential,
    near_cosine,
    near_cosine_and_sine,
)
from vrx_mj.physics.kernel import allocating_kernel, kernel
from vrx_mj.physics.lanes import (
    WIDTH,
    any_positive,
    broadcast,
    larger,
    load,
    product_and,
    store,
    total,
    totals,
    zeros_in_lines,
)
from vrx_mj.physics.motion import Vector
from vrx_mj.physics.tables import Record, Table, Waves

EAST: Final = 0
NORTH: Final = 1
WAVENUMBER: Final = 2
FREQUENCY: Final = 3
PHASE: Final = 4
AMPLITUDE: Final = 5
_ORBITAL: Final = 6
BOTTOM: Final = 7  # `bottom_share`
MEMORY: Final = 8  # and all rows from here on: what a kernel writes there is gone when the next one does
MORE: Final = 9.0 / 14.0
"""Second coefficient of what a wave's slope is less over a waterplane: `kinematics.orbital_turning`."""


@kernel
def bottom_share(wavenumber: float, depth: float) -> float:
    """Return e^(-2 k h): what the bed throws back of a wave at the surface; 0 in deep water."""
    return 0.0 if wavenumber * depth > 20.0 else exponential(-2.0 * wavenumber * depth)


@kernel
def decay(wavenumber: float, z: float, bottom: float) -> tuple[float, float]:
    """Return cosh(k (z + h)) / cosh(k h) and sinh(k (z + h)) / cosh(k h) for z <= 0; in deep water, both e^(k z).

    `bottom` is `bottom_share`.
    """
    down = exponential(wavenumber * z)
    up, whole = bottom / down, 1.0 + bottom
    return (down + up) / whole, (down - up) / whole


@allocating_kernel
def wave_columns(waves: Table, sea: Record, memory: int) -> FloatArray:
    """Return the columns of waves, (rows, n): filled up to whole lanes with waves of no height.

    `memory` is the number of rows from `MEMORY` on, at least four.
    """
    columns = zeros_in_lines(MEMORY + memory, (max(waves.size, 1) + WIDTH - 1) // WIDTH * WIDTH)
    for i in range(waves.size):
        wave = waves[i]
        columns[EAST, i], columns[NORTH, i] = wave.direction[0], wave.direction[1]
        columns[WAVENUMBER, i], columns[FREQUENCY, i] = wave.wavenumber, wave.frequency
        columns[PHASE, i], columns[AMPLITUDE, i], columns[_ORBITAL, i] = wave.phase, wave.amplitude, wave.orbital
        columns[BOTTOM, i] = bottom_share(wave.wavenumber, sea.depth)
    return columns


@kernel
def elevation_of_columns(columns: Waves, x: float, y: float, t: float) -> float:
    """Return `elevation` at (x, y) [m] and time `t` [s]."""
    east, north, wavenumber = columns[EAST], columns[NORTH], columns[WAVENUMBER]
    frequency, phase, amplitude, part = columns[FREQUENCY], columns[PHASE], columns[AMPLITUDE], columns[MEMORY]
    far = 0
    for i in range(part.size):
        angle = wavenumber[i] * (east[i] * x + north[i] * y) - frequency[i] * t + phase[i]
        far |= not abs(angle) < FAR
        part[i] = amplitude[i] * near_cosine(angle)
    if far:
        for i in range(part.size):
            angle = wavenumber[i] * (east[i] * x + north[i] * y) - frequency[i] * t + phase[i]
            part[i] = amplitude[i] * cosine(angle)
    height = 0.0
    for i in range(part.size):
        height += part[i]
    return height


@kernel
def motion_of_columns(columns: Waves, x: float, y: float, z: float, t: float) -> tuple[float, ...]:
    """Return the six sums of `orbital_motion` at (x, y) [m], `z` [m] over the mean level, and time `t` [s]."""
    east, north, wavenumber = columns[EAST], columns[NORTH], columns[WAVENUMBER]
    frequency, phase, orbital, bottom = columns[FREQUENCY], columns[PHASE], columns[_ORBITAL], columns[BOTTOM]
    cos, sin, most = columns[MEMORY], columns[MEMORY + 1], broadcast(0.0)
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
    above = columns[MEMORY + 2]
    u = v = w = du = dv = dw = broadcast(0.0)
    for i in range(0, cos.size, WIDTH):
        own, f, bed = load(orbital, i), load(frequency, i), load(bottom, i)
        down = exponential(load(wavenumber, i) * z)
        level, upright = own * down, own * down
        if any_positive(bed):
            up, whole = bed / down, bed + 1.0
            level, upright = own * ((down + up) / whole), own * ((down - up) / whole)
        store(above, i, upright)
        c, s = level * load(cos, i), level * load(sin, i) * f
        u = product_and(load(east, i), c, u)
        v = product_and(load(north, i), c, v)
        w = product_and(upright, load(sin, i), w)
        du = product_and(load(east, i), s, du)
        dv = product_and(load(north, i), s, dv)
        dw = product_and(f, upright * load(cos, i), dw)
    sums = columns[MEMORY + 3]
    store(sums, 0, totals(u, v, w, du, dv, dw, 0.0, 0.0))
    return sums[0], sums[1], sums[2], sums[3], sums[4], -sums[5]


@kernel
def turning_of_columns(columns: Waves, reach: Vector) -> tuple[float, ...]:
    """Return the four sums of `orbital_turning`, where and when `motion_of_columns` was asked for last."""
    east, north, wavenumber, frequency = columns[EAST], columns[NORTH], columns[WAVENUMBER], columns[FREQUENCY]
    cos, sin, above = columns[MEMORY], columns[MEMORY + 1], columns[MEMORY + 2]
    p = q = dp = dq = broadcast(0.0)
    for i in range(0, cos.size, WIDTH):
        k, f = load(wavenumber, i), load(frequency, i)
        along, across = k * load(east, i), k * load(north, i)
        long = along * along * reach[0] + along * across * reach[1] + across * across * reach[2]
        rise = load(above, i) / (long * (long * MORE + 1.0) + 1.0)
        c, s = rise * load(cos, i), rise * load(sin, i) * f
        p = product_and(across, c, p)
        q = product_and(along, c, q)
        dp = product_and(across, s, dp)
        dq = product_and(along, s, dq)
    sums = columns[MEMORY + 3]
    store(sums, 0, totals(p, q, dp, dq, 0.0, 0.0, 0.0, 0.0))
    return sums[0], -sums[1], sums[2], -sums[3]
