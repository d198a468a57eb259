"""What changed since an earlier campaign: cell by cell, and with a paired test for each controller and type of task."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median

from vrx_mj.campaign.manifest import Campaign
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.ranking import task_types, tasks_of_worlds
from vrx_mj.campaign.results import Result

__all__ = ["Change", "Comparison", "Test", "compare", "paired_test"]

SIGNIFICANT = 0.05
SHOWN = 3
"""How many names a note lists."""
FEWEST = 6
"""With fewer pairs that differ no two-sided test of signed ranks gets below 0.05: five give 2 / 2^5."""


@dataclass(frozen=True)
class Change:
    """A cell whose result is another one now."""

    cell: Cell
    before: Result
    after: Result
    gain: float | None
    """By how much the score is better, in its unit; None where one of the two has none."""

    @property
    def kind(self) -> str:
        """What has become of it, in one word."""
        if self.gain is None:
            return "fails now" if self.after.failed else "works now"
        return "better" if self.gain > 0.0 else "worse" if self.gain < 0.0 else "different track, same score"


@dataclass(frozen=True)
class Test:
    """Paired scores of a controller in a type of task, before and after."""

    controller: str
    task: str
    unit: str
    pairs: int
    better: int
    worse: int
    gain: float
    """Median of by how much scores are better, in their unit."""
    p: float | None
    """Two-sided, of Wilcoxon's signed ranks; None for too few pairs that differ."""
    adjusted: float | None = None
    """After Holm, for all tests of the comparison."""

    @property
    def verdict(self) -> str:
        """What may be said, in words."""
        differ = self.better + self.worse
        if not self.pairs:
            return "no cell has a score in both campaigns"
        if not differ:
            return "no score has changed"
        if self.p is None or self.adjusted is None:
            return f"too few pairs: {differ} differ, at least {FEWEST} are needed"
        if self.adjusted >= SIGNIFICANT:
            return "no significant change"
        return "significantly better" if self.gain > 0.0 else "significantly worse" if self.gain < 0.0 else "changed"


@dataclass(frozen=True)
class Comparison:
    """A campaign beside an earlier one."""

    earlier: str
    common: int
    """Cells that both have."""
    same: int
    """Of these, the ones that went the same way to the last bit, or failed with the same words."""
    changes: tuple[Change, ...]
    """The others, losses first."""
    tests: tuple[Test, ...]
    notes: tuple[str, ...]


def compare(now: Campaign, earlier: Campaign) -> Comparison:
    """Compare a campaign with an earlier one, cell by cell: the same controller, world and seed.

    Where each has one controller, these two are compared whatever they are called.
    """
    names = _counterparts(now.manifest.plan.controllers, earlier.manifest.plan.controllers)
    pairs = [
        (earlier.results[old], result)
        for cell, result in now.results.items()
        if (old := replace(cell, controller=names.get(cell.controller, ""))) in earlier.results
    ]
    better = {world: task["better"] for world, task in tasks_of_worlds(now.results.values()).items()}
    changes = [change for pair in pairs if (change := _change(*pair, better)) is not None]
    kinds = task_types(now.results.values())
    tests = [
        _test(
            controller, kind, kinds[kind]["unit"], [pair for pair in pairs if _is_of(pair[1], controller, kind)], better
        )
        for controller in now.manifest.plan.controllers
        if controller in names
        for kind in kinds
    ]
    return Comparison(
        earlier=str(earlier.folder),
        common=len(pairs),
        same=len(pairs) - len(changes),
        changes=tuple(sorted(changes, key=_severity)),
        tests=tuple(_adjusted(tests)),
        notes=(*_notes(now, earlier, names), *_changed_worlds(pairs)),
    )


def paired_test(gains: Sequence[float]) -> float | None:
    """Two-sided p-value of Wilcoxon's signed ranks (1945), zeros left out; None for fewer than six others."""
    from scipy.stats import wilcoxon

    moved = [gain for gain in gains if gain != 0.0]
    return float(wilcoxon(moved).pvalue) if len(moved) >= FEWEST else None


def _counterparts(now: Sequence[str], earlier: Sequence[str]) -> dict[str, str]:
    """What each controller was called in the earlier campaign."""
    if len(now) == len(earlier) == 1:
        return {now[0]: earlier[0]}
    return {name: name for name in now if name in earlier}


def _is_of(result: Result, controller: str, kind: str) -> bool:
    return result.cell.controller == controller and result.task is not None and result.task["type"] == kind


def _gain(before: Result, after: Result, better: Mapping[str, str]) -> float | None:
    if before.score is None or after.score is None:
        return None
    if better[after.cell.world] == "higher":
        return after.score - before.score
    return before.score - after.score


def _change(before: Result, after: Result, better: Mapping[str, str]) -> Change | None:
    """How a cell has changed; None where it has not."""
    if before.failed != after.failed:
        return Change(after.cell, before, after, None)
    if after.failed or before.state_sha256 == after.state_sha256:
        return None
    return Change(after.cell, before, after, _gain(before, after, better) or 0.0)


def _severity(change: Change) -> float:
    """What is smaller comes first: new failures, then losses, gains, and what works again."""
    if change.gain is None:
        return math.inf if change.before.failed else -math.inf
    return change.gain


def _test(
    controller: str, kind: str, unit: str, pairs: Sequence[tuple[Result, Result]], better: Mapping[str, str]
) -> Test:
    gains = [gain for pair in pairs if (gain := _gain(*pair, better)) is not None]
    return Test(
        controller,
        kind,
        unit,
        pairs=len(gains),
        better=sum(gain > 0.0 for gain in gains),
        worse=sum(gain < 0.0 for gain in gains),
        gain=median(gains) if gains else 0.0,
        p=paired_test(gains),
    )


def _adjusted(tests: Sequence[Test]) -> Iterator[Test]:
    """The tests with p-values adjusted for their number (Holm 1979)."""
    order = sorted((test.p, index) for index, test in enumerate(tests) if test.p is not None)
    adjusted: dict[int, float] = {}
    least = 0.0
    for rank, (p, index) in enumerate(order):
        least = max(least, min(1.0, (len(order) - rank) * p))
        adjusted[index] = least
    for index, test in enumerate(tests):
        yield replace(test, adjusted=adjusted.get(index))


def _changed_worlds(pairs: Sequence[tuple[Result, Result]]) -> Iterator[str]:
    """Which worlds are not the same in both."""
    changed = {after.cell.world: None for before, after in pairs if _differ(before.world_sha256, after.world_sha256)}
    if changed:
        more = f" and {len(changed) - SHOWN} more" if len(changed) > SHOWN else ""
        yield f"worlds whose files have changed: {', '.join([*changed][:SHOWN])}{more}"


def _differ(before: str, after: str) -> bool:
    """Whether two fingerprints differ; that of a failed trial is not known."""
    return bool(before and after) and before != after


def _notes(now: Campaign, earlier: Campaign, names: Mapping[str, str]) -> Iterator[str]:
    """What else is different between the two."""
    new, old = now.manifest, earlier.manifest
    if new.code != old.code:
        yield f"vrx_mj was {old.code}, now {new.code}"
    for name, before in names.items():
        if name != before:
            yield f"{name} is compared with {before}"
        elif new.controllers[name] != old.controllers[name]:
            yield f"the controller {name} has changed"
    for option in ("fleet", "duration"):
        if getattr(new.plan, option) != getattr(old.plan, option):
            yield f"--{option} was {getattr(old.plan, option)}, now {getattr(new.plan, option)}"
    if new.platform != old.platform:
        yield f"platform was {old.platform}, now {new.platform}: equal runs may differ in their last bits"
