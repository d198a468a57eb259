"""What the other forces on a hull lack of the mean force of waves.

Those forces, in body axes at the place where the hull is, hold a part of the second-order mean force of waves, and not
the rest. What is missing, the mean force of waves less the mean of the other forces, is tabulated when a world is
compiled, and added.

Both parts depend on the speed at which the hull goes through the water, by tau = omega U / g, through which it meets
the waves at another frequency. The table has their first and second derivatives. U is slow: a velocity that swings with
the waves would add its own mean square. Nor does the force change from step to step, so it is held for some.
"""

import math
from typing import Final

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.conditions import Conditions
from vrx_mj.physics.kernel import inlined_kernel, kernel
from vrx_mj.physics.lanes import WIDTH, Lanes, broadcast, choose, load, product_and, smaller, store
from vrx_mj.physics.motion import Level, Vector, Wrench, from_origin, rotate, scale_wrench, velocity_of, zero_wrench
from vrx_mj.physics.tables import Record, Table, Waves
from vrx_mj.physics.wave_box import heading_of
from vrx_mj.physics.waves import AMPLITUDE, ANGLE, COSINE, FREQUENCY, MEMORY, SINE, ramp

ENTRY: Final = 2 * WIDTH
"""Numbers of an entry of a table of waves."""
_INSIDE: Final = 1e-9  # steps of a table by which what is at its end is inside
_HELD: Final = 10
"""Steps for which the force is held."""
_SLOW: Final = 5.0
"""Time over which the hull's velocity is averaged [s]: beyond the periods of waves as short as boats."""
FASTEST: Final = 0.12
"""Largest tau along and across a hull; what goes faster has the force of that."""


@inlined_kernel
def drift_on_vessel(
    hull: Record, vessel: Record, table: FloatArray, states: Table, sea: Record, now: Conditions
) -> Wrench:
    """Advance a hull's slow velocity, and return what its forces lack of the mean force of waves.

    Args:
        hull: a row of `tables.HULL`.
        vessel: a row of `tables.VESSEL`.
        table: that of all vessels, (n, ENTRY).
        states: `tables.DRIFT_STATE`.
        sea: a row of `tables.SEA`.
        now: surroundings and motion of the hull.

    Returns:
        The wrench in world axes about `hull.link_com`.
    """
    if vessel.drift_count == 0:
        return zero_wrench()
    own, cos_sin = states[hull.drift_state], heading_of(now.body)
    if own.left <= 1:
        east, north, _ = rotate(now.body, velocity_of(now.body))
        _follow(own, cos_sin, east - now.water.stream[0], north - now.water.stream[1], now.dt)
        entries = table[vessel.drift_start : vessel.drift_start + vessel.drift_count]
        own.surge, own.sway, own.yaw = drift_load(
            entries, vessel.drift_angles, vessel.drift_step, now.waves, sea, cos_sin, (own.u, own.v), now.time
        )
        own.left = _HELD + 1
    own.left -= 1
    cos, sin = cos_sin
    force = Wrench(cos * own.surge - sin * own.sway, sin * own.surge + cos * own.sway, 0.0, 0.0, 0.0, own.yaw)
    return scale_wrench(from_origin(force, now.body, hull.link_com), now.wet)


@kernel
def _follow(own: Record, heading: Level, east: float, north: float, dt: float) -> None:
    """Let the slow velocity of a row of `tables.DRIFT_STATE` follow that through the water [m/s], world axes.

    A row that was reset has it at once.
    """
    cos, sin = heading
    share = min(_HELD * dt / _SLOW, 1.0) if own.left == 1 else 1.0
    own.u += share * (cos * east + sin * north - own.u)
    own.v += share * (cos * north - sin * east - own.v)


