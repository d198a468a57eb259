"""The worlds that the bench sails, and what its processes take."""

import math
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.simulation import Simulation

__all__ = ["DT", "SEA", "fleet", "resident_memory", "sailing"]

DT = 0.01
"""Physics step of all of them [s]."""
SEA = {
    "sea": {"scale": 2.5},
    "wind": {
        "mean_velocity": 5.0,
        "var_gain": 1.0,
        "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}],
    },
}
"""Open water with the sea of VRX's Sydney worlds and a gusty wind."""


def fleet(count: int) -> Mapping[str, Any]:
    """Boats with two fixed engines each, 12 m apart in rows of 25."""
    places = [{"x": 12.0 * (i % 25), "y": 12.0 * (i // 25)} for i in range(count)]
    return {"usv_count": count, "thrusters": "H", "positions": places}


def sailing(count: int) -> Simulation:
    """Boats under way in the sea, warmed up."""
    sim = Simulation(compile_world(SEA, fleet=fleet(count)))
    sim.step({boat: {"left": 0.1, "right": 0.1} for boat in sim.boats}, duration=2.0)
    return sim


def resident_memory() -> float:
    """Memory of this process [bytes]; not a number where the system does not report it, as Linux does."""
    if sys.platform != "linux":
        return math.nan
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
