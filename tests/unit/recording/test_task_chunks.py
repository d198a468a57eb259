import json
from dataclasses import replace

import numpy as np
import pytest

import recorded_run
from fingerprints import check
from integration.test_fingerprints_recordings import columns_of
from trees import partial, task_of
from vrx_mj.recording import task_chunks as task_chunks_module
from vrx_mj.recording.reader import SavedState, read_record
from vrx_mj.recording.session import RecordWriter
from vrx_mj.recording.task_chunks import FATES, PLOT, WORDS, TaskChunks, task_chunks, touch_chunks, words
from vrx_mj.runtime.state import STATE_VERSION, State
from vrx_mj.runtime.subscriptions import Touch
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.referee import FrameLayout, TaskStatus

BUOYS = {"red_0": (5.0, 10.0), "green_0": (-5.0, 10.0), "red_1": (5.0, 30.0), "green_1": (-5.0, 30.0)}
TASK = task_of({
    "type": "follow_path", "name": "path", "boat": "wamv", "profile": "vrx", "durations": [1.0, 1.0, 300.0],
    "collision_buffer": 3.0, "locked": True, "held": False, "rivals": ["red_1"],
    "gates": [{"left": "red_0", "right": "green_0"}, {"left": "red_1", "right": "green_1"}],
    "points_per_gate_crossed": 10.0, "bonus": 1.0, "obstacle_penalty": 3.0, "fixed": {},
})  # fmt: skip
PARAMETERS = partial(
    recorded_run.PARAMETERS
    | {
        "wind": {"mean": 0.0, "gain": 0.0, "direction": [1.0, 0.0]},
        "task": TASK,
        "objects": [{"name": name, "pose": [*place, 0.0, 0.0, 0.0, 0.0]} for name, place in BUOYS.items()],
        "floats": [],
        "docks": [],
        "boats": [{"name": "wamv", "pose": [0.0] * 6, "color": None}],
    }
)
TASKLESS = partial(recorded_run.PARAMETERS)
RATE = 20


def frames(start, end, speed=2.0, drift=0.0):
    """A boat goes north at `speed` [m/s] from 2 s on and touches a buoy at 12 s; buoys drift east at `drift` [m/s]."""
    layout = FrameLayout.of(TASK, make_referee(TASK).watched)
    rows = []
    for step in range(round(start * RATE), round(end * RATE)):
        t = step / RATE
        places = {"wamv": (0.0, max(0.0, t - 2.0) * speed)} | {n: (x + drift * t, y) for n, (x, y) in BUOYS.items()}
        stands = [(*places[name], 0.0, 1.0, 0.0, 0.0, 0.0) for name in layout.watched]
        rows.append((t, np.array([t, *np.ravel(stands), 12.0 if t >= 12.0 else -1.0]), []))
    return rows


def lines_and_marks(chunks):
    """Lines of the log, and the times of marks by their kind."""
    lines, marks = [], {}
    for chunk in chunks:
        columns = chunk.to_record_batch().to_pydict()
        times = [time.total_seconds() for time in columns.get("sim_time", ())]
        if chunk.entity_path == "/events/task":
            lines += [(time, text[0]) for time, text in zip(times, columns["TextLog:text"], strict=True)]
        elif chunk.entity_path.startswith("/marks/"):
            marks.setdefault(chunk.entity_path.removeprefix("/marks/"), []).extend(times)
    return lines, marks


def test_gates_and_scores_are_marks_and_lines():
    """The boat sets off at 2 s, crosses the first gate 5 s later, the second 15 s; touching a buoy costs points."""
    lines, marks = lines_and_marks(written(frames(0.0, 20.0)))
    assert marks["gates_passed"] == pytest.approx([7.05, 17.05], abs=0.1)
    assert "gates_missed" not in marks
    assert [text for _, text in lines] == ["score 10 points, +10", "score 7 points, -3", "score 19 points, +12"]
    assert marks["score_changes"] == [time for time, _ in lines]


