"""Half-submerged spheres: free decay with the memory of their waves, heave in waves, and added mass."""

import json
import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.resources import root
from vrx_mj.validation.rows import Comparison, Outcome, TableRow, case
from vrx_mj.validation.rows import rows as table_rows
from vrx_mj.validation.setups import PHYSICS, only_boat, packaged_simulation, record, with_boat_at

_MEMORY = ("physics/vessel.py", "adapters/pole_fit.py", "adapters/hydro.py")
_IEA_EXTREMES = (
    ("first trough", 2.21, 2.23, -0.892, -0.868),
    ("first crest", 4.37, 4.45, 0.631, 0.651),
    ("second trough", 6.52, 6.63, -0.496, -0.466),
)
"""Times [s] and heights [m] after a drop of 1 m: five codes and CFD."""
_HEAVE = {3.0: (0.115, 0.118), 4.0: (0.99, 1.18), 4.4: (1.77, 1.88), 5.0: (1.42, 1.53), 6.0: (1.12, 1.16),
         8.0: (1.03, 1.03), 11.0: (1.01, 1.01)}  # fmt: skip
"""Heave over the amplitude of the wave by its period [s]: lowest and highest of the codes."""
_RADIUS = 5.0
_NUMBERS = (0.3, 0.5, 0.7, 1.0, 1.4, 2.0)
"""Wavenumbers times radius at which radiation is compared; the decay's is 1.03."""
_RELATIVE = {4.4: 1.70, 5.0: 1.48, 11.0: 1.00}
"""Heave over the amplitude by period [s] without diffraction, in the relative form, in the frequency domain."""


def _decay(world: str, drop: float, until: float, **keys: object) -> tuple[FloatArray, FloatArray]:
    """Times [s] and heights [m] of a sphere that is let go at a height."""
    sim = with_boat_at(packaged_simulation(world, **keys), (0.0, 0.0, drop, 0.0, 0.0, 0.0))
    count = round(until / sim.timestep)
    _, heights = record(sim, lambda sim: only_boat(sim).position[2], count, sim.timestep)
    return np.arange(count + 1, dtype=np.float64) * sim.timestep, heights


def _extremes(times: FloatArray, heights: FloatArray) -> list[tuple[float, float]]:
    """Times and heights of crests and troughs after the start: of the parabola through three samples."""
    found = []
    for i in range(1, len(heights) - 1):
        before, here, after = heights[i - 1 : i + 2]
        if (here - before) * (after - here) <= 0.0 and here != after:
            shift = 0.5 * (before - after) / (before - 2.0 * here + after)
            top = here - 0.25 * (before - after) * shift
            found.append((float(times[i] + shift * (times[1] - times[0])), float(top)))
    return found


def _in_theory() -> list[TableRow]:
    """Extremes of linear theory with the buoyancy of the sphere's shape."""
    return [each for each in table_rows("hemisphere_decay") if each["theory"] == "restoring"]


@case(*_MEMORY)
def sphere_decay() -> Outcome:
    """Free decay of a sphere with wave radiation.

    assets/validation/worlds/iea_sphere.yaml: radius 5 m, 261.8 t, half under water of 1000 kg/m3, released 1 m too
    high. Added mass and memory are from Capytaine: make_spheres.py.

    Reference: Wendt et al. (2019), benchmark of IEA OES: lowest and highest of five codes and CFD.
    """
    times, heights = _decay("iea_sphere", 1.0, 12.0)
    exact = {each["extreme"]: each["height"] for each in _in_theory()}
    for (name, *_), (time, height) in zip(_IEA_EXTREMES, _extremes(times, heights), strict=False):
        yield Comparison(f"{name}, height", "m", None, height, theory=exact[name])
        yield Comparison(f"{name}, time", "s", None, time)
    middles = [(0.5 * (early + late), 0.5 * (low + high)) for _, early, late, low, high in _IEA_EXTREMES]
    at, of = np.array(middles).T
    lines = Series("five codes and CFD", at, of, kind="points", reference=True), Series("ours", times, heights)
    yield Chart("Height of the sphere", "time [s]", "height [m]", lines)


@case(*_MEMORY, table="hemisphere_decay")
def sphere_theory() -> Outcome:
    """Free decay of a sphere, in theory.

    assets/validation/worlds/iea_sphere.yaml as in sphere-decay, in steps of 1 ms: at 10 ms the motion is half a step
    early.
    """
    times, heights = _decay("iea_sphere", 1.0, 8.0, physics={**PHYSICS, "timestep": 0.001})
    for each, (time, height) in zip(_in_theory(), _extremes(times, heights), strict=False):
        name = each["extreme"]
        yield Comparison(f"{name}, height", "m", each["height"], height)
        yield Comparison(f"{name}, time", "s", each["time"], time)


