"""What numbers looked up in a `PairTable`, and the remainder of its creep force, change by along the lattice."""

import math

import numpy as np

from wrcore.contact.patch.model import MODES, NODES
from wrcore.contact.search.geometry import LANES
from wrcore.kernels.jit import FUSED, jit
from wrcore.kernels.lanes import lanes8, load8, put8, take8, total
from wrcore.wheels.table.cells import AXES, LEFT, STEPS, place_of
from wrcore.wheels.table.lookup import (
    ANGLE,
    DISK,
    FLANKS,
    FORCE,
    LEAST,
    LINEAR,
    MODE,
    PARTED_FROM,
    ROOT,
    ROUND,
    along_axis,
    family_share,
    flank_part,
    round_part,
    spread_weights,
    weigh,
)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _slope_along(f):
    """Derivatives of `along_axis` by f; g changes by half as much."""
    g = 1.0 - f
    return (
        0.5 * g * (3.0 * f - 1.0), f * (4.5 * f - 5.0), g * (5.0 - 4.5 * g), 0.5 * f * (1.0 - 3.0 * g),
        -1.0, 1.0, -0.5, 0.5,
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def weigh_slopes(at, weights):
    """Fill the weights (1 + AXES, NODES) of a cell's rows at a `Place` in it, and their derivatives by the offset
    (1/m), slope, ln D and yaw (1/rad)."""
    x, y, z = along_axis(at.fx, at.gx), along_axis(at.fy, at.gy), along_axis(at.fz, at.gz)
    odd, even = 0.5 * at.turn, 0.5 * at.turn * at.turn
    weigh(at, weights[0])
    spread_weights(_slope_along(at.fx), y, z, odd, even, weights[1])
    spread_weights(x, _slope_along(at.fy), z, odd, even, weights[2])
    spread_weights(x, y, _slope_along(at.fz), odd, even, weights[3])
    spread_weights(x, y, z, 0.5, at.turn, weights[4])
    for n in range(NODES):
        for axis in range(3):
            weights[1 + axis, n] *= (1.0 if axis == 2 else at.scale) / STEPS[axis]
        weights[4, n] *= 0.0 if n < 32 else 1.0 / at.half


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _add_rows(rows, weights, first, end, numbers, along):
    """Add the weighted sums of a cell's rows to the ``numbers``, and to what they change by ``along`` the axes, from
    ``first`` to before ``end``."""
    for column in range(first, end, LANES):
        start = np.uint64(column)
        value = x = y = z = w = lanes8(0.0)
        for n in range(NODES):
            row = load8(rows, n, start)
            value, x, y = value + weights[0, n] * row, x + weights[1, n] * row, y + weights[2, n] * row
            z, w = z + weights[3, n] * row, w + weights[4, n] * row
        put8(numbers, start, take8(numbers, start) + value)
        put8(along[0], start, take8(along[0], start) + x)
        put8(along[1], start, take8(along[1], start) + y)
        put8(along[2], start, take8(along[2], start) + z)
        put8(along[3], start, take8(along[3], start) + w)


@jit(allocates=False, fastmath=FUSED)
def _add_modes(rows, weights, numbers, along):
    """As `_add_rows`, after all else: the coefficients of modes that count."""
    for family in range(2):
        if family_share(numbers, family) > 0.0:
            _add_rows(rows, weights, MODE + MODES * family, MODE + MODES * (family + 1), numbers, along)


@jit(allocates=False, fastmath=FUSED)
def look_slopes_up(rows, weights, numbers, along):
    """Fill ``numbers`` (NUMBERS,) as `look_up` and `look_modes_up` do, and what they change by ``along`` the axes
    (AXES, NUMBERS), from a cell's ``rows``; see `weigh_slopes`."""
    numbers[:], along[:] = 0.0, 0.0
    _add_rows(rows, weights, 0, PARTED_FROM, numbers, along)
    if LEAST < numbers[ROOT] < 1.0 - LEAST:
        _add_rows(rows, weights, PARTED_FROM, MODE, numbers, along)
    _add_modes(rows, weights, numbers, along)


@jit(allocates=False, fastmath=FUSED)
def look_share_slopes_up(table, at, shares, weights, numbers, along):
    """As `look_slopes_up`, from all cells that have a share, see `wrcore.wheels.table.cells.locate`."""
    numbers[:], along[:] = 0.0, 0.0
    for modes in (False, True):
        _add_share(table, at, shares[LEFT], modes, weights, numbers, along)
        for row in range(LEFT):
            if shares[row, 0] > 0.0:
                _add_share(table, place_of(shares[row]), shares[row], modes, weights, numbers, along)
    if not LEAST < numbers[ROOT] < 1.0 - LEAST:
        numbers[PARTED_FROM:MODE] = 0.0
        along[:, PARTED_FROM:MODE] = 0.0


@jit(allocates=False, fastmath=FUSED)
def _add_share(table, at, share, modes, weights, numbers, along):
    """Add what a cell with a ``share``, that changes along the axes, has in the coefficients of ``modes``, after all
    else, or in all else."""
    rows = table.cells[at.cell]
    weigh_slopes(at, weights)
    for n in range(NODES):
        for axis in range(AXES):
            weights[1 + axis, n] = share[0] * weights[1 + axis, n] + share[1 + axis] * weights[0, n]
        weights[0, n] *= share[0]
    if modes:
        _add_modes(rows, weights, numbers, along)
    else:
        _add_rows(rows, weights, 0, MODE, numbers, along)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _flank_slope(angle):
    """Derivative of `flank_part`."""
    wide = FLANKS[1] - FLANKS[0]
    part = min(max((abs(angle) - FLANKS[0]) / wide, 0.0), 1.0)
    return math.copysign(6.0 * part * (1.0 - part) / wide, angle)


@jit(allocates=False, fastmath=FUSED)
def remainder_slopes(modes, numbers, along, x, y, out):
    """Fill ``out`` (3 + AXES, 3): `remainder` at creepages x, y over those of saturation, then its derivatives by both,
    and along the axes of the lattice."""
    cells, far = modes.shape[1] - 2, math.sqrt(DISK * DISK + x * x + y * y)
    root = 1.0 / (DISK + far)
    p, q = x * root, y * root
    square, part = p * p + q * q, flank_part(numbers[ANGLE])
    weight, bent = round_part(square, numbers[LINEAR]), _flank_slope(numbers[ANGLE])
    u, v = 0.5 * (p + 1.0) * cells, 0.5 * (q + 1.0) * cells
    i, j = min(int(u), cells - 1), min(int(v), cells - 1)
    f, g = u - i, v - j
    out[:] = 0.0
    for family in range(2):
        share, first = (part, MODE + MODES) if family else (1.0 - part, MODE)
        if share == 0.0:
            continue
        turned = bent if family else -bent
        for k in range(3):
            value = by_u = by_v = one = two = three = four = lanes8(0.0)
            for m in range(0, MODES, LANES):
                start, sums, sums_u, sums_v = np.uint64(MODES * k + m), lanes8(0.0), lanes8(0.0), lanes8(0.0)
                for r in range(3):
                    a = 0.5 * (1.0 - f) * (1.0 - f) if r == 0 else 0.5 + f * (1.0 - f) if r == 1 else 0.5 * f * f
                    da = f - 1.0 if r == 0 else 1.0 - 2.0 * f if r == 1 else f
                    line = modes[family, i + r]
                    for s in range(3):
                        b = 0.5 * (1.0 - g) * (1.0 - g) if s == 0 else 0.5 + g * (1.0 - g) if s == 1 else 0.5 * g * g
                        db = g - 1.0 if s == 0 else 1.0 - 2.0 * g if s == 1 else g
                        shape = load8(line, j + s, start)
                        sums, sums_u, sums_v = (
                            sums + (a * b) * shape,
                            sums_u + (da * b) * shape,
                            sums_v + (a * db) * shape,
                        )
                at = np.uint64(first + m)
                own = take8(numbers, at)
                value, by_u, by_v = value + own * sums, by_u + own * sums_u, by_v + own * sums_v
                one, two = one + take8(along[0], at) * sums, two + take8(along[1], at) * sums
                three, four = three + take8(along[2], at) * sums, four + take8(along[3], at) * sums
            of_family = total(value)
            out[0, k] += share * of_family
            out[1, k] += share * total(by_u)
            out[2, k] += share * total(by_v)
            out[3, k] += share * total(one) + turned * along[0, ANGLE] * of_family
            out[4, k] += share * total(two) + turned * along[1, ANGLE] * of_family
            out[5, k] += share * total(three) + turned * along[2, ANGLE] * of_family
            out[6, k] += share * total(four) + turned * along[3, ANGLE] * of_family
    # p = x root: its derivatives, and those of the weight w = s / (s + l)
    bound = max(numbers[LINEAR], 0.0) * ROUND * ROUND + 1e-12
    rise = bound / (square + bound) ** 2
    fall = -square / (square + bound) ** 2 * (ROUND * ROUND if numbers[LINEAR] > 0.0 else 0.0)
    px, py, qy = root - x * x * root * root / far, -x * y * root * root / far, root - y * y * root * root / far
    wx, wy = rise * 2.0 * (p * px + q * py), rise * 2.0 * (p * py + q * qy)
    for k in range(3):
        force = numbers[FORCE + k]
        beyond, by_p, by_q = out[0, k] - force, 0.5 * cells * out[1, k], 0.5 * cells * out[2, k]
        out[0, k] = force + weight * beyond
        out[1, k] = weight * (by_p * px + by_q * py) + wx * beyond
        out[2, k] = weight * (by_p * py + by_q * qy) + wy * beyond
        for axis in range(AXES):
            more = along[axis, FORCE + k]
            out[3 + axis, k] = more + weight * (out[3 + axis, k] - more) + fall * along[axis, LINEAR] * beyond
