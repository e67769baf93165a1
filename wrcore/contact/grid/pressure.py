"""Reference normal contact on a uniform grid of rectangular elements.

Pressure is constant in each element; displacements are those of the half-space at the elements' centres (Love). The
conditions of contact,

    e = g + u = 0  where p > 0,      e >= 0  where p = 0,      u = 1/(pi E*) int p/R dA,

are those of a convex minimum, to which conjugate gradients with an active set converge from any start. Arrays over the
grid have shape (nx, ns): x in the rolling direction, s across. The bodies can have any shape.

References
----------
Love, Phil. Trans. R. Soc. A 228 (1929) 377 (a loaded rectangle on the half-space).
Polonsky and Keer, Wear 231 (1999) 206-219 (conjugate gradients); Vollebregt, J. Optim. Theory Appl. 162 (2014) 206-228
(the same for a prescribed approach).
"""

import math

import numpy as np

from wrcore.kernels.jit import jit

MOST_STEPS = 2000
"""Maximum number of steps of conjugate gradients; more than a tenth is rarely needed."""


@jit(allocates=False, forceinline=True)
def corner_integrals(x, y):
    """Indefinite integrals over x and y of x^2/R^3 + y^2/R^3 = 1/R: the parts x asinh(y/|x|) and y asinh(x/|y|)."""
    part_x = x * math.asinh(y / abs(x)) if x != 0.0 else 0.0
    part_y = y * math.asinh(x / abs(y)) if y != 0.0 else 0.0
    return part_x, part_y


@jit
def normal_influence(nx, ns, dx, ds):
    """Integral of 1/R (m) over an element of dx by ds (m), at the centre of another element.

    Entry (i, j, k) of (nx, ns, ns) is for elements at a distance of i rows along x, at j and k across."""
    corner = np.empty((nx + 1, ns + 1))
    for i in range(nx + 1):
        for j in range(ns + 1):
            part_x, part_y = corner_integrals((i - 0.5) * dx, (j - 0.5) * ds)
            corner[i, j] = part_x + part_y
    blocks = np.empty((nx, ns, ns))
    for i in range(nx):
        for j in range(ns):
            value = corner[i + 1, j + 1] - corner[i, j + 1] - corner[i + 1, j] + corner[i, j]
            for k in range(ns - j):
                blocks[i, k, k + j] = value
                blocks[i, k + j, k] = value
    return blocks


@jit
def convolve(blocks, p, pair, part, out):
    """Fill ``out`` with the sum over elements of influence times p, by one matrix product per distance of two rows.

    ``pair`` and ``part`` are work arrays of the shape of p."""
    nx, ns = p.shape
    np.dot(p, blocks[0], out)
    for d in range(1, nx):
        for i in range(nx):
            for j in range(ns):
                pair[i, j] = (p[i - d, j] if i >= d else 0.0) + (p[i + d, j] if i + d < nx else 0.0)
        np.dot(pair, blocks[d], part)
        for i in range(nx):
            for j in range(ns):
                out[i, j] += part[i, j]


@jit(allocates=False)
def _residual(p, e):
    """Return the sum of e^2 over the contact, and the maximum violation of the conditions."""
    square, worst = 0.0, 0.0
    for i in range(p.shape[0]):
        for j in range(p.shape[1]):
            if p[i, j] > 0.0:
                square += e[i, j] * e[i, j]
                worst = max(worst, abs(e[i, j]))
            else:
                worst = max(worst, -e[i, j])
    return square, worst


@jit(allocates=False)
def _advance(p, e, t, q):
    """Do one step in the direction t, with displacement q, keeping p >= 0; return whether the contact area changed."""
    top = bottom = 0.0
    for i in range(p.shape[0]):
        for j in range(p.shape[1]):
            top += e[i, j] * t[i, j]
            bottom += q[i, j] * t[i, j]
    length, changed = (top / bottom if bottom > 0.0 else 0.0), False
    for i in range(p.shape[0]):
        for j in range(p.shape[1]):
            if p[i, j] > 0.0:
                p[i, j] -= length * t[i, j]
                if p[i, j] <= 0.0:
                    p[i, j], changed = 0.0, True
            elif e[i, j] < 0.0:
                p[i, j], changed = -length * e[i, j], True
            e[i, j] -= length * q[i, j]
    return changed


@jit
def solve_pressure(gap, dx, ds, modulus, tolerance, pressure):
    """Fill ``pressure`` (Pa) for a ``gap`` (nx, ns) between undeformed bodies along the normal (m, < 0 in overlap).

    ``tolerance`` is that of the conditions of contact, over the maximum overlap. Returns the number of steps, negative
    if the tolerance was not met after `MOST_STEPS`."""
    nx, ns = gap.shape
    p, t, q = np.empty((nx, ns)), np.zeros((nx, ns)), np.empty((nx, ns))
    depth = 0.0
    for i in range(nx):
        for j in range(ns):
            depth = max(depth, -gap[i, j])
            p[i, j], pressure[i, j] = math.sqrt(max(-gap[i, j], 0.0)), 0.0
    if not depth > 0.0:
        return 0
    blocks, pair, part = normal_influence(nx, ns, dx, ds), np.empty((nx, ns)), np.empty((nx, ns))
    convolve(blocks, p, pair, part, q)
    top = bottom = 0.0
    for i in range(nx):
        for j in range(ns):
            top -= gap[i, j] * p[i, j]
            bottom += q[i, j] * p[i, j]
    scale, before, steps = top / bottom, 0.0, -MOST_STEPS
    p *= scale
    e = gap + scale * q
    for step in range(MOST_STEPS):
        square, worst = _residual(p, e)
        if worst <= tolerance * depth:
            steps = step
            break
        ratio = square / before if before > 0.0 else 0.0
        before = square
        for i in range(nx):
            for j in range(ns):
                t[i, j] = e[i, j] + ratio * t[i, j] if p[i, j] > 0.0 else 0.0
        convolve(blocks, t, pair, part, q)
        if _advance(p, e, t, q):
            before = 0.0
            convolve(blocks, p, pair, part, q)
            e = gap + q
    pressure[:, :] = math.pi * modulus * p
    return steps
