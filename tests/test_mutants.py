"""The list of mutants fits the sources, so that `tests/mutants/run.py` finds all of them where they were."""

import ast
import re
from collections import Counter
from types import SimpleNamespace

import pytest

from mutants.catalogue import KINDS, ROOT, Mutant, mutants
from mutants.lines import FOLDER, _within, far_line_tests, near_line_tests, write_map
from mutants.random_mutants import SOURCES, all_of, draw, edits_of, mutable
from mutants.run import DRAWN, EQUAL_MUTANTS, MARKS, STAGES, killed_share, table
from mutants.scratch import Scratch, nearest_tests, own_tests, related_tests

MUTANTS = mutants()
PACKAGES = {path.parent.relative_to(ROOT / "src/vrx_mj").as_posix() for path in (ROOT / "src").rglob("*.py")}


def test_each_mutant_changes_one_place_and_can_still_be_parsed():
    sources = {name: (ROOT / name).read_text(encoding="utf-8") for name in {mutant.source for mutant in MUTANTS}}
    for mutant in MUTANTS:
        text = mutant.mutated_source(sources[mutant.source])
        assert text != sources[mutant.source], mutant.id
        ast.parse(text, mutant.id)


def test_there_are_mutants_of_every_package_and_kind_and_no_two_alike():
    assert len(MUTANTS) >= 200
    assert {mutant.kind for mutant in MUTANTS} == set(KINDS)
    whole = {name.split("/")[0] for name in PACKAGES} - {"."}
    assert {mutant.package for mutant in MUTANTS if "/" in mutant.file} == whole
    assert max(Counter(mutant.id for mutant in MUTANTS).values()) == 1
    assert max(Counter((mutant.file, mutant.old, mutant.new) for mutant in MUTANTS).values()) == 1


def test_every_mutant_has_tests_near_it():
    for mutant in MUTANTS:
        files = [*nearest_tests(mutant), *own_tests(mutant)]
        assert files, mutant.id
        assert all((ROOT / file).exists() for file in files)


@pytest.mark.slow
def test_mutants_drawn_at_random_change_one_place_and_can_still_be_parsed():
    for mutant in draw(40, seed=1, only=["tasks", "frames"]):
        text = (ROOT / mutant.source).read_text(encoding="utf-8")
        assert ast.dump(ast.parse(mutant.mutated_source(text))) != ast.dump(ast.parse(text)), mutant.id
        files = [*nearest_tests(mutant), *related_tests(mutant)]
        assert files, mutant.id
        assert all((ROOT / file).exists() for file in files)


def test_edits_flip_change_and_drop_what_tests_can_see():
    text = """
if TYPE_CHECKING:
    x = not y
def f(a: int = 1) -> int:
    '''Doc 2.'''
    if a <= 3:
        g(zip(a, strict=True))
    return (b or not c) * min(d, 0.5) if e in f"{7}" else True
"""
    found = [re.sub(r"[()]", "", edit.new) for node in mutable(ast.parse(text)) for edit in edits_of(node)]
    assert sorted(found) == [
        "1 + 1", "2 * 0.5", "3 + 1", "False", "False", "a < 3", "b", "b and not c", "b or not c",
        "b or not c / mind, 0.5", "c", "d", "e not in f'{7}'", "not c", "pass",
    ]  # fmt: skip


def test_nights_add_the_fingerprints_that_are_too_slow_for_days():
    mutant = Mutant("any", "validation/cases/waves.py", "sign", "", "")
    assert "tests/integration/test_fingerprints_validation.py" in STAGES["nightly"](mutant)
    assert "nightly" in DRAWN
    assert MARKS["nightly"] == "slow"  # as many a fingerprint, which is marked nightly besides


def test_related_tests_import_the_package_by_names_at_the_top_by_helpers_and_by_fixtures():
    def of(file):
        return related_tests(Mutant("any", file, "sign", "", ""))

    assert "tests/integration/test_symmetry.py" in of("runtime/run.py")
    assert "tests/unit/recording/test_writer.py" in of("model/world.py")
    assert "tests/unit/cli/test_trial.py" in of("mjcf/world.py")
    assert "tests/integration/test_campaign_exec.py" in of("campaign/trial.py")
    assert "tests/integration/test_fingerprints_worlds.py" in of("physics/drag.py")
    assert "tests/integration/test_fingerprints_worlds.py" not in of("nmea.py")
    assert "tests/integration/test_fingerprints_files.py" in of("formats/gazebo/worlds.py")
    assert "tests/integration/test_fingerprints_validation.py" in of("validation/cases/waves.py")


