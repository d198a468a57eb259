"""A section of a ship between the walls of a flume, in regular waves abeam, as it was measured."""

import math
from collections import defaultdict
from itertools import groupby

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Comparison, Outcome, TableRow, case
from vrx_mj.validation.rows import rows as table_rows
from vrx_mj.validation.setups import GRAVITY, only_boat, packaged_simulation

_REST = (0.0, 0.0, -0.0964715, 0.0, 0.0, 0.0)
"""Pose of the section afloat: its centre of gravity is that far under the water."""
_LENGTH, _DENSITY = 0.586, 1000.0
_SPRINGS, _FRICTION, _STRENGTH = 59.4, 8.7, 100.0
"""Springs [N/m] and friction [N s/m] of the rig, and full thrust [N] of the engines that stand for them."""
_SLOW, _FADES = 0.74, 0.05
"""Frequency [rad/s] and decay [1/s] of the section on its springs."""
_SAMPLE, _DURATION, _SETTLED = 0.02, 30.0, 12.0
"""Time between samples, length of a run, and from when on the mean force counts [s]."""
_FORCES = {"sway": ("sway force", "N/m"), "heave": ("heave force", "N/m"), "roll": ("roll moment", "N m/m")}
"""What waves do to the fixed section, by motion, and its unit."""


@case("physics/vessel.py", "mjcf/drift.py", "runtime/loop.py", table="flume")
def section_flume() -> Outcome:
    """A section of a ship in a flume.

    assets/validation/worlds/flume.yaml: the section with the added mass, damping, diffraction and drift of linear
    theory in two dimensions, in regular waves of the measured amplitude and 1 m of water, which grow as exp(-t / 2.5
    periods). Fixed: first harmonics of Froude-Krylov force and diffraction. Afloat, on the springs and with the
    friction of the rig: first harmonics in the flume's window over that of our wave there; mean force of the last 18
    of 30 s. Its linear roll damping is fitted to the roll at 1.238 s, which is not a row.

    Reference: The mean force on the fixed section is not compared: a hull's file has that of a moving hull.
    """
    charts: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    conditions = groupby(table_rows("flume"), lambda row: (row["set"], row["period"], 1e3 * row["height"]))
    for (kind, period, height), group in conditions:
        own = list(group)
        ours = _fixed(own[0]) if kind == "fixed" else _afloat(own[0])
        for row in (row for row in own if row["quantity"] in ours):
            name, unit = _FORCES[row["quantity"]] if kind == "fixed" else (row["quantity"], "")
            found = row["measured"], ours[row["quantity"]]
            charts[name].append((period, *found))
            if (kind, name, period) != ("free", "roll", 1.238):
                yield Comparison(f"{name}, {kind}, {period:g} s, {height:g} mm", unit, *found, row["theory"])
    for name, points in charts.items():
        periods, measured, found = zip(*points, strict=True)
        theirs = Series("measured", periods, measured, kind="points", reference=True)
        yield Chart(name.capitalize(), "period [s]", name, (theirs, Series("ours", periods, found, kind="points")))


def _simulation(row: TableRow) -> Simulation:
    """The section in the waves of a row, which are there at once where it is fixed."""
    sea = {"model": "regular", "height": 2.0 * row["amplitude"], "period": row["period"], "direction": [0, 1]}
    sea |= {"density": _DENSITY, "depth": 1.0, "ramp": 0.0 if row["set"] == "fixed" else 2.5 * row["period"]}
    robot = "held" if row["set"] == "roll_held" else "robot"
    spawn = {"robot": f"flume_section/{robot}.yaml", "pose": _REST, "sensors": "none"}
    return packaged_simulation("flume", sea=sea, spawn=spawn)


def _fit(times: FloatArray, values: FloatArray, period: float, *others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means and amplitudes of the first harmonic of values (n, m) at times (n,), beside their second and `others`."""
    phase = 2.0 * math.pi / period * times
    waves = [f(n * phase) for n in (1, 2) for f in (np.cos, np.sin)]
    found = np.linalg.lstsq(np.stack([np.ones(times.size), *waves, *others], axis=1), values, rcond=None)[0]
    return found[0], np.hypot(found[1], found[2])


def _fixed(row: TableRow) -> dict[str, float]:
    """Forces on the section, put back before each sample of a period, over the wave's amplitude."""
    sim, times, found = _simulation(row), [], []
    (boat,) = sim.boats
    for _ in range(math.ceil(row["period"] / _SAMPLE)):
        sim.set_boat(boat, pose=_REST, velocity=[0.0] * 6)
        forces = sim.forces(boat)
        times.append(sim.time)
        found.append((forces["diffraction"] + forces["hydrostatics"])[1:4])
        sim.step(duration=_SAMPLE)
    _, sizes = _fit(np.array(times), np.array(found), row["period"])
    return dict(zip(_FORCES, (sizes / row["amplitude"]).tolist(), strict=True))


def _afloat(row: TableRow) -> dict[str, float]:
    """Motions over the wave's amplitude, and slope, and mean force over rho g a^2 L / 2, of the section on the rig."""
    sim, times, found = _simulation(row), [], []
    for _ in range(round(_DURATION / _SAMPLE)):
        seen = only_boat(sim)
        (_, y, z), (_, sway, heave) = seen.position, seen.velocity
        times.append(sim.time)
        found.append((y, z, seen.roll, float(sim.sea.height(0.0, 0.0, sim.time))))
        rig = {"sway": -(_SPRINGS * y + _FRICTION * sway) / _STRENGTH, "heave": -_FRICTION * heave / _STRENGTH}
        sim.step({sim.boats[0]: rig}, duration=_SAMPLE)
    t, values = np.array(times), np.array(found)
    window, late = t >= row["until"] - row["periods"] * row["period"], t >= _SETTLED
    window &= t < row["until"]
    _, sizes = _fit(t[window], values[window], row["period"], t[window])
    swing = [np.exp(-_FADES * t[late]) * f(_SLOW * t[late]) for f in (np.cos, np.sin)]
    mean, _ = _fit(t[late], values[late], row["period"], *swing)
    sway, heave, roll = (sizes[:3] / sizes[3]).tolist()
    unit = 0.5 * _DENSITY * GRAVITY * row["amplitude"] ** 2 * _LENGTH
    force = _SPRINGS * float(mean[0]) / unit
    return {"sway": sway, "heave": heave, "roll": roll / row["wavenumber"], "mean force": force}
