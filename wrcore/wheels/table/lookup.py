"""Exact contact, looked up: lattices of solutions of one wheel on one rail, solved where they are first needed.

A patch consists of lobes: overlaps that lie near each other, or are about to be one, are one. A lobe's place over the
rail decides its contact: its offset t - u; the slope of the wheel's axle; its yaw; the part of the wheel's profile
where it lies; and the depth D that its overlaps imply,

    M0 = sum of int g^2 du,   u = sum of int g^2 u du / M0,   D = (15/16 sqrt(B0) M0)^0.4,

with the gap g along z and u on the wheel's profile: sums that stay smooth where overlaps merge. t is the distance of
the wheel's tape circle from the rail's origin across the track. By itself it is a poor coordinate: in a flange root
that is as round as its rail all numbers change within micrometres of it, as u does by millimetres. On a convex rail u
falls where t grows, and the offset tells the places apart.

Between nodes at no yaw: Catmull-Rom along each of offset, slope and ln D, linear in the other two, the three together
less twice what is linear in all (a Boolean sum, which wants 32 nodes in place of 64 and errs by the product of two
curvatures more). What yaw changes from the middle of a cell is a parabola through three nodes, linear between nodes of
a lattice with twice the steps. A node depends on its place alone, not on what was solved before it. Where the lattice
is too coarse a finer one takes over (:mod:`wrcore.wheels.table.cells`).

References
----------
Gordon, SIAM J. Numer. Anal. 8 (1971) 158 (Boolean sums of interpolations).

A node's numbers (`NUMBERS`) give the normal problem, and the creep force: the creep table at the ellipse of equal
moments, with the creepages scaled so that both slopes at rest are exact, and a remainder in fixed modes over the two
creepages. Spin is no input of its own: a wheel that rolls has the spin of its contact angle, and the remainder is that
of just this spin. It fades out where a wheel slides or stands. Contacts of little and of much spin have a family of
modes each, as what the table lacks differs: a tread's flat patches, a flange's slender and bent ones.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.patch.model import MODES, NODES
from wrcore.contact.search import reduction
from wrcore.contact.search.geometry import LANES
from wrcore.contact.search.strip import gap_at
from wrcore.creep.kalker import coefficients_at
from wrcore.creep.laws import LAWS, creep_force_at
from wrcore.kernels.jit import FAST, FUSED, jit
from wrcore.kernels.lanes import lanes8, load8, put8, take8, total
from wrcore.wheels.table.cells import LEFT, place_of

APART, FAR, SADDLE = 8e-3, 1.4e-2, 2e-5
"""Neighbouring overlaps are one lobe where their distance on the wheel's profile (m) is below the first; or the second,
and the gap between them (m) is nowhere more than the last."""

NARROW, WIDE = (6e-3, 1.4e-2, 1e-5), (1e-2, 1.4e-2, 4e-5)
"""The same in nodes for lobes with others beside them and for lobes alone: nodes about a lobe are of its kind."""

CURVATURE = 2.0
"""B0 of the depth D, 1/m."""

LOG_NORMAL, ANGLE, PLACE_X, PLACE_Y, PLACE_Z, LOG_A, LOG_B, LOG_PEAK, SLOPE_XI, SLOPE_ETA, LINEAR, FORCE = range(12)
ROOT, ROOT_X, ROOT_Y, ROOT_Z, ROOT_ANGLE, ROOT_A, ROOT_B, REST_A, REST_B, PARTED = range(14, 24)
PARTED_FROM, MODE = 16, 24
"""A node: ln(N / (E* D^1.5)); contact angle; place of the slip from the axle's point over the tape circle (m, the last
plus the rolling radius); ln of the semi-axes and of p_max / E*; factors of both creepages, and how far they make
the slopes exact (1; 0 where spin rules); the remainder of Fx, Fy (over mu N) and Mz (over mu N c) at no creepage;
the load in its flange root over N, and, times that, the place (m), angle and ln of the semi-axes of this part less
those of the whole; ln of the semi-axes of the rest less those of the whole, times its load over N; how much their
angles differ, times both loads over N^2 (0: one ellipse stands for both; 1: two do); and its coefficients of both
families' modes. The rows of a cell are its 8 corners; a corner more at either end of its 12 edges; and odd and even
part of what yaw adds at the 8 corners of the cell with twice the steps in which it lies."""

ROOTS = (0.15, 0.25), (0.6, 0.8)
"""Contact angles between which what is pressed goes over from tread to flange root, and from there to the flange."""

BENT = 0.008, 0.025
"""Standard deviation of both parts' contact angles over their load, rad, between which one ellipse goes over to two:
parts that turn against each other spin differently."""

LEAST, LITTLE = 1e-6, 3e-3
"""Load of a part, over N, below which the other part is the whole, and up to which its numbers go over to those of the
whole: interpolated, they are differences of small numbers."""

FLANKS = 0.2, 0.4
"""Contact angles up to which the first family of modes counts alone, and from which on the second one."""

DISK = 0.7
"""Creepages over those of saturation, p, lie in the disk at p / (DISK + sqrt(DISK^2 + p^2)): the less, the finer modes
are where wheels creep little, and the coarser where they slide."""

ROUND = 0.05
"""Where slopes at rest are exact, modes set in from this radius on in the disk of the creepages, to leave them so."""

LOCKED = 0.3
"""Deviation from free rolling at which the remainder has faded out."""

_TABLE = LAWS["table"]


@jit(allocates=False)
def lobe_end(geometry, pose, rows, first, last, limits):
    """End of the lobe of overlaps from ``first``; ``limits`` as `APART`, `FAR`, `SADDLE`."""
    apart, far, saddle = limits
    end = first + 1
    while end < last:
        u, step = rows[end - 1, reduction.U_WHEEL], rows[end, reduction.U_WHEEL] - rows[end - 1, reduction.U_WHEEL]
        if abs(step) >= far:
            break
        if abs(step) >= apart:
            gap = 0.0
            for k in range(1, 16):
                gap = max(gap, gap_at(geometry, pose, u + k / 16.0 * step)[0])
            if gap > saddle:
                break
        end += 1
    return end


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def log_depth_of(pressed):
    """ln D of a lobe, and its place on the wheel's profile, m, from what its overlaps have `Pressed`."""
    return 0.4 * math.log(0.9375 * math.sqrt(CURVATURE) * pressed.square), pressed.moment / pressed.square


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _weights(f):
    """Catmull-Rom's weights of four nodes at f, 0 to 1 between the middle two."""
    g = 1.0 - f
    return -0.5 * f * g * g, 1.0 + f * f * (1.5 * f - 2.5), 1.0 + g * g * (1.5 * g - 2.5), -0.5 * g * f * f


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def along_axis(f, g):
    """Factors along one axis of the lattice: Catmull-Rom's four, and the two each of a straight line in the cell and in
    that with twice the steps."""
    return (*_weights(f), 1.0 - f, f, 1.0 - g, g)


