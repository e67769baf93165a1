"""The gap of a real wheel over a real rail in the frame of one patch, strip by strip, and its rigid slip.

The contact frame (x forward, s lateral, n normal from rail into wheel) has one contact angle per patch. At fixed s the
wheel's height over x is a parabola about the extreme point of the wheel's strip there, the locus N_x = 0 that spatial
detection has in closed form (:mod:`wrcore.contact.search.strip`):

    g(x, s) = g0(s) + A(s) (x - x_c(s))^2,   A = kappa_x / (2 cos(delta_w - delta)),
    kappa_x = cos(alpha)/R (1 - q) + kappa_profile q,   q = sin^2 of the angle between the circle's tangent and x.

Inside, s counts outwards (to the field side) on both wheels, so that a mirrored pose is solved by the same operations.
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
"""Neighbouring overlaps whose planes differ by less (rad) are one patch with one contact angle."""

JOINED = 8e-3
"""Overlaps that are closer than this across share a patch, as in CONTACT, m."""

NODES = 48
"""Nodes over each overlap at which the gap is looked at."""

_REACH = 1.4
"""Half of the range that the mean contact angle is over, over the half width that the overlap's moments give."""

# Rows of the nodes over the overlaps.
S, NODE_GAP, NODE_SHAPE, NODE_CREST, NODE_SQUARE, NODE_SHARE = range(6)
NODE_ROWS = 6

# Rows of the strip gap: what `strip_gap` fills.
GAP, GAP_SLOPE, SHAPE, CREST, SHAPE_RATE, CREST_RATE, HEIGHT, TILT, U, UR = range(10)
GAP_ROWS = 10

_STEPS_TO_EDGE = 5
"""Quarters of a scan step in which an overlap's end is sought from the scan's point next to it."""

_ANGLE_NODES = 32
"""Nodes over half of each overlap for the mean contact angle, over its half width; as many again where it goes on."""

_PROBE = 2e-5
"""Step in u for the rates of A and x_c, m."""


class Frame(NamedTuple):
    """Contact frame of a patch, for kernels; lateral coordinates count outwards."""

    cosine: float
    sine: float
    """Of the contact angle, positive where the rail rises outwards."""
    x: float
    """Origin, m: from the wheelset's cross-section."""
    ur: float
    """Origin: rail coordinate."""
    z: float
    u: float
    """Wheel coordinate of the origin."""


@jit(allocates=False)
def group_end(geometry, patches, count, first):
    """End of the run of overlaps, from ``first``, that are one patch; where a rail may have several heads they are not
    if they lie far apart."""
    last = first + 1
    while last < count and abs(patches[last, ANGLE] - patches[last - 1, ANGLE]) < JOINED_ANGLE:
        if changes_along(geometry) and abs(patches[last, Y] - patches[last - 1, Y]) > JOINED:
            break
        last += 1
    return last


@jit(allocates=False)
def frame_of_overlaps(geometry, pose, patches, first, last):
    """Contact frame of the overlaps from ``first`` to before ``last``, at the lateral mean of g^2 over all of them.

    Its angle is the mean of that of the surfaces over g^2.5, which is g^2 over the overlap's area. Where a patch has
    two lobes the angle at the mean place is off by up to 18 mrad, and spin and lateral force with it."""
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
    """As `frame_of_overlaps`, from the rows alone: means over g^2.5 of what they have at their deepest points."""
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
    """Mean of the angle of wheel and rail over the overlaps, rad."""
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
                off = not row[OUTSIDE] < u < row[BEYOND] or not on_rail(geometry, ur)  # past its end a curve goes on
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
    """A (1/m) and the x of the least gap (m, from the wheelset's cross-section) of the wheel's strip at u, over ur."""
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
    """Gap of the strip at ``s`` (m, outwards) from guesses of its wheel and rail coordinates (m).

    Returns g0 (m) along the normal of the strip's own plane and its slope over s, A (1/m) likewise and x_c (m), the
    slopes of both over s, the height (m) of the wheel's extreme point along n, the slope over s of the strip's own
    plane (midway between wheel and rail), u and ur for the next strip."""
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
    """u of an overlap's end, m, from a point ``outside`` next to it in steps towards it; that point where none is seen:
    an overlap may hide between two, and a row have air between several."""
    u = outside
    for _ in range(_STEPS_TO_EDGE):
        u += step
        if gap_at(geometry, pose, u)[0] < 0.0:
            return edge_by_bracket(geometry, pose, u - step, u)
    return outside


