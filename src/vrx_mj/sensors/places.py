"""Where a sensor is and how it moves, from the pose and velocity of the body that carries it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import matrix_quaternion, quaternion_product, rotation_matrix


@dataclass(frozen=True)
class Mount:
    """A frame on a body."""

    position: FloatArray
    """(3,) of its origin [m], body axes from the body's origin."""
    rotation: FloatArray
    """(3, 3), frame to body."""
    orientation: FloatArray
    """(4,) the same as a unit quaternion (w, x, y, z)."""

    @staticmethod
    def of(position: Sequence[float], rotation: Sequence[Sequence[float]]) -> "Mount":
        """The frame at a position [m] with a rotation matrix."""
        turn = np.array(rotation, np.float64)
        return Mount(np.array(position, np.float64), turn, matrix_quaternion(turn))

    def at_base(self) -> "Mount":
        """A frame with the same axes at the body's origin."""
        return Mount(np.zeros(3), self.rotation, self.orientation)


class Place(NamedTuple):
    """Pose and velocity of a frame in the world."""

    position: FloatArray
    """(3,) of its origin [m], ENU."""
    rotation: FloatArray
    """(3, 3), frame to world."""
    orientation: FloatArray
    """(4,) the same as a unit quaternion (w, x, y, z)."""
    velocity: FloatArray
    """(3,) of its origin [m/s], world axes."""
    spin: FloatArray
    """(3,) angular velocity [rad/s], world axes."""


def place_of_mount(pose: FloatArray, velocity: FloatArray, mount: Mount) -> Place:
    """Where a mount is and how it moves on a free body.

    Args:
        pose: (7,) of the body as MuJoCo's free joint has it: position [m] and quaternion (w, x, y, z).
        velocity: (6,) likewise: linear [m/s], of the origin in world axes; angular [rad/s], in body axes.
        mount: the frame on that body.
    """
    attitude = pose[3:] / math.sqrt(pose[3:].dot(pose[3:]))
    turn = rotation_matrix(attitude)
    lever, spin = turn @ mount.position, turn @ velocity[3:]
    return Place(
        pose[:3] + lever,
        turn @ mount.rotation,
        quaternion_product(attitude, mount.orientation),
        velocity[:3] + _cross(spin, lever),
        spin,
    )


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    """(3,) vector product; numpy's own takes 50 times as long."""
    (a, b, c), (x, y, z) = one.tolist(), other.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])
