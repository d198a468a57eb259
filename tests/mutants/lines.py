"""Which test runs which line of the source: a map, made once by coverage, that finds the tests of a mutant.

As a plugin of pytest it writes the map, which the two functions after it read. What is compiled, or runs as its module
is imported, is no test's: there the nearest count, and those that run a function that uses it, or uses what uses it.
What is parsed in the process without rights is in no map: its mutants are left to the nearest tests.
"""

import ast
import base64
import contextlib
import functools
import itertools
import json
import os
import sqlite3
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import pytest

from mutants.catalogue import ROOT, Mutant
from mutants.scratch import SOURCES, TESTS, fingerprint_tests, nearest_tests

FOLDER = "VRX_MJ_TESTS_LINES"
"""Names the folder of the map."""
OWN_FOLDER = os.environ.get(FOLDER, "")
"""The folder, if a test takes the environment away."""
SETTINGS = (
    "[run]\nsource = src/vrx_mj\nrelative_files = true\nparallel = true\npatch =\n    subprocess\n    fork\n    _exit\n"
)
PROCESSES = "COVERAGE_PROCESS_CONFIG"
"""What coverage hands on to the processes that a test starts."""
BUDGET = 15.0
"""How long the nearest tests of a line may take, the fingerprints, and the others [s]."""


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Lines are the test's, in this process and in those that it starts."""
    import coverage

    tracer = coverage.Coverage.current()
    assert tracer is not None
    tracer.switch_context(item.nodeid)
    settings = json.loads(base64.b64decode(os.environ[PROCESSES])) | {"context": item.nodeid}
    os.environ[PROCESSES] = base64.b64encode(json.dumps(settings).encode()).decode()
    result = yield
    tracer.switch_context("")
    return result


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Append how long a part of a test took, and whether it passed; a test may just pretend to be on Windows."""
    with open(os.path.join(OWN_FOLDER, "times"), "a", encoding="utf-8") as file:  # noqa: PTH118, PTH123
        file.write(json.dumps([report.nodeid, report.duration, report.outcome]) + "\n")


def write_map(folder: Path, jobs: int, tests: Sequence[str] = ("tests",)) -> None:
    """Run the everyday tests, in so many processes at a time, and write down which lines each runs."""
    import coverage

    folder.mkdir(parents=True, exist_ok=True)
    rules = folder / "coveragerc"
    rules.write_text(f"{SETTINGS}data_file = {folder / 'lines'}\n", encoding="utf-8")
    environment = os.environ | {FOLDER: str(folder), "PYTHONPATH": str(TESTS)}
    program = [sys.executable, "-m", "coverage", "run", f"--rcfile={rules}", "-m", "pytest", "-p", "mutants.lines"]
    files = sorted(
        {file for test in tests for file in [ROOT / test, *(ROOT / test).rglob("test_*.py")] if file.is_file()}
    )

    def part(job: int) -> None:
        arguments = ["-n0", "-q", "-p", "no:cacheprovider", "-m", "not slow", *files[job::jobs]]
        with (folder / f"pytest-{job}.log").open("wb") as log:
            command = [*program, *arguments]
            done = subprocess.call(command, cwd=ROOT, env=environment, stdout=log, stderr=log)
        if done > 1:  # 1: a test failed
            raise RuntimeError(f"the map has not all tests: pytest ended with {done}, see {log.name}")

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(part, range(jobs)))
    coverage.Coverage(data_file=folder / "lines", config_file=str(rules)).combine([str(folder)])


@dataclass(frozen=True)
class Part:
    """A function, or a statement outside of functions."""

    file: Path
    span: range
    names: frozenset[str]
    """What it defines."""
    uses: frozenset[str]
    body: range
    """The lines that a test runs: none of what is compiled or runs at import."""


def near_line_tests(mutant: Mutant) -> list[str]:
    """Tests nearest to the module, first those that run the mutant's line.

    What a fixture runs, or what is kept for the next test, counts for the first test alone.
    """
    nearest = _within(_times(os.environ[FOLDER]), nearest_tests(mutant))
    running = nearest & _line_tests(mutant)
    return [*_in_turn(running, "["), *_in_turn(nearest - running, "[")]


def far_line_tests(mutant: Mutant) -> list[str]:
    """Fingerprints and other tests that run the mutant's line."""
    tests = _line_tests(mutant) - _within(_line_tests(mutant), nearest_tests(mutant))
    widest = _within(tests, fingerprint_tests(mutant))
    return [*_in_turn(widest, "["), *_in_turn(tests - widest, "::")]


def _within(tests: Iterable[str], entries: Sequence[str]) -> set[str]:
    """Those of some files and folders."""
    begins = tuple(f"{entry}{end}" for entry in entries for end in ("::", "/"))
    return {test for test in tests if test.startswith(begins)}


