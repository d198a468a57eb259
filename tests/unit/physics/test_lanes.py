"""Lanes of a kernel against the same numbers one by one."""

import json
import math
import operator
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from llvmlite import ir

from vrx_mj.physics import lanes
from vrx_mj.physics.elementary import exponential, near_cosine_and_sine
from vrx_mj.physics.lanes import (
    WIDTH,
    any_positive,
    broadcast,
    choose,
    larger,
    load,
    product_and,
    smaller,
    store,
    total,
    totals,
    zeros_in_lines,
)

NUMBERS = arrays(np.float64, 2 * WIDTH, elements=st.floats(-1e6, 1e6))


@numba.njit(error_model="numpy")
def apply(a, b, out):
    for i in range(0, a.size, WIDTH):
        x, y = load(a, i), load(b, i)
        store(out[0], i, x + y)
        store(out[1], i, x - y)
        store(out[2], i, x * y)
        store(out[3], i, x / y)
        store(out[4], i, 2.0 * x + y * 3.0)
        store(out[5], i, larger(x, y))
        store(out[6], i, smaller(x, y))
        store(out[7], i, product_and(x, y, x))
        store(out[8], i, choose(x, y, broadcast(-7.0)))
        value = x
        value += y
        value -= 0.5
        value *= x
        store(out[9], i, value)


def fused(a, b, c):
    """a b + c of fractions, rounded once."""
    return [float(Fraction(x) * Fraction(y) + Fraction(z)) for x, y, z in zip(a, b, c, strict=True)]


@given(NUMBERS, NUMBERS)
def test_operations_are_those_of_numbers(a, b):
    b = np.where(np.abs(b) < 1e-3, 1.0, b)
    out = np.zeros((10, a.size))
    apply(a, b, out)
    expected = [
        a + b, a - b, a * b, a / b, 2.0 * a + b * 3.0, np.maximum(a, b), np.minimum(a, b), fused(a, b, a),
        np.where(a > 0.0, b, -7.0), ((a + b) - 0.5) * a,
    ]  # fmt: skip
    assert (out == np.array(expected)).all()


@numba.njit
def sum_of(a):
    return total(load(a, 0))


@given(arrays(np.float64, WIDTH, elements=st.floats(-1e6, 1e6)))
def test_a_sum_has_one_order(a):
    """Halves, quarters, pairs: no processor may take another."""
    halves = a[:4] + a[4:]
    quarters = halves[:2] + halves[2:]
    assert sum_of(a) == quarters[0] + quarters[1]
    assert sum_of(a) == pytest.approx(math.fsum(a), abs=1e-9)


@numba.njit
def sums_of(a, out):
    one, two, three, four = load(a[0], 0), load(a[1], 0), load(a[2], 0), load(a[3], 0)
    store(out, 0, totals(one, two, three, four, load(a[4], 0), load(a[5], 0), load(a[6], 0), load(a[7], 0)))


@given(arrays(np.float64, (WIDTH, WIDTH), elements=st.floats(-1e6, 1e6)))
def test_eight_sums_at_once_are_those_one_by_one_to_the_bit(a):
    out = np.zeros(WIDTH)
    sums_of(a, out)
    assert out.tolist() == [sum_of(row) for row in a]


class InThreads(np.ndarray):
    """A number of each of eight threads."""

    type = ir.DoubleType()


class ThreadsBuilder:
    """Does at once what LLVM's builder would write, for eight threads."""

    fadd = staticmethod(operator.add)
    and_ = staticmethod(lambda one, other: one & other.constant)
    icmp_unsigned = staticmethod(lambda _, one, other: one == other.constant)
    select = staticmethod(lambda which, one, other: np.where(which, one, other).view(InThreads))


@given(arrays(np.float64, (WIDTH, WIDTH), elements=st.floats(-1e6, 1e6)))
def test_sums_of_threads_are_those_of_lanes_to_the_bit(a):
    """Every thread has a sum of one value, and that of its own lane of eight sums."""
    values = [row.view(InThreads) for row in a]
    emit_total, emit_totals = (each._defn.__wrapped__ for each in (total, totals))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lanes, "_thread", lambda _: np.arange(WIDTH))
        patch.setattr(lanes, "_exchange", lambda _, value, bit: value[np.arange(WIDTH) ^ bit])
        sums = [emit_total(ThreadsBuilder, value).tolist() for value in values]
        together = emit_totals(ThreadsBuilder, *values).tolist()
    assert sums == [[sum_of(row)] * WIDTH for row in a]
    assert together == [sum_of(row) for row in a]


@numba.njit
def any_of(a):
    return any_positive(load(a, 0))


def test_a_number_above_zero_is_found_in_any_lane():
    for below in (0.0, -0.0, -1e-300, -math.inf, math.nan):
        assert not any_of(np.full(WIDTH, below))
        for lane in range(WIDTH):
            assert any_of(np.where(np.arange(WIDTH) == lane, 1e-300, below))


def test_lanes_that_do_not_lie_one_after_another_are_refused():
    with pytest.raises(AssertionError, match="lanes lie one after another"):
        sum_of(np.zeros((WIDTH, 2))[:, 0])


@pytest.mark.parametrize(("rows", "width"), [(1, 8), (3, 64), (26, 8), (2, 0)])
def test_rows_begin_with_lines_of_the_cache(rows, width):
    found = zeros_in_lines(rows, width)
    assert found.shape == (rows, width)
    assert not found.any()
    assert found.flags.c_contiguous
    assert found.ctypes.data % (WIDTH * found.itemsize) == 0


@numba.njit
def product_of(a, b, c):
    return product_and(a, b, c)


ON_AN_OLDER_PROCESSOR = """
import sys
import numpy as np
sys.path[:0] = [{tests!r}]
from unit.physics.test_lanes import functions, product_of
angles = np.linspace(-1e3, 1e3, 80)
out = np.zeros((3, 80))
functions(angles, -abs(angles), *out)
print([*out.ravel().tolist(), product_of(1.0 + 2.0**-30, 1.0 - 2.0**-30, -1.0)])
"""


@pytest.mark.slow
def test_a_processor_without_fused_operations_gives_the_same_bits():
    """Of which LLVM then asks the C library."""
    variables = {**os.environ, "NUMBA_CPU_NAME": "nehalem", "NUMBA_CPU_FEATURES": ""}
    program = ON_AN_OLDER_PROCESSOR.format(tests=str(Path(__file__).parents[2]))
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=variables, check=True)
    angles, out = np.linspace(-1e3, 1e3, 80), np.zeros((3, 80))
    functions(angles, -abs(angles), *out)
    assert json.loads(found.stdout) == [*out.ravel().tolist(), -(2.0**-60)]


@numba.njit(error_model="numpy")
def functions(a, below, cos, sin, power):
    for i in range(0, a.size, WIDTH):
        c, s = near_cosine_and_sine(load(a, i))
        store(cos, i, c)
        store(sin, i, s)
        store(power, i, exponential(load(below, i)))


def test_functions_are_those_of_numbers_to_the_bit():
    angles = np.random.default_rng(1).uniform(-1e6, 1e6, 800)
    angles[:80] = np.arange(-40, 40) * math.pi / 4
    below = -np.random.default_rng(2).uniform(0.0, 800.0, 800)
    cos, sin, power = np.zeros((3, 800))
    functions(angles, below, cos, sin, power)
    assert [*zip(cos, sin, strict=True)] == [near_cosine_and_sine(angle) for angle in angles]
    assert [*power] == [exponential(x) for x in below]
