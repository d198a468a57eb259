"""The list of mutants fits the sources, so that `tests/mutants/run.py` finds all of them where they were."""

import ast
from collections import Counter

from mutants.catalogue import KINDS, ROOT, mutants
from mutants.scratch import nearest_tests, own_tests

MUTANTS = mutants()
PACKAGES = {path.parent.relative_to(ROOT / "src/vrx_mj").as_posix() for path in (ROOT / "src").rglob("*.py")}


def test_each_mutant_changes_one_place_and_can_still_be_parsed():
    sources = {name: (ROOT / name).read_text(encoding="utf-8") for name in {mutant.source for mutant in MUTANTS}}
    for mutant in MUTANTS:
        text = mutant.applied(sources[mutant.source])
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
