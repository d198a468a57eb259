"""What boats see of each other: who, from where, when, and how well."""

import math

import gymnasium
import numpy as np
import pytest

from vrx_mj.physics.noise import normal
from vrx_mj.rl.neighbours import Neighbours, NeighbourView, normals
from vrx_mj.rl.options import chance, neighbour_view, team_share
from vrx_mj.rl.problem import Team

SHARP = (0.0, 0.0, 0.0)
ALL = np.ones(1, bool)
WHAT = "of places [m], velocities [m/s] and headings [rad]"


def team(spots, present=None):
    """One world; a spot is x, y, heading, east and north velocity, and the own surge and sway follow."""
    x, y, yaw, east, north = np.array(spots, float).T[:, None]
    here = np.ones_like(x, dtype=bool) if present is None else np.array([present])
    motion = np.zeros((*x.shape, 7))
    motion[..., 0], motion[..., 4], motion[..., 5] = 1.0, east, north  # in axes that are the world's
    return Team(x, y, yaw, motion, np.zeros((*x.shape, 9)), here)


def looking(view, first, key=7):
    neighbours = Neighbours(1, first.x.shape[1], view)
    neighbours.begin(np.arange(1), np.array([key], np.uint64), first)
    return neighbours


def seen(neighbours, now):
    return neighbours.observe(now).reshape(*now.x.shape, -1, 7)[0]


def test_normal_numbers_are_those_of_the_kernel():
    keys = np.array([[3], [2**64 - 5]], np.uint64)
    counters = np.array([[0, 1, 2**40, 2**62]], np.uint64)
    expected = [[normal(key, counter) for counter in counters[0]] for key in keys[:, 0]]
    np.testing.assert_allclose(normals(keys, counters), expected, rtol=1e-12)  # numpy's log and cos are not libm's


def test_a_neighbour_is_seen_in_the_observers_axes():
    """We head north at 1 m/s; the other, 10 m north-west, heads west at 2 m/s."""
    now = team([(0, 0, math.pi / 2, 0, 1), (-10, 10, math.pi, -2, 0)])
    ours, theirs = seen(looking(NeighbourView(1, 50.0, SHARP, 0), now), now)
    np.testing.assert_allclose(ours, [[1, 10, 10, 1, 0, -1, 2]], atol=1e-12)
    np.testing.assert_allclose(theirs, [[1, -10, 10, -1, 0, -2, -1]], atol=1e-12)


def test_the_nearest_come_first_and_zeros_last():
    now = team([(0, 0, 0, 0, 0), (30, 0, 0, 0, 0), (20, 0, 0, 0, 0), (51, 0, 0, 0, 0)])
    found = seen(looking(NeighbourView(4, 50.0, SHARP, 0), now), now)
    np.testing.assert_array_equal(found[0, :, 0], [1, 1, 0, 0])
    np.testing.assert_array_equal(found[0, :, 1], [20, 30, 0, 0])
    np.testing.assert_array_equal(found[3, :, 1], [-21, -31, 0, 0])
    assert not found[0, 2:].any()


def test_who_is_not_there_is_not_seen():
    now = team([(0, 0, 0, 0, 0), (5, 0, 0, 0, 0), (9, 0, 0, 0, 0)], [True, False, True])
    np.testing.assert_array_equal(seen(looking(NeighbourView(1, 50.0, SHARP, 0), now), now)[0, :, 1], [9])


def test_reports_are_as_old_as_the_delay():
    """The other goes 1 m a step and joins after the first; we stand still, and would see where we are now."""
    at = [team([(-0.5 * k, 0, 0, 0, 0), (10 + k, 0, 0, 0, 0)], [True, k > 0]) for k in range(9)]
    neighbours = looking(NeighbourView(1, 50.0, SHARP, 3), at[0])
    shown = []
    for now in at[1:]:
        neighbours.note(ALL, now)
        shown.append(seen(neighbours, now)[0, 0, :2].tolist())
    assert shown == [[0, 0]] * 3 + [[1, 10 + k - 3 + 0.5 * k] for k in range(4, 9)]


