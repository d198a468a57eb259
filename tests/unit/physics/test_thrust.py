"""Thrusters and their servos."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.physics.rows import PROPELLER, hull, in_body_axes, moving, oracle, rotation, thruster
from vrx_mj.model.tables import THRUSTER_STATE
from vrx_mj.physics.motion import shift
from vrx_mj.physics.tables import GLF, LINEAR
from vrx_mj.physics.thrust import (
    effective_command,
    engine_wrench,
    force_point,
    servo_step,
    servo_torque,
    steering_target,
    thrust_force,
    thruster_wrench,
)

LOGISTIC = [  # VRX's curve with its 32-bit coefficients, computed by other code
    (-1.0, -100.0),
    (-0.8, -66.1851036),
    (-0.6, -28.7477134),
    (-0.4, -7.14415477),
    (-0.2, -1.11578671),
    (-0.1, -0.301329297),
    (0.0, 0.0414236258),
    (0.005, 0.0519148387),
    (0.01, 0.0),
    (0.02, 1.35493008),
    (0.1, 3.27398258),
    (0.2, 9.03302327),
    (0.28, 18.5688547),
    (0.4, 45.5850369),
    (0.5, 80.5992430),
    (0.6, 122.351511),
    (0.8, 198.207648),
    (1.0, 242.665874),
    (1.2, 250.0),
]


@pytest.mark.parametrize(("command", "force"), LOGISTIC)
def test_logistic_thrust(command, force):
    assert thrust_force(thruster(), command) == pytest.approx(force, rel=6e-9)  # nine digits are given


@pytest.mark.parametrize("mapping", [LINEAR, GLF])
def test_thrust_is_vrx_s(mapping):
    rows = [row for row in oracle("thrust_map") if row["mapping"] == mapping]
    assert rows
    for row in rows:
        engine = thruster(
            mapping=mapping,
            max_command=row["max_cmd"],
            max_forward=row["max_force_fwd_N"],
            max_reverse=row["max_force_rev_N"],
        )
        assert thrust_force(engine, row["cmd_float32"]) == pytest.approx(row["force_N"], rel=2e-8, abs=1e-10)


@given(st.floats(-5, 5), st.floats(0, 1))
def test_more_command_never_gives_less_thrust(command, more):
    """Only at 0.01, where VRX's curves do not meet, there is a dip to zero."""
    for mapping in (LINEAR, GLF):
        engine = thruster(mapping=mapping)
        if 0.01 not in {command, command + more}:
            assert thrust_force(engine, command + more) >= thrust_force(engine, command) - 1e-12


def test_a_propeller_s_wrench_by_hand():
    """Full thrust at 0.5 rad, about the base link's origin."""
    boat = hull(link_com=(0.0, 0.0, 0.0))
    wrench = thruster_wrench(thruster(), boat, moving(), 242.665874, 0.5)
    expected = (212.959339, 116.340217, 0, 22.2365711, -40.7037703, -494.903606)
    assert wrench == pytest.approx(expected, rel=6e-9)


def test_a_straight_propeller_has_no_side_force():
    wrench = thruster_wrench(thruster(), hull(), moving(), 100.0, 0.0)
    assert wrench[:3] == (100.0, 0.0, 0.0)


@given(
    mount=st.tuples(*[st.floats(-3, 3)] * 3),
    angle=st.floats(-1.5, 1.5),
    force=st.floats(-100, 250),
    attitude=st.tuples(*[st.floats(-3, 3)] * 3),
    across=st.booleans(),
)
def test_a_propeller_s_wrench_is_lever_times_force(mount, angle, force, attitude, across):
    direction = (0.0, 0.6, 0.8) if across else (1.0, 0.0, 0.0)
    engine = thruster(rotation=rotation(*mount), direction=direction)
    boat, body = hull(), moving(angles=attitude)
    spin = rotation(*mount) @ rotation(0.0, 0.0, angle)
    lever = engine["position"] + spin @ PROPELLER - boat["link_com"]
    push = force * spin @ direction
    wrench = thruster_wrench(engine, boat, body, force, angle)
    assert in_body_axes(body, wrench) == pytest.approx([*push, *np.cross(lever, push)], abs=1e-10)
    assert force_point(engine, angle) == pytest.approx(engine["position"] + spin @ PROPELLER)

    own = engine_wrench(engine, body, force, angle)  # the same force, about the engine's centre of mass
    from_com = body[3:12] @ np.kron(
        np.eye(3), (boat["link_com"] - engine["position"] - spin @ engine["body_com"])[:, None]
    )
    assert wrench == pytest.approx(shift(own, tuple(-from_com)), abs=1e-10)


