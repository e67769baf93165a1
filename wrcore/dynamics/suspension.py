"""Force elements between two bodies, evaluated pair by pair.

All elements between one first body i and one second body j share the relative motion of the two, which is computed
once in the axes of j: with A the rotation matrices, r the positions, v the velocities and w the angular velocities,

    R = Aj^T Ai,  rho = Aj^T (ri - rj),  u = Aj^T (vi - vj - wj x (ri - rj)),  W = Aj^T (wi - wj).

A marker m of i and a marker n of j are then apart by d = rho + R m - n, at the rate d' = u + W x R m. A force F on i
acts at i's marker; the opposite force acts on j at that same point, so that the pair gains neither angular momentum
nor, without dampers, energy: with U(d) the spring's energy, F = -dU/dd is its force along the axes of j exactly. The
same holds for rotation stiffnesses (kx, ky, kz) about the axes of j: their moment is that of the energy

    U(R) = c . (1 - diag R),   cx = (ky + kz - kx)/2 and so on,

which is kx roll^2/2 + ky pitch^2/2 + kz yaw^2/2 for small angles and kx (1 - cos roll) for a rotation about x alone.
Cubic stiffnesses hx, hy, hz add hx Tx^2 + hy Ty^2 + hz Tz^2 with Tx = (1 + Rxx - Ryy - Rzz)/2 and so on, which is what
a stiffness of 1 stores: to kx they add 2 hx Tx, for small angles hx roll^2.

Friction whose limit L is its own plus mu times the force N that presses in another element of the same pair sticks
and slips by one of two laws, both with a displacement as own state. A *slider* at s behind a stiffness c holds
f = c (x - s) and goes along with what pulls it from a width w below L on, s' = x' (g - L + w)/w with g = f sign(x'):
at L as fast as x, at any speed. Where L falls, (|f| - L) sign(f)/(c T) comes on top, T being a millisecond, so that f
follows at rest, too. Both parts take energy. *Approach* is Fancher's
exponential one to the envelope within a distance b, f = L z/b with z' = x' - |x'| z/b: without reversal f - L falls by
1/e in b, at any speed. At a constant L it stores L z^2/(2 b) and loses L |x'| (z/b)^2. A link of length l that hangs
under N adds N x/l.

The angular velocity w of a wheelset leaves out the spin (its frame does not spin, see wrcore.dynamics.body).

References
----------
Fancher, Ervin, MacAdam, Winkler, Measurement and representation of the mechanical properties of truck leaf springs,
SAE technical paper 800905 (1980): the approach. Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14
(1976) 1675-1682: the same as a differential equation. Iwnicki, Stichel, Orlova, Hecht, Dynamics of railway freight
vehicles, Vehicle System Dynamics 53 (2015) 995-1033: a spring and a slider in series, both laws for leaf springs and
links, friction by the load in Lenoir links and wedges.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.marker import FRAME
from wrcore.dynamics.track import moving_frame
from wrcore.kernels.jit import FUSED, jit

LINEAR, DISPLACEMENT, VELOCITY, CUBIC, SERIES, SERIES_VELOCITY, SLIDER, APPROACH = range(8)
"""Laws of an element that acts along one direction; from SERIES on with an own state, from SLIDER on with a limit."""

ROUNDING, FLOOR = 0.02, 1e-3
"""Width w below a slider's limit: part of the limit, and of that in nominal position (or of 1 N) at least."""

GIVING_WAY = 1e-3
"""T: time in which a slider at rest gives way where its limit has fallen, s."""

LINE = 3
"""Direction along the line between the markers; 0, 1 and 2 are the axes of the second body."""


