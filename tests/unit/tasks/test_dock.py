"""Docking, with scores by hand."""

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
from vrx_mj.model.tasks import Box
from vrx_mj.tasks.dock import MAX_BALL_SPEED, crosses, relative
from vrx_mj.tasks.referee import LightUp, Pose, Release, ShowSymbol


def test_a_perfect_run():
    run = Run(docking())
    run.go(messages=[("color_sequence", ["red", "green", "blue"])])
    assert run.score == 10.0
    run.stay(10.0, BAY).go()
    assert run.score == 10.0
    run.go(ball=(1.0, 9.6, 1.5)).go(ball=(5.6, 9.6, 2.8)).go(ball=(5.8, 9.6, 2.8))
    assert run.score == 15.0
    run.go(ball=(1.0, 8.4, 1.5)).go(ball=(5.6, 8.4, 2.8)).go(ball=(6.0, 8.4, 2.8))
    assert run.score == 25.0
    run.go(boat=(-1.0, 9.0, 0.0)).go(boat=OUT)
    assert (run.over, run.referee.status.timed_out, run.score) == (True, False, 45.0)
    assert run.lines == [
        "colours red, green, blue: right, 10 points",
        "wamv enters bay2",
        "wamv has docked in bay2; points are given when it backs out",
        "ball through the big hole of bay2: 5 points",
        "ball through the small hole of bay2: 10 points",
        "wamv leaves bay2 after 10.35 s",
        "wamv backs out of bay2, the right bay: 20 points",
    ]


# Docking


@pytest.mark.parametrize("yaw", [0.0, 1.0, 3.14, -1.944])
@pytest.mark.parametrize("dock", ZONES)
def test_the_zones_end_at_vrxs_faces(dock, yaw):
    """A millimetre inside and outside of every face of every internal zone."""
    anchor = pose(-480.0, 190.0, yaw=yaw)
    for number, (center, size, _, _) in enumerate(ZONES[dock], start=1):
        for axis in range(3):
            for way in (-1.0, 1.0):
                for beyond in (-0.001, 0.001):
                    place = list(center)
                    place[axis] += way * (size[axis] / 2 + beyond)
                    run = Run(docking(dock), dock=anchor).go(boat=place)
                    assert run.progress["bay"] == ("" if beyond > 0 else f"bay{number}")


@pytest.mark.parametrize("yaw", [0.0, -2.76])
@pytest.mark.parametrize("dock", ZONES)
def test_the_points_come_at_the_faces_of_the_external_zones(dock, yaw):
    anchor = pose(130.0, 97.0, yaw=yaw)
    for number, (inside, _, center, size) in enumerate(ZONES[dock], start=1):
        for axis in range(3):
            for way in (-1.0, 1.0):
                place = list(center)
                place[axis] += way * (size[axis] / 2 + 0.001)
                run = Run(docking(dock), dock=anchor).go(boat=inside).go(10.0).go(boat=place)
                assert not run.over
                place[axis] -= way * 0.002
                run.go(boat=place)
                assert run.over
                assert run.progress["left"] == f"bay{number}"
                assert run.score == (20.0 if number == 2 else 15.0)


@pytest.mark.parametrize(
    ("kind", "dock", "points", "bay", "score"),
    [
        ("dock", "dock_2018", (10.0, 10.0), 1, 10.0),
        ("dock", "dock_2018", (10.0, 10.0), 2, 20.0),
        ("scan_dock_deliver", "dock_2022", (15.0, 5.0), 3, 15.0),
        ("scan_dock_deliver", "dock_2022", (15.0, 5.0), 2, 20.0),
    ],
)
def test_a_wrong_bay_has_points_too(kind, dock, points, bay, score):
    internal, _, external, _ = ZONES[dock][bay - 1]
    values = {"dock_bonus_points": points[0], "correct_dock_bonus_points": points[1]}
    run = Run(docking(dock, type=kind, holes=[], balls=[], **values)).go(boat=internal).go(10.0).go(boat=external)
    assert (run.over, run.score) == (True, score)
    word = "right" if score == sum(points) else "wrong"
    assert run.lines[-1] == f"wamv backs out of bay{bay}, the {word} bay: {score:g} points"


def test_several_bays_may_be_right():
    for bay in (0, 1):
        internal, _, external, _ = ZONES["dock_2018"][bay]
        run = Run(docking("dock_2018", right=(1, 2))).go(boat=internal).go(10.0).go(boat=external)
        assert run.score == 20.0


def test_a_stay_of_just_the_time_counts_at_the_rate_of_frames():
    run = Run(docking()).stay(10.0, BAY)
    assert run.progress["docked"] == []
    assert run.progress["time_in_bay"] == pytest.approx(9.95)
    assert run.go().progress["docked"] == ["bay2"]


def test_who_leaves_early_begins_anew():
    run = Run(docking()).stay(9.95, BAY).go(boat=(1.45, 9.8, 0.0)).stay(9.95, BAY).go(boat=OUT)
    assert (run.over, run.score, run.progress["docked"]) == (False, 0.0, [])
    assert run.lines[1] == "wamv leaves bay2 after 9.95 s, too early: 10 s are needed"
    run.go(boat=BAY).go(10.0).go(boat=OUT)
    assert (run.over, run.score) == (True, 20.0)


