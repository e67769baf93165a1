"""Gap and rigid slip of a measured wheel on a measured rail in the contact frame of one patch, strip by strip.

The contact frame (x forward, s lateral, n normal from rail into wheel) has one contact angle per patch. At fixed s the
wheel's height over x is a parabola about the extreme point of the wheel's strip. This point, N_x = 0, is known in
closed form (:mod:`wrcore.contact.search.strip`):

    g(x, s) = g0(s) + A(s) (x - x_c(s))^2,   A = kappa_x / (2 cos(delta_w - delta)),
    kappa_x = cos(alpha)/R (1 - q) + kappa_profile q,   q = sin^2 of the angle between the circle's tangent and x.

In this module s is positive outwards (to the field side) on both wheels, so that a mirrored position is solved by the
same operations.
"""

import math
from typing import NamedTuple

from wrcore.contact.creepage import creepages
from wrcore.contact.search.geometry import SCAN_STEP
from wrcore.contact.search.reduction import (
    ANGLE,
    BEYOND,
    COSINE,
    CURVATURE_Y,
    OUTSIDE,
    PENETRATION,
    SINE,
    U_RAIL,
    U_WHEEL,
    X,
    Y,
    Z,
    edge_by_bracket,
)
from wrcore.contact.search.strip import (
    AHEAD,
    BEND,
    LIFT,
    changes_along,
    cubic_at,
    curvature_at,
    gap_at,
    lean_at,
    leaning,
    on_rail,
    strip_point,
    wheel_slope,
    with_rail_along,
)
from wrcore.kernels.jit import FUSED, jit

JOINED_ANGLE = 0.5
"""Difference of contact angles (rad) below which neighbouring overlaps are one patch with one contact angle."""

JOINED = 8e-3
"""Lateral distance (m) below which overlaps are one patch, as in CONTACT."""

NODES = 48
"""Number of nodes over each overlap at which the gap is evaluated."""

_REACH = 1.4
"""Half of the range over which the contact angle is averaged, over the overlap's half width from its moments."""

# Rows of the nodes over the overlaps.
S, NODE_GAP, NODE_SHAPE, NODE_CREST, NODE_SQUARE, NODE_SHARE = range(6)
NODE_ROWS = 6

# Rows of the strip gap, which `strip_gap` returns.
GAP, GAP_SLOPE, SHAPE, CREST, SHAPE_RATE, CREST_RATE, HEIGHT, TILT, U, UR = range(10)
GAP_ROWS = 10

_STEPS_TO_EDGE = 5
"""Number of steps, each a quarter of a scan step, in the search for an overlap's end from the scan's point next to
it."""

_ANGLE_NODES = 32
"""Nodes over half of each overlap for the mean contact angle; the same number again where the overlap is wider."""

_PROBE = 2e-5
"""Step in u for the derivatives of A and x_c by differences, m."""


class Frame(NamedTuple):
    """Contact frame of a patch, for kernels; lateral coordinates are positive outwards."""

    cosine: float
    sine: float
    """Sine of the contact angle, positive where the rail rises outwards."""
    x: float
    """Longitudinal position of the origin from the wheelset's cross-section, m."""
    ur: float
    """Rail coordinate of the origin, m."""
    z: float
    u: float
    """Wheel coordinate of the origin, m; ``z`` is the origin's height, m."""


@jit(allocates=False)
def group_end(geometry, patches, count, first):
    """Index after the last of the overlaps from ``first`` on that are one patch.

    On a rail that may have several heads, distant overlaps are separate patches (`JOINED`)."""
    last = first + 1
    while last < count and abs(patches[last, ANGLE] - patches[last - 1, ANGLE]) < JOINED_ANGLE:
        if changes_along(geometry) and abs(patches[last, Y] - patches[last - 1, Y]) > JOINED:
            break
        last += 1
    return last


@jit(allocates=False)
def frame_of_overlaps(geometry, pose, patches, first, last):
    """Contact frame of the overlaps ``first`` to ``last`` - 1, at their mean position weighted with g^2.

    Its angle is the mean angle of the surfaces weighted with g^2.5, which is g^2 integrated over the overlap's area.
    With two sub-patches the angle at the mean position would have an error of up to 18 mrad, which would cause errors
    of spin and lateral force."""
    weight = mean = 0.0
    for k in range(first, last):
        row = patches[k]
        _, slope = gap_at(geometry, pose, row[U_WHEEL])
        square = 1.0 / (1.0 + slope * slope)
        width = math.sqrt(row[PENETRATION] * square / row[CURVATURE_Y])
        share = row[PENETRATION] * row[PENETRATION] / square * width
        weight += share
        mean += share * row[U_WHEEL]
    u = mean / weight
    ur, _, radius, slope, _, along = strip_point(geometry, pose, u)
    f, df, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
    angle = _mean_angle(geometry, pose, patches, first, last, math.atan(0.5 * (wheel_slope(pose, slope, along) + df)))
    x = radius * along * pose.q + (geometry.half_distance + u) * pose.ex
    return Frame(math.cos(angle), math.sin(angle), with_rail_along(geometry, AHEAD, ur, 1.0, x), ur, f, u)


