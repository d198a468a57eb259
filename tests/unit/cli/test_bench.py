"""The bench's bookkeeping; what it measures is no test."""

import importlib.util
import json
import math
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from vrx_mj.cli import bench, bench_fleet, sailing
from vrx_mj.cli.bench import (
    FIGURES,
    PARTS,
    RECORDINGS,
    SIDES,
    batch_rows,
    decisions,
    environment_steps_per_second,
    print_rows,
    rate,
    rows_of,
    sizes,
    two_threads_and_two_processes,
)
from vrx_mj.cli.bench_campaign import campaign_times
from vrx_mj.cli.bench_fleet import (
    FLEETS,
    fleet_row,
    fleet_table,
    in_worlds_of,
    print_fleet_table,
    processor_share,
    real_time_factor,
    remarks,
)
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.packages import needs_extra
from vrx_mj.recording import record
from vrx_mj.runtime.simulation import Simulation


@pytest.fixture
def clock(monkeypatch):
    """Time that passes when somebody sleeps or works; `work(seconds)` takes processor time too."""

    class Clock:
        now = spent = 0.0

        def work(self, seconds):
            self.now += seconds
            self.spent += seconds

        def sleep(self, seconds):
            self.now += seconds

    own = Clock()
    monkeypatch.setattr(time, "perf_counter", lambda: own.now)
    monkeypatch.setattr(time, "process_time", lambda: own.spent)
    monkeypatch.setattr(time, "sleep", own.sleep)
    return own


def test_processor_time_is_that_of_the_process_that_is_started():
    idle, busy = (bench.child_cost([sys.executable, "-c", code])[0] for code in ("pass", "sum(range(20_000_000))"))
    assert busy > idle + 0.05


def test_a_rate_counts_every_boat_of_every_row(clock):
    class Slow:
        n, boats = 64, ("a", "b")

        def advance(self, steps):
            clock.work(steps * 1e-3)

    assert rate(Slow(), 0.5) == pytest.approx(64 * 2 / 1e-3)


@pytest.mark.parametrize(("second", "share", "factor"), [(0.25, 0.25, 4.0), (2.0, 2.0, 0.5)])
def test_shares_and_factors_are_those_of_a_fleet_that_takes_so_long_for_a_second(clock, second, share, factor):
    def advance(steps):
        clock.work(steps * 0.01 * second)

    assert processor_share(advance, 2.0) == pytest.approx(share)
    assert real_time_factor(advance, 2.0) == pytest.approx(factor)


def test_a_fleet_that_keeps_up_is_held_to_real_time(clock):
    processor_share(lambda steps: clock.work(steps * 1e-4), 2.0)
    assert clock.now == pytest.approx(2.0)


@pytest.mark.parametrize("boats", FLEETS)
def test_worlds_hold_the_whole_fleet(boats):
    worlds, each = in_worlds_of(boats)
    assert worlds * each == boats
    assert each <= 100


@pytest.mark.slow
def test_runs_are_a_share_of_their_campaign():
    simulated, taken = campaign_times(bench._CALM, controllers=2, trials=4)
    assert 0.1 < simulated / taken < 1.0


@pytest.fixture
def short(monkeypatch):
    """One short window of each side."""
    monkeypatch.setattr(bench, "BATCH_ROUNDS", 1)
    monkeypatch.setattr(bench, "WINDOW", 0.02)


@pytest.mark.slow
def test_threads_and_processes_are_both_timed(monkeypatch, short):
    assert all(rate > 0.0 for rate in two_threads_and_two_processes(32, 10))


@pytest.mark.slow
def test_a_row_weighs_more_than_its_state():
    weight = bench.megabytes_per_row(200)  # of a fresh process: a used one may have room for rows already
    assert 0.01 < weight < 10.0 or math.isnan(weight)  # MB; not known but on Linux


def without_free_rows(monkeypatch):
    """Rows of both engines are not measured."""
    monkeypatch.setattr(bench, "megabytes_per_row", lambda *_: 0.49)
    monkeypatch.setattr(bench, "engine_ratio", lambda *_: 2.5)
    monkeypatch.setattr(bench, "free_rates", lambda: (2_300_000.0, 4_500_000.0))
    monkeypatch.setattr(bench, "row_cost", lambda *_: 1.0)


@pytest.mark.slow
def test_engines_are_timed_side_by_side(short):
    assert bench.engine_ratio(2, "vrx") > 0.0
    assert bench.row_cost(4, 2) > 0.0
    assert all(rate > 0.0 for rate in bench.free_rates())


