"""Autopilots that sail boats in lock-step: ArduPilot's SITL, by its JSON interface."""

from vrx_mj.autopilot.ardupilot import ArduPilot, ports_of

__all__ = ["ArduPilot", "ports_of"]
