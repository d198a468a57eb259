"""What each thread of a graphics processor does, as Python, in blocks with more threads than rows; and launches."""

from types import SimpleNamespace

import numpy as np
import pytest

from unit.cuda.standalone import load
from vrx_mj.errors import CommandError

ROWS = 3
TIME, GOING = np.arange(ROWS) * 1.0, np.array([True, False, True])


class Device:
    """A processor that has one thread after another do a kernel."""

    thread, compiled = 0, ()

    def grid(self, dimensions):
        assert dimensions == 1
        return self.thread

    def jit(self, function, **options):
        self.compiled = *self.compiled, options
        return {(blocks, size, stream): (blocks, size) for blocks in range(9) for size in (64,) for stream in ("s",)}

    def run(self, kernel, *arguments, threads=64):
        for self.thread in range(threads):
            kernel(*arguments)


@pytest.fixture
def device():
    return Device()


@pytest.fixture
def kernels(monkeypatch, device):
    config = SimpleNamespace(ENABLE_CUDASIM=1, CACHE_DIR="before")
    core, own = SimpleNamespace(config=config), SimpleNamespace(__version__="1")
    module = load(monkeypatch, "kernels", device, {"numba.cuda.core": core, "numba_cuda": own})
    assert module.SIMULATED
    return module


@pytest.fixture
def calls(monkeypatch, kernels):
    """What the functions of rows are called with."""
    found = []
    for name in ("advance_free_row", "command_row", "observe_row"):
        monkeypatch.setattr(kernels, name, lambda *arguments: found.append(arguments))
    return found


def test_rows_of_vrx_that_go_have_a_thread_each(kernels, device, calls):
    device.run(kernels.advance_vrx, "runs", TIME, GOING, "done", "features", 0.1, 5, [10, 11, 12])
    assert [(call[:3], call[4:]) for call in calls] == [
        (("runs", row, row), ("done", "features", 0.1, 5, 10 + row, None)) for row in (0, 2)
    ]


def test_rows_of_marine_that_go_have_eight_threads_each_with_runs_of_their_own(kernels, device, calls):
    damping, work = range(100, 124), [[f"{name}{row}" for row in range(ROWS)] for name in "abcdef"]
    device.run(kernels.advance_marine, "runs", TIME, GOING, "done", "features", 0.1, 5, damping, *work)
    assert [(call[:3], call[4:9], tuple(call[9])) for call in calls] == [
        (("runs", run, row), ("done", "features", 0.1, 5, 100 + run), tuple(f"{name}{row}" for name in "abcdef"))
        for row in (0, 2) for run in range(row, 8 * ROWS, ROWS)
    ]  # fmt: skip


def test_every_row_is_commanded_and_observed(kernels, device, calls):
    device.run(kernels.command, "runs", TIME, "xyz", "thrusters", "angles", 0.5)
    assert calls == [("runs", row, row, "xyz"[row], "thrusters", "angles", 0.5) for row in range(ROWS)]
    calls.clear()
    device.run(kernels.observe, "runs", TIME, "abc", "xyz")
    assert calls == [("runs", row, row, "abc"[row], "xyz"[row]) for row in range(ROWS)]


def test_rows_begin_with_the_starts_that_are_named_in_every_table(kernels, device):
    kept = tuple(np.arange(4 * width).reshape(4, width) + 100 for width in (1, 5))
    wholes = tuple(np.zeros((ROWS, width), int) for width in (1, 5))
    starts = np.array([3, 1, 0])
    device.run(kernels.copy_rows, GOING, starts, kept, wholes)
    for start, whole in zip(kept, wholes, strict=True):
        assert np.array_equal(whole, np.where(GOING[:, None], start[starts], 0))


@pytest.mark.parametrize(("threads", "blocks"), [(1, 1), (64, 1), (65, 2), (128, 2), (129, 3)])
def test_a_launch_has_blocks_for_all_threads(kernels, threads, blocks):
    assert kernels.launcher(print, threads, 0, "s") == (blocks, 64)


@pytest.mark.parametrize(("waves", "registers", "name"), [(10, None, "cuda-1"), (11, 96, "cuda96-1")])
@pytest.mark.parametrize("kept", [True, False])
def test_what_is_compiled_is_kept_by_its_registers_with_the_kernels_of_the_cpu(
    waves, registers, name, kept, kernels, device, monkeypatch, tmp_path
):
    folders, jit = [], device.jit

    def compile_it(function, **options):
        folders.append(kernels.config.CACHE_DIR)
        return jit(function, **options)

    device.jit, kernels.SIMULATED = compile_it, False
    monkeypatch.setattr(kernels, "FOLDER", tmp_path if kept else None)
    for _ in range(2):
        assert kernels.launcher(print, 65, waves, "s") == (2, 64)
    assert device.compiled == ({"max_registers": registers, "cache": kept},)
    assert folders == [str(tmp_path / name) if kept else "before"]
    assert kernels.config.CACHE_DIR == "before"


