import math
from dataclasses import replace

import pytest

from campaigns import failed, scored
from vrx_mj.campaign.scores import leaderboard, mean_of

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
    assert (mean.mean, mean.deviation, str(mean)) == (2.0, pytest.approx(math.sqrt(2.0)), "2.00 ± 1.41")
    half = mean_of(RESULTS[4:6])
    assert (half.failed, str(half), math.isnan(half.deviation)) == (1, "3.00", True)
    assert str(mean_of(RESULTS[5:6])) == "failed"


def test_a_controller_that_failed_everywhere_is_last():
    results = [scored("a:f", "hold", 0, 99.0), failed("b:f", "hold", 0)]
    assert [line.controller for line in leaderboard(results, ("b:f", "a:f"))] == ["a:f", "b:f"]


def test_without_a_score_there_is_nothing_to_rank():
    (line,) = leaderboard([failed("a:f", "hold", 0)], ("a:f",))
    assert (line.ranks, line.total) == ({}, 0)


def test_tasks_of_one_type_may_have_names_of_their_own():
    results = [scored("a:f", "hold", 0, 1.0), scored("a:f", "stay", 0, 3.0)]
    assert results[1].task is not None
    results[1] = replace(results[1], task={**results[1].task, "name": "another"})
    (line,) = leaderboard(results, ("a:f",))
    assert line.means["stationkeeping"].scores == (1.0, 3.0)