def test_the_scaling_row_shows_both_numbers(monkeypatch, capsys):
    monkeypatch.setattr(bench, "two_threads_and_two_processes", lambda *_: (900_000.0, 1_200_000.0))
    monkeypatch.setattr(bench, "boat_steps_per_second", lambda: 910_000.0)
    monkeypatch.setattr(bench, "environment_steps_per_second", lambda: 31_000.0)
    without_free_rows(monkeypatch)
    rows = {row["name"]: row for row in batch_rows()}
    assert list(rows)[:5] == [
        "batch_boat_steps_per_s", "batch_scaling_2_threads", "batch_scaling_4_rows", "vector_env_steps_per_s",
        "batch_mb_per_row",
    ]  # fmt: skip
    assert rows["free_ratio_1024_60_waves"]["ok"]
    assert rows["free_boat_steps_per_s"]["parts"] == {"boat steps/s, 1 thread": 2_300_000.0}
    scaling = rows["batch_scaling_2_threads"]
    assert (scaling["value"], scaling["ok"], scaling["limit"]) == (0.75, False, "at least")
    monkeypatch.setenv("COLUMNS", "200")
    print_rows(list(rows.values()))
    shown = capsys.readouterr().out
    assert all(text in shown for text in ("910,000", "900,000", "1,200,000", "4,500,000", "at least 0.85", "no"))


def test_decisions_count_every_row(clock):
    class Slow:
        num_envs = 64

        def step(self, actions):
            clock.work(2e-3)

    assert decisions(Slow(), None, 0.5) == pytest.approx(64 / 2e-3)


@pytest.mark.slow
def test_environments_are_timed(monkeypatch, short):
    monkeypatch.setattr(bench, "BATCH_ROWS", 4)
    assert environment_steps_per_second() > 0.0


def test_what_is_not_measured_has_no_verdict_and_says_what_is_missing(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(bench, "two_threads_and_two_processes", lambda *_: (9.0, 10.0))
    monkeypatch.setattr(bench, "boat_steps_per_second", lambda: 910_000.0)
    without_free_rows(monkeypatch)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *_: None if name == "gymnasium" else True)
    rows = {row["name"]: row for row in batch_rows()}
    print_rows(list(rows.values()))
    shown = capsys.readouterr().out.splitlines()
    name = "vector_env_steps_per_s"
    assert (rows[name]["value"], rows[name]["ok"]) == (None, None)
    (line,) = (line for line in shown if line.startswith("│ " + name))
    assert "not measured" in line
    assert "yes" not in line
    assert f"{name} is not measured: {needs_extra('it', 'Gymnasium', 'rl')}" in shown
    assert not any("nan" in line for line in shown)
    assert "NaN" not in json.dumps(list(rows.values()))
    (line,) = (line for line in shown if line.startswith("│ batch_boat_steps_per_s"))
    assert "yes" not in line  # it has no budget


def test_a_budget_is_met_or_not():
    assert [bench.bench_row("x", 1.0, "s", budget)["ok"] for budget in (2.0, 0.5, None)] == [True, False, None]
    assert [bench.bench_row("x", 1.0, "s", budget, at_least=True)["ok"] for budget in (2.0, 0.5)] == [False, True]
    assert bench.bench_row("x", math.nan, "s", 2.0, missing="Linux")["ok"] is None


def test_a_command_that_fails_has_no_processor_time():
    with pytest.raises(subprocess.CalledProcessError):
        bench.child_cost([sys.executable, "-c", "raise SystemExit(3)"])


def test_several_worlds_of_a_fleet_sail_on_one_thread(monkeypatch):
    monkeypatch.setattr(bench_fleet, "IN_ONE_WORLD", 2)
    row = fleet_row(6, paced=0.1, free=0.05)
    assert (row["boats"], row["worlds"]) == (6, 3)
    assert all(row[name] > 0.0 for name in ("memory_mb", "real_time_factor", "load_s"))
    assert 0.0 <= row["cpu_share"] < math.inf


def test_a_clock_of_processor_time_that_steps_gives_a_mean(monkeypatch):
    """As under a limit on processor time: it stands still for most calls."""
    ticks = iter([0.0, 0.0, 0.0, 0.0, 0.0, 0.004])
    monkeypatch.setattr(bench_fleet.time, "process_time", lambda: next(ticks))
    assert bench_fleet.real_time_factor(lambda _: None, 0.0) == pytest.approx(0.1 / (0.004 / 3))


@pytest.mark.slow
def test_a_row_of_the_table_is_of_a_fresh_process_beside_the_guides_figures():
    (row,) = fleet_table((2,), paced=0.5, free=0.1)
    assert (row["boats"], row["worlds"], row["guide_cpu_share"], row["guide_memory_mb"]) == (2, 1, 0.55, 1800.0)
    assert (row["memory_mb"] or 250) == pytest.approx(250, abs=150)  # Python, MuJoCo, numba and two boats
    assert row["cpu_share"] > 0.0


