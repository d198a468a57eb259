"""Sails all shipped worlds for a long time under random commands: does anything go wrong without being raised?

    python tests/fuzz/soak.py --boat-steps 1e8 --jobs 2 --write docs/reliability.md
    python tests/fuzz/soak.py --boat-steps 1e5 --worlds ocean gymkhana --seed 3

Every world has a fleet of several boats, or one of the shipped fleets, and gets the same share: half of it in a
Simulation with commands up to far beyond the limits, shots, boats that are put elsewhere, that come and go, resets and
states set again; half in a Batch with rows of other wind, waves, mass and thrust. What is checked after each stretch:
no NaN or infinity that was not raised as a DivergedError, no warning of MuJoCo's that tells of a reset, a time that
grows by the steps, the number of contacts, and the memory.
"""

import argparse
import itertools
import multiprocessing
import os
import random
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fuzz.figures import markdown, plain, write_part
from fuzz.machine import made_with
from fuzz.voyages import LONGEST, Log, Rows, Voyage
from vrx_mj import Simulation, compile_world
from vrx_mj.config.search import catalogue
from vrx_mj.errors import VrxWarning

BOATS = 4
GRID = {"usv_count": BOATS, "layout": "grid", "spacing": 12, "origin": "spawn"}
GROWTH = 50e6
"""Memory that a world may take more at its end than after a third [bytes]."""
Trip = tuple[str, Any, str, int, int]
"""World, fleet, `simulation` or `batch`, boat-steps, seed."""


def sailed(trip: Trip) -> Log:
    """One trip."""
    world, fleet, kind, boat_steps, seed = trip
    log, chance = Log(world, kind), random.Random(f"{world} {kind} {seed}")
    begun = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", VrxWarning)
            _sail(log, compiled(world, fleet, kind), boat_steps, seed, chance)
    except Exception:  # whatever it is, it is a finding
        log.expect(condition=False, what=traceback.format_exc(limit=-6))
    log.seconds = time.process_time() - begun
    return log


def compiled(world: str, fleet: Any, kind: str) -> Any:
    """A world; for a batch without its task."""
    source: Any = {"extends": world, "task": None} if kind == "batch" else world
    return compile_world(source, fleet=fleet, nudge=True)


def _sail(log: Log, world: Any, boat_steps: int, seed: int, chance: random.Random) -> None:
    vessel: Voyage | Rows = (Rows if log.kind == "batch" else Voyage)(world, seed, log, chance)
    third, attempts = 0, 0
    while log.counts["boat-steps"] < boat_steps and attempts < boat_steps:
        vessel.stretch()
        attempts += LONGEST // 100
        if not third and log.counts["boat-steps"] > boat_steps / 3:
            third = resident()
    log.growth = resident() - third
    log.expect(log.growth < GROWTH, f"{log.growth / 1e6:.0f} MB more memory than after a third")


def resident() -> int:
    """Resident memory of this process [bytes]; 0 where it is not told."""
    try:
        return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


def trips(worlds: Sequence[str], boat_steps: float, seed: int) -> Iterator[Trip]:
    """A trip of each kind in each world, with the fleets in turn."""
    fleets = itertools.cycle([GRID, *(name for name in catalogue("fleets") if name != "none")])
    share = max(int(boat_steps / (2 * len(worlds))), 1)
    for world, fleet in zip(worlds, fleets, strict=False):
        for kind in ("simulation", "batch"):
            yield world, fleet, kind, share, seed


def table(logs: Sequence[Log]) -> list[list[str]]:
    """Figures by kind."""
    rows = [
        [
            "soaked",
            "worlds",
            "boat-steps",
            "NaN not raised, or silent resets",
            "diverged, and raised",
            "most contacts",
            "most growth [MB]",
            "processor time [s]",
        ]
    ]
    for kind in ("simulation", "batch"):
        own = [log for log in logs if log.kind == kind]
        counts = sum((log.counts for log in own), Counter[str]())
        figures = (
            len(own),
            counts["boat-steps"],
            sum(len(log.wrong) for log in own),
            counts["diverged"],
            max((log.contacts for log in own), default=0),
        )
        rows.append(
            [
                kind,
                *(f"{figure:,}" for figure in figures),
                f"{max((log.growth for log in own), default=0) / 1e6:.0f}",
                f"{sum(log.seconds for log in own):.0f}",
            ]
        )
    return rows


def parse_options(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The command line's options."""
    parser = argparse.ArgumentParser(description="All shipped worlds under random commands for a long time.")
    parser.add_argument("--boat-steps", type=float, default=1e6, help="of all worlds together; default: 1e6")
    parser.add_argument("--worlds", nargs="+", metavar="WORLD", help="default: all")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the table into this page, as docs/reliability.md"
    )
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """The program; 1 if something was wrong."""
    options = parse_options(arguments)
    worlds = options.worlds or list(catalogue("worlds"))
    todo, logs, begun = list(trips(worlds, options.boat_steps, options.seed)), [], time.perf_counter()
    Simulation(compile_world("ocean"))  # kernels are compiled here, once
    with multiprocessing.get_context("spawn").Pool(options.jobs) as pool:
        for log in pool.imap_unordered(sailed, todo):
            logs.append(log)
            print(*log.wrong, sep="\n", end="\n" if log.wrong else "")
            if len(logs) % 20 == 0:
                print(
                    f"{len(logs)} of {len(todo)} trips in {time.perf_counter() - begun:.0f} s",
                    file=sys.stderr,
                    flush=True,
                )
    done = sum((log.counts for log in logs), Counter[str]())
    calls = ", ".join(f"{name} {count:,}" for name, count in sorted(done.items()))
    print(plain(table(logs)), calls, f"{time.perf_counter() - begun:.0f} s", sep="\n")
    if options.write:
        command = f"python tests/fuzz/soak.py --boat-steps {options.boat_steps:g} --jobs {options.jobs}"
        write_part(options.write, "soak", f"`{command}`: {made_with()}.\n\n{markdown(table(logs))}\n\nCalls: {calls}.")
    return 1 if any(log.wrong for log in logs) else 0


if __name__ == "__main__":
    sys.exit(main())
