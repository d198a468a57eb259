"""What finer panels and more components change: how fast the error goes down when their number is doubled."""

import itertools
import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.physics.panels import panels_of, wrench_of_pressures
from vrx_mj.validation.cases.waves import PERIOD, moment
from vrx_mj.validation.rows import Comparison, Outcome, case
from vrx_mj.validation.setups import GRAVITY, marine_world

_DENSITY, _LENGTH, _BEAM, _DRAFT = 1025.0, 4.0, 2.0, 0.5
"""Water [kg/m3] and size of the fixed barge [m]."""
_WAVE = (2.0 * math.pi / 3.0) ** 2 / GRAVITY
"""Wavenumber of a period of 3 s in deep water [rad/m]."""
_CUTS = (2, 4, 8, 16)
"""Parts into which the barge's beam is cut; its length has twice as many."""
_COUNTS = (15, 30, 60, 120, 240)
_CALM = 1e6
"""Pressure that is added, so that all panels are wet [Pa]."""


def _side(across: tuple[FloatArray, FloatArray], place: FloatArray) -> list[FloatArray]:
    """Triangles of a rectangle, counter-clockwise along the two axes; `place` (3, 3) takes (u, v, 1) into space."""
    found = []
    for (a, b), (c, d) in itertools.product(*(itertools.pairwise(values.tolist()) for values in across)):
        p, q, r, s = (place @ (u, v, 1.0) for u, v in ((a, c), (b, c), (b, d), (a, d)))
        found += [np.array((p, q, r)), np.array((p, r, s))]
    return found


def _barge(cuts: int) -> FloatArray:
    """Bottom, bow and stern of a barge (n, 3, 3) [m], the water at z = 0."""
    x = np.linspace(-0.5 * _LENGTH, 0.5 * _LENGTH, 2 * cuts + 1)
    y, z = np.linspace(-0.5 * _BEAM, 0.5 * _BEAM, cuts + 1), np.linspace(-_DRAFT, 0.0, cuts // 2 + 1)
    bottom = np.array([(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -_DRAFT)])
    bow = np.array([(0.0, 0.0, 0.5 * _LENGTH), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    stern = np.array([(0.0, 0.0, -0.5 * _LENGTH), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)])
    return np.array(_side((y, x), bottom) + _side((y, z), bow) + _side((z, y), stern))


def _force(cuts: int, phase: float) -> FloatArray:
    """Force (6,) of the pressure of a wave of 1 m, at one phase, on the barge at rest."""
    corners = _barge(cuts).reshape(-1, 3)
    mesh = panels_of(corners, np.arange(len(corners)).reshape(-1, 3))
    x, _, z = mesh.points
    wave = _DENSITY * GRAVITY * np.exp(_WAVE * z) * np.cos(_WAVE * x + phase)
    still = np.full(len(x), _CALM)
    with_wave, without = (wrench_of_pressures(mesh, pressures) for pressures in (still + wave, still))
    return np.asarray(with_wave - without)


@case("physics/panels.py")
def panels_doubled() -> Outcome:
    """Panels doubled.

    The pressure of a wave of 3 s on a fixed barge of 4 x 2 x 0.5 m, whose bottom and ends are cut into 2 to 16
    parts across.

    Reference: Closed form, rho g A e^(-k d) sinc(k l / 2) and 2 rho g b sin(k l / 2) (1 - e^(-k d)) / k per metre.
    The pressure is linear over a panel: twice as many in each direction leave a quarter of the error, order 2.
    """
    long, deep = 0.5 * _WAVE * _LENGTH, math.exp(-_WAVE * _DRAFT)
    heave = _DENSITY * GRAVITY * _LENGTH * _BEAM * deep * math.sin(long) / long
    surge = 2.0 * _DENSITY * GRAVITY * _BEAM * math.sin(long) * (1.0 - deep) / _WAVE
    errors = {
        "heave": [abs(float(_force(cuts, 0.0)[2]) / heave - 1.0) for cuts in _CUTS],
        "surge": [abs(float(_force(cuts, 0.5 * math.pi)[0]) / surge - 1.0) for cuts in _CUTS],
    }
    yield from _convergence("Error of the force", "panels across", _CUTS, errors, 2.0)


@case("spectra.py")
def components_doubled() -> Outcome:
    """Components doubled.

    A JONSWAP sea of Tp 7 s, of 15 to 240 components: m2 / m0, the variance of the surface's vertical velocity over
    that of its height.

    Reference: Integrals of the spectrum. Each component has the mean frequency of its band, so m0 and m1 are exact,
    and m2 lacks the spread inside bands: order 2 where a spectrum ends, 0.5 for a tail of omega^-5 without end;
    this one ends at six times the peak's frequency.
    """
    exact = moment(2) / moment(0)
    errors = []
    for count in _COUNTS:
        sea = {"model": "jonswap", "significant_height": 1.0, "peak_period": PERIOD, "components": count}
        waves = marine_world(sea=sea).parameters.sea.waves
        errors.append(abs(math.fsum(wave.frequency**2 for wave in waves) / len(waves) / exact - 1.0))
    yield from _convergence("Error of m2 / m0", "components", _COUNTS, {"m2 / m0": errors}, 1.0)


def _convergence(
    title: str,
    parts: str,
    numbers: tuple[int, ...],
    errors: dict[str, list[float]],
    order: float,
) -> Outcome:
    """How fast errors go down with a number of parts; both as logarithms, with a line of an order."""
    for name, found in errors.items():
        for (a, one), (b, other) in itertools.pairwise(zip(numbers, found, strict=True)):
            quantity = f"order of the error of {name}, from {a} to {b} {parts}"
            yield Comparison(quantity, "", None, math.log2(one / other))
    x = np.log10(numbers)
    first = next(iter(errors.values()))[0]
    line = Series(f"order {order:g}", x, np.log10(first) - order * (x - x[0]), reference=True)
    points = [Series(name, x, np.log10(found), kind="points") for name, found in errors.items()]
    yield Chart(title, f"log10 of the number of {parts}", "log10 of the relative error", (line, *points))
