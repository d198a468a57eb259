"""Perception, with errors and attempts by hand."""

import math

import pytest

from unit.tasks.streams import begin, frame, look, pose, task
from vrx_mj.errors import CommandError
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.perception import ahead_of
from vrx_mj.tasks.referee import PlaceObject, Release

RED, GREEN = "mb_marker_buoy_red", "mb_marker_buoy_green"


def thing(name, kind, time, pose=(8, 0, 1, 0, 0, 0), duration=5.0):
    stash = [-200.0, 100.0, 1.0, 0.0, 0.0, 0.0]
    return {"time": time, "duration": duration, "type": kind, "name": name, "pose": list(pose), "stash": stash}


TWO = [thing("red_0", RED, 5.0), thing("green_0", GREEN, 5.0, (8, 2, 1, 0, 0, 0))]
UP = {"red_0": (8, 0), "green_0": (8, 2)}


def perception(objects=TWO, **values):
    referee = make_referee(task("perception", objects=objects, held=True, **{"loop_forever": False, **values}))
    begin(referee, **dict.fromkeys(referee.watched, (-200, 100)))
    return referee


def report(kind, x, y):
    return "landmark", {"type": kind, "x": x, "y": y}


def test_a_perfect_run():
    referee = perception()
    assert look(referee, 5.05, **UP) == ["landmark red_0 appears", "landmark green_0 appears"]
    messages = [report(RED, 8, 0), report(GREEN, 8, 2)]
    assert look(referee, 6.0, messages=messages, **UP) == [
        "landmark red_0 found, error 0.00 m",
        "landmark green_0 found, error 0.00 m",
    ]
    assert look(referee, 10.05, **UP) == [
        "landmark red_0 disappears: error 0.00 m",
        "landmark green_0 disappears: error 0.00 m",
    ]
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, False, 0.0)


def test_errors_are_of_now_at_most_two_and_the_least_counts():
    referee = perception([thing("red_0", RED, 5.0)])
    look(referee, 6.0, red_0=(-200, 100))
    assert look(referee, 6.05, messages=[report(RED, 9, 0)], red_0=(8.5, 0)) == ["landmark red_0 found, error 0.50 m"]
    assert look(referee, 11.0, red_0=(9, 0)) == ["landmark red_0 disappears: error 0.50 m"]
    assert referee.status.score == 0.5
    far = perception([thing("red_0", RED, 5.0)])
    look(far, 6.0, red_0=(8, 0))
    look(far, 7.0, messages=[report(RED, 800, 0)], red_0=(8, 0))
    look(far, 11.0, red_0=(8, 0))
    assert far.status.score == 2.0


def test_nothing_found_is_ten():
    referee = perception()
    look(referee, 6.0, **UP)
    look(referee, 11.0, **UP)
    assert (referee.is_over, referee.status.score) == (True, 10.0)


def test_the_sum_is_the_score_until_the_end_and_then_the_mean():
    referee = perception([thing("red_0", RED, 5.0), thing("green_0", GREEN, 15.0)])
    scores = []
    for time, messages in ((6, ()), (7, [report(RED, 8, 1)]), (11, ()), (16, ()), (21, ())):
        look(referee, time, messages=messages, **UP)
        scores.append(referee.status.score)
    assert scores == [0.0, 0.0, 1.0, 1.0, 5.5]


def test_every_report_costs_an_attempt_right_or_wrong():
    referee = perception()
    look(referee, 6.0, **UP)
    messages = [report(RED, 8, 1), report("black_totem", 8, 2), report(GREEN, 8, 2)]
    assert look(referee, 7.0, messages=messages, **UP) == [
        "landmark red_0 found, error 1.00 m",
        "landmark black_totem is not present now",
        "landmark mb_marker_buoy_green ignored: no attempts left",
    ]
    look(referee, 11.0, **UP)
    assert referee.status.score == 5.5


def test_attempts_are_shared_by_all_that_are_up():
    referee = perception()
    look(referee, 6.0, **UP)
    look(referee, 7.0, messages=[report(RED, 9, 0), report(RED, 8.25, 0), report(RED, 8, 0)], **UP)
    look(referee, 11.0, **UP)
    assert referee.status.score == (0.25 + 10.0) / 2


def test_a_worse_report_after_a_better_one_does_no_harm():
    referee = perception()
    look(referee, 6.0, **UP)
    assert look(referee, 7.0, messages=[report(RED, 8.25, 0), report(RED, 9, 0)], **UP) == [
        "landmark red_0 found, error 0.25 m",
        "landmark red_0 found, error 1.00 m",
    ]
    look(referee, 11.0, **UP)
    assert referee.status.score == (0.25 + 10.0) / 2


def test_an_attempt_goes_with_its_object():
    referee = perception([thing("red_0", RED, 5.0), thing("green_0", GREEN, 8.0)])
    look(referee, 6.0, **UP)  # 1
    look(referee, 9.0, **UP)  # 2
    look(referee, 10.05, **UP)  # 1
    lines = look(referee, 11.0, messages=[report(GREEN, 8, 2.5), report(GREEN, 8, 2)], **UP)
    assert lines == ["landmark green_0 found, error 0.50 m", "landmark mb_marker_buoy_green ignored: no attempts left"]
    look(referee, 13.05, **UP)  # stays 0
    assert referee.dump()["rules"]["attempts"] == 0
    assert referee.status.score == (10.0 + 0.5) / 2


def test_a_report_counts_for_all_of_its_type_that_are_up_and_for_no_other():
    referee = perception([thing(f"red_{k}", RED, time) for k, time in enumerate((5.0, 5.0, 20.0))])
    poses = {"red_0": (8, 0), "red_1": (8, 1), "red_2": (8, 0)}
    look(referee, 6.0, **poses)
    look(referee, 7.0, messages=[report(RED, 8, 0)], **poses)
    assert referee.progress == {
        "objects": ["red_0", "red_1", "red_2"],
        "up": [True, True, False],
        "errors": [0.0, 1.0, 10.0],
    }