@jit(allocates=False)
def look_over_overlaps(geometry, pose, frame, patches, first, last, nodes, ends):
    """Gap at nodes over the overlaps of a patch, outwards: fills s, gap (m), A (1/m) and x of the least gap (m) of
    ``nodes`` (NODE_ROWS, n), and ``ends`` with the number of nodes up to the end of each stretch of equal steps in u.
    Returns the number of stretches."""
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
    """Node k: s, gap, A and crest of the wheel's strip at u, from the vertical gap (right to second order of the
    overlap)."""
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
    """Fill the places and widths (m) that strips have along their own planes, where they carry and roll."""
    for i in range(len(centre)):
        own[i] = width[i] * math.sqrt(1.0 + tilt[i] * tilt[i])
        place[i] = centre[0]
        if i > 0:
            place[i] = place[i - 1] + centre[i] - centre[i - 1] + 0.5 * (own[i] - width[i] + own[i - 1] - width[i - 1])


@jit(allocates=False, forceinline=True)
def lean_of(geometry, pose, frame):
    """`lean_at` of a patch."""
    return lean_at(geometry, frame.ur, with_rail_along(geometry, LIFT, frame.ur, 1.0, frame.z) - pose.z)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def material_point(geometry, pose, frame, s, x, height, tilt):
    """Point of a left wheel's undeformed surface on a strip, from the wheelset's centre, and its own plane's angle, in
    axes that lean as the patch does."""
    cosine = 1.0 / math.sqrt(1.0 + tilt * tilt)
    across = frame.ur + geometry.rail_distance + s * frame.cosine - height * frame.sine
    z = frame.z + s * frame.sine + height * frame.cosine
    cosine, sine = cosine * (frame.cosine - frame.sine * tilt), cosine * (frame.sine + frame.cosine * tilt)
    px, pz = leaning(geometry, lean_of(geometry, pose, frame), frame.x + x, z - pose.z)
    return px, across - pose.y, pz, cosine, sine


@jit(allocates=False, fastmath=FUSED)
def rigid_slip(geometry, pose, frame, velocity, centre, middle, height, tilt, slip):
    """Rigid slip of a left wheel's over its rail's surface at the strips' middles, from the wheelset's motion.

    ``velocity``: vx, vy, vz (m/s) of the wheelset's centre, wx, wy, wz (rad/s), rolling speed V > 0 (m/s), in axes that
    lean as the patch does. Strips (n,):
    s, X, height of the wheel's extreme point along n (m), slope of their own planes over s. Fills ``slip`` (4, n):
    velocity of the wheel's material point relative to the rail's over V along x, its slope over x (1/m), and both
    across in the strip's own plane. That point lies on the undeformed surface, as in CONTACT: equal bodies shorten
    alike under pressure."""
    vx, vy, vz, wx, wy, wz, speed = velocity
    for i in range(len(centre)):
        px, py, pz, cosine, sine = material_point(geometry, pose, frame, centre[i], middle[i], height[i], tilt[i])
        xi, eta, phi, _ = creepages(vx, vy, vz, wx, wy, wz, px, py, pz, cosine, sine, speed)
        slip[0, i], slip[1, i], slip[2, i], slip[3, i] = xi, 0.0, eta, phi


@jit(allocates=False, fastmath=FUSED)
def strip_wrenches(geometry, pose, frame, centre, middle, height, tilt, load, force, share, pressure, friction):
    """Add ``share`` of the wrenches of pressure and friction on the strips, about the wheelset's centre, in axes that
    lean as the patch does.

    The load (along n, N) acts along the normal of each strip's own plane, as the gap along n has it: n - tilt s. For
    friction this is `rigid_slip`, transposed: it takes from the wheelset what it does on the slip. ``force``, (3, n):
    along x and across, N, and the moment of the latter about the strip's middle, N m."""
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
    """Add a force at a point to a wrench."""
    wrench[0] += fx
    wrench[1] += fy
    wrench[2] += fz
    wrench[3] += py * fz - pz * fy
    wrench[4] += pz * fx - px * fz
    wrench[5] += px * fy - py * fx
