"""What all controllers have in common: one boat, its navigation, its pilot, and its task."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from vrx_mj.control.guidance import clear_course, wrap_angle
from vrx_mj.control.navigation import Estimate, Navigator, Point, polar
from vrx_mj.control.pilot import Pilot
from vrx_mj.control.velocity import craft_of

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation, Observation
    from vrx_mj.runtime.task_runner import TaskObservation

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
    """What a controller decides by."""

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
