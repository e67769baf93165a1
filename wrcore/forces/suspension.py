"""Force elements between two bodies, evaluated pair by pair.

All elements between a first body i and a second body j share the relative motion of the two bodies, which is computed
once in the axes of j. With rotation matrices A, positions r, velocities v and angular velocities w,

    R = Aj^T Ai,  rho = Aj^T (ri - rj),  u = Aj^T (vi - vj - wj x (ri - rj)),  W = Aj^T (wi - wj).

The vector from a marker n of j to a marker m of i is d = rho + R m - n. Its rate is d' = u + W x R m. A force F on i
acts at the marker of i, and -F acts on j at this point. The pair gains no angular momentum and, without dampers, no
energy: the force of a spring with the energy U(d) is exactly F = -dU/dd in the axes of j. The moment of rotation
stiffnesses (kx, ky, kz) about the axes of j is likewise that of the energy

    U(R) = c . (1 - diag R),   cx = (ky + kz - kx)/2 and so on,

which is kx roll^2/2 + ky pitch^2/2 + kz yaw^2/2 for small angles and kx (1 - cos roll) for a rotation about x alone.
Cubic stiffnesses hx, hy, hz add hx Tx^2 + hy Ty^2 + hz Tz^2, with Tx = (1 + Rxx - Ryy - Rzz)/2 and so on, the energy of
a unit stiffness. They increase kx by 2 hx Tx, which is hx roll^2 for small angles.

An element along one direction follows a force law of its kind (`wrcore.forces.law`). Stored energy and dissipated power
of a pair are computed together with its forces, so that they are consistent; the equations of motion do not use them.

The angular velocity w of a wheelset excludes the spin (its frame does not spin, see wrcore.bodies.body).
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import STATE_SIZE, VELOCITY
from wrcore.bodies.marker import FRAME
from wrcore.bodies.vector import cross, dot, load, minus
from wrcore.forces import law
from wrcore.kernels.handles import FOUR, Kernel, Kind, four_at
from wrcore.kernels.jit import FUSED, jit
from wrcore.kernels.named_laws import UserFunction, text_digest
from wrcore.track.track import moving_frame, turned_back, turned_into

STIFFNESS, DAMPING, PRELOAD = 6, 9, 12
"""First columns in a row of ``Elements.springs``; its markers are in the columns of ``Elements.directed``."""


class Elements(NamedTuple):
    """All force elements of a model as arrays for kernels, sorted by pair of bodies."""

    pairs: np.ndarray  # (p, 2) int: first and second body; the second may be FRAME, the moving frame
    offset: np.ndarray  # (p,): arc length of the element from the origin of the moving frame, m
    turning: np.ndarray
    """(p, 3, 3): factors c of the energy U(R) (N m/rad), damping (N m s/rad) and cubic stiffness (N m/rad^3) about
    the second body's axes."""
    first_spring: np.ndarray  # (p + 1,) int: springs k of pair p have first_spring[p] <= k < first_spring[p + 1]
    springs: np.ndarray
    """(n, 15), elements along all three axes: marker of i (m), position relative to j without spring force (m),
    stiffness (N/m), damping (N s/m), preload (N, on i)."""
    first_directed: np.ndarray  # (p + 1,) int: elements k of pair p, first_directed[p] <= k < first_directed[p + 1]
    directed: np.ndarray
    """(m, 16), elements along one direction: marker of i, marker of j or rest position (m), length at rest (m; for a
    line), unit vector in the axes of j (zero for a line), and six parameters of the law."""
    law: np.ndarray
    """(m, 7) int: whether along a line, number of the law, first and last + 1 point of the characteristic, number of
    the internal state; the spring or directed element whose force is the normal force, -1 for none."""
    table: np.ndarray
    """(q, 3): points of all characteristics: displacement or speed, force (or the inverse), integral from 0."""
    states: int
    """Number of internal states: displacements (m) of dampers in series with a spring, and the states of wheels and
    track that follow them, see `wrcore.equations.equations_of_motion.fill_derivatives`."""
    laws: np.ndarray = np.zeros(0, np.int64)  # address of each law by its number, see `with_laws`
    own: np.ndarray = np.zeros((0, 4), np.int64)
    """(o, 4): digests of the laws of the user (`wrcore.kernels.own`) and of other packages."""
    own_laws: np.ndarray = np.zeros(0, np.int64)  # (o,): addresses of the laws of the user, see `with_laws`
    parameters: np.ndarray = np.zeros(0)  # of laws of the user; columns FIRST, LAST give the range


