"""Tries mutants, those of `mutants.yaml` or ones drawn at random: do tests notice that a line of the source is wrong?

    python tests/mutants/run.py                             # all of the file: hours on two cores
    python tests/mutants/run.py --only physics tasks        # mutants of some packages
    python tests/mutants/run.py --ids gates-1 gates-2 --stages nearest own
    python tests/mutants/run.py --jobs 2 --out figures      # figures.json and figures.txt
    python tests/mutants/run.py --draw 200 --jobs 2         # drawn at random: 88 % of them have to be killed
    python tests/mutants/run.py --draw 200 --seed 6 --lines lines     # which keeps the map in a folder

Each mutant is made in a scratch copy of the repository, never in the checkout. Stages run until one fails, which
kills the mutant: the test files nearest to the module, the unit tests of its package, and the tests of the everyday
tier; for those drawn at random the nearest tests that run the mutant's line, by a map of lines, or any nearest ones
where the map has none; the quickest others that run it, fingerprints first; then, as it is done by night, the slow
fingerprints, nightly ones too. `--stages` may add the related ones, which are all that import something of the package,
and those of them that are slow: ten minutes a mutant. The map (`lines.py`) is made first, in twice the time of the
everyday tests, or is that of an earlier run of the same source. Mutants that `equal.yaml` lists do what the source
does: they are counted apart, and not tried.

A test that kills is run again without a mutant; one that fails there, too, is named and left out. Kernels compile into
a cache of the scratch copy's own.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import yaml

from mutants.catalogue import Mutant, mutants
from mutants.lines import FOLDER, far_line_tests, near_line_tests, write_map
from mutants.random_mutants import draw
from mutants.scratch import Scratch, fingerprint_tests, nearest_tests, own_tests, related_tests

STAGES = {
    "nearest": nearest_tests, "own": own_tests, "related": related_tests, "nightly": fingerprint_tests,
    "near": near_line_tests, "far": far_line_tests,
    "slow": related_tests, "tier": lambda _: ["tests"],
}  # fmt: skip
LISTED, DRAWN = ("nearest", "own", "tier"), ("near", "far", "nightly")
"""Stages for the mutants of the file, and for those drawn at random."""
MARKS = dict.fromkeys(STAGES, "not slow") | {"nightly": "slow", "slow": "slow and not nightly"}
"""Which tests count, as pytest's -m."""
LIMITS = dict.fromkeys(STAGES, 2400.0) | {"nearest": 300.0, "own": 300.0, "near": 240.0, "far": 240.0}
"""Processor time [s]: more than the tests take, so that only a mutant that never ends meets it."""
ENDLESS, ALIVE, EQUAL = "endless", "alive", "equal"
EQUAL_MUTANTS = yaml.safe_load(Path(__file__).with_name("equal.yaml").read_text(encoding="utf-8"))
"""Of each file the drawn mutants, without the number of their line, that do what the source does, and why."""
NOT_THE_LISTS = ["--ignore=tests/test_mutants.py"]
"""The test of the list itself would find every mutant."""
BAR = 0.88
"""The share of mutants drawn at random that has to be killed."""


def run_stages(mutant: Mutant, scratch: Scratch, stages: Sequence[str]) -> dict[str, object]:
    """Run the stages until one kills the mutant."""
    row: dict[str, object] = {"id": mutant.id, "package": mutant.package, "file": mutant.file, "killed": ALIVE}
    if mutant.id.partition(": ")[2] in EQUAL_MUTANTS.get(mutant.file, {}):
        return row | {"killed": EQUAL, "seconds": 0.0}
    begun, before = time.perf_counter(), list[str]()
    for stage in stages:
        files = STAGES[stage](mutant)
        arguments = [*files, *NOT_THE_LISTS, "-m", MARKS[stage]]
        if not files or arguments == before:
            continue
        before = arguments
        while True:
            with scratch.holding(mutant):
                result, test = scratch.run_tests(arguments, LIMITS[stage])
            if result != "failed" or scratch.is_sound(test.partition("[")[0], LIMITS[stage]):
                break
        if result != "passed":
            row |= {"killed": stage if result == "failed" else ENDLESS, "test": test}
            break
    return row | {"seconds": round(time.perf_counter() - begun, 1)}


