"""Vector registers in kernels against numpy."""

import numpy as np
import pytest

from wrcore.kernels.jit import FUSED, jit
from wrcore.kernels.lanes import (
    below,
    count_bits,
    every8,
    highest_bit,
    lane,
    lanes8,
    load4,
    load8,
    load32,
    lowest_bit,
    maximum,
    put8,
    put32,
    ramp8,
    root,
    take8,
    take32,
    total,
    where_below,
)


@jit(fastmath=FUSED)
def polynomial(rows, start, factor):
    """Sum over eight columns of (row 0 - factor) (row 1 + k) factor + row 0, and its third term."""
    one, two = load8(rows, 0, np.uint64(start)), load8(rows, 1, np.uint64(start))
    result = (one - factor) * (two + ramp8()) * factor + one
    return total(result), lane(result, 2)


@jit
def compared(rows, limit):
    """Bits, greatest and chosen numbers of eight columns below a limit."""
    one, two = load8(rows, 0, np.uint64(0)), load8(rows, 1, np.uint64(0))
    bits = below(one, lanes8(limit))
    chosen = where_below(one, lanes8(limit), one, two)
    return bits, count_bits(bits), lowest_bit(bits), highest_bit(bits), maximum(one), total(chosen)


@jit
def four(values, start):
    """Sum and last of four neighbours."""
    lanes = load4(values, np.uint64(start))
    return total(lanes), lane(lanes, 3)


def test_arithmetic_is_that_of_numbers():
    rows = np.random.default_rng(0).normal(size=(2, 21))
    for start in (0, 1, 13):
        one, two = rows[:, start : start + 8]
        expected = (one - 0.3) * (two + np.arange(8)) * 0.3 + one
        assert polynomial(rows, start, 0.3) == pytest.approx((expected.sum(), expected[2]), rel=1e-14)


@pytest.mark.parametrize("limit", [-9.0, -0.5, 0.0, 0.7, 9.0])
def test_comparisons(limit):
    rows = np.random.default_rng(1).normal(size=(2, 8))
    is_below = rows[0] < limit
    places = np.flatnonzero(is_below)
    ends = (places[0], places[-1]) if len(places) else (64, -1)
    expected = (is_below @ 2 ** np.arange(8), len(places), *ends, rows[0].max(), np.where(is_below, *rows).sum())
    assert compared(rows, limit) == pytest.approx(expected, rel=1e-14)


def test_not_a_number_is_not_below():
    rows = np.zeros((2, 8))
    rows[0, 3] = np.nan
    assert compared(rows, 1.0)[:2] == (0b11110111, 7)


@jit
def added(rows, values, out, start):
    """Write eight columns of row 1 and as many values, added, to ``out``."""
    at = np.uint64(start)
    put8(out, at, load8(rows, 1, at) + take8(values, at))


@pytest.mark.parametrize("kinds", [(np.float64, np.float32), (np.float32, np.float64)])
def test_single_precision_is_widened_and_lanes_are_written(kinds):
    random, out = np.random.default_rng(2), np.zeros(21)
    rows, values = random.normal(size=(2, 21)).astype(kinds[0]), random.normal(size=21).astype(kinds[1])
    added(rows, values, out, 7)
    np.testing.assert_array_equal(out[7:15], rows[1, 7:15].astype(float) + values[7:15].astype(float))
    assert not out[:7].any() and not out[15:].any()


def test_single_precision_is_widened():
    values = np.arange(20, dtype=np.float32) / 3
    assert four(values, 5) == (values[5:9].astype(float).sum(), float(values[8]))


@jit(fastmath=FUSED)
def of_every_third(rows, out):
    """Roots of eight columns of row 1, three apart from the second on, over 1 + their number."""
    put8(out, np.uint64(0), root(every8(rows, np.uint64(1), np.uint64(2), np.uint64(3))) / (1.0 + ramp8()))


def test_columns_apart_and_roots():
    rows, out = np.random.default_rng(3).random((2, 40)), np.zeros(8)
    of_every_third(rows, out)
    np.testing.assert_allclose(out, np.sqrt(rows[1, 2:26:3]) / np.arange(1.0, 9.0), rtol=1e-15)


@jit(fastmath=FUSED)
def of_32(rows, factor, out):
    """Sum of 32 products of row 1 and of row 0 less a factor, and roots of their squares and a quarter."""
    start = np.uint64(5)
    products = load32(rows, np.uint64(1), start) * (take32(rows[0], start) - factor)
    put32(out, start, root(products * products + 0.25))
    return total(products)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_32_numbers(kind):
    random, out = np.random.default_rng(4), np.zeros(60)
    rows = random.normal(size=(2, 60)).astype(kind)
    products = rows[1, 5:37].astype(float) * (rows[0, 5:37].astype(float) - 0.3)
    assert of_32(rows, 0.3, out) == pytest.approx(products.sum(), abs=1e-13)
    np.testing.assert_allclose(out[5:37], np.sqrt(products**2 + 0.25), rtol=1e-14)
    assert not out[:5].any() and not out[37:].any()
