"""Worlds of the cases: profile `marine`, calm and without wind or current unless given."""

import contextlib
import warnings
from collections.abc import Mapping
from typing import Any

from vrx_mj.errors import VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.reference import folder

GRAVITY = 9.81
"""Gravity of these worlds [m/s2], the value of most of the references."""


def marine_world(fleet: Mapping[str, Any] | None = None, **keys: Any) -> World:
    """A world of profile `marine`; keys are those of a world's file."""
    given = {
        "name": "tank",
        "physics": {"profile": "marine", "gravity": GRAVITY},
        "sea": {"model": "none"},
        "wind": {"objects": []},
        **keys,
    }
    return compile_world(given) if fleet is None else compile_world(given, fleet=fleet)


def marine_simulation(fleet: Mapping[str, Any] | None = None, **keys: Any) -> Simulation:
    """A run in such a world."""
    return Simulation(marine_world(fleet, **keys))


def packaged_simulation(name: str, **keys: Any) -> Simulation:
    """A run in a world of `assets/validation/worlds`, with other keys of a world's file; what is unusual is meant."""
    with warnings.catch_warnings(action="ignore", category=VrxWarning), contextlib.chdir(folder() / "worlds"):
        return Simulation(compile_world({"extends": f"./{name}.yaml", "name": name, **keys}))
