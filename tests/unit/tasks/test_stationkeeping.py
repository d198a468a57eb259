"""Station-keeping, with errors by hand."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.tasks.streams import begin, frame, pose, task
from vrx_mj.errors import CommandError
from vrx_mj.model.tasks import Goal
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.courses import pose_error

ORIGIN = {"x": 0.0, "y": 0.0, "yaw": 0.0, "latitude": None, "longitude": None}


def goal(**values):
    return Goal(**ORIGIN | values)


def station(heading=True, **values):
    return make_referee(task("stationkeeping", goal=ORIGIN | values, heading=heading))


@pytest.mark.parametrize(
    ("boat", "yaw", "error"),
    [
        ((0, 0, 0), 0.0, 0.0),
        ((3, 4, 0), 0.0, 5.0),
        ((0, 0, 0), 0.5, 0.5),
        ((0, 0, -0.5), 0.5, 1.0),
        ((0, 0, 3.0), -3.0, 2 * math.pi - 6.0),  # the short way round
        ((0, 0, 0), math.pi, math.pi),
        ((2, 0, 0), 1.0, 2.5625),  # 2 + 0.75^2
        ((0, 0, 0), 5.5, 2 * math.pi - 5.5),  # a goal beyond pi, as in wayfinding worlds
        ((0, 0, 3.0), -3.47, 6.47 * -1 + 2 * math.pi),  # more than a full turn apart: negative
        ((1, 0, 0), 7.0, 1 + 0.75 * (2 * math.pi - 7.0)),
        ((0, 0, 0), 2 * math.pi, 0.0),
    ],
)
def test_errors_by_hand(boat, yaw, error):
    assert pose_error(pose(*boat), goal(yaw=yaw)) == pytest.approx(error, abs=1e-12)


def test_without_heading_the_error_is_the_distance():
    assert pose_error(pose(3, 4, 2), goal(yaw=-1.0), heading=False) == 5.0


@given(*[st.floats(-3, 3)] * 2, *[st.floats(-100, 100)] * 2)
def test_headings_within_pi_count_by_their_angle(yaw, goal_yaw, x, y):
    angle = math.acos(max(-1.0, min(1.0, math.cos(yaw - goal_yaw))))
    expected = math.hypot(x, y) + 0.75 ** math.hypot(x, y) * angle
    assert pose_error(pose(x, y, yaw), goal(yaw=goal_yaw)) == pytest.approx(expected, abs=1e-7)  # acos near 1


def test_roll_pitch_and_height_do_not_count():
    yaw, roll = 0.7, 0.4
    half = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(roll / 2), math.sin(roll / 2)
    rolled = pose(1, 2, z=9.0)
    rolled = type(rolled)(1, 2, 9.0, (half[0] * half[2], half[0] * half[3], half[1] * half[3], half[1] * half[2]))
    assert rolled.yaw == pytest.approx(yaw)
    assert pose_error(rolled, goal()) == pytest.approx(pose_error(pose(1, 2, yaw), goal()))


def test_the_score_is_the_mean_since_the_run_began():
    referee = station()
    begin(referee, boat=(4, 0))  # the frame at which it begins to run counts
    referee.look(frame(0.10, (1, 0)))
    assert referee.status.score == 2.5
    referee.look(frame(0.15, (1, 0)))
    assert referee.status.score == 2.0
    assert referee.outputs == {"goal": ORIGIN, "pose_error": 1.0, "mean_pose_error": 2.0}


def test_what_is_before_the_run_does_not_count():
    referee = make_referee(task("stationkeeping", goal=ORIGIN, heading=True, durations=[1, 1, 300]))
    assert referee.outputs == {}
    referee.look(frame(0.0, (50, 0)))
    assert referee.outputs == {}
    referee.look(frame(1.0, (50, 0)))
    assert referee.outputs == {"goal": ORIGIN}
    referee.look(frame(2.0, (3, 0)))
    assert referee.outputs == {"goal": ORIGIN, "pose_error": 3.0, "mean_pose_error": 3.0}
    assert referee.status.score == 3.0


def test_the_mean_stays_when_time_is_up_and_collisions_cost_nothing():
    referee = station()
    begin(referee, boat=(3, 0))
    referee.look(frame(150.0, (3, 0), touches={"pier": 150.0}))
    referee.look(frame(300.0, (500, 0), touches={"pier": 150.0}))
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, True, 3.0)
    assert referee.status.collisions == 1


def test_it_takes_no_message():
    with pytest.raises(CommandError) as error:
        station().accept("landmark", {})
    assert str(error.value) == "station-keeping takes no message 'landmark'; known: none"
