"""The report: counts, JSON, the page, and cases that fail."""

import json
import math
import re
import time
from dataclasses import replace

import numba
import pytest

from vrx_mj.draw.chart import Chart, Series
from vrx_mj.errors import UnknownNameError, VrxError
from vrx_mj.packages import root
from vrx_mj.validation import case as reference
from vrx_mj.validation.case import Band, Case, Comparison, case
from vrx_mj.validation.report import CASES, counts, evidence, page, results_json, run_cases, select_cases, write_report


def found(*ours):
    yield from (Comparison(f"row {value:g}", "m", 1.0, value, band=Band("measured", "10 %")) for value in ours)
    yield Chart("a chart", "x", "y", [Series("<ours>", [0.0, 1.0], [0.0, 1.0])])


def made(name, run):
    return Case(name, f"the case {name}", "a <tank>", "a formula & its book", ("physics/panels.py",), run)


def failing():
    raise VrxError("no water")


GOOD, BAD, FAILED = made("good", lambda: found(1.0, 1.05)), made("bad", lambda: found(1.0, 2.0)), made("worse", failing)


def test_rows_are_counted_and_a_failed_case_is_one_that_is_outside():
    assert counts(run_cases([GOOD])) == (2, 0, 2)
    assert counts(run_cases([GOOD, BAD, FAILED])) == (3, 0, 5)


def test_rows_that_are_known_to_be_outside_are_counted_apart():
    rows = [replace(row, theory=2.0) for row in found(1.0, 2.0) if isinstance(row, Comparison)]
    results = run_cases([GOOD, made("known", lambda: rows), BAD])
    assert [result.state for result in results] == ["inside", "known", "outside"]
    assert counts(results) == (4, 1, 6)
    tree = results_json(results)
    assert (tree["inside"], tree["known"], tree["rows"]) == (4, 1, 6)
    assert [each["state"] for each in tree["cases"][1]["rows"]] == ["inside", "known"]
    assert '<td class="l">known</td>' in page(results)


def test_kinds_of_references_are_counted_apart():
    def mixed():
        yield from found(1.0, 2.0)
        yield Comparison("other", "m", 1.0, 1.0, band=Band("closed form", "0"))

    results = run_cases([made("mixed", mixed), FAILED])
    assert evidence(results) == [("measured", 1, 2), ("closed form", 1, 1)]
    kinds = {"measured": {"inside": 1, "rows": 2}, "closed form": {"inside": 1, "rows": 1}}
    assert results_json(results)["evidence"] == kinds
    assert "<b>1<small> / 2</small></b><span>measured</span>" in page(results)


def test_a_row_without_a_band_fails_its_case():
    (result,) = run_cases([made("bare", lambda: [Comparison("drift", "m", 1.0, 1.0)])])
    assert result.error == "assets/validation/bands.csv: no band for 'drift' of case bare"


def test_the_time_that_compiling_takes_is_told_apart():
    def compiles():
        numba.njit(lambda x: x + 1)(1)
        return found(1.0)

    begun = time.monotonic()
    (first,) = run_cases([made("first", compiles)])
    assert first.compiling > 0.0 <= first.seconds
    assert first.seconds + first.compiling < time.monotonic() - begun
    (none,) = run_cases([GOOD])
    assert none.compiling == 0.0


def test_json_has_every_row():
    tree = results_json(run_cases([GOOD, BAD, FAILED]))
    assert (tree["inside"], tree["rows"]) == (3, 5)
    assert [each["inside"] for each in tree["cases"]] == [True, False, False]
    assert [each["error"] for each in tree["cases"]] == [None, None, "no water"]
    row = tree["cases"][1]["rows"][1]
    assert (row["reference"], row["ours"], row["difference"], row["inside"]) == (1.0, 2.0, 1.0, False)
    assert (row["low"], row["high"], row["band"]) == (pytest.approx(0.9), pytest.approx(1.1), "± 10 %")


def test_numbers_that_json_does_not_have_are_null(tmp_path):
    row = (
        Comparison("drift", "m", 1.0, math.inf, band=Band("closed form", "10 %")),
        Comparison("rate", "", None, math.nan, band=Band("closed form", "0 to 1")),
    )
    results = run_cases([made("wild", lambda: row)])
    write_report(tmp_path / "a" / "report", results)
    tree = json.loads((tmp_path / "a" / "report" / "results.json").read_text(encoding="utf-8"))
    assert [(each["ours"], each["inside"]) for each in tree["cases"][0]["rows"]] == [(None, False)] * 2


