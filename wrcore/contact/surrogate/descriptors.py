"""Dimensionless numbers that describe the overlap of one contact patch: the inputs of the surrogate.

Contact of two half-spaces lies inside the undeformed overlap, so the gap over the overlap tells all that the normal
problem depends on. Half-space contact has no length scale of its own. With the penetration g normal to a strip, its
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
29          sin(delta - slope)/friction: spin over that of saturation
30 to 33    c_k = <(angle - delta)(e, e^2 - 1, e^3, e^4 - 3)>: how much the patch is bent across
34 to 37    c_k/friction: slip by that over the slip of saturation
==========  =================================================================================================
"""

import math
from typing import NamedTuple

from wrcore.kernels.jit import FAST, FUSED, jit

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
    """Mean over a width of the parabola with these coefficients at the place ``e``; ``spread`` is the variance of the
    width."""
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


@jit(allocates=False, fastmath=FAST)
def describe(strips, count, n, rolling_radius, axle_slope, friction, out):
    """Fill the descriptors ``out`` (N_DESCRIPTORS,) of the first ``count`` strips, ``n`` of them at nodes, and return
    the `PatchShape`. ``axle_slope`` is the z component of the axle's direction."""
    total = arc = curvature = angle = ahead = height = 0.0
    for k in range(count):
        w = strips.weight[k]
        total, arc, curvature = total + w, arc + w * strips.arc[k], curvature + w * strips.curvature[k]
        angle, ahead, height = angle + w * strips.angle[k], ahead + w * strips.ahead[k], height + w * strips.height[k]
    variance = 0.0
    inverse = 1.0 / total if total > 0.0 else 0.0
    arc, curvature, angle = arc * inverse, curvature * inverse, angle * inverse
    ahead, height = ahead * inverse, height * inverse
    for k in range(count):
        d = strips.arc[k] - arc
        variance += strips.weight[k] * d * d
    if not (total > 0.0 and variance > 0.0):
        return PatchShape(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    sigma = math.sqrt(variance * inverse)
    length = math.exp(0.2 * math.log(total / (curvature * curvature)))
    m3 = m4 = m5 = m6 = a1 = a2 = x1 = x2 = c1 = c2 = c3 = c4 = z1 = z2 = 0.0
    per_sigma, per_curvature = 1.0 / sigma, 1.0 / curvature
    for k in range(count):
        w, e = strips.weight[k] * inverse, (strips.arc[k] - arc) * per_sigma
        e2 = e * e
        even, cubic, bent = e2 - 1.0, e2 * e, w * (strips.angle[k] - angle)
        m3, m4, m5, m6 = m3 + w * cubic, m4 + w * e2 * e2, m5 + w * cubic * e2, m6 + w * cubic * cubic
        changed, x, z = w * (strips.curvature[k] * per_curvature - 1.0), w * (strips.ahead[k] - ahead), 0.0
        z = w * (strips.height[k] - height)
        a1, a2, x1, x2, z1, z2 = (
            a1 + changed * e,
            a2 + changed * even,
            x1 + x * e,
            x2 + x * even,
            z1 + z * e,
            z2 + z * even,
        )
        c1, c2, c3, c4 = c1 + bent * e, c2 + bent * even, c3 + bent * cubic, c4 + bent * (e2 * e2 - 3.0)
    for j in range(N_DESCRIPTORS):
        out[j] = 0.0
    for k in range(count):
        w = strips.weight[k] * inverse
        if w != 0.0:
            place = 2.0 * (strips.arc[k] - arc) * per_sigma + 0.5 * (N_SPLINES - 1)
            if -1.5 < place < N_SPLINES + 0.5:
                j = int(place + 2.5) - 2  # the nearest centre, -1 to N_SPLINES
                t = place - j
                if j > 0:
                    out[j] += w * 0.5 * (0.5 - t) * (0.5 - t)
                if 0 <= j < N_SPLINES:
                    out[1 + j] += w * (0.75 - t * t)
                if j < N_SPLINES - 1:
                    out[2 + j] += w * 0.5 * (0.5 + t) * (0.5 + t)
    per_friction = 1.0 / friction
    out[0] = math.log(sigma / length)
    out[17], out[18], out[19], out[20], out[21], out[22] = m3, m4, m5, m6, a1, a2
    out[23], out[24], out[25] = ahead / rolling_radius, x1 * per_sigma, x2 / length
    out[26], out[27], out[28] = angle, axle_slope, math.log(friction)
    out[29] = math.sin(angle - axle_slope) * per_friction
    out[30], out[31], out[32], out[33] = c1, c2, c3, c4
    out[34], out[35], out[36], out[37] = c1 * per_friction, c2 * per_friction, c3 * per_friction, c4 * per_friction
    flatness = 1.0 / max(m4 - 1.0 - m3 * m3, _LEAST_FLATNESS)
    return PatchShape(
        total, length, curvature, sigma, angle, _lateral_at(strips, n, arc), c1, (c2 - m3 * c1) * flatness, ahead, x1,
        (x2 - m3 * x1) * flatness, height, z1, (z2 - m3 * z1) * flatness, m3,
    )  # fmt: skip
