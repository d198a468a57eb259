import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from campaigns import campaign_of, failed, scored
from vrx_mj.campaign.plan import Cell
from vrx_mj.campaign.results import Result
from vrx_mj.campaign.scores import (
    Mean,
    _holm_adjustment,
    compare,
    dependence,
    failure_classes,
    leaderboard,
    mean_of,
    paired_test,
    remarkable_trials,
    seedless_worlds,
)
from vrx_mj.campaign.scores import Test as PairedTest
from vrx_mj.campaign.vary import Quantity

SEEDS = range(8)


def signed_ranks(gains):
    """The exact two-sided p-value by trying every choice of signs, for gains without ties."""
    ranks = {size: rank for rank, size in enumerate(sorted(map(abs, gains)), start=1)}
    middle = sum(ranks.values()) / 2.0
    seen = abs(sum(ranks[abs(gain)] for gain in gains if gain > 0.0) - middle)
    sums = [sum(rank for rank, up in zip(ranks.values(), signs, strict=True) if up) for signs in
            product((False, True), repeat=len(gains))]  # fmt: skip
    return sum(abs(total - middle) >= seen - 1e-9 for total in sums) / len(sums)


@given(st.lists(st.integers(1, 1000), min_size=6, max_size=9, unique=True), st.data())
def test_the_p_value_is_that_of_all_choices_of_signs(sizes, data):
    gains = [size * data.draw(st.sampled_from((-1.0, 1.0))) for size in sizes]
    assert paired_test(gains) == pytest.approx(signed_ranks(gains), rel=1e-9)


def test_the_p_value_of_a_textbook():
    """Siegel and Castellan's way: eight pairs, all one way but the smallest: T = 1, p = 2 * 2 / 2^8."""
    assert paired_test([-1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]) == pytest.approx(4.0 / 256.0)


@pytest.mark.parametrize("gains", [[], [0.0] * 20, [1.0, 2.0, 3.0, 4.0, 5.0, 0.0, 0.0]])
def test_too_few_pairs_give_no_p_value(gains):
    assert paired_test(gains) is None


def both(tmp_path, before, after, **how):
    return compare(campaign_of(tmp_path / "new", after, **how), campaign_of(tmp_path / "old", before))


def test_lower_errors_and_more_points_are_gains(tmp_path):
    before = [scored("a:f", "hold", seed, 5.0 + seed) for seed in SEEDS]
    before += [scored("a:f", "bay", seed, 5.0 + seed, kind="dock") for seed in SEEDS]
    after = [scored("a:f", "hold", seed, 4.0 + 0.9 * seed) for seed in SEEDS]
    after += [scored("a:f", "bay", seed, 4.0 + 0.9 * seed, kind="dock") for seed in SEEDS]
    dock, hold = both(tmp_path, before, after).tests
    assert (hold.better, hold.worse, hold.gain) == (8, 0, pytest.approx(1.35))
    assert (dock.better, dock.worse, dock.gain) == (0, 8, pytest.approx(-1.35))
    assert (hold.p, hold.adjusted) == (pytest.approx(2.0 / 256.0), pytest.approx(4.0 / 256.0))  # Holm: times two
    assert (hold.verdict, dock.verdict) == ("significantly better", "significantly worse")
    assert replace(hold, gain=0.0).verdict == "changed"


def test_cells_that_changed_are_told_and_others_counted(tmp_path):
    before = [scored("a:f", "hold", seed, 5.0) for seed in range(3)] + [
        failed("a:f", "hold", 3),
        failed("a:f", "hold", 4),
    ]
    after = [
        scored("a:f", "hold", 0, 5.0), scored("a:f", "hold", 1, 9.0), failed("a:f", "hold", 2),
        scored("a:f", "hold", 3, 1.0), failed("a:f", "hold", 4), scored("a:f", "hold", 5, 1.0),
    ]  # fmt: skip
    result = both(tmp_path, before, after)
    assert (result.common, result.same) == (5, 2)
    assert [(change.cell.seed, change.kind) for change in result.changes] == [
        (2, "fails now"), (1, "worse"), (3, "works now"),
    ]  # fmt: skip
    assert result.tests[0].verdict == "too few pairs: 1 differ, at least 6 are needed"


def test_the_same_results_show_no_change(tmp_path):
    same = [scored("a:f", "hold", seed, 5.0) for seed in SEEDS]
    result = both(tmp_path, same, same)
    assert (result.same, result.changes, result.tests[0].verdict) == (8, (), "no score has changed")


def test_two_single_controllers_are_compared_whatever_their_names(tmp_path):
    before, after = [scored("old:f", "hold", 0, 5.0)], [scored("new:f", "hold", 0, 4.0)]
    result = both(tmp_path, before, after)
    assert (result.common, result.notes) == (1, ("new:f is compared with old:f",))
    assert both(tmp_path, before, [*after, scored("b:f", "hold", 0, 1.0)]).common == 0


