import csv
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString

from campaigns import failed, scored
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import (
    MOST,
    TOLERANCE,
    Tracks,
    read_result,
    read_results,
    simplified_track,
    write_csv,
    write_json,
    write_result,
)
from vrx_mj.errors import RecordError

GOOD = scored("a:f", "w/1", 3, 1.25, tracks={"wamv": [[0.0, 1.5], [2.0, 3.0]]})
BAD = failed("a:f", "w/1", 4, 'it said "no, 测试"\nand sank')


@pytest.mark.parametrize("result", [GOOD, BAD])
def test_a_result_reads_back_as_it_was(tmp_path, result):
    write_result(tmp_path, result)
    assert read_result(tmp_path) == result
    assert [file.name for file in tmp_path.iterdir()] == ["result.json"]


def test_only_whole_results_of_the_right_cell_count(tmp_path):
    cells = [Cell("a:f", "w", seed) for seed in range(4)]
    right = scored("a:f", "w", 0, 1.0)
    write_result(tmp_path / cells[0].folder, right)
    write_result(tmp_path / cells[1].folder, right)
    (tmp_path / cells[2].folder).mkdir(parents=True)
    (tmp_path / cells[2].folder / "result.json").write_text('{"format": 1, "cell"', encoding="utf-8")
    assert read_results(tmp_path, cells) == {cells[0]: right}


def test_a_result_of_another_version_is_refused(tmp_path):
    write_json(tmp_path / "result.json", {"format": 9})
    with pytest.raises(RecordError, match=r"result\.json has format 9; this version reads 1$"):
        read_result(tmp_path)


def test_the_table_has_a_line_for_each_result(tmp_path):
    write_csv(tmp_path / "results.csv", [GOOD, BAD])
    with (tmp_path / "results.csv").open(encoding="utf-8", newline="") as file:
        good, bad = csv.DictReader(file)
    assert (good["controller"], good["world"], good["seed"], good["state"]) == ("a:f", "w/1", "3", "finished")
    assert (good["task"], good["score"], good["unit"], good["better"]) == ("stationkeeping", "1.25", "m", "lower")
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
