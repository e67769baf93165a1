"""Dimensionless numbers that describe the overlap of one contact patch: the inputs of the surrogate.

Contact of two half-spaces lies inside the undeformed overlap, so that the normal problem depends only on the gap over
the overlap. Half-space contact has no intrinsic length scale. With the penetration g normal to a strip, its
width ds and radius R, the weights and scales of a patch are

    q = g^2 ds,   M0 = sum q,   <f> = sum q f / M0,   A = <cos(angle) / (2 R)>,   l = (M0 / A^2)^(1/5)

and e = (s - <s>)/sigma is the place across the patch, with sigma^2 = <(s - <s>)^2>. A parabolic overlap is described by
ln(sigma/l) alone, a one-to-one function of its ratio of curvatures.

==========  =================================================================================================
0           ln(sigma/l)
1 to 16     <phi_j(e)>, quadratic B-splines half a sigma apart, centred at -3.75 to 3.75: form of the overlap
17 to 20    <e^3> to <e^6>
21, 22      <(A(s)/A - 1) e>, <(A(s)/A - 1)(e^2 - 1)>: change of the wheel's radius across the patch
23 to 25    <x>/r0, <(x - <x>) e>/sigma, <(x - <x>)(e^2 - 1)>/l: where strips touch along the rail, by yaw
26 to 28    delta = <angle>, slope of the axle, ln(friction)
29          sin(delta - slope)/friction: in proportion to spin over that of saturation
30 to 33    c_k = <(angle - delta)(e, e^2 - 1, e^3, e^4 - 3)>: how much the patch is bent across
34 to 37    c_k/friction: slip by that over the slip of saturation
==========  =================================================================================================
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.search.geometry import LANES
from wrcore.kernels import lanes
from wrcore.kernels.jit import FUSED, jit

N_DESCRIPTORS, N_SPLINES = 38, 16

_LEAST_FLATNESS = 1e-3
"""Smallest <e^4> - 1 - <e^3>^2, the determinant of the fits of parabolas; 0 only for an overlap of two strips."""


class PatchShape(NamedTuple):
    """Scales of a patch, and parabolas over e of its angle, place along the rail and height."""

    square: float
    """M0, m^3; 0 if there is no overlap."""
    length: float
    """Scale l, m."""
    curvature: float
    """A, 1/m."""
    sigma: float
    """Standard deviation of the place across the patch, m."""
    angle: float
    """Mean inclination delta, rad."""
    lateral: float
    """Rail coordinate of the mean place, m."""
    angle_1: float
    angle_2: float
    """Coefficients of e and e^2 - 1 - <e^3> e in the angle, rad."""
    ahead: float
    ahead_1: float
    ahead_2: float
    """Place along the rail from the wheelset's centre, and its coefficients, m."""
    height: float
    height_1: float
    height_2: float
    """Height over the wheelset's centre, and its coefficients, m."""
    third: float
    """<e^3>."""


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def parabola_at(mean, first, second, third, e, spread):
    """Mean of the parabola with these coefficients over a load that is centred at ``e`` and has the variance
    ``spread``."""
    return mean + (first - second * third) * e + second * (e * e + spread - 1.0)


@jit(allocates=False, fastmath=FUSED)
def _lateral_at(strips, n, arc):
    """Rail coordinate at an arc length, by the cubic through the nodes' places and slopes."""
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if strips.arc[middle] <= arc:
            low = middle
        else:
            high = middle
    step = strips.arc[low + 1] - strips.arc[low]
    t, start, rise = (arc - strips.arc[low]) / step, strips.lateral[low], strips.lateral[low + 1] - strips.lateral[low]
    first, last = strips.cosine[low] * step, strips.cosine[low + 1] * step
    return start + t * (first + t * (3.0 * rise - 2.0 * first - last + t * (first + last - 2.0 * rise)))


class _Means(NamedTuple):
    """Sum of the weights of all strips, m^3, and means over them; ``arc_square`` is that of the square of the arc."""

    total: float
    arc: float
    arc_square: float
    curvature: float
    angle: float
    ahead: float
    height: float


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _means(strips, count):
    """`_Means` of the first ``count`` strips; those after them up to a multiple of eight have no weight."""
    zero = lanes.lanes8(0.0)
    total, arc, arc_square, curvature, angle, ahead, height = zero, zero, zero, zero, zero, zero, zero
    for start in range(0, count, LANES):
        k = np.uint64(start)
        w, s = lanes.take8(strips.weight, k), lanes.take8(strips.arc, k)
        of_arc = w * s
        total, arc, arc_square = total + w, arc + of_arc, arc_square + of_arc * s
        curvature, angle = curvature + w * lanes.take8(strips.curvature, k), angle + w * lanes.take8(strips.angle, k)
        ahead, height = ahead + w * lanes.take8(strips.ahead, k), height + w * lanes.take8(strips.height, k)
    weight = lanes.total(total)
    inverse = 1.0 / weight if weight > 0.0 else 0.0
    return _Means(
        weight, inverse * lanes.total(arc), inverse * lanes.total(arc_square), inverse * lanes.total(curvature),
        inverse * lanes.total(angle), inverse * lanes.total(ahead), inverse * lanes.total(height),
    )  # fmt: skip


