"""Gate geometry: by hand, by complex numbers, and with the gates of VRX's courses."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.tasks.streams import begin, buoys, courses, frame, gate_names, look, pose, task, through, track
from vrx_mj.config.objects import load_object
from vrx_mj.errors import CommandError
from vrx_mj.model import tasks
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.courses import FAILURE_SCORE, Gate, gate_between, passage, side_of

COURSES = courses()
EAST = Gate(0.0, 0.0, 0.0, 10.0)
metres = st.floats(-100, 100)


def test_a_gate_is_crossed_with_its_left_marker_to_starboard():
    gate = gate_between(pose(20, -5), pose(20, 5))  # heading east, starboard is south
    assert gate == pytest.approx((20.0, 0.0, 0.0, 10.0))


@pytest.mark.parametrize(
    ("left", "right", "yaw"),
    [
        ((0, -1), (0, 1), 0.0),
        ((1, 0), (-1, 0), math.pi / 2),
        ((0, 1), (0, -1), math.pi),
        ((-1, 0), (1, 0), -math.pi / 2),
    ],
)
def test_directions_by_compass(left, right, yaw):
    turned = gate_between(pose(*left), pose(*right)).yaw - yaw
    assert (math.cos(turned), math.sin(turned)) == pytest.approx((1.0, 0.0), abs=1e-15)


def test_heights_of_the_buoys_widen_a_gate_as_in_vrx():
    assert gate_between(pose(0, -3, z=4.0), pose(0, 5, z=-2.0)).width == 10.0  # 8 and 6


@pytest.mark.parametrize(
    ("x", "y", "side"),
    [
        (-1e-9, 0, "before"),
        (0, 0, "after"),  # on the line is after
        (-3, 5, "before"),  # on the edge is inside
        (3, -5, "after"),
        (-3, 5.001, "outside"),
        (3, -5.001, "outside"),
        (-1e4, 0, "before"),  # however far
    ],
)
def test_sides_of_a_gate_that_leads_east(x, y, side):
    assert side_of(EAST, x, y) == side


@given(metres, metres, st.floats(-3, 3), st.floats(1, 50), metres, metres)
def test_sides_agree_with_complex_numbers(x, y, yaw, width, boat_x, boat_y):
    half = 0.5j * width * complex(math.cos(yaw), math.sin(yaw))
    left, right = complex(x, y) - half, complex(x, y) + half
    local = (complex(boat_x, boat_y) - (left + right) / 2) / ((right - left) / abs(right - left) / 1j)
    if abs(local.real) < 1e-9 or abs(abs(local.imag) - width / 2) < 1e-9:
        return  # rounding may decide
    expected = "outside" if abs(local.imag) > width / 2 else "after" if local.real > 0 else "before"
    gate = gate_between(pose(left.real, left.imag), pose(right.real, right.imag))
    assert side_of(gate, boat_x, boat_y) == expected


@pytest.mark.parametrize(
    ("before", "x", "way"),
    [
        ("before", 1, "forwards"),
        ("after", -1, "backwards"),
        ("outside", 1, None),
        ("outside", -1, None),
        ("before", -1, None),
        ("after", 1, None),
    ],
)
def test_a_passage_needs_both_sides_in_a_row(before, x, way):
    seen = frame(1.0, (x, 0), left=(0, -5), right=(0, 5))
    assert passage(tasks.Gate(left="left", right="right"), before, "wamv", seen)[1] == way


def test_beside_a_gate_there_is_no_passage():
    seen = frame(1.0, (1, 5.1), left=(0, -5), right=(0, 5))
    assert passage(tasks.Gate(left="left", right="right"), "before", "wamv", seen) == ("outside", None)


def test_the_shipped_courses_have_vrx_gates():
    for course, gates in COURSES.items():
        places = {thing.name: tuple(thing.pose[:2]) for thing in load_object(course).objects}
        for number, (red, partner) in enumerate(gates):
            names = [name for name in places if name.endswith(f"_bound_{number}") and not name.startswith("red")]
            assert len(names) == 1
            assert places[f"red_bound_{number}"] == pytest.approx(red, abs=0.006)  # the table has centimetres
            assert places[names[0]] == pytest.approx(partner, abs=0.006)
        assert sum(name.startswith("red_bound") for name in places) == len(gates), course


def test_every_gate_of_a_course_is_entered_before_and_left_after():
    for course, gates in COURSES.items():
        poses = buoys(gates)
        for names, gate in zip(gate_names(len(gates)), gates, strict=True):
            found = gate_between(poses[names["left"]], poses[names["right"]])
            assert [side_of(found, *point) for point in through(gate)] == ["before", "after"], course


# Follow the path, with points by hand


GATES = [((x, -5), (x, 5)) for x in (10, 20, 30, 40)]
"""Four gates, to be crossed toward the east."""
BUOYS = buoys(GATES)


def path(gates=GATES, **values):
    points = {"points_per_gate_crossed": 10.0, "bonus": 1.0, "obstacle_penalty": 3.0, "profile": "vrx3"}
    referee = make_referee(task("follow_path", gates=gate_names(len(gates)), **{**points, **values}))
    begin(referee, **buoys(gates), boat=(500, 500))
    return referee


def sail(referee, *boats, start=1.0):
    """One frame a second with the boat here and there; all lines."""
    return [line for second, boat in enumerate(boats) for line in look(referee, start + second, boat, **BUOYS)]


@pytest.mark.parametrize("course", COURSES)
def test_a_perfect_run_gives_eleven_points_a_gate(course):
    gates = COURSES[course]
    referee, poses = path(gates), buoys(gates)
    legs = [point for gate in gates for point in through(gate)]
    for number, boat in enumerate(track(legs, 0.25), start=2):
        look(referee, number / 20, boat, **poses)
    assert referee.is_over
    assert referee.status.score == 11.0 * len(gates)


def test_points_come_gate_by_gate():
    referee = path()
    assert sail(referee, (5, 0), (15, 0), (25, 0), (35, 0), (45, 0)) == [
        "gate 1 of 4 crossed, 2.0 s: 10 points",
        "gate 2 of 4 crossed, 3.0 s: 21 points",
        "gate 3 of 4 crossed, 4.0 s: 32 points",
        "gate 4 of 4 crossed, 5.0 s: 44 points",
    ]
    assert (referee.is_over, referee.status.timed_out) == (True, False)


def test_a_gate_left_out_costs_its_points_and_the_bonus_of_the_next():
    referee = path()
    sail(referee, (5, 0), (15, 0), (15, 9), (25, 9), (25, 0), (35, 0), (45, 0))
    assert referee.status.score == 10 + 10 + 11 + 1
    assert referee.progress == {"gates": ["crossed", "missed", "crossed", "crossed"]}


def test_a_gate_left_out_cannot_be_made_up_for():
    referee = path()
    sail(referee, (5, 0), (15, 0), (15, 9), (25, 9), (25, 0), (35, 0), (35, 9), (15, 9), (15, 0), (25, 0))
    assert referee.status.score == 20
    assert not referee.is_over


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
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, False, 10.0)
    assert referee.progress == {"gates": ["crossed", "missed", "missed", "backwards"]}


def test_a_path_of_one_gate():
    gates = GATES[:1]
    referee = path(gates)
    for time, x in ((1.0, 5), (2.0, 15)):
        referee.look(frame(time, (x, 0), **buoys(gates)))
    assert (referee.is_over, referee.status.score) == (True, 11.0)


def test_collisions_cost_points_but_never_below_none():
    referee = path()
    referee.look(frame(4.0, touches={"red_0": 4.0}, **BUOYS))
    assert referee.status.score == 0.0
    sail(referee, (5, 0), (15, 0), start=5.0)
    referee.look(frame(8.0, (15, 0), touches={"red_0": 8.0}, **BUOYS))
    assert referee.status.score == 7.0
    assert referee.status.collisions == 2


def test_points_are_kept_when_time_is_up():
    referee = path()
    sail(referee, (5, 0), (15, 0))
    sail(referee, (15, 0), start=300.0)
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, True, 10.0)


def test_a_path_takes_no_message():
    with pytest.raises(CommandError) as error:
        path().accept("gate", 1)
    assert str(error.value) == "the path takes no message 'gate'; known: none"
    assert path().outputs == {}


# The navigation channel, with scores by hand


CHANNEL_GATES = [((x, -5), (x, 5)) for x in (10, 20, 30)]
"""Three gates, to be crossed toward the east."""
CHANNEL_BUOYS = buoys(CHANNEL_GATES)


def channel(gates=CHANNEL_GATES, **values):
    referee = make_referee(
        task("navigation_course", gates=gate_names(len(gates)), **{"obstacle_penalty": 10.0, **values})
    )
    begin(referee, **buoys(gates), boat=(500, 500))
    return referee


def sail_channel(referee, *boats, start=1.0, gates=CHANNEL_GATES):
    """One frame a second with the boat here and there; all lines."""
    poses = buoys(gates)
    return [line for second, boat in enumerate(boats) for line in look(referee, start + second, boat, **poses)]


def test_the_score_is_the_time_per_gate():
    referee = channel()
    lines = sail_channel(referee, (5, 0), (15, 0), (25, 0), (35, 0))
    assert referee.is_over
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
        if referee.is_over:
            break
    assert referee.progress == {"gates": ["crossed"] * len(gates)}
    assert referee.status.score == pytest.approx(number / 20 / len(gates), rel=1e-12)


def test_a_course_sailed_with_red_to_port_fails_at_its_first_gate():
    for course, gates in COURSES.items():
        referee = channel(gates)
        lines = sail_channel(referee, *reversed(through(gates[0])), gates=gates)
        assert (referee.is_over, referee.status.score) == (True, FAILURE_SCORE), course
        assert lines == ["gate 1 crossed backwards: failed"], course


def test_a_gate_crossed_backwards_fails_even_if_it_is_not_its_turn():
    referee = channel()
    assert sail_channel(referee, (35, 0), (25, 0)) == ["gate 3 crossed backwards: failed"]
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, False, 200.0)
    assert referee.progress == {"gates": ["ahead", "ahead", "backwards"]}


def test_a_gate_out_of_turn_fails():
    referee = channel()
    assert sail_channel(referee, (5, 0), (15, 0), (15, 9), (25, 9), (25, 0), (35, 0)) == [
        "gate 1 of 3 crossed, 2.0 s",
        "gate 3 crossed before gate 2: failed",
    ]
    assert referee.status.score == 200.0
    assert referee.progress == {"gates": ["crossed", "missed", "crossed"]}


def test_back_through_a_gate_that_was_crossed_is_no_failure():
    referee = channel()
    sail_channel(referee, (5, 0), (15, 0), (5, 0), (15, 0), (25, 0))
    assert not referee.is_over
    assert referee.progress == {"gates": ["crossed", "crossed", "ahead"]}


def test_beside_a_gate_nothing_is_crossed():
    referee = channel()
    sail_channel(referee, (5, 0), (5, 6), (15, 6), (15, 0), (15, 6), (5, 6), (5, 0))
    assert referee.progress == {"gates": ["ahead"] * 3}


def test_gates_move_with_their_buoys():
    referee = channel()
    for time, x in ((1.0, 10.0), (2.0, 4.0)):
        referee.look(frame(time, (5, 0), **{**CHANNEL_BUOYS, **buoys([((x, -5), (x, 5))])}))
    assert referee.progress["gates"][0] == "crossed"  # the gate went over the boat


def test_collisions_cost_seconds_also_those_before_the_run():
    referee = make_referee(task("navigation_course", gates=gate_names(3), obstacle_penalty=10.0, durations=[5, 5, 300]))
    referee.look(frame(4.0, touches={"red_0": 4.0}, **CHANNEL_BUOYS))
    assert referee.status.collisions == 1
    for time in (5.0, 10.0, 12.0):
        referee.look(frame(time, touches={"red_0": 4.0}, **CHANNEL_BUOYS))
    assert referee.status.score == pytest.approx((2.0 + 10.0) / 3)
    referee.look(frame(13.0, touches={"red_0": 4.0, "red_1": 13.0}, **CHANNEL_BUOYS))
    assert referee.status.score == pytest.approx((3.0 + 20.0) / 3)


def test_the_score_is_never_over_the_running_time_per_gate():
    referee = channel(obstacle_penalty=1000.0)
    referee.look(frame(5.0, touches={"red_0": 5.0}, **CHANNEL_BUOYS))
    assert referee.status.score == 100.0  # 300 / 3


def test_time_up_is_a_failure():
    referee = channel()
    sail_channel(referee, (5, 0), (15, 0), (25, 0))
    assert sail_channel(referee, (35, 0), start=300.0) == []
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, True, 200.0)
    assert referee.status.remaining == 0.0


def test_a_gate_crossed_before_the_run_does_not_count():
    referee = make_referee(task("navigation_course", gates=gate_names(3), obstacle_penalty=10.0, durations=[0, 5, 300]))
    sail_channel(referee, (5, 0), (15, 0))
    assert referee.progress == {"gates": ["ahead"] * 3}


def test_its_bodies_are_the_markers_each_once():
    gates = [{"left": "a", "right": "b"}, {"left": "c", "right": "b"}]
    referee = make_referee(task("navigation_course", gates=gates, obstacle_penalty=10.0))
    assert referee.watched == ("wamv", "a", "b", "c")


def test_a_channel_takes_no_message():
    with pytest.raises(CommandError) as error:
        channel().accept("gate", 1)
    assert str(error.value) == "the navigation course takes no message 'gate'; known: none"
    assert channel().outputs == {}
