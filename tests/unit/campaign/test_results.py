import csv
import math
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString

from campaigns import failed, scored
from vrx_mj.campaign import results
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import (
    MAX_TRACK_POINTS,
    TRACK_TOLERANCE,
    ResultStore,
    Tracks,
    read_results,
    simplified_track,
    write_csv,
    write_json,
)
from vrx_mj.errors import RecordError

GOOD = scored("a:f", "w/1", 3, 1.25, tracks={"wamv": [[0.0, 1.5], [2.0, 3.0]]})
BAD = failed("a:f", "w/1", 4, 'it said "no, 测试"\nand sank')


def test_results_read_back_as_they_were_once_for_each_cell(tmp_path):
    good = replace(GOOD, parameters={"wind.mean": 3.5}, recording="run.rrd", poses_sha256="ab")
    with ResultStore(tmp_path, writes=True) as store:
        store.add(failed("a:f", "w/1", 3))
        store.add(good, BAD)
        assert store.tracks([GOOD.cell, BAD.cell, Cell("a:f", "w/1", 5)]) == {GOOD.cell: GOOD.tracks, BAD.cell: {}}
        found = read_results(tmp_path, [BAD.cell, GOOD.cell, Cell("a:f", "w/1", 5)])  # while it is written
    assert list(found) == [BAD.cell, GOOD.cell]
    assert found == read_results(tmp_path, [BAD.cell, GOOD.cell])
    assert found[BAD.cell] == BAD
    kept = {key: value for key, value in good.task.items() if key not in {"state", "events"}}
    assert found[GOOD.cell] == replace(good, task=kept, tracks={})
    assert [file.name for file in tmp_path.iterdir()] == ["results.sqlite"]


def test_an_empty_file_is_no_database_yet(tmp_path):
    """As `sqlite3.connect` leaves it, of who looks whether there are results."""
    sqlite3.connect(tmp_path / "results.sqlite").execute("pragma user_version").close()
    (tmp_path / "results.sqlite").touch()
    assert not read_results(tmp_path, [GOOD.cell])
    with ResultStore(tmp_path, writes=True) as store:
        store.add(GOOD)
    assert list(read_results(tmp_path, [GOOD.cell])) == [GOOD.cell]


