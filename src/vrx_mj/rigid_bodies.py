"""Mass, centre of mass and inertia of rigid parts, posed in frames and joined together."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import Pose, rotation


@dataclass(frozen=True)
class MassProperties:
    """A rigid part, or several joined, in the axes of one frame."""

    mass: float
    """Mass [kg]."""
    center: FloatArray
    """Centre of mass in the frame, (3,) [m]."""
    inertia: FloatArray
    """Inertia tensor about the centre of mass, (3, 3), in the frame's axes [kg m2]."""

    def tensor(self) -> list[float]:
        """Tensor as MJCF's `fullinertia` has it: xx, yy, zz, xy, xz, yz [kg m2]."""
        rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
        return [float(value) for value in self.inertia[rows, columns]]

    @property
    def is_principal(self) -> bool:
        """Whether the frame is the principal one, its axes ordered as MuJoCo does: it then keeps a diagonal inertia."""
        xx, yy, zz, *products = self.tensor()
        return not self.center.any() and not any(products) and xx >= yy >= zz


def rigid(mass: float, center: Sequence[float], inertia: Sequence[float]) -> MassProperties:
    """A part of `mass` [kg] at `center` [m]; `inertia` [kg m2] is xx, yy, zz about it, with xy, xz, yz or without."""
    xx, yy, zz, xy, xz, yz = (*inertia, 0.0, 0.0, 0.0)[:6]
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=np.float64)
    return MassProperties(mass, np.array(center, dtype=np.float64), tensor)


def with_pose(part: MassProperties, pose: Pose) -> MassProperties:
    """The part in a frame in which its own is at `pose`."""
    turn = np.array(rotation(*pose[3:]))
    center = (turn * part.center).sum(axis=1) + np.array(pose[:3])  # sums in order: @ rounds as each processor's BLAS
    return MassProperties(part.mass, center, np.einsum("ij,jk,lk", turn, part.inertia, turn))


def combine(parts: Iterable[MassProperties]) -> MassProperties:
    """The rigid union of parts given in one frame.

    Parallel axes (Steiner): I = sum I_i + m_i (|d|^2 1 - d d^T), d from the common centre of mass.
    """
    members = tuple(parts)
    mass = math.fsum(part.mass for part in members)
    center = sum((part.mass * part.center for part in members), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in members:
        arm = part.center - center
        inertia += part.inertia + part.mass * (np.square(arm).sum() * np.eye(3) - np.outer(arm, arm))
    return MassProperties(mass, center, inertia)
