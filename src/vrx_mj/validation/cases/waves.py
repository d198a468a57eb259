"""Regular waves: lengths by linear theory, and steep waves of the fifth order."""

import math

import numpy as np
from scipy.optimize import brentq

from vrx_mj.draw.chart import Chart, Series
from vrx_mj.linear_waves import Site
from vrx_mj.spectra import stokes_wave
from vrx_mj.validation.reference import rows
from vrx_mj.validation.rows import Outcome, case, near
from vrx_mj.validation.setups import GRAVITY, marine_simulation


def _simulated_wavenumber(period: float, depth: float) -> float:
    """The wavenumber [rad/m] of the surface of a regular wave, from its height at two places."""
    sea = {"model": "regular", "height": 0.02, "period": period}
    surface = marine_simulation(sea=sea if math.isinf(depth) else {**sea, "depth": depth}).sea
    place = 0.25 * GRAVITY * (period / (2.0 * math.pi)) ** 2  # a quarter of a radian in deep water, less in shallow
    return math.acos(float(surface.height(place, 0.0, 0.0)) / float(surface.height(0.0, 0.0, 0.0))) / place


@case("linear_waves.py", "spectra.py", "physics/waves.py", table="airy")
def airy() -> Outcome:
    """Lengths of linear waves.

    A world with a regular wave of 2 cm, in deep water and in two depths. The wavenumber is read off the surface:
    the arc cosine of its height at some distance from a crest over that at the crest.
    """
    for row in rows("airy"):
        period, depth = row["period"], row["depth"]
        where = "deep water" if math.isinf(depth) else f"{depth:g} m of water"
        name, ours = f"wavenumber, {period:g} s in {where}", _simulated_wavenumber(period, depth)
        yield near(name, "rad/m", row["wavenumber"], ours, relative=1e-6)


@case("spectra.py", "physics/waves.py", table="stokes5")
def stokes5() -> Outcome:
    """Steep waves of the fifth order.

    Worlds with a wave of model stokes5. The period is searched for at which our wave has the reference's length;
    crest and trough are heights of the simulated surface.
    """
    for row in rows("stokes5"):
        height, length, depth = (row[key] for key in ("height", "length", "depth"))
        wave = f"H {height:g} m, length {length:g} m, depth {depth:g} m"
        speed = _stokes_speed(height, length, depth)
        sea = {"model": "stokes5", "height": height, "period": length / speed, "depth": depth}
        surface = marine_simulation(sea=sea).sea
        crest, trough = (float(surface.height(x, 0.0, 0.0)) for x in (0.0, 0.5 * length))
        yield near(f"speed, {wave}", "m/s", row["speed"], speed, relative=0.005)
        yield near(f"crest, {wave}", "m", row["crest"], crest, relative=0.005)
        yield near(f"trough, {wave}", "m", row["trough"], trough, relative=0.005)
    yield _profile()


def _stokes_speed(height: float, length: float, depth: float) -> float:
    """The speed [m/s] of the wave of a length, whose period is searched for."""

    def excess(period: float) -> float:
        return 2.0 * math.pi / stokes_wave(height, period, (1.0, 0.0), Site(depth, GRAVITY))[0].wavenumber - length

    airy_speed = math.sqrt(GRAVITY * length / (2.0 * math.pi) * math.tanh(2.0 * math.pi * depth / length))
    return length / float(brentq(excess, 0.8 * length / airy_speed, 1.05 * length / airy_speed, xtol=1e-12))


def _profile() -> Chart:
    """A period of the first wave of the table, beside the linear one and the other program's crest and trough."""
    row = rows("stokes5")[0]
    height, length, speed = (row[key] for key in ("height", "length", "speed"))
    sea = {"model": "stokes5", "height": height, "period": length / speed, "depth": row["depth"]}
    x = np.linspace(0.0, length, 201)
    ends = [0.0, 0.5 * length, length], [row[key] for key in ("crest", "trough", "crest")]
    lines = (
        Series("linear", x, 0.5 * height * np.cos(2.0 * math.pi * x / length), reference=True),
        Series("ours", x, marine_simulation(sea=sea).sea.height(x, 0.0, 0.0)),
        Series("raschii", *ends, reference=True, kind="points"),
    )
    return Chart(f"Surface of a wave of {height:g} m, {length:g} m long", "distance [m]", "height [m]", lines)
