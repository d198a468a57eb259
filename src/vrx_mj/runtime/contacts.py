"""Contacts of boats and their forces, sampled between calls of the compiled loop at steps that only the motion sets.

The loop returns at the step in which a touch begins (`runtime.proximity.touch_begins`), and from then on samples follow
each other while something touches. That does not change the motion.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from vrx_mj.runtime.loop_arrays import LoopArrays

__all__ = ["ContactWatch", "Touch", "forces_of_pairs"]

TOUCHING, FREE = 0.05, 0.5
"""Simulated time between two samples while a boat touches something, and while none does [s].

A sample ends a call of the compiled loop, which costs 20 us.
"""
SETTLES = 0.5
"""A touch is reported so long after it began, with the largest force until then [s]."""
PARTED = 1.0
"""After so long without contact [s] the next contact of a pair is a new touch."""

Pair = tuple[str, str]


@dataclass
class Touch:
    """A boat touches something."""

    boat: str
    other: str
    """Another boat, an object or a dock, by its name, or `terrain`."""
    time: float
    """When it began [s]."""
    force: float
    """The largest that was seen, of all points of contact together [N]."""

    def __str__(self) -> str:
        return f"{self.boat} touches {self.other}, {self.time:.1f} s, {self.force:.0f} N"


class ContactWatch:
    """Reports every touch of a boat once."""

    def __init__(
        self, boats: Callable[[], tuple[str, ...]], rig: Callable[[], LoopArrays], tell: Callable[[Touch], None]
    ) -> None:
        """Watch these boats; `rig` returns the present arrays, and `tell` is called with every touch."""
        self._boats, self._rig, self._tell = boats, rig, tell
        self._due, self._armed = 0, False
        self._touches: dict[Pair, Touch] = {}
        self._seen: dict[Pair, float] = {}
        self._waiting: set[Pair] = set()

    def begin(self) -> None:
        """The state was set, maybe to an earlier time: report what is pending, and forget all touches."""
        self.end()
        self._due = 0
        self._touches.clear()
        self._seen.clear()

    def steps(self, time: float) -> int:
        """Steps from `time` [s] to the next look."""
        return max(1, self._due - round(time / self._rig().timestep))

    def look(self, time: float) -> None:
        """Sample the contacts of the last step, if a sample is due at `time` [s]."""
        rig = self._rig()
        step = round(time / rig.timestep)
        stopped = self._armed and not rig.broadphase["armed"][0]
        if step < self._due and not stopped:
            return
        look = rig.broadphase[0]
        free = look["wait"] == 0 and look["clearance"] > 0.0  # the list of contacts is then an earlier step's
        found = forces_of_pairs(rig, frozenset(self._boats())) if rig.data.ncon and not free else {}
        for pair, force in found.items():
            self._note(pair, force, time)
        self._armed = not (found or stopped)  # what holds a boat stops the loop without a contact
        look["armed"] = self._armed
        stride = max(1, round(TOUCHING / rig.timestep))  # samples are at whole multiples of it, however the run is cut
        self._due = (step // stride + round((FREE if self._armed else TOUCHING) / TOUCHING)) * stride
        self._report(before=time - SETTLES)

    def end(self) -> None:
        """Report touches that were not reported yet: those of the last half second."""
        self._report(before=math.inf)

    def _note(self, pair: Pair, force: float, time: float) -> None:
        if time - self._seen.get(pair, -PARTED) >= PARTED:
            self._touches[pair] = Touch(*pair, time, force)
            self._waiting.add(pair)
        self._seen[pair] = time
        self._touches[pair].force = max(self._touches[pair].force, force)

    def _report(self, before: float) -> None:
        """Report touches that began before a time [s], in the order of their names."""
        begun = [pair for pair in sorted(self._waiting) if self._touches[pair].time < before]
        self._waiting.difference_update(begun)
        for pair in begun:
            self._tell(self._touches[pair])


def forces_of_pairs(rig: LoopArrays, boats: frozenset[str]) -> Mapping[Pair, float]:
    """Sizes of the contact forces [N] of the last step between boats and what they touch, by their names.

    Two boats are one pair, in the order of their names: which of their geoms MuJoCo has first says nothing.
    """
    model, data = rig.model, rig.data
    sums: dict[Pair, np.ndarray] = {}
    local = np.zeros(6)
    for number in range(data.ncon):
        contact = data.contact[number]
        one, two = (model.body(int(model.geom_bodyid[geom])).name.partition("/")[0] for geom in contact.geom)
        pair = (one, two) if one in boats and not (two in boats and two < one) else (two, one)
        if pair[0] in boats and one != two:
            mujoco.mj_contactForce(model, data, number, local)
            force = contact.frame.reshape(3, 3).T @ local[:3]
            known = (pair[0], "terrain" if pair[1] in {"", "world"} else pair[1])
            sums[known] = sums.get(known, np.zeros(3)) + (force if one == pair[0] else -force)
    return {pair: float(np.linalg.norm(force)) for pair, force in sums.items()}
