"""What `vrx-mj bench` measures, and against which budgets: worlds, fleets, commands and rows as they were."""

import json
from types import SimpleNamespace

import pytest

from fingerprints import check
from vrx_mj.cli import bench, bench_campaign, bench_fleet

MEASURED = (
    "step_ratio", "boats_in_real_time", "import_seconds", "processor_seconds", "compile_seconds", "lidar_scans",
    "real_time_factor", "ardupilot_factor", "boat_steps_per_second", "environment_steps_per_second",
    "megabytes_per_row", "engine_ratio", "row_cost",
)  # fmt: skip


@pytest.fixture
def asked(monkeypatch):
    """What was measured, none of which is; each figure is another number."""
    found = []

    def measuring(name):
        return lambda *given, **named: found.append([name, *given, named]) or 1.0 + 0.125 * len(found)

    for name in MEASURED:
        monkeypatch.setattr(bench, name, measuring(name))
    monkeypatch.setattr(bench, "two_threads_and_two_processes", lambda *_: (1000.0, 500.0))
    monkeypatch.setattr(bench, "free_rates", lambda: (3000.0, 5000.0))
    monkeypatch.setattr(bench, "campaign_times", lambda *given: found.append([*given]) or (3.0 + len(found), 40.0))
    return found


def test_the_bench_measures_what_it_measured(asked, capsys, monkeypatch):
    shown = []

    class Bar:
        def __init__(self, *given):
            shown.append(given)

        def __enter__(self):
            return SimpleNamespace(update=lambda *given: shown.append(given))

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(bench, "Bar", Bar)
    monkeypatch.setenv("COLUMNS", "160")
    rows = bench.measure()
    assert json.loads(json.dumps(rows)) == rows
    bench.print_rows(rows)
    out = capsys.readouterr().out
    check("bench", "rows", rows=rows, asked=asked, shown=shown, table=[line.split() for line in out.splitlines()])


def test_worlds_and_fleets_of_the_bench_are_what_they_were():
    boats = [bench.fleet(count) for count in (1, 3, 27)]
    fleets = [bench_fleet.in_worlds_of(count) for count in (*bench_fleet.FLEETS, 101, 200, 250)]
    check("bench", "worlds", boats=boats, seas=[bench.SEA, bench._OCEAN, bench._MARINE, bench._CALM, bench._TASK],
          sides=bench.SIDES, parts=bench.PARTS, recordings=bench.RECORDINGS, fleets=fleets, guide=bench_fleet._GUIDE,
          bare=[bench._BARE_BOAT, bench._BARE_WORLD], rows=bench.BATCH_ROWS)  # fmt: skip


def test_the_bench_of_recordings_runs_what_it_ran(monkeypatch, tmp_path):
    """Two rounds, the second in the other order, with costs that grow by the command and from round to round."""
    ran = []

    def cost(command, folder):
        ran.append(command[1:])
        return 1.0 + 0.25 * len(command) + 0.01 * len(ran), 100.0 + len(ran)

    process = SimpleNamespace(submit=lambda call, seconds: ran.append([call.__name__, seconds]) or done)
    done = SimpleNamespace(result=lambda: 0.2 + 0.03 * len(ran))

    class Process:
        def __enter__(self):
            return process

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(bench, "child_cost", cost)
    monkeypatch.setattr(bench, "fresh_process", Process)
    names = {"hundred_start": 1.0, "hundred": 8.0}
    monkeypatch.setattr(bench, "sizes", lambda file: {"states": 1e6 * names[file.stem], "the rest": 2e5})
    monkeypatch.setattr(bench, "recording_seconds", recording_seconds)
    check("bench", "recordings", rows=bench.recording_rows(2), ran=ran, all=len(bench.recording_rows()))


def recording_seconds():
    """Stands for what measures one."""


@pytest.mark.parametrize("controllers", [1, 2])
def test_the_bench_of_campaigns_counts_what_it_counted(monkeypatch, controllers):
    """Trials that take 0.5 s between the first and the last call; processes take 2 s more with each look."""
    planned, looks = [], iter(range(0, 100, 2))

    def run_trials(trials, folder, _engine):
        planned.extend(trials)
        for number, trial in enumerate(trials):
            log = folder / trial.cell.folder / "log.txt"
            log.parent.mkdir(parents=True, exist_ok=True)
            log.write_text(f"{number}\n{number + 0.5}\n", encoding="utf-8")
            yield SimpleNamespace(cell=trial.cell)

    class Store:
        def __init__(self, *_, **__):
            self.add = lambda _result: None

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

    page = SimpleNamespace(refresh=lambda result: None)
    monkeypatch.setattr(bench_campaign, "run_trials", run_trials)
    monkeypatch.setattr(bench_campaign, "ResultStore", Store)
    monkeypatch.setattr(bench_campaign, "LivePage", lambda _campaign: page)
    monkeypatch.setattr(bench_campaign, "_cpu_time", lambda: float(next(looks)))
    simulated, taken = bench_campaign.campaign_times(bench._CALM, controllers, trials=20)
    assert simulated == pytest.approx(0.5 * 20 * controllers * 300 / 299)
    assert taken == 2.0
    assert (len(planned), {trial.duration for trial in planned}) == (80 * controllers, {30.0})
    assert {trial.cell.controller for trial in planned} == {f"hold_{one}:steady" for one in range(controllers)}
