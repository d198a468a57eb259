import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.control.velocity import Allocation

AHEAD, REVERSE = 250.0, 100.0


@dataclass
class Engine:
    """A thruster whose command is its force."""

    position: tuple[float, float, float]
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    max_angle: float = math.pi / 2
    max_forward: float = AHEAD
    max_reverse: float = -REVERSE

    def command(self, force):
        return force


SIN = math.sin(math.pi / 4)
LAYOUTS = {
    "H": {"left": Engine((-2.65, 1.03, 0)), "right": Engine((-2.65, -1.03, 0))},
    "T": {
        "left": Engine((-2.65, 1.03, 0)),
        "right": Engine((-2.65, -1.03, 0)),
        "lateral": Engine((0, -0.28, 0), (0, 1, 0)),
    },
    "X": {
        "left_rear": Engine((-2.57, 0.83, 0), (SIN, SIN, 0)),
        "right_rear": Engine((-2.57, -0.83, 0), (SIN, -SIN, 0)),
        "left_front": Engine((1.40, 0.90, 0), (SIN, -SIN, 0)),
        "right_front": Engine((1.40, -0.90, 0), (SIN, SIN, 0)),
    },
}


def summed(engines, commands):
    """Second implementation: the forces of the commands, one by one."""
    surge = sway = yaw = 0.0
    for name, engine in engines.items():
        angle = math.atan2(engine.direction[1], engine.direction[0]) + commands.get(f"{name}_angle", 0.0)
        x, y, _ = engine.position
        ahead, left = commands[name] * math.cos(angle), commands[name] * math.sin(angle)
        surge, sway, yaw = surge + ahead, sway + left, yaw + x * left - y * ahead
    return surge, sway, yaw


wanted = st.tuples(st.floats(-60, 120), st.floats(-25, 25), st.floats(-60, 60))


@pytest.mark.parametrize("layout", LAYOUTS)
@given(force=wanted)
def test_the_forces_add_up_to_what_is_wanted(layout, force):
    engines = LAYOUTS[layout]
    thrust = Allocation(engines)(*force)
    # a thruster that shall push less than 2 N across does not turn for it
    assert summed(engines, thrust.commands) == pytest.approx(force, abs=12.0 if layout == "H" else 1e-9)
    assert (thrust.surge, thrust.sway, thrust.yaw) == pytest.approx(force, abs=1e-9)


@pytest.mark.parametrize("layout", LAYOUTS)
@given(force=st.tuples(*[st.floats(-3000, 3000)] * 3))
def test_no_thruster_gives_more_than_it_can(layout, force):
    engines = LAYOUTS[layout]
    commands = Allocation(engines)(*force).commands
    for name in engines:
        assert -REVERSE - 1e-6 <= commands[name] <= AHEAD + 1e-6
        assert abs(commands.get(f"{name}_angle", 0.0)) <= math.pi / 2 + 1e-9


@pytest.mark.parametrize("layout", LAYOUTS)
def test_too_much_force_leaves_the_moment_alone(layout):
    thrust = Allocation(LAYOUTS[layout])(5000.0, 0.0, 80.0)
    assert thrust.yaw == pytest.approx(80.0, abs=1e-6)
    assert 0.0 < thrust.surge < 5000.0


def test_too_much_force_keeps_its_direction():
    thrust = Allocation(LAYOUTS["T"])(2000.0, 1000.0, 0.0)
    assert thrust.sway / thrust.surge == pytest.approx(0.5, rel=1e-6)
    assert thrust.surge == pytest.approx(2 * AHEAD, rel=1e-3)  # shares are found to 1/4096 of 2000 N


def test_a_moment_comes_from_the_arms_of_two_engines():
    thrust = Allocation(LAYOUTS["T"])(0.0, 0.0, 100.0)
    half = 100.0 / (2 * 1.03)
    assert thrust.commands == pytest.approx({"left": -half, "right": half, "lateral": 0.0})


def test_a_boat_without_a_lateral_thruster_steers_and_others_do_not():
    assert "left_angle" in Allocation(LAYOUTS["H"])(0.0, 50.0, 0.0).commands
    assert "left_angle" not in Allocation(LAYOUTS["T"])(0.0, 50.0, 0.0).commands
    assert not [name for name in Allocation(LAYOUTS["X"])(0.0, 50.0, 0.0).commands if name.endswith("_angle")]


def test_fixed_engines_at_the_stern_do_not_push_every_way():
    fixed = {name: Engine(engine.position, max_angle=0.0) for name, engine in LAYOUTS["H"].items()}
    assert not Allocation(fixed).every_way
    assert Allocation(LAYOUTS["H"]).every_way
    thrust = Allocation(fixed)(100.0, 0.0, 30.0)
    assert (thrust.surge, thrust.yaw) == pytest.approx((100.0, 30.0))


def test_what_is_told_to_steer_does():
    thrust = Allocation(LAYOUTS["T"], steer=["lateral"])(60.0, 80.0, 0.0)
    assert set(thrust.commands) == {"left", "right", "lateral", "lateral_angle"}
    assert np.hypot(thrust.surge, thrust.sway) == pytest.approx(100.0)


def test_a_push_through_the_centre_does_not_turn():
    thrust = Allocation(LAYOUTS["T"], centre=-0.3)(0.0, 50.0, 0.0)
    _, sway, yaw = summed(LAYOUTS["T"], thrust.commands)
    assert (sway, yaw) == pytest.approx((50.0, -0.3 * 50.0))


def test_too_much_push_through_the_centre_does_not_turn_either():
    thrust = Allocation(LAYOUTS["T"], centre=-0.3)(0.0, 5000.0, 0.0)
    _, sway, yaw = summed(LAYOUTS["T"], thrust.commands)
    assert yaw == pytest.approx(-0.3 * sway)