@jit(allocates=False)
def frame_of_rows(patches, first, last):
    """Contact frame of the overlaps ``first`` to ``last`` - 1 from their rows: means weighted with g^2.5.

    `frame_of_overlaps` is more accurate, and evaluates the surfaces."""
    if last == first + 1:
        one = patches[first]
        return Frame(one[COSINE], one[SINE], one[X], one[U_RAIL], one[Z], one[U_WHEEL])
    weight = angle = x = ur = z = u = 0.0
    for k in range(first, last):
        row = patches[k]
        share = row[PENETRATION] * row[PENETRATION] * math.sqrt(row[PENETRATION] / row[CURVATURE_Y])
        weight, angle, x = weight + share, angle + share * row[ANGLE], x + share * row[X]
        ur, z, u = ur + share * row[U_RAIL], z + share * row[Z], u + share * row[U_WHEEL]
    angle /= weight
    return Frame(math.cos(angle), math.sin(angle), x / weight, ur / weight, z / weight, u / weight)


@jit(allocates=False)
def _mean_angle(geometry, pose, patches, first, last, otherwise):
    """Mean angle of wheel and rail over the overlaps, rad; ``otherwise`` if no node is in overlap."""
    weight = mean = 0.0
    for k in range(first, last):
        row = patches[k]
        slope = gap_at(geometry, pose, row[U_WHEEL])[1]
        width = math.sqrt(row[PENETRATION] / (row[CURVATURE_Y] * (1.0 + slope * slope)))
        for direction in (-1.0, 1.0):
            step = direction * _REACH * width / _ANGLE_NODES
            for i in range(2 * _ANGLE_NODES):
                u = row[U_WHEEL] + (i + 0.5) * step
                ur, z, _, slope, _, along = strip_point(geometry, pose, u)
                f, df, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
                depth = f - z
                off = not row[OUTSIDE] < u < row[BEYOND] or not on_rail(geometry, ur)  # curves are extrapolated
                if off or (i >= _ANGLE_NODES and depth <= 0.0):
                    break
                if depth > 0.0:
                    both = 0.5 * (wheel_slope(pose, slope, along) + df)
                    depth /= math.sqrt(1.0 + both * both)
                    share = depth * depth * math.sqrt(depth) * width
                    weight += share
                    mean += share * math.atan(both)
    return mean / weight if weight > 0.0 else otherwise


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _shape_at(geometry, pose, tangent, u, ur, radius, slope, along, m):
    """Curvature A (1/m) and x of the minimum gap (m, from the wheelset's cross-section) of the wheel's strip at u, over
    ur."""
    rise = (m - tangent) / (1.0 + m * tangent)
    cosine = 1.0 / math.sqrt(1.0 + slope * slope)
    kappa = cosine / radius
    if pose.tilt != 0.0:
        cross = 1.0 - pose.q * pose.q * (1.0 - along * along)
        profile = -curvature_at(geometry.wheel, geometry.wheel_start, geometry.wheel_step, u)
        kappa += (profile * cosine * cosine * cosine - kappa) * cross
    secant = math.sqrt(1.0 + rise * rise)  # 1/cos(delta_w - delta)
    shape = with_rail_along(geometry, BEND, ur, secant / math.sqrt(1.0 + m * m), 0.5 * kappa * secant)
    crest = radius * along * pose.q + (geometry.half_distance + u) * pose.ex
    return shape, with_rail_along(geometry, AHEAD, ur, 1.0, crest)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def strip_gap(geometry, pose, frame, s, u, ur):
    """Gap of the strip at ``s`` (m, outwards) from the guesses ``u`` and ``ur`` of its wheel and rail coordinates (m).

    A strip's plane lies midway between wheel and rail. Returns g0 (m) along the normal of the strip's plane and its
    slope over s; A (1/m), also along this normal, and x_c (m); the slopes of both over s; the height (m) of the wheel's
    extreme point along n; the slope over s of the strip's plane; u and ur as guesses for the next strip."""
    tangent = frame.sine / frame.cosine
    here = normal = rise = radius = slope = second = along = height = m = 0.0
    rate = 1.0
    for _ in range(6):
        across, height, radius, slope, second, along = strip_point(geometry, pose, u)
        m = wheel_slope(pose, slope, along)
        y, z = across - frame.ur, height - frame.z
        here, normal = y * frame.cosine + z * frame.sine, z * frame.cosine - y * frame.sine
        rise = (m - tangent) / (1.0 + m * tangent)
        down = math.sqrt(max(1.0 - along * along, 1e-6))
        dy = down * pose.y_down + along * pose.y_along
        rate = pose.ey + slope * dy + radius * pose.tilt * second * (pose.y_along - along / down * pose.y_down)
        if abs(s - here) < 1e-8:
            break
        u += (s - here) / (pose.side * rate * (frame.cosine + m * frame.sine))
    top = normal + (s - here) * rise
    rate = pose.side * rate * (frame.cosine + m * frame.sine)
    shape, crest = _shape_at(geometry, pose, tangent, u, across, radius, slope, along, m)
    across, _, radius, slope, _, along = strip_point(geometry, pose, u + _PROBE)
    m = wheel_slope(pose, slope, along)
    shape_rate, crest_rate = _shape_at(geometry, pose, tangent, u + _PROBE, across, radius, slope, along, m)
    inverse = 1.0 / (_PROBE * rate)
    shape_rate, crest_rate = (shape_rate - shape) * inverse, (crest_rate - crest) * inverse
    crest -= frame.x
    fall = 0.0
    for _ in range(6):
        f, m, _ = cubic_at(geometry.rail, geometry.rail_start, geometry.rail_step, ur)
        y, z = ur - frame.ur, f - frame.z
        here, normal = y * frame.cosine + z * frame.sine, z * frame.cosine - y * frame.sine
        fall = (m - tangent) / (1.0 + m * tangent)
        if abs(s - here) < 1e-8:
            break
        ur += (s - here) / (frame.cosine + m * frame.sine)
    tilt = 0.5 * (rise + fall)
    lean = 1.0 / math.sqrt(1.0 + tilt * tilt)
    gap, slope = (top - normal - (s - here) * fall) * lean, (rise - fall) * lean
    top = with_rail_along(geometry, LIFT, ur, frame.cosine, top)
    return gap, slope, shape * lean, crest, shape_rate * lean, crest_rate, top, tilt, u, ur