class Elements(NamedTuple):
    """Force elements of a model, sorted by pair, for kernels."""

    pairs: np.ndarray
    """(p, 2) int: first and second body; FRAME as the second one for the moving frame."""
    ahead: np.ndarray
    """(p,): for the moving frame, arc length of its cross-section ahead of the frame's origin, m."""
    turning: np.ndarray
    """(p, 3, 3): factors c of the energy U(R) (N m/rad), damping (N m s/rad) and cubic stiffness (N m/rad^3) about
    the second body's axes."""
    first_spring: np.ndarray
    """(p + 1,) int: springs k of pair p have first_spring[p] <= k < first_spring[p + 1]."""
    springs: np.ndarray
    """(n, 15): along all three axes; marker of i, position relative to j at which the element is at rest (m),
    stiffness (N/m), damping (N s/m), preload (N, on i)."""
    first_directed: np.ndarray
    """(p + 1,) int, as first_spring."""
    directed: np.ndarray
    """(m, 10): along one direction; marker of i, marker of j or rest position (m), length at rest (LINE only, m),
    stiffness (N/m; of the series spring for series laws and SLIDER; APPROACH: N/(L l), 1/m), damping (N s/m;
    APPROACH: distance b, m), preload (N; positive pushes i along the direction)."""
    law: np.ndarray
    """(m, 5) int: direction, law, first and last + 1 point of the characteristic, number of the element's own state.
    From SLIDER on, not the last point but the element that presses: a spring, -1 for none, or -2 - k for the k-th along
    one direction."""
    table: np.ndarray
    """(q, 2): points of all characteristics: displacement or speed and force; SERIES_VELOCITY: force and speed; CUBIC:
    cubic stiffness (N/m^3), 0; with a limit: its own part (N) and the whole of it in nominal position (N), then mu for
    a pressing force that is positive and for one that is negative."""
    states: int
    """Number of own states: displacements (m) of dampers that act in series with a spring; and what else is counted
    with them, see `wrcore.dynamics.system.fill_derivatives`."""


