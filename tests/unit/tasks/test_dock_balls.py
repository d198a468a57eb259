"""Balls, colours and symbols of the docking tasks, with scores by hand."""

import json
import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from unit.tasks.docking import AWAY, BALL, BAY, FAR, HOLES, OUT, ZONES, Run, docking
from unit.tasks.streams import frame, pose
from vrx_mj.errors import CommandError
from vrx_mj.frames import quaternion, rotation
from vrx_mj.tasks.dock import FASTEST, Box, relative
from vrx_mj.tasks.frame import Pose
from vrx_mj.tasks.rules import LightUp, Release, ShowSymbol

# Balls


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.0])
@pytest.mark.parametrize(("hole", "y", "points"), [(0, 3.6, 5.0), (1, 2.4, 10.0), (4, 15.6, 5.0), (5, 14.4, 10.0)])
def test_a_ball_through_any_hole_counts_though_no_frame_shows_it_there(yaw, hole, y, points):
    run = Run(docking(), dock=pose(-480.0, 190.0, yaw=yaw)).go(ball=(5.3, y, 2.8)).go(ball=(6.4, y, 2.8))
    assert run.score == points
    assert run.progress["hits"] == [
        {"time": pytest.approx(0.15), "ball": BALL, "bay": HOLES[hole]["bay"], "size": HOLES[hole]["size"]}
        | {"points": points}
    ]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ((5.3, 9.6, 2.57), (6.4, 9.6, 2.57)),  # under the big hole
        ((5.3, 9.6, 3.09), (6.4, 9.6, 3.09)),  # over it
        ((5.3, 9.0, 2.83), (6.4, 9.0, 2.83)),  # between the two
        ((5.3, 8.26, 2.83), (6.4, 8.26, 2.83)),  # past the small one
        ((5.3, 9.6, 2.83), (5.69, 9.6, 2.83)),  # short of it
        ((5.65, 9.6, 2.5), (5.75, 9.6, 2.55)),  # past its lower edge
        ((5.4, 9.6, 2.9), (6.2, 9.6, 3.7)),  # over its upper front edge, though both ranges meet
    ],
)
def test_a_ball_past_a_hole_does_not_count(before, after):
    assert Run(docking()).go(ball=before).go(ball=after).score == 0.0


def test_a_ball_that_falls_in_counts_once_each_time_it_comes_in():
    inside, outside = (5.95, 9.6, 2.83), (5.4, 9.6, 2.83)
    run = Run(docking()).go(ball=outside)
    assert [run.go(ball=at).score for at in (inside, inside, (6.0, 9.6, 2.7), inside)] == [5.0] * 4
    assert [run.go(ball=at).score for at in (outside, outside, inside, outside, inside)] == [5.0, 5.0, 10.0, 10.0, 15.0]


def test_a_new_shot_does_not_fly_through_holes_on_its_way_to_the_muzzle():
    """From behind the placard, 4.5 m away, the straight way to the muzzle leads through the big hole."""
    run = Run(docking()).go(ball=(6.6, 9.6, 3.03)).go(ball=(2.3, 9.6, 1.7))
    assert run.score == 0.0
    way = Box((5.95, 9.6, 2.83), (0.5, 0.5, 0.5))
    assert way.meets((6.6, 9.6, 3.03), (2.3, 9.6, 1.7))


@pytest.mark.parametrize(("share", "score"), [(0.999, 5.0), (1.001, 0.0)])
def test_what_is_too_fast_for_a_ball_was_shot_anew(share, score):
    length = FASTEST * 0.05 * share
    assert Run(docking()).go(ball=(5.2, 9.6, 2.83)).go(ball=(5.2 + length, 9.6, 2.83)).score == score


def test_a_ball_shot_anew_into_a_hole_counts():
    assert Run(docking()).go(ball=(5.95, 9.6, 2.83)).score == 5.0


def test_two_holes_at_once_count_once():
    """Along the placard through both holes of bay 2 within a frame: the last of them, here the small one."""
    run = Run(docking()).go(ball=(5.95, 10.0, 2.83)).go(1.0, ball=(5.95, 8.0, 2.83))
    assert (run.score, len(run.progress["hits"])) == (10.0, 1)


def test_balls_count_only_while_the_task_runs():
    run = Run(docking(durations=[1.0, 1.0, 300.0])).go(ball=(5.5, 9.6, 2.83)).go(ball=(5.95, 9.6, 2.83))
    run.go(3.0).go(3.0)
    assert (run.referee.status.phase, run.score, run.progress["hits"]) == ("running", 0.0, [])


def test_a_ball_in_the_frame_of_backing_out_counts():
    run = Run(docking()).go(boat=BAY, ball=(5.5, 9.6, 2.83)).go(10.0).go(boat=OUT, ball=(6.0, 9.6, 2.83))
    assert (run.over, run.score) == (True, 25.0)


