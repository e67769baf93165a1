"""Discrete Fourier transform in two dimensions for kernels, for sizes of powers of two.

Real and imaginary parts are separate arrays."""

import math

import numpy as np

from wrcore.kernels.jit import FAST, jit


@jit
def power_of_two(n):
    """Return the smallest power of two that is not below n."""
    size = 1
    while size < n:
        size *= 2
    return size


@jit(fastmath=FAST)
def _along_columns(re, im):
    """Transform along the first axis (Stockham's order); returns new arrays."""
    n, width = re.shape
    re2, im2 = np.empty((n, width)), np.empty((n, width))
    half, stride = n // 2, 1
    while half >= 1:
        for j in range(half):
            cosine, sine = math.cos(math.pi * j / half), -math.sin(math.pi * j / half)
            for k in range(stride):
                a, b = re[k + stride * j], re[k + stride * (j + half)]
                c, d = im[k + stride * j], im[k + stride * (j + half)]
                e, f = re2[k + 2 * stride * j], re2[k + stride * (2 * j + 1)]
                g, h = im2[k + 2 * stride * j], im2[k + stride * (2 * j + 1)]
                for m in range(width):
                    u, v = a[m] - b[m], c[m] - d[m]
                    e[m], g[m] = a[m] + b[m], c[m] + d[m]
                    f[m], h[m] = u * cosine - v * sine, u * sine + v * cosine
        re, re2, im, im2 = re2, re, im2, im
        half //= 2
        stride *= 2
    return re, im


@jit
def _transposed(a):
    return np.ascontiguousarray(a.T)


@jit
def transform(re, im):
    """Return the transform of re + i im, transposed; the arguments are overwritten.

    Inverse: the transform of (im, re) of the result is (im, re) of the original, in its order, times its size."""
    re, im = _along_columns(re, im)
    return _along_columns(_transposed(re), _transposed(im))
