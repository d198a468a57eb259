import json
from dataclasses import replace

import numpy as np
import pytest

import recorded_run
from trees import partial, task_of
from vrx_mj.recording.reader import SavedState, read_record
from vrx_mj.recording.session import RecordWriter
from vrx_mj.recording.task_chunks import FATES, PLOT, WORDS, TaskChunks, task_chunks, words
from vrx_mj.runtime.state import STATE_VERSION, State
from vrx_mj.tasks import make_referee
from vrx_mj.tasks.referee import FrameLayout

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
