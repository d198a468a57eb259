"""The actions of a referee in a simulation: boats are released, objects moved, lights lit."""

import weakref
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from vrx_mj.runtime.sampling import Sampler
from vrx_mj.tasks.actions import Action, LightUp, PlaceObject, Release, SetPinger, ShowSymbol
from vrx_mj.tasks.frame import Message

if TYPE_CHECKING:
    from vrx_mj.runtime.simulation import Simulation

__all__ = ["SimulationTaskActions"]

AT_REST = (0.0,) * 6


class SimulationTaskActions:
    """Carries out the actions of a referee in a simulation."""

    def __init__(self, sim: "Simulation", sampler: Sampler) -> None:
        self._sim: Simulation = weakref.proxy(sim)
        self._sampler = sampler

    def act(self, action: Action) -> None:
        """Do something to the world."""
        sim = self._sim
        match action:
            case Release(boat):
                sim.release(boat)
            case PlaceObject(name, pose):
                sim.set_object(name, pose=pose, velocity=AT_REST)
            case SetPinger(boat, position):
                for sensor in sim.receivers(boat):
                    sim.set_pinger(boat, sensor, position)
            case LightUp(name, colors):
                sim.set_light(name, colors)
            case ShowSymbol(placard, symbol):
                sim.set_placard(placard, symbol)

    def frame(self, row: npt.NDArray[np.float64], messages: Sequence[Message]) -> None:
        """A frame was looked at: recordings keep it."""
        for listener in self._sampler.listeners:
            listener.frame(self._sim.time, row, messages)

    def event(self, text: str, level: str = "INFO") -> None:
        """Write a line into the recordings."""
        self._sim.event(text, level)