def test_balls_of_other_boats_do_not_count():
    run = Run(docking()).go(others=[("wamv2/ball_shooter", (5.5, 9.6, 2.83))])
    assert run.go(others=[("wamv2/ball_shooter", (5.95, 9.6, 2.83))]).score == 0.0


def test_every_ball_of_the_boat_counts():
    referee = docking(balls=[BALL, "wamv/second"])
    assert referee.watched == ("wamv", "dock", BALL, "wamv/second")
    for number, x in enumerate((5.5, 5.5, 5.95)):
        balls = {BALL: pose(z=-200.0), "wamv/second": pose(x, 9.6, z=2.83)}
        referee.look(frame(0.05 * number, dock=pose(), **balls))
    assert referee.status.score == 5.0


def test_a_hole_goes_with_its_dock():
    """The dock drifts by 0.5 m toward a ball that hangs in the air."""
    referee, ball = docking(), Pose(5.5, 9.6, 2.83)
    for number in range(3):
        referee.look(frame(0.05 * number, dock=pose(), **{BALL: ball}))
    referee.look(frame(0.15, dock=pose(-0.5), **{BALL: ball}))
    assert referee.status.score == 5.0


def test_without_targets_nothing_is_shot():
    run = Run(docking(holes=[])).go(ball=(5.5, 9.6, 2.83)).go(ball=(5.95, 9.6, 2.83))
    assert run.score == 0.0


# Colours and symbols


@pytest.mark.parametrize(
    ("sent", "points", "line"),
    [
        (["red", "green", "blue"], 10.0, "colours red, green, blue: right, 10 points"),
        (["RED", "Green", "bLUE"], 10.0, "colours red, green, blue: right, 10 points"),
        (["blue", "green", "red"], 0.0, "colours blue, green, red: wrong"),
        (["yellow", "yellow", "yellow"], 0.0, "colours yellow, yellow, yellow: wrong"),
    ],
)
def test_colours_give_points_in_their_order(sent, points, line):
    run = Run(docking())
    message = run.referee.accept("color_sequence", sent)
    run.go(messages=[(message.topic, message.content)])
    assert (run.score, run.lines) == (points, [line])
    assert run.progress["colors"] == [color.lower() for color in sent]
    assert run.referee.outputs == {"color_sequence_open": False, "symbol": "blue_triangle"}


def test_colours_count_once():
    run = Run(docking()).go(messages=[("color_sequence", ["blue", "green", "red"])])
    run.go(messages=[("color_sequence", ["red", "green", "blue"])])
    assert run.score == 0.0
    assert run.lines[-1] == "colours ignored: they are accepted once, while the task runs"


def test_of_two_submissions_in_one_frame_the_first_counts():
    run = Run(docking())
    run.go(messages=[("color_sequence", ["red", "green", "blue"]), ("color_sequence", ["red", "green", "blue"])])
    assert run.score == 10.0


@pytest.mark.parametrize(("wait", "phase"), [(0.0, "initial"), (1.5, "ready")])
def test_colours_sent_too_early_are_in_vain(wait, phase):
    run = Run(docking(durations=[1.0, 1.0, 5.0])).go(wait)
    assert (run.referee.status.phase, run.referee.outputs["color_sequence_open"]) == (phase, False)
    run.go(messages=[("color_sequence", ["red", "green", "blue"])])
    assert run.lines[-1] == "colours ignored: they are accepted once, while the task runs"
    run.go(1.5)
    run.go(1.5)
    assert run.referee.outputs["color_sequence_open"]


@pytest.mark.parametrize(
    "content", [["red", "green"], ["red", "green", "purple"], ["red", "green", "blue", "red"], "red", None, [1, 2, 3]]
)
def test_wrong_colours_say_what_is_right(content):
    run = Run(docking())
    with pytest.raises(CommandError) as caught:
        run.referee.accept("color_sequence", content)
    assert str(caught.value) == (
        f"invalid color_sequence {content!r}: a list of three of red, green, blue, yellow is needed"
    )
    run.referee.accept("color_sequence", ["red", "green", "blue"])


def test_other_messages_say_what_is_taken():
    with pytest.raises(CommandError) as caught:
        Run(docking()).referee.accept("landmark", {})
    assert str(caught.value) == "docking takes no message 'landmark'; known: color_sequence"


def test_without_the_colour_checker_no_message_is_taken():
    run = Run(docking(enable_color_checker=False))
    assert not run.referee.outputs["color_sequence_open"]
    with pytest.raises(CommandError) as caught:
        run.referee.accept("color_sequence", ["red", "green", "blue"])
    assert str(caught.value) == "docking takes no message 'color_sequence'; known: none"
    assert run.go(messages=[("color_sequence", ["red", "green", "blue"])]).score == 0.0


