"""Vectors of three numbers as tuples, which the compiler keeps in registers, and copies of arrays."""

from wrcore.kernels.jit import jit


@jit(allocates=False, inline="always")
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit(allocates=False, inline="always")
def cross(a, b):
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@jit(allocates=False, inline="always")
def minus(a, b):
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@jit(allocates=False, inline="always")
def load(array, start):
    """Three numbers of an array from ``start`` on."""
    return array[start], array[start + 1], array[start + 2]


@jit(allocates=False, inline="always")
def store(vector, array):
    """Write the first three numbers of an array."""
    array[0], array[1], array[2] = vector


@jit(allocates=False, inline="always")
def copy_into(target, source):
    """Copy numbers one by one; an assignment of slices might allocate."""
    for i in range(target.shape[0]):
        target[i] = source[i]
