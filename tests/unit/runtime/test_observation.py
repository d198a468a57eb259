"""What is seen of a boat: its angles and its speed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrx_mj.frames import quaternion, rotation
from vrx_mj.runtime.observation import BoatObservation, Observation

ANGLE = st.floats(-3.1, 3.1)


def seen(roll=0.0, pitch=0.0, yaw=0.0, velocity=(0.0, 0.0, 0.0)):
    turn = np.array(quaternion(roll, pitch, yaw))
    return BoatObservation(np.zeros(3), turn, np.array(velocity), np.zeros(3))


@given(ANGLE, st.floats(-1.5, 1.5), ANGLE)
def test_angles_are_those_that_the_orientation_is_made_of(roll, pitch, yaw):
    boat = seen(roll, pitch, yaw)
    assert (boat.roll, boat.pitch, boat.heading) == pytest.approx((roll, pitch, yaw), abs=1e-6)


@given(ANGLE, st.floats(-1.5, 1.5), ANGLE, st.tuples(*[st.floats(-5, 5)] * 3))
def test_the_speed_is_over_ground_however_the_boat_leans(roll, pitch, yaw, velocity):
    vx, vy, _ = np.array(rotation(roll, pitch, yaw)) @ velocity
    boat = seen(roll, pitch, yaw, velocity)
    assert boat.speed == pytest.approx(math.hypot(vx, vy), abs=1e-9)
    along = [boat.speed * turn(boat.course) for turn in (math.cos, math.sin)]
    assert along == pytest.approx([vx, vy], abs=1e-9)


def test_heave_is_no_speed():
    assert seen(velocity=(0.0, 0.0, 2.0)).speed == 0.0
    assert seen(pitch=math.pi / 2 - 1e-9, velocity=(2.0, 0.0, 0.0)).speed == pytest.approx(0.0, abs=1e-6)


def test_the_task_is_no_boat_but_can_be_looked_up():
    obs = Observation([("a", seen())], {"state": "ready"})
    assert list(obs) == ["a"]
    assert "task" in obs
    assert obs["task"]["state"] == "ready"
    without = Observation([("a", seen())])
    assert "task" not in without
    assert without.get("task") is None
