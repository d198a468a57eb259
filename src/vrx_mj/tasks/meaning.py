"""What the score of a task is: its unit, and which way is better (VRX's competition documents)."""

from dataclasses import dataclass
from typing import Literal

__all__ = ["MEANINGS", "Meaning"]


@dataclass(frozen=True)
class Meaning:
    """Of a score."""

    unit: str
    better: Literal["lower", "higher"]


MEANINGS = {
    "stationkeeping": Meaning("m", "lower"),
    "wayfinding": Meaning("m", "lower"),
    "perception": Meaning("m", "lower"),
    "navigation_course": Meaning("s", "lower"),
    "follow_path": Meaning("points", "higher"),
    "dock": Meaning("points", "higher"),
    "scan_and_dock": Meaning("points", "higher"),
    "scan_dock_deliver": Meaning("points", "higher"),
    "wildlife": Meaning("s", "lower"),
    "gymkhana": Meaning("m", "lower"),
    "acoustic_perception": Meaning("s", "lower"),
    "acoustic_tracking": Meaning("m", "lower"),
}
"""By the type of the task."""
