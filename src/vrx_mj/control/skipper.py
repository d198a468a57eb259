"""What all controllers have in common: one boat, its navigation, its pilot, and its task."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vrx_mj.control.navigation import Estimate, Navigator
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
        seen = self.navigator(boat, t)
        self.listen(boat, seen, task, t)
        commands = {} if task.get("state") == "initial" else self.steer(boat, seen, task, t)
        sent: dict[str, Any] = {name: commands}
        if self.messages:
            sent["task"], self.messages = self.messages, {}
        return sent

    def begin(self) -> None:
        """Forget what a subclass knows."""

    def listen(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, object], t: float) -> None:
        """Take in what the boat senses, in every phase; most need nothing but the estimate."""

    def steer(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, object], t: float) -> Commands:
        """The boat's commands, from the task's phase `ready` on."""
        raise NotImplementedError