def test_worlds_that_are_not_the_same_are_noted(tmp_path):
    names = ["cove", "bay", "lake", "pond", "open"]
    before = [replace(scored("a:f", world, 0, 5.0), world_sha256="1") for world in names]
    after = [replace(scored("a:f", world, 0, 4.0), world_sha256="2" if world != "open" else "1") for world in names]
    assert both(tmp_path, before, after).notes == ("worlds whose files have changed: cove, bay, lake and 1 more",)
    assert both(tmp_path, before, [replace(after[0], world_sha256="")]).notes == ()


def test_what_else_differs_is_noted(tmp_path):
    before, after = [scored("a:f", "hold", 0, 5.0)], [scored("a:f", "hold", 0, 4.0)]
    result = both(
        tmp_path, before, after, code="0.2.0 def", platform="there", physics=1, hashes={"a:f": "2"}, duration=9.0
    )
    assert result.notes == (
        "vrx_mj was 0.1.0 abc, now 0.2.0 def",
        "physics version was 2, now 1: equal runs differ",
        "the controller a:f has changed",
        "--duration was None, now 9.0",
        "platform was here, now there: equal runs may differ in their last bits",
    )


def test_p_values_are_adjusted_step_by_step():
    """Holm (1979): the smallest of three times three, the next times two, and none smaller than the one before."""
    tests = [PairedTest("a", "dock", "points", 9, 8, 1, 1.0, p) for p in (0.03, 0.01, None, 0.04)]
    assert [test.adjusted for test in _holm_adjustment(tests)] == [
        pytest.approx(0.06), pytest.approx(0.03), None, pytest.approx(0.06)
    ]  # fmt: skip


RESULTS = [
    # station-keeping, in m: a 2, b 4, c 3 with a failure; docks, in points: a 0, b 20, c 20
    scored("a:f", "hold", 0, 1.0), scored("a:f", "hold", 1, 3.0),
    scored("b:f", "hold", 0, 4.0), scored("b:f", "hold", 1, 4.0),
    scored("c:f", "hold", 0, 3.0), failed("c:f", "hold", 1),
    *(scored(who, "bay", seed, points, kind="dock") for who, points in (("a:f", 0.0), ("b:f", 20.0), ("c:f", 20.0))
      for seed in (0, 1)),
]  # fmt: skip


def test_ranks_are_summed_over_tasks_and_failures_come_last():
    lines = {line.controller: line for line in leaderboard(RESULTS, ("a:f", "b:f", "c:f"))}
    assert lines["a:f"].ranks == {"dock": 3, "stationkeeping": 1}
    assert lines["b:f"].ranks == {"dock": 1, "stationkeeping": 2}
    assert lines["c:f"].ranks == {"dock": 1, "stationkeeping": 3}
    assert [(line.controller, line.total) for line in lines.values()] == [("b:f", 3), ("a:f", 4), ("c:f", 4)]


def test_a_mean_says_its_spread_and_how_many_failed():
    mean = mean_of(RESULTS[:2])
    assert (mean.mean, mean.deviation, str(mean)) == (2.0, pytest.approx(math.sqrt(2.0)), "2 ± 1.4")
    half = mean_of(RESULTS[4:6])
    assert (half.failed, str(half), math.isnan(half.deviation)) == (1, "3", True)
    assert str(mean_of(RESULTS[5:6])) == "failed"


def test_a_controller_that_failed_everywhere_is_last():
    results = [scored("a:f", "hold", 0, 99.0), failed("b:f", "hold", 0)]
    assert [line.controller for line in leaderboard(results, ("b:f", "a:f"))] == ["a:f", "b:f"]


def test_a_task_that_never_started_has_no_score_and_no_rank():
    never = scored("b:f", "hold", 0, 0.0, phase="ready")
    assert (never.state, never.score, str(mean_of([never]))) == ("not started", None, "not started")
    results = [scored("a:f", "hold", 0, 99.0), never, scored("c:f", "hold", 0, 50.0, phase="running")]
    lines = {line.controller: line for line in leaderboard(results, ("a:f", "b:f", "c:f"))}
    assert {who: (line.ranks["stationkeeping"], line.total) for who, line in lines.items()} == {
        "c:f": (1, 1), "a:f": (2, 2), "b:f": (None, 3)
    }  # fmt: skip
    assert results[2].state == "cut"
    assert lines["c:f"].means["stationkeeping"].cut == 1


def test_one_of_two_trials_that_never_started_goes_behind_those_that_did():
    results = [scored("a:f", "hold", seed, 9.0) for seed in (0, 1)]
    results += [scored("b:f", "hold", 0, 1.0), scored("b:f", "hold", 1, 0.0, phase="initial")]
    assert [line.controller for line in leaderboard(results, ("b:f", "a:f"))] == ["a:f", "b:f"]


@pytest.mark.parametrize(("before", "after", "kind"), [
    ("finished", "ready", "no score now"), ("ready", "finished", "works now"), ("ready", "initial", None),
])  # fmt: skip
def test_a_score_that_comes_or_goes_is_no_gain(tmp_path, before, after, kind):
    then, now = (
        campaign_of(tmp_path, [scored("a:f", "hold", 0, 5.0, phase=how, state=how[0])]) for how in (before, after)
    )
    (change,) = compare(now, then).changes
    assert (change.gain, change.kind) == ((None, kind) if kind else (0.0, "different track, same score"))


