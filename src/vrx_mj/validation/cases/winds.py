"""The wind: its profile over height, gusts of a spectrum, and gusts and directions that wander."""

import math
from itertools import pairwise

import numpy as np
from scipy.integrate import quad

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.case import (
    PHYSICS,
    Comparison,
    Outcome,
    autocorrelation,
    case,
    marine_simulation,
    only_boat,
    packaged_simulation,
)
from vrx_mj.validation.cases.drifting import drift_in_beam_wind

_SPEED = 12.0
"""Mean wind at 10 m [m/s]."""
_HEIGHTS = (0.5, 2.0, 5.0, 20.0, 50.0)
_EXPONENT = 0.11
_SEEDS, _HOURS, _SAMPLE = 3, 3.0, 0.5
"""Records of gusts, the length of one, and the time between samples [s]."""
_SLOWEST, _FASTEST = 1.0 / 600.0, 0.5
"""Frequencies of gusts in a world [Hz]."""
_BANDS = ((0.0, 0.01), (0.01, 0.05), (0.05, 0.2), (0.2, 1.0))
"""Bands in which energies are compared [Hz]."""
_STEP = 0.02
_GUST, _TURN, _KEPT = 1.5, 8.0, 1.0
"""Standard deviations of gusts [m/s] and of the direction [degrees], and the time constant of both [s]."""
_RECORD = 7200.0
"""Length of their record [s]."""


def _windy(**wind: object) -> Simulation:
    given = {"mean_velocity": _SPEED, "direction": 0.0, **wind}
    return marine_simulation(physics={**PHYSICS, "timestep": _STEP}, wind=given)


def _froya(z: float) -> float:
    """Mean wind [m/s] at a height [m] in ISO 19901-1."""
    return _SPEED * (1.0 + 0.0573 * math.sqrt(1.0 + 0.15 * _SPEED) * math.log(z / 10.0))


@case("physics/wind.py", "runtime/weather.py")
def wind_profile() -> Outcome:
    """The wind over height.

    Worlds with a mean wind of 12 m/s at 10 m over a logarithmic profile, whose roughness length makes it that of
    ISO 19901-1, and over a power law of 0.11; and the boat of beam_wind.yaml, whose areas are 0.3 m high, in the
    latter.

    Reference: ISO 19901-1: U (1 + C ln(z / 10)), C = 0.0573 sqrt(1 + 0.15 U), which is a logarithmic profile of
    roughness 10 e^(-1 / C); U (z / 10)^0.11; the root of beam-wind with the wind at 0.3 m.
    """
    roughness = 10.0 * math.exp(-1.0 / (0.0573 * math.sqrt(1.0 + 0.15 * _SPEED)))
    logarithm, power = _windy(roughness=roughness), _windy(exponent=_EXPONENT)
    for z in _HEIGHTS:
        yield Comparison(f"logarithmic, at {z:g} m", "m/s", _froya(z), _ahead(logarithm, z))
        yield Comparison(f"power law, at {z:g} m", "m/s", _SPEED * (z / 10.0) ** _EXPONENT, _ahead(power, z))
    sim = packaged_simulation("beam_wind", wind={"mean_velocity": _SPEED, "direction": 90, "exponent": _EXPONENT})
    sim.step(duration=60.0)
    drift = drift_in_beam_wind(_SPEED * (0.3 / 10.0) ** _EXPONENT)
    seen = only_boat(sim).velocity[1]
    yield Comparison("speed to lee of a boat 0.3 m high, power law", "m/s", drift, seen)
    fine = np.linspace(0.25, 50.0, 200)
    lines = (
        Series("ISO 19901-1, power law", [_froya(z) for z in fine.tolist()], fine, reference=True),
        Series("", _SPEED * (fine / 10.0) ** _EXPONENT, fine, reference=True),
        Series("logarithmic", [_ahead(logarithm, z) for z in _HEIGHTS], _HEIGHTS, kind="points"),
        Series("power law", [_ahead(power, z) for z in _HEIGHTS], _HEIGHTS, kind="points"),
    )
    yield Chart("Mean wind over height", "speed [m/s]", "height [m]", lines)


def _ahead(sim: Simulation, z: float) -> float:
    return float(sim.wind.velocity(0.0, z)[0])


def _npd(frequency: float, speed: float, z: float) -> float:
    """Spectrum [m2/s2/Hz] of ISO 19901-1 at a frequency [Hz], for the wind at 10 m [m/s] and a height [m]."""
    reduced = 172.0 * frequency * (z / 10.0) ** (2.0 / 3.0) * (speed / 10.0) ** -0.75
    level = 320.0 * (speed / 10.0) ** 2 * (z / 10.0) ** 0.45
    return float(level / (1.0 + reduced**0.468) ** (5.0 / (3.0 * 0.468)))


def _energy(first: float, last: float, speed: float, z: float) -> float:
    return float(quad(lambda f: _npd(f, speed, z), first, last, limit=200, epsrel=1e-9)[0])