@jit(allocates=False, forceinline=True, fastmath=FAST)
def spread_weights(x, y, z, odd, even, weights):
    """Fill the weights (NODES,) of a cell's rows from the factors along its axes, see `along_axis`, and from yaw's odd
    and even part. Each weight has one factor of each axis."""
    for a in range(2):
        lx, cx = (x[5], x[2]) if a else (x[4], x[1])
        for b in range(2):
            ly, cy, n = (y[5], y[2], 4 * (2 * a + b)) if b else (y[4], y[1], 8 * a)
            along = cx * ly + lx * cy - 2.0 * lx * ly
            weights[n], weights[n + 1] = along * z[4] + lx * ly * z[1], along * z[5] + lx * ly * z[2]
            weights[n + 2], weights[n + 3] = lx * ly * z[0], lx * ly * z[3]
            my, lz = (y[5] if a else y[4]), (z[5] if b else z[4])
            weights[n + 16], weights[n + 17] = my * lz * x[0], my * lz * x[3]
            weights[n + 18], weights[n + 19] = lx * lz * y[0], lx * lz * y[3]
            w = (x[7] if a else x[6]) * (y[7] if b else y[6])
            weights[n + 32], weights[n + 33] = w * z[6] * odd, w * z[6] * even
            weights[n + 34], weights[n + 35] = w * z[7] * odd, w * z[7] * even


