"""Waves: lengths by linear theory, steep waves of the fifth order, energy, records and spreading of irregular seas."""

import math

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.spectra import Site, stokes_wave
from vrx_mj.validation.case import GRAVITY, Comparison, Outcome, case, marine_simulation, marine_world, rows

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
_FILES = ("config/weather.py", "spectra.py", "physics/waves.py")


def _simulated_wavenumber(period: float, depth: float) -> float:
    """The wavenumber [rad/m] of the surface of a regular wave, from its height at two places."""
    sea = {"model": "regular", "height": 0.02, "period": period}
    surface = marine_simulation(sea=sea if math.isinf(depth) else {**sea, "depth": depth}).sea
    place = 0.25 * GRAVITY * (period / math.tau) ** 2  # a quarter of a radian in deep water, less in shallow
    return math.acos(float(surface.height(place, 0.0, 0.0)) / float(surface.height(0.0, 0.0, 0.0))) / place


@case("spectra.py", "physics/waves.py", table="airy")
def airy() -> Outcome:
    """Lengths of linear waves.

    A world with a regular wave of 2 cm, in deep water and in two depths. The wavenumber is read off the surface:
    the arc cosine of its height at some distance from a crest over that at the crest.
    """
    for row in rows("airy"):
        period, depth = row["period"], row["depth"]
        where = "deep water" if math.isinf(depth) else f"{depth:g} m of water"
        name, ours = f"wavenumber, {period:g} s in {where}", _simulated_wavenumber(period, depth)
        yield Comparison(name, "rad/m", row["wavenumber"], ours)


@case("spectra.py", "physics/waves.py", table="stokes5")
def stokes5() -> Outcome:
    """Steep waves of the fifth order.

    Worlds with a wave of model stokes5. We search for the period at which our wave has the reference's length.
    Crest and trough are heights of the simulated surface.
    """
    for row in rows("stokes5"):
        height, length, depth = (row[key] for key in ("height", "length", "depth"))
        wave = f"H {height:g} m, length {length:g} m, depth {depth:g} m"
        speed = _stokes_speed(height, length, depth)
        sea = {"model": "stokes5", "height": height, "period": length / speed, "depth": depth}
        surface = marine_simulation(sea=sea).sea
        crest, trough = (float(surface.height(x, 0.0, 0.0)) for x in (0.0, 0.5 * length))
        yield Comparison(f"speed, {wave}", "m/s", row["speed"], speed)
        yield Comparison(f"crest, {wave}", "m", row["crest"], crest)
        yield Comparison(f"trough, {wave}", "m", row["trough"], trough)
    yield _profile()


def _stokes_speed(height: float, length: float, depth: float) -> float:
    """The speed [m/s] of the wave of a length, whose period is searched for."""

    def excess(period: float) -> float:
        return math.tau / stokes_wave(height, period, (1.0, 0.0), Site(depth, GRAVITY))[0].wavenumber - length

    airy_speed = math.sqrt(GRAVITY * length / math.tau * math.tanh(math.tau * depth / length))
    return length / float(brentq(excess, 0.8 * length / airy_speed, 1.05 * length / airy_speed, xtol=1e-12))


def _profile() -> Chart:
    """A period of the first wave of the table, beside the linear one and the other program's crest and trough."""
    row = rows("stokes5")[0]
    height, length, speed = (row[key] for key in ("height", "length", "speed"))
    sea = {"model": "stokes5", "height": height, "period": length / speed, "depth": row["depth"]}
    x = np.linspace(0.0, length, 201)
    ends = [0.0, 0.5 * length, length], [row[key] for key in ("crest", "trough", "crest")]
    lines = (
        Series("linear", x, 0.5 * height * np.cos(math.tau * x / length), reference=True),
        Series("ours", x, marine_simulation(sea=sea).sea.height(x, 0.0, 0.0)),
        Series("raschii", *ends, reference=True, kind="points"),
    )
    return Chart(f"Surface of a wave of {height:g} m, {length:g} m long", "distance [m]", "height [m]", lines)


