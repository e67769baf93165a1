"""Models behind a pointer and kernels behind an address."""

from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import NumbaError

from wrcore.kernels.handles import Handle, Handles, Kernel, call_at, other_at, values_of
from wrcore.kernels.jit import jit


class Inner(NamedTuple):
    weights: np.ndarray
    flag: bool
    count: int


class Outer(NamedTuple):
    inner: Inner
    factor: float
    matrix: np.ndarray


@jit(allocates=False)
def weigh(x, values, model, out):
    more = model.inner.count if model.inner.flag else 0
    for i in range(values.shape[0]):
        out[i] = x * values[i] * model.inner.weights[i] * model.factor + model.matrix[1, 0] + more


@jit(allocates=False)
def weigh_at(kernel, x, values, model, out):
    call_at(kernel, x, values, model, out)


@jit
def copy_of_weights(model):
    return model.inner.weights.copy()


@pytest.fixture
def model():
    return Outer(Inner(np.array([1.0, 2.0, 3.0]), True, 7), 1.5, np.arange(4.0).reshape(2, 2))


@jit(allocates=False)
def sum_factors(model, others, count):
    total = 0.0
    for k in range(count):
        total += other_at(model, others[k] if len(others) > 0 else 0).factor
    return total


def test_values_behind_an_array_of_addresses_live_as_long_as_that(model):
    others = np.asarray(Handles(model._replace(factor=factor) for factor in (2.0, 3.0)))
    assert [one.factor for one in values_of(others)] == [2.0, 3.0] and values_of(np.zeros(0, np.int64)) == ()
    assert sum_factors(Handle(model), others, 2) == 5.0
    assert sum_factors(Handle(model), np.zeros(0, np.int64), 2) == 3.0
    assert sum_factors(model, np.zeros(0, np.int64), 1) == 1.5  # no reference
    assert len(sum_factors.overloads) == 2


VALUES = np.array([1.0, 10.0, 100.0])
EXPECTED = 2.0 * VALUES * [1.0, 2.0, 3.0] * 1.5 + 2.0 + 7


def test_fields_are_read_through_the_pointer(model):
    by_value, by_handle, by_address = np.zeros(3), np.zeros(3), np.zeros(3)
    handle = Handle(model)
    weigh(2.0, VALUES, model, by_value)
    weigh(2.0, VALUES, handle, by_handle)
    weigh_at(Kernel(weigh, 2.0, VALUES, handle, VALUES), 2.0, VALUES, handle, by_address)
    for found in (by_value, by_handle, by_address):
        np.testing.assert_array_equal(found, EXPECTED)


def test_arrays_are_shared_and_kept_alive(model):
    handle, out = Handle(model._replace(matrix=np.zeros((2, 2)))), np.zeros(3)
    handle.value.inner.weights[:] = 0.0
    weigh(2.0, VALUES, handle, out)
    np.testing.assert_array_equal(out, 7.0)


def test_a_field_that_does_not_exist_is_an_error(model):
    @jit(allocates=False)
    def wrong(model):
        return model.wrong

    with pytest.raises(NumbaError, match="wrong"):
        wrong(Handle(model))


def test_kernels_that_allocate_borrow_arrays_of_a_handle(model):
    handle = Handle(model)
    for _ in range(100):
        np.testing.assert_array_equal(copy_of_weights(handle), [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(model.inner.weights, [1.0, 2.0, 3.0])


def test_a_kernel_is_called_with_its_own_types_only(model):
    kernel = Kernel(weigh, 2.0, VALUES, Handle(model), VALUES)
    with pytest.raises(NumbaError, match="is called with"):
        weigh_at(kernel, 2, VALUES, Handle(model), np.zeros(3))
