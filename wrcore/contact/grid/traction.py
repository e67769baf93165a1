"""Reference steady rolling contact on a uniform grid of rectangular elements.

Two equal bodies; traction on the wheel is constant in each element and bounded by Coulomb's law, |p| <= mu p_n. A point
of the contact moves from an element to the one behind it, so that the slip at an element's centre is

    s = w + (u(x) - u(x + dx))/dx,      u = 1/(pi G) int K p dA,

which is of first order in dx. Either s = 0, or p is at its bound and opposes s. Kernel K: see
`wrcore.contact.rolling.ellipse_influence`.

The iteration is that of Douglas and Rachford as in `wrcore.contact.rolling.ellipse`, but over a periodic grid of twice
the size of the patch. Outside the patch the bound is zero. The resolvent (H + A)^-1 H is exact in Fourier space for any
shape, without factorisation. The iteration converges for every monotone A, so for every input.
"""

import math

import numpy as np

from wrcore.contact.grid.fourier import power_of_two, transform
from wrcore.contact.grid.pressure import corner_integrals
from wrcore.kernels.jit import jit

STEP_SCALE = 6.0
"""Ratio of H to the diagonal of A. With 6 there are 40 to 50 iterations; 4 to 8 are as fast on square grids, smaller
values are better for slender patches."""

RELAXATION = 1.8
MOST_ITERATIONS = 400


@jit
def slip_influence(nx, ns, dx, ds, shear_modulus, poisson):
    """Slip at an element by a unit traction (Pa) on another one, on a periodic grid of nx by ns elements (even).

    Components xx, ss, xs, (3, nx, ns), for the offsets 0, 1, .. n/2 - 1, -n/2, .. -1 of the element with the slip from
    the loaded one."""
    rows, lines = nx // 2, ns // 2
    corner, u, table = np.empty((3, rows + 3, lines + 2)), np.empty((3, rows + 2, lines + 1)), np.empty((3, nx, ns))
    for i in range(rows + 3):
        for j in range(lines + 2):
            x, y = (i - 0.5) * dx, (j - 0.5) * ds
            part_x, part_y = corner_integrals(x, y)
            corner[0, i, j] = (1.0 - poisson) * part_x + part_y
            corner[1, i, j] = part_x + (1.0 - poisson) * part_y
            corner[2, i, j] = -poisson * math.sqrt(x * x + y * y)
    scale = 1.0 / (math.pi * shear_modulus * dx)
    for m in range(3):
        for i in range(rows + 2):
            for j in range(lines + 1):
                u[m, i, j] = corner[m, i + 1, j + 1] - corner[m, i, j + 1] - corner[m, i + 1, j] + corner[m, i, j]
                u[m, i, j] *= scale
        for i in range(-rows, rows):
            for j in range(-lines, lines):
                here, ahead = u[m, abs(i), abs(j)], u[m, abs(i + 1), abs(j)]
                if m == 2:  # odd in both offsets
                    here, ahead = here * np.sign(i) * np.sign(j), ahead * np.sign(i + 1) * np.sign(j)
                table[m, i, j] = here - ahead
    return table


@jit
def _resolvent(table, step):
    """Return the factors of the resolvent on the transform z of a field x + i s.

    (H + A)^-1 H z = even z(k) + odd conj(z(-k))."""
    nx, ns = table.shape[1:]
    re, im = transform(table[0].copy(), table[1].copy())
    cross_re, cross_im = transform(table[2].copy(), np.zeros((nx, ns)))
    even, odd = np.empty((2, ns, nx)), np.empty((2, ns, nx))
    for i in range(ns):
        for j in range(nx):
            k, m = (ns - i) % ns, (nx - j) % nx
            here, there = complex(re[i, j], im[i, j]), complex(re[k, m], -im[k, m])
            a, b = step + 0.5 * (here + there), step - 0.5j * (here - there)
            c = complex(cross_re[i, j], cross_im[i, j])
            factor = step / (a * b - c * c) / (nx * ns)
            plus, minus = 0.5 * factor * (a + b), 0.5 * factor * (b - a) - 1j * factor * c
            even[0, i, j], even[1, i, j] = plus.real, plus.imag
            odd[0, i, j], odd[1, i, j] = minus.real, minus.imag
    return even, odd


