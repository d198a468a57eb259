"""Added mass of 36 coefficients: Fossen's matrices in NumPy, and what an ideal fluid conserves."""

import numpy as np
import pytest

from unit.physics.rows import moving
from vrx_mj.model.tables import VESSEL
from vrx_mj.physics.drag import added_inertia_of_vessel, added_mass_bias

RNG = np.random.default_rng(3)


def vessel(matrix, munk=1, center=(0.0, 0.0, 0.0)):
    row = np.zeros(1, VESSEL)
    row["added_mass"], row["munk"], row["buoyancy"] = matrix, munk, center
    return row[0]


def positive(seed=0):
    root = np.random.default_rng(seed).normal(size=(6, 6))
    return root @ root.T + np.eye(6)


def cross(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def coriolis(a, nu):
    """C_A, Fossen (2021), 6.43."""
    v, w = nu[:3], nu[3:]
    first, second = cross(a[:3, :3] @ v + a[:3, 3:] @ w), cross(a[3:, :3] @ v + a[3:, 3:] @ w)
    return -np.block([[np.zeros((3, 3)), first], [first, second]])


@pytest.mark.parametrize("seed", range(5))
def test_the_bias_is_fossen_s(seed):
    a, nu, (water, spin, center) = positive(seed), np.random.default_rng(seed).normal(size=6), RNG.normal(size=(3, 3))
    body = moving(angles=(0.3, -0.2, 1.0), velocity=tuple(nu))
    turn = np.array(body[3:12]).reshape(3, 3)
    taken = turn.T @ water - np.cross(turn.T @ spin, center)  # at the link's origin of what turns about the centre
    rate = np.concatenate((np.cross(nu[3:], nu[:3]) + taken, turn.T @ spin))
    found = added_mass_bias(vessel(a, center=center), body, tuple(water), tuple(spin))
    assert found == pytest.approx(a @ rate - coriolis(a, nu) @ nu, rel=1e-12)


def test_without_munk_s_moment_a_boat_that_drifts_does_not_turn():
    a = np.diag([100.0, 500.0, 900.0, 10.0, 200.0, 150.0])
    drifting = moving(velocity=(1.5, 0.5, 0.0, 0.0, 0.0, 0.0))
    none = (0.0, 0.0, 0.0)
    assert added_mass_bias(vessel(a), drifting, none, none)[5] == pytest.approx((100.0 - 500.0) * 1.5 * 0.5)
    assert added_mass_bias(vessel(a, munk=0), drifting, none, none) == (0.0,) * 6


def test_the_inertia_is_the_matrix_in_mujoco_s_coordinates():
    a, body, out = positive(), moving(angles=(0.3, -0.2, 1.0)), np.empty((6, 6))
    added_inertia_of_vessel(vessel(a), body, out)
    turn = np.eye(6)
    turn[:3, :3] = np.array(body[3:12]).reshape(3, 3)
    assert out == pytest.approx(turn @ a @ turn.T)
    assert out == pytest.approx(out.T)


def test_water_that_takes_a_body_along_pushes_it_like_its_own():
    """A body of the water's own acceleration feels no force of its added mass."""
    a, water = positive(4), (0.4, -0.3, 0.2)
    body = moving(angles=(0.3, -0.2, 1.0))
    turn = np.array(body[3:12]).reshape(3, 3)
    bias = np.array(added_mass_bias(vessel(a), body, water, (0.0, 0.0, 0.0)))
    assert bias - a @ np.concatenate((turn.T @ np.array(water), np.zeros(3))) == pytest.approx(np.zeros(6), abs=1e-12)
