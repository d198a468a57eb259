"""Who is best: means by world and by task, and the competition's ranking."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev

from vrx_mj.campaign.results import Result

__all__ = ["Line", "Mean", "leaderboard", "mean_of", "task_types", "tasks_of_worlds"]


@dataclass(frozen=True)
class Mean:
    """Scores of several trials."""

    scores: tuple[float, ...]
    failed: int
    """Trials without a score because they failed."""

    @property
    def mean(self) -> float:
        """Their mean; NaN where there are none."""
        return fmean(self.scores) if self.scores else math.nan

    @property
    def deviation(self) -> float:
        """Standard deviation of the sample; NaN for fewer than two."""
        return stdev(self.scores) if len(self.scores) > 1 else math.nan

    def __str__(self) -> str:
        if not self.scores:
            return "failed" if self.failed else "-"
        spread = f" ± {self.deviation:.2f}" if len(self.scores) > 1 else ""
        return f"{self.mean:.2f}{spread}"


@dataclass(frozen=True)
class Line:
    """A controller on the leaderboard."""

    controller: str
    means: Mapping[str, Mean]
    """By type of task."""
    ranks: Mapping[str, int]
    """By type of task; 1 is the best, and equals share the better rank."""

    @property
    def total(self) -> int:
        """Sum of the ranks: the smaller, the better."""
        return sum(self.ranks.values())

    @property
    def failed(self) -> int:
        """Trials that failed."""
        return sum(mean.failed for mean in self.means.values())


def mean_of(results: Iterable[Result]) -> Mean:
    """The scores of these trials together."""
    found = list(results)
    scores = tuple(result.score for result in found if result.score is not None)
    return Mean(scores, sum(result.failed for result in found))


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

    That is how VRX ranks teams. Within a task, fewer failed trials come first and then the better mean score.
    """
    worlds, kinds = tasks_of_worlds(results), task_types(results)
    means = {
        controller: {kind: mean_of(_of(results, controller, kind, worlds)) for kind in kinds}
        for controller in controllers
    }
    ranks = {kind: _ranks({who: means[who][kind] for who in controllers}, kinds[kind]["better"]) for kind in kinds}
    lines = [Line(who, means[who], {kind: ranks[kind][who] for kind in kinds}) for who in controllers]
    return sorted(lines, key=lambda line: (line.total, line.failed))


def _of(
    results: Iterable[Result], controller: str, kind: str, worlds: Mapping[str, Mapping[str, str]]
) -> Iterable[Result]:
    """The trials of a controller at a type of task; failed ones count where another one shows what task it was."""
    return (
        result
        for result in results
        if result.cell.controller == controller and worlds.get(result.cell.world, {}).get("type") == kind
    )


def _ranks(means: Mapping[str, Mean], better: str) -> dict[str, int]:
    sign = 1.0 if better == "lower" else -1.0
    keys = {who: (mean.failed, sign * mean.mean if mean.scores else math.inf) for who, mean in means.items()}
    return {who: 1 + sum(other < key for other in keys.values()) for who, key in keys.items()}
