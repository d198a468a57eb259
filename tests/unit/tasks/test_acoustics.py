"""Beacons to find and to follow, with scores by hand."""

import math

import pytest

from unit.tasks.streams import begin, frame, look, pose, task
from vrx_mj.errors import CommandError
from vrx_mj.tasks.perception import AcousticPerception, AcousticTracking
from vrx_mj.tasks.referee import Release, SetPinger


def perception(**values):
    pinger = {"x": -560.0, "y": 185.0, "z": -2.0, "latitude": None, "longitude": None}
    row = task("acoustic_perception", profile="vrx3", **({"pinger": pinger, "goal_tolerance": 3.0} | values))
    return AcousticPerception(row)


def tracking(**values):
    parameters = {"pinger": "pinger", "pinger_depth": 2.0, "obstacle_penalty": 1.0, "profile": "vrx3"}
    row = task("acoustic_tracking", **(parameters | values))
    return AcousticTracking(row)


# Perception


def test_the_score_is_the_time_to_the_beacon():
    referee = perception()
    begin(referee, boat=(-532, 162))
    for second in range(1, 21):
        assert look(referee, float(second), (-532, 162)) == []
        assert referee.status.score == second
    lines = look(referee, 25.5, (-560, 185))
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, False, 25.5)
    assert lines == ["wamv is 2.00 m from the beacon: found after 25.50 s"]


@pytest.mark.parametrize(
    ("place", "found"),
    [
        ((0.0, math.sqrt(5.0) - 0.001, 0.0), True),  # 3 m in space is 2.24 m over a beacon 2 m deep
        ((0.0, math.sqrt(5.0) + 0.001, 0.0), False),
        ((2.0, 0.0, 0.2), True),
        ((2.0, 0.0, 0.3), False),  # 2.3 m above and 2 m aside
        ((3.0, 0.0, -2.0), True),  # the tolerance itself
    ],
)
def test_the_distance_is_taken_in_space(place, found):
    referee = perception()
    begin(referee, boat=(-532, 162))
    look(referee, 1.0, pose(-560.0 + place[0], 185.0 + place[1], z=place[2]))
    assert referee.is_over is found


def test_a_boat_that_is_early_ends_the_task_at_0():
    referee = perception(durations=[10.0, 10.0, 300.0])
    referee.look(frame(0.0, (-532, 162)))
    referee.look(frame(10.0, (-532, 162)))
    referee.look(frame(15.0, (-560, 185)))
    assert (referee.is_over, referee.status.score, referee.status.elapsed) == (True, 0.0, 0.0)


def test_a_run_in_vain_has_the_full_time_and_hits_cost_nothing():
    referee = perception(durations=[0.0, 0.0, 30.0])
    begin(referee, boat=(-532, 162))
    for second in range(1, 31):
        referee.look(frame(float(second), (-532, 162), {"buoy": float(second)}))
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, True, 30.0)
    assert referee.status.collisions > 0


def test_the_beacon_is_put_to_its_place_once():
    referee = perception(durations=[1.0, 1.0, 30.0])
    actions = [action for time in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5) for action in referee.look(frame(time)).actions]
    assert actions == [SetPinger("wamv", (-560.0, 185.0, -2.0)), Release("wamv")]
    assert referee.outputs == {}


# Tracking


def test_the_score_is_the_mean_horizontal_distance():
    referee = tracking()
    begin(referee, boat=(0, 0), pinger=(3, 4))  # one frame that counts: 5 m
    look(referee, 0.1, (0, 0), pinger=(6, 8))
    look(referee, 0.15, pose(0, 0, z=0.5), pinger=pose(3, 0, z=-7))
    assert referee.status.score == pytest.approx((5 + 10 + 3) / 3)
    assert referee.outputs == {"pose_error": 3.0, "mean_pose_error": pytest.approx(6.0)}


def test_hits_cost_at_time_out_only_also_those_before_the_run():
    referee = tracking(durations=[5.0, 5.0, 20.0], obstacle_penalty=1.5)
    times = [0.0, 4.0, 5.0, 8.0, 10.0, 15.0, 20.0, 29.0, 30.0]
    hits = {4.0: 4.0, 8.0: 6.9, 20.0: 18.0}  # at 4 s; within 3 s of that one; at 18 s
    for time in times:
        referee.look(frame(time, (0, 0), {"buoy": hits[time]} if time in hits else {}, pinger=(3, 4)))
        if not referee.is_over:
            assert referee.status.score == (5.0 if time >= 10.0 else 0.0)
    assert (referee.status.timed_out, referee.status.collisions) == (True, 2)
    assert referee.status.score == 5.0 + 2 * 1.5
    assert referee.outputs == {"pose_error": 5.0, "mean_pose_error": 5.0}


def test_a_boat_right_over_the_beacon_scores_0():
    referee = tracking(durations=[0.0, 0.0, 2.0])
    begin(referee, boat=(3, 4), pinger=(3, 4))
    look(referee, 2.0, (3, 4), pinger=(3, 4))
    assert (referee.is_over, referee.status.score) == (True, 0.0)


def test_the_beacon_is_told_ten_times_a_second_2_m_above_the_water_while_it_runs():
    referee = tracking(durations=[1.0, 1.0, 300.0])
    told = []
    for step in range(20 * 4):
        verdict = referee.look(frame(step / 20, pinger=pose(step / 10, 7.0, z=-0.3)))
        told += [(step, action) for action in verdict.actions if isinstance(action, SetPinger)]
    assert told == [(step, SetPinger("wamv", (step / 10, 7.0, 2.0))) for step in range(40, 80, 2)]


def test_nothing_counts_before_it_runs():
    referee = tracking(durations=[1.0, 1.0, 300.0])
    for time in (0.0, 1.0, 1.9):
        referee.look(frame(time, pinger=(50, 0)))
        assert referee.outputs == {}
    look(referee, 2.0, pinger=(5, 0))
    assert referee.status.score == 5.0


# Both


@pytest.mark.parametrize("make", [perception, tracking])
def test_no_message_is_taken(make):
    referee = make()
    with pytest.raises(CommandError) as caught:
        referee.accept("goal", 1)
    name = referee.type.replace("_", " ")
    assert str(caught.value) == f"{name} takes no message 'goal'; known: none"


@pytest.mark.parametrize("make", [perception, tracking])
def test_another_boat_changes_nothing(make):
    alone, together = make(), make()
    for step in range(100):
        poses = {"pinger": (step / 10, 7.0)}
        verdict = alone.look(frame(step / 20, (-532 - step, 162), **poses))
        assert verdict == together.look(frame(step / 20, (-532 - step, 162), wamv2=(-560, 185), **poses))
    assert alone.dump() == together.dump()
