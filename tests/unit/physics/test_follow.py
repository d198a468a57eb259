"""Followers: what drives a thing toward a waypoint, and when it takes the next one."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import in_body_axes, matrix, moving, table
from vrx_mj.model import tables
from vrx_mj.physics.flotation import follow

PLACES = ((10.0, 0.0), (10.0, 5.0), (-3.0, 5.0))


def driven(body, *, target=0, places=PLACES, com=(0.0, 0.0, 0.0), **changes):
    """Wrench in body axes, and the waypoint it is bound for afterwards."""
    row = {
        "force": 10.0, "torque": 1.0, "tolerance": math.radians(2.0), "reach": 0.5, "turns_first": 0, "loop": 1,
        "waypoint_start": 1, "waypoint_count": len(places), **changes,
    }  # fmt: skip
    follower = table(tables.FOLLOWER, [row])[0]
    others = [{"position": (99.0, 99.0)}, *({"position": place} for place in places)]
    state = np.zeros(1, tables.FOLLOWER_STATE)
    state["target"] = target
    wrench = follow(follower, table(tables.WAYPOINT, others), state[0], com, body)
    return in_body_axes(body, wrench), int(state["target"][0])


@pytest.mark.parametrize(
    ("bearing", "torque"), [(0.0, 0.0), (1.9, 0.0), (2.1, 1.0), (170.0, 1.0), (-1.9, 0.0), (-2.1, -1.0), (-90.0, -1.0)]
)
def test_it_pushes_ahead_and_turns_to_its_waypoint(bearing, torque):
    wrench, _ = driven(moving(angles=(0.0, 0.0, -math.radians(bearing))))
    assert wrench == pytest.approx((10.0, 0.0, 0.0, 0.0, 0.0, torque), abs=1e-12)


def test_it_is_pushed_at_its_origin_above_its_centre_of_mass():
    """The torque is r x F with r from the centre of mass to the origin."""
    com = (0.1, -0.2, -2.0)
    wrench, _ = driven(moving(), com=com)
    assert wrench[3:] == pytest.approx(np.cross(np.negative(com), (10.0, 0.0, 0.0)))


@pytest.mark.parametrize(("bearing", "force", "torque"), [(1.9, 10.0, 0.0), (2.1, 0.0, 1.0), (-2.1, 0.0, -1.0)])
def test_one_that_turns_first_pushes_only_when_its_waypoint_is_ahead(bearing, force, torque):
    wrench, _ = driven(moving(angles=(0.0, 0.0, -math.radians(bearing))), turns_first=1)
    assert wrench == pytest.approx((force, 0.0, 0.0, 0.0, 0.0, torque), abs=1e-12)


@given(angles=st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(-3.0, 3.0)), place=st.floats(-5.0, 5.0))
def test_on_its_side_it_pushes_along_its_own_axes(angles, place):
    """Second implementation: the bearing is that in the body's own x-y plane."""
    body = moving(position=(1.0, place, 0.3), angles=angles)
    ahead, left, _ = matrix(body).T @ np.array([9.0, -place, -0.3])
    bearing = math.atan2(left, ahead)
    torque = 0.0 if abs(bearing) <= math.radians(2.0) else math.copysign(1.0, bearing)
    wrench, _ = driven(body)
    assert wrench == pytest.approx((10.0, 0.0, 0.0, 0.0, 0.0, torque), abs=1e-9)


@pytest.mark.parametrize(("x", "after"), [(9.49, 0), (9.51, 1)])
def test_a_waypoint_is_reached_within_half_a_metre(x, after):
    wrench, target = driven(moving(position=(x, 0.0, 0.0)))
    assert target == after
    assert np.any(wrench) == (after == 0)


def test_distances_are_in_space_except_where_it_turns_first():
    high = moving(position=(10.0, 0.0, 0.6))
    assert driven(high)[1] == 0
    assert driven(high, turns_first=1)[1] == 1


def test_a_loop_begins_again_and_a_path_ends():
    there = moving(position=(*PLACES[2], 0.0))
    assert driven(there, target=2)[1] == 0
    wrench, target = driven(there, target=2, loop=0)
    assert (target, np.any(wrench)) == (2, False)


def test_at_its_last_waypoint_it_comes_back_when_it_drifts_off():
    wrench, target = driven(moving(position=(-5.0, 5.0, 0.0)), target=2, loop=0)
    assert (target, wrench[0]) == (2, 10.0)


def test_a_single_waypoint_is_kept():
    wrench, target = driven(moving(position=(10.0, 0.0, 0.0)), places=PLACES[:1])
    assert (target, np.any(wrench)) == (0, False)
