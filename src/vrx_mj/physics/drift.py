"""What the forces on a hull without diffraction lack of the mean force of waves.

Those forces, all in body axes at the place where the hull is, hold a part of the second-order mean force of waves, and
not the rest. What is missing, the mean force of waves less the mean of the other forces, is tabulated when a world is
compiled, and added.
"""

import math
from typing import Final

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.conditions import Conditions
from vrx_mj.physics.kernel import inlined_kernel, kernel
from vrx_mj.physics.lanes import WIDTH, broadcast, choose, load, product_and, smaller, store
from vrx_mj.physics.motion import Motion, Wrench, from_origin, scale_wrench, zero_wrench
from vrx_mj.physics.tables import Record, Table, Waves
from vrx_mj.physics.wave_box import heading_of
from vrx_mj.physics.waves import AMPLITUDE, ANGLE, COSINE, FREQUENCY, MEMORY, SINE, ramp

DRIFT: Final = 8
"""Numbers of an entry of the table: surge and sway force, yaw moment and 0, and how much more they are at the next."""
_INSIDE: Final = 1e-9  # steps of a table by which what is at its end is inside


@inlined_kernel
def drift_on_vessel(
    hull: Record, vessel: Record, table: FloatArray, waves: Table, sea: Record, now: Conditions
) -> Wrench:
    """Return what the forces on a hull lack of the mean force of waves: world axes, about `hull.link_com`.

    `table` has that of all vessels, (n, DRIFT).
    """
    if vessel.drift_count == 0 or waves.size == 0:
        return zero_wrench()
    angles = vessel.drift_angles
    first, frequencies = vessel.drift_start, vessel.drift_count // angles
    entries = table[first : first + vessel.drift_count].reshape((frequencies, angles, DRIFT))
    load = drift_load(entries, vessel.drift_step, now.waves, sea, now.body, now.time)
    return scale_wrench(from_origin(load, now.body, hull.link_com), now.wet)


@kernel
def drift_load(table: FloatArray, step: float, columns: Waves, sea: Record, body: Motion, t: float) -> Wrench:
    """Return what a hull lacks of the mean force of waves: world axes, about the link's origin.

    It is that of Newman's approximation (1974): with a_i, theta_i the waves' amplitudes and phases at the hull and D_i
    what a square metre of each lacks, sum over i and j of a_i a_j (D_i + D_j) / 2 cos(theta_i - theta_j). D_i is
    linear between the table's entries, and beyond the last frequency that of it.

    Args:
        table: (frequencies, angles, DRIFT): surge and sway force [N/m2] and yaw moment [N/m] in the hull's heading, and
            what they gain up to the next frequency, at multiples of `step` from 0 on and at even angles from 0 to a
            full turn.
        step: between frequencies [rad/s].
        columns: `wave_columns` after `orbital_motion` at the hull, whose memory is used.
        sea: a row of `tables.SEA`.
        body: motion of the link.
        t: time [s].
    """
    row, numbers, cos_sin = table.shape[1], table.reshape(table.size), heading_of(body)
    place_waves(columns, row - 1, 1.0 / step, table.shape[0] - 1 - _INSIDE, cos_sin)
    cos_wave, sin_wave, amplitude = columns[COSINE], columns[SINE], columns[AMPLITUDE]
    place, turn, even, odd = columns[MEMORY], columns[MEMORY + 1], 0.0, 0.0
    own = own_later = more = more_later = broadcast(0.0)
    for i in range(place.size):
        low, near = int(place[i]), int(turn[i])
        up, on, c, s = place[i] - low, turn[i] - near, amplitude[i] * cos_wave[i], amplitude[i] * sin_wave[i]
        first = DRIFT * (low * row + near)
        lacks = product_and(load(numbers, first + DRIFT), on, load(numbers, first) * (1.0 - on))
        own, own_later = product_and(lacks, c, own), product_and(lacks, s, own_later)
        more, more_later = product_and(lacks, up * c, more), product_and(lacks, up * s, more_later)
        even, odd = even + c, odd + s
    store(place, 0, product_and(own, even, own_later * odd))
    store(turn, 0, product_and(more, even, more_later * odd))
    squared = ramp(sea, t) ** 2
    x, y, moment = squared * (place[0] + turn[4]), squared * (place[1] + turn[5]), squared * (place[2] + turn[6])
    cos, sin = cos_sin
    return Wrench(cos * x - sin * y, sin * x + cos * y, 0.0, 0.0, 0.0, moment)


@kernel
def place_waves(columns: Waves, angles: int, per_step: float, last: float, heading: tuple[float, float]) -> None:
    """Write the waves' places in a hull's table to memory: frequency in steps, up to the last, and angle.

    The angle is that off the heading, whose cosine and sine are given, in shares of a circle of so many `angles`.
    """
    per_angle, whole, toward = angles / (2.0 * math.pi), float(angles), math.atan2(heading[1], heading[0])
    for i in range(0, columns.shape[1], WIDTH):
        store(columns[MEMORY], i, smaller(load(columns[FREQUENCY], i) * per_step, broadcast(last)))
        turn = (load(columns[ANGLE], i) - toward) * per_angle
        store(columns[MEMORY + 1], i, smaller(choose(0.0 - turn, turn + whole, turn), broadcast(whole - _INSIDE)))
