"""Docking, with scores by hand."""

import pytest

from unit.tasks.docking import AWAY, BALL, BAY, OUT, ZONES, Run, docking
from unit.tasks.streams import frame, pose
from vrx_mj.frames import quaternion
from vrx_mj.tasks.frame import Pose


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
