"""A mooring in a current: where it holds what floats, and how that swings."""

import math
from itertools import pairwise

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Outcome, case, near
from vrx_mj.validation.setups import packaged_simulation, record

_MASS = 1025.0 * 4.0 / 3.0 * math.pi * 0.5**3
_DRAG = 0.05 * _MASS
"""Drag of the sphere [N s/m]."""
_LENGTH, _STIFFNESS = 3.0, 200.0
_DEPTH = 5.0
_MOORING_FILES = ("physics/afloat.py", "physics/flotation.py", "physics/current.py", "runtime/loop.py")


def _offset(speed: float) -> float:
    """How far from its anchor [m] a rope holds the sphere in a current [m/s]."""
    return _LENGTH + _DRAG * speed / _STIFFNESS


def _track(sim: Simulation, place: tuple[float, float], duration: float) -> tuple[FloatArray, FloatArray]:
    """Times (n,) and places (n, 2) of the sphere after it is let go at a place."""
    sim.set_object("sphere", pose=(*place, -_DEPTH, 0.0, 0.0, 0.0), velocity=[0.0] * 6)
    times, places = record(sim, lambda sim: sim.observe_object("sphere").position[:2], round(duration / 0.05), 0.05)
    return times - times[0], places


def _swing(times: FloatArray, offs: FloatArray) -> tuple[float, float]:
    """Mean period [s] of the crossings of 0, and the ratio of one swing to that before on the other side."""
    at = np.flatnonzero(offs[:-1] * offs[1:] < 0.0)
    crossings = times[at] - offs[at] * (times[at + 1] - times[at]) / (offs[at + 1] - offs[at])
    heights = [float(np.abs(offs[a:b]).max()) for a, b in pairwise(at)]
    ratios = np.array(heights[1:]) / np.array(heights[:-1])
    return 2.0 * float(np.diff(crossings).mean()), float(ratios.mean())


@case(*_MOORING_FILES)
def mooring_offset() -> Outcome:
    """Offset of a moored sphere in a current.

    assets/validation/worlds/moored.yaml: a neutral sphere of 1 m, 5 m deep, on a rope of 3 m and 200 N/m without
    damping; let go where the rope is straight, its place after 300 s in currents of 0.5, 1 and 1.5 m/s.

    Reference: Stretch d U / s, with the drag d = 26.8 N s/m of the sphere's file: the rope pulls on the horizontal
    plane.
    """
    longest = 300.0
    series = []
    for speed in (0.5, 1.0, 1.5):
        sim = packaged_simulation("moored", current={"speed": speed, "direction": 0})
        times, places = _track(sim, (_LENGTH, 0.0), longest)
        stretch = places[-1, 0] - _LENGTH
        yield near(f"stretch of the rope in {speed:g} m/s", "m", _offset(speed) - _LENGTH, stretch, relative=2e-3)
        series.append(Series("closed form", [0.0, longest], [_offset(speed)] * 2, reference=True))
        series.append(Series(f"{speed:g} m/s", times, places[:, 0]))
    yield Chart("Distance of the sphere from the anchor", "time [s]", "distance [m]", series)


@case(*_MOORING_FILES)
def mooring_period() -> Outcome:
    """Swings on a mooring.

    assets/validation/worlds/moored.yaml: a neutral sphere of 1 m, 5 m deep, on a rope of 3 m and 200 N/m without
    damping, in a current of 1 m/s; let go 5 cm from where it rests, along the rope and across it.

    Reference: Along sqrt(s / m - delta^2) and across sqrt(d U / (m r) - delta^2), with r the distance from the
    anchor and delta = d / 2 m: a spring, and a pendulum in the stream. Objects have no added mass. A rope is
    implicit in time, which damps as the step times its stiffness does, here 2 N s/m.
    """
    sim, aside = packaged_simulation("moored"), 0.05
    far = _offset(1.0)
    times, places = _track(sim, (far + aside, 0.0), 40.0)
    decay = _DRAG / (2.0 * _MASS)
    along = math.sqrt(_STIFFNESS / _MASS - decay**2)
    across = math.sqrt(_DRAG / (_MASS * far) - decay**2)
    stretch = places[:, 0] - far
    found, ratio = _swing(times, stretch)
    later, sway = _track(sim, (far, aside), 240.0)
    yield near("period along the rope", "s", 2.0 * math.pi / along, found, relative=0.01)
    yield near("half a swing over the one before", "", math.exp(-decay * math.pi / along), ratio, relative=0.01)
    yield near("period across it", "s", 2.0 * math.pi / across, _swing(later, sway[:, 1])[0], relative=0.01)
    closed = np.exp(-decay * times) * (np.cos(along * times) + decay / along * np.sin(along * times))
    lines = Series("closed form", times, aside * closed, reference=True), Series("ours", times, stretch)
    yield Chart("Stretch of the rope beyond that at rest", "time [s]", "stretch [m]", lines)
