"""A state that is NaN or huge stops the run, with a file to go on from."""

import math
import os
import re
import tempfile
from pathlib import Path

import numpy as np
import pytest

import vrx_mj
from integration.sailing import AHEAD, boats, simulation
from vrx_mj.errors import DivergedError
from vrx_mj.runtime import state
from vrx_mj.runtime.state import State

BUOY = {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [20, 3, 0, 0, 0, 0]}
MESSAGE = re.compile(
    r"(?P<name>\S+) has a state that is not finite, or huge, at step (?P<step>\d+) \(t = (?P<time>\S+) s\)\. "
    r"The state at t = (?P<good>\S+) s is in (?P<file>.+): State\.load reads it; "
    r"the last 10 such states are kept"
)


@pytest.fixture(autouse=True)
def _elsewhere(monkeypatch, tmp_path):
    """MuJoCo writes its log into the current folder."""
    monkeypatch.chdir(tmp_path)


def start():
    sim = simulation(boats((0.0, 0.0, 0.0), (50.0, 0.0, 1.0)), objects=[BUOY])
    sim.step({"a": AHEAD}, duration=2.5)
    return sim


def spoil_velocity(sim, value):
    sim.data.qvel[sim.model.joint("b/free").dofadr[0] + 1] = value


def spoil_pose(sim, value):
    sim.data.qpos[sim.model.joint("buoy/free").qposadr[0]] = value


def stopped(sim, steps):
    with pytest.raises(DivergedError) as caught:
        sim.advance(steps)
    found = MESSAGE.fullmatch(str(caught.value))
    assert found, str(caught.value)
    return found


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e9, -1e300])
@pytest.mark.parametrize(("spoil", "name"), [(spoil_velocity, "b"), (spoil_pose, "buoy")])
def test_a_run_that_diverges_names_the_body_the_step_and_the_last_good_state(spoil, name, value):
    sim = start()
    spoil(sim, value)
    found = stopped(sim, 10)
    assert (found["name"], found["step"], found["time"], found["good"]) == (name, "250", "2.5", "2")


def test_the_last_good_state_continues_the_run():
    sim = start()
    reached = sim.get_state().sha256
    spoil_velocity(sim, math.nan)
    state = vrx_mj.State.load(Path(stopped(sim, 10)["file"]))
    for run in (sim, vrx_mj.Simulation(sim.world)):
        run.set_state(state)
        assert run.time == pytest.approx(2.0)
        run.advance(50)
        assert run.get_state().sha256 == reached


def test_what_diverges_in_the_middle_of_an_advance_stops_there():
    """An engine that pushes with 10^12 N."""
    sim = simulation(edit=lambda tree: tree["thrusters"][0].update(mapping=0, max_forward=1e12))
    sim.step({"a": {"left": 0.0}}, duration=1.5)
    sim.command("a", left=1.0)
    found = stopped(sim, 200)
    assert found["name"] == "a"
    assert 150 < int(found["step"]) < 160
    assert found["good"] == "1"


@pytest.mark.parametrize("seconds", [0.5, 1.0])
def test_no_step_ends_in_a_state_that_is_not_finite(seconds):
    """Also where the step that breaks it is the last of an advance, or of a second."""
    sim = simulation(edit=lambda tree: tree["thrusters"][0].update(mapping=0, max_forward=1e300))
    sim.step({"a": {"left": 0.0}}, duration=seconds - 0.01)
    sim.command("a", left=1.0)
    with pytest.raises(DivergedError):
        sim.advance(1)


def test_a_reset_goes_on_after_a_divergence():
    sim, fresh = start(), start()
    spoil_velocity(sim, math.nan)
    stopped(sim, 10)
    for run in (sim, fresh):
        run.reset()
        run.advance(100)
    assert sim.get_state().sha256 == fresh.get_state().sha256
    assert np.isfinite(sim.data.qpos).all()


def test_recorders_hear_of_it():
    class Listener:
        def __init__(self):
            self.heard, self.filled = [], 0

        def rows(self, block):
            self.filled += len(block)

        def state(self, time, blob):
            pass

        def event(self, time, text, level):
            self.heard.append((time, text, level))

    sim = start()
    listener = Listener()
    sim.attach(listener, rate=100.0)
    sim.advance(20)
    spoil_velocity(sim, math.nan)
    stopped(sim, 10)
    (time, text, level) = listener.heard[0]
    assert (time, level) == (pytest.approx(2.7), "ERROR")
    assert MESSAGE.fullmatch(text)
    assert listener.filled >= 20


@pytest.mark.parametrize("value", [math.nan, 1e9])
def test_mujoco_writes_no_log(value, tmp_path):
    sim = start()
    spoil_velocity(sim, value)
    stopped(sim, 10)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """An empty temporary folder."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def diverge(time, size=1):
    """What is told of a run that diverges after `time` [s] with a state of so many numbers."""
    good = State(3, "", 1, time, np.zeros(size), b"", 0)
    kept = state.save_last_good_state(good)
    text = state.divergence_message("b", time + 1.0, 0.01, good, kept)
    folder = Path(MESSAGE.fullmatch(text)["file"]).parent
    os.utime(folder, (time, time))
    return folder


def test_the_last_ten_states_are_kept(temporary):
    folders = [diverge(float(time)) for time in range(1, 26)]
    assert sorted(temporary.iterdir()) == sorted(folders[-state.MAX_KEPT :])
    assert all(folder.stat().st_mode & 0o777 == 0o700 for folder in temporary.iterdir())


def test_they_hold_no_more_than_their_share(temporary, monkeypatch):
    monkeypatch.setattr(state, "MAX_KEPT_BYTES", 20_000)
    folders = [diverge(float(time), size=1000) for time in range(1, 6)]  # of 8 kB each
    assert sorted(temporary.iterdir()) == sorted(folders[-2:])
    assert diverge(9.0, size=10_000).is_dir()
    assert len(list(temporary.iterdir())) == 1


def test_what_looks_alike_but_is_not_ours_is_left_alone(temporary, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "precious").touch()
    (temporary / "vrx_mj-diverged-link").symlink_to(elsewhere)
    (temporary / "vrx_mj-diverged-file").touch()
    (temporary / "vrx_mj-diverged-My Folder").mkdir()
    if os.getuid() == 0:
        (temporary / "vrx_mj-diverged-theirs").mkdir()
        os.chown(temporary / "vrx_mj-diverged-theirs", 65534, 65534)
    before = set(temporary.iterdir())
    for time in range(1, 26):
        diverge(float(time))
    left = set(temporary.iterdir())
    assert before < left
    assert len(left - before) == state.MAX_KEPT
    assert (elsewhere / "precious").exists()


def test_where_nothing_can_be_saved_the_message_says_so(temporary, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(temporary / "none"))
    good = State(3, "", 1, 1.0, np.zeros(1), b"", 0)
    told = state.divergence_message("b", 2.0, 0.01, good, state.save_last_good_state(good))
    assert told == (
        "b has a state that is not finite, or huge, at step 200 (t = 2 s). "
        "The state at t = 1 s could not be saved: No such file or directory"
    )
