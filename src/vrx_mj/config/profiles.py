"""The profiles of physics: VRX classic's, VRX 3's and `marine`, and their defaults."""

from collections.abc import Mapping
from typing import Any, Literal

from vrx_mj.config.tree import Section
from vrx_mj.constants import STANDARD_GRAVITY

Profile = Literal["vrx", "vrx3", "marine"]
"""VRX classic (Gazebo 11, ROS 1), VRX 3 (gz-sim, ROS 2), the one of 2023, and water that streams."""

CLASSIC: Profile = "vrx"
NEWER: Profile = "vrx3"
MARINE: Profile = "marine"
DEFAULT: Profile = MARINE
"""Of a world that names none."""

PHYSICS: Mapping[str, Mapping[str, Any]] = {
    "vrx3": {"timestep": 0.004, "at_base_link": ("pinger",)},
    "marine": {"gravity": STANDARD_GRAVITY, "at_base_link": ()},
}
"""What a profile has instead of the defaults of `PhysicsConfig`; VRX 3's GPS and IMU are links of their own."""
SEA: Mapping[str, Mapping[str, Any]] = {"vrx3": {"scale": 1.1}}
"""The same for `SeaConfig`; VRX 3's Wavefield.cc."""


def physics_of_profile(data: object) -> object:
    """A world's `physics` with its profile's values where it gives none."""
    return _on_top(PHYSICS, data.get("profile", DEFAULT), data) if isinstance(data, Mapping) else data


def world_of_profile(data: object) -> object:
    """A world's file with its profile's defaults of the sea."""
    if not isinstance(data, Mapping) or not isinstance(data.get("physics"), Mapping):
        return data
    sea, profile = data.get("sea"), data["physics"].get("profile")
    if not isinstance(profile, str) or profile not in SEA or not (sea is None or isinstance(sea, Mapping)):
        return data
    return _with_places(data, {**data, "sea": _on_top(SEA, profile, sea or {})})


def _on_top(
    defaults: Mapping[str, Mapping[str, object]], profile: object, data: Mapping[str, object]
) -> Mapping[str, object]:
    own = defaults.get(profile, {}) if isinstance(profile, str) else {}
    return _with_places(data, {**own, **data}) if own else data


def _with_places(data: Mapping[str, object], values: Mapping[str, object]) -> Mapping[str, object]:
    """Other values at the places that a file's have."""
    return data.holding(values) if isinstance(data, Section) else values
