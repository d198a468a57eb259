"""The crash stop: from full ahead to full astern (IMO MSC.137(76))."""

import numpy as np

from vrx_mj.trials.records import Figure, Trial, track_of
from vrx_mj.trials.steering import approach, approach_remarks, sail_until
from vrx_mj.trials.vessel import Vessel


def crash_stop(vessel: Vessel, *, power: float = 1.0, astern: float = 1.0) -> Trial:
    """Crash stop: engines astern at steady speed, until the vessel is dead in the water.

    Args:
        vessel: what is tried.
        power: of the approach, 0 to 1.
        astern: power astern, 0 to 1.
    """
    begun = approach(vessel, power)
    states = sail_until(vessel, -astern, 0.0, lambda seen: seen[-1].surge <= 0.0)
    track = track_of(states, [0.0] * len(states))
    share = 1.0
    if len(states) > 1 and states[-1].surge < 0.0:  # the last piece up to speed 0
        share = states[-2].surge / (states[-2].surge - states[-1].surge)
    pieces = np.hypot(np.diff(track.x), np.diff(track.y))
    stopped = states[-1].surge <= 0.0
    end = [float(values[-2] + share * (values[-1] - values[-2])) for values in (track.time, track.x, track.y)]
    way = float(pieces[:-1].sum() + share * pieces[-1])
    nan = float("nan")
    figures = {
        "speed": Figure(begun[-1].surge, "m/s", "speed of the approach"),
        "stopping_time": Figure(end[0] if stopped else nan, "s", "time until it is dead in the water"),
        "track_reach": Figure(way if stopped else nan, "m", "distance along the track"),
        "head_reach": Figure(end[1] if stopped else nan, "m", "distance along the approach"),
        "lateral_deviation": Figure(end[2] if stopped else nan, "m", "distance to port of the approach"),
    }
    curves, axes = {"speed": (track.time, track.surge)}, ("time [s]", "speed ahead [m/s]")
    return Trial("crash-stop", figures, curves, axes, track, approach_remarks(begun))
