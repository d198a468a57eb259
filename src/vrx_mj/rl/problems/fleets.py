"""Problems of fleets: formation, places beside a leader that is only a point, and rendezvous, to meet at one of two."""

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.control.formation import slots
from vrx_mj.rl.options import PERIOD
from vrx_mj.rl.problem import (
    Entry,
    Facts,
    Judged,
    Problem,
    Rows,
    Spot,
    Team,
    boats_too_near,
    mean_of,
    point,
    turn_to,
    wrap_angle,
)

_SHAPES = ("line", "column", "wedge", "circle")
_SPACING = 12.0
"""Distance between neighbours [m]."""
_LEADER_SPEEDS = (0.6, 1.2)
"""Speeds of the leader, least and greatest [m/s]."""
_MAX_YAW_RATE = 0.08
"""The leader's yaw rate swings to this at most [rad/s]; half of that at the end of the widest arm is 0.7 m/s."""
_YAW_PERIOD = 40.0
"""Period of the leader's yaw rate [s]."""
_MAX_START_OFFSET = 3.0
"""A boat starts no farther beside or behind its place than this [m]."""
_LOSS_DISTANCE = 10.0
"""A boat that is lost forfeits what it is off and so much more [m], for the time left."""
_MAX_START_ANGLE = np.radians(45.0)
"""Greatest angle between the bow and the leader's course at the start [rad]."""
_PLACE_DISTANCES = (24.0, 36.0)
"""Least and largest distance between the two places [m]."""
_MAX_DRIFT = 0.2
"""Largest speed of the places, each in its own direction [m/s]."""
_MEETING_RADIUS = 5.0
"""Boats have met within this distance of a place, times the root of their number [m]."""
_HOLD_TIME = 3.0
"""Time there after which boats have met [s]."""
_START_DISTANCES = (25.0, 35.0)
"""Least and largest distance of the boats from the middle between the places at the start [m]."""
_NEARNESS_COST = 0.2
"""Cost of a step with another boat too near: 50 of them make a meeting worth nothing."""


