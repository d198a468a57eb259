"""Chunks of numbers, against rerun's own way to them."""

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.recording.timeline import numbers, times

SECONDS = np.array([0.0, 0.5, 2.0])
RANDOM = np.random.default_rng(1)


def values(*shape: int) -> np.ndarray:
    return RANDOM.normal(size=shape).astype(np.float32)


@pytest.mark.parametrize(
    ("kind", "counts", "fields"),
    [
        (rr.Transform3D, [1, 1, 1], {"translation": values(3, 3), "quaternion": values(3, 4)}),
        (rr.Scalars, [2, 2, 2], {"scalars": RANDOM.normal(size=6)}),
        (rr.Arrows3D, [2, 0, 3], {"vectors": values(5, 3), "origins": values(5, 3)}),
        (rr.Mesh3D, [4, 1, 2], {"vertex_positions": values(7, 3), "vertex_colors": np.arange(7, dtype=np.uint32)}),
        (rr.LineStrips3D, [1, 1, 1], {"strips": values(3, 2, 3)}),
    ],
)
def test_a_chunk_of_numbers_is_the_one_that_rerun_makes_of_them(kind, counts, fields):
    ours = numbers("/there", SECONDS, kind, counts, **fields).to_record_batch()
    theirs = Chunk.from_columns("/there", [times(SECONDS)], kind.columns(**fields).partition(counts)).to_record_batch()
    assert ours.schema.remove_metadata() == theirs.schema.remove_metadata()
    for name in ours.schema.names[1:]:  # the first are numbers of rows
        assert ours[name] == theirs[name]
        assert ours.schema.field(name).metadata == theirs.schema.field(name).metadata
