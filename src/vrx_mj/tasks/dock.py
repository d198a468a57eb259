"""Docking, also with a light buoy to read and balls to deliver (VRX scan_dock_scoring_plugin.cc).

The points for docking come on backing out, through the zone before the bay, and end the task. Times are
simulated in both profiles; VRX classic times the stay by the wall clock, which differs where it is not in real time.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from vrx_mj.config.docks import LIGHT_COLORS
from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError, StateError, quote
from vrx_mj.frames import Vector
from vrx_mj.model import tasks
from vrx_mj.tasks.referee import Frame, LightUp, Outputs, Phase, Place, Pose, Referee, ShowSymbol

_TOPIC = "color_sequence"
"""Name of the message that reports the colours."""
MAX_BALL_SPEED = 30.0
"""Speed of a ball [m/s] beyond which it did not fly but was put somewhere: it is shot anew. VRX's leaves at 7.5 m/s."""
_HIT_KEYS: Mapping[str, Any] = {"time": int | float, "ball": str, "bay": str, "size": str, "points": int | float}
"""Keys of a hit, as teams see it."""


def is_in(box: tasks.Box, point: Sequence[float]) -> bool:
    """Whether a point [m] is in an upright box of the dock's frame, whose faces belong to it."""
    return all(2.0 * abs(p - center) <= size for p, center, size in zip(point, box.center, box.size, strict=True))


def crosses(box: tasks.Box, start: Sequence[float], end: Sequence[float]) -> bool:
    """Whether the straight way from one point to another has a point in a box: it lies between all pairs of faces."""
    enters, leaves = 0.0, 1.0
    for a, b, center, size in zip(start, end, box.center, box.size, strict=True):
        low, high = center - 0.5 * size, center + 0.5 * size
        if a == b:
            if not low <= a <= high:
                return False
            continue
        first, last = sorted(((low - a) / (b - a), (high - a) / (b - a)))
        enters, leaves = max(enters, first), min(leaves, last)
    return enters <= leaves


def has_entered(box: tasks.Box, before: Sequence[float], now: Sequence[float], reach: float) -> bool:
    """Whether something has come into a box between two frames; more than `reach` [m] apart, it did not fly there."""
    if is_in(box, before):
        return False
    return crosses(box, before, now) if math.dist(before, now) <= reach else is_in(box, now)


def relative(anchor: Pose, pose: Pose) -> Vector:
    """Where `pose` is in the frame of `anchor` [m]: R^T (p - o), with R the rotation of the unit quaternion (w, q).

    Reference: R^T v = v + w t + t x q with t = 2 v x q.
    """
    w, a, b, c = anchor.quaternion
    x, y, z = pose.x - anchor.x, pose.y - anchor.y, pose.z - anchor.z
    u, v, s = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return x + w * u + v * c - s * b, y + w * v + s * a - u * c, z + w * s + u * b - v * a


@dataclass
class DockingState:
    """Where the boat and its balls are in the dock, and what was earned."""

    inside: dict[str, float] = field(default_factory=dict)
    """Bays whose internal zone the boat is in, with the time [s] at which it came."""
    docked: list[str] = field(default_factory=list)
    """Bays in which it has stayed for long enough, at any time."""
    bay: str = ""
    """The bay it is in; empty if in none."""
    time_in_bay: float = 0.0
    """Time since it came there [s]."""
    left: str = ""
    """The bay that it has backed out of, for the points."""
    colors_open: bool = False
    """Whether the colours may be sent."""
    colors: list[str] = field(default_factory=list)
    """Colours sent."""
    balls: dict[str, Place] = field(default_factory=dict)
    """Where the balls were at the frame before, in the dock's frame [m]."""
    seen: float = 0.0
    """Time of that frame [s]."""
    hits: list[dict[str, float | str]] = field(default_factory=list)
    """Holes hit: time [s], ball, bay, size and points."""


