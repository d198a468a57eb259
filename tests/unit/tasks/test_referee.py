"""The referee: phases, times, collisions, and its state; for every type of task where that makes sense."""

import json
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from unit.tasks.samples import SAMPLES, restless, sample
from unit.tasks.streams import begin, frame, pose, task
from vrx_mj.errors import CommandError, StateError, UnknownNameError
from vrx_mj.tasks import TASK_KINDS, make_referee
from vrx_mj.tasks.referee import Message, Referee, Release, dead_time

GOAL = {"x": 0.0, "y": 0.0, "yaw": 0.0, "latitude": None, "longitude": None}
TYPES = sorted(TASK_KINDS)


def station(**values):
    return make_referee(
        task("stationkeeping", **{"goal": GOAL, "heading": True, "durations": [10.0, 10.0, 300.0], **values})
    )


def phases(referee, times, boat=None):
    found = []
    for time in times:
        referee.look(frame(time, boat))
        found.append(referee.status.phase)
    return found


def test_phases_follow_the_clock():
    referee = station()
    assert phases(referee, (0.0, 9.95, 10.0, 19.95, 20.0, 319.95, 320.0, 321.0)) == [
        *["initial"] * 2,
        *["ready"] * 2,
        *["running"] * 2,
        *["finished"] * 2,
    ]
    assert referee.info == {
        "type": "stationkeeping",
        "name": "stationkeeping",
        "boat": "wamv",
        "state": "finished",
        "ready_time": 10.0,
        "running_time": 20.0,
        "elapsed_time": 300.0,
        "remaining_time": 0.0,
        "timed_out": True,
        "num_collisions": 0,
        "score": 0.0,
    }


def test_a_phase_begins_though_the_clock_is_a_rounded_sum():
    time = sum([0.01] * 1000)
    assert time < 10.0
    assert phases(station(), (0.0, time)) == ["initial", "ready"]


def test_without_durations_a_phase_begins_at_each_frame():
    referee = station(durations=[0, 0, 0])
    assert phases(referee, (0.0, 0.05, 0.10), boat=(4, 0)) == ["ready", "running", "finished"]
    assert (referee.status.timed_out, referee.status.elapsed, referee.status.score) == (True, 0.0, 4.0)


def test_times_are_counted_from_where_the_run_should_begin():
    referee = station()
    phases(referee, (0.0, 10.0, 20.0, 63.2))
    assert referee.status.elapsed == pytest.approx(43.2)
    assert referee.status.remaining == pytest.approx(256.8)


def test_the_log_tells_the_phases():
    referee = station()
    lines = [line for time in (0, 10, 20, 21, 320) for line in referee.look(frame(time, (3, 0))).lines]
    assert lines == [
        ("stationkeeping: ready", "INFO"),
        ("stationkeeping: running", "INFO"),
        ("stationkeeping: time is up after 300.0 s, score 3.000, collisions 0", "INFO"),
    ]


@pytest.mark.parametrize(("values", "released"), [({}, True), ({"locked": False}, False), ({"held": True}, False)])
def test_the_boat_is_let_go_when_ready(values, released):
    referee = station(**values)
    assert referee.look(frame(0.0)).actions == ()
    assert referee.look(frame(10.0)).actions == ((Release("wamv"),) if released else ())
    assert referee.look(frame(20.0)).actions == ()


@dataclass
class Nothing:
    """A state without anything."""


class Early(Referee):
    """Sets scores and ends as the test wants."""

    def __init__(self, timeout=None, end=None):
        super().__init__(task("stationkeeping", durations=[1.0, 1.0, 10.0]), Nothing())
        self._timeout, self._end = timeout, end

    def update(self, frame):
        self.set_score(5.0)
        if self._end is not None and frame.time >= self._end:
            self.finish()

    def timeout_score(self):
        return self._timeout