def pack_elements(springs=(), directed=(), turning=()):
    """Sort elements by pair (first body, second body, ahead).

    ``springs``: (pair, the 15 numbers of a row of ``Elements.springs``). ``directed``: (pair, the 10 of
    ``Elements.directed``, direction, law, points (q, 2) of the characteristic or None, the element that presses: None,
    or (0, k) and (1, k) for the k-th of ``springs`` and of ``directed``). ``turning``: (pair, stiffness, damping, cubic
    stiffness) against relative rotation about the second body's axes, three numbers each; summed pair by pair.
    """
    pairs = sorted({item[0] for group in (springs, directed, turning) for item in group})
    orders = [sorted(range(len(group)), key=lambda k: group[k][0]) for group in (springs, directed)]
    springs, directed = ([group[k] for k in order] for group, order in zip((springs, directed), orders, strict=True))
    rotational = np.zeros((len(pairs), 3, 3))
    for pair, stiffness, damping, cubic in turning:
        rotational[pairs.index(pair)] += (0.5 * np.sum(stiffness) - np.asarray(stiffness, float), damping, cubic)
    points, laws, states = [], [], 0
    for _, _, direction, law, polygon, pressing in directed:
        own = states if law >= SERIES else -1
        states += own >= 0
        start = len(points)
        points += [] if polygon is None else list(polygon)
        last = len(points)
        if law >= SLIDER:
            number = -1 if pressing is None else orders[pressing[0]].index(pressing[1])
            last = -2 - number if pressing is not None and pressing[0] == 1 else number
        laws.append((direction, law, start, last, own))
    first_spring, first_directed = (
        np.array([sum(item[0] < pair for item in group) for pair in pairs] + [len(group)], np.int64)
        for group in (springs, directed)
    )
    return Elements(
        np.array([pair[:2] for pair in pairs], np.int64).reshape(-1, 2), np.array([pair[2] for pair in pairs], float),
        rotational,
        first_spring, np.array([row for _, row in springs], float).reshape(-1, 15),
        first_directed, np.array([item[1] for item in directed], float).reshape(-1, 10),
        np.array(laws, np.int64).reshape(-1, 5), np.array(points, float).reshape(-1, 2), states,
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def characteristic(table, first, last, x):
    """Value at x of the polygon through the points ``first`` to ``last - 1``, continued with its outer slopes."""
    k = first
    while k < last - 2 and x > table[k + 1, 0]:
        k += 1
    return table[k, 1] + (x - table[k, 0]) * (table[k + 1, 1] - table[k, 1]) / (table[k + 1, 0] - table[k, 0])


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _directed_force(elements, k, stretch, speed, state, own):
    """Force against stretch and speed of the k-th element along one direction, and the rate of its own state."""
    row, law = elements.directed[k], elements.law[k]
    if law[1] == SERIES:
        force = row[7] * (stretch - state[own + law[4]])
        return force - row[9], force / row[8]
    if law[1] == SERIES_VELOCITY:
        force = row[7] * (stretch - state[own + law[4]])
        return force - row[9], characteristic(elements.table, law[2], law[3], force)
    force = row[7] * stretch + row[8] * speed - row[9]
    if law[1] == DISPLACEMENT:
        force += characteristic(elements.table, law[2], law[3], stretch)
    elif law[1] == VELOCITY:
        force += characteristic(elements.table, law[2], law[3], speed)
    elif law[1] == CUBIC:
        force += elements.table[law[2], 0] * stretch * stretch * stretch
    return force, 0.0


@jit(allocates=False, fastmath=FUSED)
def friction_limit(elements, k, rotation, place, velocity, turn):
    """Force at which the k-th element along one direction, one with a limit, slips, N; R, rho (m), u (m/s) and W
    (rad/s) of its pair as tuples."""
    first, other = elements.law[k, 2], elements.law[k, 3]
    if other == -1:
        return elements.table[first, 0]
    x, y, z = rotation
    row = elements.springs[other] if other >= 0 else elements.directed[-2 - other]
    bx = x[0] * row[0] + x[1] * row[1] + x[2] * row[2]
    by = y[0] * row[0] + y[1] * row[1] + y[2] * row[2]
    bz = z[0] * row[0] + z[1] * row[1] + z[2] * row[2]
    if other >= 0:
        stretch, along = place[2] + bz - row[5], velocity[2] + turn[0] * by - turn[1] * bx
        press = row[14] - row[8] * stretch - row[11] * along
    else:
        ends = place[0] + bx - row[3], place[1] + by - row[4], place[2] + bz - row[5]
        law = elements.law[-2 - other]
        press = -characteristic(elements.table, law[2], law[3], ends[law[0]])
    mu = elements.table[first + 1]
    return elements.table[first, 0] + max(mu[0] * press, -mu[1] * press)


@jit(allocates=False, fastmath=FUSED)
def friction_force(elements, k, stretch, speed, inner, limit):
    """Force against stretch and speed of the k-th element, one with a limit, and the rate of its state ``inner``."""
    row, nominal = elements.directed[k], elements.table[elements.law[k, 2], 1]
    if elements.law[k, 1] == APPROACH:
        return limit * (inner / row[8] + row[7] * stretch), speed - abs(speed) * inner / row[8]
    force, width = row[7] * (stretch - inner), max(ROUNDING * limit, FLOOR * max(nominal, 1.0))
    pulled = math.copysign(1.0, speed) * force
    slip = speed * max(pulled - max(limit - width, 0.0), 0.0) / width
    return force, slip + math.copysign(max(abs(force) - limit, 0.0), force) / (GIVING_WAY * row[7])


@jit(allocates=False, fastmath=FUSED)
def element_forces(elements, track, t, speed, state, rotations, turns, wrenches, rate):
    """Add the forces of all elements to the ``wrenches`` (n, 6) of the bodies (about centres of mass, track axes) and
    write the rates of the elements' own states (m/s) at their places in ``rate``.

    ``rotations`` (n + 1, 3, 3) end with the moving frame's; ``turns`` (n, 3) are the angular velocities of the bodies'
    frames in track axes, rad/s; ``speed`` is the frame's, m/s.
    """
    own = STATE_SIZE * wrenches.shape[0]
    for p in range(elements.pairs.shape[0]):
        i, j = elements.pairs[p, 0], elements.pairs[p, 1]
        at = STATE_SIZE * i
        # relative motion of the pair in track axes
        if j == FRAME:
            axes = rotations[rotations.shape[0] - 1]
            if track.tangent:
                origin, velocity, turn = (speed * t + elements.ahead[p], 0.0, 0.0), (speed, 0.0, 0.0), (0.0, 0.0, 0.0)
            else:
                origin, velocity, turn = moving_frame(track, speed, t, elements.ahead[p], axes)
        else:
            axes = rotations[j]
            other = STATE_SIZE * j
            origin = (state[other], state[other + 1], state[other + 2])
            velocity = (state[other + 7], state[other + 8], state[other + 9])
            turn = (turns[j, 0], turns[j, 1], turns[j, 2])
        dx, dy, dz = state[at] - origin[0], state[at + 1] - origin[1], state[at + 2] - origin[2]
        vx = state[at + 7] - velocity[0] - turn[1] * dz + turn[2] * dy
        vy = state[at + 8] - velocity[1] - turn[2] * dx + turn[0] * dz
        vz = state[at + 9] - velocity[2] - turn[0] * dy + turn[1] * dx
        wx, wy, wz = turns[i, 0] - turn[0], turns[i, 1] - turn[1], turns[i, 2] - turn[2]
        # the same in the axes of the second body
        body = rotations[i]
        a00, a01, a02 = axes[0, 0], axes[0, 1], axes[0, 2]
        a10, a11, a12 = axes[1, 0], axes[1, 1], axes[1, 2]
        a20, a21, a22 = axes[2, 0], axes[2, 1], axes[2, 2]
        px, py, pz = a00 * dx + a10 * dy + a20 * dz, a01 * dx + a11 * dy + a21 * dz, a02 * dx + a12 * dy + a22 * dz
        ux, uy, uz = a00 * vx + a10 * vy + a20 * vz, a01 * vx + a11 * vy + a21 * vz, a02 * vx + a12 * vy + a22 * vz
        ox, oy, oz = a00 * wx + a10 * wy + a20 * wz, a01 * wx + a11 * wy + a21 * wz, a02 * wx + a12 * wy + a22 * wz
        b00, b01, b02 = body[0, 0], body[0, 1], body[0, 2]
        b10, b11, b12 = body[1, 0], body[1, 1], body[1, 2]
        b20, b21, b22 = body[2, 0], body[2, 1], body[2, 2]
        r00, r01, r02 = (
            a00 * b00 + a10 * b10 + a20 * b20, a00 * b01 + a10 * b11 + a20 * b21, a00 * b02 + a10 * b12 + a20 * b22,
        )  # fmt: skip
        r10, r11, r12 = (
            a01 * b00 + a11 * b10 + a21 * b20, a01 * b01 + a11 * b11 + a21 * b21, a01 * b02 + a11 * b12 + a21 * b22,
        )  # fmt: skip
        r20, r21, r22 = (
            a02 * b00 + a12 * b10 + a22 * b20, a02 * b01 + a12 * b11 + a22 * b21, a02 * b02 + a12 * b12 + a22 * b22,
        )  # fmt: skip
        turning = elements.turning[p]
        fx = fy = fz = 0.0
        c0, c1, c2 = turning[0, 0], turning[0, 1], turning[0, 2]
        if turning[2, 0] != 0.0 or turning[2, 1] != 0.0 or turning[2, 2] != 0.0:
            h0 = turning[2, 0] * (1.0 + r00 - r11 - r22)
            h1 = turning[2, 1] * (1.0 - r00 + r11 - r22)
            h2 = turning[2, 2] * (1.0 - r00 - r11 + r22)
            c0, c1, c2 = c0 + 0.5 * (h1 + h2 - h0), c1 + 0.5 * (h0 + h2 - h1), c2 + 0.5 * (h0 + h1 - h2)
        mx = c2 * r12 - c1 * r21 - turning[1, 0] * ox
        my = c0 * r20 - c2 * r02 - turning[1, 1] * oy
        mz = c1 * r01 - c0 * r10 - turning[1, 2] * oz
        for k in range(elements.first_spring[p], elements.first_spring[p + 1]):
            row = elements.springs[k]
            bx = r00 * row[0] + r01 * row[1] + r02 * row[2]
            by = r10 * row[0] + r11 * row[1] + r12 * row[2]
            bz = r20 * row[0] + r21 * row[1] + r22 * row[2]
            gx = row[12] - row[6] * (px + bx - row[3]) - row[9] * (ux + oy * bz - oz * by)
            gy = row[13] - row[7] * (py + by - row[4]) - row[10] * (uy + oz * bx - ox * bz)
            gz = row[14] - row[8] * (pz + bz - row[5]) - row[11] * (uz + ox * by - oy * bx)
            fx, fy, fz = fx + gx, fy + gy, fz + gz
            mx, my, mz = mx + by * gz - bz * gy, my + bz * gx - bx * gz, mz + bx * gy - by * gx
        for k in range(elements.first_directed[p], elements.first_directed[p + 1]):
            row, direction = elements.directed[k], elements.law[k, 0]
            bx = r00 * row[0] + r01 * row[1] + r02 * row[2]
            by = r10 * row[0] + r11 * row[1] + r12 * row[2]
            bz = r20 * row[0] + r21 * row[1] + r22 * row[2]
            ex, ey, ez = px + bx - row[3], py + by - row[4], pz + bz - row[5]
            nx, ny, nz = 1.0 * (direction == 0), 1.0 * (direction == 1), 1.0 * (direction == 2)
            length = 0.0
            if direction == LINE:
                length = math.sqrt(ex * ex + ey * ey + ez * ez)
                nx, ny, nz = ex / length, ey / length, ez / length
            stretch = nx * ex + ny * ey + nz * ez - row[6]
            along = nx * (ux + oy * bz - oz * by) + ny * (uy + oz * bx - ox * bz) + nz * (uz + ox * by - oy * bx)
            if elements.law[k, 1] < SLIDER:
                force, own_rate = _directed_force(elements, k, stretch, along, state, own)
            else:
                rotation = (r00, r01, r02), (r10, r11, r12), (r20, r21, r22)
                limit = friction_limit(elements, k, rotation, (px, py, pz), (ux, uy, uz), (ox, oy, oz))
                inner = state[own + elements.law[k, 4]]
                force, own_rate = friction_force(elements, k, stretch, along, inner, limit)
            if elements.law[k, 4] >= 0:
                rate[own + elements.law[k, 4]] = own_rate
            gx, gy, gz = -force * nx, -force * ny, -force * nz
            fx, fy, fz = fx + gx, fy + gy, fz + gz
            mx, my, mz = mx + by * gz - bz * gy, my + bz * gx - bx * gz, mz + bx * gy - by * gx
        # back to track axes: on i at its centre, and the opposite on j
        gx, gy, gz = a00 * fx + a01 * fy + a02 * fz, a10 * fx + a11 * fy + a12 * fz, a20 * fx + a21 * fy + a22 * fz
        tx, ty, tz = a00 * mx + a01 * my + a02 * mz, a10 * mx + a11 * my + a12 * mz, a20 * mx + a21 * my + a22 * mz
        wrench = wrenches[i]
        wrench[0] += gx
        wrench[1] += gy
        wrench[2] += gz
        wrench[3] += tx
        wrench[4] += ty
        wrench[5] += tz
        if j != FRAME:
            wrench = wrenches[j]
            wrench[0] -= gx
            wrench[1] -= gy
            wrench[2] -= gz
            wrench[3] -= tx + dy * gz - dz * gy
            wrench[4] -= ty + dz * gx - dx * gz
            wrench[5] -= tz + dx * gy - dy * gx