def test_a_gate_that_is_passed_by_is_missed():
    first, last = TASK.gates
    course = replace(TASK, gates=(first, replace(last, right="red_0"), last))
    going = TaskChunks(partial({"task": course}))
    going.look((), frames(0.0, 20.0))
    lines, marks = lines_and_marks(going.chunks())
    assert [text for _, text in lines if "gate" in text] == ["gate 2 of 3 missed"]
    assert marks["gates_passed"] == pytest.approx([7.05, 17.05], abs=0.1)
    assert marks["gates_missed"] == marks["gates_passed"][1:]


def test_only_marks_that_a_world_may_have_are_in_the_legend():
    def named(parameters):
        return {path for chunk in task_chunks(parameters) if (path := chunk.entity_path).startswith("/marks/")}

    assert named(PARAMETERS) == {
        "/marks/contacts", "/marks/gates_passed", "/marks/gates_missed", "/marks/score_changes",
    }  # fmt: skip
    assert named(partial({"task": None})) == {"/marks/contacts"}


def judged(rows):
    """The referee after the rows."""
    referee = make_referee(TASK)
    layout = FrameLayout.of(TASK, referee.watched)
    for _, row, _ in rows:
        if not referee.is_over:
            referee.look(layout.frame(row.tolist()))
    return referee


def written(rows, states=(), block=RATE):
    """All chunks of rows that come a block at a time."""
    going = TaskChunks(PARAMETERS)
    for first in range(0, len(rows), block):
        going.look(states if first == 0 else (), rows[first : first + block])
    return list(going.chunks())


def series(chunks, path, component):
    """Times [s] and values of a component."""
    batches = [chunk.to_record_batch() for chunk in chunks if chunk.entity_path == path]
    times = [float(t) / 1e9 for batch in batches for t in batch.column("sim_time").to_numpy().astype(np.int64)]
    return times, [value for batch in batches for value in batch.column(component).to_pylist()]


def test_the_plot_goes_on_to_the_end_at_the_score_of_the_run():
    rows = frames(0.0, 40.0)
    times, values = series(written(rows), PLOT, "Scalars:scalars")
    referee = judged(rows)
    assert referee.is_over
    assert values[-1] == [referee.status.score, referee.status.collisions] == [10.0 - 3.0 + 10.0 + 2.0, 1.0]
    assert times[values.index(values[-1])] == pytest.approx(2.0 + referee.status.elapsed)
    assert times[-1] == pytest.approx(rows[-1][0])
    assert times == sorted(set(times))


@pytest.mark.parametrize(("end", "last"), [(0.0, 4.95), (4.95, 4.95), (7.5, 7.5)])
def test_the_plot_s_last_value_stands_at_the_end_of_the_run_if_it_is_later_than_the_last_frame(end, last):
    going = TaskChunks(PARAMETERS)
    going.look((), frames(0.0, 5.0))
    times, values = series(going.chunks(end), PLOT, "Scalars:scalars")
    assert (times[-1], values[-1]) == (last, [0.0, 0.0])
    assert times == sorted(set(times))


def test_phases_and_scores_are_states_and_the_result_says_who_scored_what():
    going = TaskChunks(PARAMETERS)
    going.look((), frames(0.0, 15.0))
    chunks = list(going.chunks())
    assert going.result == ""
    times, states = series(chunks, "/timeline/score", "StateChange:state")
    assert states == [["0 points"], ["10 points"], ["7 points"]]
    np.testing.assert_allclose(times, [2.0, 7.0, 12.0], atol=0.1)
    assert series(chunks, "/timeline/task", "StateChange:state")[1] == [["initial"], ["ready"], ["running"]]
    going.look((), frames(15.0, 40.0))
    assert going.result == "wamv, score 19 points"