def test_a_score_is_written_only_while_the_task_runs():
    referee = Early()
    scores = []
    for time in (0.0, 1.0, 1.5, 2.0):
        referee.look(frame(time))
        scores.append(referee.status.score)
    assert scores == [0.0, 0.0, 0.0, 5.0]


@pytest.mark.parametrize(("timeout", "score"), [(None, 5.0), (200.0, 200.0), (0.0, 5.0), (-1.0, 5.0)])
def test_a_score_for_time_out_counts_if_it_is_above_0(timeout, score):
    referee = Early(timeout=timeout)
    phases(referee, (1.0, 2.0, 12.0))
    assert (referee.status.timed_out, referee.status.score) == (True, score)


def test_rules_that_end_a_task_do_not_time_it_out():
    referee = Early(timeout=200.0, end=4.5)
    assert phases(referee, (1.0, 2.0, 4.45, 4.5, 5.0, 99.0)) == ["ready", *["running"] * 2, *["finished"] * 3]
    assert (referee.status.timed_out, referee.status.elapsed, referee.status.score) == (False, 2.5, 5.0)
    assert referee.is_over


def test_plain_rules_take_no_message_and_have_no_outputs():
    with pytest.raises(CommandError) as error:
        Early().accept("hello", None)
    assert str(error.value) == "the task takes no message 'hello'; known: none"
    assert Early().outputs == {}
    assert Early().progress == {}


# Collisions


def hits(referee, *touches):
    """Numbers of collisions after frames with the latest touches: by name, or of a pier."""
    found = []
    for touch in touches:
        named = touch if isinstance(touch, dict) else {"pier": touch}
        referee.look(frame(max(named.values()), touches=named))
        found.append(referee.status.collisions)
    return found


def test_a_hit_within_the_dead_time_of_the_last_does_not_count():
    assert hits(station(), 5.0, 6.0, 8.0, 8.05, 11.0, 11.10) == [1, 1, 1, 2, 2, 3]


def test_the_first_seconds_are_dead_as_in_vrx():
    assert hits(station(), 1.0, 3.0, 3.01) == [0, 0, 1]


def test_hits_count_in_every_phase():
    referee = station()
    assert hits(referee, 5.0, 15.0, 25.0) == [1, 2, 3]


def test_after_the_end_nothing_counts():
    referee = station()
    phases(referee, (0.0, 10.0, 20.0, 320.0))
    assert hits(referee, 321.0) == [0]
    assert referee.look(frame(330.0, touches={"pier": 330.0})).lines == ()


def test_one_hit_a_frame_and_the_latest_is_named():
    referee = station()
    verdict = referee.look(frame(5.0, touches={"a": 4.9, "b": 5.0, "c": 5.0, "d": 0.5}))
    assert verdict.lines == (("stationkeeping: wamv hits c, collision 1", "WARN"),)
    assert hits(referee, {"a": 4.9, "b": 5.0, "c": 5.0}, {"a": 9.0, "b": 9.0, "c": 5.0}) == [1, 2]


def test_a_touch_that_is_long_over_does_not_count_when_the_dead_time_ends():
    assert hits(station(), 5.0, 7.0, {"pier": 7.0, "x": 0.0}) == [1, 1, 1]
    referee = station()
    hits(referee, 5.0, 7.0)
    referee.look(frame(50.0, touches={"pier": 7.0}))
    assert referee.status.collisions == 1


def test_another_boat_is_hit_as_anything_else_and_its_own_hits_are_not_seen():
    referee = station()
    referee.look(frame(5.0, rival=(50, 0)))
    assert referee.status.collisions == 0
    referee.look(frame(6.0, touches={"rival": 6.0}, rival=(1, 0)))
    assert referee.status.collisions == 1


def test_the_scored_boat_is_the_one_that_the_task_names():
    referee = station(boat="second", durations=[0, 0, 300])
    begin(referee, boat=(400, 0), second=(3, 0))
    assert referee.status.score == 3.0
    assert referee.watched == ("second",)