@jit(allocates=False)
def _edge_of(geometry, pose, outside, step):
    """Wheel coordinate of an overlap's end (m), by steps from a point ``outside`` next to it.

    Returns ``outside`` if no step is in overlap: an overlap can lie between two steps, and a row can contain several
    overlaps with gaps between them."""
    u = outside
    for _ in range(_STEPS_TO_EDGE):
        u += step
        if gap_at(geometry, pose, u)[0] < 0.0:
            return edge_by_bracket(geometry, pose, u - step, u)
    return outside


@jit(allocates=False)
def look_over_overlaps(geometry, pose, frame, patches, first, last, nodes, ends):
    """Evaluate the gap at nodes over the overlaps of a patch, from the inside outwards.

    Fills s (m), gap (m), A (1/m) and x of the minimum gap (m) of ``nodes`` (NODE_ROWS, n), and ``ends`` with the number
    of nodes up to the end of each overlap. Nodes of one overlap have equal steps in u. Returns the number of
    overlaps."""
    count = 0
    for k in range(first, last):
        low = _edge_of(geometry, pose, patches[k, OUTSIDE], SCAN_STEP / 4.0)
        high = _edge_of(geometry, pose, patches[k, BEYOND], -SCAN_STEP / 4.0)
        for i in range(NODES):  # the first and the last half a step outside
            u = low + (high - low) * (i - 0.5) / (NODES - 2)
            _fill_node(geometry, pose, frame, u, nodes, count)
            count += 1
        ends[k - first] = count
    return last - first


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _fill_node(geometry, pose, frame, u, nodes, k):
    """Fill s, gap, A and x of the minimum gap at node k, for the wheel's strip at ``u``.

    They come from the vertical gap, with errors beyond second order in the overlap."""
    ur, z, radius, slope, _, along = strip_point(geometry, pose, u)
    gap, df = gap_at(geometry, pose, u)
    nodes[S, k] = (ur - frame.ur) * frame.cosine + (z - frame.z) * frame.sine
    tangent = frame.sine / frame.cosine
    fall = (df - tangent) / (1.0 + df * tangent)
    m = wheel_slope(pose, slope, along)
    rise = (m - tangent) / (1.0 + m * tangent)
    tilt = 0.5 * (rise + fall)
    lean = 1.0 / math.sqrt(1.0 + tilt * tilt)
    nodes[NODE_GAP, k] = gap * (frame.cosine - frame.sine * fall) * lean
    shape = 0.5 * lean * math.sqrt((1.0 + rise * rise) / (1.0 + slope * slope)) / radius
    upright = lean * math.sqrt((1.0 + rise * rise) / (1.0 + m * m))
    nodes[NODE_SHAPE, k] = with_rail_along(geometry, BEND, ur, upright, shape)
    crest = radius * along * pose.q + (geometry.half_distance + u) * pose.ex - frame.x
    nodes[NODE_CREST, k] = with_rail_along(geometry, AHEAD, ur, 1.0, crest)


