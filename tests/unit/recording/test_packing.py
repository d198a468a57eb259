import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

import recorded_run
from vrx_mj.recording.packing import HEADER, ORDER, pack_rows, plain_rows, unpack_rows

ANY_ROWS = npst.arrays(np.uint64, npst.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9))


@given(bits=ANY_ROWS)
def test_every_bit_pattern_comes_back(bits):
    for packed in (pack_rows, plain_rows):
        assert unpack_rows(packed(bits.view(np.float64))).tobytes() == bits.tobytes()


def formerly_packed(rows):
    """Rows as the former version packed them: third differences of bit patterns, by byte planes."""
    bits = rows.T.astype("<f8").view("<i8")
    changes = np.where(bits < 0, bits ^ 0x7FFF_FFFF_FFFF_FFFF, bits)
    for order in range(3):
        changes[:, order + 1 :] = np.diff(changes[:, order:])
    folded = (changes << 1) ^ (changes >> 63)
    planes = folded.reshape(-1, 1).view(np.uint8).T
    return HEADER.pack(*rows.shape) + planes.tobytes()


@given(bits=ANY_ROWS)
def test_rows_that_the_former_version_packed_come_back(bits):
    assert unpack_rows(formerly_packed(bits.view(np.float64))).tobytes() == bits.tobytes()


@given(count=st.integers(1, 30), scale=st.floats(1e-12, 1e12))
def test_smooth_rows_come_back(count, scale):
    time = np.arange(count)[:, None] / 20.0
    rows = scale * np.sin(time * [1.0, 2.0, 3.0] + [0.0, 1.0, 2.0])
    assert unpack_rows(pack_rows(rows)).tobytes() == rows.tobytes()


def test_rows_are_not_changed_by_packing():
    rows = np.array([[1.0, -2.0], [3.0, 4.0]])
    pack_rows(rows)
    np.testing.assert_array_equal(rows, [[1.0, -2.0], [3.0, 4.0]])


def test_a_polynomial_is_predicted():
    """By as many numbers as it has coefficients: all planes of what comes after them are empty."""
    time = np.arange(50.0)[:, None]
    planes = np.frombuffer(pack_rows(time**ORDER - 3.0 * time**2), np.uint8, offset=HEADER.size).reshape(8, -1)
    assert not planes[:, ORDER + 1 :].any()


def test_rows_of_a_run_take_less_than_three_fifths_of_their_space():
    """With the compression of the file, LZ4; raw rows do not compress at all."""
    pa = pytest.importorskip("pyarrow")

    rows = np.concatenate(list(recorded_run.blocks(20.0)))
    packed = pa.compress(pack_rows(rows), codec="lz4", asbytes=True)
    assert len(packed) < 0.6 * rows.nbytes
