"""COLREGs for two vessels under power: who gives way, and how well each did. Arrays (n, 2), the two in either order.

The rules are those of the International Regulations for Preventing Collisions at Sea, 1972, part B. Bearings are those
of the other vessel from the bow, positive to port [rad]; note that seamen count them to starboard.

They are words, so numbers for them are a choice. That scores are products of a range's score and a pose's, taken at the
closest point of approach, follows Woerner, Benjamin, Novitzky and Leonard, Quantifying protocol evaluation for
autonomous collision avoidance, Autonomous Robots 43 (2019); of their formulas only the port-to-port one of a head-on
meeting is used, as others have programmed it, for we could not read the paper. The others are derived here.
"""

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.rl.problem import folded

__all__ = [
    "GIVE_WAY", "HEAD_ON", "OVERTAKEN", "OVERTAKING", "ROLES", "STAND_ON", "approach", "bearings", "departure",
    "gone_by", "keeps_clear", "pose_score", "range_score", "roles",
]  # fmt: skip

HEAD_ON, GIVE_WAY, STAND_ON, OVERTAKING, OVERTAKEN = range(5)
ROLES = ("head-on", "gives way", "stands on", "overtaking", "overtaken")
ABAFT = np.radians(112.5)
"""Who comes from more than 22.5 degrees abaft the beam is overtaking: rule 13 (b)."""
NEARLY = np.radians(15.0)
"""Courses so near to reciprocal are nearly so, and who is so near the bow is nearly ahead; rule 14 gives no number."""
READILY = np.radians(30.0)
"""An alteration of course that is readily apparent (rule 8 (b)), and departs wholly from a course that is kept."""


def bearings(x: FloatArray, y: FloatArray, yaw: FloatArray) -> FloatArray:
    """Where each sees the other, (n, 2), from places [m] and headings."""
    return folded(np.arctan2(y[:, ::-1] - y, x[:, ::-1] - x) - yaw)


def roles(bearing: FloatArray, yaw: FloatArray) -> IntArray:
    """What each has to do, (n, 2), by their places when they sight each other; rule 13 (d): it stays so.

    Head-on where both are nearly ahead of each other on nearly reciprocal courses (rule 14). Else who is in the other's
    stern sector overtakes, unless the other is in its own as well (13). Else who has the other to starboard gives way
    (15), and the other one stands on (17).
    """
    reciprocal = np.abs(np.abs(folded(yaw[:, :1] - yaw[:, 1:])) - np.pi) <= NEARLY
    head_on = reciprocal & (np.abs(bearing) <= NEARLY).all(axis=1, keepdims=True)
    astern = np.abs(bearing) > ABAFT
    overtaken = astern & ~astern[:, ::-1]
    crossing = np.where(bearing < 0.0, GIVE_WAY, STAND_ON)
    role: IntArray = np.select([np.repeat(head_on, 2, axis=1), overtaken, overtaken[:, ::-1]],
                            [HEAD_ON, OVERTAKEN, OVERTAKING], crossing)  # fmt: skip
    return role


def keeps_clear(role: IntArray) -> BoolArray:
    """Who has to keep out of the way: rules 13 (a), 14 (a) and 15."""
    clear: BoolArray = (role == HEAD_ON) | (role == GIVE_WAY) | (role == OVERTAKING)
    return clear


def gone_by(role: IntArray, x: FloatArray, y: FloatArray, course: FloatArray) -> BoolArray:
    """Whether both have gone by each other, (n,), from places [m] and the courses [rad] at their first sight.

    Each has the other abaft the beam of its course; who is overtaken has it before the beam.
    """
    ahead = np.cos(course) * (x[:, ::-1] - x) + np.sin(course) * (y[:, ::-1] - y)
    by = np.where(role == OVERTAKEN, ahead > 0.0, ahead < 0.0)
    return np.asarray(by.all(axis=1))


def approach(x: FloatArray, y: FloatArray, east: FloatArray, north: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Time [s] to the closest point of approach, 0 if that is past, and the distance there [m], (n,) each.

    Both keep their velocities: t = -p v / v^2, with p and v the relative place and velocity; d = |p + v t|.
    """
    px, py, vx, vy = x[:, 1] - x[:, 0], y[:, 1] - y[:, 0], east[:, 1] - east[:, 0], north[:, 1] - north[:, 0]
    square = vx * vx + vy * vy
    time = np.where(square > 1e-9, np.maximum(-(px * vx + py * vy) / np.maximum(square, 1e-9), 0.0), 0.0)
    return time, np.hypot(px + vx * time, py + vy * time)


def departure(turn: FloatArray, speed: FloatArray, speed_before: FloatArray) -> FloatArray:
    """How much a vessel departs from the course and speed it has to keep (rule 17 (a) (i)), 0 to 1.

    `turn` [rad] from that course over 30 degrees, plus the change of speed over the speed before.
    """
    slower = np.abs(speed - speed_before) / np.maximum(speed_before, 0.5)
    share: FloatArray = np.minimum(np.abs(turn) / READILY + slower, 1.0)
    return share


def range_score(distance: FloatArray, least: float, wanted: float) -> FloatArray:
    """1 for a closest approach at `wanted` [m] or beyond, 0 at `least` or nearer, linear between."""
    return np.clip((distance - least) / (wanted - least), 0.0, 1.0)


def pose_score(role: IntArray, bearing: FloatArray, kept: FloatArray) -> FloatArray:
    """How each passed, 0 to 1, by the bearings (n, 2) at the closest point of approach.

    Head-on, port to port (14): ((1 + sin a) / 2)^2 ((1 + sin b) / 2)^2 with both bearings a and b, 1 where both have
    the other abeam to port. Who gives way in a crossing, astern of the other (15): (1 - cos b) / 2 with b the bearing
    from the other, 0 right ahead of it. Overtaking, on either side (13): 1. Who is not to keep clear: `kept`, (n, 2),
    how well it held on (17).
    """
    abeam = ((1.0 + np.sin(bearing)) / 2.0) ** 2
    astern = (1.0 - np.cos(bearing[:, ::-1])) / 2.0
    cases = [role == HEAD_ON, role == GIVE_WAY, role == OVERTAKING]
    return np.select(cases, [abeam * abeam[:, ::-1], astern, np.ones_like(bearing)], kept)