@case("spectra.py", "physics/wind.py", "runtime/weather.py")
def wind_gusts() -> Outcome:
    """Gusts of the NPD spectrum.

    Worlds whose wind has spectrum npd with 100 components, over a power law of 0.11: 3 records of 3 h, every 0.5 s.
    Their power is that of their Fourier series.

    Reference: ISO 19901-1: S(f) = 320 (U / 10)^2 (z / 10)^0.45 / (1 + x^n)^(5 / 3 n), x = 172 f (z / 10)^(2/3) (U /
    10)^(-3/4), n = 0.468, integrated between 1/600 and 0.5 Hz, where it holds.
    """
    times = np.arange(0.0, 3600.0 * _HOURS, _SAMPLE)
    frequency = np.asarray(np.fft.rfftfreq(len(times), _SAMPLE), np.float64)
    for speed, z in ((_SPEED, 10.0), (20.0, 10.0), (_SPEED, 4.0)):
        mean = speed * (z / 10.0) ** _EXPONENT
        sim = _windy(mean_velocity=mean, spectrum="npd", components=100, height=z, exponent=_EXPONENT)
        power = np.zeros(len(frequency))
        for seed in range(_SEEDS):
            sim.reset(seed)
            gust = sim.wind.velocity(times)[:, 0] - mean
            power += 2.0 * np.abs(np.fft.rfft(gust)) ** 2 / len(times) ** 2 / _SEEDS
        whole = _energy(_SLOWEST, _FASTEST, speed, z)
        name = f"variance at {z:g} m, {speed:g} m/s at 10 m"
        yield Comparison(name, "m2/s2", whole, power[1:].sum())
        if (speed, z) == (_SPEED, 10.0):
            shown = power
    for first, last in _BANDS:
        seen = shown[1:][(frequency[1:] >= first) & (frequency[1:] < last)].sum()
        closed = _energy(max(first, _SLOWEST), min(last, _FASTEST), _SPEED, 10.0)
        name = f"variance from {first:g} to {last:g} Hz, {_SPEED:g} m/s at 10 m"
        yield Comparison(name, "m2/s2", closed, seen)
    yield _spectrum(frequency, shown)


def _spectrum(frequency: FloatArray, power: FloatArray) -> Chart:
    """Density of the records in twenty bands, and the formula."""
    edges = np.geomspace(_SLOWEST, _FASTEST, 21)
    middles = np.sqrt(edges[1:] * edges[:-1])
    width = edges[1:] - edges[:-1]
    density = [power[(frequency >= a) & (frequency < b)].sum() for a, b in pairwise(edges)] / width
    closed = [_npd(f, _SPEED, 10.0) for f in middles.tolist()]
    lines = (
        Series("ISO 19901-1", np.log10(middles), np.log10(closed), reference=True),
        Series("records", np.log10(middles), np.log10(density), kind="points"),
    )
    title = f"Spectrum of {_SEEDS} records of {_HOURS:g} h, {_SPEED:g} m/s at 10 m"
    return Chart(title, "log10 of the frequency [Hz]", "log10 of the density [m2/s2/Hz]", lines)


@case("physics/wind.py", "runtime/weather.py")
def wind_wander() -> Outcome:
    """A turning wind, and random gusts and directions.

    A wind that turns by 2 degrees/s from 30 degrees, for two turns; one with gusts of 1.5 m/s and a direction of 8
    degrees that are Gauss-Markov processes, both with a time constant of 1 s: 2 h, every 0.1 s.

    Reference: Variance sigma^2, correlation e^(-t / tau). The bands are three standard deviations of the estimate from
    a record of T = 7200 tau: sqrt(2 tau / T) of the variance, by Bartlett (1946) sqrt((1 - 3 e^-2) tau / T) of the
    correlation after tau.
    """
    rate, times = 2.0, np.linspace(0.0, 360.0, 73)
    east, north, _ = _windy(turning=rate, direction=30.0).wind.velocity(times).T
    turned = np.degrees(np.unwrap(np.arctan2(north, east)))
    slope, start = np.polyfit(times, turned, 1)
    yield Comparison("rate of a turning wind", "deg/s", rate, slope)
    yield Comparison("its direction at time 0", "deg", 30.0, start)
    keys = {"var_gain": _GUST, "var_time": _KEPT, "var_direction": _TURN, "var_direction_time": _KEPT}
    sim, samples = _windy(seed=1, **keys), np.arange(20.0, _RECORD + 20.0, 0.1)
    east, north, _ = sim.wind.velocity(samples).T
    lags = np.arange(31)
    delays = 0.1 * lags
    series = [Series("closed form", delays, np.exp(-delays / _KEPT), reference=True)]
    kinds = ("gusts", np.hypot(east, north), _GUST), ("direction", np.degrees(np.arctan2(north, east)), _TURN)
    for name, found, deviation in kinds:
        variance, kept = autocorrelation(found - found.mean(), lags)
        yield Comparison(f"variance of the {name} over its closed form", "", 1.0, variance / deviation**2)
        yield Comparison(f"correlation of the {name} after a time constant", "", math.exp(-1.0), kept[10])
        series.append(Series(name, delays, kept))
    yield Chart("Correlation", "lag [s]", "correlation", series)