def test_rows_that_stand_keep_their_memory():
    first, later = team([(0, 0, 0, 0, 0), (10, 0, 0, 0, 0)]), team([(0, 0, 0, 0, 0), (20, 0, 0, 0, 0)])
    neighbours = looking(NeighbourView(1, 50.0, SHARP, 0), first)
    neighbours.note(~ALL, later)
    assert seen(neighbours, later)[0, 0, 1] == 10


def test_noise_is_as_large_as_it_is_said_to_be_and_new_in_every_step():
    now = team([(0, 0, 0, 0, 0), (10, 0, 0.5, 0, 0)])
    neighbours = looking(NeighbourView(1, 50.0, (0.5, 0.2, 0.1), 0), now)
    rows = []
    for _ in range(3000):
        neighbours.note(ALL, now)
        rows.append(seen(neighbours, now)[0, 0])
    _, ahead, port, sine, cosine, faster, aside = np.array(rows).T
    turn = np.arctan2(sine, cosine)
    within = 5 / math.sqrt(2 * 3000)  # five standard errors of a standard deviation
    for values, mean, spread in (
        (ahead, 10, 0.5), (port, 0, 0.5), (faster, 0, 0.2), (aside, 0, 0.2), (turn, 0.5, 0.1)
    ):  # fmt: skip
        assert values.std() == pytest.approx(spread, rel=within)
        assert values.mean() == pytest.approx(mean, abs=5 * spread / math.sqrt(3000))
    together = np.corrcoef([ahead, port, faster, aside, turn])
    assert np.abs(together - np.eye(5)).max() < 5 / math.sqrt(3000)
    assert abs(np.corrcoef(ahead[1:], ahead[:-1])[0, 1]) < 5 / math.sqrt(3000)


def test_noise_hangs_on_the_key_and_the_pair_alone():
    pair = [(0, 0, 0, 0, 0), (10, 0, 0.5, 0, 0), (-12, 0, 0.5, 0, 0)]
    both, alone = team(pair), team(pair, [True, True, False])
    view = NeighbourView(1, 50.0, (0.5, 0.2, 0.1), 0)
    np.testing.assert_array_equal(seen(looking(view, both), both)[:2], seen(looking(view, alone), alone)[:2])
    assert (seen(looking(view, both), both)[0, 0, 1:] != seen(looking(view, both, key=8), both)[0, 0, 1:]).all()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((-1, 50, SHARP, 0), "invalid neighbours -1: a whole number of 0 or more is needed"),
        ((1.5, 50, SHARP, 0), "invalid neighbours 1.5: a whole number of 0 or more is needed"),
        ((1, 0, SHARP, 0), "invalid range 0: a number of metres above 0 is needed"),
        ((1, math.nan, SHARP, 0), "invalid range nan: a number of metres above 0 is needed"),
        (
            (1, 50, (1, 2), 0),
            f"invalid noise (1, 2): three numbers of 0 or more are needed, {WHAT}",
        ),
        ((1, 50, SHARP, 0.25), "invalid delay 0.25: a multiple of 0.1 s, up to 3600 s, is needed"),
        ((1, 50, SHARP, -1), "invalid delay -1: a multiple of 0.1 s, up to 3600 s, is needed"),
    ],
)
def test_views_that_are_invalid(given, message):
    with pytest.raises(gymnasium.error.Error) as caught:
        neighbour_view(*given)
    assert str(caught.value) == message


def test_shares():
    assert [team_share(reward) for reward in ("team", "individual", 0.25)] == [1, 0, 0.25]
    with pytest.raises(gymnasium.error.Error) as caught:
        team_share("both")
    text = "invalid reward 'both': 'team', 'individual' or the team's share, from 0 to 1, is needed"
    assert str(caught.value) == text
    with pytest.raises(gymnasium.error.Error) as caught:
        chance("joining", 1.5)
    assert str(caught.value) == "invalid joining 1.5: a share from 0 to 1 is needed"