def test_the_page_shows_what_a_reader_needs_and_escapes_it():
    text = page(run_cases([GOOD, BAD, FAILED]), [replace(GOOD, name="slow")])
    for words in ("a &lt;tank&gt;", "a formula &amp; its book", "vrx_mj/physics/panels.py", "± 10 %", "no water"):
        assert words in text
    assert "<tank>" not in text
    assert "--only bad" in text
    assert "Not in this report: slow." in text
    assert text.count('<svg class="chart"') == 2
    assert not re.findall(r"https?://(?!www\.w3\.org/)", text)


def test_cases_are_chosen_by_name():
    first, second = CASES[3], CASES[0]
    assert select_cases((first.name, second.name)) == (second, first)
    assert select_cases() == CASES
    assert select_cases(quick=True) == tuple(each for each in CASES if each.quick)
    with pytest.raises(UnknownNameError) as error:
        select_cases(("airry",))
    assert str(error.value).startswith("no case named 'airry'; did you mean 'airy'?")


def test_cases_name_files_that_are_there():
    package = root() / "src" / "vrx_mj"
    for each in CASES:
        assert [file for file in each.files if not (package / file).is_file()] == [], each.name
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", each.name)
        assert each.setup.endswith("."), each.name
        assert len(each.source) > 30, each.name
        for file in re.findall(r"assets/\S+\.(?:yaml|csv|off)", f"{each.setup} {each.source}"):
            assert list(root().glob(file)), file


def test_a_docstring_is_what_the_report_shows():
    @case("physics/panels.py", table="airy", quick=False)
    def a_case():
        """Lengths of waves.

        A tank with
        a wave.

        Reference: Airy (1845), linear.
        """

    assert (a_case.name, a_case.title, a_case.setup) == ("a-case", "Lengths of waves", "A tank with a wave.")
    assert a_case.source == f"Airy (1845), linear. {reference.source('airy')}"
    assert (a_case.files, a_case.quick) == (("physics/panels.py",), False)


def test_names_of_cases_differ():
    names = [each.name for each in CASES]
    assert len(set(names)) == len(names)


def test_tables_name_their_source():
    for table in reference.folder().glob("*.csv"):
        assert len(reference.source(table.stem)) > 60, table
        assert reference.rows(table.stem)


def test_multipoles_have_hulmes_digits():
    """Hulme (1982): added mass and damping in heave, as LHEEA's repository of benchmarks quotes them."""
    hulme = {0.05: (0.8764, 0.1036), 0.1: (0.8627, 0.1816), 0.2: (0.7938, 0.2793), 0.3: (0.7157, 0.3254),
             0.5: (0.5861, 0.3391), 0.7: (0.4999, 0.3098), 1.0: (0.4284, 0.2484), 1.4: (0.3924, 0.1756),
             2.0: (0.3884, 0.1031), 2.5: (0.3988, 0.0674), 3.0: (0.4111, 0.0452)}  # fmt: skip
    for row in reference.rows("hemisphere"):
        mass, damping = hulme[float(row["ka"])]
        assert float(row["added_mass"]) == pytest.approx(mass, abs=6e-5)
        assert float(row["damping"]) == pytest.approx(damping, abs=6e-5)


OUTSIDE = {"sphere-decay": ["first trough, height", "second trough, height"]}
"""Rows outside, as exact theory is, by their case, besides those that `bands.csv` says are."""


QUICK = [case.name for case in select_cases(quick=True)]
LONGEST = "response-amplitudes"
"""The quick case that takes as long as all others together."""
PARTS = [[name for name in QUICK if name != LONGEST][first::4] for first in range(4)]


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("names", [*PARTS, [LONGEST]])
def test_quick_cases_are_inside_but_for_what_is_known(names):
    """Every fourth case, so that the parts take about as long as each other; by day they find what they found."""
    for result in run_cases(select_cases(tuple(names))):
        assert result.error == "", result.case.name
        found = [row for row in result.rows if not row.inside]
        known = [row.quantity for row in result.rows if row.band.known]
        assert [row.quantity for row in found] == OUTSIDE.get(result.case.name, known)
        assert {row.state for row in found} <= {"known"}, result.case.name
        assert result.rows, result.case.name
        for chart in result.charts:
            assert any(series.reference for series in chart.series), chart.title
