"""Arrows as lines, which look alike in all viewers."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import vrx_mj
from vrx_mj.recording.timeline import ARROW, arrow_strips


@given(vector=arrays(np.float64, (1, 3), elements=st.floats(-9.0, 9.0).map(lambda x: round(x, 3))))
def test_an_arrow_is_its_vector_with_a_head_of_its_length_on_both_sides(vector):
    (begin, tip, left, again, right), length = arrow_strips([(1.0, 2.0, 3.0)], vector)[0], np.linalg.norm(vector)
    assert begin == pytest.approx([1.0, 2.0, 3.0])
    assert tip - begin == pytest.approx(vector[0])
    assert np.array_equal(tip, again)
    for barb in (left, right):
        assert np.linalg.norm(tip - barb) == pytest.approx(length * np.hypot(0.24, 0.2))
    assert np.linalg.norm(left - right) == pytest.approx(2.0 * ARROW[2, 1] * length)


def test_the_head_of_a_level_arrow_is_level():
    assert arrow_strips(np.zeros((1, 3)), [(3.0, 4.0, 0.0)])[0, :, 2] == pytest.approx(np.zeros(5))


def test_no_arrow_is_a_viewers_own():
    """Their tips are black in rerun's page."""
    folder = Path(vrx_mj.__file__).parent / "recording"
    assert [path for path in folder.rglob("*.py") if "rr.Arrows" in path.read_text(encoding="utf-8")] == []
