"""The sea: which waves it is made of, and how high it is at a point and a time.

VRX's sea is a sum of a few cosine waves of deep water. Its surface is sampled at a fixed point
without following the horizontal motion of the water ("simple sampler"), and it grows from flat
calm at time 0. A wave's phase is zero at the origin at time 0, whatever VRX's `phase` is; a
batch may give its rows others.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.constants import SPECTRUM_GRAVITY, WAVE_GRAVITY
from vrx_mj.physics.elementary import cosine
from vrx_mj.physics.kernel import allocating_kernel, kernel
from vrx_mj.physics.noise import stream_key, uniform
from vrx_mj.physics.tables import Record, Table, Waves
from vrx_mj.physics.wave_columns import elevation_of_columns, wave_columns
from vrx_mj.spectra import rotated_direction

_PHILLIPS = 0.0081
"""Phillips' constant of the Pierson-Moskowitz spectrum (1964)."""

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
    key = np.uint64(stream_key(seed, *(names or ("waves",))))
    return np.array([2.0 * math.pi * uniform(key, np.uint64(index)) for index in range(number)])


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
    along = wave.direction[0] * x + wave.direction[1] * y
    return float(wave.wavenumber * along - wave.frequency * t + wave.phase)


@kernel
def elevation(waves: Waves, x: float, y: float, t: float) -> float:
    """Return the height [m] of the grown sea above its mean level at (x, y) [m] and time `t` [s]."""
    if waves.ndim == 2:
        return elevation_of_columns(waves, x, y, t)
    height = 0.0
    for i in range(waves.size):
        wave = waves[i]
        height += wave.amplitude * cosine(wave_phase(wave, x, y, t))
    return height


@kernel
def surface_height(waves: Waves, sea: Record, x: float, y: float, t: float) -> float:
    """Return the height [m] of the water's surface in the world at (x, y) [m] and time `t` [s].

    eta = level + ramp(t) sum a cos(k (d . x) - omega t): VRX's "simple sampler", the one its forces use.
    """
    return float(sea.level + ramp(sea, t) * elevation(waves, x, y, t))


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
def stretch_waves(waves: Table, sea: Record, change: Record, phases: FloatArray, out: Table) -> None:
    """Write the waves of a sea that differs from `waves` by `change` into `out`; `sea` and `change` are as below.

    Heights grow by a factor; angular frequencies go from w to (p / f) (w / p)^b, with the peak's p, the period's
    factor f and the band's factor b, so that the same energy lies in a band of another width; wavenumbers follow from
    the dispersion of deep water. Directions keep a share of their angles from the sea's own, which turns.

    Args:
        waves: `tables.WAVE` of the world.
        sea: peak [rad/s], direction (2,) and gravity [m/s2] of the world's sea.
        change: factors of `amplitude`, `period`, `band` and `spread`, and `turn` [rad].
        phases: (n,) of the waves at the origin at time 0 [rad].
        out: `tables.WAVE`.
    """
    for i in range(waves.size):
        wave, own = waves[i], out[i]
        own.amplitude, own.phase, own.steepness = wave.amplitude * change.amplitude, phases[i], wave.steepness
        own.orbital = wave.orbital * change.amplitude
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