@jit(allocates=False, fastmath=FAST)
def weigh(at, weights):
    """Fill the weights (NODES,) of a cell's rows at a `Place` in it."""
    x, y, z = along_axis(at.fx, at.gx), along_axis(at.fy, at.gy), along_axis(at.fz, at.gz)
    spread_weights(x, y, z, 0.5 * at.turn, 0.5 * at.turn * at.turn, weights)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _add_rows(rows, weights, first, end, numbers):
    """Add the weighted sum of a cell's rows to the ``numbers`` from ``first`` to before ``end``: eight at a time."""
    for column in range(first, end, LANES):
        start = np.uint64(column)
        one = two = three = four = lanes8(0.0)
        for n in range(0, NODES, 4):
            one = one + weights[n] * load8(rows, n, start)
            two = two + weights[n + 1] * load8(rows, n + 1, start)
            three = three + weights[n + 2] * load8(rows, n + 2, start)
            four = four + weights[n + 3] * load8(rows, n + 3, start)
        put8(numbers, start, take8(numbers, start) + ((one + two) + (three + four)))


@jit(allocates=False, fastmath=FUSED)
def look_up(rows, weights, numbers):
    """Fill ``numbers`` (NUMBERS,), but for coefficients of modes, from a cell's ``rows`` (NODES, NUMBERS)."""
    numbers[:] = 0.0
    _add_rows(rows, weights, 0, PARTED_FROM, numbers)
    if LEAST < numbers[ROOT] < 1.0 - LEAST:
        _add_rows(rows, weights, PARTED_FROM, MODE, numbers)


@jit(allocates=False, fastmath=FUSED)
def look_modes_up(rows, weights, numbers):
    """As `look_up`, after it: the coefficients of modes that count."""
    for family in range(2):
        if family_share(numbers, family) > 0.0:
            _add_rows(rows, weights, MODE + MODES * family, MODE + MODES * (family + 1), numbers)


@jit(allocates=False, fastmath=FUSED)
def look_shares_up(table, at, shares, weights, numbers):
    """As `look_up` and `look_modes_up` together, from all cells that have a share, see `locate`."""
    numbers[:] = 0.0
    for modes in (False, True):
        _add_share(table, at, modes, weights, numbers)
        for row in range(LEFT):
            if shares[row, 0] > 0.0:
                _add_share(table, place_of(shares[row]), modes, weights, numbers)
    if not LEAST < numbers[ROOT] < 1.0 - LEAST:
        numbers[PARTED_FROM:MODE] = 0.0


@jit(allocates=False, fastmath=FUSED)
def _add_share(table, at, modes, weights, numbers):
    """Add what a cell with a share has in the coefficients of ``modes``, after all else, or in all else."""
    rows = table.cells[at.cell]
    weigh(at, weights)
    for n in range(NODES):
        weights[n] *= at.own
    if modes:
        look_modes_up(rows, weights, numbers)
    else:
        _add_rows(rows, weights, 0, MODE, numbers)


@jit(allocates=False)
def smooth(value, ends):
    """From 0 to 1 between two ends."""
    part = min(max((value - ends[0]) / (ends[1] - ends[0]), 0.0), 1.0)
    return part * part * (3.0 - 2.0 * part)


@jit(allocates=False)
def flank_part(angle):
    """Weight of the second family of modes at a contact angle."""
    return smooth(abs(angle), FLANKS)


@jit(allocates=False, forceinline=True)
def family_share(numbers, family):
    """Weight of a family of modes."""
    part = flank_part(numbers[ANGLE])
    return part if family else 1.0 - part


@jit(allocates=False, forceinline=True)
def round_part(square, linear):
    """Weight of the modes at the square of a radius in the disk; `LINEAR`."""
    return square / (square + max(linear, 0.0) * ROUND * ROUND + 1e-12)  # which a cubic takes below its nodes