@pytest.mark.parametrize(
    ("profile", "buffer", "seconds"),
    [("vrx", 3.0, 3.0), ("vrx", 10.0, 10.0), ("vrx", 2.9, 2.0), ("vrx", 0.5, 0.0), ("vrx3", 10.0, 3.0)],
)
def test_the_dead_time_is_cut_to_whole_seconds_and_in_vrx3_always_3(profile, buffer, seconds):
    assert dead_time(task("stationkeeping", profile=profile, collision_buffer=buffer)) == seconds


def test_without_a_dead_time_every_later_touch_counts():
    assert hits(station(collision_buffer=0.0), 0.05, 0.05, 0.10) == [1, 1, 2]


# All types


FORMS = {"number": float, "numbers": list, "text": str, "place": dict, "places": list}


@pytest.mark.parametrize("kind", TYPES)
def test_records_list_all_outputs_in_their_forms(kind):
    referee, seen = make_referee(sample(kind)), {}
    for each in restless(kind, 1):
        referee.look(each)
        seen |= referee.outputs
    forms = TASK_KINDS[kind].outputs
    assert seen.keys() == forms.keys()
    assert all(form is None or isinstance(seen[key], FORMS[form]) for key, form in forms.items())


def test_an_unknown_type():
    with pytest.raises(UnknownNameError) as error:
        make_referee(task("wayfindin"))
    assert str(error.value) == "no task type named 'wayfindin'; did you mean 'wayfinding'?"


