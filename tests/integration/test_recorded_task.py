"""A recording shows how the task went: its plot ends at the score of the run, also where it begins in the middle."""

from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from vrx_mj.draw.course import map_of
from vrx_mj.recording.eyes import plan_eye
from vrx_mj.recording.session import viewable
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.recording.task_chunks import PLOT, WORDS

BUOYS = [
    {"name": name, "model": f"mb_marker_buoy_{color}", "pose": [x, y, 0.0, 0, 0, 0]}
    for name, color, x, y in (("red_bound_0", "red", 8, -6), ("green_bound_0", "green", 8, 6))
]
TASK = {
    "type": "follow_path", "gates": [["red_bound_0", "green_bound_0"]],
    "initial_state_duration": 0.5, "ready_state_duration": 0.5, "running_state_duration": 4,
}  # fmt: skip


@pytest.fixture(scope="module")
def sim():
    spawn = {"sensors": "none", "thrusters": "H"}
    return vrx_mj.Simulation(vrx_mj.compile_world({"name": "bay", "spawn": spawn, "objects": BUOYS, "task": TASK}))


def through_the_gate(sim, start):
    """Take the boat through the gate at `start` [s], until the task is finished."""
    sim.step(duration=start - sim.time)
    for x in (6.0, 7.0, 9.0, 10.0):
        sim.set_boat("wamv", pose=[x, 0.0, 0.1, 0.0, 0.0, 0.0])
        sim.step(duration=0.1)
    sim.step(duration=0.5)


def told(path, entity, component):
    from rerun.chunk import RrdReader

    stream = RrdReader(Path(path)).stream().filter(content=entity, components=component, is_static=False)
    return [value for chunk in stream for value in chunk.to_record_batch().column(component).to_pylist()]


@pytest.mark.parametrize("begun", [0.0, 1.5])
def test_the_plot_of_a_recording_ends_at_the_score_of_the_run(sim, tmp_path, begun):
    sim.reset()
    if begun:
        sim.step(duration=begun)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sea=False):
        through_the_gate(sim, 2.0)
    assert sim.task["state"] == "finished"
    assert told(tmp_path / "run.rrd", PLOT, "Scalars:scalars")[-1] == [sim.task["score"], sim.task["num_collisions"]]
    assert sim.task["score"] == 11.0
    assert told(tmp_path / "run.rrd", WORDS, "TextDocument:text")[-1][0].endswith("gates 1✓")


def views(path):
    """What the views of a recording have, whatever their order and identifiers."""
    from rerun.chunk import RrdReader

    reader = RrdReader(path)
    batches = [chunk.to_record_batch() for chunk in reader.stream(store=reader.blueprints()[0])]
    names = (
        "ViewBlueprint:display_name",
        "ViewContents:query",
        "EyeControls3D:tracking_entity",
        "EyeControls3D:position",
    )
    return {
        name: sorted(str(value) for batch in batches if name in batch.schema.names for value in batch[name].to_pylist())
        for name in names
    }


@pytest.mark.parametrize("sea", [True, False])
def test_a_boat_that_is_followed_later_is_shown_as_one_that_was_followed_from_the_start(sim, tmp_path, sea):
    for name, follow in {"then": "wamv", "later": None}.items():
        sim.reset()
        with vrx_mj.record(sim, tmp_path / f"{name}.rrd", sea=sea, follow=follow):
            through_the_gate(sim, 2.0)
    later = viewable(vrx_mj.read_record(tmp_path / "later.rrd"), "wamv", tmp_path)
    assert views(later) == views(tmp_path / "then.rrd")
    assert "['Task: wamv, score 11 points']" in views(later)["ViewBlueprint:display_name"]
    assert ("- /world/trails/**" in str(views(later)["ViewContents:query"])) is sea


def test_the_plan_holds_the_course(sim):
    sim.reset()
    (x, y), height = plan_eye(scene_of(sim), np.zeros((2, 2)))
    assert x == pytest.approx(4.0, abs=0.1)
    assert y - height / 2.0 < -6.0 < 6.0 < y + height / 2.0


def test_the_map_has_the_gate_in_the_direction_of_the_course(sim):
    (gate,) = map_of(sim.world).course.gates
    assert gate.middle == (8.0, 0.0)
    assert gate.yaw == pytest.approx(0.0)  # red to starboard of a boat that heads east
