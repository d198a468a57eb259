"""`vrx-mj campaign`: controllers on worlds with seeds, in parallel, to a table and a page."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option, echo

from vrx_mj.bar import Bar
from vrx_mj.cli.options import Fleet, above_zero, reads_files
from vrx_mj.cli.screen import print_table, show
from vrx_mj.errors import CommandError
from vrx_mj.outputs import writing

if TYPE_CHECKING:
    from vrx_mj.campaign.engines import Engine
    from vrx_mj.campaign.manifest import Campaign
    from vrx_mj.campaign.page import LivePage
    from vrx_mj.campaign.plan import Plan, Serving
    from vrx_mj.campaign.results import Result
    from vrx_mj.campaign.scores import Comparison, Mean

_Worlds = Annotated[
    list[str],
    Option(
        metavar="<world>", help="A name, a file or a pattern, such as 'vrx2022/*' or 'seas/*.yaml'; may be repeated."
    ),
]
_Controllers = Annotated[
    list[str] | None,
    Argument(metavar="CONTROLLER", help="module:function or module:Class; several are compared."),
]
_Programs = Annotated[
    list[str] | None,
    Option(
        "--exec",
        metavar="<program>",
        help="A program that sails through ROS or ArduPilot, instead of a controller; may be repeated.",
    ),
]
_Duration = Annotated[
    float | None,
    Option(help="Simulated seconds of a trial; default: until the task is finished.", callback=above_zero()),
]
_Timeout = Annotated[
    float | None,
    Option(help="Wall-time limit of a trial [s]; default: its simulated time plus 60 s.", callback=above_zero()),
]
_Waits = Annotated[
    str | None,
    Option(help="With --exec: topics A,B that the simulation waits for; step: the service /vrx_mj/step."),
]
_Vary = Annotated[
    list[str] | None,
    Option(
        metavar="NAME=LOW..HIGH",
        help="Draw a quantity for each seed, such as wind.mean_velocity=0..8; may be repeated.",
    ),
]
_Ray = Annotated[
    str | None,
    Option(
        metavar="[<address>]", help="Run on the Ray cluster at this address; default: RAY_ADDRESS, or this machine."
    ),
]
_SHOWN_FAILURES = 10


@reads_files
def campaign(
    worlds: _Worlds,
    output: Annotated[Path, Option("--output", "-o", help="Folder for results; a stopped campaign continues.")],
    controllers: _Controllers = None,
    programs: _Programs = None,
    seeds: Annotated[str, Option(help="Seeds, as in 0..9 or 0,3,7.")] = "0",
    vary: _Vary = None,
    jobs: Annotated[int | None, Option(min=1, help="Trials at a time; default: one for each core.")] = None,
    against: Annotated[Path | None, Option(help="Folder of an earlier campaign to compare with.")] = None,
    fleet: Fleet = None,
    duration: _Duration = None,
    timeout: _Timeout = None,
    record: Annotated[bool, Option("--record", help="Keep a recording of every trial (.rrd).")] = False,
    rate: Annotated[str | None, Option(help="With --exec: simulated seconds per second, or max.")] = None,
    lockstep: _Waits = None,
    rosbridge: Annotated[bool, Option("--rosbridge", help="With --exec: rosbridge in every trial.")] = False,
    ardupilot: Annotated[bool, Option("--ardupilot", help="With --exec: ArduPilot's SITL, without ROS.")] = False,
    ray: _Ray = None,
    restart: Annotated[bool, Option("--restart", help="Discard the folder's results and start over.")] = False,
) -> None:
    """Sail controllers in many worlds, and compare their scores. Every controller sails every world with every seed.

    A crash of one trial does not affect the others. Ctrl-C keeps the finished trials. Run the same command again to
    continue with the rest; failed trials run again.

    Example: vrx-mj campaign my_boat:controller --worlds 'vrx2022/*' --seeds 0..9 --jobs 2 -o results/
    """
    from vrx_mj.campaign.manifest import begin, read_campaign
    from vrx_mj.campaign.page import LivePage
    from vrx_mj.campaign.worker import check_controllers

    serving = _serving(controllers, programs, rate, lockstep, rosbridge=rosbridge, ardupilot=ardupilot)
    plan = _plan(
        programs or controllers or (), worlds, seeds, fleet=fleet, duration=duration, timeout=timeout, record=record,
        serving=serving, vary=vary or (),
    )  # fmt: skip
    earlier = read_campaign(against) if against is not None else None
    rows = check_controllers(plan.controllers) if serving is None else frozenset()
    with writing("the campaign", output):
        begun = begin(output, plan, restart=restart)
        page = LivePage(begun, earlier)
        stopped = _carry_out(begun, _engine(jobs, ray), page, rows)
        now, comparison = page.write()
    _conclude(now, comparison, page.file, stopped=stopped)


def _serving(
    controllers: Sequence[str] | None,
    programs: Sequence[str] | None,
    rate: str | None,
    lockstep: str | None,
    *,
    rosbridge: bool,
    ardupilot: bool,
) -> "Serving | None":
    """How worlds are served to programs; None where controllers sail."""
    from vrx_mj.campaign.plan import Serving
    from vrx_mj.cli.ros import check_installed, parse_lockstep, parse_rate

    if bool(controllers) == bool(programs):
        raise CommandError("a campaign needs either controllers (CONTROLLER...) or programs (--exec)")
    if not programs:
        given = {"--rate": rate, "--lockstep": lockstep, "--rosbridge": rosbridge, "--ardupilot": ardupilot}
        for option, value in given.items():
            if value not in {None, False}:
                raise CommandError(f"{option} needs --exec: it applies to programs, not to controllers")
        return None
    if not all(map(str.strip, programs)):
        raise CommandError("invalid --exec '': the name of a program is needed")
    if not ardupilot:
        check_installed(*("rosbridge",) * rosbridge, "ros1")
    elif rosbridge or lockstep is not None:
        raise CommandError("--ardupilot serves no ROS: --rosbridge and --lockstep cannot be given with it")
    return Serving(
        parse_rate(rate or "1"), None if lockstep is None else parse_lockstep(lockstep), rosbridge, ardupilot
    )


def _plan(controllers: Sequence[str], worlds: Sequence[str], seeds: str, vary: Sequence[str], **options: Any) -> "Plan":
    """The plan, whose worlds can be read and have the quantities that vary."""
    from vrx_mj.campaign.manifest import check_files
    from vrx_mj.campaign.plan import Plan, choose_worlds, parse_seeds
    from vrx_mj.campaign.vary import check_vary, parse_vary

    if twice := next((name for name in controllers if controllers.count(name) > 1), None):
        raise CommandError(f"the {'program' if options['serving'] else 'controller'} {twice} is named twice")
    plan = Plan(tuple(controllers), choose_worlds(worlds), parse_seeds(seeds), parse_vary(vary), **options)
    check_files(plan)
    return replace(plan, vary=check_vary(plan.vary, plan.worlds, plan.fleet))


def _carry_out(begun: "Campaign", engine: "Engine", page: "LivePage", rows: frozenset[str]) -> bool:
    """Sail what is left, of controllers that take `rows` together; whether it was stopped before its end."""
    from vrx_mj.campaign.engines import run_trials
    from vrx_mj.campaign.results import ResultStore

    plan, left = begun.manifest.plan, begun.remaining
    if len(left) < len(plan.cells):
        show(f"{begun.folder}: {len(plan.cells) - len(left)} of {len(plan.cells)} trials are finished")
    trials = [replace(plan.trial(cell), rows=cell.controller in rows) for cell in left]
    with ResultStore(begun.folder, writes=True) as store, Bar("campaign", len(trials), "trials") as bar:
        page.refresh()
        progress = CampaignProgress(bar, len(trials))
        sailed = run_trials(trials, begun.folder, engine, running=progress.running)
        try:
            for result in sailed:
                store.add(result)
                progress.note_result(result)
                page.refresh(result)
        except KeyboardInterrupt:
            return True
        finally:
            sailed.close()
    return False


def _engine(jobs: int | None, ray: str | None) -> "Engine":
    from vrx_mj.campaign.engines import ProcessPool, RayCluster
    from vrx_mj.runtime.limits import core_share

    return ProcessPool(jobs or max(1, int(core_share()[1]))) if ray is None else RayCluster(ray or None, jobs)


def _conclude(now: "Campaign", comparison: "Comparison | None", page: Path, *, stopped: bool) -> None:
    """Print how it went; exit code 1 if it was stopped, or if every trial failed."""
    print_tables(now, comparison)
    cells, failed = now.manifest.plan.cells, sum(result.has_failed for result in now.results.values())
    counts = f"{len(now.results) - failed} of {len(cells)} trials finished, {failed} failed"
    echo(f"{counts}; page: {page}")
    if stopped:
        show("stopped; the same command continues from here")
    if stopped or failed == len(cells):
        raise SystemExit(1)


class CampaignProgress:
    """Shows how far a campaign is: in a terminal by a bar and the first failure of each kind, else by lines."""

    def __init__(self, bar: Bar, total: int) -> None:
        self._bar, self._total, self._done, self._failed, self._running = bar, total, 0, 0, 0
        self._kinds: set[tuple[str, str]] = set()

    def running(self, count: int) -> None:
        """Show the number of trials under way."""
        self._running = count
        self._show()

    def note_result(self, result: "Result") -> None:
        """A trial has ended."""
        from vrx_mj.campaign.scores import failure_kind

        self._done += 1
        self._failed += result.has_failed
        kind = failure_kind(result)
        is_new = result.has_failed and kind not in self._kinds
        if is_new or not self._bar.watched:
            outcome = f"{result.state} as before" if result.has_failed and not is_new else _outcome(result)
            self._kinds.add(kind)
            line = f"[{self._done}/{self._total}] {result.cell}: {outcome}"
            self._bar.print(line, "red" if result.has_failed else None)
        self._show()

    def _show(self) -> None:
        self._bar.update(self._done, f"{self._running} running, {self._failed} failed")


def print_tables(campaign: "Campaign", comparison: "Comparison | None") -> None:
    """Scores by world, the leaderboard where there are several controllers, what changed, and failures."""
    from vrx_mj.campaign.scores import failure_classes, seedless_worlds

    _print_scores(campaign)
    for world in seedless_worlds(campaign.results.values()):
        seeds = len(campaign.manifest.plan.seeds)
        echo(f"{world}: all {seeds} seeds give the same motion; --vary draws weather or boats per seed")
    if len(campaign.manifest.plan.controllers) > 1:
        _print_leaderboard(campaign)
    if comparison is not None:
        title = f"compared with {comparison.earlier}: {comparison.common} trials in both, {comparison.same} alike"
        rows = []
        for test in comparison.tests:
            p = "-" if test.adjusted is None or math.isnan(test.adjusted) else f"{test.adjusted:.3g}"
            counts = (str(test.pairs), str(test.better), str(test.worse), f"{test.gain:+.3g} {test.unit}", p)
            rows.append((test.controller, test.task.replace("_", " "), *counts, test.verdict))
        print_table(title, ("controller", "task"), ("pairs", "better", "worse", "gain", "p", "verdict"), rows)
    classes = failure_classes(campaign.results.values())
    for first, *others in classes[:_SHOWN_FAILURES]:
        more = f" (and {len(others)} more like it)" if others else ""
        show(f"{first.cell}: {first.error}{more}", "red", result=True)
    if len(classes) > _SHOWN_FAILURES:
        show(f"and {len(classes) - _SHOWN_FAILURES} other kinds of failures: see the page", "red", result=True)


def _print_scores(campaign: "Campaign") -> None:
    from vrx_mj.campaign.scores import group_by, mean_of, tasks_of_worlds

    plan, results = campaign.manifest.plan, campaign.results.values()
    tasks, rows = tasks_of_worlds(results), []
    groups = group_by(results, lambda result: (result.cell.world, result.cell.controller))
    for world in plan.worlds:
        task, cells = tasks.get(world), []
        for controller in plan.controllers:
            own = groups.get((world, controller), [])
            cells.append(_mean(mean_of(own), len(own), has_task=task is not None))
        rows.append((world, f"{'↑' if task['better'] == 'higher' else '↓'} {task['unit']}" if task else "", *cells))
    title = "scores: mean ± standard deviation over the seeds; ↓ lower is better, ↑ higher"
    print_table(title, ("world", "unit"), plan.controllers, rows)


def _mean(mean: "Mean", count: int, *, has_task: bool) -> str:
    kinds = {"failed": mean.failed, "lost": mean.lost, "not started": mean.unstarted, "cut": mean.cut}
    notes = [f"{number} of {count} {how}" for how, number in kinds.items() if number]
    text = str(mean) if has_task else "no task" if count > mean.failed + mean.lost else "failed"
    return "not sailed" if not count else ", ".join([text, *notes] if text not in kinds else notes)


def _print_leaderboard(campaign: "Campaign") -> None:
    from vrx_mj.campaign.scores import leaderboard, task_types

    results = list(campaign.results.values())
    kinds = task_types(results)
    rows = [
        (line.controller, str(line.total), *(str(line.ranks[kind] or "-") for kind in kinds))
        for line in leaderboard(results, campaign.manifest.plan.controllers)
    ]
    names = ("sum", *(kind.replace("_", " ") for kind in kinds))
    print_table("leaderboard: rank in each task, and their sum", ("controller",), names, rows)


def _outcome(result: "Result") -> str:
    if result.has_failed:
        return f"{result.state}: {result.error}"
    outcome: str = "no task" if result.task is None else result.state
    if result.task is not None and result.score is not None:
        outcome = f"{result.score:.4g} {result.task['unit']}{', cut' if result.state == 'cut' else ''}"
    return f"{outcome} ({result.sim_time:g} s in {result.wall_time:.1f} s)"
