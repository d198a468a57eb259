import re
from dataclasses import replace

import numpy as np
import pytest

import recorded_run
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.errors import RecordError, VrxWarning
from vrx_mj.recording import open_viewer, session
from vrx_mj.recording.checks import compare
from vrx_mj.recording.reader import read_record
from vrx_mj.recording.video import write_video


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return read_record(recorded_run.record_run(tmp_path_factory.mktemp("runs") / "run.rrd", 3.0))


def changed(record, row, column, value):
    rows = record.rows.copy()
    rows[row, column] = value
    return replace(record, rows=rows)


def test_equal_runs_are_equal(record, tmp_path):
    again = recorded_run.record_run(tmp_path / "again.rrd", 3.0)
    found = compare(record.path, again)
    assert found.equal
    assert str(found) == "equal bit for bit: 61 rows"


def test_first_parting_is_named_with_its_time_body_and_values(record):
    column = record.layout.names().index("wamv2 y")
    before = float(record.rows[40, column])
    after = float(np.nextafter(before, np.inf))
    other = changed(changed(record, 40, column, after), 50, 3, 0.0)
    found = compare(record, other)
    assert not found.equal
    assert found.parting is not None
    assert (found.parting.row, found.parting.time, found.parting.column) == (40, 2.0, "wamv2 y")
    gap = f"{after - before:.2g}"
    assert str(found) == f"they diverge at 2.000 s (row 40) in wamv2 y: {before!r} and {after!r}, {gap} apart"


def test_number_of_columns_that_part_is_told(record):
    other = changed(changed(record, 7, 2, 1.0), 7, 3, 2.0)
    text = str(compare(record, other))
    assert text.startswith("they diverge at 0.350 s (row 7) in wamv1 left thrust: ")
    assert text.endswith(" apart, and 1 more columns")


def test_sign_of_zero_parts_two_runs_and_equal_nans_do_not(record):
    zero, minus = changed(record, 5, 2, 0.0), changed(record, 5, 2, -0.0)
    nan = changed(record, 5, 2, np.nan)
    assert not compare(zero, minus).equal
    assert compare(nan, nan).equal


def test_shorter_run_is_told_apart(record):
    other = replace(record, rows=record.rows[:40])
    both = f"40 rows of {len(record.layout.names())} columns"
    assert str(compare(record, other)) == f"rows: 61 and 40\nthe rows that both have are equal bit for bit: {both}"
    assert not compare(record, other).equal


def test_other_seed_and_other_bodies_are_told(record, tmp_path):
    other = recorded_run.record_run(tmp_path / "other.rrd", 1.0, boats=2, seed=8)
    found = compare(record, other)
    assert not found.equal
    lines = str(found).splitlines()
    assert lines[0] == "seed: 7 and 8"
    assert lines[1].startswith(f"only '{record.path}' has wamv3 ")


def test_equal_motion_of_fleets_with_other_names_is_equal(record):
    properties = {**record.properties, "fleet": "harbour", "world_sha256": "0", "physics_version": 1}
    found = compare(record, replace(record, properties=properties))
    assert found.equal
    assert str(found).splitlines() == [
        f"fleet: {record.properties.get('fleet')!r} and 'harbour'",
        f"world_sha256: {record.properties.get('world_sha256')!r} and '0'",
        f"physics_version: {PHYSICS_VERSION} and 1",
        "equal bit for bit: 61 rows",
    ]


@pytest.mark.parametrize("version", [1, PHYSICS_VERSION + 1])
def test_whoever_replays_a_run_of_other_physics_is_warned(tmp_path, monkeypatch, version):
    monkeypatch.setattr(recorded_run, "PHYSICS_VERSION", version)
    other = recorded_run.record_run(tmp_path / "other.rrd", 0.1, boats=1)
    told = f"'{other}' is of physics version {version}, and this is {PHYSICS_VERSION}: equal runs differ"
    monkeypatch.setattr(session, "no_window", lambda **_: None)
    monkeypatch.setattr(session, "viewer_binary", lambda: "true")  # a program that does nothing
    with pytest.warns(VrxWarning, match=f"^{re.escape(told)}$"):
        assert open_viewer(other) == 0
    with pytest.warns(VrxWarning, match=f"^{re.escape(told)}$"), pytest.raises(RecordError, match="no world to draw"):
        write_video(other, tmp_path / "other.mp4")


def test_boats_that_both_have_are_compared_where_one_recording_has_more(record, tmp_path):
    other = read_record(recorded_run.record_run(tmp_path / "other.rrd", 1.0, boats=2))
    assert str(compare(record, other)).splitlines()[-1].startswith("they diverge at 0.000 s (row 0) in wamv2 x: ")
    names = record.layout.names()
    rows = record.rows[: len(other.rows), [names.index(name) for name in other.layout.names()]]
    other = replace(other, rows=rows)
    found = compare(record, other)
    assert (found.equal, found.complete, found.parting) == (False, False, None)
    both = f"{len(other.rows)} rows of {len(other.layout.names())} columns"
    assert str(found).splitlines()[-1] == f"the rows that both have are equal bit for bit: {both}"
    column = other.layout.names().index("wamv2 y")
    parting = compare(record, changed(other, 9, column, 1.0)).parting
    assert parting is not None
    assert (parting.row, parting.column, parting.second) == (9, "wamv2 y", 1.0)


def test_versions_alone_do_not_part_runs(record):
    assert compare(record, replace(record, properties={**record.properties, "versions": {}})).equal
