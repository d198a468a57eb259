"""Trials of boats, as ITTC and IMO have them: turning circle, zigzag, crash stop, pull-out, spiral and free decay."""

from collections.abc import Callable

from vrx_mj.trials.procedures import (
    Figure,
    SimulatedVessel,
    Track,
    Trial,
    Vessel,
    VesselState,
    crash_stop,
    decay,
    pull_out,
    spiral,
    turning,
    zigzag,
)

__all__ = [
    "TRIALS",
    "Figure",
    "SimulatedVessel",
    "Track",
    "Trial",
    "Vessel",
    "VesselState",
    "crash_stop",
    "decay",
    "pull_out",
    "spiral",
    "turning",
    "zigzag",
]

TRIALS: dict[str, Callable[..., Trial]] = {
    "turning": turning,
    "zigzag": zigzag,
    "crash-stop": crash_stop,
    "pull-out": pull_out,
    "spiral": spiral,
    "decay": decay,
}
"""The trials by name, each a function of a vessel."""