class _Moments(NamedTuple):
    """Means of powers of e, and of e, e^2 - 1 and so on times what differs from its mean, see the table above."""

    third: float
    fourth: float
    fifth: float
    sixth: float
    curvature_1: float
    curvature_2: float
    ahead_1: float
    ahead_2: float
    height_1: float
    height_2: float
    angle_1: float
    angle_2: float
    angle_3: float
    angle_4: float


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _moments(strips, count, means, sigma):
    """`_Moments` of the first ``count`` strips."""
    zero = lanes.lanes8(0.0)
    m3, m4, m5, m6, a1, a2, x1 = zero, zero, zero, zero, zero, zero, zero
    x2, z1, z2, c1, c2, c3, c4 = zero, zero, zero, zero, zero, zero, zero
    per_sigma, per_curvature, inverse = 1.0 / sigma, 1.0 / means.curvature, 1.0 / means.total
    for start in range(0, count, LANES):
        k = np.uint64(start)
        w, e = inverse * lanes.take8(strips.weight, k), (lanes.take8(strips.arc, k) - means.arc) * per_sigma
        e2 = e * e
        even, cubic, square = e2 - 1.0, e2 * e, e2 * e2
        w3, w4 = w * cubic, w * square
        m3, m4, m5, m6 = m3 + w3, m4 + w4, m5 + w3 * e2, m6 + w4 * e2
        changed = w * (lanes.take8(strips.curvature, k) * per_curvature - 1.0)
        x, z = w * (lanes.take8(strips.ahead, k) - means.ahead), w * (lanes.take8(strips.height, k) - means.height)
        bent = w * (lanes.take8(strips.angle, k) - means.angle)
        a1, a2, x1, x2 = a1 + changed * e, a2 + changed * even, x1 + x * e, x2 + x * even
        z1, z2, c1, c2 = z1 + z * e, z2 + z * even, c1 + bent * e, c2 + bent * even
        c3, c4 = c3 + bent * cubic, c4 + bent * (square - 3.0)
    return _Moments(
        lanes.total(m3), lanes.total(m4), lanes.total(m5), lanes.total(m6), lanes.total(a1), lanes.total(a2),
        lanes.total(x1), lanes.total(x2), lanes.total(z1), lanes.total(z2), lanes.total(c1), lanes.total(c2),
        lanes.total(c3), lanes.total(c4),
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _fill_splines(strips, count, means, sigma, out):
    """Fill ``out[1 : 1 + N_SPLINES]`` with means of the quadratic B-splines; changes the number before and two after
    them."""
    for j in range(N_SPLINES + 3):
        out[j] = 0.0
    inverse, per_step = 1.0 / means.total, 2.0 / sigma
    for k in range(count):
        place = (strips.arc[k] - means.arc) * per_step + 0.5 * (N_SPLINES - 1)
        if strips.weight[k] != 0.0 and -1.5 < place < N_SPLINES + 0.5:
            j, w = int(place + 2.5) - 2, inverse * strips.weight[k]  # the nearest centre, -1 to N_SPLINES
            t = place - j
            before, after = 0.5 - t, 0.5 + t
            if j >= 0:
                out[j] += 0.5 * w * before * before
            out[1 + j] += w * (0.75 - t * t)
            out[2 + j] += 0.5 * w * after * after


@jit(allocates=False, fastmath=FUSED)
def describe(strips, count, n, rolling_radius, axle_slope, friction, out):
    """Fill the descriptors ``out`` (N_DESCRIPTORS,) of the first ``count`` strips, ``n`` of them at nodes, and return
    the `PatchShape`. ``axle_slope`` is the z component of the axle's direction."""
    means = _means(strips, count)
    variance = means.arc_square - means.arc * means.arc
    if not (means.total > 0.0 and variance > 0.0):
        return PatchShape(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    sigma, curvature, angle = math.sqrt(variance), means.curvature, means.angle
    length = math.exp(0.2 * math.log(means.total / (curvature * curvature)))
    m = _moments(strips, count, means, sigma)
    _fill_splines(strips, count, means, sigma, out)
    per_friction = 1.0 / friction
    out[0] = math.log(sigma / length)
    out[17], out[18], out[19], out[20], out[21], out[22] = (
        m.third, m.fourth, m.fifth, m.sixth, m.curvature_1, m.curvature_2
    )  # fmt: skip
    out[23], out[24], out[25] = means.ahead / rolling_radius, m.ahead_1 / sigma, m.ahead_2 / length
    out[26], out[27], out[28] = angle, axle_slope, math.log(friction)
    out[29] = math.sin(angle - axle_slope) * per_friction
    out[30], out[31], out[32], out[33] = m.angle_1, m.angle_2, m.angle_3, m.angle_4
    for j in range(4):
        out[34 + j] = out[30 + j] * per_friction
    flatness = 1.0 / max(m.fourth - 1.0 - m.third * m.third, _LEAST_FLATNESS)
    return PatchShape(
        means.total, length, curvature, sigma, angle, _lateral_at(strips, n, means.arc), m.angle_1,
        (m.angle_2 - m.third * m.angle_1) * flatness, means.ahead, m.ahead_1,
        (m.ahead_2 - m.third * m.ahead_1) * flatness, means.height, m.height_1,
        (m.height_2 - m.third * m.height_1) * flatness, m.third,
    )  # fmt: skip
