"""What a problem sees of its boat: arrays with a row for every world."""

from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray

__all__ = ["OWN", "OWN_NAMES", "Seen", "folded", "pose_error", "seen_of"]

OWN = np.array([3.0, 3.0, 0.5, 0.3, 0.3, 0.5, 0.5, 10.0, 10.0])
"""Scales of what a boat feels, in the order of `OWN_NAMES`: in these units it is observed."""
OWN_NAMES = (
    "surge velocity [m/s]", "sway velocity [m/s]", "yaw rate [rad/s]", "roll [rad]", "pitch [rad]",
    "roll rate [rad/s]", "pitch rate [rad/s]", "wind ahead [m/s]", "wind to port [m/s]",
)  # fmt: skip
"""The wind's velocity is that of the air over ground, where it blows toward."""


class Seen(NamedTuple):
    """The boats at a moment, (n,) each unless it says otherwise."""

    x: FloatArray
    """East of the world's origin [m]."""
    y: FloatArray
    """North [m]."""
    yaw: FloatArray
    """Heading, counter-clockwise from east [rad]."""
    own: FloatArray
    """(n, 9): what `OWN_NAMES` says, in its units."""

    def toward(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where a point of each world is, ahead and to port [m]."""
        east, north, cos, sin = x - self.x, y - self.y, np.cos(self.yaw), np.sin(self.yaw)
        return cos * east + sin * north, cos * north - sin * east

    def beyond(self, x: FloatArray, y: FloatArray, course: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far the boats are from points [m]: along a course [rad] through them, and to port of it."""
        east, north, cos, sin = self.x - x, self.y - y, np.cos(course), np.sin(course)
        return cos * east + sin * north, cos * north - sin * east


def seen_of(features: FloatArray, wind: FloatArray) -> Seen:
    """What is seen, from a batch's features of one boat, (n, 13), and its wind, (n, 2) [m/s]."""
    x, y, _, qw, qx, qy, qz, u, v, _, p, q, r = features.T
    yaw = np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
    roll = np.arctan2(2 * (qw * qx + qy * qz), 1 - 2 * (qx * qx + qy * qy))
    pitch = np.arcsin(np.clip(2 * (qw * qy - qz * qx), -1.0, 1.0))
    cos, sin = np.cos(yaw), np.sin(yaw)
    ahead, port = cos * wind[:, 0] + sin * wind[:, 1], cos * wind[:, 1] - sin * wind[:, 0]
    return Seen(x, y, yaw, np.stack((u, v, r, roll, pitch, p, q, ahead, port), axis=1))


def folded(angle: FloatArray) -> FloatArray:
    """Angles [rad] within half a turn either way."""
    return angle - 2 * np.pi * np.round(angle / (2 * np.pi))


def pose_error(seen: Seen, x: FloatArray, y: FloatArray, yaw: FloatArray) -> FloatArray:
    """VRX's error of a pose [m]: d + 0.75^d h, with d the distance [m] and h the difference of headings [rad]."""
    distance = np.hypot(x - seen.x, y - seen.y)
    error: FloatArray = distance + 0.75**distance * np.abs(folded(yaw - seen.yaw))
    return error
