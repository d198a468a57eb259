"""The velocity loop in closed form, without a simulator."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.control.test_allocation import LAYOUTS, summed
from vrx_mj.control.navigation import Estimate
from vrx_mj.control.velocity import WAMV, VelocityKeeper

layouts = pytest.mark.parametrize("layout", ["T", "X"])  # H does not turn its engines for less than 2 N


def forces(keeper, layout, velocity, wanted, t=0.0):
    """Force ahead and to port [N] and moment [N m] about the centre of a boat that heads east."""
    u, v, r = velocity
    seen = Estimate(0.0, 0.0, 0.0, 0.0, u, v, r, None)
    surge, sway, yaw = summed(LAYOUTS[layout], keeper(seen, t, *wanted))
    return surge, sway, yaw - WAMV.centre * sway


@layouts
@given(u=st.floats(0.2, 1.0), v=st.floats(-0.1, 0.1), r=st.floats(-0.05, 0.05))
def test_a_boat_at_its_speed_and_rate_is_given_its_drag(layout, u, v, r):
    drag = WAMV.drag(u, 0.0)[0], 0.0, WAMV.turning_drag(r)
    assert forces(VelocityKeeper(LAYOUTS[layout]), layout, (u, v, r), (u, r)) == pytest.approx(drag, abs=1e-9)
    aside = WAMV.mass * (u * r - 1.2 * v)  # what a turn takes, and what brings sway to rest
    holding = VelocityKeeper(LAYOUTS[layout], hold_sway=True)
    found = forces(holding, layout, (u, v, r), (math.hypot(u, v), r))
    assert found == pytest.approx((drag[0], aside, drag[2]), abs=1e-9)


@layouts
def test_errors_die_at_their_rates_and_what_stays_is_taken_over_by_a_fifth_of_those_each_second(layout):
    keeper = VelocityKeeper(LAYOUTS[layout], hold_sway=True)
    ahead, aside, around = WAMV.mass * 1.2 * 0.1, -WAMV.mass * 1.2 * 0.02, WAMV.inertia * 2.5 * 0.02
    speed = math.hypot(0.6, 0.02)
    for calls, t in enumerate((0.0, 0.1, 0.3, 0.4)):
        seconds = (0.0, 0.0, 0.1, 0.3)[calls]  # between the calls before
        expected = (
            WAMV.drag(0.6, 0.0)[0] + ahead * (1.0 + 0.2 * 1.2 * seconds),
            aside * (1.0 + 0.2 * 1.2 * seconds),
            around * (1.0 + 0.2 * 2.5 * seconds),
        )
        found = forces(keeper, layout, (0.5, 0.02, -0.02), (speed, 0.0), t)
        assert found == pytest.approx(expected, abs=1e-9)