def test_a_model_may_show_up_twice():
    referee = perception([thing("red_0", RED, 5.0), thing("red_0", RED, 15.0)])
    for time, messages in ((6, ()), (7, [report(RED, 8, 1)]), (11, ()), (16, ()), (21, ())):
        look(referee, time, messages=messages, **UP)
    assert (referee.is_over, referee.status.score) == (True, 5.5)


def test_objects_are_placed_by_the_boats_yaw_and_go_back_to_their_stash():
    referee = perception([thing("red_0", RED, 5.0, (8, -2, 1, 0.1, 0.2, 0.3))])
    boat = pose(100, 50, math.pi / 2, z=0.25)
    (action,) = referee.look(frame(5.05, boat, red_0=(0, 0))).actions
    assert action.name == "red_0"
    assert action.pose == pytest.approx((102.0, 58.0, 1.25, 0.1, 0.2, math.pi / 2 + 0.3))
    assert referee.look(frame(10.05, boat, red_0=(0, 0))).actions == (
        PlaceObject("red_0", (-200.0, 100.0, 1.0, 0.0, 0.0, 0.0)),
    )


def test_roll_and_pitch_of_the_boat_are_dropped():
    rolled = type(pose())(0.0, 0.0, 0.0, (math.cos(0.2), math.sin(0.2), 0.0, 0.0))
    assert ahead_of(rolled, (8, 2, 1, 0, 0, 0)) == pytest.approx((8, 2, 1, 0, 0, 0))


@pytest.mark.parametrize(("time", "up"), [(5.0, False), (5.01, True), (9.99, True), (10.0, True), (10.01, False)])
def test_an_object_is_up_between_its_times(time, up):
    referee = perception([thing("red_0", RED, 5.0)])
    for moment in (5.0, time):
        look(referee, moment, red_0=(8, 0))
    if time > 9:
        referee = perception([thing("red_0", RED, 5.0)])
        look(referee, 6.0, red_0=(8, 0))
        look(referee, time, red_0=(8, 0))
    assert referee.progress["up"] == [up]


def test_the_boat_is_never_released():
    referee = make_referee(task("perception", objects=TWO, loop_forever=False, held=True, durations=[0, 1, 300]))
    actions = [action for time in (0.0, 1.0, 2.0) for action in referee.look(frame(time, **UP)).actions]
    assert not [action for action in actions if isinstance(action, Release)]


def test_out_of_time_the_sum_is_left():
    referee = perception([thing("red_0", RED, 5.0), thing("green_0", GREEN, 299.0)])
    for time in (6, 11, 299.5, 300):
        look(referee, time, **UP)
    assert (referee.is_over, referee.status.timed_out, referee.status.score) == (True, True, 10.0)


def test_reports_before_the_run_are_lost():
    referee = make_referee(task("perception", objects=TWO, loop_forever=False, held=True, durations=[0, 100, 300]))
    referee.look(frame(0.0, **UP))
    assert look(referee, 50.0, messages=[report(RED, 8, 0)], **UP) == []


def test_a_sequence_that_loops_begins_anew_with_fresh_errors():
    referee = perception([thing("red_0", RED, 5.0)], loop_forever=True)
    scores = []
    for time, messages in ((6, ()), (7, [report(RED, 8, 1)]), (11, ()), (15.9, ()), (17, ()), (22, ())):
        look(referee, time, messages=messages, **UP)
        scores.append((referee.status.score, referee.progress["up"]))
    assert scores == [
        (0.0, [True]),
        (0.0, [True]),
        (1.0, [False]),
        (1.0, [False]),
        (1.0, [True]),
        (10.0, [False]),
    ]
    assert not referee.is_over


@pytest.mark.parametrize(
    ("topic", "content", "message"),
    [
        ("color", [], "perception takes no message 'color'; known: landmark"),
        (
            "landmark",
            "red",
            (
                "invalid landmark: the keys type, and x and y [m] or latitude and longitude [degrees] are needed, "
                "got 'red'"
            ),
        ),
        (
            "landmark",
            {"type": RED, "x": 1},
            (
                "invalid landmark: the keys type, and x and y [m] or latitude and longitude [degrees] are needed, "
                "got the keys type, x"
            ),
        ),
        (
            "landmark",
            {},
            (
                "invalid landmark: the keys type, and x and y [m] or latitude and longitude [degrees] are needed, "
                "got the keys none"
            ),
        ),
        (
            "landmark",
            {"type": 3, "x": 1, "y": 2},
            "invalid landmark type 3: a name is needed, as in 'mb_marker_buoy_red'",
        ),
        (
            "landmark",
            {"type": RED, "x": "far", "y": 2},
            "invalid x 'far' of a landmark: a number of metres is needed",
        ),
        (
            "landmark",
            {"type": RED, "x": 1, "y": math.nan},
            "invalid y nan of a landmark: a number of metres is needed",
        ),
        (
            "landmark",
            {"type": RED, "x": True, "y": 2},
            "invalid x True of a landmark: a number of metres is needed",
        ),
    ],
)
def test_wrong_messages(topic, content, message):
    with pytest.raises(CommandError) as error:
        perception().accept(topic, content)
    assert str(error.value) == message


def test_a_right_message_comes_back_as_plain_data():
    message = perception().accept("landmark", {"y": 2, "x": 1, "type": RED})
    assert (message.topic, message.content) == ("landmark", {"type": RED, "x": 1.0, "y": 2.0})
