"""Guidance, navigation and control laws for controllers, and controllers to start from: one for each task."""

from vrx_mj.control.captain import Captain
from vrx_mj.control.stationkeeping import StationKeeper
from vrx_mj.control.wayfinding import WaypointFollower

__all__ = ["Captain", "StationKeeper", "WaypointFollower"]
