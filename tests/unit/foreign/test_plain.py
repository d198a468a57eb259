"""Plain data that goes from one process to another, and back."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from vrx_mj.foreign.plain import pack, unpack


@dataclass
class Pair:
    """Two values."""

    one: object
    other: object


@pytest.mark.parametrize(
    ("value", "found"),
    [
        (None, None),
        ([1, 2.5, "three", True], [1, 2.5, "three", True]),
        ({"a": (1, 2)}, {"a": [1, 2]}),
        ({7}, [7]),
        (Path("a/b"), "a/b"),
        (np.float64(0.5), 0.5),
        (b"abc", b"abc"),
        ([bytearray(b"one"), b"", memoryview(b"three")], [b"one", b"", b"three"]),
        (Pair(b"x", Pair(1, b"yz")), {"one": b"x", "other": {"one": 1, "other": b"yz"}}),
    ],
)
def test_what_is_packed_is_unpacked(value, found):
    assert unpack(pack(value)) == found


def test_arrays_keep_their_type_and_shape_among_other_blobs():
    sent = [b"before", np.arange(6, dtype=np.int16).reshape(2, 3), np.zeros((0, 3)), b"after", np.array([[1.5]])]
    back = unpack(pack(sent))
    assert (back[0], back[3]) == (b"before", b"after")
    for place in (1, 2, 4):
        assert back[place].dtype == sent[place].dtype
        np.testing.assert_array_equal(back[place], sent[place])
        assert back[place].flags.writeable


def test_what_is_not_plain_is_refused():
    with pytest.raises(TypeError, match="a value of type complex is not plain data"):
        pack(1j)
    with pytest.raises(ValueError, match=r"an array of type .O"):
        unpack(pack(np.array([None, 1], dtype=object)))


@pytest.mark.parametrize("kept", [0, 3, 9, 20])
def test_a_block_that_is_cut_is_damaged(kept):
    with pytest.raises(ValueError, match=r"damaged|line 1 column"):
        unpack(pack({"a": b"abc", "b": [1, 2]})[:kept])
