"""The navigation channel, with scores by hand."""

import pytest

from unit.tasks.streams import begin, buoys, courses, frame, gate_names, look, task, through, track
from vrx_mj.errors import CommandError
from vrx_mj.tasks.gates import FAILURE, NavigationCourse
from vrx_mj.tasks.registry import make_referee

COURSES = courses()
GATES = [((x, -5), (x, 5)) for x in (10, 20, 30)]
"""Three gates, to be crossed toward the east."""
STANDS = buoys(GATES)


def channel(gates=GATES, **values):
    referee = make_referee(
        task("navigation_course", gates=gate_names(len(gates)), **{"obstacle_penalty": 10.0, **values})
    )
    begin(referee, **buoys(gates), boat=(500, 500))
    return referee


def sail(referee, *boats, start=1.0, gates=GATES):
    """One frame a second with the boat here and there; all lines."""
    poses = buoys(gates)
    return [line for second, boat in enumerate(boats) for line in look(referee, start + second, boat, **poses)]


def test_the_score_is_the_time_per_gate():
    referee = channel()
    lines = sail(referee, (5, 0), (15, 0), (25, 0), (35, 0))
    assert referee.finished
    assert not referee.status.timed_out
    assert referee.status.elapsed == pytest.approx(4.0)
    assert referee.status.score == pytest.approx(4.0 / 3)
    assert lines == ["gate 1 of 3 crossed, 2.0 s", "gate 2 of 3 crossed, 3.0 s", "gate 3 of 3 crossed, 4.0 s"]
    assert referee.progress == {"gates": ["crossed"] * 3}


@pytest.mark.parametrize("course", COURSES)
def test_a_course_sailed_with_red_to_starboard_is_finished_in_its_time(course):
    gates = COURSES[course]
    referee, poses = channel(gates), buoys(gates)
    legs = [point for gate in gates for point in through(gate)]
    for number, boat in enumerate(track(legs, 0.25), start=2):
        look(referee, number / 20, boat, **poses)
        if referee.finished:
            break
    assert referee.progress == {"gates": ["crossed"] * len(gates)}
    assert referee.status.score == pytest.approx(number / 20 / len(gates), rel=1e-12)


@pytest.mark.parametrize("course", COURSES)
def test_a_course_sailed_with_red_to_port_fails_at_its_first_gate(course):
    gates = COURSES[course]
    referee = channel(gates)
    lines = sail(referee, *reversed(through(gates[0])), gates=gates)
    assert (referee.finished, referee.status.score) == (True, FAILURE)
    assert lines == ["gate 1 crossed backwards: failed"]


def test_a_gate_crossed_backwards_fails_even_if_it_is_not_its_turn():
    referee = channel()
    assert sail(referee, (35, 0), (25, 0)) == ["gate 3 crossed backwards: failed"]
    assert (referee.finished, referee.status.timed_out, referee.status.score) == (True, False, 200.0)
    assert referee.progress == {"gates": ["ahead", "ahead", "backwards"]}


def test_a_gate_out_of_turn_fails():
    referee = channel()
    assert sail(referee, (5, 0), (15, 0), (15, 9), (25, 9), (25, 0), (35, 0)) == [
        "gate 1 of 3 crossed, 2.0 s",
        "gate 3 crossed before gate 2: failed",
    ]
    assert referee.status.score == 200.0
    assert referee.progress == {"gates": ["crossed", "missed", "crossed"]}


def test_back_through_a_gate_that_was_crossed_is_no_failure():
    referee = channel()
    sail(referee, (5, 0), (15, 0), (5, 0), (15, 0), (25, 0))
    assert not referee.finished
    assert referee.progress == {"gates": ["crossed", "crossed", "ahead"]}


def test_beside_a_gate_nothing_is_crossed():
    referee = channel()
    sail(referee, (5, 0), (5, 6), (15, 6), (15, 0), (15, 6), (5, 6), (5, 0))
    assert referee.progress == {"gates": ["ahead"] * 3}


def test_gates_move_with_their_buoys():
    referee = channel()
    for time, x in ((1.0, 10.0), (2.0, 4.0)):
        referee.look(frame(time, (5, 0), **{**STANDS, **buoys([((x, -5), (x, 5))])}))
    assert referee.progress["gates"][0] == "crossed"  # the gate went over the boat


def test_collisions_cost_seconds_also_those_before_the_run():
    referee = make_referee(task("navigation_course", gates=gate_names(3), obstacle_penalty=10.0, durations=[5, 5, 300]))
    referee.look(frame(4.0, touches={"red_0": 4.0}, **STANDS))
    assert referee.status.collisions == 1
    for time in (5.0, 10.0, 12.0):
        referee.look(frame(time, touches={"red_0": 4.0}, **STANDS))
    assert referee.status.score == pytest.approx((2.0 + 10.0) / 3)
    referee.look(frame(13.0, touches={"red_0": 4.0, "red_1": 13.0}, **STANDS))
    assert referee.status.score == pytest.approx((3.0 + 20.0) / 3)


def test_the_score_is_never_over_the_running_time_per_gate():
    referee = channel(obstacle_penalty=1000.0)
    referee.look(frame(5.0, touches={"red_0": 5.0}, **STANDS))
    assert referee.status.score == 100.0  # 300 / 3


def test_time_up_is_a_failure():
    referee = channel()
    sail(referee, (5, 0), (15, 0), (25, 0))
    assert sail(referee, (35, 0), start=300.0) == []
    assert (referee.finished, referee.status.timed_out, referee.status.score) == (True, True, 200.0)
    assert referee.status.remaining == 0.0


def test_a_gate_crossed_before_the_run_does_not_count():
    referee = make_referee(task("navigation_course", gates=gate_names(3), obstacle_penalty=10.0, durations=[0, 5, 300]))
    sail(referee, (5, 0), (15, 0))
    assert referee.progress == {"gates": ["ahead"] * 3}


def test_its_bodies_are_the_markers():
    rules = NavigationCourse(task("navigation_course", gates=gate_names(2), obstacle_penalty=10.0))
    assert rules.watched == ("red_0", "green_0", "red_1", "green_1")


def test_it_takes_no_message():
    with pytest.raises(CommandError) as error:
        channel().accept("gate", 1)
    assert str(error.value) == "the navigation course takes no message 'gate'; known: none"
    assert channel().outputs == {}
