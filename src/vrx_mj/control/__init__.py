"""Guidance, navigation and control laws, a controller for each task, and the captain, which picks the right one."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from vrx_mj.control.acoustics import BeaconFollower, BeaconSeeker
from vrx_mj.control.channel import Channel, Gymkhana
from vrx_mj.control.docking import Docking
from vrx_mj.control.perception import Perceiver
from vrx_mj.control.pilot import Commands, Skipper, task_of
from vrx_mj.control.waypoints import StationKeeper, WaypointFollower, WildlifeCircler

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import Observation

__all__ = [
    "BeaconFollower",
    "BeaconSeeker",
    "Captain",
    "Channel",
    "Docking",
    "Gymkhana",
    "Perceiver",
    "StationKeeper",
    "WaypointFollower",
    "WildlifeCircler",
]


SKIPPERS: dict[str, Callable[[], Skipper]] = {
    "acoustic_perception": BeaconSeeker,
    "acoustic_tracking": BeaconFollower,
    "dock": Docking,
    "follow_path": Channel,
    "gymkhana": Gymkhana,
    "navigation_course": Channel,
    "perception": Perceiver,
    "scan_and_dock": Docking,
    "scan_dock_deliver": Docking,
    "stationkeeping": StationKeeper,
    "wayfinding": WaypointFollower,
    "wildlife": WildlifeCircler,
}
"""Controllers by the type of the task."""


class Captain:
    """Steers a boat through any task with the controller for it.

    Example: `vrx-mj campaign vrx_mj.control:Captain --worlds 'vrx2022/*'`.
    In a world without a task, or with an unknown one, the boat holds its pose.
    """

    def __init__(self) -> None:
        self.reset(0)

    def reset(self, seed: int) -> None:
        """Forget the last run."""
        self._seed, self._skipper = seed, None

    def __call__(self, obs: "Observation", t: float) -> Commands:
        """Commands by boat for the observations and the time [s]."""
        if self._skipper is None:
            make = SKIPPERS.get(str(task_of(obs).get("type")), StationKeeper)
            self._skipper = make()
            self._skipper.reset(self._seed)
        return self._skipper(obs, t)

    _skipper: Skipper | None