class Docking(Referee):
    """The score is in points; none are lost when time is up.

    VRX's quirks are kept: a boat docks once, and gets points also in a wrong bay; a ball counts in any placard's hole,
    each time it comes in; of several holes hit at once the last counts; the colours can be sent once; zones of profile
    `vrx` are watched from the start, so that a boat that backs out before the task runs has ended it without points,
    those of `vrx3` while it runs.
    """

    title = "docking"
    watches_early = True
    state: DockingState

    def __init__(self, task: tasks.Dock) -> None:
        super().__init__(task, DockingState())
        self._anchor, self._balls = task.anchor, task.balls
        self._bays = task.bays
        self._holes = [(hole, tasks.Box(center=hole.center, size=hole.box)) for hole in task.holes if hole.points]
        self._buoy, self._colors = task.light_buoy, [color.lower() for color in task.color_sequence]
        self._asks_colors, self._color_points = task.enable_color_checker, task.color_bonus_points
        self.message = _TOPIC if self._asks_colors else None
        self._dock_points, self._right_points = task.dock_bonus_points, task.correct_dock_bonus_points
        self._stay = task.min_dock_time
        self._early_zones = self._announces = task.profile != "vrx3"
        self._symbol = next((bay.symbol for bay in reversed(self._bays) if bay.dock_allowed), None)

    @property
    def parts(self) -> dict[str, object]:
        """The bay the boat is in and for how long, those it docked in, the one it backed out of, colours and hits."""
        own = self.state
        return {
            "bay": own.bay,
            "time_in_bay": own.time_in_bay,
            "docked": own.docked,
            "left": own.left,
            "colors": own.colors,
            "hits": own.hits,
        }

    def enter(self, phase: Phase, frame: Frame) -> None:
        """Tell the placards their symbols, twice as VRX does; light the buoy and open the ears as it begins to run."""
        self.state.colors_open = phase == "running" and self._asks_colors
        if phase == "finished":
            return
        for bay in self._bays:
            if bay.placard is not None:
                self.act(ShowSymbol(bay.placard, bay.symbol))
        if phase == "running" and self._buoy is not None:
            first, second, third = self._colors
            self.act(LightUp(self._buoy, (first, second, third)))

    def update(self, frame: Frame) -> None:
        """Listen, then look for balls in holes, then for the boat: all that falls into the last frame counts."""
        dock = frame.poses[self._anchor]
        for message in frame.messages:
            if message.topic == _TOPIC:
                self._judge_colors(message.content)
        if self._holes:
            self._follow_balls(frame, dock)
        if self._early_zones or self.status.phase == "running":
            self._follow_boat(frame, dock)

    def check_state(self, state: DockingState) -> None:
        """Every hit has all keys that teams see.

        Raises:
            StateError: one has not.
        """
        for hit in state.hits:
            if hit.keys() != _HIT_KEYS.keys() or not all(isinstance(hit[key], kind) for key, kind in _HIT_KEYS.items()):
                raise StateError(f"the state does not fit the task: a hit needs {', '.join(_HIT_KEYS)}")

    @property
    def outputs(self) -> Outputs:
        """Whether the colours may be sent and, from `ready` on, the symbol of the right bay (the last, if several).

        Classic VRX publishes the symbol in all these tasks, VRX 3 in none.
        """
        seen: Outputs = {"color_sequence_open": self.state.colors_open}
        if self.status.phase != "initial" and self._symbol is not None and self._announces:
            seen["symbol"] = self._symbol
        return seen

    def checked_content(self, content: object) -> object:
        """The colours of the light buoy, in small letters; whether they count is seen at the next frame.

        Raises:
            CommandError: they are no three colours.
        """
        return _colors(content)

    # Inside

    def _judge_colors(self, colors: Sequence[str]) -> None:
        own = self.state
        if not own.colors_open:
            self.log("colours ignored: they are accepted once, while the task runs", "WARN")
            return
        own.colors_open, own.colors = False, list(colors)
        right = own.colors == self._colors
        if right:
            self.set_score(self.status.score + self._color_points)
        self.log(f"colours {', '.join(colors)}: {f'right, {self._color_points:g} points' if right else 'wrong'}")

    def _follow_balls(self, frame: Frame, dock: Pose) -> None:
        """Look along the straight way of each ball since the frame before, as the dock sees it.

        A ball flies 0.4 m between frames, further than a small hole is long; gravity bends its way there by 3 mm. What
        is further off than it can have flown was shot anew: it counts where it is now, but not on a way it never took.
        """
        own = self.state
        reach = MAX_BALL_SPEED * (frame.time - own.seen)
        for_points: list[tuple[str, tasks.Hole]] = []
        for ball in self._balls:
            now = list(relative(dock, frame.poses[ball]))
            before = own.balls.get(ball, now)
            own.balls[ball] = now
            if before != now:
                for_points += [(ball, hole) for hole, box in self._holes if has_entered(box, before, now, reach)]
        own.seen = frame.time
        if for_points and self.status.phase == "running":
            ball, hole = for_points[-1]
            self._reward(ball, hole, frame.time)

    def _reward(self, ball: str, hole: tasks.Hole, time: float) -> None:
        self.set_score(self.status.score + hole.points)
        self.state.hits.append({"time": time, "ball": ball, "bay": hole.bay, "size": hole.size, "points": hole.points})
        self.log(f"ball through the {hole.size} hole of {hole.bay}: {hole.points:g} points")

    def _follow_boat(self, frame: Frame, dock: Pose) -> None:
        own, place = self.state, relative(dock, frame.poses[self.boat])
        for bay in self._bays:
            self._time_stay(bay, is_in(bay.internal, place), frame.time)
        own.bay, came = next(iter(own.inside.items()), ("", frame.time))
        own.time_in_bay = frame.time - came
        for bay in self._bays:
            if bay.name in own.docked and is_in(bay.external, place):
                self._back_out(bay)
                return

    def _time_stay(self, bay: tasks.Bay, inside: bool, time: float) -> None:
        """Time the stay in a bay; a boat that leaves too early begins anew."""
        own, docked = self.state, bay.name in self.state.docked
        if inside and bay.name not in own.inside:
            own.inside[bay.name] = time
            self.log(f"{self.boat} enters {bay.name}")
        elif not inside and bay.name in own.inside:
            stay = time - own.inside.pop(bay.name)
            early = "" if docked else f", too early: {self._stay:g} s are needed"
            self.log(f"{self.boat} leaves {bay.name} after {stay:.2f} s{early}", "INFO" if docked else "WARN")
        if inside and not docked and time - own.inside[bay.name] >= self._stay - EARLY:
            own.docked.append(bay.name)
            self.log(f"{self.boat} has docked in {bay.name}; points are given when it backs out")

    def _back_out(self, bay: tasks.Bay) -> None:
        """Give the points, if the task runs, and end it."""
        points = self._dock_points + (self._right_points if bay.dock_allowed else 0.0)
        worth = f"{points:g} points" if self.status.phase == "running" else "no points before the task runs"
        self.state.left = bay.name
        self.set_score(self.status.score + points)
        self.log(f"{self.boat} backs out of {bay.name}, the {'right' if bay.dock_allowed else 'wrong'} bay: {worth}")
        self.finish()


def _colors(content: object) -> list[str]:
    words = content if isinstance(content, list | tuple) else ()
    colors = [word.lower() for word in words if isinstance(word, str)]
    if len(words) != 3 or len(colors) != 3 or not set(colors) <= set(LIGHT_COLORS):
        raise CommandError(f"invalid {_TOPIC} {quote(content)}: a list of three of {', '.join(LIGHT_COLORS)} is needed")
    return colors
