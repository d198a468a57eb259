"""Irregular seas: the energy of their components, records of three hours, and spreading."""

import math

import numpy as np
from scipy.integrate import quad

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Case, Findings, near
from vrx_mj.validation.setups import marine_simulation, marine_world

_HEIGHTS = (0.3, 0.5, 1.0, 2.0, 3.0)
PERIOD = 7.0
"""Peak period of all of these seas [s]."""
_HOURS = 3.0
_SEEDS = 20
_STEP = 0.5
"""Time between two heights of a record [s]."""
_SPREADING = (2.0, 10.0, 75.0)


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


def _energy() -> Findings:
    """Variance and mean frequency of the components."""
    found = []
    for height in _HEIGHTS:
        sea = {"model": "jonswap", "significant_height": height, "peak_period": PERIOD}
        waves = marine_world(sea=sea).parameters.sea.waves
        variance = math.fsum(0.5 * wave.amplitude**2 for wave in waves)
        found.append(near(f"variance, Hs {height:g} m", "m2", (height / 4.0) ** 2, variance, relative=1e-6))
    mean = math.fsum(wave.frequency for wave in waves) / len(waves)
    found.append(near("mean frequency m1 / m0", "rad/s", moment(1) / moment(0), mean, relative=1e-3))
    return Findings(tuple(found), (_shares(sorted(wave.frequency for wave in waves)),))


def _shares(frequencies: list[float]) -> Chart:
    """Share of the energy below a frequency: that of the components, and the spectrum's integral."""
    omega = np.linspace(0.2, 3.0, 400)
    density = _jonswap(omega, 1.0)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(omega))])
    steps = np.searchsorted(frequencies, omega) / len(frequencies)
    return Chart(
        "Share of the energy below a frequency",
        "angular frequency [rad/s]",
        "share",
        (Series("JONSWAP", omega, integral / integral[-1], reference=True), Series("60 components", omega, steps)),
    )


def _record() -> Findings:
    """Significant height and spectrum of records of three hours."""
    height = 1.0
    world = marine_world(sea={"model": "jonswap", "significant_height": height, "peak_period": PERIOD})
    sim, times = Simulation(world), np.arange(0.0, 3600.0 * _HOURS, _STEP)
    heights, spectra = [], []
    for seed in range(_SEEDS):
        sim.reset(seed)
        surface = sim.sea.height(0.0, 0.0, times)
        heights.append(4.0 * float(surface.std()))
        spectra.append(_periodogram(surface))
    omega: FloatArray = np.asarray(2.0 * math.pi * np.fft.rfftfreq(_BLOCK, _STEP), np.float64)
    seen = omega < 3.0
    shape = _jonswap(omega[seen], 1.0)
    target = shape * (height / 4.0) ** 2 / np.trapezoid(shape, omega[seen])
    chart = Chart(
        f"Spectrum of {_SEEDS} records of {_HOURS:g} h",
        "angular frequency [rad/s]",
        "density [m2 s/rad]",
        (
            Series("JONSWAP", omega[seen], target, reference=True),
            Series("records", omega[seen], np.mean(spectra, axis=0)[seen]),
        ),
    )
    row = near(f"4 x standard deviation, mean of {_SEEDS} seeds", "m", height, float(np.mean(heights)), relative=0.02)
    return Findings((row,), (chart,))


_BLOCK = 256
"""Heights of a block of the periodograms."""


def _periodogram(surface: FloatArray) -> FloatArray:
    """Density [m2 s/rad] by Welch's method, half-overlapping blocks under a Hann window."""
    window = np.hanning(_BLOCK)
    starts = range(0, len(surface) - _BLOCK + 1, _BLOCK // 2)
    power = np.mean([np.abs(np.fft.rfft(window * surface[start : start + _BLOCK])) ** 2 for start in starts], axis=0)
    return np.asarray(power * _STEP / (math.pi * (window**2).sum()))


def _spreading() -> Findings:
    """Fourier coefficients of the directions of a spread sea."""
    found, charts = [], []
    for exponent in _SPREADING:
        sea = {"model": "jonswap", "significant_height": 1.0, "peak_period": PERIOD, "spreading": exponent}
        waves = marine_simulation(sea={**sea, "components": 500}).world.parameters.sea.waves
        angles = np.array([math.atan2(wave.direction[1], wave.direction[0]) for wave in waves])
        first = exponent / (exponent + 1.0)
        second = exponent * (exponent - 1.0) / ((exponent + 1.0) * (exponent + 2.0))
        found += [
            near(f"mean of cos theta, s = {exponent:g}", "", first, float(np.cos(angles).mean()), relative=0.02),
            near(f"mean of cos 2 theta, s = {exponent:g}", "", second, float(np.cos(2 * angles).mean()), relative=0.02),
        ]
        charts.append((exponent, np.sort(angles)))
    return Findings(tuple(found), (_directions(charts),))


def _directions(found: list[tuple[float, FloatArray]]) -> Chart:
    series: list[Series] = []
    for exponent, angles in found:
        theta = np.linspace(-math.pi, math.pi, 721)
        shape = np.cos(0.5 * theta) ** (2.0 * exponent)
        share = np.concatenate([[0.0], np.cumsum(0.5 * (shape[1:] + shape[:-1]))])
        label = "closed forms" if not series else ""
        series.append(Series(label, np.degrees(theta), share / share[-1], reference=True))
        series.append(Series(f"s = {exponent:g}", np.degrees(angles), (np.arange(len(angles)) + 0.5) / len(angles)))
    return Chart("Share of the energy below a direction", "direction off the mean [degrees]", "share", tuple(series))


_FILES = ("config/sea.py", "spectra.py", "physics/waves.py")
_SPECTRUM = "JONSWAP spectrum, gamma 3.3 (Hasselmann et al., 1973)"
CASES = (
    Case(
        name="sea-energy",
        title="Energy of the components of a sea",
        setup=f"Worlds with a JONSWAP sea of peak period {PERIOD:g} s and significant heights of 0.3 to 3 m, 60 "
        "components. The variance is the sum of a^2 / 2 over the components; their mean frequency is that of all.",
        source=f"{_SPECTRUM}: m0 = Hs^2 / 16; m1 / m0 by numerical integration between 0.25 and 6 times the peak's "
        "frequency, where these seas have their energy.",
        files=_FILES,
        run=_energy,
    ),
    Case(
        name="sea-record",
        title="Records of three hours",
        setup=f"A JONSWAP sea of Hs 1 m and Tp {PERIOD:g} s, 60 components; the height of the surface at one place "
        f"for {_HOURS:g} h every {_STEP:g} s, with {_SEEDS} seeds.",
        source=f"{_SPECTRUM} whose Hs is the world's; the records' spectrum by Welch's method, Hann window of "
        f"{_BLOCK * _STEP:g} s.",
        files=_FILES,
        run=_record,
    ),
    Case(
        name="sea-spreading",
        title="Directions of a spread sea",
        setup="Worlds with a JONSWAP sea of 500 components and spreading exponents of 2, 10 and 75. The means are "
        "those over the components, which have equal energy.",
        source="D(theta) = C cos^(2 s)(theta / 2) (Longuet-Higgins et al., 1963), whose Fourier coefficients are s "
        "/ (s + 1) and s (s - 1) / ((s + 1) (s + 2)).",
        files=_FILES,
        run=_spreading,
    ),
)
