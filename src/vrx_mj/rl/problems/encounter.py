"""Encounter: two boats on collision courses, who pass by the rules of the road: who gives way, how well each did.

The rules are those of the International Regulations for Preventing Collisions at Sea, 1972, part B, for two vessels
under power. Arrays are (n, 2), the two in either order. Bearings are those of the other vessel from the bow, positive
to port [rad]; note that seamen count them to starboard.

They are words, so numbers for them are a choice. That scores are products of a range's score and a pose's, taken at the
closest point of approach, follows Woerner, Benjamin, Novitzky and Leonard, Quantifying protocol evaluation for
autonomous collision avoidance, Autonomous Robots 43 (2019); of their formulas only the port-to-port one of a head-on
meeting is used, as others have programmed it, for we could not read the paper. The others are derived here.
"""

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.rl.problem import MIN_CLEARANCE, Entry, Facts, Judged, Problem, Rows, Spot, Team, point, wrap_angle

HEAD_ON, GIVE_WAY, STAND_ON, OVERTAKING, OVERTAKEN = range(5)
ROLES = ("head-on", "gives way", "stands on", "overtaking", "overtaken")
_ABAFT_BEARING = np.radians(112.5)
"""Who comes from more than 22.5 degrees abaft the beam is overtaking: rule 13 (b)."""
_HEAD_ON_ANGLE = np.radians(15.0)
"""Courses so near to reciprocal are nearly so, and who is so near the bow is nearly ahead; rule 14 gives no number."""
_APPARENT_TURN = np.radians(30.0)
"""An alteration of course that is readily apparent (rule 8 (b)), and departs wholly from a course that is kept."""
_COLLISION_TIME = 18.0
"""Time from the start to the collision if both kept on [s]."""
_GOAL_DISTANCE = 20.0
"""Distance of a goal from the point where the boats would collide [m]."""
_MEETING_SPEED, _OVERTAKEN_SPEED, _OVERTAKING_SPEED = 1.5, 0.8, 2.0
"""Speeds of who meets or crosses, is overtaken, and overtakes [m/s]."""
_SAFE_DISTANCE = 15.0
"""Closest approach beyond which nothing is lost [m]."""
_ACTION_DISTANCE = 15.0
"""Distance within which, with risk of collision, the stand-on vessel may act [m]: rule 17 (a) (ii), (b)."""
_GOAL_RADIUS = 5.0
"""Distance from its goal within which a boat has arrived [m]."""
_PASSED_DISTANCE = 1.0
"""Distance beyond the closest approach at which boats that are behind each other have passed [m]; waves shake them by
less."""


def bearings(x: FloatArray, y: FloatArray, yaw: FloatArray) -> FloatArray:
    """Where each sees the other, (n, 2), from places [m] and headings."""
    return wrap_angle(np.arctan2(y[:, ::-1] - y, x[:, ::-1] - x) - yaw)


def roles(bearing: FloatArray, yaw: FloatArray) -> IntArray:
    """Role of each boat, (n, 2), by their positions when they sight each other; by rule 13 (d) it stays so.

    Head-on where both are nearly ahead of each other on nearly reciprocal courses (rule 14). Else who is in the other's
    stern sector overtakes, unless the other is in its own as well (13). Else who has the other to starboard gives way
    (15), and the other one stands on (17).
    """
    reciprocal = np.abs(np.abs(wrap_angle(yaw[:, :1] - yaw[:, 1:])) - np.pi) <= _HEAD_ON_ANGLE
    head_on = reciprocal & (np.abs(bearing) <= _HEAD_ON_ANGLE).all(axis=1, keepdims=True)
    astern = np.abs(bearing) > _ABAFT_BEARING
    overtaken = astern & ~astern[:, ::-1]
    crossing = np.where(bearing < 0.0, GIVE_WAY, STAND_ON)
    role: IntArray = np.select([np.repeat(head_on, 2, axis=1), overtaken, overtaken[:, ::-1]],
                            [HEAD_ON, OVERTAKEN, OVERTAKING], crossing)  # fmt: skip
    return role


def keeps_clear(role: IntArray) -> BoolArray:
    """Whether a boat has to keep out of the way: rules 13 (a), 14 (a) and 15."""
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
    share: FloatArray = np.minimum(np.abs(turn) / _APPARENT_TURN + slower, 1.0)
    return share


