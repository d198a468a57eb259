import csv
import math
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString

from campaigns import failed, scored
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import (
    MOST,
    TOLERANCE,
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
    assert LineString(places).hausdorff_distance(LineString(line)) <= TOLERANCE + ROUNDING + 1e-6
    assert all(math.dist(line[end], places[end]) <= ROUNDING + 1e-9 for end in (0, -1))


def test_a_straight_way_needs_two_points():
    tracks = Tracks()
    for i in range(1000):
        tracks.add("wamv", (0.1 * i, 0.05 * i, 0.0))
    assert len(tracks.lines()["wamv"]) == 2


def test_a_long_curly_way_keeps_few_points():
    places = [(i * math.cos(i), i * math.sin(i)) for i in range(1500)]
    assert 2 < len(simplified_track(places)) <= MOST
