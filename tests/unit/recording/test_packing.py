import math
import struct

import mujoco
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

import recorded_run
from fingerprints import check
from vrx_mj.errors import RecordError
from vrx_mj.recording.boat_sets import numbered_blocks
from vrx_mj.recording.packing import (
    HEAD,
    HEADER,
    WIDTH_BITS,
    pack_rows,
    plain_rows,
    unpack_rows,
)
from vrx_mj.recording.parts import Part

ANY_ROWS = npst.arrays(np.uint64, npst.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9))
BODY = ((1, 8),)
"""Columns of a body's pose and velocity, after the time."""
STEP = 0.01


@given(bits=ANY_ROWS)
def test_every_bit_pattern_comes_back(bits):
    for packed in (pack_rows, plain_rows):
        assert unpack_rows(packed(bits.view(np.float64))).tobytes() == bits.tobytes()


@given(bits=npst.arrays(np.uint64, st.tuples(st.integers(1, 16), st.just(14))), time=st.booleans())
@example(bits=np.array([[np.inf] * 14, [np.inf] + [0.0] * 13]).view(np.uint64), time=False)
def test_every_bit_pattern_of_a_body_comes_back(bits, time):
    if time:
        bits[:, 0] = (np.arange(len(bits)) / 20.0).view(np.uint64)
    with np.errstate(all="ignore"):
        packed = pack_rows(bits.view(np.float64), BODY, STEP)
    assert unpack_rows(packed).tobytes() == bits.tobytes()


@given(count=st.integers(1, 30), scale=st.floats(1e-12, 1e12))
def test_smooth_rows_come_back(count, scale):
    time = np.arange(count)[:, None] / 20.0
    rows = scale * np.sin(time * [1.0, 2.0, 3.0] + [0.0, 1.0, 2.0])
    assert unpack_rows(pack_rows(rows)).tobytes() == rows.tobytes()


def test_rows_are_not_changed_by_packing():
    rows = np.array([[1.0, -2.0], [3.0, 4.0]])
    pack_rows(rows)
    np.testing.assert_array_equal(rows, [[1.0, -2.0], [3.0, 4.0]])


def test_a_polynomial_takes_no_space_a_row():
    """It is predicted by as many numbers as it has coefficients."""
    time = np.arange(1000.0)[:, None]
    short, long = (len(pack_rows(time[:n] ** 4 - 3.0 * time[:n] ** 2)) for n in (200, 1000))
    assert long - short < 800 / 8


def test_columns_that_do_not_change_take_no_space_a_row():
    rows = np.random.default_rng(1).random((500, 1)) * np.ones(20)
    rows[:, 1:] = rows[0, 1:]
    assert len(pack_rows(rows)) - len(pack_rows(rows[:, :1])) == 19 * 8 + 2


def sailed(steps, every):
    """Rows of a body that is pushed at random, moved by MuJoCo's semi-implicit Euler."""
    moment = np.arange(steps)[:, None] * STEP
    pushes = np.random.default_rng(0).normal(0.0, 1e-3, (steps, 6))
    sine = np.vectorize(math.sin)  # NumPy's has other last bits on some processors
    velocity = sine(moment * [0.3, 0.4, 0.5, 0.6, 0.2, 0.1] + np.arange(6)) + np.cumsum(pushes, axis=0)
    place = 500.0 + np.cumsum(STEP * velocity[:, :3], axis=0)
    q = np.tile([0.8, 0.0, 0.0, 0.6], (steps, 1))
    for i in range(1, steps):
        q[i] = q[i - 1]
        mujoco.mju_quatIntegrate(q[i], velocity[i, 3:], STEP)
    return np.hstack([moment, place, q, velocity])[::every]


def test_poses_of_each_step_follow_from_velocities():
    """Without them, numbers of poses take 43 bits."""
    rows = sailed(1000, 1)
    packed = pack_rows(rows, BODY, STEP)
    assert unpack_rows(packed).tobytes() == rows.tobytes()
    assert 8 * (len(packed) - len(pack_rows(rows[:, [0, *range(8, 14)]]))) / rows[:, 1:8].size < 20.0


def test_poses_between_which_there_are_steps_take_fewer_bits_with_velocities():
    rows = sailed(5000, 5)
    packed = pack_rows(rows, BODY, STEP)
    assert unpack_rows(packed).tobytes() == rows.tobytes()
    assert len(packed) < 0.95 * len(pack_rows(rows))


def test_predictions_are_the_same_everywhere(monkeypatch):
    """To the last bit, or what one machine packs another could not unpack."""
    planes = []

    class Codec:
        def __init__(self, name, **_):
            assert name == "zstd"

        def compress(self, data):
            planes.append(data)
            return b""

    monkeypatch.setattr("pyarrow.Codec", Codec)
    run = np.concatenate(list(recorded_run.blocks(2.0)))
    several = [(first, len(run[0]) - 36 + 6 * body) for body, first in enumerate(range(14, 14 + 42, 7))]
    wild = np.random.default_rng(2).normal(0.0, 1.0, (20, 14)) * [10.0**power for power in range(-300, 300, 43)]
    wild[:, 0], wild[7, 3], wild[9, 4], wild[11, 9] = np.arange(20) * STEP, np.nan, -np.inf, 0.0
    sail = sailed(300, 1)
    for rows, bodies in ((sail, BODY), (sail[::7], BODY), (run, several), (run[:3], several), (wild, BODY), (wild, ())):
        with np.errstate(all="ignore"):
            planes.append(pack_rows(rows, bodies, STEP))
    check("packing", "to the last bit", planes=planes)


def test_rows_of_a_run_take_less_than_half_of_their_space():
    rows = np.concatenate(list(recorded_run.blocks(20.0)))
    assert len(pack_rows(rows)) < 0.5 * rows.nbytes


@pytest.mark.parametrize("damage", ["cut", "body out of the row", "body that rests", "other bytes", "no bytes"])
def test_damaged_rows_are_refused(damage):
    rows = sailed(100, 5)
    packed = pack_rows(rows, BODY, STEP)
    start = HEADER.size + HEAD.size  # of the columns of bodies
    damaged = {
        "cut": packed[:-8],
        "body out of the row": packed[:start] + struct.pack("<II", 1, 4_000_000_000) + packed[start + 8 :],
        "body that rests": packed[:start] + struct.pack("<II", 2, 8) + packed[start + 8 :],
        "other bytes": packed[:-40] + bytes(40),
        "no bytes": packed[: HEADER.size + 8],
    }[damage]
    with pytest.raises(RecordError, match=r"^block: "):
        unpack_rows(damaged)


def test_more_rows_than_a_file_can_hold_are_refused():
    """Before they are made."""
    packed = pack_rows(np.ones((2, 3)))
    huge = HEADER.pack(2**32 - 1, 3 | 3 << WIDTH_BITS) + packed[HEADER.size :]
    blocks = {"block": [packed, huge], "company": [np.array([0])] * 2}
    with pytest.raises(RecordError, match=r"block: 98304 MiB of rows: at most 1$"):
        numbered_blocks([Part("/record/rows", False, blocks)], 1, 1 << 20)
