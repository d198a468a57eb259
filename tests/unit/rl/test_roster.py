"""Who is in the water: boats that come late, go early, and where they are put."""

from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.rl.environment import MIN_JOINING_DISTANCE, Roster

BOATS, MOST = 4, 40


class Batch:
    """Of two rows; notes where boats are put."""

    n, boats = 2, tuple("abcd")

    def __init__(self):
        self.put = {}

    def launch(self, boat, rows, spots):
        """As `LostBoats.launch`."""
        for row, spot in zip(rows, spots, strict=True):
            self.put[int(row), self.boats[boat]] = tuple(spot.tolist())


class Problem:
    """Boats start 20 m apart on a line, and enter at the places that a test gives."""

    anchor, placed, n, size = 1, True, 2, BOATS

    def __init__(self, *entrances):
        self.entrances = iter(entrances)

    def start(self, row, random):
        return [(20.0 * boat, float(row), 0.5, 1.0) for boat in range(BOATS)]

    def entrance(self, row, boat, random):
        return next(self.entrances)


def team():
    return SimpleNamespace(x=np.tile(20.0 * np.arange(BOATS), (2, 1)), y=np.zeros((2, BOATS)))


def begun(problem=None, *, joining=0.0, leaving=0.0, seed=1):
    batch = Batch()
    problem, random = problem or Problem(), [np.random.default_rng(seed + row) for row in range(2)]
    roster = Roster(problem, batch, moving=(joining, leaving), most=MOST)
    roster.begin(np.arange(2), random, [problem.start(row, own) for row, own in enumerate(random)])
    return roster, batch


def test_who_is_there_from_the_start_is_where_the_problem_says():
    roster, batch = begun()
    assert roster.present.all()
    assert batch.put[1, "c"] == pytest.approx((40.0, 1.0, 0.5, 1.0))
    assert not roster.due(np.full(2, MOST)).any()


def test_the_anchor_is_there_all_the_time():
    roster, _ = begun(joining=1.0, leaving=1.0)
    assert roster.present.tolist() == [[False, True, False, False]] * 2
    due = roster.due(np.full(2, MOST))
    assert not due[:, 1].any()


def test_who_is_not_there_waits_far_away():
    roster, batch = begun(joining=1.0)
    x, y, *_, surge = batch.put[0, "d"]
    assert min(x, y) >= 1e4
    assert surge == 0.0
    gaps = [abs(batch.put[0, one][0] - batch.put[0, other][0]) for one, other in ("ac", "cd", "ad")]
    assert min(gaps) >= 200.0
    assert roster.present.sum() == 2


def late(joins, *entrances):
    """A roster whose last boat comes at a step, to one of the places."""
    roster, batch = begun(Problem(*entrances))
    roster.present[0, 3], roster._joins[0, 3] = False, joins
    return roster, batch


def join(roster, step, going=(True, True)):
    generators = [np.random.default_rng(row) for row in range(2)]
    return roster.join(np.full(2, step), np.array(going), team(), generators)[0, 3]


def test_a_boat_joins_when_its_time_has_come_and_its_world_goes_on():
    spot = (60.0, 30.0, 1.0, 2.0)
    roster, batch = late(5, spot)
    assert not join(roster, 4)
    assert not join(roster, 5, (False, True))
    assert join(roster, 5)
    assert roster.present[0, 3]
    assert batch.put[0, "d"] == pytest.approx((60.0, 30.0, 1.0, 2.0))


def test_a_boat_joins_only_where_no_other_is_near():
    """The first three places are next to a boat each, though far from all others."""
    near = [(20.0 * boat + MIN_JOINING_DISTANCE - 0.1, 0.0, 0.0, 0.0) for boat in range(3)]
    roster, batch = late(1, *near, (20.0, MIN_JOINING_DISTANCE + 0.1, 0.0, 0.0))
    assert join(roster, 1)
    assert batch.put[0, "d"][:2] == pytest.approx((20.0, MIN_JOINING_DISTANCE + 0.1))


def test_a_boat_that_finds_no_room_waits():
    roster, _ = late(1, *[(0.0, 1.0, 0.0, 0.0)] * 20, (60.0, 40.0, 0.0, 0.0))
    assert not join(roster, 1)
    assert not roster.present[0, 3]
    assert join(roster, 2)


def test_who_is_dismissed_is_gone_and_does_not_come_again():
    roster, batch = begun()
    gone = np.zeros((2, BOATS), bool)
    gone[0, 2] = True
    roster.dismiss(gone)
    assert roster.present.tolist() == [[True, True, False, True], [True] * 4]
    assert batch.put[0, "c"][0] >= 1e4
    assert not join(roster, MOST)
