"""The Otter of published coefficients: top speeds, and periods of its free motions."""

import math

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Comparison, Outcome, case, rows
from vrx_mj.validation.setups import GRAVITY, only_boat, packaged_simulation, record

_THRUST = 0.02216 / 2.0
"""k of the thrust k n^2 of a propeller [N s2/rad2]."""
_FULL_THRUST = 119.682
"""Thrust of a propeller at full command [N], in assets/robots/otter/robot.yaml."""
_TANK = "otter_tank"
_FILES = ("mjcf/hulls.py", "physics/drag.py", "physics/vessel.py", "runtime/loop.py")
_SURGE_DAMPING = 24.4 * GRAVITY / (6.0 * 0.5144)
"""|X_u| [N s/m]: 24.4 kg of bollard pull at 6 knots."""
_PERIODS = {"heave": 0.680, "roll": 0.975, "pitch": 1.149}
"""Damped periods [s] of his M, D and G, the shortest first: make_otter.py has 0.6798, 0.9750 and 1.1486."""


def _periods(stiffness: FloatArray, damping: FloatArray) -> list[float]:
    """Damped periods [s] of accelerations by pose (6, 6) and by velocity (6, 6), the shortest first."""
    system = np.block([[np.zeros((6, 6)), np.eye(6)], [stiffness, damping]])
    return sorted(2.0 * math.pi / value.imag for value in np.linalg.eigvals(system) if value.imag > 1e-3)


def _accelerations(sim: Simulation, pose: FloatArray, velocity: FloatArray) -> FloatArray:
    """Accelerations (6,) of the boat's own velocities in one step."""
    sim.reset()
    sim.set_boat(sim.boats[0], pose=pose.tolist(), velocity=velocity.tolist())
    sim.advance(1)
    seen = only_boat(sim)
    return (np.concatenate((seen.velocity, seen.angular_velocity)) - velocity) / sim.timestep


@case(*_FILES)
def otter_periods() -> Outcome:
    """Free motions of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml, a hull of matrices (hydrostatics: matrix) at rest.
    Accelerations in one step from poses 0.1 mm or mrad aside and from velocities of 0.1 mm/s or mrad/s make the
    linear system; its damped periods are those of its eigenvalues: of heave and pitch coupled with surge, and of
    roll coupled with sway and yaw.

    Reference: Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, and his otter.py of the Python
    Vehicle Simulator (commit 61a8f41): mass, added mass, damping and stiffness by its formulas, computed independently.
    Eigenvalues of M, D and G about rest without trim, with the payload 0.05 m ahead of midships and a time constant of
    1 s in sway. Earlier versions of it have the payload amidships and no damping in sway: 0.681, 0.975 and 1.136 s.
    """
    sim, step, still = packaged_simulation(_TANK), 1e-4, np.zeros(6)
    by_pose, by_velocity = np.zeros((6, 6)), np.zeros((6, 6))
    for axis in range(6):
        aside = step * np.eye(6)[axis]
        by_pose[:, axis] = (_accelerations(sim, aside, still) - _accelerations(sim, -aside, still)) / (2.0 * step)
        by_velocity[:, axis] = (_accelerations(sim, still, aside) - _accelerations(sim, still, -aside)) / (2.0 * step)
    ours = _periods(by_pose, by_velocity)
    ours += [math.nan] * (len(_PERIODS) - len(ours))
    yield from (
        Comparison(f"damped period of {motion}", "s", reference, value)
        for (motion, reference), value in zip(_PERIODS.items(), ours, strict=False)
    )


def _command(rate: float) -> float:
    """The command of the shipped robot that has the thrust k n^2 of a propeller at a rate n [rad/s]."""
    return _THRUST * rate**2 / _FULL_THRUST


@case(*_FILES)
def otter_surge() -> Outcome:
    """Speeds of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml with both propellers at 60, 80 and 100 rad/s, 20 s from
    rest. The weight of the payload as an external force, with which the file trims the boat and pushes it ahead
    (1.118 m/s instead of 1.029), is left out: mass and stiffness have it already.

    Reference: Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, and his otter.py of the
    Python Vehicle Simulator (commit 61a8f41): mass, added mass, damping and stiffness by its formulas, computed
    independently. 2 k n^2 = |X_u| u.
    """
    sim, series = packaged_simulation(_TANK), []
    for rate in (60.0, 80.0, 100.0):
        sim.reset()
        command = _command(rate)
        times, speeds = record(sim, lambda sim: only_boat(sim).velocity[0], 100, 0.2, left=command, right=command)
        reference = 2.0 * _THRUST * rate**2 / _SURGE_DAMPING
        yield Comparison(f"speed at {rate:g} rad/s", "m/s", reference, speeds[-1])
        series.append(Series("closed form", times[[0, -1]], [reference] * 2, reference=True))
        series.append(Series(f"{rate:g} rad/s", times, speeds))
    yield Chart("Speed of the Otter", "time [s]", "speed [m/s]", series)


@case("physics/drag.py", *_FILES, table="otter_turn")
def otter_turn() -> Outcome:
    """Turn of the Otter.

    Robot otter in assets/validation/worlds/otter_tank.yaml from rest with its left propeller at 100 rad/s and its
    right one at 80, 60 s, without that external force and without the lag of propellers.
    """
    theirs = {column: np.array([row[column] for row in rows("otter_turn")]) for column in ("x", "y", "u", "v", "r")}
    sim = packaged_simulation(_TANK)
    commands = {"left": _command(100.0), "right": _command(80.0)}
    _, path = record(sim, lambda sim: only_boat(sim).position * (1.0, -1.0, 1.0), 60, 1.0, **commands)
    seen, (u, v, r) = only_boat(sim), (theirs[column][-1] for column in "uvr")
    ours = seen.velocity[0], -seen.velocity[1], -seen.angular_velocity[2]
    yield Comparison("speed ahead", "m/s", u, ours[0])
    yield Comparison("speed to starboard", "m/s", v, ours[1])
    yield Comparison("rate of turn to starboard", "rad/s", r, ours[2])
    yield Comparison("radius", "m", math.hypot(u, v) / r, math.hypot(*ours[:2]) / ours[2])
    yield Comparison("farthest ahead", "m", theirs["x"].max(), path[:, 0].max())
    yield Comparison("farthest to starboard", "m", theirs["y"].max(), path[:, 1].max())
    lines = (
        Series("his equations", theirs["y"], theirs["x"], reference=True),
        Series("ours", path[:, 1], path[:, 0]),
    )
    yield Chart("Turn of the Otter", "transfer to starboard [m]", "advance [m]", lines)
