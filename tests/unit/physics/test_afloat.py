"""Floating objects in water that moves: against still water in turned axes, and closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import MARKER, element, floating, matrix, moving, rotation, table
from vrx_mj.model import tables
from vrx_mj.physics.afloat import apparent_gravity, flotation_in_waves, rope_pull
from vrx_mj.physics.flotation import flotation
from vrx_mj.physics.kinematics import Orbital
from vrx_mj.physics.motion import zero_wrench
from vrx_mj.physics.tables import MARINE

STILL = Orbital(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
DEEP = element("sphere", (0.2, 0.0, 0.0))
numbers = st.floats(-1, 1)
angles = st.tuples(*[st.floats(-0.6, 0.6)] * 3)


def row(*elements, **changes):
    return floating(list(elements), profile=MARINE, **changes)


@given(angles, st.tuples(*[numbers] * 6), st.floats(-0.4, 0.4))
def test_in_still_water_it_is_the_flotation_of_still_water(tilt, twist, z):
    body, elements = row(MARKER)
    moved = moving((3.0, 4.0, z), tilt, twist)
    found = flotation_in_waves(body, elements, moved, 0.1, (0.0, 0.0, 0.0), STILL, 0.01, zero_wrench())
    still = flotation(body, elements, None, moved, 0.1, 0.0, 0.01, zero_wrench())
    assert np.array(found.wrench) == pytest.approx(np.array(still.wrench), rel=1e-9, abs=1e-9)
    assert found.acceleration == pytest.approx(still.acceleration, rel=1e-9, abs=1e-9)


@given(angles, st.tuples(*[numbers] * 6), st.tuples(numbers, numbers))
def test_a_current_is_a_moving_frame(tilt, twist, stream):
    body, elements = row(MARKER)
    moved = moving((0.0, 0.0, -0.05), tilt, twist)
    shift = matrix(moved).T @ np.array([*stream, 0.0])
    over_ground = moving((0.0, 0.0, -0.05), tilt, (*(np.array(twist[:3]) + shift), *twist[3:]))
    found = flotation_in_waves(body, elements, over_ground, 0.0, (*stream, 0.0), STILL, 0.01, zero_wrench())
    still = flotation(body, elements, None, moved, 0.0, 0.0, 0.01, zero_wrench())
    assert np.array(found.wrench) == pytest.approx(np.array(still.wrench), rel=1e-7, abs=1e-7)


def test_deep_water_pushes_with_its_pressure():
    """Froude-Krylov: rho V (g + a)."""
    body, elements = row(DEEP, linear_drag=0.0, angular_drag=0.0, com=(0.0, 0.0, 0.0))
    water = Orbital(0.0, 0.0, 0.0, 0.4, -0.2, 0.3)
    wrench = flotation_in_waves(
        body, elements, moving((0.0, 0.0, -3.0)), 0.0, (0.0, 0.0, 0.0), water, 0.0, zero_wrench()
    ).wrench  # fmt: skip
    volume = 4.0 / 3.0 * math.pi * 0.2**3
    assert wrench[:3] == pytest.approx(1000.0 * volume * np.array([0.4, -0.2, 9.8 + 0.3]))
    assert wrench[3:] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("lean", [(0.4, 0.0), (-0.2, 0.7)])
def test_it_is_upright_when_it_is_square_to_the_surface(lean):
    """On a slope of a/g a float that leans with the surface feels no torque, whatever its shape; one upright does."""
    box = element("box", (0.6, 0.4, 0.5))
    body, elements = row(box, com=(0.0, 0.0, -0.1), linear_drag=0.0, angular_drag=0.0)
    water = Orbital(0.0, 0.0, 0.0, *lean, 0.0)
    up = np.array(apparent_gravity(9.8, water)) / np.linalg.norm([*lean, 9.8])
    pitch, roll = math.atan2(up[0], up[2]), -math.asin(up[1])
    square = rotation(roll, pitch, 0.0)
    assert square[:, 2] == pytest.approx(up, abs=1e-12)
    still = (0.0, 0.0, 0.0), water, 0.0, zero_wrench()
    leaning = flotation_in_waves(body, elements, moving((0.0, 0.0, 0.05), (roll, pitch, 0.0)), 0.0, *still).wrench
    upright = flotation_in_waves(body, elements, moving((0.0, 0.0, 0.05)), 0.0, *still).wrench
    assert leaning[3:] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert np.linalg.norm(upright[3:]) > 1.0


def rope(**changes):
    line = {"float": 0, "anchor": (1.0, 2.0), "length": 2.0, "stiffness": 50.0, "damping": 20.0}
    return table(tables.ROPE, [line | changes])[0]


def test_a_rope_is_slack_up_to_its_length_and_then_a_spring():
    body, _ = row(MARKER, com=(0.0, 0.0, 0.0))
    assert (
        rope_pull(rope(), body, moving((1.0, 3.9, 0.0), velocity=(0, 9, 0, 0, 0, 0)), 0.01, np.zeros(3)) == (0.0,) * 6
    )
    pull = rope_pull(rope(), body, moving((1.0, 5.0, 0.0)), 0.0, np.zeros(3))
    assert pull == pytest.approx((0.0, -50.0, 0.0, 0.0, 0.0, 0.0))


def test_a_rope_damps_and_never_pushes():
    body, _ = row(MARKER, com=(0.0, 0.0, 0.0))
    out, back = (
        rope_pull(rope(), body, moving((1.0, 5.0, 0.0), velocity=(0, rate, 0, 0, 0, 0)), 0.0, np.zeros(3))
        for rate in (1, -5)
    )
    assert out[1] == pytest.approx(-70.0)
    assert back == (0.0,) * 6


@pytest.mark.parametrize("stiffness", [10.0, 1e4, 1e8])
def test_a_stiff_rope_on_a_light_body_is_stable(stiffness):
    """A free body on a taut rope, at 10 ms, comes back and does not gain energy."""
    body, _ = row(MARKER, mass=2.0, com=(0.0, 0.0, 0.0))
    line, y, speed, dt, farthest = rope(stiffness=stiffness, damping=0.0, anchor=(0.0, 0.0)), 2.0, 1.0, 0.01, 0.0
    for _ in range(2000):
        moved = moving((0.0, y, 0.0), velocity=(0.0, speed, 0.0, 0.0, 0.0, 0.0))
        damping = np.zeros(3)
        pull = rope_pull(line, body, moved, dt, damping)[1]
        speed += dt * pull / (2.0 + damping[0])
        y += dt * speed
        farthest = max(farthest, y)
        if y < 2.0:
            break
    assert y < 2.0
    assert abs(speed) <= 1.0 + 1e-9
    assert farthest <= 2.0 + max(math.sqrt(2.0 / stiffness), dt) * 1.05