def pack_elements(springs=(), directed=(), turning=()):
    """Return `Elements` sorted by pair (first body, second body, offset).

    ``springs``: (pair, the 15 numbers of a row of ``Elements.springs``). ``directed``: (pair, the first 10 numbers of a
    row of ``Elements.directed``, law, its parameters, points (q, 2) of the characteristic or None, number of internal
    states, element of the normal force). The latter is None, (0, k) for the k-th of ``springs``, or (1, k) for the k-th
    of ``directed``. ``turning``: (pair, stiffness, damping, cubic stiffness) against relative rotation about the second
    body's axes, three numbers each; they are summed for each pair.
    """
    pairs = sorted({item[0] for group in (springs, directed, turning) for item in group})
    orders = [sorted(range(len(group)), key=lambda k: group[k][0]) for group in (springs, directed)]
    springs, directed = ([group[k] for k in order] for group, order in zip((springs, directed), orders, strict=True))
    rotational = np.zeros((len(pairs), 3, 3))
    for pair, stiffness, damping, cubic in turning:
        rotational[pairs.index(pair)] += (0.5 * np.sum(stiffness) - np.asarray(stiffness, float), damping, cubic)
    tables, rows, laws, length, states = [np.zeros((0, 3))], [], [], 0, 0
    own: dict[tuple, int] = {}
    parameters: list[float] = []
    for _, row, kernel, numbers, points, inner, presses in directed:
        tables.append(_with_integral(points))
        pressing = [-1, -1]
        if presses is not None:
            pressing[presses[0]] = orders[presses[0]].index(presses[1])
        end = length + len(tables[-1])
        on_line, first, last = not np.any(row[law.AXIS :]), length, end
        if isinstance(kernel, UserFunction):
            number, first, last = -1 - own.setdefault(kernel.digest, len(own)), len(parameters), -1
            parameters += numbers
            last, numbers = len(parameters), (inner,)
        else:
            number = law.LAWS.index(kernel)
            if not kernel.__module__.startswith("wrcore."):
                own.setdefault(text_digest(kernel), len(own))
        laws.append((on_line, number, first, last, states if inner else -1, *pressing))
        length, states = end, states + inner
        rows.append([*row, *numbers, *[0.0] * (law.MOST_NUMBERS - len(numbers))])
    first_spring, first_directed = (
        np.array([sum(item[0] < pair for item in group) for pair in pairs] + [len(group)], np.int64)
        for group in (springs, directed)
    )
    return Elements(
        np.array([pair[:2] for pair in pairs], np.int64).reshape(-1, 2), np.array([pair[2] for pair in pairs], float),
        rotational,
        first_spring, np.array([row for _, row in springs], float).reshape(-1, 15),
        first_directed, np.array(rows, float).reshape(-1, law.NUMBERS + law.MOST_NUMBERS),
        np.array(laws, np.int64).reshape(-1, 7), np.vstack(tables), states,
        own=np.array(list(own), np.int64).reshape(-1, 4), parameters=np.array(parameters, float),
    )  # fmt: skip


def _with_integral(points):
    """Return the points of a characteristic and its integral from 0 to each point, (q, 3); (0, 3) for None."""
    if points is None:
        return np.zeros((0, 3))
    x, y = points.T
    sums = np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])
    k = min(max(int(np.searchsorted(x, 0.0)) - 1, 0), len(x) - 2)
    at_zero = y[k] - x[k] * (y[k + 1] - y[k]) / (x[k + 1] - x[k])
    return np.column_stack([x, y, sums - (sums[k] - 0.5 * (y[k] + at_zero) * x[k])])


