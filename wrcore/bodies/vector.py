"""Operations on vectors of three numbers as tuples, which the compiler keeps in registers, and copies of arrays."""

from wrcore.kernels.jit import jit


@jit(allocates=False, inline="always")
def dot(a, b):
    """Return the scalar product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit(allocates=False, inline="always")
def cross(a, b):
    """Return the cross product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@jit(allocates=False, inline="always")
def minus(a, b):
    """Return the difference a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@jit(allocates=False, inline="always")
def load(array, start):
    """Return three numbers of an array from index ``start`` on."""
    return array[start], array[start + 1], array[start + 2]


@jit(allocates=False, inline="always")
def store(vector, array):
    """Write a vector into the first three numbers of an array."""
    array[0], array[1], array[2] = vector


@jit(allocates=False, inline="always")
def copy_into(target, source):
    """Copy an array number by number; an assignment of slices might allocate memory."""
    for i in range(target.shape[0]):
        target[i] = source[i]