@jit(allocates=False, fastmath=FUSED)
def remainder(modes, numbers, x, y):
    """Remainder of Fx, Fy, Mz at creepages over those of saturation."""
    cells, root = modes.shape[1] - 2, 1.0 / (DISK + math.sqrt(DISK * DISK + x * x + y * y))
    p, q = x * root, y * root
    weight, part = round_part(p * p + q * q, numbers[LINEAR]), flank_part(numbers[ANGLE])
    u, v = 0.5 * (p + 1.0) * cells, 0.5 * (q + 1.0) * cells
    i, j = min(int(u), cells - 1), min(int(v), cells - 1)
    f, g = u - i, v - j
    b0, b1, b2 = 0.5 * (1.0 - g) * (1.0 - g), 0.5 + g * (1.0 - g), 0.5 * g * g
    fx = fy = mz = 0.0
    for family in range(2):
        share, first = (part, MODE + MODES) if family else (1.0 - part, MODE)
        if share == 0.0:
            continue
        x_sum = y_sum = z_sum = lanes8(0.0)
        for r in range(3):
            a = 0.5 * (1.0 - f) * (1.0 - f) if r == 0 else 0.5 + f * (1.0 - f) if r == 1 else 0.5 * f * f
            line = modes[family, i + r]
            for s in range(3):
                b = share * a * (b0 if s == 0 else b1 if s == 1 else b2)
                for m in range(0, MODES, LANES):
                    c, at = b * take8(numbers, np.uint64(first + m)), np.uint64(m)
                    x_sum = x_sum + c * load8(line, j + s, at)
                    y_sum = y_sum + c * load8(line, j + s, at + np.uint64(MODES))
                    z_sum = z_sum + c * load8(line, j + s, at + np.uint64(2 * MODES))
        fx, fy, mz = fx + total(x_sum), fy + total(y_sum), mz + total(z_sum)
    rest = 1.0 - weight
    return (
        rest * numbers[FORCE] + weight * fx, rest * numbers[FORCE + 1] + weight * fy,
        rest * numbers[FORCE + 2] + weight * mz,
    )  # fmt: skip


class Slip(NamedTuple):
    """How a wheel slips on its rail at the place of a lobe, over V."""

    xi: float
    eta: float
    phi: float
    """Creepages and spin (1/m), with what friction on other lobes adds."""
    vy: float
    vz: float
    """Of the wheel's point."""
    wx: float
    wy: float
    wz: float
    """Angular velocity, 1/m."""


@jit(allocates=False)
def root_share(angle):
    """Of what is pressed at a contact angle, the share that belongs to the flange root."""
    return smooth(abs(angle), ROOTS[0]) * (1.0 - smooth(abs(angle), ROOTS[1]))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _at_ellipse(model, log_a, log_b, limit, xi, eta, phi):
    """Creep force of the creep table, over mu N and mu N c; look-ups missed; c."""
    c, log_g = math.exp(0.5 * (log_a + log_b)), log_a - log_b
    scale = model.shear_modulus * c * c / limit
    f1, f2, m3, missed = creep_force_at(
        _TABLE, model.creep, log_g, math.exp(log_g), 0.0, xi * scale, eta * scale, phi * scale * c
    )
    return f1, f2, m3, missed, c


@jit(allocates=False, forceinline=True)
def of_load(load):
    """What a part's numbers are multiplied with: 1 over its load over N, unless that is little."""
    return load / (load * load + LITTLE * LITTLE)


