"""A task in a run: its referee sees the same whoever records, steers or resumes, and a recording scores alike."""

import math
from itertools import pairwise

import pytest

import vrx_mj
from vrx_mj.errors import CommandError, RecordError, StateError
from vrx_mj.recording import read_record
from vrx_mj.recording.checks import rescore

GOAL = [10.0, 0.0, 0.5]
SHORT = {"initial_state_duration": 1, "ready_state_duration": 1, "running_state_duration": 6}
SEA = {"gain": 0.3, "period": 4.0}
BUOYS = [{"name": "near", "model": "mb_marker_buoy_red", "pose": [6, 1, 0.3, 0, 0, 0]}]


def world(**more):
    task = {"type": "stationkeeping", "goal_cart": GOAL, **SHORT}
    return {"name": "bay", "sea": SEA, "spawn": {"sensors": "none", "thrusters": "H"}, "task": task, **more}


def ahead(obs, t):
    return {"wamv": {"left": 1.0, "right": 0.9}}


@pytest.fixture(scope="module")
def sim():
    return vrx_mj.Simulation(vrx_mj.compile_world(world(objects=BUOYS)))


@pytest.fixture(autouse=True)
def _fresh(sim):
    sim.reset()


def test_a_run_lasts_until_the_task_is_finished(sim):
    summary = vrx_mj.run(sim, controller=ahead)
    assert summary.sim_time == pytest.approx(8.0)
    assert (summary.task.state, summary.task.timed_out, summary.task.unit) == ("finished", True, "m")
    assert summary.task.score == sim.task["score"] > 0.0


@pytest.mark.parametrize(("duration", "state", "scored"), [(1.5, "ready", False), (4.0, "running", True)])
def test_a_run_has_no_score_before_its_task_has_started(sim, duration, state, scored):
    task = vrx_mj.run(sim, duration, controller=ahead).task
    assert (task.state, task.score is not None) == (state, scored)


def test_the_score_is_the_mean_error_of_the_frames_of_the_run(sim):
    """The same sum by hand, from the boat's pose at each twentieth of a second."""
    errors = []
    sim.advance(200)
    while sim.task["state"] != "finished":
        seen = sim.observe()["wamv"]
        distance = math.hypot(GOAL[0] - seen.position[0], GOAL[1] - seen.position[1])
        errors.append(distance + 0.75**distance * abs(math.remainder(GOAL[2] - seen.heading, math.tau)))
        sim.step({"wamv": {"left": 1.0, "right": 0.9}}, duration=0.05)
    assert len(errors) == 120
    assert sim.task["score"] == pytest.approx(sum(errors) / 120, rel=1e-12)


def test_neither_recording_nor_how_it_advances_changes_a_score(sim, tmp_path):
    plain = vrx_mj.run(sim, 8.0, controller=ahead)
    sim.reset()
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        recorded = vrx_mj.run(sim, 8.0, controller=ahead)
    assert recorded.task == plain.task
    assert recorded.state_sha256 == plain.state_sha256
    sim.reset()
    for tenth in range(80):
        sim.command("wamv", **ahead(None, tenth)["wamv"])
        for part in (1, 2, 3, 4):
            sim.advance(part)
    assert sim.task["score"] == plain.task.score
    assert sim.get_state().sha256 == plain.state_sha256


def test_a_recording_scores_as_the_run_did(sim, tmp_path):
    with vrx_mj.record(sim, tmp_path / "run.rrd", sea=False):
        summary = vrx_mj.run(sim, controller=ahead)
    referee, events = rescore(tmp_path / "run.rrd")
    assert referee.status.score == summary.task.score
    assert referee.status.collisions == summary.task.num_collisions
    assert events == summary.task.events


def test_a_recording_that_begins_in_the_middle_scores_as_the_run_did(sim, tmp_path):
    vrx_mj.run(sim, 3.5, controller=ahead)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sea=False):
        summary = vrx_mj.run(sim, controller=ahead)
    assert rescore(tmp_path / "run.rrd")[0].status.score == summary.task.score


def test_a_resumed_run_scores_as_the_uninterrupted_one(sim):
    vrx_mj.run(sim, 3.5, controller=ahead)
    state = vrx_mj.State.from_bytes(sim.get_state().to_bytes())
    vrx_mj.run(sim, 4.5, controller=ahead)
    score, end = sim.task["score"], sim.get_state().sha256
    sim.set_state(state)
    assert sim.task["elapsed_time"] == pytest.approx(1.5)
    vrx_mj.run(sim, 4.5, controller=ahead)
    assert (sim.task["score"], sim.get_state().sha256) == (score, end)


