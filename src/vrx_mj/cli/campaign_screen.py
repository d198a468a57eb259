"""What a campaign shows in the terminal: how far it is, and tables at the end."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from vrx_mj.bar import Bar

if TYPE_CHECKING:
    from vrx_mj.campaign.manifest import Campaign
    from vrx_mj.campaign.results import Result
    from vrx_mj.campaign.scores import Comparison

__all__ = ["Watch", "print_tables", "watching"]

SHOWN_FAILURES = 10


class Watch:
    """Shows how far a campaign is: failed trials and a bar in a terminal, else a line for each trial."""

    def __init__(self, bar: Bar, total: int) -> None:
        self._bar, self._total, self._done, self._failed, self._running = bar, total, 0, 0, 0

    def running(self, count: int) -> None:
        """So many trials are under way."""
        self._running = count
        self._show()

    def finished(self, result: "Result") -> None:
        """A trial has ended."""
        self._done += 1
        self._failed += result.failed
        if result.failed or not self._bar.watched:
            line = f"[{self._done}/{self._total}] {result.cell}: {_outcome(result)}"
            self._bar.print(line, "red" if result.failed else None)
        self._show()

    def _show(self) -> None:
        self._bar.update(self._done, f"{self._running} running, {self._failed} failed")


@contextmanager
def watching(total: int) -> Iterator[Watch]:
    """A bar over the trials of a campaign."""
    with Bar("campaign", total, "trials") as bar:
        yield Watch(bar, total)


def print_tables(campaign: "Campaign", comparison: "Comparison | None") -> None:
    """Scores by world, the leaderboard where there are several controllers, what changed, and failures."""
    out = Console()
    out.print(_scores(campaign))
    if len(campaign.manifest.plan.controllers) > 1:
        out.print(_leaderboard(campaign))
    if comparison is not None:
        out.print(_changes(comparison))
    _print_failures(campaign, out.print)


def _table(title: str, left: tuple[str, ...], right: tuple[str, ...]) -> Table:
    table = Table(title=Text(title), title_justify="left")
    for name in left:
        table.add_column(Text(name), overflow="fold")
    for name in right:
        table.add_column(Text(name), justify="right", overflow="fold")
    return table


def _scores(campaign: "Campaign") -> Table:
    from vrx_mj.campaign.scores import mean_of, tasks_of_worlds

    plan, results = campaign.manifest.plan, list(campaign.results.values())
    tasks = tasks_of_worlds(results)
    table = _table(
        "scores: mean ± standard deviation over the seeds; ↓ lower is better, ↑ higher",
        ("world", "unit"),
        plan.controllers,
    )
    for world in plan.worlds:
        task, cells = tasks.get(world), []
        for controller in plan.controllers:
            own = [each for each in results if each.cell.world == world and each.cell.controller == controller]
            cells.append(_mean(mean_of(own), len(own), has_task=task is not None))
        table.add_row(Text(world), Text(_unit(task) if task else ""), *cells)
    return table


def _unit(task: Mapping[str, str]) -> str:
    return f"{'↑' if task['better'] == 'higher' else '↓'} {task['unit']}"


def _mean(mean: object, count: int, *, has_task: bool) -> Text:
    failed = getattr(mean, "failed", 0)
    text = str(mean) if has_task else "no task" if count > failed else ""
    lost = f"{failed} of {count} failed" if failed else ""
    return Text("not sailed" if not count else ", ".join(filter(None, [text if text != "failed" else "", lost])))


def _leaderboard(campaign: "Campaign") -> Table:
    from vrx_mj.campaign.scores import leaderboard, task_types

    results = list(campaign.results.values())
    kinds = task_types(results)
    table = _table(
        "leaderboard: rank in each task, and their sum", ("controller",), ("sum", *(k.replace("_", " ") for k in kinds))
    )
    for line in leaderboard(results, campaign.manifest.plan.controllers):
        table.add_row(Text(line.controller), str(line.total), *(str(line.ranks[kind]) for kind in kinds))
    return table


def _changes(comparison: "Comparison") -> Table:
    title = f"since {comparison.earlier}: {comparison.common} trials in both, {comparison.same} went the same way"
    table = _table(title, ("controller", "task"), ("pairs", "better", "worse", "gain", "p", "verdict"))
    for test in comparison.tests:
        p = "-" if test.adjusted is None or math.isnan(test.adjusted) else f"{test.adjusted:.3g}"
        counts = (str(test.pairs), str(test.better), str(test.worse), f"{test.gain:+.3g} {test.unit}", p)
        table.add_row(Text(test.controller), Text(test.task.replace("_", " ")), *counts, Text(test.verdict))
    return table


def _print_failures(campaign: "Campaign", show: Callable[..., None]) -> None:
    failed = [result for result in campaign.results.values() if result.failed]
    for result in failed[:SHOWN_FAILURES]:
        show(f"{result.cell}: {result.error}", style="red", markup=False, highlight=False, soft_wrap=True)
    if len(failed) > SHOWN_FAILURES:
        show(f"and {len(failed) - SHOWN_FAILURES} more failures: the page has them all", style="red")


def _outcome(result: "Result") -> str:
    if result.failed:
        return f"failed: {result.error}"
    outcome = "no task" if result.task is None else f"{result.score:.4g} {result.task['unit']}"
    return f"{outcome} ({result.sim_time:g} s in {result.wall_time:.1f} s)"