def test_worlds_in_which_all_seeds_give_one_run_are_found():
    def sailed(world, seed, score, poses="1", who="a:f"):
        return replace(scored(who, world, seed, score), poses_sha256=poses)

    results = [
        *(sailed("calm", seed, 1.0, who=who) for seed in (0, 1, 2) for who in ("a:f", "b:f")),
        *(sailed("gusty", seed, 1.0 + seed) for seed in (0, 1)),
        *(sailed("points", seed, 1.0, poses=str(seed)) for seed in (0, 1)),
        sailed("once", 0, 1.0),
        *(failed("a:f", "sunk", seed) for seed in (0, 1)),
    ]
    assert seedless_worlds(results) == ["calm"]


def test_without_a_score_there_is_nothing_to_rank():
    (line,) = leaderboard([failed("a:f", "hold", 0)], ("a:f",))
    assert (line.ranks, line.total) == ({}, 0)


def test_tasks_of_one_type_may_have_names_of_their_own():
    results = [scored("a:f", "hold", 0, 1.0), scored("a:f", "stay", 0, 3.0)]
    assert results[1].task is not None
    results[1] = replace(results[1], task={**results[1].task, "name": "another"})
    (line,) = leaderboard(results, ("a:f",))
    assert line.means["stationkeeping"].scores == (1.0, 3.0)


def lost(controller, world, seed):
    return Result(Cell(controller, world, seed), "lost", error="the node ended")


def test_a_lost_trial_costs_no_rank():
    results = [
        scored("a:f", "hold", 0, 1.0),
        lost("a:f", "hold", 1),
        *(scored("b:f", "hold", seed, 2.0) for seed in (0, 1)),
    ]
    first, second = leaderboard(results, ("b:f", "a:f"))
    assert (first.controller, first.total, first.means["stationkeeping"].notes) == ("a:f", 1, "1 lost")
    assert second.total == 2


def test_the_interval_is_that_of_the_normal_distribution_for_many_scores_and_covers_as_often_as_it_says():
    """Of 400 samples of 40 exponential numbers about 95 % (percentile bootstrap: a little less) cover the mean, 1."""
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(400):
        low, high = Mean(tuple(rng.exponential(size=40)), 0).interval
        hits += low <= 1.0 <= high
    assert 0.90 * 400 <= hits <= 0.97 * 400
    many = tuple(rng.exponential(size=1000))
    resampled, limit = Mean(many, 0).interval, Mean((*many, 1.0), 0).interval
    assert resampled == pytest.approx(limit, abs=0.006)
    assert Mean((1.0,), 0).interval is None


def test_failures_that_differ_by_numbers_alone_are_one_class():
    results = [failed("a:f", "hold", seed, f"at t = {seed}.5 s it sank") for seed in range(9)]
    results += [failed("b:f", "hold", 0, "it flew"), lost("b:f", "hold", 1)]
    found = failure_classes([*results, scored("a:f", "hold", 10, 1.0)])
    kinds = [(len(each), each[0].state, {result.cell.controller for result in each}) for each in found]
    assert kinds == [(9, "failed", {"a:f"}), (1, "failed", {"b:f"}), (1, "lost", {"b:f"})]


def test_the_worst_of_every_world_and_the_median_are_worth_seeing():
    """Worlds with scores of very different size count alike; recorded trials go before others."""
    results = [scored("a:f", "hold", seed, float(seed)) for seed in range(41)]
    results += [scored("a:f", "bay", seed, 1e6 * seed, kind="dock") for seed in range(41)]
    found = [(why, result.cell.world, result.cell.seed) for why, result in remarkable_trials(results)]
    assert len(found) == 10
    assert {*found[:4]} == {("worst", "hold", 40), ("worst", "hold", 39), ("worst", "bay", 0), ("worst", "bay", 1)}
    assert {("median", "hold", 20), ("median", "bay", 20)} <= {*found}
    results[7] = replace(results[7], recording="run.rrd")
    assert [result.cell.seed for _, result in remarkable_trials(results)] == [7]


def test_a_dependence_has_a_mean_for_each_part_of_the_range():
    quantity = Quantity("wind.mean", 0.0, 10.0)
    results = [replace(scored("a:f", "hold", k, 3.0 * x), parameters={"wind.mean": x})
               for k, x in enumerate((0.5, 1.5, 1.6, 10.0))]  # fmt: skip
    found = dependence([*results, scored("a:f", "hold", 9, 1.0)], quantity, "a:f")
    assert found.centers == pytest.approx((0.5, 1.5, 9.5))
    assert [mean.mean for mean in found.means] == pytest.approx([1.5, 4.65, 30.0])
    assert found.correlation == pytest.approx(1.0)
    assert math.isnan(dependence([], quantity, "a:f").correlation)


def test_trials_that_failed_in_both_campaigns_are_alike(tmp_path):
    """One that was interrupted has a last state, too."""
    before, after = ([replace(failed("a:f", "w", 0), state_sha256=state)] for state in ("1", "2"))
    comparison = both(tmp_path, before, after)
    assert (comparison.common, comparison.same, comparison.changes) == (1, 1, ())
