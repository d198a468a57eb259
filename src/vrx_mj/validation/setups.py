"""Worlds of the cases: profile `marine`, calm and without wind or current unless given."""

import contextlib
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.errors import ignore_warnings
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.world import World
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import folder

GRAVITY = 9.81
"""Gravity of these worlds [m/s2], the value of most of the references."""
PHYSICS = {"profile": "marine", "gravity": GRAVITY}
"""Key `physics` of these worlds."""


def marine_world(fleet: Mapping[str, object] | None = None, **keys: object) -> World:
    """A world of profile `marine`; keys are those of a world's file."""
    given = {"name": "tank", "physics": PHYSICS, "sea": {"model": "none"}, "wind": {"objects": []}, **keys}
    return compile_world(given, fleet=fleet)


def marine_simulation(fleet: Mapping[str, object] | None = None, **keys: object) -> Simulation:
    """A run in such a world."""
    return Simulation(marine_world(fleet, **keys))


def packaged_simulation(name: str, **keys: object) -> Simulation:
    """A run in a world of `assets/validation/worlds`, with other keys of a world's file; what is unusual is meant."""
    with ignore_warnings(), contextlib.chdir(folder() / "worlds"):
        return Simulation(compile_world({"extends": f"./{name}.yaml", "name": name, **keys}))


def one_boat(robot: str, heading: float = 0.0, **keys: object) -> dict[str, object]:
    """A fleet of one boat of a robot at the origin with a heading [rad]; keys are those of a fleet's file."""
    return {"robot": robot, "boats": [{"name": "a", "pose": [0.0, 0.0, 0.0, 0.0, 0.0, heading]}], **keys}


def with_boat_at(sim: Simulation, pose: Sequence[float], velocity: Sequence[float] | None = None) -> Simulation:
    """A run whose only boat is let go in a pose, at rest unless it has a velocity."""
    sim.set_boat(sim.boats[0], pose=pose, velocity=velocity)
    return sim


def only_boat(sim: Simulation) -> BoatObservation:
    """The only boat of a run, now."""
    return sim.observe()[sim.boats[0]]


def record(
    sim: Simulation, read: Callable[[Simulation], npt.ArrayLike], count: int, part: float, **commands: float
) -> tuple[FloatArray, FloatArray]:
    """Times (count + 1,) [s], and what is read then: now, and after each of `count` steps of `part` [s].

    The commands are those of the only boat.
    """
    given = {sim.boats[0]: commands} if commands else {}
    times, values = [sim.time], [np.array(read(sim), np.float64)]
    for _ in range(count):
        sim.step(given, duration=part)
        times.append(sim.time)
        values.append(np.array(read(sim), np.float64))
    return np.array(times), np.array(values)


def autocorrelation(off: FloatArray, lags: IntArray) -> tuple[float, list[float]]:
    """The variance of a record without a mean, and its correlation with itself some samples later."""
    variance = float((off**2).mean())
    return variance, [float((off[lag:] * off[: len(off) - lag]).mean()) / variance for lag in lags]
