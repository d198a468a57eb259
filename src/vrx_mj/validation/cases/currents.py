"""The current, as drogues show it: its profile, its tide and its random part."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.frames import rotation_matrix
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Outcome, case, near
from vrx_mj.validation.setups import autocorrelation, packaged_simulation, record

_DEPTHS = (0.5, 2.0, 4.0, 7.5, 12.0)
"""Depths of the drogues in drogues.yaml [m]."""
_PROFILE = ((0.0, 1.0), (1.0, 1.0), (5.0, 0.6), (10.0, 0.1))
"""Shares of the current by depth [m]."""
_MEAN, _TOWARD = 0.3, 30.0
"""Mean speed [m/s] and its direction [degrees]."""
_MAJOR, _MINOR, _AXIS, _PERIOD, _PHASE = 0.6, -0.25, 70.0, 300.0, 40.0
"""Tide: half axes [m/s], direction of the longer [degrees], period [s], phase [degrees]."""
_DEVIATION, _KEPT = 0.1, 2.0
"""Standard deviation [m/s] and time constant [s] of the random part."""
_RECORD, _SAMPLE = 7200.0, 0.2
"""Length of its record, and time between samples [s]."""
_CURRENT_FILES = ("physics/current.py", "physics/flotation.py", "runtime/loop.py")


def _velocity(sim: Simulation, name: str) -> FloatArray:
    """Velocity (2,) toward east and north [m/s]."""
    seen = sim.observe_object(name)
    found: FloatArray = (np.array(rotation_matrix(seen.quaternion)) @ seen.velocity)[:2]
    return found


def _unit(degrees: float) -> FloatArray:
    return np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])


@case(*_CURRENT_FILES)
def current_tide() -> Outcome:
    """A tide over the depth.

    assets/validation/worlds/drogues.yaml: neutral spheres with much drag, 0.5 to 12 m deep, in a current of 0.3 m/s
    toward 30 degrees with a tide of 0.6 and 0.25 m/s, turning clockwise, over a profile. Their velocities over the
    second of its periods of 300 s: mean and first harmonic.

    Reference: Mean and ellipse of the world's file, times the share of straight lines between the profile's depths.
    """
    current = {
        "speed": _MEAN, "direction": _TOWARD, "profile": _PROFILE,
        "tide": {"speed": _MAJOR, "minor": _MINOR, "direction": _AXIS, "period": _PERIOD, "phase": _PHASE},
    }  # fmt: skip
    sim, samples, names = packaged_simulation("drogues", current=current), 300, [f"drogue{n}" for n in range(1, 6)]
    sim.step(duration=_PERIOD)
    times, found = record(sim, lambda sim: [_velocity(sim, name) for name in names], samples, _PERIOD / samples)
    phase, seen = 2.0 * math.pi / _PERIOD * times[1:], found[1:]
    mean = seen.mean(axis=0)
    swing = 2.0 * np.tensordot(np.exp(-1j * phase), seen, 1) / samples  # of e^(i omega t)
    shares = np.interp(_DEPTHS, *np.transpose(_PROFILE))
    turn = np.exp(1j * math.radians(_PHASE))
    for depth, share, steady, wave in zip(_DEPTHS, shares.tolist(), mean, swing, strict=True):
        at = f"at {depth:g} m"
        along, across = (complex(wave @ _unit(angle) / turn) for angle in (_AXIS, _AXIS + 90.0))
        yield near(f"mean {at}", "m/s", share * _MEAN, steady @ _unit(_TOWARD), relative=2e-3)
        yield near(f"greatest tide {at}", "m/s", share * _MAJOR, along.real, relative=2e-3)
        yield near(f"least tide {at}, clockwise", "m/s", share * _MINOR, -across.imag, relative=2e-3)
    yield _ellipses(seen, shares, phase)


def _ellipses(seen: FloatArray, shares: FloatArray, phase: FloatArray) -> Chart:
    """What the arrow of the current draws at the surface, in the middle and at the bottom of the profile."""
    series: list[Series] = []
    angle = phase + math.radians(_PHASE)
    ring = np.outer(_MAJOR * np.cos(angle), _unit(_AXIS)) + np.outer(_MINOR * np.sin(angle), _unit(_AXIS + 90.0))
    for number in (0, 2, 4):
        east, north = (shares[number] * (_MEAN * _unit(_TOWARD) + ring)).T
        series.append(Series("closed form", east, north, reference=True))
        series.append(Series(f"{_DEPTHS[number]:g} m", seen[::10, number, 0], seen[::10, number, 1], kind="points"))
    return Chart("Velocity over a period, by depth", "east [m/s]", "north [m/s]", series, equal=True)


@case(*_CURRENT_FILES)
def current_random() -> Outcome:
    """The random part of a current.

    assets/validation/worlds/drogue_random.yaml: one of these spheres in a current of a random part alone, 0.1 m/s
    with a time constant of 2 s: 2 h, every 0.2 s.

    Reference: Gauss-Markov process: variance sigma^2, correlation e^(-t / tau). The bands are three standard
    deviations of what a record of T = 3600 tau shows in two components: of the variance and of the correlation
    between them sqrt(tau / T), of the correlation after tau by Bartlett (1946) sqrt((1 - 3 e^-2) tau / (2 T)).
    """
    current = {"var_gain": _DEVIATION, "var_time": _KEPT, "seed": 1}
    sim = packaged_simulation("drogue_random", current=current)
    sim.step(duration=20.0)
    _, found = record(sim, lambda sim: _velocity(sim, "drogue"), round(_RECORD / _SAMPLE), _SAMPLE)
    off = found[1:] - found[1:].mean(axis=0)
    lags = np.arange(round(3.0 * _KEPT / _SAMPLE) + 1)
    variance, kept = autocorrelation(off, lags)
    # Bartlett (1946) for two independent records of a Gauss-Markov process, at a lag of one time constant
    independent = _RECORD / _KEPT
    correlation = 3.0 * math.sqrt(0.5 * (1.0 - 3.0 * math.exp(-2.0)) / independent)
    one = np.interp(_KEPT / _SAMPLE, lags, kept)
    spread, sway = 3.0 / math.sqrt(independent), round(correlation, 4)
    mixed = (off[:, 0] * off[:, 1]).mean() / variance
    yield near("variance over its closed form", "", 1.0, variance / _DEVIATION**2, relative=spread)
    yield near("correlation after a time constant", "", math.exp(-1.0), one, absolute=sway)
    yield near("correlation between east and north", "", 0.0, mixed, absolute=round(spread, 4))
    times = _SAMPLE * lags
    lines = Series("closed form", times, np.exp(-times / _KEPT), reference=True), Series("ours", times, kept)
    yield Chart("Correlation of the random part", "lag [s]", "correlation", lines)