def state(**values):
    row = np.zeros(1, THRUSTER_STATE)[0]
    for name, value in values.items():
        row[name] = value
    return row


def test_a_command_holds_until_it_expires():
    own = state(command=0.7, expires=4.0)
    assert [effective_command(own, t) for t in (3.0, 4.0, 4.001, 100.0)] == [0.7, 0.7, 0.0, 0.0]


@pytest.mark.parametrize(("angle", "target"), [(0.3, 0.3), (2.0, math.pi / 2), (-9.0, -math.pi / 2)])
def test_steering_stays_within_what_the_engine_may_turn(angle, target):
    assert steering_target(thruster(), angle) == target


def turned(target, dt, duration):
    """Times, angles and rates of an engine that starts at rest at 0."""
    angle, rate, rows = 0.0, 0.0, []
    for step in range(round(duration / dt)):
        angle, rate = servo_step(thruster(), angle, rate, target, dt)
        rows.append(((step + 1) * dt, angle, rate))
    return np.array(rows).T


@pytest.mark.parametrize("dt", [0.0005, 0.001, 0.005, 0.01, 0.02])
def test_the_servo_is_stable_at_any_step(dt):
    _, angle, rate = turned(1.2, dt, 2.0)
    assert angle[-1] == pytest.approx(1.2, abs=1e-6)
    assert angle.max() < 1.2 * 1.01
    assert abs(rate).max() <= 10.0 + 1e-9
    assert abs(rate[-1]) < 1e-5


def test_the_servo_s_path_hardly_depends_on_the_step():
    time, angle, _ = turned(1.2, 0.0002, 1.0)
    for dt in (0.001, 0.01):
        t, coarse, _ = turned(1.2, dt, 1.0)
        assert coarse == pytest.approx(np.interp(t, time, angle), abs=10.0 * dt)  # a step at full rate


def test_the_servo_settles_at_the_rate_of_stiffness_over_damping():
    time, angle, _ = turned(0.05, 0.0001, 0.6)
    late = time > 0.3
    slope = np.polyfit(time[late], np.log(0.05 - angle[late]), 1)[0]
    slow = (20 - math.sqrt(400 - 4 * 300 * 0.131210)) / (2 * 0.131210)  # of I s^2 + kd s + kp
    assert slope == pytest.approx(-slow, rel=0.01)


@given(angle=st.floats(-1.5, 1.5), rate=st.floats(-9, 9), target=st.floats(-1.5, 1.5))
def test_in_a_short_step_it_is_vrx_s_pid(angle, rate, target):
    torque = servo_torque(thruster(), angle, rate, target, 1e-9)
    assert torque == pytest.approx(np.clip(-300 * (angle - target) - 20 * rate, -10, 10), abs=1e-3)


@given(angle=st.floats(-3, 3), rate=st.floats(-20, 20), dt=st.floats(0.001, 0.02))
def test_the_servo_keeps_its_limits(angle, rate, dt):
    torque = servo_torque(thruster(), angle, rate, 0.0, dt)
    assert abs(torque) <= 10.0
    if abs(rate) >= 10.0:
        assert torque * rate <= 0.0


@pytest.mark.parametrize("target", [1.5, -1.5])
@pytest.mark.parametrize("dt", [0.001, 0.01, 0.05])
def test_a_strong_servo_turns_no_faster_than_its_velocity(target, dt):
    strong = thruster(effort=1e4, velocity=0.5, kp=3e3)
    angle = rate = fastest = 0.0
    for _ in range(round(4.0 / dt)):
        angle, rate = servo_step(strong, angle, rate, target, dt)
        fastest = max(fastest, abs(rate))
    assert fastest == pytest.approx(0.5)
    assert angle == pytest.approx(target, abs=0.02)
