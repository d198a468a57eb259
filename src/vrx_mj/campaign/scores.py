"""Scores of a campaign: the ranking, and what changed since an earlier one, with paired tests by type of task."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean, median, stdev

from vrx_mj.campaign.manifest import Campaign
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import Result
from vrx_mj.errors import first_names

_SIGNIFICANT = 0.05
_SHOWN = 3
"""How many names a note lists."""
_FEWEST = 6
"""Fewest pairs that differ for a test: with five of them no two-sided p-value of signed ranks is below 2 / 2^5."""


@dataclass(frozen=True)
class Change:
    """A cell whose result is another one now."""

    cell: Cell
    before: Result
    after: Result
    gain: float | None
    """Improvement of the score in its unit; None where one of the two has no score."""

    @property
    def is_loss(self) -> bool:
        """Whether it failed now, or has a score no longer."""
        return self.after.has_failed or (self.after.score is None and self.before.score is not None)

    @property
    def kind(self) -> str:
        """The kind of change, in a few words."""
        if self.gain is None:
            return "fails now" if self.after.has_failed else "no score now" if self.is_loss else "works now"
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
    """p-value after Holm's adjustment for all tests of the comparison."""

    @property
    def verdict(self) -> str:
        """The conclusion, in words."""
        differ = self.better + self.worse
        if not self.pairs:
            return "no cell has a score in both campaigns"
        if not differ:
            return "no score has changed"
        if self.p is None or self.adjusted is None:
            return f"too few pairs: {differ} differ, at least {_FEWEST} are needed"
        if self.adjusted >= _SIGNIFICANT:
            return "no significant change"
        return "significantly better" if self.gain > 0.0 else "significantly worse" if self.gain < 0.0 else "changed"


@dataclass(frozen=True)
class Comparison:
    """A campaign beside an earlier one."""

    earlier: str
    common: int
    """Cells that both have."""
    same: int
    """Cells that have the same result in both to the last bit, or failed with the same words."""
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
            controller,
            kind,
            kinds[kind]["unit"],
            [
                pair
                for pair in pairs
                if pair[1].cell.controller == controller and (pair[1].task or {}).get("type") == kind
            ],
            better,
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
        tests=tuple(_holm_adjustment(tests)),
        notes=(*_notes(now, earlier, names), *_changed_worlds(pairs)),
    )


def paired_test(gains: Sequence[float]) -> float | None:
    """Two-sided p-value of Wilcoxon's signed ranks (1945), zeros left out; None for fewer than six others."""
    from scipy.stats import wilcoxon

    moved = [gain for gain in gains if gain != 0.0]
    return float(wilcoxon(moved).pvalue) if len(moved) >= _FEWEST else None


def _counterparts(now: Sequence[str], earlier: Sequence[str]) -> dict[str, str]:
    """What each controller was called in the earlier campaign."""
    if len(now) == len(earlier) == 1:
        return {now[0]: earlier[0]}
    return {name: name for name in now if name in earlier}


def _gain(before: Result, after: Result, better: Mapping[str, str]) -> float | None:
    if before.score is None or after.score is None:
        return None
    if better[after.cell.world] == "higher":
        return after.score - before.score
    return before.score - after.score


def _change(before: Result, after: Result, better: Mapping[str, str]) -> Change | None:
    """How a cell has changed; None where it has not."""
    if before.has_failed != after.has_failed or (before.score is None) != (after.score is None):
        return Change(after.cell, before, after, None)
    if after.has_failed or before.state_sha256 == after.state_sha256:
        return None
    return Change(after.cell, before, after, _gain(before, after, better) or 0.0)


def _severity(change: Change) -> float:
    """What is smaller comes first: new failures, then losses, gains, and what works again."""
    if change.gain is None:
        return -math.inf if change.is_loss else math.inf
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


def _holm_adjustment(tests: Sequence[Test]) -> Iterator[Test]:
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
    known = [(after.cell.world, {before.world_sha256, after.world_sha256} - {""}) for before, after in pairs]
    changed = dict.fromkeys(world for world, hashes in known if len(hashes) > 1)  # a failed trial may have none
    if changed:
        yield f"worlds whose files have changed: {first_names(changed, _SHOWN)}"


def _notes(now: Campaign, earlier: Campaign, names: Mapping[str, str]) -> Iterator[str]:
    """What else is different between the two."""
    new, old = now.manifest, earlier.manifest
    if new.code != old.code:
        yield f"vrx_mj was {old.code}, now {new.code}"
    if new.physics_version != old.physics_version:
        yield f"physics version was {old.physics_version}, now {new.physics_version}: equal runs differ"
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


