"""What a batch is given: which rows, and numbers for them."""

import numpy as np
import pytest

from vrx_mj.errors import CommandError
from vrx_mj.runtime.rows import row_seeds, row_values, row_vectors, varied_values, which_rows


@pytest.mark.parametrize(
    ("rows", "expected"),
    [(None, [0, 1, 2, 3]), ([2], [2]), ([3, 0], [3, 0]), ([True, False, True, False], [0, 2]), ([], [])],
)
def test_rows_are_numbers_or_a_mask(rows, expected):
    assert which_rows(4, rows).tolist() == expected


@pytest.mark.parametrize("rows", [[4], [0, 7], [-1], [0.0], [True, False], [[0]], 2])
def test_rows_that_are_not_there_are_refused(rows):
    with pytest.raises(CommandError):
        which_rows(4, rows)


def test_one_seed_is_row_0s_whichever_rows_take_theirs():
    assert row_seeds(np.array([0, 1, 2]), 7).tolist() == [7, 8, 9]
    assert row_seeds(np.array([3, 1]), 7).tolist() == [10, 8]
    assert row_seeds(np.array([3, 1]), [5, 5]).tolist() == [5, 5]


@pytest.mark.parametrize("seed", [[1], [1, 2, 3], [0.5, 1.5], True, "1"])
def test_seeds_that_are_none_are_refused(seed):
    with pytest.raises(CommandError):
        row_seeds(np.array([3, 1]), seed)


def test_values_are_one_for_all_or_one_for_each():
    assert row_values("mass", 2, 3, 0.0).tolist() == [2.0] * 3
    assert row_values("mass", [1, 2, 3], 3, 0.0).tolist() == [1.0, 2.0, 3.0]
    assert row_vectors("pose", range(6), 2).tolist() == [[0, 1, 2, 3, 4, 5]] * 2


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf, [1, 2], [[1, 2, 3]], "x"])
def test_values_that_cannot_be_are_refused(value):
    with pytest.raises(CommandError):
        row_values("mass", value, 3, 0.0)


def test_what_varies_may_be_as_small_as_its_kind_allows():
    """Speeds and directions have signs, strengths may be 0, masses and periods only near to it."""
    signed = {"wind_speed": -20.0, "wind_direction": -400.0, "wave_direction": [-1.0, 1.0]}
    others = {"mass": 1e-9, "wave_period": [1e-9, 5.0], "waves": 0.0, "thrust": None, "wave_phases": [1.0], "rows": 3}
    found = varied_values(2, signed | others)
    assert {name: values.tolist() for name, values in found.items()} == {
        "mass": [1e-9, 1e-9],
        "wave_period": [1e-9, 5.0],
        "waves": [0.0, 0.0],
        "wind_speed": [-20.0, -20.0],
        "wind_direction": [-400.0, -400.0],
        "wave_direction": [-1.0, 1.0],
    }
    for name in ("mass", "wave_period"):
        with pytest.raises(CommandError, match="above 0"):
            varied_values(2, {name: 0.0})


@pytest.mark.parametrize("value", [[0] * 5, [[0] * 6] * 3, [0, 0, 0, 0, 0, 1e7], [np.nan] * 6])
def test_vectors_that_cannot_be_are_refused(value):
    with pytest.raises(CommandError):
        row_vectors("pose", value, 2)


@pytest.mark.parametrize(("value", "most"), [(1e6, 1e6), (-7.0, 7.0)])
def test_values_may_be_as_large_as_the_most_and_no_larger(value, most):
    assert row_values("mass", value, 2, -np.inf, most).tolist() == [value] * 2
    with pytest.raises(CommandError) as refused:
        row_values("mass", [0.0, np.nextafter(value, 2.0 * value)], 2, -np.inf, most)
    assert str(refused.value).endswith(f": at most {most:g}")


@pytest.mark.parametrize(
    ("least", "needed"),
    [(-1.0, "one finite number, or 2"), (0.0, "one finite number of 0 or more, or 2"), (0.5, "finite number above 0")],
)
def test_what_is_needed_is_said(least, needed):
    with pytest.raises(CommandError, match=rf"^invalid mass nan: .*{needed}"):
        row_values("mass", np.nan, 2, least)


def test_lists_of_several_lengths_are_no_rows():
    with pytest.raises(CommandError, match=r"a mask of 4 booleans, or numbers from 0 to 3, is needed$"):
        which_rows(4, [[1], [2, 3]])