@jit
def _apply(even, odd, re, im):
    """Return the resolvent applied to a field re + i im; the arguments are overwritten."""
    re, im = transform(re, im)
    ns, nx = re.shape
    out_re, out_im = np.empty((ns, nx)), np.empty((ns, nx))
    for i in range(ns):
        k = (ns - i) % ns
        for j in range(nx):
            m = (nx - j) % nx
            a, b, c, d = re[i, j], im[i, j], re[k, m], -im[k, m]
            out_re[i, j] = even[0, i, j] * a - even[1, i, j] * b + odd[0, i, j] * c - odd[1, i, j] * d
            out_im[i, j] = even[0, i, j] * b + even[1, i, j] * a + odd[0, i, j] * d + odd[1, i, j] * c
    im, re = transform(out_im, out_re)
    return re, im


@jit(allocates=False)
def _project(zx, zs, limit, fx, fs):
    """Fill F = P(z): the vectors z scaled back to their limit."""
    for i in range(limit.shape[0]):
        for j in range(limit.shape[1]):
            size = math.sqrt(zx[i, j] * zx[i, j] + zs[i, j] * zs[i, j])
            scale = limit[i, j] / max(size, limit[i, j], 1e-300)
            fx[i, j], fs[i, j] = scale * zx[i, j], scale * zs[i, j]


@jit
def solve_traction(bound, wx, ws, dx, ds, shear_modulus, poisson, tolerance, px, ps, sx, ss):
    """Fill traction on the wheel (``px``, ``ps``, Pa) and slip over the speed (``sx``, ``ss``) in rolling contact.

    ``bound`` is mu p_n (Pa; 0 outside the contact); ``wx``, ``ws`` are the rigid slip of the wheel over the rail, over
    the speed; all (nx, ns). The contact moves towards larger x over both surfaces. ``tolerance``: sum of the last
    changes of the traction over the sum of the traction. Returns the number of iterations, negative if the tolerance
    was not met after `MOST_ITERATIONS`."""
    nx, ns = bound.shape
    wide, long = power_of_two(2 * nx - 1), power_of_two(2 * ns - 1)
    table = slip_influence(wide, long, dx, ds, shear_modulus, poisson)
    step = STEP_SCALE * math.sqrt(table[0, 0, 0] * table[1, 0, 0])
    even, odd = _resolvent(table, step)
    limit, rx, rs = np.zeros((wide, long)), np.zeros((wide, long)), np.zeros((wide, long))
    zx, zs, fx, fs = np.zeros((wide, long)), np.zeros((wide, long)), np.zeros((wide, long)), np.zeros((wide, long))
    re, im = np.empty((wide, long)), np.empty((wide, long))
    iterations = -MOST_ITERATIONS
    for i in range(nx):
        for j in range(ns):
            limit[i, j], rx[i, j], rs[i, j] = bound[i, j], wx[i, j] / step, ws[i, j] / step
            zx[i, j], zs[i, j] = -rx[i, j], -rs[i, j]
    for count in range(1, MOST_ITERATIONS + 1):
        _project(zx, zs, limit, fx, fs)
        for i in range(wide):
            for j in range(long):
                re[i, j], im[i, j] = 2.0 * fx[i, j] - zx[i, j] - rx[i, j], 2.0 * fs[i, j] - zs[i, j] - rs[i, j]
        yx, ys = _apply(even, odd, re, im)
        change = total = 0.0
        for i in range(wide):
            for j in range(long):
                move_x, move_s = yx[i, j] - fx[i, j], ys[i, j] - fs[i, j]
                zx[i, j] += RELAXATION * move_x
                zs[i, j] += RELAXATION * move_s
                change += math.sqrt(move_x * move_x + move_s * move_s)
                total += math.sqrt(fx[i, j] * fx[i, j] + fs[i, j] * fs[i, j])
        if change <= tolerance * total:
            iterations = count
            break
    _project(zx, zs, limit, fx, fs)
    for i in range(nx):
        for j in range(ns):
            px[i, j], ps[i, j] = fx[i, j], fs[i, j]
            sx[i, j], ss[i, j] = step * (fx[i, j] - zx[i, j]), step * (fs[i, j] - zs[i, j])
    return iterations
