"""Where a sensor is and how it moves, from the pose and velocity of the body that carries it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.motion import rotation_matrix

__all__ = ["Mount", "Place", "carried", "conjugate", "product", "rotation_vector"]


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
        return Mount(np.array(position, np.float64), turn, _quaternion(turn))

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


def carried(pose: FloatArray, velocity: FloatArray, mount: Mount) -> Place:
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
        product(attitude, mount.orientation),
        velocity[:3] + _cross(spin, lever),
        spin,
    )


def product(one: FloatArray, other: FloatArray) -> FloatArray:
    """(4,) product of two quaternions (w, x, y, z): the rotation `other`, then `one`."""
    a, b, c, d = one.tolist()
    w, x, y, z = other.tolist()
    return np.array(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def conjugate(quaternion: FloatArray) -> FloatArray:
    """(4,) the inverse of a unit quaternion."""
    return quaternion * (1.0, -1.0, -1.0, -1.0)


def rotation_vector(quaternion: FloatArray) -> FloatArray:
    """(3,) axis times angle [rad] of a unit quaternion (w, x, y, z), the short way round."""
    w, axis = (-quaternion[0], -quaternion[1:]) if quaternion[0] < 0.0 else (quaternion[0], quaternion[1:])
    sine = float(np.linalg.norm(axis))
    scale = 2.0 if sine < 1e-12 else 2.0 * np.arctan2(sine, w) / sine
    vector: FloatArray = scale * axis
    return vector


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    """(3,) vector product; numpy's own takes 50 times as long."""
    (a, b, c), (x, y, z) = one.tolist(), other.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def _quaternion(rotation: FloatArray) -> FloatArray:
    """(4,) unit quaternion (w, x, y, z) of a rotation matrix; w is not negative.

    The four squares follow from the diagonal; the largest gives the others without cancellation (Shepperd 1978).
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    products = np.array(
        [
            [1 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
            [zy - yz, 1 + xx - yy - zz, yx + xy, zx + xz],
            [xz - zx, yx + xy, 1 + yy - xx - zz, zy + yz],
            [yx - xy, zx + xz, zy + yz, 1 + zz - xx - yy],
        ]
    )
    row = products[np.argmax(np.diag(products))]
    unit: FloatArray = row / np.linalg.norm(row)
    return -unit if unit[0] < 0.0 else unit
