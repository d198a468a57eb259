"""The pilot: motion control, from where the boat should go to what its thrusters do; and the base of all controllers.

One law does all, in the manner of dynamic positioning (Fossen, Handbook of Marine Craft Hydrodynamics and Motion
Control, 2nd ed., 12.2): a wanted velocity over ground is held by a proportional law with the drag fed forward, and an
observer estimates what else pushes (wind, waves, what the model does not know). A position is held by wanting a
velocity toward it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from vrx_mj.control.guidance import Course, approach_speed, clear_course, wrap_angle
from vrx_mj.control.navigation import Estimate, Navigator, Point, from_axes, in_axes, polar
from vrx_mj.control.velocity import Allocation, Craft, Thrust, clamp, craft_of, wamv_of

if TYPE_CHECKING:
    from vrx_mj.runtime.hull import Propeller
    from vrx_mj.runtime.observation import BoatObservation, Observation
    from vrx_mj.runtime.task_runner import TaskObservation


_VELOCITY_RATE = 1.8
"""Rate at which errors of velocity decay [1/s]: crossover of the speed loop, a fifth of what calls at 10 Hz would
allow."""
POSITION_RATE = 0.7
"""Rate at which errors of position decay [1/s]: 0.4 of the above, for a damping ratio of 0.8."""
_TURN_RATE = 3.0
"""Rate at which errors of yaw rate decay [1/s]."""
_HEADING_RATE = 1.2
"""Rate at which errors of heading decay [1/s]."""
_MAX_YAW_RATE = 0.8
"""Largest commanded yaw rate [rad/s]."""
_OBSERVER_RATE = 1.0
"""Bandwidth of the disturbance observer [rad/s]: it follows gusts of 2 s, and noise of 2 cm/s makes 10 N."""
_BRAKING_SHARE = 0.25
"""Share of the deceleration at full thrust that an approach relies on, which leaves a margin for wind."""
_MAX_BRAKING = 1.0
"""Largest deceleration that an approach relies on [m/s2]."""


class Pilot:
    """Steers one boat: what it wants, in forces, and their allocation."""

    def __init__(self, thrusters: "Mapping[str, Propeller]", craft: Craft | None = None) -> None:
        """`craft` has the boat's figures; by default they are the WAM-V's."""
        self.craft = craft or wamv_of(thrusters)
        self._allocation = Allocation(thrusters, centre=self.craft.centre)
        ahead, astern = (
            sum(_push(thruster, way * thruster.direction[0]) for thruster in thrusters.values()) for way in (1.0, -1.0)
        )
        self.top_speed = self.craft.top_speed(ahead)
        """Full ahead in calm water [m/s]."""
        self.braking = min(_MAX_BRAKING, _BRAKING_SHARE * (astern + ahead) / self.craft.mass)
        """Deceleration to rely on [m/s2]."""
        self.every_way = self._allocation.every_way
        """Whether the boat can push sideways, too."""
        self._course = None if self.every_way else Course(thrusters, self.craft, self._allocation)
        self._observed = (0.0, 0.0, 0.0)
        self._expected: tuple[float, float, float] | None = None
        self._then = 0.0

    def hold(
        self, seen: Estimate, t: float, x: float, y: float, heading: float, *, speed: float = math.inf
    ) -> dict[str, float]:
        """Commands to be at a place [m] with a heading [rad], and stay; on the way there at most at a `speed` [m/s]."""
        if self._course is not None:
            return self._course.hold(seen, x, y, heading, speed=min(speed, self.top_speed), braking=self.braking)
        distance, bearing = seen.to(x, y)
        wanted = min(approach_speed(distance, POSITION_RATE, self.braking), speed, self.top_speed)
        return self.sail(seen, t, *polar(wanted, bearing), heading)

    def sail(
        self,
        seen: Estimate,
        t: float,
        vx: float,
        vy: float,
        heading: float,
        *,
        turn: float = 0.0,
        acceleration: tuple[float, float] = (0.0, 0.0),
    ) -> dict[str, float]:
        """Commands for a velocity over ground [m/s, east and north] with a heading [rad].

        `turn` [rad/s] is how fast that heading turns, `acceleration` [m/s2] how fast the velocity changes.
        """
        if self._course is not None:
            return self._course.sail(seen, vx, vy, heading)
        self._observe(seen, t)
        ax = acceleration[0] + _VELOCITY_RATE * (vx - seen.vx)
        ay = acceleration[1] + _VELOCITY_RATE * (vy - seen.vy)
        fx, fy = self.craft.mass * ax - self._observed[0], self.craft.mass * ay - self._observed[1]
        drag = self.craft.drag(*in_axes(seen.heading, vx, vy))
        surge, sway = in_axes(seen.heading, fx, fy)
        thrust = self._allocation(surge + drag[0], sway + drag[1], self._moment(seen, heading, turn))
        self._expect(seen, t, thrust)
        return thrust.commands

    def _moment(self, seen: Estimate, heading: float, turn: float) -> float:
        """About the centre of mass [N m]."""
        wanted = clamp(turn + _HEADING_RATE * wrap_angle(heading - seen.heading), _MAX_YAW_RATE)
        push = self.craft.inertia * _TURN_RATE * (wanted - seen.turn)
        return push + self.craft.turning_drag(wanted) - self._observed[2]

    def _expect(self, seen: Estimate, t: float, thrust: Thrust) -> None:
        """Accelerations that the thrust should cause by the model [m/s2, rad/s2]."""
        drag = self.craft.drag(seen.surge, seen.sway)
        surge, sway = (thrust.surge - drag[0]) / self.craft.mass, (thrust.sway - drag[1]) / self.craft.mass
        moment = thrust.yaw - self.craft.turning_drag(seen.turn)
        self._expected = (*from_axes(seen.heading, surge, sway), moment / self.craft.inertia)
        self._before = (seen.vx, seen.vy, seen.turn)
        self._then = t

    def _observe(self, seen: Estimate, t: float) -> None:
        """Take what the boat does otherwise than expected for a push [N, N m], filtered."""
        interval = t - self._then
        if self._expected is None or not 0.0 < interval < 1.0:
            return
        now, weights = (seen.vx, seen.vy, seen.turn), (self.craft.mass, self.craft.mass, self.craft.inertia)
        share = 1.0 - math.exp(-_OBSERVER_RATE * interval)
        rows = zip(now, self._before, self._expected, weights, self._observed, strict=True)
        x, y, z = (
            push + share * (weight * ((v - before) / interval - expected) - push)
            for v, before, expected, weight, push in rows
        )
        self._observed = (x, y, z)


def _push(thruster: "Propeller", cos: float) -> float:
    """The largest force [N] of a thruster along a line, by the cosine of the angle between them."""
    return max(0.0, cos * (thruster.max_forward if cos > 0.0 else thruster.max_reverse))


Commands = dict[str, Any]
"""Commands by boat, each by thruster, and messages under `task`."""


def task_of(obs: Mapping[str, Any]) -> "TaskObservation":
    """Observation of the world's task; empty without a task."""
    try:
        task: TaskObservation = obs["task"]
    except KeyError:
        return {}
    return task


