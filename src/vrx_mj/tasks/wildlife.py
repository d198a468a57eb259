"""Wildlife: circle the animals that want it, and keep away from the others (VRX wildlife_scoring_plugin.cc).

Around every animal are eight gates, at every 45 degrees of the world's azimuth, from the animal out to the radius of
engagement. The boat circles by crossing eight times in the right sense without a break.
"""

import math
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from vrx_mj.constants import EARLY
from vrx_mj.errors import StateError
from vrx_mj.model import tasks
from vrx_mj.tasks.courses import Side
from vrx_mj.tasks.referee import Count, Frame, Outputs, Pose, Referee

GATES = 8
"""Number of gates around an animal."""
AXES = tuple((math.cos(math.tau * gate / GATES), math.sin(math.tau * gate / GATES)) for gate in range(GATES))
"""Directions of the gates, from the animal outwards."""
_KIND_BY_GOAL = {
    "avoid": "crocodile",
    "circumnavigate_clockwise": "platypus",
    "circumnavigate_counterclockwise": "turtle",
}
"""Kind of animal that teams see: VRX goes by the goal, not by the model."""
_NUMBERS = ("x", "y", "z", "yaw")
"""Keys of an animal's place in the world frame [m, rad]."""
_ANIMAL_KEYS = frozenset({"name", *_NUMBERS, "latitude", "longitude"})
"""Keys of an animal, as teams see it."""


def gate_side(dx: float, dy: float, axis: tuple[float, float], radius: float) -> Side:
    """Where a point dx, dy [m] from the animal is, seen by the gate along `axis` of length `radius` [m].

    `after` is the side that a counter-clockwise circle comes out at, the gate itself included; `outside` is what lies
    behind the animal or beyond the radius.
    """
    along, across = dx * axis[0] + dy * axis[1], dy * axis[0] - dx * axis[1]
    if abs(along - 0.5 * radius) > 0.5 * radius:
        return "outside"
    return "after" if across >= 0.0 else "before"


_Gate = Annotated[int, Field(ge=0, lt=GATES)]
"""Number of a gate around an animal."""


@dataclass
class WildlifeState:
    """Rows are animals."""

    status: list[Literal["never_engaged", "engaged", "not_engaged", "circumnavigated"]]
    """Circumnavigated is for good."""
    sides: list[list[Side | Literal["crossed"]]]
    """Side of every gate on which the boat was when last looked at while engaged; `crossed` just after a crossing."""
    circled: list[list[_Gate]]
    """Gates crossed in the right sense since the circle began, in their order: one may be in it twice."""
    animals: list[dict[str, str | float | None]] = field(default_factory=list)
    """The animals as teams saw them last."""
    published: Count = 0
    """Number of times that they were published."""


