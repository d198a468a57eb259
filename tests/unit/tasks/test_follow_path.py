"""Follow the path, with points by hand."""

import pytest

from unit.tasks.streams import begin, buoys, courses, frame, gate_names, look, task, through, track
from vrx_mj.errors import CommandError
from vrx_mj.tasks.registry import make_referee

COURSES = courses()
GATES = [((x, -5), (x, 5)) for x in (10, 20, 30, 40)]
"""Four gates, to be crossed toward the east."""
STANDS = buoys(GATES)


def path(gates=GATES, **values):
    points = {"points_per_gate_crossed": 10.0, "bonus": 1.0, "obstacle_penalty": 3.0, "profile": "vrx3"}
    referee = make_referee(task("follow_path", gates=gate_names(len(gates)), **{**points, **values}))
    begin(referee, **buoys(gates), boat=(500, 500))
    return referee


def sail(referee, *boats, start=1.0):
    """One frame a second with the boat here and there; all lines."""
    return [line for second, boat in enumerate(boats) for line in look(referee, start + second, boat, **STANDS)]


@pytest.mark.parametrize("course", COURSES)
def test_a_perfect_run_gives_eleven_points_a_gate(course):
    gates = COURSES[course]
    referee, poses = path(gates), buoys(gates)
    legs = [point for gate in gates for point in through(gate)]
    for number, boat in enumerate(track(legs, 0.25), start=2):
        look(referee, number / 20, boat, **poses)
    assert referee.finished
    assert referee.status.score == 11.0 * len(gates)


def test_points_come_gate_by_gate():
    referee = path()
    assert sail(referee, (5, 0), (15, 0), (25, 0), (35, 0), (45, 0)) == [
        "gate 1 of 4 crossed, 2.0 s: 10 points",
        "gate 2 of 4 crossed, 3.0 s: 21 points",
        "gate 3 of 4 crossed, 4.0 s: 32 points",
        "gate 4 of 4 crossed, 5.0 s: 44 points",
    ]
    assert (referee.finished, referee.status.timed_out) == (True, False)


def test_a_gate_left_out_costs_its_points_and_the_bonus_of_the_next():
    referee = path()
    sail(referee, (5, 0), (15, 0), (15, 9), (25, 9), (25, 0), (35, 0), (45, 0))
    assert referee.status.score == 10 + 10 + 11 + 1
    assert referee.progress == {"gates": ["crossed", "missed", "crossed", "crossed"]}


def test_a_gate_left_out_cannot_be_made_up_for():
    referee = path()
    sail(referee, (5, 0), (15, 0), (15, 9), (25, 9), (25, 0), (35, 0), (35, 9), (15, 9), (15, 0), (25, 0))
    assert referee.status.score == 20
    assert not referee.finished


def test_before_the_first_gate_none_counts():
    referee = path()
    sail(referee, (15, 0), (25, 0), (15, 0), (35, 0))
    assert referee.status.score == 0
    assert referee.progress == {"gates": ["ahead"] * 4}


def test_the_first_gate_may_be_crossed_backwards():
    referee = path()
    sail(referee, (15, 0), (5, 0), (15, 0))
    assert referee.status.score == 10


def test_a_gate_crossed_backwards_is_lost_and_breaks_the_row():
    referee = path()
    boats = [(5, 0), (15, 0), (15, 9), (25, 9), (25, 0), (15, 0), (25, 0), (35, 0)]
    assert sail(referee, *boats) == [
        "gate 1 of 4 crossed, 2.0 s: 10 points",
        "gate 2 crossed backwards: no points for it",
        "gate 3 of 4 crossed, 8.0 s: 20 points",
    ]
    assert referee.progress == {"gates": ["crossed", "backwards", "crossed", "ahead"]}


def test_the_last_gate_ends_the_run_even_backwards():
    referee = path()
    sail(referee, (5, 0), (15, 0), (15, 9), (45, 9), (45, 0), (35, 0))
    assert (referee.finished, referee.status.timed_out, referee.status.score) == (True, False, 10.0)
    assert referee.progress == {"gates": ["crossed", "missed", "missed", "backwards"]}


def test_a_path_of_one_gate():
    gates = GATES[:1]
    referee = path(gates)
    for time, x in ((1.0, 5), (2.0, 15)):
        referee.look(frame(time, (x, 0), **buoys(gates)))
    assert (referee.finished, referee.status.score) == (True, 11.0)


def test_collisions_cost_points_but_never_below_none():
    referee = path()
    referee.look(frame(4.0, touches={"red_0": 4.0}, **STANDS))
    assert referee.status.score == 0.0
    sail(referee, (5, 0), (15, 0), start=5.0)
    referee.look(frame(8.0, (15, 0), touches={"red_0": 8.0}, **STANDS))
    assert referee.status.score == 7.0
    assert referee.status.collisions == 2


def test_points_are_kept_when_time_is_up():
    referee = path()
    sail(referee, (5, 0), (15, 0))
    sail(referee, (15, 0), start=300.0)
    assert (referee.finished, referee.status.timed_out, referee.status.score) == (True, True, 10.0)


def test_it_takes_no_message():
    with pytest.raises(CommandError) as error:
        path().accept("gate", 1)
    assert str(error.value) == "the path takes no message 'gate'; known: none"
    assert path().outputs == {}
