"""Boats with_scaled_mass or lighter than their files say."""

import copy
from collections.abc import Iterable

import mujoco

__all__ = ["with_scaled_mass"]


def with_scaled_mass(model: mujoco.MjModel, roots: Iterable[int], factor: float) -> mujoco.MjModel:
    """A model like another, with mass and inertia of some bodies, and of all that hangs on them, times a factor."""
    own, chosen = copy.copy(model), set(roots)
    bodies = [body for body in range(model.nbody) if int(model.body_rootid[body]) in chosen]
    own.body_mass[bodies] *= factor
    own.body_inertia[bodies] *= factor
    mujoco.mj_setConst(own, mujoco.MjData(own))
    return own
