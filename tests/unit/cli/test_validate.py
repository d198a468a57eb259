"""`vrx-mj validate`: its folder, its last line and its exit codes."""

import json
from dataclasses import replace

import pytest

from vrx_mj.draw.chart import Chart
from vrx_mj.validation import report
from vrx_mj.validation.case import Band, Case, Comparison


def case(name, ours, **options):
    found = Comparison("force", "N", 100.0, ours, band=Band("measured", "1 %")), Chart("", "", "", ())
    return Case(name, "A title", "set up.", "a source", (), lambda: iter(found), **options)


@pytest.fixture
def three(monkeypatch):
    monkeypatch.setattr(report, "CASES", (case("one", 100.5), case("two", 102.0), case("three", 99.5, quick=False)))


def test_all_inside(cli, folder, three):
    found = cli("validate", "--only", "one", "--only", "three")
    assert found.code == 0
    assert found.out.splitlines()[-1] == "2 of 2 inside: measured 2 of 2"
    assert "<html" in (folder / "report" / "index.html").read_text(encoding="utf-8")
    tree = json.loads((folder / "report" / "results.json").read_text(encoding="utf-8"))
    assert [each["name"] for each in tree["cases"]] == ["one", "three"]


def test_one_outside_is_printed_and_ends_with_1(cli, folder, three):
    found = cli("validate", "--quick", "-o", "there")
    assert found.code == 1
    assert found.out.splitlines()[-1] == "1 of 2 inside: measured 1 of 2"
    assert "two: force is 102 N, the band is 99 to 101" in found.out
    assert (folder / "there" / "index.html").is_file()


def test_rows_that_are_known_to_be_outside_do_not_end_with_1(cli, folder, monkeypatch):
    known = case("known", 102.0)
    row = replace(next(known.run()), theory=102.0)
    monkeypatch.setattr(report, "CASES", (case("one", 100.5), replace(known, run=lambda: iter([row]))))
    found = cli("validate")
    assert found.code == 0
    assert found.out.splitlines()[-1] == "1 of 2 inside, 1 known to be outside: measured 1 of 2"
    assert "known: known: force is 102 N, the band is 99 to 101" in found.out


def test_an_unknown_case(cli, folder, three):
    found = cli("validate", "--only", "four")
    assert (found.code, found.out) == (2, "")
    assert "no case named 'four'; known: one, two, three" in found.err
    assert list(folder.iterdir()) == []


def test_a_folder_that_cannot_be(cli, folder, three):
    (folder / "report").write_text("", encoding="utf-8")
    found = cli("validate", "--only", "one")
    assert found.code == 2
    assert "cannot write the report 'report/results.json': File exists" in found.err


def test_one_file_of_two(cli, folder, three):
    found = cli("validate", "--case", "mine.yaml")
    assert found.code == 2
    assert "--case and --data are needed together: the case, and its measurements" in found.err


def test_measurements_of_a_user(cli, folder):
    (folder / "bay.yaml").write_text("physics: {profile: marine}\nspawn: {robot: skiff}\n", encoding="utf-8")
    case = "source: a lake\nworld: ./bay.yaml\nsignals: {speed: {band: 1}}\n"
    (folder / "mine.yaml").write_text(case, encoding="utf-8")
    (folder / "mine.csv").write_text("time,speed\n0,0\n1,9\n", encoding="utf-8")
    found = cli("validate", "--case", "mine.yaml", "--data", "mine.csv")
    assert found.code == 1
    assert found.out.splitlines()[-1] == "0 of 1 inside: measured 0 of 1"


@pytest.mark.slow
def test_a_real_case(cli):
    found = cli("validate", "--only", "airy")
    assert found.code == 0
    assert found.out.splitlines()[-1] == "3 of 3 inside: closed form 3 of 3"
