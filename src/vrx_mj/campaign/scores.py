"""Scores of a campaign: the ranking, and what changed since an earlier one, with paired tests by type of task."""

import heapq
import math
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import fmean, median, stdev
from typing import TypeVar

import numpy as np

from vrx_mj.campaign.manifest import Campaign
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import Result
from vrx_mj.campaign.vary import Quantity
from vrx_mj.errors import first_names

_SIGNIFICANCE_LEVEL = 0.05
_RESAMPLES = 1000
"""Resamples of a bootstrap; so many scores show the normal distribution."""
_WORTH_SEEING = 5
_BINS = 10
_NUMBERS = re.compile(r"\d+(\.\d+)?([eE][-+]?\d+)?")
_Key = TypeVar("_Key", bound=Hashable)
_MIN_PAIRS = 6
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
            return f"too few pairs: {differ} differ, at least {_MIN_PAIRS} are needed"
        if self.adjusted >= _SIGNIFICANCE_LEVEL:
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
    return float(wilcoxon(moved).pvalue) if len(moved) >= _MIN_PAIRS else None


def _counterparts(now: Sequence[str], earlier: Sequence[str]) -> dict[str, str]:
    """Names of the controllers in the earlier campaign."""
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
    """Sort key: new failures come first, then losses, gains, and trials that work again."""
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
        yield f"worlds whose files have changed: {first_names(changed)}"


def _notes(now: Campaign, earlier: Campaign, names: Mapping[str, str]) -> Iterator[str]:
    """Notes on other differences between the two."""
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
    lost: int = 0
    """Trials that say nothing, because their machine failed."""

    @property
    def mean(self) -> float:
        """Mean of the scores; NaN without any."""
        return fmean(self.scores) if self.scores else math.nan

    @property
    def deviation(self) -> float:
        """Standard deviation of the sample; NaN for fewer than two."""
        return stdev(self.scores) if len(self.scores) > 1 else math.nan

    @cached_property
    def interval(self) -> tuple[float, float] | None:
        """Where the mean of all such trials lies, with 95 %; None for fewer than two scores.

        Percentiles of the means of resamples (bootstrap: Efron 1979), which are always the same ones. For many scores
        they are those of the normal distribution, which is used from there on.
        """
        scores = np.array(self.scores)
        if len(scores) < 2:
            return None
        if len(scores) > _RESAMPLES:
            reach = 1.96 * self.deviation / math.sqrt(len(scores))
            return self.mean - reach, self.mean + reach
        means = scores[np.random.default_rng(0).integers(len(scores), size=(_RESAMPLES, len(scores)))].mean(axis=1)
        low, high = np.quantile(means, (0.025, 0.975)).tolist()
        return low, high

    @property
    def notes(self) -> str:
        """How many trials ended otherwise than with their task, in words."""
        counts = {"failed": self.failed, "lost": self.lost, "not started": self.unstarted, "cut": self.cut}
        return ", ".join(f"{count} {how}" for how, count in counts.items() if count)

    def __str__(self) -> str:
        if not self.scores:
            return "failed" if self.failed else "not started" if self.unstarted else "lost" if self.lost else "-"
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
    states = Counter(result.state for result in found)
    return Mean(
        tuple(score for result in found if (score := result.score) is not None),
        *(states[how] for how in ("failed", "not started", "cut", "lost")),
    )


def group_by(results: Iterable[Result], key: Callable[[Result], _Key]) -> dict[_Key, list[Result]]:
    """Results by what a function says of each."""
    groups: dict[_Key, list[Result]] = defaultdict(list)
    for result in results:
        groups[key(result)].append(result)
    return groups


def seedless_worlds(results: Iterable[Result]) -> list[str]:
    """Worlds in which each controller's boats moved alike, to the last bit, with all of several seeds."""
    worlds: dict[str, bool] = {}
    for (world, _), own in group_by(results, lambda result: (result.cell.world, result.cell.controller)).items():
        runs = {(one.has_failed, one.score, one.sim_time, one.poses_sha256) for one in own}
        alike = len(own) > 1 and len(runs) == 1 and not own[0].has_failed
        worlds[world] = alike and worlds.get(world, True)
    return [world for world, alike in worlds.items() if alike]


