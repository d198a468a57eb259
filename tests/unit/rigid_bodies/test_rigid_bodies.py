"""Masses that are turned, moved and joined."""

import math

import numpy as np
import pytest

from vrx_mj.rigid_bodies import combine, rigid, with_pose


def test_a_turned_body_has_its_inertia_turned_with_it():
    """About the vertical by a: Ixy is (Ixx - Iyy) sin a cos a."""
    part = with_pose(rigid(4.0, (1.0, 0.0, 0.0), (1.0, 2.0, 3.0)), (0.0, 0.0, 5.0, 0.0, 0.0, 0.5))
    c, s = math.cos(0.5), math.sin(0.5)
    assert part.center == pytest.approx([c, s, 5.0])
    assert part.inertia[0, 1] == pytest.approx((1.0 - 2.0) * s * c)
    assert part.tensor() == pytest.approx([c * c + 2 * s * s, s * s + 2 * c * c, 3.0, -s * c, 0.0, 0.0])


def test_joined_bodies_turn_as_their_points_do():
    """Point masses, against the sum over them."""
    places = np.array([[1.0, 2.0, 3.0], [-2.0, 0.5, 1.0], [0.0, -1.0, 4.0]])
    masses = np.array([1.0, 2.0, 5.0])
    whole = combine(rigid(m, place, (0.0, 0.0, 0.0)) for m, place in zip(masses, places, strict=True))
    assert whole.center == pytest.approx(masses @ places / 8.0)
    arms = places - whole.center
    expected = sum(m * (arm @ arm * np.eye(3) - np.outer(arm, arm)) for m, arm in zip(masses, arms, strict=True))
    assert whole.inertia == pytest.approx(expected)