def test_a_recording_without_a_task_has_no_score(tmp_path):
    sim = vrx_mj.Simulation(vrx_mj.compile_world({"name": "pond", "spawn": {"sensors": "none"}}))
    with vrx_mj.record(sim, tmp_path / "run.rrd", sea=False):
        sim.advance(10)
    with pytest.raises(RecordError, match=r"run.rrd' has no score: its world, pond, has no task$"):
        rescore(tmp_path / "run.rrd")
    assert read_record(tmp_path / "run.rrd").frames == ()
    with pytest.raises(CommandError, match=r"^'landmark' cannot be sent: this world has no task$"):
        sim.send("landmark", {})
    assert sim.task is None
    with pytest.raises(KeyError, match="task"):
        sim.observe()["task"]


def test_a_boat_is_held_until_the_task_is_ready(sim):
    for _ in range(10):
        sim.step({"wamv": {"left": 1.0, "right": 0.3}}, duration=0.1)
    held = sim.observe()["wamv"]
    assert held.position[:2] == pytest.approx([0.0, 0.0], abs=0.02)
    assert held.heading == pytest.approx(0.0, abs=0.01)
    assert abs(held.velocity[2]) + abs(held.angular_velocity[0]) > 1e-4  # heaves and rolls on
    sim.step({"wamv": {"left": 1.0, "right": 1.0}}, duration=2.0)
    assert sim.observe()["wamv"].position[0] > 0.5


def test_a_boat_that_is_put_somewhere_is_let_go(sim):
    sim.set_boat("wamv", pose=(-20, 5, 0.0, 0, 0, 1.0))
    sim.step({"wamv": {"left": 0.5, "right": 0.5}}, duration=0.5)
    assert sim.observe()["wamv"].position[:2] == pytest.approx([-20, 5], abs=0.5)


def test_boats_alone_are_met_by_who_goes_through_what_is_seen(sim):
    seen = sim.observe()
    assert list(seen) == ["wamv"]
    assert seen["task"]["state"] == "initial"
    assert seen["task"]["ready_time"] == 1.0
    assert seen.get("task") is seen["task"]
    assert seen.get("nobody", 1) == 1


def test_a_hit_is_counted_and_told(sim):
    vrx_mj.run(sim, 8.0, controller=ahead)
    hits = [time for time, text, _ in sim.task_events if text.startswith("stationkeeping: wamv hits near, collision")]
    assert len(hits) == sim.task["num_collisions"] > 0
    assert hits[0] > 3.0  # VRX counts none in the first seconds of the dead time
    assert all(later - earlier > 2.9 for earlier, later in pairwise(hits))  # told at the next frame


def test_the_other_boats_hits_are_its_own():
    fleet = {"boats": [{"name": "judged", "pose": [0, 30, 0, 0, 0, 0]}, {"name": "other", "pose": [2, 0, 0, 0, 0, 0]}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world(objects=BUOYS), fleet=fleet))
    vrx_mj.run(sim, 8.0, controller=lambda obs, t: {"other": {"left": 1.0, "right": 1.0}})
    assert sim.observe_object("near").position[0] > 6.2
    assert sim.task["num_collisions"] == 0


def test_a_message_that_the_task_does_not_take_is_refused(sim):
    with pytest.raises(CommandError, match=r"^station-keeping takes no message 'landmark'; known: none$"):
        sim.send("landmark", {"type": "mb_marker_buoy_red", "x": 1.0, "y": 2.0})
    with pytest.raises(CommandError, match=r"^invalid message 'landmark': plain data with finite numbers is needed: "):
        sim.send("landmark", {"x": math.nan})


def test_a_state_of_a_run_without_a_task_is_refused(sim):
    state = sim.get_state()
    with pytest.raises(StateError, match=r"^the state does not fit this run: only one of them has a task"):
        sim.set_state(vrx_mj.State(**{**vars(state), "task": ""}))


def test_the_referee_says_the_same_in_every_run(sim):
    first = vrx_mj.run(sim, controller=ahead)
    sim.reset()
    assert vrx_mj.run(sim, controller=ahead).task == first.task