def test_points_of_the_plot_are_changes_at_most_two_a_second():
    times, values = series(written(frames(0.0, 15.0)), PLOT, "Scalars:scalars")
    # before the task starts it has no score
    np.testing.assert_equal(values, [[np.nan, 0.0], [0.0, 0.0], [10.0, 0.0], [7.0, 1.0], [7.0, 1.0]])
    assert min(np.diff(times)) >= 0.5 - 1e-6
    np.testing.assert_allclose(times[1:], [2.0, 7.0, 12.0, 15.0], atol=0.5)


def test_gates_change_their_colours_when_they_are_passed():
    times, colors = series(written(frames(0.0, 40.0)), "/world/course/gates", "LineStrips3D:colors")
    fates = [[color >> 8 for color in row[::3]] for row in colors]  # of three lines each
    code = {name: (r << 16) + (g << 8) + b for name, (r, g, b) in FATES.items()}
    assert fates == [
        [code["next"], code["ahead"]],
        [code["crossed"], code["next"]],
        [code["crossed"], code["crossed"]],
    ]
    np.testing.assert_allclose(times, [0.0, 7.0, 17.0], atol=2.0 / RATE)


def test_the_arrow_points_where_a_gate_is_to_be_crossed():
    _, strips = series(written(frames(0.0, 1.0)), "/world/course/gates", "LineStrips3D:strips")
    bar, arrow = (np.array(strip) for strip in strips[0][:2])
    np.testing.assert_allclose(bar[:, :2], [[5, 10], [-5, 10]])
    np.testing.assert_allclose(arrow[:2, :2], [[0, 10], [0, 13.5]], atol=1e-6)  # red to starboard: north


def test_gates_follow_buoys_that_drift_but_not_at_every_frame():
    times, _ = series(written(frames(0.0, 60.0, speed=0.0, drift=0.2)), "/world/course/gates", "LineStrips3D:colors")
    assert len(times) == 12
    assert min(np.diff(times)) >= 5.0 - 1e-6


def test_a_recording_that_begins_in_a_run_goes_on_from_its_state():
    early, late = frames(0.0, 10.0), frames(10.0, 16.0)
    task = json.dumps({**judged(early).dump(), "seen": 0, "sent": [], "lines": []})
    state = State(STATE_VERSION, "", 0, early[-1][0], np.zeros(0), b"", 0, task).to_bytes()
    chunks = written(late, states=[SavedState(early[-1][0], state)])
    times, values = series(chunks, PLOT, "Scalars:scalars")
    assert values == [[10.0, 0.0], [7.0, 1.0], [7.0, 1.0]]
    assert times[0] == pytest.approx(early[-1][0])
    _, colors = series(chunks, "/world/course/gates", "LineStrips3D:colors")
    assert len(colors) == 1


def test_words_tell_phase_score_and_gates():
    chunks = written(frames(0.0, 40.0))
    _, texts = series(chunks, WORDS, "TextDocument:text")
    assert texts[0][0].startswith("**path: initial**, ready at 1 s  \n**no score yet**")
    assert texts[-1][0] == (
        "**path: finished**, done after 15.0 s  \n**score 19 points**, the higher the better; "
        "collisions **1**  \ngates 1✓ 2✓"
    )


@pytest.mark.parametrize(
    ("progress", "line"),
    [
        ({"waypoints": [1.234, 5.0]}, "least errors [m] 1.23, 5.00"),
        (
            {
                "animals": [
                    {"name": "turtle", "goal": "circumnavigate_clockwise", "status": "not_engaged", "circled": [1, 2]},
                    {"name": "croc", "goal": "avoid", "status": "engaged", "circled": []},
                ]
            },
            "- turtle not engaged, 2 of 8\n- croc engaged",
        ),
        (
            {"bay": "bay1", "time_in_bay": 3.2, "docked": ["bay1"], "hits": [{}], "colors": ["red", "green", "blue"]},
            "in bay1 for 3 s, docked in bay1, balls in holes 1, colours sent red green blue",
        ),
        ({"bay": "", "time_in_bay": 0.0, "docked": [], "hits": [], "colors": []}, "in no bay"),
        ({"objects": ["red", "green"], "up": [False, True], "errors": []}, "before the boat: green"),
        ({"objects": ["red"], "up": [False], "errors": []}, "before the boat: nothing"),
    ],
)
def test_words_tell_the_parts_of_every_task(progress, line):
    class Told:
        type, name, status = "follow_path", "task", judged([]).status

    Told.progress = progress
    assert words(Told).endswith("  \n" + line)