@case(*_MEMORY)
def sphere_tank() -> Outcome:
    """Free decay of a sphere in a tank.

    assets/validation/worlds/kramer_sphere.yaml: diameter 0.3 m, 7.056 kg, water of 998.2 kg/m3, g 9.82 m/s2, released
    at 30, 90 and 150 mm.

    Reference: Kramer et al. (2021), Highly accurate experimental heave decay tests with a floating sphere.
    """
    series, crests = [], []
    for drop in (0.03, 0.09, 0.15):
        times, heights = _decay("kramer_sphere", drop, 2.0)
        series.append(Series(f"{1000.0 * drop:g} mm", times, heights / drop))
        crests.append(_extremes(times, heights)[1])
    time, height = crests[0]
    yield Comparison("next crest after 30 mm, time", "s", None, time)
    yield Comparison("next crest after 30 mm, share of the drop", "", None, height / 0.03)
    yield from (
        Comparison(f"next crest after {name} mm, later than before", "s", None, crests[i + 1][0] - crests[i][0])
        for i, name in enumerate((90, 150))
    )
    measured = Series("measured crest after 30 mm", [0.7635], [0.64], kind="points", reference=True)
    yield Chart("Height over the drop", "time [s]", "height / drop", (measured, *series))


def _heave(period: float, world: str) -> float:
    """Heave over the amplitude of a low wave of a period [s], when what the start left has faded."""
    height, step = 0.1, 0.05
    sea = {"model": "regular", "height": height, "period": period, "density": 1000.0}
    sim = packaged_simulation(world, sea=sea)
    seen, places = record(sim, lambda sim: only_boat(sim).position, round(30.0 * period / step), step)
    last = slice(-round(5.0 * period / step), None)
    times, (x, _, z) = seen[last], places[last].T
    omega = 2.0 * math.pi / period
    turned = z * np.exp(1j * (omega * times - omega**2 / 9.81 * x))  # it drifts with the waves
    return float(2.0 * abs(turned.mean()) / (0.5 * height))


@case(*_MEMORY, quick=False)
def sphere_heave() -> Outcome:
    """Heave of a sphere in regular waves.

    assets/validation/worlds/iea_sphere.yaml in waves of 0.1 m, for 30 periods, with the forces of diffraction in
    its file; in iea_sphere_relative.yaml without, by the relative form.

    Reference: Wendt et al. (2019): lowest and highest of the codes, within 2 %. Relative form: (C_FK - omega2 A + i
    omega B) of the water's motion at the depth of the centre of buoyancy, in the mean over the waterplane, 2 J1(k R) /
    (k R) of that at its middle, in the frequency domain.
    """
    points = []
    for period in _HEAVE:
        points.append(_heave(period, "iea_sphere"))
        yield Comparison(f"heave at {period:g} s", "", None, points[-1])
    for period, reference in _RELATIVE.items():
        points.append(_heave(period, "iea_sphere_relative"))
        yield Comparison(f"heave at {period:g} s, relative form", "", reference, points[-1])
    periods, middle, count = list(_HEAVE), [0.5 * sum(pair) for pair in _HEAVE.values()], len(_HEAVE)
    lines = (
        Series("codes", periods, middle, kind="points", reference=True),
        Series("ours, with diffraction", periods, points[:count]),
        Series("ours, relative form", list(_RELATIVE), points[count:], kind="points"),
    )
    yield Chart("Heave over the wave's amplitude", "period [s]", "heave / amplitude", lines)


@case("adapters/hydro.py", table="hemisphere")
def hemisphere() -> Outcome:
    """Radiation of a hemisphere in heave.

    assets/robots/sphere/hydro.json, which Capytaine computed with 2592 panels.

    Reference: Hulme (1982): 0.831 of the displaced mass at frequency 0, 0.5 at infinite frequency. Between:
    """
    table = json.loads((root() / "assets" / "robots" / "sphere" / "hydro.json").read_text(encoding="utf-8"))
    displaced = table["density"] * 2.0 / 3.0 * math.pi * _RADIUS**3
    yield Comparison("A33 / (rho V), frequency 0", "", 0.831, table["added_mass_zero"][2][2] / displaced)
    yield Comparison("A33 / (rho V), infinite", "", 0.5, table["added_mass_infinite"][2][2] / displaced)
    omega = np.array(table["frequencies"])
    numbers = omega**2 * _RADIUS / table["gravity"]
    ours = {
        "A33 / (rho V)": np.array(table["added_mass"])[:, 2, 2] / displaced,
        "B33 / (rho V omega)": np.array(table["damping"])[:, 2, 2] / (displaced * omega),
    }
    exact = np.array([list(each.values()) for each in table_rows("hemisphere")]).T
    for name, reference in zip(ours, exact[1:], strict=True):
        lines = (
            Series("multipoles", exact[0], reference, kind="points", reference=True),
            Series("ours", numbers, ours[name]),
        )
        yield Chart(name, "k a", name, lines)
        yield from (
            Comparison(f"{name}, k a {ka:g}", "", value, _at(ka, numbers, ours[name]))
            for ka, value in zip(exact[0], reference, strict=True)
            if ka in _NUMBERS
        )


def _at(number: float, numbers: FloatArray, values: FloatArray) -> float:
    """A value between samples, by the cubic through the four around it."""
    first = int(np.searchsorted(numbers, number)) - 2
    x, y = numbers[first : first + 4], values[first : first + 4]
    return float(sum(y[i] * np.prod([(number - x[j]) / (x[i] - x[j]) for j in range(4) if j != i]) for i in range(4)))
