"""Arrows as lines, which look alike in all viewers, and chunks of numbers, against rerun's own way to them."""

from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rerun.chunk import Chunk

import vrx_mj
from vrx_mj.recording.timeline import ARROW, arrow_strips, numbers, times

SECONDS = np.array([0.0, 0.5, 2.0])
RANDOM = np.random.default_rng(1)


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


def values(*shape: int) -> np.ndarray:
    return RANDOM.normal(size=shape).astype(np.float32)


@pytest.mark.parametrize(
    ("kind", "counts", "fields"),
    [
        (rr.Transform3D, [1, 1, 1], {"translation": values(3, 3), "quaternion": values(3, 4)}),
        (rr.Scalars, [2, 2, 2], {"scalars": RANDOM.normal(size=6)}),
        (rr.Mesh3D, [4, 1, 2], {"vertex_positions": values(7, 3), "vertex_colors": np.arange(7, dtype=np.uint32)}),
        (rr.LineStrips3D, [1, 1, 1], {"strips": values(3, 2, 3)}),
        (rr.LineStrips3D, [2, 0, 3], {"strips": values(5, 5, 3)}),
    ],
)
def test_a_chunk_of_numbers_is_the_one_that_rerun_makes_of_them(kind, counts, fields):
    ours = numbers("/there", SECONDS, kind, counts, **fields).to_record_batch()
    theirs = Chunk.from_columns("/there", [times(SECONDS)], kind.columns(**fields).partition(counts)).to_record_batch()
    assert ours.schema.remove_metadata() == theirs.schema.remove_metadata()
    for name in ours.schema.names[1:]:  # the first are numbers of rows
        assert ours[name] == theirs[name]
        assert ours.schema.field(name).metadata == theirs.schema.field(name).metadata
