"""Encounter: two boats on collision courses, who pass by the rules of the road."""

from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.adapters.gym.problem import Entry, Mask, open_water
from vrx_mj.adapters.gym.seen import Floats, folded
from vrx_mj.adapters.zoo import colregs
from vrx_mj.adapters.zoo.team import CLEAR, Spot, Team, TeamJudged, TeamProblem, mean_of

__all__ = ["Encounter"]

AHEAD = 18.0
"""So long after the start they would collide if both kept on [s]."""
BEYOND = 20.0
"""Of a goal from the point where they would collide [m]."""
SPEED, SLOW, FAST = 1.5, 0.8, 2.0
"""Meeting or crossing, overtaken, and overtaking [m/s]."""
WANTED = 15.0
"""A closest approach beyond this costs nothing [m]."""
AGREED = 15.0
"""Within this distance, with risk of collision, who stands on may act: rule 17 (a) (ii), (b) [m]."""
ARRIVED = 5.0
"""A boat is at its goal within this distance [m]."""
OPENED = 1.0
"""They have passed when they are farther apart than they were at the least by this [m]: waves shake them by less."""


class Encounter(TeamProblem):
    """Two boats meet head-on (within 5 degrees), cross (at 50 to 130) or overtake (within 10); one in three each.

    They start under way, 1.5 m/s each or 2 and 0.8, so that both would be at one point after 18 s; each has its goal
    20 m behind that point, straight ahead. `adapters/zoo/colregs.py` tells roles and scores.

    Reward of a boat: 0.1 for every m by which its goal has come nearer, and 5 within 5 m of it, which takes it out.
    -0.1 times its fault in each step while they approach each other. The fault of who has to keep clear: 1 - d/15 with
    d [m] the closest approach at present velocities, so that early action pays (rules 8 and 16), and head-on also any
    turn to port over 30 degrees, at most 1 (14). Of who has to hold on: its departure from course and speed (17),
    which is free within 15 m, where only the turn to port of who stands on in a crossing counts (17 c). Once they have
    passed, 5 times the range's score, of 6 to 15 m, times the pose's. -10 for being nearer than 6 m, which ends the
    episode. The team's reward is the mean of both. `info`: `role`, `closest` [m] so far, and `score`.
    """

    world = open_water()
    duration = 60.0
    entries = (
        Entry("goal ahead [m]", 20.0), Entry("goal to port [m]", 20.0),
        Entry("sine of the turn since the start", 1.0), Entry("cosine of the turn since the start", 1.0),
        Entry("change of speed since the start [m/s]", 3.0), Entry("whether the boats meet head-on", 1.0),
        Entry("whether this boat has to keep clear", 1.0), Entry("whether the boats have passed", 1.0),
    )  # fmt: skip
    boats = 2
    fixed = True

    def __init__(self, n: int, boats: int) -> None:
        super().__init__(n, boats)
        self._goals, self._far = np.zeros((n, 2, 2)), np.zeros((n, 2))
        self._course, self._speed = np.zeros((n, 2)), np.zeros((n, 2))
        self._role = np.zeros((n, 2), np.int64)
        self._closest, self._passed = np.zeros(n), np.zeros(n, np.bool_)
        self._bearing, self._score = np.zeros((n, 2)), np.zeros((n, 2))
        self._held, self._steps = np.zeros((n, 2)), np.zeros(n, np.int64)

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """A situation, who is who in it, and the way it lies in the world."""
        kind, course, side = int(random.integers(3)), random.uniform(-np.pi, np.pi), random.choice((-1.0, 1.0))
        apart = (np.radians(180.0 + random.uniform(-5.0, 5.0)), side * np.radians(random.uniform(50.0, 130.0)),
                 np.radians(random.uniform(-10.0, 10.0)))[kind]  # fmt: skip
        ways = [(course, FAST if kind == 2 else SPEED), (course + apart, SLOW if kind == 2 else SPEED)]
        if random.random() < 0.5:
            ways.reverse()
        self._goals[row] = [(BEYOND * np.cos(way), BEYOND * np.sin(way)) for way, _ in ways]
        return [(-AHEAD * speed * np.cos(way), -AHEAD * speed * np.sin(way), way, speed) for way, speed in ways]

    def entrance(self, row: int, boat: int, random: np.random.Generator) -> Spot:
        """Nobody joins two boats that meet."""
        raise NotImplementedError

    def begin(self, who: Mask, team: Team) -> None:
        """Who is who."""
        rows = who.any(axis=1)
        bearing = colregs.bearings(team.x, team.y, team.yaw)
        for kept, now in (
            (self._far, self._distances(team)), (self._course, team.yaw), (self._speed, _speeds(team)),
            (self._role, colregs.roles(bearing, team.yaw)), (self._closest, _gap(team)), (self._bearing, bearing),
        ):  # fmt: skip
            kept[rows] = now[rows]
        for count in (self._passed, self._score, self._held, self._steps):
            count[rows] = 0

    def observe(self, team: Team) -> Floats:
        """The goal from the boat, what it must do, and what it did."""
        turn = folded(team.yaw - self._course)
        head_on = self._role == colregs.HEAD_ON
        passed = np.repeat(self._passed[:, None], 2, axis=1)
        return np.stack(
            (*team.toward(*np.moveaxis(self._goals, -1, 0)), np.sin(turn), np.cos(turn), _speeds(team) - self._speed,
             head_on, colregs.keeps_clear(self._role), passed), axis=-1
        )  # fmt: skip

    def judge(self, team: Team, going: Mask) -> TeamJudged:
        """Gain by the goal, lose by faults, and be scored when they have passed."""
        far, gap = self._distances(team), _gap(team)
        meet = team.present.all(axis=1) & going
        fault = self._faults(team, gap, meet)
        touched = meet & (gap < CLEAR)
        arrived = (far < ARRIVED) & ~touched[:, None]
        own = 0.1 * (self._far - far) - 0.1 * fault + 5.0 * arrived - 10.0 * touched[:, None]
        own = np.where(team.present, own + 5.0 * self._scored(team, gap, meet), 0.0)
        self._far = np.where(team.present, far, self._far)
        return TeamJudged(mean_of(own, team.present), own, (touched[:, None] | arrived) & team.present)

    def facts(self) -> dict[str, npt.NDArray[Any]]:
        """Who is who, how near they came, and what that was worth."""
        return {"role": self._role.copy(), "closest": self._closest.copy(), "score": self._score.copy()}

    def _faults(self, team: Team, gap: Floats, meet: Mask) -> Floats:
        """(n, 2), 0 to 1; none once they draw apart. What the stand-on vessel departs is added up for its score."""
        time, distance = colregs.approach(team.x, team.y, team.east, team.north)
        port = np.clip(folded(team.yaw - self._course) / colregs.READILY, 0.0, 1.0)
        risk = np.clip(1.0 - distance / WANTED, 0.0, 1.0)[:, None]
        clear = np.minimum(risk + np.where(self._role == colregs.HEAD_ON, port, 0.0), 1.0)
        off = colregs.departure(folded(team.yaw - self._course), _speeds(team), self._speed)
        late = np.where(self._role == colregs.STAND_ON, port, 0.0)
        holds = np.where((gap < AGREED)[:, None], late, off)
        near = ((time > 0.0) & ~self._passed & meet)[:, None]
        self._steps += near[:, 0]
        self._held += np.where(near, holds, 0.0)
        return np.where(near, np.where(colregs.keeps_clear(self._role), clear, holds), 0.0)

    def _scored(self, team: Team, gap: Floats, meet: Mask) -> Floats:
        """The scores (n, 2) of those who pass in this step, 0 for the others."""
        nearer = meet & (gap < self._closest)
        self._closest = np.where(nearer, gap, self._closest)
        now = colregs.bearings(team.x, team.y, team.yaw)
        self._bearing = np.where(nearer[:, None], now, self._bearing)
        passes = meet & ~self._passed & (gap > self._closest + OPENED)
        kept = 1.0 - self._held / np.maximum(self._steps, 1)[:, None]
        safe = colregs.range_score(self._closest, CLEAR, WANTED)[:, None]
        score = np.where(passes[:, None], safe * colregs.pose_score(self._role, self._bearing, kept), 0.0)
        self._passed |= passes
        self._score += score
        return score

    def _distances(self, team: Team) -> Floats:
        """(n, 2): to the goals [m]."""
        x, y = np.moveaxis(self._goals, -1, 0)
        far: Floats = np.hypot(x - team.x, y - team.y)
        return far


def _gap(team: Team) -> Floats:
    """(n,): between both boats [m]."""
    gap: Floats = np.hypot(team.x[:, 1] - team.x[:, 0], team.y[:, 1] - team.y[:, 0])
    return gap


def _speeds(team: Team) -> Floats:
    """(n, 2): over ground [m/s]."""
    speed: Floats = np.hypot(team.east, team.north)
    return speed
