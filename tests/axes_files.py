"""Axes files of our own with the structure and the figures of VRX's examples of 2019 (vrx_2019/worlds/yamls)."""

from pathlib import Path

__all__ = ["LOST_AN_AXIS", "SAMPLES", "WORLDS"]

SAMPLES = Path(__file__).parent / "unit" / "formats" / "series" / "axes"
WORLDS = {
    "nav_challenge_deep": 8,
    "perception_deep": 8,
    "scan_and_dock_shallow": 2,
    "station_keeping_shallow": 1,
}
"""How many worlds each makes: deep ones have axes of 2 x 2 x 2 steps, shallow ones of 2; the last lost its axis."""
LOST_AN_AXIS = (
    "station_keeping_shallow.yaml: given twice; the last one is used, as in VRX: "
    "tasks.macros (lines 11 and 18), tasks.sequence (lines 14 and 25); step 1 of tasks does not exist: it has 1 step"
)
"""What a reader of the last is told."""
