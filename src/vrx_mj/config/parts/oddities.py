"""What VRX accepts in silence and nobody means: each is a warning."""

import math
from collections.abc import Iterator

from vrx_mj.config.parts.catalogue import JAZZY_NAMES, TYPES
from vrx_mj.config.parts.files import Instance
from vrx_mj.config.wording import shown

__all__ = ["LIDAR_TYPES", "oddities"]

LIDAR_TYPES = ("16_beam", "32_beam")
"""Lidars there are; any other type makes none, as in VRX."""
FULL_TURN = 2.0 * math.pi
"""An angle beyond this is rather meant in degrees [rad]."""

Oddity = tuple[str, str]
"""The parameter, and what is odd about it."""


def oddities(instance: Instance) -> Iterator[Oddity]:
    """What is odd about a part whose parameters are all valid."""
    yield from _angles(instance)
    yield from _post(instance)
    kind = instance.parameters.get("type", LIDAR_TYPES[0])
    if instance.type == "lidar" and kind not in LIDAR_TYPES:
        yield "type", f"VRX makes no lidar of type {shown(kind)}; known: {', '.join(LIDAR_TYPES)}"
    if JAZZY_NAMES & instance.parameters.keys() and "position" in instance.parameters:
        message = "VRX jazzy takes it for the beacon's place in the world; the receiver is at base_link's origin"
        yield "position", message


def _angles(instance: Instance) -> Iterator[Oddity]:
    for key, value in instance.parameters.items():
        parameter = TYPES[instance.type].parameter(key)
        if parameter is None or parameter.unit != "rad":
            continue
        for angle in map(float, str(value).split()):
            if abs(angle) > FULL_TURN:
                yield (
                    key,
                    f"{angle:g} exceeds a full turn, {FULL_TURN:.4f}; angles are in radians: ${{radians({angle:g})}}",
                )
                break


def _post(instance: Instance) -> Iterator[Oddity]:
    """A post's length is what is left of the height of what it carries."""
    part = TYPES[instance.type]
    if part.drop is None:
        return
    height, foot = (float(instance.parameters.get(key, part.default(key) or 0.0)) for key in ("z", "post_z_from"))
    length = height - foot - part.drop
    if length < -1e-9:  # what rounding leaves of zero is no length
        least = foot + part.drop
        yield (
            "z",
            f"at {height:g} m its post is {length:.4g} m long, with a negative mass; it needs {least:g} m or more",
        )
