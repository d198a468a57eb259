"""Docking: into a bay of a dock, and stay there."""

import math

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray
from vrx_mj.config.docks import MOUTH_GAP, Bay, find_bays
from vrx_mj.model.things import Dock
from vrx_mj.rl.options import PERIOD
from vrx_mj.rl.problem import Entry, Facts, Judged, Problem, Rows, Spot, Team, open_water, point, turn_to, wrap_angle

_START_DISTANCES = (8.0, 18.0)
"""Least and largest distance of the start from the bay's mouth [m]."""
_MAX_START_OFFSET = 6.0
"""Greatest distance of the start from the bay's axis [m]."""
_MAX_START_ANGLE = np.radians(60.0)
"""Greatest angle between the bow and the bay's axis at the start [rad]."""
_HOLD_TIME = 3.0
"""Time inside after which a boat has docked [s]."""
_APPROACH_RADIUS = 5.0
"""Distance from the middle of the bay's zone within which the speed of the approach counts [m]."""
_FULL_SPEED, _ZERO_SPEED = 1.0, 2.0
"""Speed up to which docking earns everything, and from which it earns nothing [m/s]."""
_DOCKING_REWARD = 10.0
"""Greatest reward for having docked."""


class Docking(Problem):
    """One of the three bays of VRX's dock of 2022, 4 m wide; a WAM-V is 2.4 m wide. Which one is drawn.

    The boat starts 8 to 18 m off the mouth, up to 6 m beside the bay's axis and turned by up to 60 degrees. It has
    docked when its origin was inside the zone that VRX watches, bow in, for 3 s.

    Reward: 0.1 for every m by which c has become less, with c the distance [m] to the middle of the bay's zone plus
    twice that from the bay's axis; 0.1 in every step inside, all of which is lost again by leaving; and for having
    docked, which ends the episode, 10 (2 - v), within 0 and 10, with v the greatest speed [m/s] within 5 m of the
    middle since the boat was last farther away: a boat that comes in at 1 m/s gets all of it, one that rams the dock
    at 2 m/s nothing. `info`: `inside`, `docked` and `approach_speed` [m/s]; at the start `bay`, x, y [m] of its middle
    and the heading into it [rad].
    """

    world = open_water(
        docks=[{"name": "dock", "layout": "dock_2022", "pose": [30, 0, 0, 0, 0, 0]}],
        spawn={"pose": [0, 0, 0.1, 0, 0, 0]},
    )
    duration = 90.0
    entries = (
        *point("middle of the bay", 10.0),
        *turn_to("the bay's axis"),
        Entry("distance of the bay's mouth along its axis [m]", 10.0),
        Entry("distance of the bay's axis to port of the boat [m]", 3.0),
    )  # fmt: skip

    def __init__(self, rows: Rows) -> None:
        super().__init__(rows)
        docks = rows.world.parameters.docks
        self._bays = [_place_of(bay, dock) for dock in docks for bay in find_bays(dock.cells)]
        self._goal = np.zeros((self.n, 6))
        self._cost, self._fastest = np.zeros((self.n, 1)), np.zeros((self.n, 1))
        self._inside, self._held = np.zeros((self.n, 1), np.bool_), np.zeros((self.n, 1), np.int64)

    def start(self, row: int, random: np.random.Generator) -> list[Spot]:
        """A bay, and a place before it."""
        self._goal[row] = x, y, inward, _, _, mouth = self._bays[int(random.integers(len(self._bays)))]
        away, beside = mouth + random.uniform(*_START_DISTANCES), random.uniform(-_MAX_START_OFFSET, _MAX_START_OFFSET)
        start = x - away * np.cos(inward) - beside * np.sin(inward), y - away * np.sin(inward) + beside * np.cos(inward)
        return [(*start, inward + random.uniform(-_MAX_START_ANGLE, _MAX_START_ANGLE), 0.0)]

    def begin(self, who: BoolArray, team: Team) -> None:
        """Start without a boat that has held its place."""
        self._held[who], self._inside[who], self._fastest[who] = 0, False, 0.0
        self._cost[who] = _cost(*self._from_middle(team))[who]

    def observe(self, team: Team) -> FloatArray:
        """The bay from the boat."""
        x, y, inward, _, _, mouth = self._goal.T[:, :, None]
        turn = wrap_angle(inward - team.yaw)
        along, aside = self._from_middle(team)
        return np.stack((*team.toward(x, y), np.sin(turn), np.cos(turn), -along - mouth, -aside), axis=-1)

    def judge(self, team: Team, going: BoolArray) -> Judged:
        """Gain by coming nearer and by staying inside, differences of a potential, which cycles cannot farm."""
        along, aside = self._from_middle(team)
        _, _, inward, half_depth, half_width, _ = self._goal.T[:, :, None]
        straight, going = np.cos(inward - team.yaw) > 0.0, going[:, None]
        self._inside = (np.abs(along) <= half_depth) & (np.abs(aside) <= half_width) & straight
        speed, near = np.hypot(team.own[..., 0], team.own[..., 1]), np.hypot(along, aside) <= _APPROACH_RADIUS
        self._fastest = np.where(near, np.maximum(self._fastest, np.where(going, speed, 0.0)), 0.0)
        held, cost = np.where(self._inside, self._held + going, 0), _cost(along, aside)
        docked = held >= round(_HOLD_TIME / PERIOD)
        worth = _DOCKING_REWARD * np.clip((_ZERO_SPEED - self._fastest) / (_ZERO_SPEED - _FULL_SPEED), 0.0, 1.0)
        reward = 0.1 * (self._cost - cost) + 0.1 * (held - self._held) + worth * docked
        self._cost, self._held = cost, held
        return Judged(reward, docked)

    def facts(self) -> Facts:
        """Whether the boat is inside and has docked, and how fast it came."""
        docked = self._held >= round(_HOLD_TIME / PERIOD)
        return {"inside": self._inside, "docked": docked, "approach_speed": self._fastest}

    def episode_facts(self) -> Facts:
        """The bays, (n, 3): x, y [m] of the middle of the zone and the heading into it [rad]."""
        return {"bay": self._goal[:, :3]}

    def _from_middle(self, team: Team) -> tuple[FloatArray, FloatArray]:
        """How far the boats are from the middles of their bays' zones, along the bay and to port of its axis [m]."""
        return team.beyond(*self._goal.T[:3, :, None])


def _cost(along: FloatArray, aside: FloatArray) -> FloatArray:
    return np.hypot(along, aside) + 2.0 * np.abs(aside)


def _place_of(bay: Bay, dock: Dock) -> tuple[float, ...]:
    """A bay in the world.

    x, y of its zone's middle [m], the heading inward [rad], half the zone's depth and width [m], and how far before
    that middle the mouth is [m].
    """
    inside, outside = bay.zones(dock.block)
    dx, dy, _, _, _, turn = dock.pose
    x, y = inside.center[:2]
    cos, sin = math.cos(turn), math.sin(turn)
    depth, width = inside.size[:2] if bay.opens[0] else inside.size[1::-1]
    mouth = math.dist(outside.center, inside.center) - MOUTH_GAP
    inward = math.atan2(-bay.opens[1], -bay.opens[0]) + turn
    return dx + cos * x - sin * y, dy + sin * x + cos * y, inward, depth / 2, width / 2, mouth