def test_nothing_is_written_without_a_task():
    going = TaskChunks(partial({"task": None}))
    going.look((), frames(0.0, 1.0))
    assert list(going.chunks()) == []


def test_a_run_that_flushes_every_second_writes_few_blocks():
    chunks = written(frames(0.0, 300.0, speed=0.0, drift=0.1))
    assert len(chunks) == len({chunk.entity_path for chunk in chunks})


@pytest.mark.parametrize("parameters", [TASKLESS, PARAMETERS])
def test_rows_stay_as_they_are(tmp_path, parameters):
    path = tmp_path / "run.rrd"
    with RecordWriter(path, replace(recorded_run.scene(), parameters=parameters)) as writer:
        for block in recorded_run.blocks(2.0):
            writer.rows(block)
        for frame in frames(0.0, 2.0) if parameters.task else ():
            writer.frame(*frame)
    record = read_record(path)
    assert record.complete
    assert record.rows.tobytes() == np.concatenate(list(recorded_run.blocks(2.0))).tobytes()


def test_a_file_grows_by_less_than_100_kb_in_300_s(tmp_path):
    sizes = []
    for name, parameters in (("without", TASKLESS), ("with", PARAMETERS)):
        path = tmp_path / f"{name}.rrd"
        with RecordWriter(path, replace(recorded_run.scene(), parameters=parameters)) as writer:
            for frame in frames(0.0, 300.0, speed=0.11, drift=0.05):
                writer.frame(*frame)
        sizes.append(path.stat().st_size)
    assert 1_000 < sizes[1] - sizes[0] < 100_000


class Referee:
    """Stands for one that comes from one status and progress to the next, a second each."""

    type, name, boat, watched = "gymkhana", "task", "wamv", ("wamv", *BUOYS)

    def __init__(self, *steps):
        self.steps = [*steps]
        self.look(None)

    def look(self, _frame):
        self.progress, status = self.steps.pop(0) if len(self.steps) > 1 else self.steps[0]
        self.status = TaskStatus(3.0, 1.0, 60.0, **{"phase": "running", "elapsed": 15.4} | status)
        self.is_over = self.status.phase == "finished"


PAIRS = [{"left": f"red_{number}", "right": f"green_{number}"} for number in range(2)]
UNLIT = {"light_buoy": "red_0", "color_sequence": ["red", "green", "blue"]}
BAYS = [
    {"symbol": "red_cross", "placard": "p", "name": f"bay{number}", "dock_allowed": number == 1,
     "internal": {"center": [4.0, y, 0.3], "size": [6.0, 5.0, 2.0]},
     "external": {"center": [-4.0, y, 1.5], "size": [2.0, 30.0, 2.0]}}
    for number, y in ((1, -3.0), (2, 3.0))
]  # fmt: skip
IN_DOCK = {"bay": "", "time_in_bay": 0.0, "docked": [], "hits": [], "colors": []}
ANIMALS = [("t", "circumnavigate_clockwise"), ("u", "circumnavigate_counterclockwise"), ("c", "avoid")]
SHOWN = {"time": 5.0, "duration": 3.0, "type": "buoy", "name": "red_0", "pose": [8.0, 2.0, 1.0, 0, 0, 0]}


def animals(*statuses):
    rows = zip(ANIMALS, statuses, strict=True)
    return {"animals": [{"name": name, "goal": goal, "status": own, "circled": [1]} for (name, goal), own in rows]}