def with_laws(elements):
    """Return the elements with the addresses of their laws; only laws that an element uses are compiled."""
    addresses, example = np.zeros(len(law.LAWS), np.int64), Kind(elements)
    own = np.zeros(len(elements.own), np.int64)
    for number in np.unique(elements.law[:, law.LAW]):
        if number >= 0:
            addresses[number] = Kernel(law.LAWS[number], example, 0, 0.0, 0.0, 0.0, 0.0, returns=FOUR).address
        else:
            from wrcore.forces.kinds.own_law import address

            own[-1 - number] = address(tuple(map(int, elements.own[-1 - number])), example)
    return elements._replace(laws=addresses, own_laws=own)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def relative_motion(elements, p, track, t, speed, state, rotations, turns):
    """Return the relative motion (R by columns, rho, u, W) of a pair, in the axes of its second body.

    Also return these axes and, in track axes, ri - rj, vj and wj."""
    i, j = elements.pairs[p, 0], elements.pairs[p, 1]
    at = STATE_SIZE * i
    if j == FRAME:
        axes = rotations[rotations.shape[0] - 1]
        if track.tangent:
            origin, velocity, turn = (speed * t + elements.offset[p], 0.0, 0.0), (speed, 0.0, 0.0), (0.0, 0.0, 0.0)
        else:
            origin, velocity, turn = moving_frame(track, speed, t, elements.offset[p], axes)
    else:
        axes = rotations[j]
        other = STATE_SIZE * j
        origin, velocity, turn = load(state, other), load(state, other + VELOCITY), load(turns[j], 0)
    dx, dy, dz = minus(load(state, at), origin)
    ux, uy, uz = minus(load(state, at + VELOCITY), velocity)
    vx = ux - turn[1] * dz + turn[2] * dy
    vy = uy - turn[2] * dx + turn[0] * dz
    vz = uz - turn[0] * dy + turn[1] * dx
    wx, wy, wz = minus(load(turns[i], 0), turn)
    body = rotations[i]
    rotation = (
        turned_into(axes, body[0, 0], body[1, 0], body[2, 0]),
        turned_into(axes, body[0, 1], body[1, 1], body[2, 1]),
        turned_into(axes, body[0, 2], body[1, 2], body[2, 2]),
    )
    local = rotation, turned_into(axes, dx, dy, dz), turned_into(axes, vx, vy, vz), turned_into(axes, wx, wy, wz)
    return local, (axes, (dx, dy, dz), velocity, turn)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _marker_motion(row, motion):
    """Return R m, d and d' of an element from the markers m and n at the beginning of its row."""
    (c0, c1, c2), (px, py, pz), (ux, uy, uz), (ox, oy, oz) = motion
    (mx, my, mz), (nx, ny, nz) = load(row, law.MARKER), load(row, law.REST)
    bx = c0[0] * mx + c1[0] * my + c2[0] * mz
    by = c0[1] * mx + c1[1] * my + c2[1] * mz
    bz = c0[2] * mx + c1[2] * my + c2[2] * mz
    apart = px + bx - nx, py + by - ny, pz + bz - nz
    return (bx, by, bz), apart, (ux + oy * bz - oz * by, uy + oz * bx - ox * bz, uz + ox * by - oy * bx)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _along(elements, k, motion):
    """Return R m, unit vector, stretch and rate of stretch of the k-th element along one direction."""
    row = elements.directed[k]
    arm, (ex, ey, ez), (vx, vy, vz) = _marker_motion(row, motion)
    nx, ny, nz = load(row, law.AXIS)
    if elements.law[k, law.ON_LINE]:
        length = math.sqrt(ex * ex + ey * ey + ez * ez)
        nx, ny, nz = ex / length, ey / length, ez / length
    return arm, (nx, ny, nz), nx * ex + ny * ey + nz * ez - row[law.LENGTH], nx * vx + ny * vy + nz * vz


