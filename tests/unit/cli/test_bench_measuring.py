"""How the bench measures, with false clocks, processes and worlds: what counts, and by what it divides."""

import statistics
import subprocess
import sys
import time
from collections import Counter
from types import SimpleNamespace

import mujoco
import numpy as np
import psutil
import pytest

from vrx_mj.cli import bench, bench_campaign, bench_fleet


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    return now


def taking(clock, *seconds):
    """A call that takes these times, one after the other, and then the last one for ever."""
    left = list(seconds)

    def call(*_):
        calls.append(_)
        clock[0] += left.pop(0) if len(left) > 1 else left[0]

    calls = call.calls = []
    return call


def test_a_median_leaves_out_the_warm_up(clock):
    call = taking(clock, 50.0, 60.0, 1.0, 2.0, 4.0)
    assert bench.median_seconds(call, 3, warm_up=2) == 2.0
    assert len(call.calls) == 5
    assert bench.median_seconds(taking(clock, 8.0, 1.0, 1.0), 3) == 1.0


def test_a_ratio_alternates_and_leaves_out_two_rounds(clock):
    ours, theirs = taking(clock, 90.0, 90.0, 3.0), taking(clock, 1.0, 1.0, 1.5)
    assert bench.ratio(ours, theirs) == 2.0
    assert len(ours.calls) == len(theirs.calls) == 17


def test_costs_of_steps_are_of_a_fleet_under_way_over_bare_ones(clock, monkeypatch):
    ours, theirs = taking(clock, 4.0), taking(clock, 1.0)
    fleets = []
    monkeypatch.setattr(bench, "sailing", lambda *given: fleets.append(given) or SimpleNamespace(advance=ours))
    monkeypatch.setattr(bench, "bare", lambda count: fleets.append(count) or theirs)
    assert bench.step_ratio(7, 200, bench._OCEAN) == 4.0
    assert fleets == [(7, bench._OCEAN), 7]
    assert set(ours.calls) == set(theirs.calls) == {(200,)}
    assert bench.boats_in_real_time(50) == 50 * 0.01 * 20 / 4.0  # 20 steps of 10 ms take 4 s
    assert ours.calls[-15:] == [(20,)] * 15


def test_bare_boats_are_free_bodies_apart(clock):
    step = bench.bare(27)
    model, data = step.args
    assert (step.func, model.nbody, model.ngeom, model.nv) == (mujoco.mj_step, 28, 3 * 27, 6 * 27)
    places = data.qpos.reshape(27, 7)[:, :3]
    assert places[[0, 1, 24, 25, 26]].tolist() == [[0, 0, 0], [12, 0, 0], [288, 0, 0], [0, 12, 0], [12, 12, 0]]


def test_boats_are_warmed_up_for_two_seconds(monkeypatch):
    steps = []
    sim = SimpleNamespace(boats=("a", "b"), step=lambda *given, **how: steps.append((*given, how)))
    monkeypatch.setattr(bench, "compile_world", lambda world, fleet: (world, fleet))
    monkeypatch.setattr(bench, "Simulation", lambda world: steps.append(world) or sim)
    assert bench.sailing(2) is sim
    slow = {"left": 0.1, "right": 0.1}
    assert steps == [(bench.SEA, bench.fleet(2)), ({"a": slow, "b": slow}, {"duration": 2.0})]


def test_an_import_is_the_median_of_five_interpreters(monkeypatch):
    came, ran = iter((b"9", b"1", b"2\n", b"0.5", b"3")), []

    def run(command, **how):
        ran.append((command[:2], how))
        return SimpleNamespace(stdout=next(came))

    monkeypatch.setattr(subprocess, "run", run)
    assert bench.import_seconds() == 2.0
    assert ran == [([sys.executable, "-c"], {"capture_output": True, "check": True})] * 5


def test_a_command_is_the_median_of_nine(monkeypatch):
    came = iter(range(9))
    monkeypatch.setattr(bench, "child_cost", lambda command: (float(next(came)), command[3:] == ["list", "worlds"]))
    assert bench.processor_seconds("list", "worlds") == 4.0


class Child:
    """A process that ends at the fourth look, and cannot be seen at the third."""

    def __init__(self, command, **how):
        self.how, self.looks, self.returncode = how, 0, 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def poll(self):
        self.looks += 1
        return None if self.looks < 4 else 0

    def cpu_times(self):
        return (1.0 * self.looks, 0.5, 0.25, 0.125, 99.0)

    def memory_info(self):
        if self.looks == 3:
            raise psutil.NoSuchProcess(1)
        return SimpleNamespace(rss={1: 5e6, 2: 3e6}[self.looks])


