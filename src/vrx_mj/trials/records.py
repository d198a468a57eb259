"""What a trial records and finds: the vessel's states over time, and figures with their units."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.trials.vessel import VesselState


@dataclass(frozen=True)
class Figure:
    """A number of a trial."""

    value: float
    """Value; NaN if the trial did not get to it."""
    unit: str
    """Unit of the value."""
    meaning: str
    """What it is, in words."""


@dataclass(frozen=True)
class Track:
    """States of a vessel over time, (n,) each, from the moment at which the trial begins.

    x points along the heading at that moment, y to its left.
    """

    time: FloatArray
    """Time [s]."""
    x: FloatArray
    """Distance ahead [m]."""
    y: FloatArray
    """Distance to port [m]."""
    heading: FloatArray
    """Change of heading [rad], positive to port, without jumps."""
    surge: FloatArray
    """Speed ahead [m/s]."""
    sway: FloatArray
    """Speed to port [m/s]."""
    yaw_rate: FloatArray
    """Rate of turn [rad/s], positive to port."""
    helm: FloatArray
    """Helm -1 to 1, positive turns to port."""


def track_of(states: Sequence[VesselState], helms: Sequence[float]) -> Track:
    """The track of states and of the helm at each, from the first of them."""
    rows = np.array([(s.time, s.x, s.y, s.heading, s.surge, s.sway, s.yaw_rate) for s in states], np.float64)
    time, x, y, heading, surge, sway, rate = rows.T
    cos, sin = math.cos(heading[0]), math.sin(heading[0])
    east, north = x - x[0], y - y[0]
    return Track(
        time - time[0], cos * east + sin * north, cos * north - sin * east, np.unwrap(heading) - heading[0],
        surge, sway, rate, np.array(helms, np.float64),
    )  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """A trial that has been carried out."""

    name: str
    """Name of the trial."""
    figures: Mapping[str, Figure]
    """Figures of the trial by name."""
    curves: Mapping[str, tuple[FloatArray, FloatArray]]
    """Curves of its chart by name: abscissae and ordinates."""
    axes: tuple[str, str]
    """Names and units of the chart's axes."""
    track: Track
    """States of the vessel."""
    remarks: tuple[str, ...] = ()
    """Why figures are missing, or are not what they seem."""


def crossing(x: FloatArray, y: FloatArray, level: float) -> float:
    """Abscissa at which ordinates first reach a level from below, by a straight line; not a number if they do not."""
    beyond = np.flatnonzero(y >= level)
    if not len(beyond) or beyond[0] == 0:
        return math.nan
    i = int(beyond[0])
    return float(x[i - 1] + (level - y[i - 1]) / (y[i] - y[i - 1]) * (x[i] - x[i - 1]))