def test_the_fleet_table_is_printed_and_is_data(cli, monkeypatch):
    monkeypatch.setattr(bench_fleet, "fleet_table", lambda: [row_of(2, 80.0)])
    said = cli("bench", "--fleet-table", "--json", "fleets.json")
    assert json.loads(Path("fleets.json").read_text(encoding="utf-8")) == [row_of(2, 80.0)]
    assert all(text in said.out for text in ("1.2 %", "300 MB", "80 x"))


def row_of(boats, factor, worlds=1):
    return {
        "boats": boats,
        "worlds": worlds,
        "cpu_share": 1.0 / factor,
        "memory_mb": 300.0,
        "real_time_factor": factor,
        "guide_cpu_share": None,
        "guide_memory_mb": None,
    }


def test_the_table_says_why_a_fleet_does_not_keep_up():
    assert remarks([row_of(1, 200.0), row_of(3000, 0.5)]) == [
        "3,000 boats are too many for this core: a step of one takes 6.67 microseconds here, and may take 3.33."
    ]


def test_the_table_says_which_fleets_are_several_worlds(capsys):
    rows = [row_of(100, 30.0), row_of(1000, 3.0, worlds=10)]
    print_fleet_table(rows)
    shown = " ".join(capsys.readouterr().out.split())
    assert bench_fleet.MISSING in shown
    assert "1,000*" in shown


def costs(*noise):
    """Rounds in which every command costs 2 s, and 0.2 s more with a recording; the noise of each round is added.

    Recordings alone cost 0.4 s, and 0.2 s more of 10 minutes.
    """
    names = [name for side in SIDES for name in (side, f"{side} MB")]
    found = {name: [2.0 + 0.2 * (".rrd" in name) + extra * (name == "minute.rrd") for extra in noise] for name in names}
    return found | {name: [0.4 + 0.2 * (name == "ten")] * 16 for name in RECORDINGS}


def test_figures_of_recordings_are_made_of_the_medians_of_the_rounds():
    rows = {row["name"]: row for row in rows_of(costs(0.0, 0.1, 0.0, 0.1))}
    assert list(rows) == list(FIGURES)
    assert rows["readme_run_s"]["value"] == pytest.approx(2.25)
    assert rows["readme_run_s"]["parts"] == {"A/A": pytest.approx(0.1)}
    assert rows["record_open_close_s"]["value"] == pytest.approx(0.4)
    assert rows["record_share"]["value"] == pytest.approx(0.2 / 2.2)
    assert rows["record_boat_of_100"]["value"] == pytest.approx(0.03 * 0.2 / 0.25)


def test_a_recording_costs_what_its_run_takes_longer_than_one_without(clock, monkeypatch):
    class Run:
        def __init__(self, world, seed):
            self.second = 0.5

        def step(self, commands, duration):
            clock.work(self.second)

    @contextmanager
    def recording(sim, path, sensors):
        clock.work(0.2)
        sim.second += 0.01
        yield
        clock.work(0.1)

    monkeypatch.setattr(bench, "compile_world", lambda *_, **__: SimpleNamespace(boats=("a",)))
    monkeypatch.setattr(bench, "Simulation", Run)
    monkeypatch.setattr(sailing, "recording", recording)
    assert bench.recording_seconds(3) == pytest.approx(0.2 + 3 * 0.01 + 0.1)


@pytest.mark.parametrize(
    ("noise", "verdict"), [((0.0, 0.0), True), ((0.0, 0.3), True), ((0.0, 1.0), None), ((0.9, 0.9), False)]
)
def test_there_is_a_verdict_where_the_margin_is_wider_than_the_difference_of_equal_rounds(noise, verdict):
    (row,) = (row for row in rows_of(costs(*noise)) if row["name"] == "readme_run_s")
    assert row["ok"] is verdict


def test_a_film_that_cannot_be_drawn_is_not_measured():
    (row,) = (
        row for row in rows_of(costs(0.0, 0.0) | {"film": [math.nan, math.nan]}) if row["name"] == "film_minute_s"
    )
    assert (row["value"], row["ok"]) == (None, None)
    assert "video" in row["missing"]


def test_the_sizes_of_a_recordings_parts_make_up_the_file(tmp_path):
    sim = Simulation(compile_world({"sea": {"model": "none"}}))
    with record(sim, tmp_path / "run.rrd"):
        sim.step(duration=20.0)
    found = sizes(tmp_path / "run.rrd")
    assert set(found) <= {*PARTS.values(), "the rest"}
    assert found["exact rows"] > 1000
    assert sum(found.values()) == pytest.approx((tmp_path / "run.rrd").stat().st_size, rel=0.25)
