"""Lanes of a kernel against the same numbers one by one."""

import math

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vrx_mj.physics.elementary import cosines_and_sines, exponential, exponentials, near_cosine_and_sine
from vrx_mj.physics.lanes import WIDTH, chosen, floor, larger, load, smaller, spread, store, total

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
        store(out[7], i, floor(x))
        store(out[8], i, chosen(x, y, spread(-7.0)))
        value = x
        value += y
        value -= 0.5
        value *= x
        store(out[9], i, value)


@given(NUMBERS, NUMBERS)
def test_operations_are_those_of_numbers(a, b):
    b = np.where(np.abs(b) < 1e-3, 1.0, b)
    out = np.zeros((10, a.size))
    apply(a, b, out)
    expected = [
        a + b, a - b, a * b, a / b, 2.0 * a + b * 3.0, np.maximum(a, b), np.minimum(a, b), np.floor(a),
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


@numba.njit(error_model="numpy")
def functions(a, below, cos, sin, power):
    for i in range(0, a.size, WIDTH):
        c, s = cosines_and_sines(load(a, i))
        store(cos, i, c)
        store(sin, i, s)
        store(power, i, exponentials(load(below, i)))


def test_functions_are_those_of_numbers_to_the_bit():
    angles = np.random.default_rng(1).uniform(-1e6, 1e6, 800)
    angles[:80] = np.arange(-40, 40) * math.pi / 4
    below = -np.random.default_rng(2).uniform(0.0, 800.0, 800)
    cos, sin, power = np.zeros((3, 800))
    functions(angles, below, cos, sin, power)
    assert [*zip(cos, sin, strict=True)] == [near_cosine_and_sine(angle) for angle in angles]
    assert [*power] == [exponential(x) for x in below]
