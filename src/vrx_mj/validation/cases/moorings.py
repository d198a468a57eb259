"""A mooring in a current: where it holds what floats, and how that swings."""

import math
from itertools import pairwise

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Case, Findings, Row, near
from vrx_mj.validation.setups import packaged_simulation

_MASS = 1025.0 * 4.0 / 3.0 * math.pi * 0.5**3
_DRAG = 0.05 * _MASS
"""Drag of the sphere [N s/m]."""
_LENGTH, _STIFFNESS = 3.0, 200.0
_DEPTH = 5.0


def _offset(speed: float) -> float:
    """How far from its anchor [m] a rope holds the sphere in a current [m/s]."""
    return _LENGTH + _DRAG * speed / _STIFFNESS


def _track(sim: Simulation, place: tuple[float, float], duration: float) -> tuple[FloatArray, FloatArray]:
    """Times (n,) and places (n, 2) of the sphere after it is let go at a place."""
    sim.set_object("sphere", pose=(*place, -_DEPTH, 0.0, 0.0, 0.0), velocity=[0.0] * 6)
    start, times, places = sim.time, [0.0], [place]
    for _ in range(round(duration / 0.05)):
        sim.step(duration=0.05)
        x, y, _ = sim.observe_object("sphere").position.tolist()
        times.append(sim.time - start)
        places.append((x, y))
    return np.array(times), np.array(places)


def _swing(times: FloatArray, offs: FloatArray) -> tuple[float, float]:
    """Mean period [s] of the crossings of 0, and the ratio of one swing to that before on the other side."""
    at = np.flatnonzero(offs[:-1] * offs[1:] < 0.0)
    crossings = times[at] - offs[at] * (times[at + 1] - times[at]) / (offs[at + 1] - offs[at])
    heights = [float(np.abs(offs[a:b]).max()) for a, b in pairwise(at)]
    ratios = np.array(heights[1:]) / np.array(heights[:-1])
    return 2.0 * float(np.diff(crossings).mean()), float(ratios.mean())


def offset() -> Findings:
    """Where the rope holds the sphere."""
    longest = 300.0
    rows: list[Row] = []
    series: list[Series] = []
    for speed in (0.5, 1.0, 1.5):
        sim = packaged_simulation("moored", current={"speed": speed, "direction": 0})
        times, places = _track(sim, (_LENGTH, 0.0), longest)
        stretch = float(places[-1, 0]) - _LENGTH
        rows.append(
            near(f"stretch of the rope in {speed:g} m/s", "m", _offset(speed) - _LENGTH, stretch, relative=2e-3)
        )
        label = "closed form" if not series else ""
        series.append(Series(label, [0.0, longest], [_offset(speed)] * 2, reference=True))
        series.append(Series(f"{speed:g} m/s", times, places[:, 0]))
    return Findings(tuple(rows), (Chart("Way of the sphere", "time [s]", "from the anchor [m]", tuple(series)),))


def _period() -> Findings:
    """Swings along the taut rope and across it."""
    sim, aside = packaged_simulation("moored"), 0.05
    far = _offset(1.0)
    times, places = _track(sim, (far + aside, 0.0), 40.0)
    decay = _DRAG / (2.0 * _MASS)
    along = math.sqrt(_STIFFNESS / _MASS - decay**2)
    across = math.sqrt(_DRAG / (_MASS * far) - decay**2)
    stretch = places[:, 0] - far
    found, ratio = _swing(times, stretch)
    later, sway = _track(sim, (far, aside), 240.0)
    rows = (
        near("period along the rope", "s", 2.0 * math.pi / along, found, relative=0.01),
        near("half a swing over the one before", "", math.exp(-decay * math.pi / along), ratio, relative=0.01),
        near("period across it", "s", 2.0 * math.pi / across, _swing(later, sway[:, 1])[0], relative=0.01),
    )
    closed = np.exp(-decay * times) * (np.cos(along * times) + decay / along * np.sin(along * times))
    chart = Chart(
        "Stretch of the rope beyond that at rest",
        "time [s]",
        "stretch [m]",
        (Series("closed form", times, aside * closed, reference=True), Series("ours", times, stretch)),
    )
    return Findings(rows, (chart,))


_SETUP = (
    "assets/validation/worlds/moored.yaml: a neutral sphere of 1 m, 5 m deep, on a rope of 3 m and 200 N/m without "
    "damping"
)
_FILES = ("physics/afloat.py", "physics/flotation.py", "physics/current.py", "runtime/loop.py")
CASES = (
    Case(
        name="mooring-offset",
        title="What a mooring holds in a current",
        setup=f"{_SETUP}; let go where the rope is straight, its place after 300 s in currents of 0.5, 1 and 1.5 m/s.",
        source="Stretch d U / s, with the drag d = 26.8 N s/m of the sphere's file: the rope pulls on the horizontal "
        "plane.",
        files=_FILES,
        run=offset,
    ),
    Case(
        name="mooring-period",
        title="Swings on a mooring",
        setup=f"{_SETUP}, in a current of 1 m/s; let go 5 cm from where it rests, along the rope and across it.",
        source="Along sqrt(s / m - delta^2) and across sqrt(d U / (m r) - delta^2), with r the distance from the "
        "anchor and delta = d / 2 m: a spring, and a pendulum in the stream. Objects have no added mass. A rope is "
        "implicit in time, which damps as the step times its stiffness does, here 2 N s/m.",
        files=_FILES,
        run=_period,
    ),
)