@dataclass(frozen=True)
class Mean:
    """Scores of several trials."""

    scores: tuple[float, ...]
    failed: int
    """Trials without a score because they failed."""
    unstarted: int = 0
    """Trials without a score because their task never started."""
    cut: int = 0
    """Trials whose score is of a task that was cut."""

    @property
    def mean(self) -> float:
        """Mean of the scores; NaN without any."""
        return fmean(self.scores) if self.scores else math.nan

    @property
    def deviation(self) -> float:
        """Standard deviation of the sample; NaN for fewer than two."""
        return stdev(self.scores) if len(self.scores) > 1 else math.nan

    def __str__(self) -> str:
        if not self.scores:
            return "failed" if self.failed else "not started" if self.unstarted else "-"
        spread = f" ± {self.deviation:.2g}" if len(self.scores) > 1 else ""
        return f"{self.mean:.4g}{spread}"


@dataclass(frozen=True)
class Line:
    """A controller on the leaderboard."""

    controller: str
    means: Mapping[str, Mean]
    """Means by type of task."""
    ranks: Mapping[str, int | None]
    """Ranks by type of task; 1 is the best, equals share the better rank, and without a score there is none."""
    total: int
    """Sum of the ranks: the smaller, the better; no rank counts as the last."""

    @property
    def failures(self) -> int:
        """Trials that failed."""
        return sum(mean.failed for mean in self.means.values())


def mean_of(results: Iterable[Result]) -> Mean:
    """The scores of these trials together."""
    found = list(results)
    scores = tuple(result.score for result in found if result.score is not None)
    return Mean(scores, *(sum(result.state == how for result in found) for how in ("failed", "not started", "cut")))


def seedless_worlds(results: Iterable[Result]) -> list[str]:
    """Worlds in which each controller sailed one and the same run with all of several seeds, by score and track."""
    groups: dict[tuple[str, str], list[Result]] = {}
    for result in results:
        groups.setdefault((result.cell.world, result.cell.controller), []).append(result)
    runs = {key: [(one.has_failed, one.score, one.sim_time, one.tracks) for one in own] for key, own in groups.items()}
    varied = {key[0] for key, own in runs.items() if len(own) < 2 or own[0][0] or any(one != own[0] for one in own)}
    return [world for world in dict.fromkeys(world for world, _ in groups) if world not in varied]


def tasks_of_worlds(results: Iterable[Result]) -> dict[str, Mapping[str, str]]:
    """Type, name, unit and direction of the task in each world, as far as some trial there came to its end."""
    return {
        result.cell.world: {key: str(result.task[key]) for key in ("type", "name", "unit", "better")}
        for result in results
        if result.task is not None
    }


def task_types(results: Iterable[Result]) -> dict[str, Mapping[str, str]]:
    """Unit and direction of each type of task, sorted."""
    tasks = tasks_of_worlds(results).values()
    return {task["type"]: task for task in sorted(tasks, key=lambda task: task["type"])}


def leaderboard(results: Sequence[Result], controllers: Sequence[str]) -> list[Line]:
    """Controllers, the best first: ranked in each type of task, their ranks summed.

    That is how VRX ranks teams. Within a task, fewer trials without a score come first and then the better mean score.
    """
    worlds, kinds = tasks_of_worlds(results), task_types(results)
    tasks = [(result, worlds.get(result.cell.world, {}).get("type")) for result in results]  # of failed ones, too
    means = {
        who: {
            kind: mean_of(one for one, task in tasks if task == kind and one.cell.controller == who) for kind in kinds
        }
        for who in controllers
    }
    ranks = {kind: _ranks({who: means[who][kind] for who in controllers}, kinds[kind]["better"]) for kind in kinds}
    lines = []
    for who in controllers:
        own = {kind: ranks[kind][who] for kind in kinds}
        lines.append(Line(who, means[who], own, sum(rank or len(controllers) for rank in own.values())))
    return sorted(lines, key=lambda line: (line.total, line.failures))


def _ranks(means: Mapping[str, Mean], better: str) -> dict[str, int | None]:
    sign = 1.0 if better == "lower" else -1.0
    keys = {who: (mean.failed + mean.unstarted, sign * mean.mean) for who, mean in means.items() if mean.scores}
    return {who: 1 + sum(other < keys[who] for other in keys.values()) if who in keys else None for who in means}