def run(referee, frames):
    return [referee.look(each) for each in frames]


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
@pytest.mark.parametrize("kind", TYPES)
@settings(max_examples=10)
@given(seed=st.integers(0, 10**6), cut=st.integers(0, 250))
def test_a_dump_goes_on_exactly(kind, profile, seed, cut):
    whole = make_referee(sample(kind, profile))
    frames = restless(kind, seed)
    first = make_referee(sample(kind, profile))
    run(whole, frames[:cut])
    run(first, frames[:cut])
    saved = json.loads(json.dumps(first.dump()))
    second = make_referee(sample(kind, profile))
    run(second, frames[: cut // 2])  # what it had seen is forgotten
    second.load(saved)
    assert run(second, frames[cut:]) == run(whole, frames[cut:])
    assert json.dumps(second.dump()) == json.dumps(whole.dump())
    assert (second.outputs, second.progress, second.info) == (whole.outputs, whole.progress, whole.info)


@pytest.mark.parametrize("kind", TYPES)
def test_the_same_frames_give_the_same_dump_also_after_a_restart(kind):
    referee = make_referee(sample(kind))
    fresh = json.dumps(referee.dump())
    frames = restless(kind, 7)
    verdicts = run(referee, frames)
    dumped = json.dumps(referee.dump())
    referee.restart()
    assert json.dumps(referee.dump()) == fresh
    assert run(referee, frames) == verdicts
    assert json.dumps(referee.dump()) == dumped != fresh


@pytest.mark.parametrize("kind", TYPES)
def test_every_task_ends_and_says_so(kind):
    referee = make_referee(sample(kind))
    verdicts = run(referee, restless(kind, 3))
    assert referee.is_over
    assert sum("after" in text and "score" in text for each in verdicts for text, _ in each.lines) >= 1
    json.dumps([referee.info, referee.outputs, referee.progress])


@pytest.mark.parametrize("kind", TYPES)
def test_no_task_looks_at_bodies_that_it_does_not_name(kind):
    referee = make_referee(sample(kind))
    for each in restless(kind, 5):
        few = {name: each.poses[name] for name in referee.watched}
        referee.look(type(each)(each.time, few, each.touches, each.messages))
    assert referee.watched[0] == "wamv"


@pytest.mark.parametrize("kind", TYPES)
def test_no_task_takes_a_message_that_it_does_not_know(kind):
    with pytest.raises(CommandError, match="takes no message 'nonsense'"):
        make_referee(sample(kind)).accept("nonsense", 1)


@pytest.mark.parametrize("kind", [kind for kind, each in SAMPLES.items() if each.message is not None])
def test_some_tasks_take_messages(kind):
    referee = make_referee(sample(kind))
    run(referee, restless("dock", 1)[:25])  # 1.2 s: it runs
    assert referee.status.phase == "running"
    topic, content = SAMPLES[kind].message
    assert referee.accept(topic, content) == Message(topic, content)


@pytest.mark.parametrize("kind", TYPES)
def test_outputs_are_the_teams_to_keep(kind):
    referee = make_referee(sample(kind))
    frames = restless(kind, 11)
    run(referee, frames[:100])
    kept = referee.outputs
    before = json.dumps(kept)
    run(referee, frames[100:])
    assert json.dumps(kept) == before


def test_a_state_of_another_task():
    saved = make_referee(sample("wayfinding")).dump()
    with pytest.raises(StateError) as error:
        make_referee(sample("perception")).load(saved)
    assert str(error.value) == "the state is of the task 'wayfinding', not 'perception'"


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda saved: saved.pop("sheet"), "sheet: expected keys and values, got nothing"),
        (lambda saved: saved.update(rules=[]), "rules: expected keys and values, got []"),
        (lambda saved: saved["rules"].update(more=1), "rules: unknown or missing: more"),
        (
            lambda saved: saved["sheet"].update(phase="over"),
            "sheet: phase: expected initial, ready, running or finished, got 'over'",
        ),
        (lambda saved: saved["sheet"].update(collisions=-1), "sheet: collisions: must be at least 0, got -1"),
        (
            lambda saved: saved["sheet"].update(collisions=10**400),
            "sheet: collisions: must be at most 9007199254740992, got a number of more than 60 digits",
        ),
        (lambda saved: saved["rules"].update(errors=["far"]), "rules: errors[0]: expected a number, got 'far'"),
    ],
)
def test_a_state_with_holes_changes_nothing(spoil, reason):
    referee = make_referee(sample("wayfinding"))
    run(referee, restless("wayfinding", 1)[:100])
    before, saved = referee.dump(), referee.dump()
    spoil(saved)
    with pytest.raises(StateError) as error:
        referee.load(saved)
    assert str(error.value) == f"the state does not fit the task 'wayfinding': {reason}"
    assert referee.dump() == before


@pytest.mark.parametrize("kind", TYPES)
def test_lists_of_a_course_keep_their_lengths_in_a_state(kind):
    referee = make_referee(sample(kind))
    rules = referee.dump()["rules"]
    for key, first in rules.items():
        if isinstance(first, list) and first:
            with pytest.raises(StateError) as error:
                referee.load({**referee.dump(), "rules": {**rules, key: first[1:]}})
            assert str(error.value) == f"the state does not fit the task '{kind}': rules: a list of another length"


@pytest.mark.parametrize(
    ("kind", "part", "reason"),
    [
        ("wayfinding", {"errors": [1.0]}, "1 of 2 errors"),
        ("dock", {"hits": [{"size": "small"}]}, "a hit needs time, ball, bay, size, points"),
        ("wildlife", {"animals": [{"x": 1.0}]}, "an animal needs latitude, longitude, name, x, y, yaw, z"),
    ],
)
def test_what_teams_see_is_whole_in_a_state(kind, part, reason):
    referee = make_referee(sample(kind))
    saved = referee.dump()
    with pytest.raises(StateError) as error:
        referee.load({**saved, "rules": saved["rules"] | part})
    assert str(error.value) == f"the state does not fit the task: {reason}"


def test_a_stand_knows_its_yaw():
    assert pose(yaw=2.5).yaw == pytest.approx(2.5)
    assert pose(yaw=-3.0).yaw == pytest.approx(-3.0)
