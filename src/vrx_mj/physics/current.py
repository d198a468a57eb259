"""The current: a mean, a tidal ellipse and a random part, which is the same everywhere but for the depth."""

import math

import numpy as np

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.noise import normal
from vrx_mj.physics.tables import Table


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
def current_velocity(current: Table, state: Table, layers: Table, depth: float, t: float) -> tuple[float, float]:
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
