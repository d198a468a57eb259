"""Where boats and objects of a simulation started, and their way back."""

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import VrxError
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.simulation import Simulation

_STILL = (0.0,) * 6
_CLOSE = 1e-9
"""A body that moved less [m] is left alone: one that sleeps goes on sleeping."""


class InitialPoses:
    """Poses by name, each from when its body was first seen."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._boats: dict[str, FloatArray] = {}
        self._objects: dict[str, FloatArray] = {}
        self.bind()

    def bind(self) -> None:
        """Boats came or went."""
        seen = self._sim.observe()
        self._boats = {name: self._boats.get(name, _pose(seen[name])) for name in self._sim.boats}
        afloat = {name: place for name in self._names() if (place := self._object(name)) is not None}
        self._objects = {name: self._objects.get(name, place) for name, place in afloat.items()}

    def put_back(self) -> None:
        """Put everything that moved where it started, at rest; boats that their task holds stay where it does."""
        task = self._sim.task
        held = {task["boat"]} if task is not None and task["state"] == "initial" else set()
        for name, pose in self._boats.items():
            if name not in held:
                self._sim.set_boat(name, pose=pose.tolist(), velocity=_STILL)
        for name, pose in self._objects.items():
            now = self._object(name)
            if now is not None and np.abs(now - pose).max() > _CLOSE:
                self._sim.set_object(name, pose=pose.tolist(), velocity=_STILL)

    def _names(self) -> list[str]:
        return [item.name for item in self._sim.world.parameters.objects if item.kind != "static"]

    def _object(self, name: str) -> FloatArray | None:
        try:
            return _pose(self._sim.observe_object(name))
        except VrxError:
            return None


def _pose(seen: BoatObservation) -> FloatArray:
    return np.array([*seen.position, seen.roll, seen.pitch, seen.heading])