@functools.lru_cache(maxsize=1)
def _line_tests(mutant: Mutant) -> frozenset[str]:
    """All that run its line, or, where it is compiled or runs at import, what uses it, and the nearest."""
    text = (ROOT / mutant.source).read_text(encoding="utf-8")
    line = text.count("\n", 0, text.index(mutant.old)) + 1
    part = next((part for part in _parts(SOURCES / mutant.file) if line in part.span), None)
    if part is None:
        return frozenset()
    runs = line in part.body
    places = [(part.file, _statement(part.file, line))] if runs else _users(part)
    near = set() if runs else _within(_times(os.environ[FOLDER]), nearest_tests(mutant))
    return frozenset(near.union(*(_tests_of(file, lines) for file, lines in places)))


def _in_turn(tests: Iterable[str], group_end: str) -> list[str]:
    """One test of each function or file, the quickest first, then another of each, as many as the time allows."""
    times, rank = _times(os.environ[FOLDER]), Counter[str]()
    order = list[tuple[int, float, str]]()
    for test in sorted(tests, key=lambda test: (times[test], test)):
        group = test.partition(group_end)[0]
        order.append((rank[group], times[test], test))
        rank[group] += 1
    order.sort()
    spent = itertools.accumulate(seconds for _, seconds, _ in order)
    return [test for (_, _, test), sum_ in zip(order, spent, strict=True) if sum_ <= BUDGET]


def _users(part: Part) -> list[tuple[Path, range]]:
    """The functions that use what a part defines, or what uses it."""
    every = [other for file in sorted(SOURCES.rglob("*.py")) for other in _parts(file) if other != part]
    names, found, new = set[str](), list[tuple[Path, range]](), part.names
    while new - names:
        names |= new
        using = [other for other in every if other.uses & new]
        found += [(other.file, other.body) for other in using if other.body]
        new = frozenset().union(*(other.names for other in using if not other.body))
    return found


@functools.cache
def _parts(file: Path) -> list[Part]:
    found = list[Part]()

    def visit(nodes: Iterable[ast.stmt], name: str = "") -> None:
        for node in nodes:
            span, uses = range(node.lineno, (node.end_lineno or 0) + 1), frozenset(_names(node))
            if isinstance(node, ast.ClassDef):
                visit(node.body, node.name)
            elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                compiled = any(
                    "kernel" in ast.unparse(mark) or "intrinsic" in ast.unparse(mark) for mark in node.decorator_list
                )
                body = range(0) if compiled else range(node.body[0].lineno, span.stop)
                found.append(Part(file, span, frozenset({node.name}), uses, body))
            elif not isinstance(node, ast.Import | ast.ImportFrom):
                targets = {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
                found.append(Part(file, span, frozenset(targets or {name}), uses, range(0)))

    visit(ast.parse(file.read_text(encoding="utf-8")).body)
    return found


def _names(node: ast.AST) -> Iterator[str]:
    for inner in ast.walk(node):
        if isinstance(inner, ast.Name):
            yield inner.id
        elif isinstance(inner, ast.Attribute):
            yield inner.attr


def _statement(file: Path, line: int) -> range:
    """The lines of the innermost statement at a line, without those of the statements in it."""
    ends = {
        node.lineno: (body[0].lineno if (body := getattr(node, "body", None)) else (node.end_lineno or 0) + 1)
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.stmt)
    }
    begin = max(start for start in ends if start <= line)
    return range(begin, max(ends[begin], line + 1))


def _tests_of(file: Path, lines: range) -> Iterator[str]:
    """The tests that run some of a file's lines."""
    wanted = ((1 << len(lines)) - 1) << lines.start
    return (test for test, ran in _lines_by_test(os.environ[FOLDER], file) if ran & wanted)


@functools.cache
def _lines_by_test(folder: str, file: Path) -> list[tuple[str, int]]:
    """Tests, and the lines of a file that each runs, as the bits of a number."""
    query = (
        "select context, numbits from line_bits join file on file.id = file_id join context on context.id = context_id"
        " where path = ?"
    )
    with contextlib.closing(sqlite3.connect(Path(folder) / "lines")) as connection:
        found, times = connection.execute(query, (file.relative_to(ROOT).as_posix(),)), _times(folder)
        return [(test, int.from_bytes(bits, "little")) for test, bits in found if test in times]


@functools.cache
def _times(folder: str) -> dict[str, float]:
    """How long each test took that passed [s]; one that is called after the checkout is not in a scratch copy."""
    times, bad = Counter[str](), set[str]()
    for line in (Path(folder) / "times").read_text(encoding="utf-8").splitlines():
        test, seconds, outcome = json.loads(line)
        times[test] += seconds
        if outcome != "passed" or str(ROOT) in test:
            bad.add(test)
    return {test: seconds for test, seconds in times.items() if test not in bad}
