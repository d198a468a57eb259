"""What is around a hull in a step, which all effects share: the wind, the water, and the motion through it.

The current is a mean, a tidal ellipse and a random part, and varies in depth alone.
"""

import math
from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import expanded_kernel, kernel
from vrx_mj.physics.kinematics import Orbital, Turning, half_step_back, orbital_motion, orbital_turning, reach_of
from vrx_mj.physics.motion import Level, Motion, Vector, Wrench, place_of, plus, relative_motion, zero_vector
from vrx_mj.physics.noise import normal
from vrx_mj.physics.tables import Record, Table, Views, Waves
from vrx_mj.physics.wave_box import heading_of


@kernel
def current_step(current: Table, state: Table, dt: float) -> None:
    """Advance the random part of each row by `dt` [s].

    An exact Gauss-Markov process: v' = v exp(-dt / tau) + gain sqrt(1 - exp(-2 dt / tau)) xi, whose standard deviation
    is `gain` at any step.
    """
    for i in range(current.size):
        own, now = current[i], state[i]
        if own.gain > 0.0:
            keep = math.exp(-dt / own.time_constant)
            kick = own.gain * math.sqrt(1.0 - keep * keep)
            now.east = keep * now.east + kick * normal(own.key, np.uint64(2) * now.counter)
            now.north = keep * now.north + kick * normal(own.key, np.uint64(2) * now.counter + np.uint64(1))
            now.counter += np.uint64(1)


@kernel
def current_share(layers: Table, depth: float) -> float:
    """Return the share of the surface's current at a depth [m]: straight lines, and the ends' beyond them."""
    if layers.size == 0:
        return 1.0
    if depth <= layers[0].depth:
        return float(layers[0].share)
    for i in range(1, layers.size):
        if depth <= layers[i].depth:
            above, below = layers[i - 1], layers[i]
            down = (depth - above.depth) / (below.depth - above.depth)
            return float(above.share + down * (below.share - above.share))
    return float(layers[layers.size - 1].share)


@kernel
def current_velocity(current: Table, state: Table, layers: Table, depth: float, t: float) -> Level:
    """Return the velocity [m/s] toward east and north at a depth [m] under the mean surface and a time `t` [s]."""
    east, north = 0.0, 0.0
    for i in range(current.size):
        own = current[i]
        share = current_share(layers, depth)
        angle = own.tide_frequency * t + own.tide_phase
        along, across = math.cos(angle), math.sin(angle)
        major, minor = own.tide_major, own.tide_minor
        east += share * (own.mean[0] + along * major[0] + across * minor[0]) + state[i].east
        north += share * (own.mean[1] + along * major[1] + across * minor[1]) + state[i].north
    return east, north


class WaterMotion(NamedTuple):
    """Motion of the undisturbed water at a point of a hull."""

    stream: Vector
    """The current [m/s], world axes."""
    orbital: Orbital
    """The waves' motion of the water there, in the mean over the hull's waterplane."""
    turning: Turning
    """The waves' turning of the water over the hull's waterplane."""


class Conditions(NamedTuple):
    """Surroundings and motion of a hull in a step."""

    waves: Waves
    """The waves, in columns or as `tables.WAVE`."""
    windage: Table | None
    """`tables.WINDAGE`; None in a run where no hull has any."""
    air: Level
    """Wind at the hull [m/s], world axes."""
    water: WaterMotion
    """Motion of the water at `hull.link_com`, or at `vessel.buoyancy`; at rest in VRX's profiles."""
    body: Motion
    """Motion of the link over ground."""
    through: Motion
    """Motion of the link through the water, which current and waves move and waves turn."""
    through_level: Motion
    """Motion of the link through water that moves but stays level."""
    pressure: Wrench
    """Pressure of the undisturbed water on a hull of `tables.VESSEL`: world axes, about `hull.link_com`."""
    wet: float
    """Share of the water's other forces that is left of such a hull when it leaves the water; 1 for others."""
    time: float
    """Time [s] at the end of the step."""
    dt: float
    """Length of the step [s]."""


@expanded_kernel
def water_motion(
    hull: Record, point: FloatArray, body: Motion, waves: Waves, a: Views, time: float, dt: float, turns: bool
) -> WaterMotion:
    """Return the motion of the water by current and waves at a point (3,) [m] of a hull, body axes.

    Velocities are those of half a step `dt` [s] ago, as the hull's is. Without `turns` that of waves is left out: a
    hull with a table of diffraction has it there.
    """
    sea = a.sea[0]
    x, y, z = place_of(body, point)
    past = half_step_back(body, point, dt)
    east, north = current_velocity(a.current, a.current_state, a.layers, sea.level - z, time - past[2])
    reach = reach_of(hull, heading_of(body))
    orbital = orbital_motion(waves, sea, x, y, z, time, reach, past)
    turning = orbital_turning(waves, sea, reach, x, y, z, time, past) if turns else Turning(0.0, *zero_vector())
    return WaterMotion((east, north, 0.0), orbital, turning)


@kernel
def still_water() -> WaterMotion:
    """Return the motion of water at rest."""
    return WaterMotion(zero_vector(), Orbital(*zero_vector(), *zero_vector()), Turning(0.0, *zero_vector()))


@kernel
def motion_through(water: WaterMotion, body: Motion) -> Motion:
    """Return a motion through water that moves so but stays level."""
    return relative_motion(body, plus(water.stream, water.orbital[:3]))