def failure_kind(result: Result) -> tuple[str, str]:
    """State and message without numbers: equal for failures of one class."""
    return result.state, _NUMBERS.sub("#", result.error or "")


def failure_classes(results: Iterable[Result]) -> list[list[Result]]:
    """Trials that failed or were lost with the same message but for its numbers, the most frequent first."""
    found = group_by((result for result in results if result.has_failed), failure_kind)
    return sorted(found.values(), key=len, reverse=True)


def remarkable_trials(results: Iterable[Result]) -> list[tuple[str, Result]]:
    """The five worst scores and the five nearest to the median, each by the scores in its world; recorded ones, if any.

    Worlds have units of their own: scores are compared by their distance from the median of the world.
    """
    scored = [result for result in results if result.score is not None]
    places: list[tuple[float, Result]] = []
    for own in group_by(scored, lambda result: result.cell.world).values():
        scores = np.array([result.score for result in own])
        low, middle, high = np.quantile(scores, (0.25, 0.5, 0.75))
        sign = 1.0 if (own[0].task or {})["better"] == "lower" else -1.0
        places += zip((sign * (scores - middle) / ((high - low) or 1.0)).tolist(), own, strict=True)
    if any(result.recording for result in scored):
        places = [(place, result) for place, result in places if result.recording]
    worst = heapq.nlargest(_WORTH_SEEING, places, key=lambda pair: pair[0])
    rest = [pair for pair in places if pair not in worst]
    median = heapq.nsmallest(_WORTH_SEEING, rest, key=lambda pair: abs(pair[0]))
    return [(why, result) for why, own in (("worst", worst), ("median", median)) for _, result in own]


@dataclass(frozen=True)
class Dependence:
    """Scores of a controller in a type of task over a quantity that was varied."""

    controller: str
    x: tuple[float, ...]
    """Values of the quantity, of each trial."""
    scores: tuple[float, ...]
    centers: tuple[float, ...]
    """Middle of each bin of the quantity's range that has trials."""
    means: tuple[Mean, ...]
    """Scores in each of these."""
    correlation: float
    """Spearman's rank correlation; NaN where it is not defined."""


def dependence(results: Sequence[Result], quantity: Quantity, controller: str) -> Dependence:
    """Scores of a controller's trials of one task over a quantity, in ten bins of its range."""
    from scipy.stats import spearmanr

    own = [result for result in results if result.score is not None and quantity.name in result.parameters]
    x = np.array([result.parameters[quantity.name] for result in own])
    scores = [float(result.score or 0.0) for result in own]
    width = (quantity.high - quantity.low) / _BINS
    bins = group_by(own, lambda result: min(int((result.parameters[quantity.name] - quantity.low) / width), _BINS - 1))
    order = sorted(bins)
    varied = len({*x.tolist()}) > 1 and len({*scores}) > 1
    return Dependence(
        controller,
        tuple(x.tolist()),
        tuple(scores),
        tuple(quantity.low + (number + 0.5) * width for number in order),
        tuple(mean_of(bins[number]) for number in order),
        float(spearmanr(x, scores).statistic) if varied else math.nan,
    )


def tasks_of_worlds(results: Iterable[Result]) -> dict[str, Mapping[str, str]]:
    """Type, name, unit and direction of the task in each world, as far as some trial there came to its end."""
    found: dict[str, Mapping[str, str]] = {}
    for result in results:
        if result.task is not None and result.cell.world not in found:
            found[result.cell.world] = {key: str(result.task[key]) for key in ("type", "name", "unit", "better")}
    return found


def task_types(results: Iterable[Result]) -> dict[str, Mapping[str, str]]:
    """Unit and direction of each type of task, sorted."""
    tasks = tasks_of_worlds(results).values()
    return {task["type"]: task for task in sorted(tasks, key=lambda task: task["type"])}


def leaderboard(results: Sequence[Result], controllers: Sequence[str]) -> list[Line]:
    """Controllers, the best first: ranked in each type of task, their ranks summed.

    That is how VRX ranks teams. Within a task, fewer trials without a score come first and then the better mean score.
    """
    worlds, kinds = tasks_of_worlds(results), task_types(results)
    groups = group_by(results, lambda one: (one.cell.controller, worlds.get(one.cell.world, {}).get("type")))
    means = {who: {kind: mean_of(groups.get((who, kind), ())) for kind in kinds} for who in controllers}
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
