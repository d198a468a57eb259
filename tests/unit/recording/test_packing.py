import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

import recorded_run
from vrx_mj.recording.packing import pack_rows, unpack_rows

ANY_ROWS = npst.arrays(np.uint64, npst.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9))


@given(bits=ANY_ROWS)
def test_every_bit_pattern_comes_back(bits):
    assert unpack_rows(pack_rows(bits.view(np.float64))).tobytes() == bits.tobytes()


@given(count=st.integers(1, 30), scale=st.floats(1e-12, 1e12))
def test_smooth_rows_come_back(count, scale):
    time = np.arange(count)[:, None] / 20.0
    rows = scale * np.sin(time * [1.0, 2.0, 3.0] + [0.0, 1.0, 2.0])
    assert unpack_rows(pack_rows(rows)).tobytes() == rows.tobytes()


def test_rows_are_not_changed_by_packing():
    rows = np.array([[1.0, -2.0], [3.0, 4.0]])
    pack_rows(rows)
    np.testing.assert_array_equal(rows, [[1.0, -2.0], [3.0, 4.0]])


def test_rows_of_a_run_take_less_than_three_quarters_of_their_space():
    """With the compression of the file, LZ4; raw rows do not compress at all."""
    import pyarrow as pa

    rows = np.concatenate(list(recorded_run.blocks(20.0)))
    packed = pa.compress(pack_rows(rows), codec="lz4", asbytes=True)
    assert len(packed) < 0.75 * rows.nbytes