@pytest.mark.parametrize(("vrx_only", "advance", "threads"), [(True, "vrx", 3), (False, "marine", 24)])
@pytest.mark.parametrize(("stream", "used"), [(None, "default"), (7, "stream 7")])
@pytest.mark.parametrize(("movers", "obstacles", "alone"), [(1, 0, True), (2, 0, False), (1, 1, False)])
def test_a_batch_has_a_thread_for_each_row_and_eight_in_marine(
    vrx_only, advance, threads, stream, used, movers, obstacles, alone, monkeypatch
):
    launches, going = [], object()
    kernels = SimpleNamespace(
        SIMULATED=True, advance_vrx="vrx", advance_marine="marine", command="command", observe="observe",
        launcher=lambda *arguments: launches.append(arguments) or arguments[0],
    )  # fmt: skip
    known = dict.fromkeys(("time", "done", "features", "wind_velocity", "surface"), range(ROWS))
    on_device = SimpleNamespace(threads=threads // ROWS, arrays={"going": going, "qpos": range(8 * ROWS)} | known)
    library = SimpleNamespace(asarray=list)
    tables = SimpleNamespace(
        DeviceArray=object, DeviceRows=lambda rows, at: (rows, at) == (own, used) and on_device, arrays=library
    )
    cuda = SimpleNamespace(external_stream="stream {}".format, default_stream=lambda: "default", to_device=tuple)
    module = load(monkeypatch, "batch", cuda, {"vrx_mj.cuda.kernels": kernels, "vrx_mj.cuda.rows": tables})
    own = SimpleNamespace(arrays=SimpleNamespace(vrx_only=vrx_only))
    host = SimpleNamespace(
        world="world", n=ROWS, _rows=own, _thrusters=[1, 2], _angles=[3], boats="boats", channels="channels",
        timestep=0.1, _arrays=SimpleNamespace(waves=range(60), movers=range(movers), obstacles=range(obstacles)),
    )  # fmt: skip
    batch = module.Batch.of(host, stream=stream)
    assert launches == [(advance, threads, 60, used), ("command", ROWS, 0, used), ("observe", ROWS, 0, used)]
    assert (batch._advance, batch._command, batch._observe) == (advance, "command", "observe")
    assert (batch.n, batch.world, batch._thrusters, batch._angles) == (ROWS, "world", (1, 2), (3,))
    assert (batch._asked, batch._going, batch.open_water) == (0, going, alone)
    assert (batch.boats, batch.channels, batch.timestep) == ("boats", "channels", 0.1)
    assert batch.qpos == batch.time == batch.done == batch.features == batch.wind == [0, 1, 2]


@pytest.fixture
def stand_ins():
    names = ("advance_vrx", "advance_marine", "command", "observe", "launcher", "copy_rows", "Stream")
    return SimpleNamespace(SIMULATED=True, **dict.fromkeys(names))


def test_commands_on_another_device_are_refused(monkeypatch, stand_ins):
    cuda = SimpleNamespace(get_current_device=lambda: SimpleNamespace(id=1))
    tables = SimpleNamespace(DeviceArray=object, DeviceRows=object, arrays=np)
    module = load(monkeypatch, "batch", cuda, {"vrx_mj.cuda.kernels": stand_ins, "vrx_mj.cuda.rows": tables})
    batch = module.Batch.__new__(module.Batch)
    batch.n, batch.channels = ROWS, ("port",)
    tensor = SimpleNamespace(__cuda_array_interface__={}, __dlpack_device__=lambda: (2, 0))
    with pytest.raises(CommandError, match=r"^commands are on device 0: move them to device 1, which has the rows$"):
        batch.command(tensor)


@pytest.mark.parametrize(("size", "fit"), [(3_002, None), (3_003, 2)])
def test_too_little_memory_on_the_device_says_how_many_rows_fit(size, fit, monkeypatch, stand_ins):
    context = SimpleNamespace(get_memory_info=lambda: (3_003, 9_999))
    cuda = SimpleNamespace(current_context=lambda: context)
    module = load(monkeypatch, "rows", cuda, {"vrx_mj.cuda.kernels": stand_ins})
    module.SIMULATED = False
    rows = SimpleNamespace(_rows=SimpleNamespace(n=ROWS))
    if fit is None:
        module.DeviceRows._check_memory(rows, size)
    else:
        with pytest.raises(CommandError, match=f"^no memory for {ROWS} rows: .*; make at most {fit} rows$"):
            module.DeviceRows._check_memory(rows, size)
