"""Drag and added mass of a hull."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import hull, in_body_axes, matrix, moving
from vrx_mj.physics.drag import added_bias, added_inertia, added_moment, drag, has_added_moment
from vrx_mj.physics.tables import MARINE, VRX, VRX3

numbers = st.floats(-3, 3)
vectors = st.tuples(numbers, numbers, numbers)
angles = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)
ADDED = (20.0, 60.0, 40.0, 20.0, 40.0, 60.0)
ASKEW = (0.3, -0.2, 0.5)


def test_drag_by_hand():
    body = moving(angles=(0.3, -0.2, 1.0), velocity=(1.5, -0.4, 0.1, 0.05, -0.02, 0.3))
    assert in_body_axes(body, drag(hull(), body)) == pytest.approx((-239.85, 16, -50, -2.5, 1, -120))


@given(angle=angles, linear=vectors, angular=vectors)
def test_drag_takes_power(angle, linear, angular):
    body = moving(angles=angle, velocity=(*linear, *angular))
    power = in_body_axes(body, drag(hull(), body)) @ (*linear, *angular)
    assert power <= 1e-12


@given(angle=angles, linear=vectors, angular=vectors, a=vectors, alpha=vectors)
def test_added_mass_resists_the_change_of_body_velocities(angle, linear, angular, a, alpha):
    """Differences of R^T v and omega over a short time, as VRX has them, against inertia, bias and moment."""
    boat = hull(added_mass=ADDED, link_com=ASKEW)
    body = moving(angles=angle, velocity=(*linear, *angular))
    inertia = np.empty((6, 6))
    added_inertia(boat, body, inertia)
    turn, now = matrix(body), np.array([*linear, *angular])
    dt = 1e-7
    turn_next = turn @ (np.eye(3) + dt * np.cross(np.eye(3), angular))
    next_ = np.array([*(turn_next.T @ (turn @ linear + np.multiply(dt, a))), *np.add(angular, np.multiply(dt, alpha))])
    force, torque = np.split(-np.array(ADDED) * (next_ - now) / dt, 2)

    reaction = -inertia @ (*a, *alpha)
    bias = np.array(added_bias(boat, body))
    error = 1e-3  # dt times the next derivative, up to 60 kg 3 rad/s 3 rad/s 3 m/s, and rounding / dt
    assert reaction[:3] + bias[:3] == pytest.approx(turn @ force, abs=error)
    about_origin = np.cross(turn @ ASKEW, bias[:3]) + turn @ reaction[3:] + added_moment(boat, body, a)
    assert about_origin == pytest.approx(turn @ (torque + np.cross(ASKEW, force)), abs=error)


@given(angle=angles)
def test_added_inertia_is_symmetric_and_never_negative(angle):
    inertia = np.full((6, 6), np.nan)
    added_inertia(hull(added_mass=ADDED), moving(angles=angle), inertia)
    assert inertia == pytest.approx(inertia.T, abs=1e-12)
    assert np.linalg.eigvalsh(inertia) == pytest.approx(sorted(ADDED))


def test_a_wam_v_s_moment_that_the_inertia_leaves_out_is_zero():
    moment = added_moment(hull(), moving(angles=(0.1, 0.2, 0.3)), (1.0, 2.0, 3.0))
    assert moment == pytest.approx((0, 0, 0), abs=1e-15)
    assert not has_added_moment(hull())


@pytest.mark.parametrize(
    ("profile", "added", "has"),
    [(VRX, (0, 0, 9, 9, 9, 9), False), (VRX, (9, 0, 0, 0, 0, 0), True), (VRX, (0, 9, 0, 0, 0, 0), True),
     (VRX3, (9, 9, 0, 0, 0, 0), False), (MARINE, (9, 9, 0, 0, 0, 0), False)],
)  # fmt: skip
def test_the_moment_is_that_of_vrx_classic_s_boats_with_added_mass_in_surge_or_sway(profile, added, has):
    assert has_added_moment(hull(profile=profile, added_mass=added)) is has


def test_no_added_mass_adds_nothing():
    boat = hull(added_mass=(0.0,) * 6)
    body = moving(velocity=(1, 2, 3, 4, 5, 6))
    inertia = np.ones((6, 6))
    added_inertia(boat, body, inertia)
    assert not inertia.any()
    assert added_bias(boat, body) == (0.0,) * 6
