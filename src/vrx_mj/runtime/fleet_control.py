"""The controllers that a fleet's file names, as one: each commands its own boats."""

from collections.abc import Mapping
from typing import Any

from vrx_mj.errors import CommandError, VrxError, shown
from vrx_mj.runtime.observation import TASK, Observation
from vrx_mj.runtime.run import Controller, load_controller
from vrx_mj.runtime.simulation import Simulation

__all__ = ["fleet_controller", "names_controllers"]


def names_controllers(sim: Simulation) -> bool:
    """Whether the fleet of a simulation's world names any."""
    return bool(_crews(sim))


def fleet_controller(sim: Simulation) -> Controller | None:
    """What calls every controller that the world's fleet names; None if it names none.

    Each is loaded once, however many boats it has, and is called with the observations of all boats and the time [s].
    Of what it returns the commands for its own boats are taken, and, if it has the boat that is scored, its messages to
    the task.

    Raises:
        VrxError: a controller cannot be loaded; it names the boats that want it.
    """
    crews = _crews(sim)
    if not crews:
        return None
    task = sim.world.parameters.task
    loaded = []
    for name, own in crews.items():
        takes = own | {TASK} if task is not None and task.boat in own else own
        loaded.append((name, _loaded(name, own, sim.seed), takes))

    def controller(obs: Observation, time: float) -> Mapping[str, Any]:
        commands: dict[str, Any] = {}
        for name, steer, takes in loaded:
            commands |= {boat: item for boat, item in _commands(name, steer(obs, time)).items() if boat in takes}
        return commands

    return controller


def _crews(sim: Simulation) -> dict[str, set[str]]:
    """The boats of each controller, by its name."""
    crews: dict[str, set[str]] = {}
    for boat in sim.world.parameters.boats:
        if boat.controller is not None:
            crews.setdefault(boat.controller, set()).add(boat.name)
    return crews


def _loaded(name: str, boats: set[str], seed: int) -> Controller:
    try:
        return load_controller(name, seed)
    except VrxError as error:
        some = sorted(boats)
        rest = f" and {len(some) - 3} more" if len(some) > 3 else ""
        raise VrxError(f"controller of {', '.join(some[:3])}{rest}: {error}") from error


def _commands(name: str, returned: Any) -> Mapping[str, Any]:
    if returned is None:
        return {}
    if not isinstance(returned, Mapping):
        raise CommandError(f"the controller {name} returned {shown(returned)}: a mapping by boat, or None, is needed")
    return returned