def table(rows: Sequence[dict[str, object]], stages: Sequence[str]) -> str:
    """The figures by package, and who lives."""
    packages = list(dict.fromkeys(str(row["package"]) for row in rows))
    heads = [*stages, ENDLESS, ALIVE, EQUAL]
    lines = [f"{'package':<20}{'mutants':>9}" + "".join(f"{head:>9}" for head in heads)]
    for package in [*packages, "all"]:
        of_it = [row for row in rows if package in {row["package"], "all"}]
        counts = [sum(row["killed"] == head for row in of_it) for head in heads]
        lines.append(f"{package:<20}{len(of_it):>9}" + "".join(f"{count:>9}" for count in counts))
    alive = [f"  {row['file']}: {row['id']}" for row in rows if is_alive(row)]
    unequal = sum(row["killed"] != EQUAL for row in rows)
    share = f"{unequal - len(alive)} of {unequal} that are not equal killed: {killed_share(rows):.0%}"
    return "\n".join([*lines, share, "alive:" if alive else "", *alive]) + "\n"


def is_alive(row: dict[str, object]) -> bool:
    """Whether no test failed, or went on for ever."""
    return row["killed"] == ALIVE


def killed_share(rows: Sequence[dict[str, object]]) -> float:
    """The share that a test noticed, of those that are not equal to the source."""
    unequal = [row for row in rows if row["killed"] != EQUAL]
    return sum(not is_alive(row) for row in unequal) / max(len(unequal), 1)


def select(only: Sequence[str], ids: Sequence[str]) -> list[Mutant]:
    """The mutants of some packages, or with some ids."""
    known = mutants()
    unknown = set(ids) - {mutant.id for mutant in known}
    if unknown:
        raise SystemExit(f"no mutants with the ids {', '.join(sorted(unknown))}")
    if foreign := set(only) - (packages := {mutant.package for mutant in known}):
        raise SystemExit(f"no mutants of {', '.join(sorted(foreign))}; packages: {', '.join(sorted(packages))}")
    picked = [m for m in known if not only or m.package in only]
    return [mutant for mutant in picked if not ids or mutant.id in ids]


def parse_options(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The command line's options."""
    parser = argparse.ArgumentParser(description="Which tests notice that a line of the source is wrong?")
    parser.add_argument("--only", nargs="+", default=[], metavar="PACKAGE", help="as physics or ros")
    parser.add_argument("--ids", nargs="+", default=[], metavar="ID")
    parser.add_argument("--draw", type=int, metavar="N", help="so many at random places, in place of the file's")
    parser.add_argument("--seed", type=int, default=0, help="of the draw; default: %(default)s")
    parser.add_argument("--lines", type=Path, metavar="FOLDER", help="keeps the map of which test runs which line")
    parser.add_argument("--stages", nargs="+", choices=STAGES)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("mutants"), help="writes OUT.json and OUT.txt")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Try the mutants; 1 if one of the file lives, or too many of those drawn at random."""
    options = parse_options(arguments)
    if options.draw is None:
        picked, stages, least = select(options.only, options.ids), options.stages or LISTED, 1.0
    else:
        picked, stages, least = draw(options.draw, options.seed, options.only), options.stages or DRAWN, BAR
    rows = list[dict[str, object]]()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        os.environ[FOLDER] = str((options.lines or Path(folder) / "lines").resolve())
        if not {"near", "far"}.isdisjoint(stages) and not (Path(os.environ[FOLDER]) / "lines").exists():
            write_map(Path(os.environ[FOLDER]), options.jobs)
        free: SimpleQueue[Scratch] = SimpleQueue()
        for job in range(options.jobs):
            free.put(Scratch(Path(folder) / str(job)))

        def attempt(mutant: Mutant) -> None:
            scratch = free.get()
            try:
                row = run_stages(mutant, scratch, stages)
            finally:
                free.put(scratch)
            rows.append(row)
            print(*(row.get(key, "") for key in ("id", "killed", "seconds", "test")), flush=True)
            options.out.with_suffix(".json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")

        with ThreadPoolExecutor(options.jobs) as pool:
            list(pool.map(attempt, picked))
    order = [mutant.id for mutant in picked]
    rows.sort(key=lambda row: order.index(str(row["id"])))
    figures = table(rows, stages)
    options.out.with_suffix(".txt").write_text(figures, encoding="utf-8")
    print(figures)
    return int(killed_share(rows) < least)


if __name__ == "__main__":
    sys.exit(main())
