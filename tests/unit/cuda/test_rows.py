"""Rows of a graphics processor whose memory is the host's, and whose threads do a kernel one after another."""

import importlib
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import vrx_mj
from integration.sailing import boats, water
from unit.cuda.standalone import load
from vrx_mj.errors import CommandError
from vrx_mj.physics.lanes import WIDTH
from vrx_mj.rl.environment import Environment, Outcome
from vrx_mj.rl.options import ActionError

BUOY = {"model": "mb_round_buoy_black", "name": "b", "pose": [100.0, 0, 0, 0, 0, 0]}


USERS = "unit.cuda.simulated_rows", "vrx_mj.rl.device"
"""Modules that import `vrx_mj.cuda`."""


class Memory(np.ndarray):
    """An array on the device."""

    def copy_to_host(self, ary=None, stream=0):
        if ary is None:
            return np.array(self)
        ary[...] = self
        return ary

    def copy_to_device(self, ary, stream=0):
        self[...] = ary


class Kernel:
    """What a processor makes of a function."""

    def __init__(self, processor, function):
        self.processor, self.function = processor, function
        self.step = WIDTH if function.__name__ == "advance_marine" else 1  # the function of the CPU has all lanes

    def __getitem__(self, extent):
        (blocks, size, _stream), processor = extent, self.processor

        def launch(*arguments):
            for processor.thread in range(0, blocks * size, self.step):
                self.function(*arguments)

        return launch


class Processor:
    """Stands in for `numba.cuda`."""

    thread = 0

    def grid(self, dimensions):
        return self.thread

    def jit(self, function):
        return Kernel(self, function)

    def to_device(self, array, stream=0):
        return np.array(array).view(Memory)

    def device_array(self, shape, dtype):
        return np.zeros(shape, dtype).view(Memory)

    device_array_like = staticmethod(np.zeros_like)

    def default_stream(self):
        return SimpleNamespace(synchronize=lambda: None)


@pytest.fixture
def rows(monkeypatch):
    """The program that compares rows, with the modules of `vrx_mj.cuda` on this processor."""
    processor, config = Processor(), SimpleNamespace(ENABLE_CUDASIM=1)
    modules = {"numba.cuda.core": SimpleNamespace(config=config), "numba_cuda": SimpleNamespace()}
    for name in ("kernels", "rows", "batch"):
        modules[f"vrx_mj.cuda.{name}"] = load(monkeypatch, name, processor, modules)
    batch, kernels = modules["vrx_mj.cuda.batch"], modules["vrx_mj.cuda.kernels"]
    arrays = modules["vrx_mj.cuda.rows"].arrays
    own = SimpleNamespace(arrays=arrays, Batch=batch.Batch, check_driver=batch.check_driver, kernels=kernels)
    monkeypatch.setitem(sys.modules, "vrx_mj.cuda", own)
    for name in USERS:
        monkeypatch.delitem(sys.modules, name, raising=False)
    program, _ = map(importlib.import_module, USERS)
    yield program
    for name in USERS:
        del sys.modules[name]


def world(profile="vrx"):
    water_ = water(physics={"profile": profile}, objects=[BUOY])
    return vrx_mj.compile_world(water_, fleet=boats((0.0, 0.0, 0.3), engines="fixed"))


@pytest.mark.parametrize("profile", ["vrx", "marine"])
def test_rows_are_those_of_the_cpu_to_the_bit(rows, profile):
    rows.compare(world(profile), rows.PARAMETERS[profile])


def test_water_is_open_for_a_boat_alone(rows):
    fleets = [boats((0.0, 0.0, 0.3)), boats((0.0, 0.0, 0.3), (30.0, 0.0, 0.0))]
    found = [rows.Batch(vrx_mj.compile_world(water(), fleet=fleet), 1).open_water for fleet in fleets]
    assert found == [True, False]


def test_rows_that_stop_or_diverge_are_named(rows, capsys):
    rows.stop(world())
    diverged, near, *_ = capsys.readouterr().out.splitlines()
    assert diverged.startswith("rows 2 have a state that is not finite")
    assert near.startswith("something is near rows 1 (1 in all): they stop until they are reset, or moved by host()")


@pytest.mark.parametrize("profile", ["vrx", "marine"])
def test_rows_that_begin_anew_have_the_starts_that_were_kept(rows, profile):
    batch = rows.Batch(world(profile), 3, seed=5)
    assert not batch.open_water
    batch.keep()
    starts = np.array(batch.qpos)
    batch.command(np.full((3, len(batch.channels)), 0.5))
    batch.advance(3)
    moved = np.array(batch.qpos)
    batch.begin(np.array([True, False, True]), np.array([2, 1, 0]))
    assert np.array_equal(np.array(batch.qpos), [starts[2], moved[1], starts[0]])
    assert np.array(batch.time).tolist() == pytest.approx([0.0, 0.03, 0.0])


def test_rows_do_not_begin_with_starts_that_are_not_kept_as_they_are(rows):
    """Not before `keep`, and not when `vary` has given a table another size, whose memory is elsewhere then."""
    batch = rows.Batch(world(), 2, seed=5)
    everywhere, starts = np.ones(2, bool), np.arange(2)
    for prepare in (lambda: None, lambda: (batch.keep(), batch.vary(thrust=0.9))):
        prepare()
        with pytest.raises(CommandError, match=r"^no starts are kept of rows as they are: call keep\(\) before begin"):
            batch.begin(everywhere, starts)
    batch.keep()
    batch.begin(everywhere, starts)


def test_a_world_without_boats_is_refused(rows):
    empty = vrx_mj.compile_world(water(), fleet={"usv_count": 0})
    with pytest.raises(CommandError, match=r'^world world has no boat: take vrx_mj.Batch\(engine="free"\)$'):
        rows.Batch(empty, 2)


def test_an_environment_s_episodes_are_those_of_the_cpu_to_the_bit(rows):
    """Its second episode of a row is the first of the next row."""
    variety = {"waves": (0, 1), "wind_speed": (0, 6), "gusts": 1.0, "mass": (0.9, 1.1)}
    options = {"world": None, "fleet": None, "duration": None, "threads": 1, "size": (8, 8), "max_episode_steps": 3}
    ours, cpu = (
        kind("StationKeeping", 3, variety=variety, engine="free", **options)
        for kind in (importlib.import_module("vrx_mj.rl.device").DeviceEnvironment, Environment)
    )
    everywhere, random = np.ones(3, bool), np.random.default_rng(1)
    assert ours.reset(everywhere, 4).tobytes() == cpu.reset(everywhere, 4).tobytes()
    for episode in range(3):
        assert ours.episode_info(everywhere)["start"].tolist() == [(row + episode) % 3 for row in range(3)]
        for _ in range(3):
            actions = random.uniform(-1.5, 1.5, (3, 4)).astype(np.float32)
            own = ours.step(ours.actions.array(actions, ours.roster.present, (3, 4)))
            wanted = cpu.step(actions.clip(-1.0, 1.0)[:, None])
            for name in Outcome._fields[:7]:
                assert np.array_equal(getattr(own, name), getattr(wanted, name)), name
        assert own.cut.all()
        ours.begin(everywhere)
        cpu.reset(everywhere, [4 + (row + episode + 1) % 3 for row in range(3)])
        assert np.array_equal(ours.observe(), cpu.observe())
    with pytest.raises(CommandError, match="rows reset by themselves"):
        ours.reset(np.array([True, False, True]), 4)
    with pytest.raises(ActionError, match=r"invalid actions of shape \(3,\): \(3, 4\) is needed"):
        ours.actions.array(np.zeros(3), ours.roster.present, (3, 4))
