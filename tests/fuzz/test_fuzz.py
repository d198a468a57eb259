"""A share of the fuzzers, and what they are worth: inputs that do harm are found as what they are."""

import json
import os
import random
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fuzz import junk, raw, trees
from fuzz.figures import Figures, markdown, plain, write_part
from fuzz.harm import KINDS as HARMS
from fuzz.trial import Result
from fuzz.workers import told_place

FUZZ = Path(__file__).parent
REPO = FUZZ.parents[1]
LIGHT = (
    "world",
    "fleet",
    "object",
    "thrusters",
    "components",
    "axes",
    "terrain",
    "dock",
    "robot",
    "xacro",
    "urdf",
    "mesh",
    "hull",
    "hydro",
)
LINUX = pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs Linux: memory is read from /proc")
SEED = 2026


SHARE = """
import sys

from fuzz import run
from fuzz.catalogue import KINDS
from fuzz.kind import chance_of

code = run.main(sys.argv[1:])  # first: rerun, which makes recordings, does not survive its forks
for name, kind in KINDS.items():
    first, again, other = (dict(kind.mutated(chance_of(name, 1, number))) for number in (5, 5, 6))
    assert first == again or name == "recording", name  # rerun gives the parts of a file ids of their own
    assert first != other, name
sys.exit(code)
"""
"""Tries inputs as run.py does, then makes some again from their numbers: the seeds of both take half a minute."""


def printed(*program: str) -> str:
    """What a program prints; it must end well."""
    command = [sys.executable, *program]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False, env=environment)
    assert done.returncode == 0, f"{done.stdout[-6000:]}\n{done.stderr[-2000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def found() -> dict[str, dict[str, str]]:
    """What became of each harmful input."""
    return json.loads(printed(str(FUZZ / "harm.py")))


@pytest.mark.slow
@LINUX
def test_harm_is_found_as_what_it_is(found):
    assert {harm: found[harm]["outcome"] for harm in HARMS} == {harm: outcome for harm, (_, outcome) in HARMS.items()}


@LINUX
@pytest.mark.parametrize(
    ("harm", "word"),
    [
        ("raise", "KeyError"),
        ("abort", "SIGABRT"),
        ("segfault", "SIGSEGV"),
        ("exit", "exit 3"),
        ("write natively", "made"),
        ("change input", "changed"),
        ("read bait", "open"),
        ("refuse at length", "a long message"),
        ("refuse without file", "a message without its file"),
    ],
)
def test_its_cause_is_named(harm, word, found):
    assert word in found[harm]["place"]


@LINUX
def test_of_a_hang_the_stack_is_told(found):
    assert "in _spin" in found["spin"]["text"]


@pytest.mark.slow
@pytest.mark.nightly
@LINUX
def test_a_seeded_share_of_all_files_is_used_or_refused(tmp_path):
    printed(str(FUZZ / "run.py"), "--inputs", "20", "--seed", str(SEED), "--kinds", *LIGHT, "--keep", str(tmp_path))


@LINUX
@pytest.mark.slow
@pytest.mark.nightly
def test_a_larger_share_of_everything_is_used_or_refused_and_made_again_from_its_number(tmp_path):
    printed("-c", SHARE, "--inputs", "60", "--seed", str(SEED + 1), "--jobs", "1", "--keep", str(tmp_path))


@pytest.mark.slow
def test_a_short_soak_finds_nothing():
    printed(str(FUZZ / "soak.py"), "--boat-steps", "5e4", "--worlds", "ocean", "gymkhana", "vrx2023/wildlife_task")


def test_the_page_names_every_kind_and_files_that_exist():
    from fuzz.catalogue import KINDS

    page = (REPO / "docs" / "reliability.md").read_text(encoding="utf-8")
    told = {word for row in re.findall(r"^\| ([\w, ]+) \| [^|]+ \| [^|]+ \|$", page, re.M) for word in row.split(", ")}
    assert set(KINDS) <= told
    named = set(re.findall(r"`(tests/[\w/]+\.py)`", page))
    assert len(named) > 10
    assert not [name for name in named if not (REPO / name).is_file()]


def test_mutations_differ_from_the_original_or_are_few():
    chance, tree = random.Random(1), {"a": [1, {"b": 2.5}], "c": "text"}
    assert sum(raw.mutated(b"\x04\0\0\0abcdef", chance) != b"\x04\0\0\0abcdef" for _ in range(100)) > 80
    assert sum(repr(trees.mutated(tree, chance)) != repr(tree) for _ in range(100)) > 90
    assert tree == {"a": [1, {"b": 2.5}], "c": "text"}


def test_junk_is_of_many_kinds():
    chance = random.Random(1)
    assert {type(junk.value(chance)).__name__ for _ in range(500)} == {
        "NoneType",
        "bool",
        "dict",
        "float",
        "int",
        "list",
        "str",
    }


def test_figures_count_and_name_each_cause_once():
    figures = Figures()
    for number, (outcome, place) in enumerate(
        [("accepted", ""), ("traceback", "KeyError at a.py:1"), ("traceback", "KeyError at a.py:1")]
    ):
        figures.add(Result("world", 1, number, outcome, place, peak=number * 10**8, seconds=number))
    assert figures.count == 3
    assert figures.rows()[1] == ["world", "3", "1", "0", "0", "2", "0", "0", "0", "0", "200", "2.0"]
    assert figures.causes() == ["    2 world        traceback: KeyError at a.py:1   --again 'world:1:1'"]


def test_tables():
    rows = [["a", "bb"], ["ccc", "1"]]
    assert plain(rows) == "  a  bb\nccc   1"
    assert markdown(rows) == "| a | bb |\n| --- | ---: |\n| ccc | 1 |"


def test_a_part_of_a_page_is_replaced(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- fuzz -->\nold\n<!-- end of fuzz -->\nafter\n", encoding="utf-8")
    write_part(page, "fuzz", "new")
    assert page.read_text(encoding="utf-8") == "before\n<!-- fuzz -->\n\nnew\n\n<!-- end of fuzz -->\nafter\n"
    with pytest.raises(SystemExit, match="has no lines <!-- soak --> and <!-- end of soak -->"):
        write_part(page, "soak", "new")


def test_the_stack_of_an_ended_process_names_our_innermost_line():
    ours = "/x/src/vrx_mj/runtime/loop_arrays.py"
    said = f'Fatal Python error: Aborted\n\n  File "/x/numba/a.py", line 3 in f\n  File "{ours}", line 41 in g\n'
    assert told_place(said) == " at vrx_mj/runtime/loop_arrays.py:41 in g"
