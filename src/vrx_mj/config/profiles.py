"""The profiles of physics: VRX classic's, VRX 3's and `marine`, and their defaults."""

from collections.abc import Mapping
from typing import Any, Literal

from vrx_mj.config.tree import Section, merge, of_python
from vrx_mj.constants import STANDARD_GRAVITY

Profile = Literal["vrx", "vrx3", "marine"]
"""VRX classic (Gazebo 11, ROS 1), VRX 3 (gz-sim, ROS 2), the one of 2023, and water that streams."""

CLASSIC: Profile = "vrx"
NEWER: Profile = "vrx3"
MARINE: Profile = "marine"
DEFAULT: Profile = MARINE
"""Profile of a world that names none."""

_DEFAULTS: Mapping[str, Mapping[str, Any]] = {
    "vrx3": {"physics": {"timestep": 0.004, "at_base_link": ("pinger",)}, "sea": {"scale": 1.1}},
    "marine": {"physics": {"gravity": STANDARD_GRAVITY, "at_base_link": ()}},
}
"""Defaults of a world by profile; VRX 3's GPS and IMU are links of their own, its sea is Wavefield.cc's."""


def on_its_profile(world: Section) -> Section:
    """A world's file on top of its profile's defaults."""
    physics = world.get("physics")
    profile = physics.get("profile", DEFAULT) if isinstance(physics, Mapping) else DEFAULT
    own = _DEFAULTS.get(profile, {}) if isinstance(profile, str) else {}
    given = {key: value for key, value in world.items() if value is not None or key not in own}
    return merge(of_python(own, world.place.file), world.holding(given))
