"""Names that ROS allows in topics and frames. Without ROS, more are allowed."""

import re
from collections.abc import Iterable

from vrx_mj.config.wording import shown

__all__ = ["ALLOWED", "is_ros_name", "ros_names_note"]

ALLOWED = "a letter, then letters, digits and '_'"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_SHOWN = 8


def is_ros_name(name: str) -> bool:
    """Whether ROS allows a name in a topic: a letter, then letters, digits and underscores."""
    return _NAME.fullmatch(name) is not None


def ros_names_note(kind: str, names: Iterable[str]) -> list[str]:
    """A line about those of the names that ROS refuses; none if it allows all."""
    odd = [name for name in dict.fromkeys(names) if not is_ros_name(name)]
    if not odd:
        return []
    rest = f" and {len(odd) - _SHOWN} more" if len(odd) > _SHOWN else ""
    listed = ", ".join(shown(name) for name in odd[:_SHOWN]) + rest
    return [f"ROS refuses topics with the name of {kind} {listed}: {ALLOWED} are allowed"]