def test_a_childs_cost_is_that_of_all_its_times_and_its_largest_memory(monkeypatch):
    naps = []
    monkeypatch.setattr(psutil, "Popen", Child)
    monkeypatch.setattr(time, "sleep", naps.append)
    assert bench.child_cost(["x"], "here") == (2.875, 5.0)
    assert naps == [0.001] * 3


def test_compiling_ends_when_mujoco_has_the_model(clock, monkeypatch):
    def compiled(_world, fleet):
        clock[0] += 2.0
        assert fleet == bench.fleet(30)
        return SimpleNamespace(mjcf="<mujoco/>", assets={})

    monkeypatch.setattr(bench, "compile_world", compiled)
    assert bench.compile_seconds(30) == 2.0


def test_scans_are_counted_of_a_lidar_among_buoys(clock, monkeypatch):
    class Lidar:
        def __init__(self, *given):
            made.append(given)

        def scan(self, data, *, key, index):
            made.append((key, index))
            clock[0] += 0.02

    made, worlds = [], []
    body = "<mujoco><worldbody><body name='a/base_link'/></worldbody></mujoco>"
    sim = SimpleNamespace(visual_model=mujoco.MjModel.from_xml_string(body), boats=("a",))
    monkeypatch.setattr(bench, "compile_world", lambda world, fleet: worlds.append((world, fleet)))
    monkeypatch.setattr(bench, "Simulation", lambda _world: sim)
    monkeypatch.setattr("vrx_mj.sensors.lidar.Lidar", Lidar)
    assert bench.lidar_scans(6) == pytest.approx(50.0)
    (world, fleet), (model, config, number, place, turn) = worlds[0], made[0]
    assert fleet == bench.fleet(2)
    assert (model, config.link, number, place, turn.tolist()) == (
        sim.visual_model, "lidar_link", 1, (0.7, 0.0, 1.8), np.eye(3).tolist()
    )  # fmt: skip
    assert made[1:] == [(1, number) for number in range(102)]
    assert {tuple(buoy["pose"][2:]) for buoy in world["objects"]} == {(0, 0, 0, 0)}
    spots = [np.hypot(*buoy["pose"][:2]) for buoy in world["objects"]]
    assert spots == pytest.approx([15.0 + 85.0 / 6 * number for number in range(6)])
    angles = [np.arctan2(buoy["pose"][1], buoy["pose"][0]) for buoy in world["objects"][:2]]
    assert angles == pytest.approx([0.0, 2.4])
    assert Counter(buoy["model"] for buoy in world["objects"]) == {
        "mb_marker_buoy_red": 2, "mb_round_buoy_orange": 2, "polyform_a7": 2
    }  # fmt: skip


def test_a_minute_of_the_example_course_is_timed(clock, monkeypatch):
    steps = []

    def step(commands, duration):
        steps.append((commands, duration))
        clock[0] += 3.0

    monkeypatch.setattr(bench, "compile_world", lambda name: name)
    monkeypatch.setattr(bench, "Simulation", lambda world: SimpleNamespace(step=step, world=world))
    assert bench.real_time_factor() == 20.0
    assert steps == [({"wamv": {"left": 0.5, "right": 0.4}}, 60.0)]


def test_frames_of_an_autopilot_are_timed_after_a_hundred(clock, monkeypatch):
    class Pilot:
        def __init__(self, _sim, ports):
            assert ports == {"a": 0}
            self.addresses = {"a": "there"}

        __enter__ = lambda self: self  # noqa: E731
        __exit__ = lambda *_: None  # noqa: E731

        def step(self):
            clock[0] += 0.5 if len(sent) > 100 else 7.0

    class Socket(Pilot):
        def __init__(self, *_):
            pass

        def sendto(self, data, address):
            sent.append((bench.FORMATS[18458].unpack(data)[:4], address))

        def recv(self, size):
            assert size == 4096

    sent = []
    monkeypatch.setattr(bench, "compile_world", lambda _world, fleet: fleet)
    monkeypatch.setattr(bench, "Simulation", lambda world: world)
    monkeypatch.setattr(bench, "ArduPilot", Pilot)
    monkeypatch.setattr(bench.socket, "socket", Socket)
    assert bench.ardupilot_factor(40) == pytest.approx(40 * 0.01 / (40 * 0.5))
    assert sent == [((18458, 100, number, 1700), "there") for number in range(140)]


