"""Wayfinding, with errors by hand."""

import math

import pytest

from unit.tasks.streams import begin, frame, look, task
from vrx_mj.errors import CommandError
from vrx_mj.tasks import make_referee


def place(x, y, yaw=0.0):
    return {"x": x, "y": y, "yaw": yaw, "latitude": None, "longitude": None}


POINTS = [place(0, 0), place(10, 0), place(10, 10, 1.0)]


def finding(points=POINTS, **values):
    return make_referee(task("wayfinding", waypoints=points, **values))


def test_the_score_is_the_mean_of_the_least_errors():
    referee = finding()
    begin(referee, boat=(3, 0))
    assert referee.outputs["min_errors"] == pytest.approx([3.0, 7.0, math.hypot(7, 10) + 0.75 ** math.hypot(7, 10)])
    for time, boat in ((1.0, (1, 0)), (2.0, (10, 0)), (3.0, (10, 10, 1.0)), (4.0, (500, 500))):
        referee.look(frame(time, boat))
    assert referee.outputs["min_errors"] == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
    assert referee.status.score == pytest.approx(1 / 3)
    assert referee.outputs["mean_error"] == referee.status.score
    assert referee.progress == {"waypoints": referee.outputs["min_errors"]}


def test_the_order_is_free_and_the_run_lasts_until_time_is_up():
    referee = finding()
    begin(referee, boat=(99, 99))
    for time, boat in ((1.0, (10, 10, 1.0)), (2.0, (0, 0)), (3.0, (10, 0))):
        referee.look(frame(time, boat))
    assert not referee.is_over
    assert referee.status.score == pytest.approx(0.0, abs=1e-12)
    assert look(referee, 300.0, (0, 0)) == [f"waypoint {k} of 3: smallest error 0.00 m" for k in (1, 2, 3)]
    assert (referee.is_over, referee.status.timed_out) == (True, True)


def test_the_score_never_rises():
    referee, scores = finding(), []
    begin(referee, boat=(-5, 0))
    for k in range(2, 200):
        referee.look(frame(k / 20, (10 * math.cos(k / 9), 10 * math.sin(k / 7), k / 5)))
        scores.append(referee.status.score)
    assert scores == sorted(scores, reverse=True)


def test_headings_more_than_a_turn_apart_lower_the_error_as_in_vrx():
    referee = finding([place(0, 0, -3.47)])
    begin(referee, boat=(0, 0, 3.0))
    assert referee.status.score == pytest.approx(2 * math.pi - 6.47)
    assert referee.status.score < 0


def test_waypoints_are_told_from_ready_on():
    referee = finding(durations=[1, 1, 300])
    referee.look(frame(0.0))
    assert referee.outputs == {}
    referee.look(frame(1.0))
    assert referee.outputs == {"waypoints": POINTS}


def test_it_takes_no_message():
    with pytest.raises(CommandError) as error:
        finding().accept("goal", 1)
    assert str(error.value) == "wayfinding takes no message 'goal'; known: none"
