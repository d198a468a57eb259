"""Boats on one spot: MuJoCo, whose memory their contacts would not fit into, is not asked."""

import contextlib
import re

import numpy as np
import pytest

import vrx_mj
from vrx_mj.errors import CommandError, DivergedError
from vrx_mj.runtime.stepping_models import FEW_BOATS

COUNT = 20
AWAY = (0.0, 500.0, 0.0, 0.0, 0.0, 0.0)
HEAP = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
TOLD = re.compile(r"too many contacts at one place, \d+: place the bodies farther apart( \(t = [\d.]+ s\))?")


@pytest.fixture(scope="module")
def world():
    fleet = {"usv_count": COUNT, "layout": "line", "spacing": 12, "sensors": "none"}
    return vrx_mj.compile_world("ocean", fleet=fleet)


@pytest.mark.slow
def test_twenty_boats_on_one_spot_are_parted_or_refused_and_the_run_goes_on(world):
    sim = vrx_mj.Simulation(world)
    for boat in sim.boats:
        with contextlib.suppress(CommandError):
            sim.set_boat(boat, pose=HEAP)
    with contextlib.suppress(DivergedError):
        sim.step()
    first = sim.reset()
    assert np.isfinite(sim.step(duration=0.1)["wamv1"].position).all()
    assert len(first) == COUNT


def test_a_heap_that_has_no_room_is_refused_and_undone(world, monkeypatch):
    sim = vrx_mj.Simulation(world)
    sim.step(duration=0.1)
    monkeypatch.setattr(sim._live, "_most_contacts", 50)
    before = sim.get_state().sha256
    sim.set_boat("wamv1", pose=(0, 500, 0, 0, 0, 0))
    apart = sim.get_state()
    assert apart.sha256 != before
    with pytest.raises(CommandError, match=TOLD):
        sim.set_boat("wamv2", pose=(0, 500, 0, 0, 0, 0))
    assert sim.get_state().sha256 == apart.sha256


def test_rows_of_a_batch(world, monkeypatch):
    batch = vrx_mj.Batch(world, 2, threads=2)
    monkeypatch.setattr("vrx_mj.runtime.stepping_models.PER_CONTACT", 56_000)
    for boat in batch.boats[:8]:
        before = batch.qpos.copy()
        if list(batch.boats).index(boat) < FEW_BOATS:
            batch.set_boat(boat, pose=AWAY, rows=[1])
            continue
        with pytest.raises(CommandError, match=TOLD):
            batch.set_boat(boat, pose=AWAY, rows=[1])
        assert np.array_equal(batch.qpos, before)
    batch.reset()
    batch.advance(5)
    assert np.isfinite(batch.features).all()