@pytest.fixture
def batches(monkeypatch):
    """Batches that advance as often per second as they have rows, by threads, engine and sea."""
    made = []

    class Batch:
        boats, channels = ("a",), range(4)

        def __init__(self, world, rows, *, threads, engine):
            made.append((world[0], world[1], rows, threads, engine))
            self.n, self.engine, self.threads = rows, engine, threads

        def step(self, commands, duration):
            made.append((np.shape(commands), commands[0][0], duration))

    monkeypatch.setattr(bench, "Batch", Batch)
    monkeypatch.setattr(bench, "compile_world", lambda world, fleet: (world, fleet))
    monkeypatch.setattr(
        bench, "rate", lambda batch, window, steps=0: {"free": 30.0, "mujoco": 10.0}[batch.engine] / window
    )
    bench.batch_of.cache_clear()
    yield made
    bench.batch_of.cache_clear()


def test_rows_are_warmed_up_once(batches):
    assert bench.batch_of(3, 2, "free", "60_waves") is bench.batch_of(3, 2, "free", "60_waves")
    assert batches == [(bench._OCEAN, bench.fleet(1), 3, 2, "free"), ((3, 4), 0.1, 2.0)]


def test_engines_are_compared_on_one_thread(batches):
    assert bench.engine_ratio(64, "vrx") == 3.0
    assert [made[2:] for made in batches[::2]] == [(64, 1, "mujoco"), (64, 1, "free")]
    assert bench.row_cost(4096, 64) == 1.0
    assert [made[2:] for made in batches[4::2]] == [(4096, 1, "free"), (64, 1, "free")]
    assert bench.boat_steps_per_second() == 20.0  # of half a second
    assert bench.rate_on_one_thread(8, 2.0, 10) == 5.0
    assert batches[-2][2:] == (8, 1, "mujoco")


def test_medians_are_of_seven_windows_of_half_a_second(batches, monkeypatch):
    windows = []
    monkeypatch.setattr(bench, "rate", lambda batch, window: windows.append(window) or float(len(windows)))
    assert bench.boat_steps_per_second() == 4.0
    assert windows == [0.5] * 7
    assert bench.engine_ratio(64, "vrx") == statistics.median(
        [9 / 8, 11 / 10, 13 / 12, 15 / 14, 17 / 16, 19 / 18, 21 / 20]
    )
    bench.row_cost(64, 8)
    assert windows == [0.5] * 35


def test_two_threads_alternate_with_two_processes_of_half_the_rows_and_the_first_round_does_not_count(monkeypatch):
    """Rows of all threads: 100 the first time, then 8; a process: 1000 the first time, then 3."""
    asked, ended = [], []

    class Process:
        def __enter__(self):
            return self

        def __exit__(self, *_):
            ended.append(self)

        def submit(self, call, *given):
            asked.append((call, *given))
            return SimpleNamespace(result=lambda: 1000.0 if len(asked) <= 2 else 3.0)

    def rate(batch, *given):
        asked.append((batch, *given))
        return 100.0 if len(asked) == 1 else 8.0

    monkeypatch.setattr(bench, "fresh_process", Process)
    monkeypatch.setattr(bench, "rate", rate)
    monkeypatch.setattr(bench, "batch_of", lambda rows, threads: (rows, threads))
    assert bench.two_threads_and_two_processes(512, 10) == (8.0, 6.0)
    one = [((512, 2), 0.5, 10), *[(bench.rate_on_one_thread, 256, 0.5, 10)] * 2]
    assert asked == one * 8
    assert len(ended) == 2


def test_memory_is_what_rows_add_to_a_process_in_megabytes_each(monkeypatch):
    used, made = iter((50e6, 90e6)), []
    monkeypatch.setattr(bench, "process_memory", lambda: next(used))
    monkeypatch.setattr(bench, "batch_of", lambda rows, engine: made.append((rows, engine)))
    assert bench.megabytes(1000, "free") == 40.0
    assert made == [(8, "free"), (1000, "free")]

    class Process:
        __enter__ = lambda self: self  # noqa: E731
        __exit__ = lambda *_: None  # noqa: E731

        def submit(self, call, rows, engine):
            made.append((call, rows, engine))
            return SimpleNamespace(result=lambda: 500.0)

    monkeypatch.setattr(bench, "fresh_process", Process)
    assert (bench.megabytes_per_row(), bench.megabytes_per_row(250, "free")) == (0.5, 2.0)
    assert made[2:] == [(bench.megabytes, 1000, "mujoco"), (bench.megabytes, 250, "free")]


