"""Forces that callers apply for a while."""

import math

import numpy as np
import pytest

import vrx_mj
from vrx_mj.errors import CommandError
from vrx_mj.runtime.applied import MAX_ACCELERATION, MAX_FORCES, MAX_SPEED, AppliedForce, AppliedForces

FLEET = {"usv_count": 2, "layout": "line", "spacing": 20.0, "origin": "spawn", "sensors": "none"}


@pytest.fixture(scope="module")
def world():
    return vrx_mj.compile_world("example_course", fleet=FLEET)


class Pushed:
    """A simulation, what is applied to it, and what that reported."""

    def __init__(self, world):
        self.sim, self.told = vrx_mj.Simulation(world), []
        self.forces = AppliedForces(self.sim, lambda _level, text: self.told.append(text))

    def push(self, values, begins=0.0, seconds=1.0, boat="wamv1"):
        wrench = np.array(values, np.float64)
        self.forces.add(AppliedForce(boat, f"{boat}/base_link", "", wrench, begins, begins + seconds))

    @property
    def bits(self):
        return self.sim.get_state().sha256


def test_a_wrench_is_what_the_physics_has_of_the_same_by_engines(world):
    """Beside a run in which engines push, one is pushed by what the loop gave MuJoCo of them."""
    driven, still, pushed = Pushed(world), Pushed(world), Pushed(world)
    body = driven.sim.model.body("wamv1/base_link").id
    for each in (driven, still, pushed):
        each.sim.advance(50)
    driven.sim.command("wamv1", left=0.8, right=0.3)
    driven.sim.advance(1)
    still.sim.advance(1)
    wrench = driven.sim.data.xfrc_applied[body] - still.sim.data.xfrc_applied[body]
    pushed.push(wrench, begins=0.5, seconds=0.01)
    pushed.forces.advance(1)
    assert np.linalg.norm(wrench[:3]) > 200.0
    np.testing.assert_allclose(pushed.sim.data.qvel, driven.sim.data.qvel, rtol=0.0, atol=1e-12)


def test_a_wrench_acts_on_the_steps_of_its_duration_and_leaves_nothing(world):
    pushed, still = Pushed(world), Pushed(world)
    pushed.push((200.0, 0.0, 0.0, 0.0, 0.0, 0.0), begins=0.05, seconds=0.1)
    moved = []
    for _ in range(20):
        pushed.forces.advance(1)
        still.sim.advance(1)
        moved.append(not np.array_equal(pushed.sim.data.qvel, still.sim.data.qvel))
        assert not pushed.sim.data.qfrc_applied.any()
    assert moved.index(True) == 5
    again = Pushed(world)
    again.push((200.0, 0.0, 0.0, 0.0, 0.0, 0.0), begins=0.05, seconds=0.1)
    again.forces.advance(20)
    assert again.bits == pushed.bits


def test_who_applies_nothing_has_the_same_run_to_the_bit(world):
    pushed, still = Pushed(world), Pushed(world)
    pushed.push(np.zeros(6), seconds=0.2)
    pushed.forces.advance(40)
    still.sim.advance(40)
    assert pushed.bits == still.bits


def test_a_force_of_no_end_acts_until_it_is_cleared(world):
    pushed = Pushed(world)
    pushed.push((0.0, 0.0, 0.0, 0.0, 0.0, 300.0), seconds=math.inf)
    pushed.forces.advance(300)
    turning = pushed.sim.observe()["wamv1"].angular_velocity[2]
    pushed.forces.clear(body="wamv1/base_link")
    pushed.forces.advance(300)
    assert abs(pushed.sim.observe()["wamv1"].angular_velocity[2]) < 0.5 * abs(turning)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((math.nan, 0, 0, 0, 0, 0), "invalid force on wamv1: finite numbers are needed"),
        ((0, 0, 0, 0, math.inf, 0), "invalid force on wamv1: finite numbers are needed"),
        (
            (1e300, 0, 0, 0, 0, 0),
            r"the force would accelerate wamv1 by \S+: at most 100 m/s\^2 or rad/s\^2 are allowed",
        ),
        (
            (0, 0, 0, 1e308, 1e308, 1e308),
            r"the force would accelerate wamv1 by \S+: at most 100 m/s\^2 or rad/s\^2 are allowed",
        ),
    ],
)
def test_a_force_that_would_end_the_run_is_refused(world, values, message):
    pushed = Pushed(world)
    with pytest.raises(CommandError, match=f"^{message}$"):
        pushed.push(values)
    pushed.forces.advance(1)


def test_what_cannot_move_is_told_and_too_many_are_refused(world):
    pushed = Pushed(world)
    with pytest.raises(CommandError, match=r"^antenna cannot move$"):
        pushed.forces.add(AppliedForce("antenna", "antenna/link", "", np.ones(6), 0.0, 1.0))
    for _ in range(MAX_FORCES):
        pushed.push((1.0, 0, 0, 0, 0, 0))
    with pytest.raises(CommandError, match=rf"^{MAX_FORCES} forces are already applied$"):
        pushed.push((1.0, 0, 0, 0, 0, 0))


def test_a_force_on_a_boat_that_is_removed_ends(world):
    pushed = Pushed(world)
    for _ in range(2):
        pushed.push((50.0, 0, 0, 0, 0, 0), seconds=math.inf, boat="wamv2")
    pushed.forces.advance(5)
    pushed.sim.remove("wamv2")
    pushed.forces.bind()
    pushed.forces.advance(5)
    assert pushed.told == 2 * ["the force on wamv2 ends: it left"]


def test_many_forces_are_together_no_stronger_than_one_may_be(world):
    pushed = Pushed(world)
    for boat in ("wamv1", "wamv2"):
        for sign in (1.0, -1.0):
            pushed.push((sign * 10_000.0, 0, 0, 0, 0, 0), begins=2.0 + sign, boat=boat)
    with pytest.raises(CommandError, match=r"^the force would accelerate wamv1 by "):
        pushed.push((10_000.0, 0, 0, 0, 0, 0))


@pytest.mark.parametrize("axis", range(6))
def test_the_strongest_force_that_is_taken_ends_no_run(world, axis):
    pushed, values = Pushed(world), np.zeros(6)
    body = pushed.sim.model.body("wamv1/base_link").id
    scale = pushed.sim.model.body_subtreemass[body] if axis < 3 else pushed.sim.model.body_inertia[body].min()
    for sign in (1.0, -1.0):
        values[axis] = sign * 0.9 * MAX_ACCELERATION * scale
        pushed.push(values, seconds=math.inf)
        pushed.forces.advance(500)
        assert pushed.told.pop() == f"the force on wamv1 ends: it is faster than {MAX_SPEED:g} m/s or rad/s"
        pushed.sim.set_boat("wamv1", velocity=(0,) * 6)