def test_placards_are_told_at_ready_and_running_and_the_buoy_at_running():
    run = Run(docking(durations=[1.0, 1.0, 5.0])).go(0.0)
    assert (run.actions, run.referee.outputs) == ([], {"color_sequence_open": False})
    symbols = ("red_circle", "blue_triangle", "yellow_cross")
    shown = [ShowSymbol(f"placard{number}", symbol) for number, symbol in enumerate(symbols, start=1)]
    run.go(1.0)
    assert run.actions == [Release("wamv"), *shown]
    assert run.referee.outputs == {"color_sequence_open": False, "symbol": "blue_triangle"}
    run.go(1.0)
    assert run.actions[4:] == [*shown, LightUp("light_buoy", ("red", "green", "blue"))]
    run.go(6.0)
    assert len(run.actions) == 8


def test_without_a_buoy_or_a_right_bay_nothing_is_told_of_them():
    run = Run(docking(light_buoy=None, right=()))
    assert run.referee.outputs == {"color_sequence_open": True}
    assert not any(isinstance(action, LightUp) for action in run.actions)


# State


def wandering(seed):
    """A stream of frames in which about everything happens."""
    draw = random.Random(seed)
    places = [BAY, OUT, AWAY, ZONES["dock_2022"][0][0], ZONES["dock_2022"][2][0]]
    boat, ball, time = AWAY, FAR, 0.0
    run = Run(docking(durations=[1.0, 2.0, 300.0]))
    for _ in range(400):
        time += draw.choice((0.05, 0.05, 0.05, 3.0))
        boat = draw.choice(places) if draw.random() < 0.08 else boat
        ball = draw.choice([(5.5, 9.6, 2.83), (6.0, 9.6, 2.83), (5.95, 2.4, 2.83), FAR])
        messages = [("color_sequence", ["red", "green", "blue"])] if draw.random() < 0.02 else []
        run.dock = pose(0.1 * draw.random(), draw.random(), yaw=0.05 * draw.random())
        touches = {"dock": time} if draw.random() < 0.05 else {}
        others = {"dock": run.dock, BALL: run.place(ball)}
        yield frame(time, run.place(boat), messages=messages, touches=touches, **others)


@pytest.mark.parametrize("seed", range(8))
def test_a_run_cut_anywhere_goes_on_exactly(seed):
    stream = list(wandering(seed))
    whole = docking(durations=[1.0, 2.0, 300.0])
    said = [whole.look(each) for each in stream]
    assert whole.status.score > 0.0
    for cut in random.Random(seed).sample(range(len(stream)), 8):
        first, second = docking(durations=[1.0, 2.0, 300.0]), docking(durations=[1.0, 2.0, 300.0])
        before = [first.look(each) for each in stream[:cut]]
        second.load(json.loads(json.dumps(first.dump())))
        assert before + [second.look(each) for each in stream[cut:]] == said
        assert second.dump() == whole.dump()


def test_a_restart_forgets_all():
    run = Run(docking())
    fresh = docking().dump()
    run.go(boat=BAY, messages=[("color_sequence", ["red", "green", "blue"])], ball=(5.95, 9.6, 2.83)).go(10.0)
    run.referee.restart()
    assert run.referee.dump() == fresh


# Geometry

NUMBER = st.floats(-3.0, 3.0)
POINT = st.tuples(NUMBER, NUMBER, NUMBER)
EDGE = st.floats(0.1, 3.0)


@given(start=POINT, end=POINT, center=POINT, size=st.tuples(EDGE, EDGE, EDGE))
def test_a_way_meets_a_box_where_a_walk_along_it_is_inside(start, end, center, size):
    """Against 2000 points of the way; boxes a little smaller and larger allow for what is between the points."""
    walk = np.linspace(start, end, 2001)
    spacing = math.dist(start, end) / 2000 + 1e-9
    apart = np.abs(walk - center)

    def walked(margin):
        return bool(np.any(np.all(apart <= np.array(size) / 2 + margin, axis=1)))

    met = Box(center, size).meets(start, end)
    if walked(0.0):
        assert met
    if not walked(spacing):
        assert not met


@given(origin=POINT, point=POINT, roll=st.floats(-1, 1), pitch=st.floats(-1, 1), yaw=st.floats(-math.pi, math.pi))
def test_places_in_a_frame_agree_with_matrices(origin, point, roll, pitch, yaw):
    turn = np.array(rotation(roll, pitch, yaw))
    expected = turn.T @ (np.array(point) - origin)
    found = relative(Pose(*origin, quaternion(roll, pitch, yaw)), Pose(*point))
    assert found == pytest.approx(expected.tolist(), abs=1e-12)
