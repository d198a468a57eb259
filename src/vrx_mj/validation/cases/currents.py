"""The current, as drogues show it: its profile, its tide and its random part."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.frames import rotation_matrix
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Case, Findings, Row, near
from vrx_mj.validation.setups import packaged_simulation

_DEPTHS = (0.5, 2.0, 4.0, 7.5, 12.0)
"""Of the drogues in drogues.yaml [m]."""
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


def _velocity(sim: Simulation, name: str) -> FloatArray:
    """Velocity (2,) toward east and north [m/s]."""
    seen = sim.observe_object(name)
    found: FloatArray = (np.array(rotation_matrix(seen.quaternion)) @ seen.velocity)[:2]
    return found


def _unit(degrees: float) -> FloatArray:
    return np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])


def _tide() -> Findings:
    """The tide's ellipse, and the profile over depth."""
    current = {
        "speed": _MEAN, "direction": _TOWARD, "profile": _PROFILE,
        "tide": {"speed": _MAJOR, "minor": _MINOR, "direction": _AXIS, "period": _PERIOD, "phase": _PHASE},
    }  # fmt: skip
    sim, samples = packaged_simulation("drogues", current=current), 300
    sim.step(duration=_PERIOD)
    times, arrows = [], []
    for _ in range(samples):
        sim.step(duration=_PERIOD / samples)
        times.append(sim.time)
        arrows.append([_velocity(sim, f"drogue{number + 1}") for number in range(len(_DEPTHS))])
    phase = 2.0 * math.pi / _PERIOD * np.array(times)
    seen = np.array(arrows)
    mean = seen.mean(axis=0)
    swing = 2.0 * np.tensordot(np.exp(-1j * phase), seen, 1) / samples  # of e^(i omega t)
    shares = np.interp(_DEPTHS, *np.transpose(_PROFILE))
    rows: list[Row] = []
    turn = np.exp(1j * math.radians(_PHASE))
    for depth, share, steady, wave in zip(_DEPTHS, shares.tolist(), mean, swing, strict=True):
        at = f"at {depth:g} m"
        along, across = (complex(wave @ _unit(angle) / turn) for angle in (_AXIS, _AXIS + 90.0))
        rows += [
            near(f"mean {at}", "m/s", share * _MEAN, float(steady @ _unit(_TOWARD)), relative=2e-3),
            near(f"greatest tide {at}", "m/s", share * _MAJOR, along.real, relative=2e-3),
            near(f"least tide {at}, clockwise", "m/s", share * _MINOR, -across.imag, relative=2e-3),
        ]
    return Findings(tuple(rows), (_ellipses(seen, shares, phase),))


def _ellipses(seen: FloatArray, shares: FloatArray, phase: FloatArray) -> Chart:
    """What the arrow of the current draws at the surface, in the middle and at the bottom of the profile."""
    series: list[Series] = []
    angle = phase + math.radians(_PHASE)
    ring = np.outer(_MAJOR * np.cos(angle), _unit(_AXIS)) + np.outer(_MINOR * np.sin(angle), _unit(_AXIS + 90.0))
    for number in (0, 2, 4):
        east, north = (shares[number] * (_MEAN * _unit(_TOWARD) + ring)).T
        series.append(Series("" if series else "closed form", east, north, reference=True))
        series.append(Series(f"{_DEPTHS[number]:g} m", seen[::10, number, 0], seen[::10, number, 1], kind="points"))
    return Chart("Velocity over a period, by depth", "east [m/s]", "north [m/s]", tuple(series), equal=True)


def _random() -> Findings:
    """Deviation and correlation of the random part."""
    current = {"var_gain": _DEVIATION, "var_time": _KEPT, "seed": 1}
    sim, found = packaged_simulation("drogue_random", current=current), []
    sim.step(duration=20.0)
    stride = round(_SAMPLE / sim.timestep)
    for _ in range(round(_RECORD / _SAMPLE)):
        sim.advance(stride)
        found.append(_velocity(sim, "drogue"))
    record = np.array(found)
    record -= record.mean(axis=0)
    variance = float((record**2).mean())
    lags = np.arange(round(3.0 * _KEPT / _SAMPLE) + 1)
    kept = np.array([float((record[lag:] * record[: len(record) - lag]).mean()) / variance for lag in lags])
    # Bartlett (1946) for two independent records of a Gauss-Markov process, at a lag of one time constant
    independent = _RECORD / _KEPT
    correlation = 3.0 * math.sqrt(0.5 * (1.0 - 3.0 * math.exp(-2.0)) / independent)
    rows = (
        near("variance over its closed form", "", 1.0, variance / _DEVIATION**2, relative=3.0 / math.sqrt(independent)),
        near("correlation after a time constant", "", math.exp(-1.0), float(np.interp(_KEPT / _SAMPLE, lags, kept)),
             absolute=round(correlation, 4)),
        near("correlation between east and north", "", 0.0, float((record[:, 0] * record[:, 1]).mean()) / variance,
             absolute=round(3.0 / math.sqrt(independent), 4)),
    )  # fmt: skip
    times = np.array(_SAMPLE * lags, np.float64)
    lines = Series("closed form", times, np.exp(-times / _KEPT), reference=True), Series("ours", times, kept)
    return Findings(rows, (Chart("Correlation of the random part", "lag [s]", "correlation", lines),))


_FILES = ("physics/current.py", "physics/flotation.py", "runtime/loop.py")
CASES = (
    Case(
        name="current-tide",
        title="A tide over the depth",
        setup="assets/validation/worlds/drogues.yaml: neutral spheres with much drag, 0.5 to 12 m deep, in a current "
        "of 0.3 m/s toward 30 degrees with a tide of 0.6 and 0.25 m/s, turning clockwise, over a profile. Their "
        "velocities over the second of its periods of 300 s: mean and first harmonic.",
        source="Mean and ellipse of the world's file, times the share of straight lines between the profile's depths.",
        files=_FILES,
        run=_tide,
    ),
    Case(
        name="current-random",
        title="The random part of a current",
        setup="assets/validation/worlds/drogue_random.yaml: one of these spheres in a current of a random part alone, "
        f"{_DEVIATION:g} m/s with a time constant of {_KEPT:g} s: {_RECORD / 3600.0:g} h, every {_SAMPLE:g} s.",
        source="Gauss-Markov process: variance sigma^2, correlation e^(-t / tau). The bands are three standard "
        "deviations of what a record of T = 3600 tau shows in two components: of the variance and of the correlation "
        "between them sqrt(tau / T), of the correlation after tau by Bartlett (1946) sqrt((1 - 3 e^-2) tau / (2 T)).",
        files=_FILES,
        run=_random,
    ),
)
