"""What became of many inputs: counts by kind, causes of what is bad, and the table of docs/reliability.md."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fuzz.trial import ACCEPTED, CRASH, GOOD, HANG, MEMORY, OUTCOMES, OUTSIDE, REFUSED, TRACEBACK, UNCLEAR, Result

HEADS = {
    ACCEPTED: "accepted", REFUSED: "refused", UNCLEAR: "unclear messages", TRACEBACK: "tracebacks", CRASH: "crashes",
    HANG: "hangs", MEMORY: "over 1 GB", OUTSIDE: "files outside",
}  # fmt: skip


@dataclass
class Figures:
    """Counts of results, and the worst of each."""

    counts: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    """Outcomes by kind."""
    peak: Counter[str] = field(default_factory=Counter)
    """Largest memory by kind [bytes]."""
    slowest: Counter[str] = field(default_factory=Counter)
    """Most processor time by kind [ms]."""
    bad: dict[tuple[str, str], list[Result]] = field(default_factory=lambda: defaultdict(list))
    """Bad results by kind and place."""

    def add(self, result: Result) -> None:
        """Count a result."""
        self.counts[result.kind][result.outcome] += 1
        self.peak[result.kind] = max(self.peak[result.kind], result.peak)
        self.slowest[result.kind] = max(self.slowest[result.kind], round(1000 * result.seconds))
        if result.outcome not in GOOD:
            self.bad[result.kind, f"{result.outcome}: {result.place}"].append(result)

    @property
    def count(self) -> int:
        """All inputs."""
        return sum(counts.total() for counts in self.counts.values())

    def rows(self) -> list[list[str]]:
        """The table: heads, a row for each kind, and the sum."""
        heads = ["input", "tried", *(HEADS[outcome] for outcome in OUTCOMES), "largest memory [MB]", "longest [s]"]
        total = sum(self.counts.values(), Counter())
        lines = [(kind, counts, self.peak[kind], self.slowest[kind]) for kind, counts in self.counts.items()]
        lines.append(("all", total, max(self.peak.values(), default=0), max(self.slowest.values(), default=0)))
        return [heads] + [
            [
                name,
                f"{counts.total():,}",
                *(f"{counts[outcome]:,}" for outcome in OUTCOMES),
                f"{peak / 1e6:.0f}",
                f"{slowest / 1000:.1f}",
            ]
            for name, counts, peak, slowest in lines
        ]

    def causes(self) -> list[str]:
        """What is bad, one line for each cause, the most frequent first, with an input to try again."""
        found = sorted(self.bad.items(), key=lambda item: -len(item[1]))
        return [f"{len(results):5d} {kind:12s} {place}   --again '{results[0].id}'" for (kind, place), results in found]


def plain(rows: Sequence[Sequence[str]]) -> str:
    """A table for the terminal."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """A table for a page."""
    head, *body = rows
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *body]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def write_part(page: Path, name: str, text: str) -> None:
    """Put text into a page between `<!-- NAME -->` and `<!-- end of NAME -->`."""
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    old = page.read_text(encoding="utf-8")
    before, found, rest = old.partition(begin)
    _, also, after = rest.partition(end)
    if not (found and also):
        raise SystemExit(f"{page} has no lines {begin} and {end}")
    page.write_text(f"{before}{begin}\n\n{text}\n\n{end}{after}", encoding="utf-8", newline="\n")
