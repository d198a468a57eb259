"""Guidance, navigation and control laws for controllers, and controllers to start from: one for each task."""

from vrx_mj.control.acoustics import BeaconFollower, BeaconSeeker
from vrx_mj.control.captain import Captain
from vrx_mj.control.channel import Channel, Gymkhana
from vrx_mj.control.docking import Docking
from vrx_mj.control.perception import Perceiver
from vrx_mj.control.waypoints import StationKeeper, WaypointFollower
from vrx_mj.control.wildlife import WildlifeCircler

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