@jit(allocates=False, forceinline=True)
def _by_law(elements, k, stretch, speed, inner, press):
    """Return the four results of the law of the k-th element, see `wrcore.forces.law`."""
    return four_at(elements.laws[elements.law[k, law.LAW]], elements, k, stretch, speed, inner, press)


@jit(allocates=False, fastmath=FUSED)
def _pressing_force(elements, k, motion):
    """Return the normal force on the k-th friction element, N.

    This is the force of a spring along z, or of another element along one direction."""
    other = elements.law[k, law.PRESSING_SPRING]
    if other >= 0:
        row = elements.springs[other]
        _, apart, rate = _marker_motion(row, motion)
        return row[PRELOAD + 2] - row[STIFFNESS + 2] * apart[2] - row[DAMPING + 2] * rate[2]
    other = elements.law[k, law.PRESSING]
    _, _, stretch, speed = _along(elements, other, motion)
    return -_by_law(elements, other, stretch, speed, 0.0, 0.0)[0]


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def pair_forces(elements, p, motion, state, inner_at, rate):
    """Return force and moment of a pair on its first body, stored energy (J) and dissipated power (W).

    The moment is about the centre of the first body; both are in the axes of the second body. The rates of internal
    states, which begin at ``inner_at``, are written into ``rate``."""
    ((r00, r10, r20), (r01, r11, r21), (r02, r12, r22)), _, _, (ox, oy, oz) = motion
    turning = elements.turning[p]
    fx = fy = fz = 0.0
    c0, c1, c2 = turning[0, 0], turning[0, 1], turning[0, 2]
    stored = c0 * (1.0 - r00) + c1 * (1.0 - r11) + c2 * (1.0 - r22)
    if turning[2, 0] != 0.0 or turning[2, 1] != 0.0 or turning[2, 2] != 0.0:
        tx, ty, tz = 1.0 + r00 - r11 - r22, 1.0 - r00 + r11 - r22, 1.0 - r00 - r11 + r22
        h0, h1, h2 = turning[2, 0] * tx, turning[2, 1] * ty, turning[2, 2] * tz
        c0, c1, c2 = c0 + 0.5 * (h1 + h2 - h0), c1 + 0.5 * (h0 + h2 - h1), c2 + 0.5 * (h0 + h1 - h2)
        stored += 0.25 * (turning[2, 0] * (tx * tx) + turning[2, 1] * (ty * ty) + turning[2, 2] * (tz * tz))
    mx = c2 * r12 - c1 * r21 - turning[1, 0] * ox
    my = c0 * r20 - c2 * r02 - turning[1, 1] * oy
    mz = c1 * r01 - c0 * r10 - turning[1, 2] * oz
    lost = turning[1, 0] * (ox * ox) + turning[1, 1] * (oy * oy) + turning[1, 2] * (oz * oz)
    for k in range(elements.first_spring[p], elements.first_spring[p + 1]):
        row = elements.springs[k]
        (bx, by, bz), (ex, ey, ez), (vx, vy, vz) = _marker_motion(row, motion)
        (kx, ky, kz), (dx, dy, dz), (px, py, pz) = load(row, STIFFNESS), load(row, DAMPING), load(row, PRELOAD)
        gx, gy, gz = px - kx * ex - dx * vx, py - ky * ey - dy * vy, pz - kz * ez - dz * vz
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        mx, my, mz = mx + by * gz - bz * gy, my + bz * gx - bx * gz, mz + bx * gy - by * gx
        stored += 0.5 * (kx * (ex * ex) + ky * (ey * ey) + kz * (ez * ez))
        stored -= px * ex + py * ey + pz * ez
        lost += dx * (vx * vx) + dy * (vy * vy) + dz * (vz * vz)
    for k in range(elements.first_directed[p], elements.first_directed[p + 1]):
        (bx, by, bz), (nx, ny, nz), stretch, along = _along(elements, k, motion)
        inner, press, place = 0.0, 0.0, elements.law[k, law.INNER]
        if elements.law[k, law.PRESSING_SPRING] >= 0 or elements.law[k, law.PRESSING] >= 0:
            press = _pressing_force(elements, k, motion)
        if elements.law[k, law.LAW] < 0:
            at, address = inner_at + max(place, 0), elements.own_laws[-1 - elements.law[k, law.LAW]]
            force, _, energy, loss = four_at(address, elements, k, stretch, along, state, rate, at)
        else:
            if place >= 0:
                inner = state[inner_at + place]
            force, inner_rate, energy, loss = _by_law(elements, k, stretch, along, inner, press)
            if place >= 0:
                rate[inner_at + place] = inner_rate
        gx, gy, gz = -force * nx, -force * ny, -force * nz
        fx, fy, fz = fx + gx, fy + gy, fz + gz
        mx, my, mz = mx + by * gz - bz * gy, my + bz * gx - bx * gz, mz + bx * gy - by * gx
        stored, lost = stored + energy, lost + loss
    return (fx, fy, fz), (mx, my, mz), stored, lost


