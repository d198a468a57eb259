"""Worlds without a boat, which boats join later: they compile, run, are saved and recorded as others are."""

import numpy as np
import pytest

import vrx_mj
from vrx_mj.errors import UnknownNameError, VrxWarning

LINE = {"name": "cat", "robot": "wamv", "thrusters": "H", "pose": [-532, 162, 0.1, 0, 0, 1]}


def test_a_world_without_boats_runs_and_is_the_same_when_saved(tmp_path):
    world = vrx_mj.compile_world("example_course", fleet="none")
    sim = vrx_mj.Simulation(world)
    assert (world.boats, sim.reset(seed=3)) == ((), {})
    sim.step(duration=2.0)
    saved = vrx_mj.Simulation.load(world.save(tmp_path / "saved"))
    saved.reset(seed=3)
    saved.step(duration=2.0)
    assert sim.get_state().sha256 == saved.get_state().sha256


def test_a_boat_that_joins_moves_as_one_that_was_there():
    """Boats that do not touch move bit-equally whatever else is in the world, and whenever it was compiled."""
    alone = vrx_mj.Simulation(vrx_mj.compile_world("example_course", fleet={"boats": [LINE]}))
    joined = vrx_mj.Simulation(vrx_mj.compile_world("example_course", fleet="none"))
    alone.reset(seed=3)
    joined.reset(seed=3)
    joined.spawn("cat", robot="wamv", thrusters="H", pose=LINE["pose"])
    assert joined.boats == alone.boats
    for sim in (alone, joined):
        sim.step({"cat": {"left": 0.5, "right": 0.4}}, duration=5.0)
    one, other = alone.observe()["cat"], joined.observe()["cat"]
    np.testing.assert_array_equal(one.position, other.position)
    np.testing.assert_array_equal(one.velocity, other.velocity)


def test_boats_join_leave_and_join_again():
    sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean", fleet="none"))
    for name, x in (("a", 0.0), ("b", 20.0)):
        sim.spawn(name, pose=[x, 0, 0.1, 0, 0, 0])
    assert sim.boats == ("a", "b")
    sim.step({"a": {"left": 1.0, "right": 1.0}}, duration=2.0)
    assert sim.observe()["a"].speed > 0.3
    sim.remove("a")
    sim.remove("b")
    sim.step(duration=1.0)
    assert sim.observe() == {}


def test_a_task_needs_a_boat_from_the_start():
    with pytest.warns(VrxWarning) as warned:
        world = vrx_mj.compile_world("stationkeeping_task", fleet="none")
    (one,) = warned
    assert str(one.message) == (
        "world stationkeeping_task: its task is left out: it needs a boat at the start, and the fleet has none"
    )
    sim = vrx_mj.Simulation(world)
    assert sim.task is None
    sim.step(duration=1.0)


def test_thrust_for_no_boat_is_an_error():
    from vrx_mj.runtime.run import steady

    with pytest.raises(UnknownNameError) as caught:
        steady(vrx_mj.Simulation(vrx_mj.compile_world("ocean", fleet={"usv_count": 0})), {"left": 1.0})
    assert str(caught.value) == "no thruster named 'left'; known: none"


def test_a_run_without_boats_is_recorded(tmp_path):
    sim = vrx_mj.Simulation(vrx_mj.compile_world("sand_island", fleet="none"))
    with vrx_mj.record(sim, tmp_path / "run.rrd"):
        sim.step(duration=1.0)
        sim.spawn("cat", pose=[158, 108, 0.1, 0, 0, 3])
        sim.step(duration=1.0)
    assert (tmp_path / "run.rrd").stat().st_size > 10_000