@kernel
def drift_load(
    table: FloatArray, row: int, step: float, columns: Waves, sea: Record, heading: Level,
    velocity: Level, t: float,
) -> Vector:  # fmt: skip
    """Return surge and sway force [N] and yaw moment [N m] about the link's origin that a hull lacks, in its heading.

    It is that of Newman's approximation (1974): with a_i, theta_i the waves' amplitudes and phases at the hull and D_i
    what a square metre of each lacks, sum over i and j of a_i a_j (D_i + D_j) / 2 cos(theta_i - theta_j). With
    tau_u = omega u / g and tau_v it is D = D_0 + tau_u D_1 + tau_u^2 D_2 + tau_v D_3 + tau_v^2 D_4. These are linear
    between the table's entries, and beyond the last frequency those of it.

    Args:
        table: (frequencies x angles, ENTRY): D_0 to D_4 one after another, of surge and sway force [N/m2] and yaw
            moment [N/m], at multiples of `step` from 0 on and at even angles from 0 to a full turn.
        row: number of angles.
        step: between frequencies [rad/s].
        columns: `wave_columns` after `orbital_motion` at the hull, whose memory is used.
        sea: a row of `tables.SEA`.
        heading: cosine and sine of the hull's.
        velocity: slow velocity u ahead and v to the left through the water [m/s].
        t: time [s].
    """
    last = len(table) // row - 1
    place_waves(columns, row - 1, 1.0 / step, last - _INSIDE, heading)
    cos_wave, sin_wave, amplitude, frequency = columns[COSINE], columns[SINE], columns[AMPLITUDE], columns[FREQUENCY]
    place, turn, d, e = columns[MEMORY], columns[MEMORY + 1], columns[MEMORY + 2], columns[MEMORY + 3]
    ahead, aside = velocity[0] / sea.gravity, velocity[1] / sea.gravity
    even = odd = x_even = y_even = n_even = x_odd = y_odd = n_odd = 0.0
    for i in range(place.size):
        low, near = int(place[i]), int(turn[i])
        weights = weights_of(place[i] - low, turn[i] - near)
        first = ENTRY * (low * row + near)
        store(d, 0, weighted_sum(table, first, row, weights))
        store(e, 0, weighted_sum(table, first + WIDTH, row, weights))
        a, b = _within(frequency[i] * ahead), _within(frequency[i] * aside)
        x = d[0] + a * (d[3] + a * d[6]) + b * (e[1] + b * e[4])
        y = d[1] + a * (d[4] + a * d[7]) + b * (e[2] + b * e[5])
        n = d[2] + a * (d[5] + a * e[0]) + b * (e[3] + b * e[6])
        c, s = amplitude[i] * cos_wave[i], amplitude[i] * sin_wave[i]
        even, x_even, y_even, n_even = even + c, x_even + c * x, y_even + c * y, n_even + c * n
        odd, x_odd, y_odd, n_odd = odd + s, x_odd + s * x, y_odd + s * y, n_odd + s * n
    squared = ramp(sea, t) ** 2
    return (
        squared * (even * x_even + odd * x_odd),
        squared * (even * y_even + odd * y_odd),
        squared * (even * n_even + odd * n_odd),
    )


@kernel
def _within(tau: float) -> float:
    return min(max(tau, -FASTEST), FASTEST)


@kernel
def place_waves(columns: Waves, angles: int, per_step: float, last: float, heading: Level) -> None:
    """Write the waves' places in a hull's table to memory: frequency in steps, up to the last, and angle.

    The angle is that off the heading, whose cosine and sine are given, in shares of a circle of so many `angles`.
    """
    per_angle, whole, toward = angles / (2.0 * math.pi), float(angles), math.atan2(heading[1], heading[0])
    for i in range(0, columns.shape[1], WIDTH):
        store(columns[MEMORY], i, smaller(load(columns[FREQUENCY], i) * per_step, broadcast(last)))
        turn = (load(columns[ANGLE], i) - toward) * per_angle
        store(columns[MEMORY + 1], i, smaller(choose(0.0 - turn, turn + whole, turn), broadcast(whole - _INSIDE)))


@kernel
def weights_of(up: float, on: float) -> tuple[float, float, float, float]:
    """Return the weights of an entry, of that of the next angle, and of both of the next frequency, from shares."""
    return (1.0 - up) * (1.0 - on), (1.0 - up) * on, up * (1.0 - on), up * on


@kernel
def weighted_sum(numbers: FloatArray, start: int, row: int, weights: tuple[float, float, float, float]) -> Lanes:
    """Return the weighted sum of lanes of four entries of a table whose rows have so many; `start` is in the first."""
    ahead = ENTRY * row
    low = product_and(load(numbers, start + ENTRY), weights[1], load(numbers, start) * weights[0])
    high = product_and(load(numbers, start + ahead), weights[2], low)
    return product_and(load(numbers, start + ahead + ENTRY), weights[3], high)