def test_a_fresh_process_is_spawned_alone(monkeypatch):
    monkeypatch.setattr(bench, "ProcessPoolExecutor", lambda *given: given)
    count, context = bench.fresh_process()
    assert (count, context.get_start_method()) == (1, "spawn")


def test_a_film_that_fails_is_not_measured_and_any_other_command_ends_the_bench(monkeypatch):
    def cost(command, _folder):
        if failing in command:
            raise subprocess.CalledProcessError(1, command)
        return 1.0 + ("--record" in command), 100.0

    class Process:
        __enter__ = lambda self: self  # noqa: E731
        __exit__ = lambda *_: None  # noqa: E731

        def submit(self, *_):
            return SimpleNamespace(result=lambda: 0.5)

    monkeypatch.setattr(bench, "child_cost", cost)
    monkeypatch.setattr(bench, "fresh_process", Process)
    monkeypatch.setattr(bench, "sizes", lambda _file: {"states": 1e6})
    failing = "film.mp4"
    rows = {row["name"]: row for row in bench.recording_rows(2)}
    assert (rows["film_minute_s"]["value"], rows["readme_run_s"]["value"]) == (None, 2.0)
    failing = "minute.rrd"
    with pytest.raises(subprocess.CalledProcessError):
        bench.recording_rows(2)


def test_a_fleet_is_a_row_beside_the_guide(monkeypatch, clock):
    class Process:
        __enter__ = lambda self: self  # noqa: E731
        __exit__ = lambda *_: None  # noqa: E731

        def submit(self, call, boats, **how):
            assert (call, how) == (bench_fleet.fleet_row, {"paced": 6.0, "free": 3.0})
            return SimpleNamespace(result=lambda: {"boats": boats})

    monkeypatch.setattr(bench_fleet, "fresh_process", Process)
    found = [tuple(row.values()) for row in bench_fleet.fleet_table()]
    assert found == [(1, 0.35, 1200.0), (2, 0.55, 1800.0), (3, 0.75, 2400.0), *((10**n, None, None) for n in (1, 2, 3)),
                     (3000, None, None)]  # fmt: skip


def test_processor_time_is_that_of_all_children_too(monkeypatch):
    def process():
        children = [SimpleNamespace(cpu_times=lambda: (1.0, 2.0, 4.0, 8.0, 99.0))] * 2
        asked = lambda *, recursive: children if recursive else []  # noqa: E731
        return SimpleNamespace(cpu_times=lambda: (0.5, 0.25, 0.0, 0.0, 99.0), children=asked)

    monkeypatch.setattr(psutil, "Process", process)
    assert bench_campaign._cpu_time() == 30.75


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "not measured"), (9999.4, "9999"), (10_000.0, "10,000"), (1234567.8, "1,234,568"), (0.123456, "0.1235")],
)
def test_figures_have_four_digits_or_all_before_the_point(value, text):
    assert bench._figure(value) == text


def test_decisions_of_environments_are_the_median_of_seven_windows(monkeypatch):
    """Rows of Gymnasium, under way with a tenth of the thrust."""

    class Rows:
        action_space = SimpleNamespace(sample=lambda: np.ones((3, 2), np.float32))

        def __init__(self, *given):
            asked.append(given)

        def reset(self, seed):
            asked.append(seed)

    def decisions(_rows, actions, window):
        asked.append((actions.tolist(), window))
        return float(len(asked))

    asked = []
    monkeypatch.setitem(sys.modules, "vrx_mj.rl", SimpleNamespace(VectorEnv=Rows))
    monkeypatch.setattr(bench.importlib.util, "find_spec", lambda name: name == "gymnasium" or None)
    monkeypatch.setattr(bench, "decisions", decisions)
    assert bench.environment_steps_per_second() == 6.0
    assert asked[:2] == [("StationKeeping", 512), 0]
    assert asked[2:] == [([[np.float32(0.1)] * 2] * 3, 0.5)] * 7


def test_calls_are_counted_in_a_window_over_the_time_that_they_took(clock):
    """A call of 0.3 s begins as long as half a second is not over: two take 0.6 s."""
    call = taking(clock, 0.3)
    assert bench.per_second(call, 0.5) == pytest.approx(2.0 / 0.6)
    assert len(call.calls) == 2