def range_score(distance: FloatArray, least: float, wanted: float) -> FloatArray:
    """Score 1 for a closest approach at `wanted` [m] or beyond, 0 at `least` or nearer, linear between."""
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


class Encounter(Problem):
    """Two boats meet head-on (within 5 degrees), cross (at 50 to 130) or overtake (within 10); one in three each.

    They start under way, 1.5 m/s each or 2 and 0.8, so that both would be at one point after 18 s; each has its goal
    20 m behind that point, straight ahead. `rl/problems/encounter.py` has roles and scores.

    They have passed when each has the other abaft the beam of the course it started on, or, where one overtakes, when
    the one that does is ahead; and the range has opened by 1 m. To stop, to go astern or to turn away does not pass.

    Reward of a boat: 0.1 for every m by which its goal has come nearer, and 5 for the first time within 5 m of it.
    -0.1 times its fault in each step until they have passed. The fault of who has to keep clear, while they approach
    each other: 1 - d/15 with d [m] the closest approach at present velocities, so that early action pays (rules 8 and
    16), and head-on also any turn to port over 30 degrees, at most 1 (14). Of who has to hold on: its departure from
    course and speed (17), which is free within 15 m, where only the turn to port of who stands on in a crossing counts
    (17 c). A boat that is at its goal when they have passed leaves, with 5 times the range's score, of 6 to 15 m, times
    the pose's. -10 for being nearer than 6 m at any time, which ends the episode, without scores. A boat that is lost
    forfeits 20, and 0.1 for each step left. The team's reward is the mean of both. `info`: `role`, `closest` [m] so
    far, `passed`, `collided`, and the present `score`, 0 until they have passed; at the start `goals` [m].
    """

    duration = 60.0
    entries = (
        *point("goal", 20.0),
        Entry("sine of the turn since the start", 1.0), Entry("cosine of the turn since the start", 1.0),
        Entry("change of speed since the start [m/s]", 3.0), Entry("whether the boats meet head-on", 1.0),
        Entry("whether this boat has to keep clear", 1.0), Entry("whether the boats have passed", 1.0),
    )  # fmt: skip
    boats = 2
    step_facts, start_facts = ("role", "closest", "passed", "collided"), ("goals",)

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows)
        n = self.n
        self._goals, self._far = np.zeros((n, 2, 2)), np.zeros((n, 2))
        self._course, self._speed = np.zeros((n, 2)), np.zeros((n, 2))
        self._role = np.zeros((n, 2), np.int64)
        self._closest, self._passed = np.zeros(n), np.zeros(n, np.bool_)
        self._bearing, self._held, self._steps = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros(n, np.int64)
        self._reached, self._collided = np.zeros((n, 2), np.bool_), np.zeros(n, np.bool_)

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """A situation, which boat has which part in it, and the way it lies in the world."""
        kind, course, side = int(random.integers(3)), random.uniform(-np.pi, np.pi), random.choice((-1.0, 1.0))
        apart = (np.radians(180.0 + random.uniform(-5.0, 5.0)), side * np.radians(random.uniform(50.0, 130.0)),
                 np.radians(random.uniform(-10.0, 10.0)))[kind]  # fmt: skip
        ways = [
            (course, _OVERTAKING_SPEED if kind == 2 else _MEETING_SPEED),
            (course + apart, _OVERTAKEN_SPEED if kind == 2 else _MEETING_SPEED),
        ]
        if random.random() < 0.5:
            ways.reverse()
        self._goals[row] = [(_GOAL_DISTANCE * np.cos(way), _GOAL_DISTANCE * np.sin(way)) for way, _ in ways]
        return [
            (-_COLLISION_TIME * speed * np.cos(way), -_COLLISION_TIME * speed * np.sin(way), way, speed)
            for way, speed in ways
        ]

    def begin(self, who: BoolArray, team: Team) -> None:
        """The roles of both."""
        rows = who.any(axis=1)
        bearing = bearings(team.x, team.y, team.yaw)
        for kept, now in (
            (self._far, self._distances(team)), (self._course, team.yaw), (self._speed, _speeds(team)),
            (self._role, roles(bearing, team.yaw)), (self._closest, _gap(team)), (self._bearing, bearing),
        ):  # fmt: skip
            kept[rows] = now[rows]
        for count in (self._passed, self._collided, self._reached, self._held, self._steps):
            count[rows] = 0

    def observe(self, team: Team) -> FloatArray:
        """The goal from the boat, what it must do, and what it did."""
        turn = wrap_angle(team.yaw - self._course)
        head_on = self._role == HEAD_ON
        passed = np.repeat(self._passed[:, None], 2, axis=1)
        return np.stack(
            (*team.toward(*np.moveaxis(self._goals, -1, 0)), np.sin(turn), np.cos(turn), _speeds(team) - self._speed,
             head_on, keeps_clear(self._role), passed), axis=-1
        )  # fmt: skip

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """Gain by the goal, lose by faults, and be scored at the goal when they have passed."""
        far, gap, both = self._distances(team), _gap(team), team.present.all(axis=1)
        meet = both & going
        self._follow(team, gap, meet)
        fault, touched = self._faults(team, gap, meet), meet & (gap < MIN_CLEARANCE)
        self._collided |= touched
        inside = (far < _GOAL_RADIUS) & team.present & ~touched[:, None]
        leaves = inside & (self._passed | ~both)[:, None]
        own = 0.1 * (self._far - far) - 0.1 * fault + 5.0 * (inside & ~self._reached) - 10.0 * touched[:, None]
        own = np.where(team.present, own + 5.0 * np.where(leaves, self._scores(), 0.0), 0.0)
        self._reached |= inside
        self._far = far
        return Judged(own, touched[:, None] | leaves)

    def forfeit(self, left: IntArray) -> FloatArray:
        """Beside the usual, being at fault for all steps left."""
        return super().forfeit(left) + 0.1 * left[:, None]

    def facts(self) -> Facts:
        """Roles of the boats, how near they came, and what that was worth."""
        return super().facts() | {"score": self._scores()}

    def _faults(self, team: Team, gap: FloatArray, meet: BoolArray) -> FloatArray:
        """Faults (n, 2), 0 to 1; none after passing. What the stand-on vessel departs is added up for its score."""
        time, distance = approach(team.x, team.y, *team.velocity())
        port = np.clip(wrap_angle(team.yaw - self._course) / _APPARENT_TURN, 0.0, 1.0)
        risk = np.clip(1.0 - distance / _SAFE_DISTANCE, 0.0, 1.0)[:, None]
        clear = np.minimum(risk + np.where(self._role == HEAD_ON, port, 0.0), 1.0)
        off = departure(wrap_angle(team.yaw - self._course), _speeds(team), self._speed)
        late = np.where(self._role == STAND_ON, port, 0.0)
        holds = np.where((gap < _ACTION_DISTANCE)[:, None], late, off)
        before, closing = (meet & ~self._passed)[:, None], (time > 0.0)[:, None]
        self._steps += before[:, 0]
        self._held += np.where(before, holds, 0.0)
        faults: FloatArray = np.where(keeps_clear(self._role), np.where(closing, clear, 0.0), holds)
        return np.where(before, faults, 0.0)

    def _follow(self, team: Team, gap: FloatArray, meet: BoolArray) -> None:
        """Keep the closest approach so far, and whether they have passed."""
        nearer = meet & (gap < self._closest)
        self._closest = np.where(nearer, gap, self._closest)
        now = bearings(team.x, team.y, team.yaw)
        self._bearing = np.where(nearer[:, None], now, self._bearing)
        behind = gone_by(self._role, team.x, team.y, self._course)
        self._passed = np.where(meet, behind & (gap > self._closest + _PASSED_DISTANCE), self._passed)

    def _scores(self) -> FloatArray:
        """The present scores, (n, 2): 0 until the boats have passed, and after a collision."""
        kept = 1.0 - self._held / np.maximum(self._steps, 1)[:, None]
        safe = range_score(self._closest, MIN_CLEARANCE, _SAFE_DISTANCE)
        counts = (safe * self._passed * ~self._collided)[:, None]
        return counts * pose_score(self._role, self._bearing, kept)

    def _distances(self, team: Team) -> FloatArray:
        """Distances to the goals, (n, 2) [m]."""
        x, y = np.moveaxis(self._goals, -1, 0)
        return np.hypot(x - team.x, y - team.y)


def _gap(team: Team) -> FloatArray:
    """Distance between both boats, (n,) [m]."""
    return np.hypot(team.x[:, 1] - team.x[:, 0], team.y[:, 1] - team.y[:, 0])


def _speeds(team: Team) -> FloatArray:
    """Speeds over ground, (n, 2) [m/s]."""
    return np.hypot(*team.velocity())