def test_docked_is_docked_however_long_the_way_out():
    run = Run(docking()).go(boat=BAY).go(10.0).go(boat=AWAY).stay(5.0, AWAY)
    assert not run.over
    assert run.go(boat=OUT).over


def test_the_points_are_for_the_bay_backed_out_of():
    """In the right bay for long enough, out of another one: nothing, until that one is docked in as well."""
    first, _, before_first, _ = ZONES["dock_2022"][0]
    run = Run(docking()).go(boat=BAY).go(10.0).go(boat=before_first)
    assert not run.over
    run.go(boat=first).go(10.0).go(boat=before_first)
    assert (run.over, run.score) == (True, 15.0)
    assert run.progress["docked"] == ["bay2", "bay1"]


def test_a_boat_docks_once():
    run = Run(docking()).go(boat=BAY).go(10.0).go(boat=OUT)
    before = run.referee.dump()
    run.go(boat=BAY).go(10.0).go(boat=OUT)
    assert run.referee.dump() == before


def test_points_stay_when_time_is_up():
    run = Run(docking(durations=[0.0, 0.0, 30.0])).go(messages=[("color_sequence", ["red", "green", "blue"])])
    run.go(10.0, boat=BAY).go(20.0)
    assert (run.over, run.referee.status.timed_out, run.score) == (True, True, 10.0)


def test_a_hit_costs_nothing():
    run = Run(docking()).go(boat=BAY).go(10.0, touches={"dock": 9.0}).go(boat=OUT)
    assert (run.score, run.referee.status.collisions) == (20.0, 1)


def test_backing_out_before_the_task_runs_ends_it_without_points():
    run = Run(docking(durations=[1.0, 19.0, 300.0])).go(boat=BAY).go(10.0).go(1.0, boat=OUT)
    assert run.referee.status.phase == "finished"
    assert run.score == 0.0
    assert run.lines[-1] == "wamv backs out of bay2, the right bay: no points before the task runs"


def test_vrx3_times_the_stay_from_running_on():
    run = Run(docking(durations=[1.0, 19.0, 300.0], profile="vrx3")).go(boat=BAY).go(10.0).go(1.0, boat=OUT)
    assert run.referee.status.phase == "ready"
    assert run.progress["docked"] == []
    run.go(1.0, boat=BAY).go(9.0).go(9.0)
    assert run.progress["docked"] == []
    assert run.go(1.0).progress["docked"] == ["bay2"]


def test_vrx_times_the_stay_from_the_start_on():
    run = Run(docking(durations=[1.0, 19.0, 300.0]), boat=BAY).go(15.0).go(5.5)
    run.go(4.5)
    assert run.progress["docked"] == ["bay2"]
    assert run.go(1.0, boat=OUT).score == 20.0


def test_only_the_tasks_boat_docks():
    run = Run(docking()).go(others=[("wamv2", BAY)]).go(10.0, others=[("wamv2", BAY)])
    run.go(others=[("wamv2", OUT)])
    assert (run.over, run.score, run.lines) == (False, 0.0, [])


def test_zones_go_with_a_dock_that_drifts():
    run = Run(docking(), dock=pose(10.0, 20.0, yaw=0.3)).go(boat=BAY)
    for second in range(10):
        run.go(1.0, dock=pose(10.0 + second, 20.0 - second, yaw=0.3 - 0.1 * second))
    assert run.progress["docked"] == ["bay2"]


def test_a_dock_that_drifts_may_leave_a_boat_behind():
    """The boat is at rest in the world; the bay is 1.5 m wide and the dock drifts across it."""
    referee = docking()
    for number in range(40):
        place = pose(1.45, 9.0)
        referee.look(frame(number * 0.5, place, dock=pose(0.0, 0.1 * number), **{BALL: pose(z=-200.0)}))
        assert referee.progress["bay"] == ("bay2" if number <= 7 else "")


def test_a_zone_heels_with_its_dock():
    """Heeled by 0.4 rad about x, bay 3 at y = 15 is lifted by 5.8 m: a boat on the water is no more in it."""
    heeled = Pose(0.0, 0.0, 0.0, quaternion(0.4, 0.0, 0.0))
    run = Run(docking(), dock=heeled).go(boat=(1.45, 15.0, 0.0))
    assert run.progress["bay"] == "bay3"
    referee = docking()
    referee.look(frame(0.0, (1.45, 15.0), dock=heeled, **{BALL: pose(z=-200.0)}))
    assert referee.progress["bay"] == ""


# Balls, colours and symbols of the docking tasks, with scores by hand


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
    way = Box(center=(5.95, 9.6, 2.83), size=(0.5, 0.5, 0.5))
    assert crosses(way, (6.6, 9.6, 3.03), (2.3, 9.6, 1.7))


@pytest.mark.parametrize(("share", "score"), [(0.999, 5.0), (1.001, 0.0)])
def test_what_is_too_fast_for_a_ball_was_shot_anew(share, score):
    length = MAX_BALL_SPEED * 0.05 * share
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

    met = crosses(Box(center=center, size=size), start, end)
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