class Wildlife(Referee):
    """The score is the time [s], in the end less a bonus for each animal circled and each one to avoid never engaged.

    VRX's quirks are kept: an animal is engaged within a radius in space; the sense alone counts, not which gates are
    crossed, and the wrong one starts a circle over, as leaving the radius does; any collision starts over all circles;
    at time-out a bonus that eats up the full time is not given; a task without an animal to circle ends as it begins.
    In profile `vrx` a score is at least 0 and `num_collisions` stays 0; in `vrx3` neither is so.
    """

    title = "wildlife"
    state: WildlifeState

    def __init__(self, task: tasks.Wildlife) -> None:
        self._animals = task.animals
        self._classic = task.profile != "vrx3"
        self.counts_hits = not self._classic
        self._radius, self._bonus = task.engagement_distance, task.time_bonus
        self._rate = task.publication_rate
        count = len(self._animals)
        state = WildlifeState(
            ["never_engaged"] * count, [["outside"] * GATES for _ in range(count)], [[] for _ in range(count)]
        )
        super().__init__(task, state)

    @property
    def parts(self) -> dict[str, object]:
        """How far the circles are: for every animal its name, goal, status and the numbers of the gates crossed."""
        rows = zip(self._animals, self.state.status, self.state.circled, strict=True)
        return {
            "animals": [
                {"name": animal.name, "goal": animal.goal, "status": status, "circled": circled}
                for animal, status, circled in rows
            ]
        }

    def update(self, frame: Frame) -> None:
        """Take the time, look at every animal, and end the task when all circles are closed."""
        status = self.status
        self.set_score(min(status.duration, status.elapsed))
        boat = frame.poses[self.boat]
        for number, animal in enumerate(self._animals):
            if not self._is_circled(number):
                self._look_at(number, frame.poses[animal.name], boat)
        self._publish(frame)
        if all(self._is_circled(number) for number in range(len(self._animals)) if not self._is_avoided(number)):
            self._complete()

    def take_hit(self, other: str, frame: Frame) -> None:
        """Any collision starts over all circles under way."""
        for number, circled in enumerate(self.state.circled):
            if circled and not self._is_circled(number):
                name = self._animals[number].name
                self.log(f"the circle around {name} starts over: collision with {other}", "WARN")
                circled.clear()

    def timeout_score(self) -> float | None:
        """The full time less the bonus; if nothing is left, the full time."""
        duration = self.status.duration
        left = duration - self._bonuses()
        return left if left > 0.0 else duration

    def check_state(self, state: WildlifeState) -> None:
        """The animals as teams saw them have all keys, and numbers for the place.

        Raises:
            StateError: it has not.
        """
        for animal in state.animals:
            if animal.keys() != _ANIMAL_KEYS or not all(isinstance(animal[key], int | float) for key in _NUMBERS):
                raise StateError(f"the state does not fit the task: an animal needs {', '.join(sorted(_ANIMAL_KEYS))}")

    @property
    def outputs(self) -> Outputs:
        """Where the animals are, from `running` on; who knows the georeference fills in latitude and longitude."""
        return {"animals": [dict(animal) for animal in self.state.animals]} if self.state.published else {}

    # Inside

    def _is_avoided(self, number: int) -> bool:
        return self._animals[number].goal == "avoid"

    def _is_circled(self, number: int) -> bool:
        return self.state.status[number] == "circumnavigated"

    def _bonuses(self) -> float:
        """Sum of the bonuses for animals circled, and for those to avoid that were never engaged [s]."""
        status = self.state.status
        earned = (
            status[number] == ("never_engaged" if self._is_avoided(number) else "circumnavigated")
            for number in range(len(status))
        )
        return self._bonus * sum(earned)

    def _complete(self) -> None:
        bonus = self._bonuses()
        score = self.status.score - bonus
        self.set_score(max(0.0, score) if self._classic else score)
        self.log(f"all animals circled after {self.status.elapsed:.2f} s: bonus {bonus:g} s")
        self.finish()

    def _look_at(self, number: int, animal: Pose, boat: Pose) -> None:
        """Engage, leave, or go on with the circle: one of them at a frame."""
        own, name = self.state, self._animals[number].name
        distance = math.dist((boat.x, boat.y, boat.z), (animal.x, animal.y, animal.z))
        if own.status[number] != "engaged":
            if distance <= self._radius:
                lost = self._is_avoided(number) and own.status[number] == "never_engaged"
                self.log(f"{name} engaged" + (": its bonus is lost" if lost else ""), "WARN" if lost else "INFO")
                own.status[number] = "engaged"
        elif distance > self._radius:
            own.status[number] = "not_engaged"
            self._start_over(number, f"{name} left")
        elif not self._is_avoided(number):
            self._circle(number, boat.x - animal.x, boat.y - animal.y)

    def _circle(self, number: int, dx: float, dy: float) -> None:
        """See which gates the boat has crossed, and in which sense."""
        own, name = self.state, self._animals[number].name
        right = "after" if self._animals[number].goal == "circumnavigate_counterclockwise" else "before"
        sides, circled = own.sides[number], own.circled[number]
        for gate, axis in enumerate(AXES):
            side = gate_side(dx, dy, axis, self._radius)
            if {side, sides[gate]} != {"before", "after"}:
                sides[gate] = side
                continue
            sides[gate] = "crossed"
            if side != right:
                self._start_over(number, f"{name} passed the wrong way round")
                continue
            circled.append(gate)
            self.log(f"{name}: {len(circled)} of {GATES} gates of its circle crossed")
            if len(circled) == GATES:
                own.status[number] = "circumnavigated"
                self.log(f"{name} circled: {self._bonus:g} s bonus at the end")
                return

    def _start_over(self, number: int, why: str) -> None:
        circled = self.state.circled[number]
        self.log(why + (f": its circle starts over after {len(circled)} of {GATES} gates" if circled else ""))
        circled.clear()

    def _publish(self, frame: Frame) -> None:
        """Publish where the animals are, if it is time: at every frame, or at a rate since the run began."""
        own = self.state
        if self._rate and frame.time < self.status.running_time + own.published / self._rate - EARLY:
            return
        own.published += 1
        own.animals = [_announcement(animal, frame.poses[animal.name]) for animal in self._animals]


def _announcement(animal: tasks.Animal, pose: Pose) -> dict[str, str | float | None]:
    place = {"x": pose.x, "y": pose.y, "z": pose.z, "yaw": pose.yaw, "latitude": None, "longitude": None}
    return {"name": _KIND_BY_GOAL[animal.goal], **place}
