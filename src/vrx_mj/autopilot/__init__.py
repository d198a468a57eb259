"""Autopilots that sail boats in lock-step: ArduPilot's SITL, by its JSON interface."""

from vrx_mj.autopilot.ardupilot import MAVLINK_PORT, PORT, PORT_STEP, ArduPilot, ports_of

__all__ = ["MAVLINK_PORT", "PORT", "PORT_STEP", "ArduPilot", "ports_of"]
