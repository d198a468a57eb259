"""Scores from recordings: also of one that began in a run."""

import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from trees import partial
from unit.tasks.streams import task
from vrx_mj.errors import RecordError, StateError
from vrx_mj.recording.checks import rescore
from vrx_mj.recording.reader import Record, SavedState
from vrx_mj.runtime.state import STATE_VERSION, State
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.referee import FrameLayout, Message

GOAL = {"x": 0.0, "y": 0.0, "yaw": 0.0, "latitude": None, "longitude": None}
TASK = task("stationkeeping", goal=GOAL, heading=False)
TIMES = [0.05 * number for number in range(60)]


class Boats:
    """The boats that sailed together: what a rescoring reads of them."""

    world = SimpleNamespace(parameters=partial({"task": TASK}))


def row(time):
    """A boat that moves away ever faster, so that no frame is like another."""
    return np.array([time, time**2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def watched(until=None):
    """A referee that saw the frames from the first on, and its state after the one at `until`."""
    referee, kept = make_referee(TASK), None
    layout = FrameLayout.of(TASK, referee.watched)
    for time in TIMES:
        referee.look(layout.frame(row(time)))
        if time == until:
            kept = json.dumps({"seen": 0, "sent": [], "lines": [], **referee.dump()})
    return referee, kept


def record(times, states=()):
    fields = dict.fromkeys((field.name for field in dataclasses.fields(Record)), None)
    frames = tuple((0, row(time), ()) for time in times)
    return Record(**{**fields, "path": Path("run.rrd"), "companies": (Boats(),), "frames": frames, "states": states})


def test_the_score_of_a_recording_is_that_of_the_run():
    assert rescore(record(TIMES))[0].status == watched()[0].status


@pytest.mark.parametrize("first", [10, 33])
def test_a_recording_that_begins_in_a_run_goes_on_and_counts_no_frame_twice(first):
    begun = TIMES[first]
    referee, kept = watched(begun)
    blob = State(STATE_VERSION, "", 0, begun, np.zeros(1), b"", 0, kept).to_bytes()
    again, _ = rescore(record(TIMES[first:], (SavedState(begun, blob),)))
    assert again.status == referee.status
    assert again.dump() == referee.dump()


@pytest.mark.parametrize("kept", [None, json.dumps({"seen": 0, "sent": [], "lines": [], "type": "dock"})])
def test_a_recording_that_begins_with_another_state_is_refused(kept):
    blob = State(STATE_VERSION, "", 0, 0.5, np.zeros(1), b"", 0, kept).to_bytes()
    with pytest.raises(StateError, match=r"^'run\.rrd' begins with a state from which its task cannot continue: "):
        rescore(record(TIMES, (SavedState(0.5, blob),)))


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        ((0, row(0.0)[:-1], ()), "a frame of 7 numbers instead of 8"),
        ((0, row(0.0), (Message("nonsense", 1),)), "sent: station-keeping takes no message 'nonsense'"),
    ],
)
def test_frames_of_another_task_are_damage(frame, reason):
    damaged = dataclasses.replace(record([]), frames=(frame,))
    with pytest.raises(RecordError) as refused:
        rescore(damaged)
    assert str(refused.value).startswith(f"'run.rrd' is damaged: /record/frames: {reason}")
