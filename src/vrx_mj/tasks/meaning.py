"""What the score of a task is: its unit, and which way is better (VRX's competition documents)."""

from dataclasses import dataclass
from typing import Literal

__all__ = ["MEANINGS", "Meaning"]


@dataclass(frozen=True)
class Meaning:
    """Of a score."""

    unit: str
    better: Literal["lower", "higher"]
    about: str


MEANINGS = {
    "stationkeeping": Meaning("m", "lower", "mean error of the pose since the run began"),
    "wayfinding": Meaning("m", "lower", "mean over the waypoints of the least error of the pose"),
    "perception": Meaning("m", "lower", "mean error of the landmarks' positions; 10 for one that was not found"),
    "navigation_course": Meaning("s", "lower", "time per gate with penalties; 200 is a failure"),
    "follow_path": Meaning("points", "higher", "10 for each gate, 1 for each in a row, less 3 for each collision"),
    "dock": Meaning("points", "higher", "docking, and docking in the right bay"),
    "scan_and_dock": Meaning("points", "higher", "the light buoy's colours, docking, and docking in the right bay"),
    "scan_dock_deliver": Meaning(
        "points", "higher", "the colours, docking, the right bay, and balls through the holes"
    ),
    "wildlife": Meaning("s", "lower", "time to circle the animals, less bonuses"),
    "gymkhana": Meaning("m", "lower", "mean distance to the black box since the run began; 200 is a failed channel"),
    "acoustic_perception": Meaning("s", "lower", "time until the beacon is reached"),
    "acoustic_tracking": Meaning("m", "lower", "mean distance to the moving beacon"),
}
"""By the type of the task."""
