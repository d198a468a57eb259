"""A real run, recorded and read back."""

import numpy as np
import pytest

import vrx_mj
from vrx_mj.errors import CommandError

COMMANDS = {"wamv1": {"left": 0.8, "right": 0.5, "left_angle": 0.3}}
WORLD = {
    "sea": {"scale": 2.5, "gain": 0.2},
    "wind": {"mean_velocity": 5, "var_gain": 2, "objects": [{"model": "wamv", "coefficients": [0.5, 0.5, 0.33]}]},
    "objects": [{"name": "ball", "model": "polyform_a5", "pose": [6, 3, 0.2, 0, 0, 0]}],
}
PAIR = {"usv_count": 2, "thrusters": "H", "positions": [{"x": 0, "y": 0}, {"x": 0, "y": 12}]}


@pytest.fixture(scope="module")
def sim():
    return vrx_mj.Simulation(vrx_mj.compile_world(WORLD, fleet=PAIR), seed=3)


@pytest.fixture(scope="module")
def recorded(sim, tmp_path_factory):
    path = tmp_path_factory.mktemp("记录") / "run.rrd"
    sim.reset(3)
    poses = []
    with vrx_mj.record(sim, path):
        for _ in range(50):
            obs = sim.step(COMMANDS, duration=0.1)
            poses.append(obs["wamv1"].position)
        sim.event("done")
    return path, np.array(poses), sim.get_state()


def test_a_recording_is_of_one_run(tmp_path):
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean"))
    begun = sim.get_state()
    text = (
        "{0} cannot be called while the run is recorded, since a recording holds one run: call it before "
        "the recording begins, or end the recording first"
    )
    with vrx_mj.record(sim, tmp_path / "run.rrd", sea=False):
        sim.step(duration=0.1)
        with pytest.raises(CommandError) as raised:
            sim.reset()
        assert str(raised.value) == text.format("reset")
        with pytest.raises(CommandError) as raised:
            sim.set_state(begun)
        assert str(raised.value) == text.format("set_state")
        assert sim.time == pytest.approx(0.1)
    sim.reset()


def test_what_is_read_is_what_was_sailed(recorded):
    path, poses, _ = recorded
    record = vrx_mj.read_record(path)
    steps = np.searchsorted(record.time, np.arange(1, 50) * 0.1 - 1e-9)
    assert np.array_equal(record.boats["wamv1"].position[steps], poses[:-1])
    assert np.array_equal(record.boats["wamv1"].position[-1], poses[-1])
    assert set(record.objects) == {"ball"}
    assert record.boats["wamv1"].thrust["left"][20] > 150
    assert [event.text for event in record.events] == ["world, fleet fleet, seed 3: recording starts", "done"]


def test_recording_changes_nothing(sim, recorded):
    sim.reset(3)
    for _ in range(50):
        sim.step(COMMANDS, duration=0.1)
    assert sim.get_state().sha256 == recorded[2].sha256


def test_a_run_goes_on_from_any_recorded_second(sim, recorded):
    path, _, end = recorded
    resumed = vrx_mj.resume(path, 3.4)
    assert resumed.time == pytest.approx(3.0)
    sim.reset(3)
    for _ in range(30):
        sim.step(COMMANDS, duration=0.1)
    assert resumed.get_state().sha256 == sim.get_state().sha256
    for _ in range(20):
        resumed.step(COMMANDS, duration=0.1)
    assert resumed.get_state().sha256 == end.sha256


def test_a_time_before_the_first_state_is_refused(recorded):
    with pytest.raises(vrx_mj.VrxError, match=r"has no state at or before -1 s; the first is at 0 s$"):
        vrx_mj.resume(recorded[0], -1.0)


def test_two_equal_runs_compare_equal_and_others_say_where_they_part(sim, recorded, tmp_path):
    sim.reset(3)
    with vrx_mj.record(sim, tmp_path / "same.rrd"):
        for _ in range(50):
            sim.step(COMMANDS, duration=0.1)
    assert vrx_mj.compare(recorded[0], tmp_path / "same.rrd").parting is None
    sim.reset(4)
    with vrx_mj.record(sim, tmp_path / "other.rrd"):
        sim.step(COMMANDS, duration=5.0)
    parting = vrx_mj.compare(recorded[0], tmp_path / "other.rrd").parting
    assert parting is not None
    assert parting.time < 0.2


def test_an_error_inside_leaves_a_whole_recording(sim, tmp_path):
    def crash():
        with vrx_mj.record(sim, tmp_path / "broken.rrd"):
            sim.step(COMMANDS, duration=1.0)
            raise RuntimeError

    sim.reset(3)
    with pytest.raises(RuntimeError):
        crash()
    assert vrx_mj.read_record(tmp_path / "broken.rrd").time[-1] == pytest.approx(1.0)
    assert sim.step(COMMANDS, duration=0.1)


def test_a_long_run_can_be_read(tmp_path):
    """Summed time is 709.9999999995 s then; a finer timeline than a microsecond would not read back."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world({"sea": {"model": "none"}}))
    with vrx_mj.record(sim, tmp_path / "long.rrd", sea=False):
        sim.step(duration=720.0)
    record = vrx_mj.read_record(tmp_path / "long.rrd")
    assert record.time[-1] == sim.time
    assert len(record.states) == 721 + 1  # one per second, and the last