@pytest.mark.slow
def test_mutants_equal_to_the_source_are_counted_apart_each_with_a_reason():
    rows = [{"package": "any", "file": "any.py", "id": kind, "killed": kind} for kind in ("near", "alive", "equal")]
    assert killed_share(rows) == 0.5
    assert "1 of 2 that are not equal killed: 50%\nalive:\n  any.py: alive\n" in table(rows, ["near"])
    for name, edits in EQUAL_MUTANTS.items():
        assert all(len(reason.split()) > 3 for reason in edits.values())
        drawn = Counter(mutant.id.partition(": ")[2] for mutant in all_of(SOURCES / name))
        assert {drawn[edit] for edit in edits} == {1}, name


def test_tests_are_those_of_a_file_or_of_a_folder():
    """A module that no file of tests is near to has those of its package."""
    one, other = "tests/unit/rl/test_a.py::test_x[1]", "tests/unit/rl_b/test_a.py::test_x"
    assert _within([one, other], ["tests/unit/rl"]) == _within([one, other], ["tests/unit/rl/test_a.py"]) == {one}


ALONE = """
def test_without_an_environment(monkeypatch):
    monkeypatch.setattr(os, "environ", {})
"""


@pytest.mark.slow
def test_a_map_is_not_made_of_some_tests(tmp_path):
    pytest.importorskip("coverage")
    ending = tmp_path / "test_ending.py"
    ending.write_text("import os\n\ndef test_that_ends_all():\n    os._exit(3)\n", encoding="utf-8")
    with pytest.raises(RuntimeError, match=r"^the map has not all tests: pytest ended with 3, see .*pytest-0\.log$"):
        write_map(tmp_path / "map", 1, [str(ending)])


@pytest.mark.slow
def test_a_map_finds_the_tests_that_run_a_line_or_what_uses_it(tmp_path, monkeypatch):
    def of(file, line, tests_of=near_line_tests):
        text = (ROOT / "src/vrx_mj" / file).read_text(encoding="utf-8")
        tests = tests_of(Mutant("any", file, "sign", text[text.index(line) :], ""))
        return list(dict.fromkeys(test.partition("::")[2].partition("[")[0] for test in tests))

    pytest.importorskip("coverage")
    monkeypatch.setenv(FOLDER, str(tmp_path))
    alone = tmp_path / "test_alone.py"
    alone.write_text(f"import os\n\n{ALONE}", encoding="utf-8")
    write_map(tmp_path, 1, ["tests/unit/test_bar.py", "tests/unit/physics/test_sail.py", str(alone)])
    assert "test_without_an_environment" in (tmp_path / "times").read_text(encoding="utf-8")
    printed_above = {"test_what_is_printed_meanwhile_stands_above_the_bar", "test_without_colors_lines_are_plain"}
    first, second, *others = of("bar.py", 'self._write(f"{_CLEAR}{in_color')
    assert {first, second} == printed_above
    drawn = of("bar.py", "_DRAW_PERIOD = 0.1")
    assert "test_a_terminal_is_drawn_ten_times_a_second_at_most" in others
    assert set(drawn) == {first, second, *others}
    assert not any("sail" in test or "wind" in test for test in drawn)
    assert "test_drag_is_along_the_wind_and_lift_across_it" in of("physics/sail.py", "pressure = 0.5")  # compiled
    assert of("bar.py", "_DRAW_PERIOD = 0.1", far_line_tests) == []


@pytest.mark.parametrize(
    ("code", "told"),
    [(1, "FAILED {} - no"), (1, "ERROR {}"), (4, "ERROR: not found: /0/tree/{}\n(no match in any of [<Module a.py>])")],
)
def test_what_a_mutant_breaks_is_named_by_its_test(tmp_path, monkeypatch, code, told):
    """Also where the test is no longer there, since its parameters come from the source."""
    test = "tests/a.py::test_b[c]"
    (tmp_path / "pytest.log").write_text(told.format(test), encoding="utf-8")
    monkeypatch.setattr("mutants.scratch.run_pytest", lambda *_: code)
    copy = SimpleNamespace(tree=tmp_path / "tree", cache=tmp_path, _sound={})
    assert Scratch.run_tests(copy, [], 1.0) == ("failed", test)
