"""Free decay of heave, roll or pitch in calm water: period, linear and quadratic damping."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError
from vrx_mj.trials.records import Figure, Trial, Vessel, VesselState, track_of

MODES = {"heave": 0.1, "roll": math.radians(10.0), "pitch": math.radians(5.0)}
"""How far a vessel is put aside by default [m], [rad]."""
_UNITS = {"heave": "m", "roll": "rad", "pitch": "rad"}
_STEP = 0.02
"""Time between two states [s]."""
_REST = 30.0
"""Time in which it comes to rest before, and longest time of the decay [s]."""
_SMALLEST = 0.02
"""Extremes below this share of the first are left out."""


def decay(vessel: Vessel, *, mode: str = "roll", amount: float | None = None) -> Trial:
    """Free decay: put aside in heave, roll or pitch at rest, and let go.

    The figures are those of z'' + 2 alpha z' + beta |z'| z' + omega^2 z = 0: over half a period of amplitude a, the
    logarithm of the ratio of extremes is pi alpha / omega + 4/3 beta a (ITTC 7.5-02-07-04.5).

    Args:
        vessel: what is tried.
        mode: heave, roll or pitch.
        amount: how far it is put aside [m] or [rad].

    Raises:
        CommandError: unknown mode.
    """
    if mode not in MODES:
        raise CommandError(f"invalid mode '{mode}': heave, roll or pitch is needed")
    vessel.advance(0.0, 0.0, _REST)
    still = _value(vessel.state, mode)
    vessel.displace(mode, MODES[mode] if amount is None else amount)
    states = [vessel.state]
    for _ in range(round(_REST / _STEP)):
        vessel.advance(0.0, 0.0, _STEP)
        states.append(vessel.state)
    time: FloatArray = np.arange(len(states), dtype=np.float64) * _STEP
    values = np.array([_value(state, mode) for state in states]) - still
    figures = decay_figures(time, values, _UNITS[mode])
    curves = {mode: (time, values)}
    axes = ("time [s]", f"{mode} from rest [{_UNITS[mode]}]")
    return Trial("decay", figures, curves, axes, track_of(states, [0.0] * len(states)))


def _value(state: VesselState, mode: str) -> float:
    return {"heave": state.z, "roll": state.roll, "pitch": state.pitch}[mode]


def decay_figures(time: FloatArray, values: FloatArray, unit: str) -> dict[str, Figure]:
    """Period and damping of a decay about 0; not numbers where there are less than three extremes."""
    moments, sizes = _extremes(time, values)
    kept = sizes >= _SMALLEST * sizes[0]
    count = int(np.argmin(kept)) if not kept.all() else len(kept)
    moments, sizes = moments[:count], sizes[:count]
    period = alpha = beta = math.nan
    if count >= 3:
        period = 2.0 * float(np.mean(np.diff(moments)))
        omega, ratios = 2.0 * math.pi / period, np.log(sizes[:-1] / sizes[1:])
        middles = 0.5 * (sizes[:-1] + sizes[1:])
        if count >= 4:
            slope, start = np.polyfit(middles, ratios, 1)
            alpha, beta = float(start) * omega / math.pi, 0.75 * float(slope)
        else:
            alpha, beta = float(ratios.mean()) * omega / math.pi, 0.0
    ratio = alpha * period / (2.0 * math.pi)
    return {
        "period": Figure(period, "s", "period, between extremes"),
        "linear_damping": Figure(alpha, "1/s", "alpha of 2 alpha z'"),
        "damping_ratio": Figure(ratio, "", "alpha over the frequency"),
        "quadratic_damping": Figure(beta, f"1/{unit}", "beta of beta |z'| z'"),
        "extremes": Figure(float(count), "", "extremes that were used"),
    }


def _extremes(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times and sizes of the extremes, by parabolas through three points; the start is the first."""
    found = [(float(time[0]), abs(float(values[0])))]
    for i in range(1, len(values) - 1):
        before, here, after = (float(values[k]) for k in (i - 1, i, i + 1))
        last = math.copysign(1.0, float(values[0])) * (-1.0) ** (len(found) - 1)  # extremes alternate
        if abs(here) > abs(before) and abs(here) >= abs(after) and here * last < 0.0:
            curve = before - 2.0 * here + after
            shift = 0.5 * (before - after) / curve if curve else 0.0
            found.append((float(time[i] + shift * (time[1] - time[0])), abs(here - 0.25 * (before - after) * shift)))
    moments, sizes = np.array(found).T
    return moments, sizes