def _jonswap(frequency: FloatArray | float, height: float) -> FloatArray:
    """The JONSWAP spectrum S(omega) [m2 s/rad] of a significant height [m], gamma 3.3, without a factor of its own."""
    omega = np.maximum(np.asarray(frequency, np.float64), 1e-6)
    peak = math.tau / PERIOD
    width = np.where(omega <= peak, 0.07, 0.09)
    enhanced = 3.3 ** np.exp(-0.5 * ((omega - peak) / (width * peak)) ** 2)
    return np.asarray(height**2 * peak**4 * omega**-5 * np.exp(-1.25 * (peak / omega) ** 4) * enhanced)


def moment(order: int) -> float:
    """Integral of omega^n S over the frequencies that a sea has."""
    peak = math.tau / PERIOD
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
        yield Comparison(f"variance, Hs {height:g} m", "m2", (height / 4.0) ** 2, variance)
    mean = math.fsum(wave.frequency for wave in waves) / len(waves)
    yield Comparison("mean frequency m1 / m0", "rad/s", moment(1) / moment(0), mean)
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
    yield Comparison(f"4 x standard deviation, mean of {_SEEDS} seeds", "m", height, np.mean(heights))
    omega = math.tau * np.fft.rfftfreq(_BLOCK, _STEP)
    seen = omega < 3.0
    shape = _jonswap(np.asarray(omega[seen], np.float64), 1.0)
    target = shape * (height / 4.0) ** 2 / np.trapezoid(shape, omega[seen])
    lines = (
        Series("JONSWAP", omega[seen], target, reference=True),
        Series("records", omega[seen], np.mean(spectra, axis=0)[seen]),
    )
    title = f"Spectrum of {_SEEDS} records of {_HOURS:g} h"
    yield Chart(title, "angular frequency [rad/s]", "density [m2 s/rad]", lines)


@case(*_FILES)
def sea_scatter() -> Outcome:
    """Significant heights of records of different seeds.

    A JONSWAP sea of Hs 1 m and Tp 7 s of 60 and 200 components; the height of the surface at one place for an hour, and
    in a world of `record: 600` for ten minutes, every two seconds, with 400 seeds.

    Reference: A Gaussian sea, whose variance m0 has the variance int S^2 df / T in a record of T seconds (Bendat and
    Piersol, 2010); the relative deviation of Hs is half of that of m0.
    """
    density = _jonswap(np.linspace(0.25, 6.0, 20_001) * math.tau / PERIOD, 1.0)
    roughness = PERIOD * 20_000 / 5.75 * float((density**2).sum() / density.sum() ** 2)
    for count in (60, 200):
        for record in (600.0, 3600.0):
            sea = {"model": "jonswap", "significant_height": 1.0, "peak_period": PERIOD, "components": count}
            sim, times = Simulation(marine_world(sea={**sea, "record": record})), np.arange(0.0, record, 2.0)
            heights = []
            for seed in range(400):
                sim.reset(seed)
                heights.append(4.0 * sim.sea.height(0.0, 0.0, times).std())
            name = f"standard deviation of Hs over {record / 60.0:g} min, {count} components"
            gaussian = 50.0 * math.sqrt(roughness / record)
            yield Comparison(name, "%", gaussian, 100.0 * np.std(heights))


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
            yield Comparison(name, "", reference, np.cos(number * angles).mean())
        theta = np.linspace(-math.pi, math.pi, 721)
        shape = np.cos(0.5 * theta) ** (2.0 * exponent)
        share = np.concatenate([[0.0], np.cumsum(0.5 * (shape[1:] + shape[:-1]))])
        series.append(Series("closed forms", np.degrees(theta), share / share[-1], reference=True))
        below = (np.arange(len(angles)) + 0.5) / len(angles)
        series.append(Series(f"s = {exponent:g}", np.degrees(np.sort(angles)), below))
    yield Chart("Share of the energy below a direction", "direction off the mean [degrees]", "share", series)