class Formation(Problem):
    """Places of a line, column, wedge or circle, 12 m apart, that go along with a leader who is only a point.

    The shape and the leader's speed, 0.6 to 1.2 m/s, are drawn; the leader's yaw rate swings like a sine with a period
    of 40 s to at most 0.08 rad/s. Boats start within 3 m of their places, at the leader's speed.

    Reward of a boat: -0.1 for every m that it is off its place, in each step, and -1 while another one is nearer than
    6 m. The team's is the mean of that. Nothing but the loss of a boat ends its episode before time is up; it forfeits
    1 + 0.1 (off + 10) for each step left. `info`: `off` [m]; at the start `leader`, x, y [m] and course [rad],
    `leader_speed` [m/s], and `slots`, ahead and to port of the leader [m].
    """

    duration = 60.0
    entries = (
        *point("own place", 10.0),
        Entry("velocity of that place ahead [m/s]", 3.0), Entry("velocity of that place to port [m/s]", 3.0),
        *turn_to("the leader's course"),
    )  # fmt: skip
    boats, fixed = 4, False
    step_facts, start_facts = ("off",), ("leader", "leader_speed", "slots")

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows)
        n, boats = self.n, self.size
        self._shapes = np.array([slots(shape, boats, _SPACING) for shape in _SHAPES]).reshape(len(_SHAPES), boats, 2)
        self._slots = np.zeros((n, boats, 2))
        self._leader = np.zeros((n, 3))
        self._leader_speed, self._bend, self._phase, self._time = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
        self._off = np.zeros((n, boats))

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """A shape and a leader, and the boats near their places."""
        self._slots[row] = self._shapes[random.integers(len(_SHAPES))]
        self._leader[row] = 0.0, 0.0, random.uniform(-np.pi, np.pi)
        self._leader_speed[row], self._bend[row] = random.uniform(*_LEADER_SPEEDS), random.uniform(0.0, _MAX_YAW_RATE)
        self._phase[row], self._time[row] = random.uniform(-np.pi, np.pi), 0.0
        return [self.entrance(row, boat, random) for boat in range(self.size)]

    def entrance(self, row: int, boat: int, random: np.random.Generator) -> Spot:
        """Draw a start near the place of the boat, where that is by now."""
        x, y = (float(part[0, boat]) for part in self._places(slice(row, row + 1))[:2])
        dx, dy = random.uniform(-_MAX_START_OFFSET, _MAX_START_OFFSET, 2).tolist()
        heading = float(self._leader[row, 2]) + random.uniform(-_MAX_START_ANGLE, _MAX_START_ANGLE)
        return x + dx, y + dy, heading, float(self._leader_speed[row])

    def begin(self, who: BoolArray, team: Team) -> None:
        """How far the boats are off their places."""
        self._off = np.where(who, self._now(team), self._off)

    def observe(self, team: Team) -> FloatArray:
        """The place from the boat."""
        x, y, east, north = self._places()
        turn = wrap_angle(self._leader[:, 2:] - team.yaw)
        return np.stack((*team.toward(x, y), *team.body_axes(east, north), np.sin(turn), np.cos(turn)), axis=-1)

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """Lose by how far each is off, once the leader has gone on."""
        self._go_on(going)
        self._off = np.where(team.present, self._now(team), 0.0)
        own = np.where(team.present, -0.1 * self._off - boats_too_near(team), 0.0)
        return Judged(own, np.zeros_like(team.present))

    def forfeit(self, left: IntArray) -> FloatArray:
        """Penalty of the present error plus 10 m, and of another boat too near, for all steps left."""
        return (1.0 + 0.1 * (self._off + _LOSS_DISTANCE)) * left[:, None]

    def _rate(self) -> FloatArray:
        """The leaders' yaw rates (n,) [rad/s]."""
        return self._bend * np.sin(2.0 * np.pi * self._time / _YAW_PERIOD + self._phase)

    def _go_on(self, going: BoolArray) -> None:
        self._time += np.where(going, PERIOD, 0.0)
        self._leader[:, 2] += np.where(going, PERIOD * self._rate(), 0.0)
        way = np.where(going, PERIOD * self._leader_speed, 0.0)
        self._leader[:, 0] += way * np.cos(self._leader[:, 2])
        self._leader[:, 1] += way * np.sin(self._leader[:, 2])

    def _places(self, rows: slice = slice(None)) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Places (rows, boats), which turn with the leader: x, y [m], and velocities east and north [m/s]."""
        x, y, course = self._leader[rows].T[:, :, None]
        ahead, left = np.moveaxis(self._slots[rows], -1, 0)
        cos, sin = np.cos(course), np.sin(course)
        dx, dy = cos * ahead - sin * left, sin * ahead + cos * left
        speed, rate = self._leader_speed[rows, None], self._rate()[rows, None]
        return x + dx, y + dy, speed * cos - rate * dy, speed * sin + rate * dx

    def _now(self, team: Team) -> FloatArray:
        x, y, *_ = self._places()
        off: FloatArray = np.hypot(x - team.x, y - team.y)
        return off


class Rendezvous(Problem):
    """Two places 24 to 36 m apart that drift by up to 0.2 m/s; the boats, all around, have to agree upon one.

    They have met when all that are in the water were within 5 m times the root of the fleet's size of the same place
    for 3 s (10 m for four boats); that ends the episode.

    Reward of a boat: 0.1 for every m by which the place nearest to it has come nearer, and -0.2 while another one is
    nearer than 6 m. The team's: 0.1 for every m by which the boats' mean distance to the place where that is least has
    become less, -0.2 times the share of boats that are too near, and 10 for having met, which every boat gets as well.
    A boat that is lost forfeits 20, and 0.2 for each step left. `info`: `distance`, that mean [m], and `met`; at the
    start `places` [m] and their `drift` [m/s], two each.
    """

    duration = 90.0
    entries = (
        *point("first place", 10.0),
        *point("second place", 10.0),
    )  # fmt: skip
    boats, fixed = 4, False
    start_facts = ("places", "drift")

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows)
        n, boats = self.n, self.size
        self._places, self._drift = np.zeros((n, 2, 2)), np.zeros((n, 2, 2))
        self._far = np.zeros((n, boats, 2))
        self._distance, self._held = np.zeros(n), np.zeros(n, np.int64)
        self.room = _MEETING_RADIUS * float(np.sqrt(boats))

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """Two places, and the boats around them, heading anywhere."""
        bearing, half = random.uniform(-np.pi, np.pi), 0.5 * random.uniform(*_PLACE_DISTANCES)
        middle = half * np.array([np.cos(bearing), np.sin(bearing)])
        self._places[row] = middle, -middle
        ways, speeds = random.uniform(-np.pi, np.pi, 2), random.uniform(0.0, _MAX_DRIFT, 2)
        self._drift[row] = np.stack((speeds * np.cos(ways), speeds * np.sin(ways)), axis=1)
        self._held[row] = 0
        first = random.uniform(-np.pi, np.pi)
        return [_around(first + 2.0 * np.pi * boat / self.size, self.size, random) for boat in range(self.size)]

    def entrance(self, row: int, boat: int, random: np.random.Generator) -> Spot:
        """Draw a place somewhere around."""
        return _around(random.uniform(-np.pi, np.pi), self.size, random)

    def begin(self, who: BoolArray, team: Team) -> None:
        """How far they are from the places."""
        self._far = np.where(who[..., None], self._now(team), self._far)
        self._distance = np.where(who.any(axis=1), self._least(self._far, team.present), self._distance)

    def observe(self, team: Team) -> FloatArray:
        """Both places from the boat."""
        (x1, y1), (x2, y2) = np.moveaxis(self._places, 0, -1)[..., None]
        return np.stack((*team.toward(x1, y1), *team.toward(x2, y2)), axis=-1)

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """Gain by coming nearer, alone and together."""
        self._places += np.where(going[:, None, None], PERIOD * self._drift, 0.0)
        far, near, present = self._now(team), boats_too_near(team), team.present
        inside = np.asarray(((far < self.room) | ~present[..., None]).all(axis=1))
        there = inside.any(axis=1) & present.any(axis=1)
        self._held = np.where(there, self._held + going, 0)
        met = self._held >= round(_HOLD_TIME / PERIOD)
        own = 0.1 * (self._far.min(axis=2) - far.min(axis=2)) - _NEARNESS_COST * near + 10.0 * met[:, None]
        self._distance = self._least(far, present)
        team_gain = 0.1 * (self._least(self._far, present) - self._distance)
        self._far = np.where(present[..., None], far, 0.0)
        shared = team_gain - _NEARNESS_COST * mean_of(near.astype(np.float64), present) + 10.0 * met
        return Judged(np.where(present, own, 0.0), met[:, None] & present, shared)

    def forfeit(self, left: IntArray) -> FloatArray:
        """Beside the usual, having another boat too near for all steps left."""
        return super().forfeit(left) + _NEARNESS_COST * left[:, None]

    def facts(self) -> Facts:
        """How far the boats are from the place, and whether they have met."""
        return {"distance": self._distance, "met": self._held >= round(_HOLD_TIME / PERIOD)}

    def _now(self, team: Team) -> FloatArray:
        """Distances (n, boats, 2) to both places [m]."""
        x, y = np.moveaxis(self._places, -1, 0)[:, :, None]
        far: FloatArray = np.hypot(x - team.x[..., None], y - team.y[..., None])
        return far

    def _least(self, far: FloatArray, present: BoolArray) -> FloatArray:
        """The boats' mean distance (n,) to the place where it is least [m]."""
        return np.minimum(mean_of(far[..., 0], present), mean_of(far[..., 1], present))


def _around(bearing: float, boats: int, random: np.random.Generator) -> Spot:
    """A place around the middle in a direction [rad]; with many boats farther out, so that there is room."""
    away = random.uniform(*_START_DISTANCES) + max(0.0, 2.0 * (boats - 10))
    x, y = away * np.cos(bearing), away * np.sin(bearing)
    return float(x), float(y), random.uniform(-np.pi, np.pi), 0.0