@jit(allocates=False, fastmath=FUSED)
def unroll(centre, width, tilt, place, own):
    """Fill ``place`` and ``own`` with positions and widths (m) of the strips, measured over their inclined planes."""
    for i in range(len(centre)):
        own[i] = width[i] * math.sqrt(1.0 + tilt[i] * tilt[i])
        place[i] = centre[0]
        if i > 0:
            place[i] = place[i - 1] + centre[i] - centre[i - 1] + 0.5 * (own[i] - width[i] + own[i - 1] - width[i - 1])


@jit(allocates=False, forceinline=True)
def lean_of(geometry, pose, frame):
    """Cosine and sine of the angle of a patch about the axle, see `wrcore.contact.search.strip.lean_at`."""
    return lean_at(geometry, frame.ur, with_rail_along(geometry, LIFT, frame.ur, 1.0, frame.z) - pose.z)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def material_point(geometry, pose, frame, s, x, height, tilt):
    """Point of a left wheel's undeformed surface on a strip, and the angle of the strip's plane.

    Returns x, y, z from the wheelset's centre (m), in axes rotated by `lean_of`, and cosine and sine of the angle."""
    cosine = 1.0 / math.sqrt(1.0 + tilt * tilt)
    across = frame.ur + geometry.rail_distance + s * frame.cosine - height * frame.sine
    z = frame.z + s * frame.sine + height * frame.cosine
    cosine, sine = cosine * (frame.cosine - frame.sine * tilt), cosine * (frame.sine + frame.cosine * tilt)
    px, pz = leaning(geometry, lean_of(geometry, pose, frame), frame.x + x, z - pose.z)
    return px, across - pose.y, pz, cosine, sine


@jit(allocates=False, fastmath=FUSED)
def rigid_slip(geometry, pose, frame, velocity, centre, middle, height, tilt, slip):
    """Fill ``slip`` (4, n) with the rigid slip of a left wheel over its rail at the middles of the strips.

    ``velocity``: vx, vy, vz (m/s) of the wheelset's centre, wx, wy, wz (rad/s), rolling speed V > 0 (m/s), in axes
    rotated by `lean_of`. Strips (n,): s, X, height of the wheel's extreme point along n (m), slope of their planes over
    s. Rows of ``slip``: velocity of the wheel's material point relative to that of the rail, over V, along x; its slope
    over x (1/m); then both across, in the strip's plane. The point lies on the undeformed surface, as in CONTACT: equal
    bodies shorten equally under pressure."""
    vx, vy, vz, wx, wy, wz, speed = velocity
    for i in range(len(centre)):
        px, py, pz, cosine, sine = material_point(geometry, pose, frame, centre[i], middle[i], height[i], tilt[i])
        xi, eta, phi, _ = creepages(vx, vy, vz, wx, wy, wz, px, py, pz, cosine, sine, speed)
        slip[0, i], slip[1, i], slip[2, i], slip[3, i] = xi, 0.0, eta, phi


@jit(allocates=False, fastmath=FUSED)
def strip_wrenches(geometry, pose, frame, centre, middle, height, tilt, load, force, share, pressure, friction):
    """Add ``share`` times the wrenches of the strips to ``pressure`` and ``friction``, about the wheelset's centre.

    Axes are rotated by `lean_of`. The load (along n, N) acts along the normal of each strip's plane, n - tilt s, in
    agreement with the gap along n. The wrench of friction is the transpose of `rigid_slip`, so that its power equals
    that of the slip. ``force`` (3, n): forces along x and across, N, and the moment of the second about the strip's
    middle, N m."""
    for i in range(len(centre)):
        px, py, pz, cosine, sine = material_point(geometry, pose, frame, centre[i], middle[i], height[i], tilt[i])
        fx, fs, turn = share * force[0, i], share * force[1, i], share * force[2, i]
        add_force(px, py, pz, fx, fs * cosine, fs * sine, friction)
        friction[4] -= turn * sine
        friction[5] += turn * cosine
        along = share * load[i] * math.sqrt(1.0 + tilt[i] * tilt[i])
        add_force(px, py, pz, 0.0, -along * sine, along * cosine, pressure)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def add_force(px, py, pz, fx, fy, fz, wrench):
    """Add a force (N) at a point (m) to a ``wrench`` of force (N) and moment about the origin (N m)."""
    wrench[0] += fx
    wrench[1] += fy
    wrench[2] += fz
    wrench[3] += py * fz - pz * fy
    wrench[4] += pz * fx - px * fz
    wrench[5] += px * fy - py * fx
