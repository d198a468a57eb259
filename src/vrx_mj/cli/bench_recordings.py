"""Cost of recordings: `vrx-mj bench --recordings` runs the commands themselves, each in a fresh process.

Their order turns around from round to round. Beside each figure is its A/A row: by how much the figures of even and of
odd rounds differ. Where that is wider than the margin to the budget there is no verdict.
"""

import math
import statistics
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from vrx_mj.bar import Bar
from vrx_mj.cli.bench import Row, bench_row, child_cost

_RECORDING_ROUNDS = 4
"""An even number."""
_THRUST = ("--seed", "7", "--thrust", "left=0.6,right=0.4")
_README = ("run", "example_course", "--fleet", "trio", *_THRUST)
_HUNDRED = ("run", "ocean", "--fleet", "hundred.yaml", *_THRUST)
_RUNS = {
    "start": (*_README, "--duration", "0.1"),
    "minute": (*_README, "--duration", "60"),
    "ten": (*_README, "--duration", "600"),
    "hundred_start": (*_HUNDRED, "--duration", "0.1"),
    "hundred": (*_HUNDRED, "--duration", "60"),
}
SIDES = {
    **_RUNS,
    **{f"{name}.rrd": (*words, "--record", f"{name}.rrd") for name, words in _RUNS.items()},
    "film": ("replay", "minute.rrd", "--video", "film.mp4"),
}
"""Commands by name, in an order in which each has the files that it needs; `.rrd` is the same run recorded."""

_Costs = Mapping[str, float]
"""Processor time [s] by side, and with ` MB` behind the side its largest resident memory."""


def _cost(costs: _Costs, run: str) -> float:
    return costs[f"{run}.rrd"] - costs[run]


FIGURES: Mapping[str, tuple[Callable[[_Costs], float], str, float]] = {
    "readme_run_s": (lambda costs: costs["minute.rrd"], "s of processor time, recorded", 2.8),
    "readme_run_ratio": (lambda costs: costs["minute.rrd"] / costs["minute"], "x the same run without", 1.35),
    "record_open_close_s": (lambda costs: _cost(costs, "start"), "s of processor time", 0.5),
    "record_share": (
        lambda costs: (_cost(costs, "ten") - _cost(costs, "start")) / costs["ten"],
        "of a run of 10 minutes, beyond that",
        0.1,
    ),
    "record_rss_mb": (lambda costs: costs["minute.rrd MB"], "MB resident, 3 recorded boats", 300.0),
    "record_boat_of_100": (
        lambda costs: 0.03 * _cost(costs, "hundred") / _cost(costs, "minute"),
        "x that of one of 3 boats",
        1.0,
    ),
    "film_minute_s": (lambda costs: costs["film"], "s of processor time", 30.0),
}
"""Name, figure, unit and budget."""

PARTS = {
    "/record/rows": "exact rows",
    "/record/states": "states",
    "/plots": "plots",
    "/world/trails": "trails",
    "/world/sea": "sea",
    "/world/wakes": "wakes",
    "/world/boats": "shown poses",
}


def recording_rows(rounds: int = _RECORDING_ROUNDS) -> list[Row]:
    """A row for each budget of recordings; it takes some minutes."""
    found: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder, Bar("measuring", rounds * len(SIDES), "commands") as bar:
        (Path(folder) / "hundred.yaml").write_text("usv_count: 100\nlayout: grid\n", encoding="utf-8")
        for number in range(rounds):
            for side in SIDES if number % 2 == 0 else reversed(SIDES):
                bar.update(sum(map(len, found.values())) // 2, side)
                command = [sys.executable, "-m", "vrx_mj", *SIDES[side]]
                try:
                    seconds, memory = child_cost(command, folder)
                except subprocess.CalledProcessError:
                    if side != "film":
                        raise
                    seconds = memory = math.nan  # nothing can draw here, or the extra `video` is missing
                found.setdefault(side, []).append(seconds)
                found.setdefault(f"{side} MB", []).append(memory)
        early, late = (sizes(Path(folder) / f"{name}.rrd") for name in ("hundred_start", "hundred"))
    growth = {part: (late[part] - early[part]) / 1e5 for part in late}
    return [
        *rows_of(found),
        bench_row("record_kb", sum(growth.values()), "kB a boat and minute, of 100", 150.0, parts=growth),
        bench_row("record_start_mb", sum(early.values()) / 1e6, "MB before the first second of 100 boats", 10.0),
    ]


def rows_of(costs: Mapping[str, Sequence[float]]) -> list[Row]:
    """The rows of what the rounds cost, each with the difference between even and odd rounds."""
    whole, even, odd = (
        {side: statistics.median(rounds[part]) for side, rounds in costs.items()}
        for part in (slice(None), slice(0, None, 2), slice(1, None, 2))
    )
    rows = []
    for name, (figure, unit, budget) in FIGURES.items():
        value, spread = figure(whole), abs(figure(even) - figure(odd))
        missing = "it needs the extra `video`, and something that draws"
        found = bench_row(name, value, unit, budget, parts={"A/A": spread}, missing=missing)
        rows.append({**found, "ok": found["ok"] if spread <= abs(value - budget) else None})
    return rows


def sizes(recording: Path) -> Counter[str]:
    """Bytes of a recording by what they are for: those of its chunks, and the rest."""
    from rerun.chunk import RrdReader

    found = Counter({"the rest": recording.stat().st_size})
    index = RrdReader(recording).store()._chunk_index().to_arrow()
    columns = (index[f"chunk_{name}"].to_pylist() for name in ("entity_path", "byte_size"))
    for entity, size in zip(*columns, strict=True):
        part = next((part for path, part in PARTS.items() if entity.startswith(path)), "the rest")
        found[part] += size
        found["the rest"] -= size
    return found