class Moment(NamedTuple):
    """Data by which a controller decides, at one moment."""

    boat: "BoatObservation"
    """Observation of its boat."""
    seen: Estimate
    """Where the boat is and how it moves, by its own sensors."""
    task: "TaskObservation"
    """Observation of the task; empty without one."""
    t: float
    """Simulated time [s]."""


class Skipper:
    """A controller of the boat that has the task, or else of the first; subclasses define in `steer` what it does.

    Until the task lets go of the boat, nothing is commanded; when the task has finished the thrusters stop. The boat is
    known by its thrusters and sensors; no place of it or of anything else is taken from the simulation, except as
    `Navigator` documents.
    """

    def __init__(self) -> None:
        self.reset(0)

    def reset(self, seed: int) -> None:
        """Forget all, before a new run; nothing here is random, so the seed does nothing."""
        self.navigator = Navigator()
        self._course: float | None = None
        self._pilot: Pilot | None = None
        self.messages: dict[str, Any] = {}
        """Messages to the task, sent with the next commands."""
        self.begin()

    @property
    def pilot(self) -> Pilot:
        """Pilot of the boat."""
        assert self._pilot is not None, "no boat was seen yet"
        return self._pilot

    def __call__(self, obs: "Observation", t: float) -> Commands:
        """Commands for the task's boat, or else the first, and messages to the task."""
        task = task_of(obs)
        name = str(task.get("boat") or next(iter(obs)))
        boat = obs[name]
        if task.get("state") == "finished":
            return {name: dict.fromkeys(boat.thrusters, 0.0)}
        if self._pilot is None:
            self._pilot = Pilot(boat.thrusters, craft_of(boat))
        now = Moment(boat, self.navigator(boat, t), task, t)
        self.listen(now)
        commands = {} if task.get("state") == "initial" else self.steer(now)
        sent: dict[str, Any] = {name: commands}
        if self.messages:
            sent["task"], self.messages = self.messages, {}
        return sent

    def begin(self) -> None:
        """Forget what a subclass knows."""

    def listen(self, now: Moment) -> None:
        """Take in what the boat senses, in every phase; most need nothing but the estimate."""

    def steer(self, now: Moment) -> Commands:
        """The boat's commands, from the task's phase `ready` on."""
        raise NotImplementedError

    def sail(self, now: Moment, speed: float, course: float, heading: float | None = None) -> Commands:
        """Commands for a speed [m/s] over ground on a course [rad], the bow in a heading [rad] or on the course."""
        return self.pilot.sail(now.seen, now.t, *polar(speed, course), course if heading is None else heading)

    def sail_clear(
        self,
        now: Moment,
        bearing: float,
        discs: Sequence[tuple[Point, float]],
        *,
        reach: float,
        speed: float,
        least: float,
    ) -> Commands:
        """Commands for the nearest course to a bearing [rad] that is clear of discs, given by centre and radius [m].

        Discs further off than `reach` [m] are left for later. The speed [m/s] falls with the turn that is left to make,
        to a share `least` of it.
        """
        self._course = clear_course(now.seen.place, bearing, discs, reach=reach, before=self._course)
        share = max(least, math.cos(wrap_angle(self._course - now.seen.heading)) ** 3)
        return self.sail(now, speed * share, self._course)

    def stop(self, now: Moment, heading: float | None = None) -> Commands:
        """Commands to lie still with a heading [rad], by default the present one."""
        return self.sail(now, 0.0, 0.0, now.seen.heading if heading is None else heading)
