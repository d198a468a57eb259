"""The generators of the rows: which seeds they have, and which go on."""

import gymnasium
import numpy as np
import pytest

from vrx_mj.rl.options import Generators

ALL = np.arange(3)


def drawn(generators, rows=ALL):
    return [float(own.random()) for own in generators.of(rows)]


def first(seed):
    return float(gymnasium.utils.seeding.np_random(seed)[0].random())


def seeded(seed, rows=ALL):
    generators = Generators(3)
    generators.seed(rows, seed)
    return generators


def test_one_seed_is_that_of_row_0_and_the_next_ones_are_the_others():
    assert drawn(seeded(7)) == [first(7), first(8), first(9)]
    assert drawn(seeded([4, 4, 5])) == [first(4), first(4), first(5)]


def test_rows_without_a_seed_go_on():
    generators = seeded(7)
    before = drawn(generators)
    generators.seed(ALL, [None, 8, None])
    after = drawn(generators)
    assert after[1] == before[1]
    assert after[0] != before[0]
    generators.seed(ALL, None)
    assert drawn(generators)[1] != before[1]


def test_only_the_rows_that_are_reset_take_their_seeds():
    generators = seeded(7)
    before = drawn(generators)
    generators.seed(np.array([2]), 7)
    after = drawn(generators)
    assert after[2] == before[2]
    assert after[0] != before[0]


@pytest.mark.parametrize("seed", [[1, 2], [1, 2, -3], 1.5, [[1, 2, 3]]])
def test_seeds_that_are_none_are_refused(seed):
    with pytest.raises(gymnasium.error.Error):
        seeded(seed)
