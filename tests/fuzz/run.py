"""Tries mutated inputs of every kind that the package reads: is each used, or refused with a message?

    python tests/fuzz/run.py --minutes 60                       # as long as one likes
    python tests/fuzz/run.py --inputs 20000 --seed 7 --jobs 2 --write docs/reliability.md
    python tests/fuzz/run.py --kinds world xacro --inputs 500
    python tests/fuzz/run.py --again 'world:7:1234'             # one input, in this process, with its traceback

An input is drawn from its kind, the seed and its number alone. It is tried in a process of its own that is watched: an
exception that is not a VrxError, a signal, more than 5 s of processor time, more than 1 GB of memory and a file outside
of the input's folder are bad, and so is a refusal without the file's name. Files of bad inputs are kept in a folder.
"""

import argparse
import itertools
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fuzz.catalogue import KINDS
from fuzz.figures import Figures, markdown, plain, write_part
from fuzz.kind import chance_of, write
from fuzz.machine import made_with
from fuzz.trial import GOOD, Limits, Result, Trials
from fuzz.workers import Job, Pool
from fuzz.yaml_files import warm_kernels

KEPT_OF_A_CAUSE = 3
"""Inputs that are kept of one cause."""


BLOCK = 25
"""Inputs of each kind that come in a row: those of files, and those of servers, which are tried by other processes."""


def drawn(kinds: Sequence[str], seed: int, inputs: int | None, minutes: float | None) -> Iterator[Job]:
    """Inputs of the kinds in turn, until there are enough or time is over."""
    until = time.monotonic() + 60.0 * minutes if minutes else None
    groups = [group for calls in (False, True) if (group := [name for name in kinds if KINDS[name].calls is calls])]
    for number, name in enumerate(itertools.chain.from_iterable(group * BLOCK for group in itertools.cycle(groups))):
        if (inputs is not None and number >= inputs) or (until is not None and time.monotonic() >= until):
            return
        yield name, seed, number


class Keeper:
    """Keeps files of bad inputs, a few of each cause."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.counts = folder, dict[tuple[str, str], int]()

    def __call__(self, result: Result, work: Path) -> None:
        """Keep an input if it is bad."""
        cause = (result.kind, result.place)
        self.counts[cause] = self.counts.get(cause, 0) + (result.outcome not in GOOD)
        if result.outcome in GOOD or self.counts[cause] > KEPT_OF_A_CAUSE:
            return
        kept = self.folder / result.id.replace(":", "-").replace(" ", "_")
        write(
            {file.relative_to(work).as_posix(): file.read_bytes() for file in work.rglob("*") if file.is_file()}, kept
        )
        kept.mkdir(parents=True, exist_ok=True)
        again = f"python tests/fuzz/run.py --again '{result.id}'"
        (kept / "RESULT.txt").write_text(
            f"{again}\n{result.outcome} {result.place}\n\n{result.text}\n", "utf-8", errors="replace"
        )


def again(name: str) -> int:
    """Try one input in this process, and say what became of it."""
    kind, seed, number = name.rsplit(":", 2)
    KINDS[kind].warm()
    with tempfile.TemporaryDirectory(prefix="vrx_mj-fuzz-") as folder:
        here = Path.cwd()
        print("first file:", next(iter(KINDS[kind].mutated(chance_of(kind, int(seed), int(number))))))
        result = Trials(KINDS, Path(folder).resolve(), Limits()).try_one(kind, int(seed), int(number))
        os.chdir(here)
    print(f"{result.outcome} {result.place}\n{result.text}\n{result.seconds:.2f} s, {result.peak / 1e6:.0f} MB")
    return result.outcome not in GOOD


def parse_options(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The command line's options."""
    parser = argparse.ArgumentParser(
        description="Mutated inputs of every kind: is each used, or refused with a message?"
    )
    parser.add_argument("--inputs", type=int, help="how many; default: 2000 unless --minutes says otherwise")
    parser.add_argument("--minutes", type=float, help="for how long")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--kinds", nargs="+", choices=list(KINDS), default=list(KINDS), metavar="KIND", help=", ".join(KINDS)
    )
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, default=Path(tempfile.gettempdir()) / "vrx_mj-fuzz", metavar="FOLDER",
                        help="where files of bad inputs are kept; default: %(default)s")  # fmt: skip
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the table into this page, as docs/reliability.md"
    )
    parser.add_argument("--again", metavar="KIND:SEED:NUMBER", help="try one input here, and print what becomes of it")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """The program; 1 if something was bad."""
    options = parse_options(arguments)
    if options.again:
        return again(options.again)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # the workers are ended then too
    inputs = options.inputs or (None if options.minutes else 2000)
    warm_kernels()
    figures, begun, said = Figures(), time.monotonic(), time.monotonic()
    pool = Pool({name: KINDS[name] for name in options.kinds}, options.jobs, kept=Keeper(options.keep))
    for result in pool.results(drawn(options.kinds, options.seed, inputs, options.minutes)):
        figures.add(result)
        if time.monotonic() - said > 10.0:
            said = time.monotonic()
            bad = sum(map(len, figures.bad.values()))
            print(f"{figures.count} inputs in {said - begun:.0f} s, {bad} bad", file=sys.stderr, flush=True)
    print(
        plain(figures.rows()),
        *figures.causes(),
        f"{figures.count} inputs in {time.monotonic() - begun:.0f} s",
        sep="\n",
    )
    if figures.bad:
        print(f"files of bad inputs: {options.keep}")
    if options.write:
        command = f"python tests/fuzz/run.py --inputs {figures.count} --seed {options.seed}"
        command += "" if options.kinds == list(KINDS) else f" --kinds {' '.join(options.kinds)}"
        write_part(options.write, "fuzz", f"`{command}`: {made_with()}.\n\n{markdown(figures.rows())}")
    return 1 if figures.bad else 0


if __name__ == "__main__":
    sys.exit(main())