@jit(allocates=False, fastmath=FUSED)
def _of_part(model, numbers, slip, xi, eta, limit, load, side, sizes):
    """As `_at_ellipse`, of a part of a lobe with a ``load`` over N, for the creepages ``xi``, ``eta`` of the whole:
    over mu N and m, about the place of the whole, and along the normal of the whole. ``side``: 1 in the flange root, -1
    for the rest; ``sizes``: first of the semi-axes' numbers."""
    each = of_load(load)
    dx, dy, dz = side * each * numbers[ROOT_X], side * each * numbers[ROOT_Y], side * each * numbers[ROOT_Z]
    turned, angle = side * each * numbers[ROOT_ANGLE], numbers[ANGLE]
    log_a, log_b = numbers[LOG_A] + each * numbers[sizes], numbers[LOG_B] + each * numbers[sizes + 1]
    cosine, sine = math.cos(angle), math.sin(angle)
    own_cosine, own_sine = math.cos(angle + turned), math.sin(angle + turned)
    vy, vz = slip.vy + slip.wz * dx - slip.wx * dz, slip.vz + slip.wx * dy - slip.wy * dx
    xi += slip.wy * dz - slip.wz * dy
    eta += vy * own_cosine + vz * own_sine - slip.vy * cosine - slip.vz * sine
    phi = slip.wz * own_cosine - slip.wy * own_sine
    f1, f2, m3, missed, c = _at_ellipse(model, log_a, log_b, load * limit, xi, eta, phi)
    fn = load * f2 * math.sin(turned)
    f1, f2, m3 = load * f1, load * f2 * math.cos(turned), load * m3 * c * math.cos(turned)
    return f1, f2, m3 - f1 * (dy * cosine + dz * sine) + f2 * dx, missed, fn


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def of_two(numbers):
    """Share that two ellipses have in the creep force of a lobe; the rest is one's."""
    root = numbers[ROOT]
    return min(numbers[PARTED] / (root * (1.0 - root)), 1.0) if LEAST < root < 1.0 - LEAST else 0.0


@jit(allocates=False, fastmath=FUSED)
def base_force(model, numbers, slip, xi, eta, limit):
    """Creep force of the creep table at a lobe's ellipse, or at those of its two parts, for creepages ``xi``, ``eta``
    in place of the ``slip``'s, over mu N and mu N c; look-ups missed; c; and what friction in the parts' own planes has
    along the normal of the whole, over mu N."""
    root, log_a, log_b, two = numbers[ROOT], numbers[LOG_A], numbers[LOG_B], of_two(numbers)
    f1 = f2 = m3 = missed = 0.0
    if two < 1.0:
        f1, f2, m3, missed, c = _at_ellipse(model, log_a, log_b, limit, xi, eta, slip.phi)
        if two <= 0.0:
            return f1, f2, m3, missed, c, 0.0
    c = math.exp(0.5 * (log_a + log_b))
    g1, g2, n3, more, gn = _of_part(model, numbers, slip, xi, eta, limit, root, 1.0, ROOT_A)
    h1, h2, o3, most, hn = _of_part(model, numbers, slip, xi, eta, limit, 1.0 - root, -1.0, REST_A)
    one = 1.0 - two
    f1, f2, m3 = one * f1 + two * (g1 + h1), one * f2 + two * (g2 + h2), one * m3 + two * (n3 + o3) / c
    return f1, f2, m3, missed + more + most, c, two * (gn + hn)


@jit(allocates=False, fastmath=FUSED)
def tabulated_force(model, modes, numbers, slip, limit, turning):
    """Creep force Fx, Fy (N), together no more than friction bears, Mz (N m) from a node's numbers, look-ups missed,
    and what friction has along the normal (N): a bent patch's parts have planes of their own. ``turning``: of the
    wheel's rate of rolling over that of free rolling, less 1."""
    part = turning / LOCKED
    fade = max(0.0, 1.0 - part * part)
    fade *= fade
    xi = (1.0 + fade * (numbers[SLOPE_XI] - 1.0)) * slip.xi
    eta = (1.0 + fade * (numbers[SLOPE_ETA] - 1.0)) * slip.eta
    f1, f2, m3, missed, c, fn = base_force(model, numbers, slip, xi, eta, limit)
    scale = model.shear_modulus * c * c / (3.0 * limit)
    c11, c22, _, _ = coefficients_at(numbers[LOG_A] - numbers[LOG_B], model.creep.table.kalker)
    r1, r2, r3 = remainder(modes, numbers, xi * scale * c11, eta * scale * c22)
    fx, fy, mz = f1 + fade * r1, f2 + fade * r2, m3 + fade * r3
    scale = limit / max(math.sqrt(fx * fx + fy * fy), 1.0)
    return scale * fx, scale * fy, limit * c * mz, missed, scale * fn