TASKS = {
    "gates": (
        {"type": "navigation_course", "gates": PAIRS},
        [({"gates": ["ahead", "ahead"]}, {"phase": "initial"}), ({"gates": ["crossed", "ahead"]}, {"score": 1.5}),
         ({"gates": ["crossed", "missed"]}, {"score": 7.0, "collisions": 2}),
         ({"gates": ["crossed", "backwards"]}, {"phase": "finished", "score": 9.0, "timed_out": True})],
    ),
    "dock": (
        {"type": "dock", "anchor": "d", "bays": BAYS, **UNLIT},
        [(IN_DOCK, {}), (IN_DOCK | {"bay": "bay1", "time_in_bay": 2.0}, {}),
         (IN_DOCK | {"bay": "bay2"}, {"score": 2.0}),
         (IN_DOCK | {"docked": ["bay1"], "colors": ["red"]}, {"score": 5.0})],
    ),
    "wildlife": (
        {"type": "wildlife", "engagement_distance": 10.0,
         "animals": [{"name": name, "goal": goal} for name, goal in ANIMALS]},
        [(animals("never_engaged", "never_engaged", "never_engaged"), {}),
         (animals("engaged", "not_engaged", "never_engaged"), {}),
         (animals("circumnavigated", "engaged", "engaged"), {"score": 3.0})],
    ),
    "perception": (
        {"type": "perception", "boat": "wamv", "objects": [SHOWN]},
        [({"objects": ["red_0"], "up": [True], "errors": []}, {})] * 2,
    ),
    "sound": (
        {"type": "acoustic_perception", "pinger": {"x": -20.0, "y": 10.0}, "goal_tolerance": 3.0},
        [({}, {})] * 2,
    ),
}  # fmt: skip
"""Tasks, and what their referees come to."""


@pytest.mark.parametrize("name", TASKS)
def test_a_task_is_shown_as_it_was(name, monkeypatch):
    tree, steps = TASKS[name]
    things = [*(BUOYS | {"t": (0.0, 0.0), "u": (40.0, 0.0), "c": (0.0, 40.0)}).items()]
    rows = {
        "objects": [{"name": thing, "pose": [*place, 0.0, 0.0, 0.0, 0.0]} for thing, place in things],
        "docks": [{"name": "d", "pose": [50.0, 0.0, 0.0, 0.0, 0.0, 1.0]}],
        "lights": [{"name": "red_0", "pattern": ["off"] * 3}],
        "followers": [{"waypoint_start": 0, "waypoint_count": 3, "loop": 1}],
        "floats": [{"body": "t/link", "follower": 0}],
        "path_points": [{"position": [x, -30.0 + x]} for x in (-15.0, 0.0, 9.0)],
    }
    parameters = partial(
        {**vars(PARAMETERS), **rows, "task": task_of({"name": name, "boat": "wamv", "rivals": (), **tree})}
    )
    monkeypatch.setattr(task_chunks_module, "make_referee", lambda _: Referee(*steps))
    going = TaskChunks(parameters)
    for second in range(len(steps)):
        places = {"wamv": (0.0, 5.0 * second)} | {buoy: (x + 0.1 * second, y) for buoy, (x, y) in BUOYS.items()}
        going.look((), [(second, np.array([second, *np.ravel([(*at, 0, 1, 0, 0, 0) for at in places.values()])]), [])])
    still, moving = task_chunks(parameters), going.chunks(len(steps) + 3.0)
    found = [[[chunk.entity_path, *columns_of(chunk)] for chunk in chunks] for chunks in (still, moving)]
    check("tasks", name, still=found[0], moving=found[1], result=going.result)


def test_touches_are_shown_as_they_were():
    touches = [
        Touch("a", "b", 2.0, 500.0, point=(1.0, 2.0, 3.0), vector=(300.0, -400.0, 0.0)),
        Touch("a", "dock", 3.0, 4000.0, duration=4.0, point=(0.0, 0.0, 0.5), vector=(0.0, 0.0, 4000.0)),
        Touch("a", "c", 4.0, 5.0),
    ]
    found = [[chunk.entity_path, *columns_of(chunk)] for chunk in touch_chunks(touches)]
    check("tasks", "touches", found=found)