@jit(allocates=False, fastmath=FUSED)
def element_forces(elements, track, t, speed, state, rotations, turns, wrenches, rate):
    """Add the forces of all elements to the ``wrenches`` (n, 6) of the bodies, about centres of mass, in track axes.

    Also write the rates of the internal states of elements (m/s) into ``rate``. The last of ``rotations`` (n + 1, 3, 3)
    is that of the moving frame; ``turns`` (n, 3) are the angular velocities of the bodies' frames in track axes, rad/s;
    ``speed`` is the speed of the moving frame, m/s.
    """
    inner_at = STATE_SIZE * wrenches.shape[0]
    for p in range(elements.pairs.shape[0]):
        i, j = elements.pairs[p, 0], elements.pairs[p, 1]
        motion, (axes, (dx, dy, dz), _, _) = relative_motion(elements, p, track, t, speed, state, rotations, turns)
        (fx, fy, fz), (mx, my, mz), _, _ = pair_forces(elements, p, motion, state, inner_at, rate)
        # back to track axes: on i about its centre, and the opposite on j
        gx, gy, gz = force = turned_back(axes, fx, fy, fz)
        tx, ty, tz = moment = turned_back(axes, mx, my, mz)
        about = tx + dy * gz - dz * gy, ty + dz * gx - dx * gz, tz + dx * gy - dy * gx
        for k in range(3):
            wrenches[i, k] += force[k]
            wrenches[i, 3 + k] += moment[k]
            if j != FRAME:
                wrenches[j, k] -= force[k]
                wrenches[j, 3 + k] -= about[k]


@jit(allocates=False)
def element_energies(elements, track, t, speed, state, rotations, turns, rate):
    """Return stored energy (J) of all force elements, its rate, dissipated power and power of the moving frame (W).

    The last is the power of the frame at the ends of elements that are fixed to it. The energy is zero in nominal
    position, also for a preloaded spring. The arguments are those of `element_forces`."""
    inner_at = STATE_SIZE * turns.shape[0]
    stored = storing = lost = driven = 0.0
    for p in range(elements.pairs.shape[0]):
        motion, (axes, apart, velocity, turn) = relative_motion(elements, p, track, t, speed, state, rotations, turns)
        force, moment, energy, loss = pair_forces(elements, p, motion, state, inner_at, rate)
        stored, lost = stored + energy, lost + loss
        storing -= dot(force, motion[2]) + dot(moment, motion[3]) + loss
        if elements.pairs[p, 1] == FRAME:  # the force on the first body, times the velocity of the frame's point there
            swept = cross(turn, apart)
            place = velocity[0] + swept[0], velocity[1] + swept[1], velocity[2] + swept[2]
            driven += dot(turned_back(axes, force[0], force[1], force[2]), place)
            driven += dot(turned_back(axes, moment[0], moment[1], moment[2]), turn)
    return stored, storing, lost, driven