WRITER = """
import os, signal, sys
from pathlib import Path
from types import SimpleNamespace
from campaigns import scored
from vrx_mj.campaign.results import ResultStore
with ResultStore(Path(sys.argv[1]), writes=True) as store:
    for seed in range(1000):
        store.add(scored("a:f", "w", seed, float(seed)))
        if seed == 20:
            os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_results_are_there_after_a_kill(tmp_path):
    here = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", WRITER, str(tmp_path)], check=False, cwd=here)
    cells = [Cell("a:f", "w", seed) for seed in range(1000)]
    assert [cell.seed for cell in read_results(tmp_path, cells)] == list(range(21))
    with ResultStore(tmp_path, writes=True) as store:
        store.add(scored("a:f", "w", 20, 1.0), scored("a:f", "w", 21, 1.0))
    assert len(read_results(tmp_path, cells)) == 22


def test_results_of_version_0_1_are_read(tmp_path):
    """A file for each cell, without state; one that was cut short or is of another cell does not count."""
    cells = [Cell("a:f", "w", seed) for seed in range(5)]
    trees = [
        asdict(scored("a:f", "w", seed, 1.0, phase=phase))
        for seed, phase in enumerate(("running", "finished", "ready"))
    ]
    for cell, tree in zip(cells, trees, strict=False):
        former = {key: tree[key] for key in tree if key not in {"state", "poses_sha256", "parameters"}}
        write_json(tmp_path / cell.folder / "result.json", {"format": 1, **former})
    shutil.copytree(tmp_path / cells[0].folder, tmp_path / cells[3].folder)
    (tmp_path / cells[4].folder).mkdir(parents=True)
    (tmp_path / cells[4].folder / "result.json").write_text('{"format": 1, "cell"', encoding="utf-8")
    assert [result.state for result in read_results(tmp_path, cells).values()] == ["cut", "finished", "not started"]


@pytest.mark.parametrize(("statement", "message"), [
    ("pragma user_version = 9", r"results\.sqlite has format 9; this version reads 2: use the vrx_mj that wrote it"),
    (None, r"^cannot use the results .*results\.sqlite: file is not a database; free the disk or"),
])  # fmt: skip
def test_results_that_cannot_be_read_are_refused(tmp_path, statement, message):
    file = tmp_path / "results.sqlite"
    if statement:
        sqlite3.connect(file).execute(statement).close()
    else:
        file.write_bytes(b"no database" * 1000)
    with pytest.raises(RecordError, match=message):
        read_results(tmp_path, [])


def test_results_that_are_gone_are_named(tmp_path):
    with pytest.raises(RecordError, match=r"results\.sqlite: it is gone; free the disk or stop"):
        ResultStore(tmp_path / "there")


def test_the_table_has_a_line_for_each_result(tmp_path):
    write_csv(tmp_path / "results.csv", [replace(GOOD, parameters={"wind.mean": 3.5}), BAD])
    with (tmp_path / "results.csv").open(encoding="utf-8", newline="") as file:
        good, bad = csv.DictReader(file)
    assert (good["controller"], good["world"], good["seed"], good["state"]) == ("a:f", "w/1", "3", "finished")
    assert (good["task"], good["score"], good["unit"], good["better"]) == ("stationkeeping", "1.25", "m", "lower")
    assert (good["wind.mean"], bad["wind.mean"], "parameters" in good) == ("3.5", "", False)
    assert (bad["state"], bad["score"], bad["error"]) == ("failed", "", BAD.error)


ROUNDING = 0.05 * math.sqrt(2.0)  # to a decimetre, both ways [m]


@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=2, max_size=60))
def test_a_simplified_track_stays_near_and_keeps_its_ends(places):
    line = simplified_track(places)
    assert LineString(places).hausdorff_distance(LineString(line)) <= TRACK_TOLERANCE + ROUNDING + 1e-6
    assert all(math.dist(line[end], places[end]) <= ROUNDING + 1e-9 for end in (0, -1))


def test_a_straight_way_needs_two_points():
    tracks = Tracks()
    for i in range(1000):
        tracks.add("wamv", (0.1 * i, 0.05 * i, 0.0))
    assert len(tracks.lines()["wamv"]) == 2


def test_a_long_curly_way_keeps_few_points():
    places = [(i * math.cos(i), i * math.sin(i)) for i in range(1500)]
    assert 2 < len(simplified_track(places)) <= MAX_TRACK_POINTS


@pytest.mark.parametrize(("corners", "are_kept"), [(400, True), (401, False)])
def test_a_zigzag_keeps_all_its_corners_where_they_are_400_at_most(corners, are_kept):
    places = [[3.0 * i, i % 2] for i in range(corners)]
    assert (simplified_track(places) == places) is are_kept


def test_the_table_has_a_column_for_each_thing_in_this_order(tmp_path):
    write_csv(tmp_path / "results.csv", [replace(GOOD, parameters={"wind.mean": 3.5}, wall_time=2.5), BAD])
    lines = (tmp_path / "results.csv").read_text(encoding="utf-8").split("\n")
    head = (
        "controller,world,seed,state,task,task_name,score,unit,better,timed_out,collisions,elapsed,sim_time,wall_time,"
        "state_sha256,poses_sha256,world_sha256,platform,recording,error"
    )
    assert lines == [
        f"{head},wind.mean",
        f'a:f,w/1,3,finished,{"stationkeeping," * 2}1.25,m,lower,True,0,300.0,320.0,2.5,"{GOOD.state_sha256}",,,,,,3.5',
        'a:f,w/1,4,failed,,,,,,,,,0.0,0.0,,,,,,"it said ""no, 测试""', 'and sank",', "",
    ]  # fmt: skip
    write_csv(tmp_path / "results.csv", [])
    assert (tmp_path / "results.csv").read_text(encoding="utf-8") == f"{head}\n"


def test_who_writes_is_waited_for_a_minute_and_readers_do_not_wait(tmp_path, monkeypatch):
    asked, connect = [], sqlite3.connect
    monkeypatch.setattr(sqlite3, "connect", lambda file, **how: asked.append(how["timeout"]) or connect(file, **how))
    with ResultStore(tmp_path, writes=True) as store:
        settings = [store._base.execute(f"pragma {name}").fetchone() for name in ("journal_mode", "synchronous")]
        assert settings == [("wal",), (1,)]
        with ResultStore(tmp_path) as reader:
            assert list(reader.results()) == []
        assert store._base.execute("pragma journal_mode").fetchone() == ("wal",)
        store.add(GOOD)
    assert asked == [60.0, 60.0]
    with sqlite3.connect(tmp_path / "results.sqlite", timeout=1.0) as base:
        assert base.execute("pragma journal_mode").fetchone() == ("delete",)
    base.close()


@pytest.mark.parametrize("kind", ["score", "version"])
def test_results_of_version_0_1_that_cannot_be_read_are_missing_or_refused(tmp_path, kind):
    file = tmp_path / GOOD.cell.folder / "result.json"
    if kind == "score":
        write_json(file, {"format": 1, "task": 3, "error": None})
        assert read_results(tmp_path, [GOOD.cell]) == {}
        write_json(file, {"format": 1, "cell": asdict(GOOD.cell), "task": None, "error": "it sank"})
        assert read_results(tmp_path, [GOOD.cell])[GOOD.cell].state == "failed"
        write_json(file, {"format": 1, "cell": asdict(GOOD.cell), "task": None, "error": None})
        assert read_results(tmp_path, [GOOD.cell])[GOOD.cell].state == "finished"
    else:
        write_json(file, {"format": 2})
        with pytest.raises(RecordError, match=r"result\.json has format 2; this version reads 1$"):
            read_results(tmp_path, [GOOD.cell])


@pytest.mark.parametrize("asks", [True, False])
def test_a_stopwatch_says_when_the_trial_must_have_ended(monkeypatch, asks):
    dumps = []
    monkeypatch.setattr(results, "TIME_UP", 12 if asks else None)
    monkeypatch.setattr(results.faulthandler, "dump_traceback_later", lambda *given, **how: dumps.append((*given, how)))
    monkeypatch.setattr(results, "time", SimpleNamespace(monotonic=lambda: 100.0))
    watch = results.Stopwatch(shared := [0.0] * 4)
    watch.allow(20.0)
    watch.reach(3.5)
    watch.lead(77)
    assert (shared, dumps) == ([120.0, 20.0, 3.5, 77], [] if asks else [(20.0, {"exit": True})])


def test_places_of_a_track_are_three_decimetres_apart_along_both_axes_together():
    tracks = Tracks()
    for x, y in ((0.0, 0.0), (0.25, 0.0), (0.125, -0.125), (0.25, -0.125), (0.25, 0.125), (-0.25, 0.125), (0.0, 0.0)):
        tracks.add("a", np.array([x, y, 0.0]))
    assert tracks._places == {"a": [(0.0, 0.0), (0.25, -0.125), (-0.25, 0.125), (0.0, 0.0)]}


def test_a_track_is_made_simpler_by_half_as_much_again_until_it_is_short_enough():
    """Of teeth of a saw, to which 0.2 m is near enough, then 0.3, and 0.45 m: the highest ones stay."""
    high = [0.18] * 100 + [0.22] * 500 + [0.42] * 500 + [0.55] * 300
    saw = simplified_track([(float(x), top * (x % 2)) for x, top in enumerate(high)])
    assert len(saw) == pytest.approx(300, abs=15)
    assert min(x for x, y in saw[1:]) == pytest.approx(1100.0, abs=3.0)


@pytest.mark.parametrize(("count", "kept"), [(400, 400), (401, 399)])
def test_a_track_has_four_hundred_points_at_most(count, kept):
    assert len(simplified_track([(float(x), 5.0 * (x % 2)) for x in range(count)])) == kept


def test_a_file_of_results_has_every_letter_as_it_is(tmp_path):
    write_json(tmp_path / "one.json", {"boat": "größte"})
    assert (tmp_path / "one.json").read_text(encoding="utf-8") == '{"boat": "größte"}\n'
