"""Irregular seas: the energy of their components, records of three hours, and spreading."""

import math

import numpy as np
from scipy.integrate import quad

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Outcome, case, near
from vrx_mj.validation.setups import marine_world

_HEIGHTS = (0.3, 0.5, 1.0, 2.0, 3.0)
PERIOD = 7.0
"""Peak period of all of these seas [s]."""
_HOURS = 3.0
_SEEDS = 20
_STEP = 0.5
"""Time between two heights of a record [s]."""
_SPREADING = (2.0, 10.0, 75.0)
_BLOCK = 256
"""Heights of a block of the periodograms."""
_FILES = ("config/sea.py", "spectra.py", "physics/waves.py")


def _jonswap(frequency: FloatArray | float, height: float) -> FloatArray:
    """The JONSWAP spectrum S(omega) [m2 s/rad] of a significant height [m], gamma 3.3, without a factor of its own."""
    omega = np.maximum(np.asarray(frequency, np.float64), 1e-6)
    peak = 2.0 * math.pi / PERIOD
    width = np.where(omega <= peak, 0.07, 0.09)
    enhanced = 3.3 ** np.exp(-0.5 * ((omega - peak) / (width * peak)) ** 2)
    return np.asarray(height**2 * peak**4 * omega**-5 * np.exp(-1.25 * (peak / omega) ** 4) * enhanced)


def moment(order: int) -> float:
    """Integral of omega^n S over the frequencies that a sea has."""
    peak = 2.0 * math.pi / PERIOD
    value, _ = quad(lambda w: w**order * float(_jonswap(w, 1.0)), 0.25 * peak, 6.0 * peak, limit=400, points=[peak])
    return float(value)


@case(*_FILES)
def sea_energy() -> Outcome:
    """Energy of the components of a sea.

    Worlds with a JONSWAP sea of peak period 7 s and significant heights of 0.3 to 3 m, 60 components. The variance
    is the sum of a^2 / 2 over the components; their mean frequency is that of all.

    Reference: JONSWAP spectrum, gamma 3.3 (Hasselmann et al., 1973): m0 = Hs^2 / 16; m1 / m0 by numerical
    integration between 0.25 and 6 times the peak's frequency, where these seas have their energy.
    """
    for height in _HEIGHTS:
        sea = {"model": "jonswap", "significant_height": height, "peak_period": PERIOD}
        waves = marine_world(sea=sea).parameters.sea.waves
        variance = math.fsum(0.5 * wave.amplitude**2 for wave in waves)
        yield near(f"variance, Hs {height:g} m", "m2", (height / 4.0) ** 2, variance, relative=1e-6)
    mean = math.fsum(wave.frequency for wave in waves) / len(waves)
    yield near("mean frequency m1 / m0", "rad/s", moment(1) / moment(0), mean, relative=1e-3)
    yield _shares(sorted(wave.frequency for wave in waves))


def _shares(frequencies: list[float]) -> Chart:
    """Share of the energy below a frequency: that of the components, and the spectrum's integral."""
    omega = np.linspace(0.2, 3.0, 400)
    density = _jonswap(omega, 1.0)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(omega))])
    steps = np.searchsorted(frequencies, omega) / len(frequencies)
    lines = Series("JONSWAP", omega, integral / integral[-1], reference=True), Series("60 components", omega, steps)
    return Chart("Share of the energy below a frequency", "angular frequency [rad/s]", "share", lines)


@case(*_FILES)
def sea_record() -> Outcome:
    """Records of three hours.

    A JONSWAP sea of Hs 1 m and Tp 7 s, 60 components; the height of the surface at one place for 3 h every 0.5 s,
    with 20 seeds.

    Reference: JONSWAP spectrum, gamma 3.3 (Hasselmann et al., 1973) whose Hs is the world's; the records' spectrum
    by Welch's method, Hann window of 128 s.
    """
    height = 1.0
    world = marine_world(sea={"model": "jonswap", "significant_height": height, "peak_period": PERIOD})
    sim, times = Simulation(world), np.arange(0.0, 3600.0 * _HOURS, _STEP)
    heights, spectra = [], []
    for seed in range(_SEEDS):
        sim.reset(seed)
        surface = sim.sea.height(0.0, 0.0, times)
        heights.append(4.0 * surface.std())
        spectra.append(_periodogram(surface))
    yield near(f"4 x standard deviation, mean of {_SEEDS} seeds", "m", height, np.mean(heights), relative=0.02)
    omega = 2.0 * math.pi * np.fft.rfftfreq(_BLOCK, _STEP)
    seen = omega < 3.0
    shape = _jonswap(np.asarray(omega[seen], np.float64), 1.0)
    target = shape * (height / 4.0) ** 2 / np.trapezoid(shape, omega[seen])
    lines = (
        Series("JONSWAP", omega[seen], target, reference=True),
        Series("records", omega[seen], np.mean(spectra, axis=0)[seen]),
    )
    title = f"Spectrum of {_SEEDS} records of {_HOURS:g} h"
    yield Chart(title, "angular frequency [rad/s]", "density [m2 s/rad]", lines)


def _periodogram(surface: FloatArray) -> FloatArray:
    """Density [m2 s/rad] by Welch's method, half-overlapping blocks under a Hann window."""
    window = np.hanning(_BLOCK)
    starts = range(0, len(surface) - _BLOCK + 1, _BLOCK // 2)
    power = np.mean([np.abs(np.fft.rfft(window * surface[start : start + _BLOCK])) ** 2 for start in starts], axis=0)
    return np.asarray(power * _STEP / (math.pi * (window**2).sum()))


@case(*_FILES)
def sea_spreading() -> Outcome:
    """Directions of a spread sea.

    Worlds with a JONSWAP sea of 500 components and spreading exponents of 2, 10 and 75. The means are those over
    the components, which have equal energy.

    Reference: D(theta) = C cos^(2 s)(theta / 2) (Longuet-Higgins et al., 1963), whose Fourier coefficients are s /
    (s + 1) and s (s - 1) / ((s + 1) (s + 2)).
    """
    series = []
    for exponent in _SPREADING:
        sea = {"model": "jonswap", "significant_height": 1.0, "peak_period": PERIOD, "spreading": exponent}
        waves = marine_world(sea={**sea, "components": 500}).parameters.sea.waves
        angles = np.array([math.atan2(wave.direction[1], wave.direction[0]) for wave in waves])
        first = exponent / (exponent + 1.0)
        second = exponent * (exponent - 1.0) / ((exponent + 1.0) * (exponent + 2.0))
        for number, reference in ((1, first), (2, second)):
            name = f"mean of cos {f'{number} ' if number > 1 else ''}theta, s = {exponent:g}"
            yield near(name, "", reference, np.cos(number * angles).mean(), relative=0.02)
        theta = np.linspace(-math.pi, math.pi, 721)
        shape = np.cos(0.5 * theta) ** (2.0 * exponent)
        share = np.concatenate([[0.0], np.cumsum(0.5 * (shape[1:] + shape[:-1]))])
        series.append(Series("closed forms", np.degrees(theta), share / share[-1], reference=True))
        below = (np.arange(len(angles)) + 0.5) / len(angles)
        series.append(Series(f"s = {exponent:g}", np.degrees(np.sort(angles)), below))
    yield Chart("Share of the energy below a direction", "direction off the mean [degrees]", "share", series)
