"""Gymkhana, with scores by hand."""

import pytest

from unit.tasks.streams import begin, buoys, frame, gate_names, look, task
from vrx_mj.errors import CommandError
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.referee import Release, SetPinger

GATES = [((x, -5), (x, 5)) for x in (10, 20)]
STANDS = buoys(GATES)
PINGER = {"x": 30.0, "y": 0.0, "z": -1.0, "latitude": None, "longitude": None}


def gymkhana(**values):
    channel = {"gates": gate_names(2), "obstacle_penalty": 10.0, "collision_buffer": 10.0}
    referee = make_referee(
        task("gymkhana", **{"channel": channel, "pinger": PINGER, "obstacle_penalty": 1.0, **values})
    )
    begin(referee, **STANDS)  # 30 m from the beacon
    return referee


def sail(referee, *boats, start=1.0, **values):
    """One frame a second with the boat here and there; the score after each."""
    scores = []
    for second, boat in enumerate(boats):
        look(referee, start + second, boat, **STANDS, **values)
        scores.append(referee.status.score)
    return scores


def test_the_score_is_200_until_the_channel_is_finished_and_then_the_mean_distance_since_the_start():
    referee = gymkhana()
    assert sail(referee, (5, 0), (15, 0), (25, 0), (30, 0)) == [
        200.0,
        200.0,
        pytest.approx((30 + 25 + 15 + 5) / 4),
        pytest.approx((30 + 25 + 15 + 5 + 0) / 5),
    ]
    assert referee.outputs["mean_pose_error"] == referee.status.score
    assert referee.outputs["channel"]["score"] == pytest.approx(3.0 / 2)
    assert referee.progress == {"gates": ["crossed", "crossed"]}


def test_lines_of_the_channel_are_told():
    referee = gymkhana()
    poses = [frame(time, (x, 0), **STANDS) for time, x in ((1.0, 5), (2.0, 15), (3.0, 25))]
    lines = [text for each in poses for text, _ in referee.look(each).lines]
    assert lines == [
        "gate 1 of 2 crossed, 2.0 s",
        "gate 2 of 2 crossed, 3.0 s",
        "gymkhana_channel: finished after 3.0 s, score 1.500, collisions 0",
    ]


def test_the_heading_does_not_count():
    referee = gymkhana()
    sail(referee, (5, 0, 1), (15, 0, 2), (25, 0, 3))
    assert referee.status.score == (30 + 25 + 15 + 5) / 4


def test_a_failed_channel_fails_all():
    referee = gymkhana()
    assert sail(referee, (0, 9), (15, 9), (15, 0), (5, 0)) == [200.0] * 4
    assert (referee.is_over, referee.status.timed_out) == (True, False)
    assert referee.progress == {"gates": ["backwards", "ahead"]}


def test_a_channel_out_of_time_fails_all_without_penalties():
    referee = gymkhana()
    sail(referee, (5, 0), (15, 0), start=200.0, touches={"red_0": 200.0})
    sail(referee, (15, 0), start=300.0)
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, True, 200.0)
    assert referee.outputs["channel"]["timed_out"]
    assert referee.outputs["channel"]["score"] == 200.0


def test_penalties_are_added_only_when_time_is_up():
    referee = gymkhana()
    sail(referee, (5, 0), (15, 0), (25, 0))
    referee.look(frame(100.0, (30, 0), touches={"buoy": 100.0}, **STANDS))
    assert referee.status.score == (30 + 25 + 15 + 5 + 0) / 5
    referee.look(frame(200.0, (30, 0), touches={"buoy": 200.0}, **STANDS))
    assert referee.status.score == 75 / 6
    referee.look(frame(300.0, (500, 0), touches={"buoy": 200.0}, **STANDS))
    assert (referee.is_over, referee.status.timed_out) == (True, True)
    assert referee.status.score == 75 / 6 + 2 * 1.0


def test_the_channel_counts_with_its_own_buffer_and_penalty():
    referee = gymkhana()
    for time in (12.0, 16.0, 20.0):  # over 3 s apart, but not 10 s
        referee.look(frame(time, (5, 0), touches={"red_0": time}, **STANDS))
    assert referee.status.collisions == 3
    assert referee.outputs["channel"]["num_collisions"] == 1
    referee.look(frame(30.0, (5, 0), touches={"red_0": 20.0}, **STANDS))
    assert referee.outputs["channel"]["score"] == (30.0 + 10.0) / 2


def test_hits_after_the_channel_are_not_the_channels():
    referee = gymkhana()
    sail(referee, (5, 0), (15, 0), (25, 0))
    referee.look(frame(100.0, (30, 0), touches={"buoy": 100.0}, **STANDS))
    assert (referee.status.collisions, referee.outputs["channel"]["num_collisions"]) == (1, 0)


def test_in_vrx3_the_channel_is_the_path_with_points_and_cannot_fail():
    referee = gymkhana(profile="vrx3")
    scores = sail(referee, (5, 0), (15, 0), (15, 9), (25, 9), (25, 0), (15, 0))
    assert scores[:5] == [200.0] * 5
    assert scores[5] < 30.0  # the last gate, even backwards
    assert referee.outputs["channel"]["score"] == 10.0
    assert referee.status.phase == "running"


def test_in_vrx3_a_channel_out_of_time_costs_penalties_too():
    referee = gymkhana(profile="vrx3")
    sail(referee, (5, 0), (6, 0), start=200.0, touches={"red_0": 200.0})
    sail(referee, (15, 0), start=300.0)
    assert referee.status.score == 201.0


def test_the_beacon_is_set_and_told_at_ready():
    values = {"channel": {"gates": gate_names(2), "obstacle_penalty": 10.0, "collision_buffer": 10.0}}
    referee = make_referee(task("gymkhana", **values, pinger=PINGER, obstacle_penalty=1.0, durations=[1, 1, 300]))
    assert list(referee.outputs) == ["channel"]
    assert referee.look(frame(0.0, **STANDS)).actions == ()
    assert referee.look(frame(1.0, **STANDS)).actions == (Release("wamv"), SetPinger("wamv", (30.0, 0.0, -1.0)))
    assert referee.outputs["goal"] == PINGER
    assert "mean_pose_error" not in referee.outputs
    assert referee.watched == ("wamv", "red_0", "green_0", "red_1", "green_1")


def test_it_takes_no_message():
    with pytest.raises(CommandError) as error:
        gymkhana().accept("goal", 1)
    assert str(error.value) == "the gymkhana takes no message 'goal'; known: none"
