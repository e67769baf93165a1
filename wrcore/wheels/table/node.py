"""A node of a `PairTable`: exact contact of a wheel at a place over its rail, reduced to some numbers."""

import math

import numpy as np

from wrcore.contact.hertz import contact_modulus
from wrcore.contact.normal import solve
from wrcore.contact.normal.gap import group_end, material_point, rigid_slip, strip_wrenches
from wrcore.contact.normal.strips import WEIGHT, WIDENED
from wrcore.contact.normal.windows import BLENDING_RATIO
from wrcore.contact.patch.model import NUMBERS
from wrcore.contact.patch.solution import library_of, roll_patch, solve_overlaps
from wrcore.contact.rigid.height_at_load import bracket_from, narrowed
from wrcore.contact.rolling import rolling
from wrcore.contact.search.approach import LEVEL, pressed_together
from wrcore.contact.search.detection import find_patches
from wrcore.contact.search.reduction import MOMENT, PENETRATION
from wrcore.contact.search.strip import gap_at, make_pose
from wrcore.creep.kalker import coefficients_at
from wrcore.kernels.jit import jit
from wrcore.wheels.motion import WheelMotion
from wrcore.wheels.table import lookup as columns
from wrcore.wheels.table.cells import PART
from wrcore.wheels.table.lookup import WIDE, Slip, base_force, lobe_end, log_depth_of, root_share, tabulated_force

SUMS = 33
"""Of `press_lobe`, the last twelve scratch."""

SLIPS = 12
"""Of a lobe that are solved at once."""

PROBE = 0.06
"""Creepages, over those of saturation, between which the slopes at rest are taken."""

SPUN = 0.5, 0.8
"""Where spin leaves less than the first part of the table's slope, its factor is 1; where more than the second, it
makes the slope exact."""

AT_REST = PROBE * np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [0, 0]])
"""Creepages with which slopes and force at rest are found."""

HEIGHT_STEP, HEIGHT_ERROR = 2e-5, 1e-13
ASIDE_STEP, ASIDE_ERROR, FARTHEST = 2e-4, 1e-10, 1e-8
"""First steps in height and across of the search for a lobe, where it ends, and how far its place on the profile may
then be off, m."""

MOST_STEPS = 60


@jit(allocates=False, nogil=True)
def lobe_at(geometry, y, z, ex, ey, ez, place, limits, rows, sums):
    """First and end of the overlaps of the lobe nearest to a place on the wheel's profile, their depth D and their own
    place; 0, 0, 0 and the place where there is none."""
    low, high, found, at, first = 0, 0, 0.0, place, 0
    nearest, pose = math.inf, make_pose(1.0, y, z, ex, ey, ez, True)
    count = find_patches(geometry, 1.0, y, z, ex, ey, ez, True, MOMENT, rows)
    while first < count:
        group = group_end(geometry, rows, count, first)
        while first < group:
            last = lobe_end(geometry, pose, rows, first, group, limits)
            pressed = pressed_together(geometry, pose, True, LEVEL, rows, first, last, sums)
            log_depth, u = log_depth_of(pressed)
            if abs(u - place) < nearest:
                low, high, found, at, nearest = first, last, math.exp(log_depth), u, abs(u - place)
            first = last
    return low, high, found, at


@jit(allocates=False, nogil=True)
def least_gap(geometry, y, z, ex, ey, ez, place):
    """Smallest vertical gap about a place on the wheel's profile, m."""
    pose, least = make_pose(1.0, y, z, ex, ey, ez, True), 1.0
    for k in range(-8, 9):
        least = min(least, gap_at(geometry, pose, place + 0.125 * PART * k)[0])
    return least


@jit(allocates=False, nogil=True)
def lobe_height(geometry, y, axle, place, rows, sums):
    """Height of the wheelset's centre at which the lobe nearest to u of a ``place``, see `solve_place`, has its
    depth; NaN if lost."""
    _, _, depth, _, u, limits = place
    ex, ey, ez = axle
    level = geometry.rolling_radius - geometry.half_distance * ez
    level -= least_gap(geometry, y, level, ex, ey, ez, u) + 0.5 * depth
    bracket = bracket_from(level, HEIGHT_STEP)
    for _ in range(MOST_STEPS):
        found, z = lobe_at(geometry, y, bracket.at, ex, ey, ez, u, limits, rows, sums)[2], bracket.at
        if found == 0.0 and least_gap(geometry, y, z, ex, ey, ez, u) < 0.0:  # one with its neighbours
            found = 2.0 * depth
        bracket = narrowed(bracket, found - depth)
        if abs(bracket.at - z) < HEIGHT_ERROR or bracket.high - bracket.low < HEIGHT_ERROR:
            return bracket.at
    return math.nan


@jit(allocates=False, nogil=True)
def find_lobe(geometry, place, rows, sums):
    """Pose (y, z, axle) of the wheelset at which the lobe of a ``place``, see `solve_place`, has its depth and its
    offset, where it then lies on the wheel's profile, and whether others lie beside it; a height of NaN where there is
    none.

    The wheel is moved across its rail until the lobe nearest to the place that the offset implies lies there."""
    offset, slope, depth, yaw, u, limits = place
    ex, ey, ez = axle = yaw, math.sqrt(1.0 - yaw * yaw - slope * slope), slope
    middle = geometry.rail_distance - geometry.half_distance * ey
    bracket, beside = bracket_from(offset + u, ASIDE_STEP), False
    for _ in range(MOST_STEPS):
        t = bracket.at
        y, near = t + middle, t - offset
        z = lobe_height(geometry, y, axle, (offset, slope, depth, yaw, near, limits), rows, sums)
        if math.isnan(z):
            break
        first, last, found, at = lobe_at(geometry, y, z, ex, ey, ez, near, limits, rows, sums)
        bracket = narrowed(bracket, at - near)
        if abs(at - near) < ASIDE_ERROR or bracket.high - bracket.low < HEIGHT_ERROR:
            if abs(at - near) > FARTHEST or abs(found - depth) > 1e-6 * depth:
                break
            alone = lobe_at(geometry, y, z, ex, ey, ez, at, WIDE, rows, sums)
            beside = first != alone[0] or last != alone[1]
            return (y, z, axle), at, beside
    return (0.0, math.nan, axle), 0.0, beside


def lobe_of(geometry, place, work):
    """As `find_lobe`; None where there is none. ``work``: `StripWork`, of which it needs the rows of overlaps."""
    found = find_lobe(geometry, place, work.rows, work.moments)
    return None if math.isnan(found[0][1]) else found


@jit(allocates=False, nogil=True)
def _part_lobe(geometry, pose, frame, count, load, sums, work):
    """Fill the places 6 to 8 of ``sums`` with the place of the slip, and those from 12 on with the load of the
    flange root over N; that times its place, angle and ln of its semi-axes; and the rest's load times ln of its own."""
    sums[:] = 0.0
    for i in range(count):
        s, x, length = work.strips[solve.CENTRE, i], work.strips[solve.MIDDLE, i], work.strips[solve.HALF_LENGTH, i]
        px, py, pz, cosine, sine = material_point(
            geometry, pose, frame, s, x, work.strips[solve.WHEEL_HEIGHT, i], work.strips[solve.STRIP_TILT, i]
        )
        part, angle = work.strips[solve.STRIP_LOAD, i] / load, math.atan2(sine, cosine)
        share = root_share(angle)
        root = part * share
        sums[6], sums[7], sums[8] = sums[6] + part * px, sums[7] + part * py, sums[8] + part * pz
        sums[12], sums[13], sums[14] = sums[12] + root, sums[13] + root * px, sums[14] + root * py
        sums[15], sums[16] = sums[15] + root * pz, sums[16] + root * angle
        for k in range(2):
            at, share = 21 + 6 * k, (1.0 - share if k else share)
            own = share * part
            sums[at], sums[at + 1], sums[at + 2] = sums[at] + own, sums[at + 1] + own * x, sums[at + 2] + own * s
            sums[at + 3] += own * (x * x + 0.25 * length * length)
            sums[at + 4], sums[at + 5] = sums[at + 4] + own * s * s, sums[at + 5] + own * share
    for k in range(2):
        at = 21 + 6 * k
        own = max(sums[at], columns.LEAST)
        x, s, alone = sums[at + 1] / own, sums[at + 2] / own, max(sums[at + 5] / own, 1e-3)
        xx, ss = sums[at + 3] / own - x * x, sums[at + 4] / own - s * s
        sums[17 + 2 * k] = own * 0.5 * math.log(5.0 * max(xx, 1e-10))
        # parts that share strips share their width
        sums[18 + 2 * k] = own * (0.5 * math.log(5.0 * max(ss, 1e-10)) + math.log(alone))


@jit(allocates=False, nogil=True)
def press_lobe(model, y, z, axle, place, limits, velocity, more, sums, work):
    """Exact solution of a left wheel's lobe near a ``place`` on its profile (m), with ``more`` strips, for a velocity
    (6,) of its wheelset, linear and angular.

    Fills ``sums`` (SUMS,): wrench of pressure about the wheelset's centre, place of the slip from there, semi-axes
    and p_max, and what `_part_lobe` says. Returns the number of windows, 0 where strips find no solution, their
    frame, and the weight of the solution with more strips.
    """
    finer, geometry, (ex, ey, ez) = work.normal.more, model.geometry, axle
    first, last, _, _ = lobe_at(geometry, y, z, ex, ey, ez, place, limits, work.rows, work.moments)
    pose, deepest = make_pose(1.0, y, z, ex, ey, ez, True), 0.0
    for k in range(first, last):
        deepest = max(deepest, work.rows[k, PENETRATION])
    finer[WIDENED], work.spare[0] = more, 0.0
    windows, frame = solve_overlaps(model, pose, first, last, work.spare, work)
    finer[WIDENED] = 1.0
    share = finer[WEIGHT]
    if windows == 0:
        return 0, frame, share
    v = velocity
    m = WheelMotion(1.0, y, z, ex, ey, ez, v[0], v[1], v[2], v[3], v[4], v[5], 0.0, 0.0, model.friction)
    for q in range(6):
        work.wrench[0, q] = 0.0
    found = roll_patch(model, m, pose, frame, windows, deepest, 1.0, model.friction, 1.0, work)
    _part_lobe(geometry, pose, frame, work.normal.start[windows], found.load, sums, work)
    for q in range(6):
        sums[q] = work.wrench[0, q]
    sums[9], sums[10], sums[11] = found.a, found.b, found.p_max
    return windows, frame, share


@jit(allocates=False, nogil=True)
def roll_lobe_on(model, y, z, axle, frame, velocities, slips, forces, wrenches, work):
    """Wrenches of friction (n, 6) about the wheelset's centre on the lobe pressed last in ``work``, for velocities
    (n, 6) at V = 1 m/s; ``slips`` (n, 4, strips) and ``forces`` (n, 3, strips) are scratch."""
    strips, count, (library, own) = work.strips, work.solved[0], library_of(model.strips, work)
    pose = make_pose(1.0, y, z, axle[0], axle[1], axle[2], True)
    centre, middle = strips[solve.CENTRE, :count], strips[solve.MIDDLE, :count]
    height, tilt = strips[solve.WHEEL_HEIGHT, :count], strips[solve.STRIP_TILT, :count]
    for k in range(len(velocities)):
        v = velocities[k]
        velocity = v[0], v[1], v[2], v[3], v[4], v[5], 1.0
        rigid_slip(model.geometry, pose, frame, velocity, centre, middle, height, tilt, slips[k])
    rolling.roll_again(slips, library, own, forces)
    for k in range(len(velocities)):
        strip_wrenches(
            model.geometry, pose, frame, centre, middle, height, tilt, strips[solve.STRIP_LOAD, :count], forces[k], 1.0,
            work.wrench[0], wrenches[k],
        )  # fmt: skip


def solve_place(contact, handle, works, place, points):
    """Numbers of a node at a place, all but those of its modes, and the remainder (n, 3) of its creep force at
    creepages (n, 2) over those of saturation; None where strips find no solution.

    ``contact``: `ContactModel` with exact patches and a creep table, and its handle; ``works``: handles of two
    `StripWork`, for less and for more strips; ``place``: offset, slope of the axle, depth D, yaw, about where on the
    wheel's profile (m), and limits of `lobe_end`.
    """
    (_, slope, depth, yaw, _, limits), geometry = place, contact.geometry
    half, radius, modulus = geometry.half_distance, geometry.rolling_radius, _modulus(contact)
    found = lobe_of(geometry, place, works[0].value)
    if found is None:
        return None
    (y, z, axle), u, _ = found
    at, axle, sums, each, pressed = (y, z, axle), np.array(axle), np.zeros(SUMS), np.zeros(SUMS), []
    for work, more in zip(works, (1.0, BLENDING_RATIO), strict=True):
        windows, frame, share = press_lobe(
            handle, *at, u, limits, np.array([1.0, 0.0, 0.0, *(axle / radius)]), more, each, work
        )
        if windows == 0:
            return None
        weight = 1.0 - pressed[0][0] if pressed else 1.0 - max(share, 0.0)
        pressed.append((weight, frame, work))
        sums += weight * each
        if weight == 1.0:
            break

    def forces_at(velocities):
        total = np.zeros((len(velocities), 6))
        for weight, frame, work in pressed:
            for first in range(0, len(velocities), SLIPS):
                some, count = velocities[first : first + SLIPS], work.value.solved[0]
                slips, forces = (np.zeros((len(some), rows, count)) for rows in (4, 3))
                wrenches = np.zeros((len(some), 6))
                roll_lobe_on(handle, *at, frame, some, slips, forces, wrenches, work)
                total[first : first + SLIPS] += weight * wrenches
        return total

    slip, (a, b), normal = sums[6:9].copy(), sums[9:11], math.hypot(sums[1], sums[2])
    cosine, sine = sums[2] / normal, -sums[1] / normal
    numbers = np.zeros(NUMBERS)
    numbers[columns.LOG_NORMAL] = math.log(normal / (modulus * depth**1.5))
    numbers[columns.ANGLE] = math.atan2(sine, cosine)
    numbers[columns.PLACE_X : columns.PLACE_Z + 1] = slip - half * axle + [0.0, 0.0, radius]
    numbers[[columns.LOG_A, columns.LOG_B, columns.LOG_PEAK]] = np.log([a, b, sums[11] / modulus])
    _part_numbers(numbers, sums)
    # what is added to rolling without slip in the mean, over the creepages of saturation
    free = rolling_slip(numbers, slope, yaw, half, radius, 0.0, 0.0)
    c, limit, at_slip = math.sqrt(a * b), contact.friction * normal, tuple(slip)
    kalker = coefficients_at(math.log(a / b), contact.creep.table.kalker)[:2]
    unit = contact.shear_modulus * c * c / limit

    def exact_and_table(points, factors):
        """Forces (n, 3) of both, over mu N and mu N c; the table's creepages are those times factors."""
        creepages = 3.0 * points / (kalker * factors * unit)
        velocities, exact, table = np.empty((len(points), 6)), np.empty((len(points), 3)), np.empty((len(points), 3))
        slide(free, at_slip, cosine, creepages, velocities)
        along_normal(forces_at(velocities), at_slip, cosine, sine, c, limit, exact)
        base_forces(handle, numbers, slope, yaw, creepages, factors, limit, table)
        return exact, table

    exact, table = exact_and_table(AT_REST, np.ones(2))
    of_exact, of_table = (np.diag(force[[0, 2]] - force[[1, 3]]) for force in (exact, table))
    linear = np.clip((np.abs(of_table) / (6.0 * PROBE) - SPUN[0]) / (SPUN[1] - SPUN[0]), 0.0, 1.0)
    linear *= linear * (3.0 - 2.0 * linear)
    factors = 1.0 + linear * (np.clip(of_exact / of_table, 0.5, 2.0) - 1.0)
    numbers[columns.LINEAR] = linear.min()
    numbers[columns.SLOPE_XI : columns.SLOPE_ETA + 1] = factors
    numbers[columns.FORCE : columns.FORCE + 3] = exact[4] - table[4]
    exact, table = exact_and_table(points, factors)
    return (numbers, exact - table) if np.isfinite(exact).all() else None


def _part_numbers(numbers, sums):
    """Fill in numbers of a lobe's parts, from what `press_lobe` found."""
    root = sums[12]
    if root > 1.0 - columns.LEAST:
        numbers[columns.ROOT] = 1.0
    if not columns.LEAST < root < 1.0 - columns.LEAST:
        return
    whole = [*sums[6:9], *numbers[[columns.ANGLE, columns.LOG_A, columns.LOG_B]]]
    numbers[columns.ROOT : columns.ROOT_B + 1] = root, *(sums[13:19] - root * np.array(whole))
    numbers[columns.REST_A : columns.REST_B + 1] = sums[19:21] - (1.0 - root) * np.array(whole[4:])
    for load, size in ((root, columns.ROOT_B), (1.0 - root, columns.REST_B)):  # strips lie in one plane
        turned = numbers[columns.ROOT_ANGLE] * columns.of_load(load)
        numbers[size] -= load * math.log(max(math.cos(turned), 0.5))
    both = root * (1.0 - root)
    numbers[columns.PARTED] = both * columns.smooth(abs(numbers[columns.ROOT_ANGLE]) / math.sqrt(both), columns.BENT)


@jit(allocates=False)
def rolling_slip(numbers, slope, yaw, half, radius, xi, eta):
    """`Slip` of a wheel that rolls, but for creepages, at a lobe."""
    across = math.sqrt(1.0 - yaw * yaw - slope * slope)
    x, y = numbers[columns.PLACE_X] + half * yaw, numbers[columns.PLACE_Y] + half * across
    rate = 1.0 / (slope * y - across * (numbers[columns.PLACE_Z] + half * slope - radius))
    wx, wy, wz = rate * yaw, rate * across, rate * slope
    cosine, sine, rise = math.cos(numbers[columns.ANGLE]), math.sin(numbers[columns.ANGLE]), wx * y - wy * x
    return Slip(xi, eta, wz * cosine - wy * sine, (eta - rise * sine) / cosine, rise, wx, wy, wz)


@jit(allocates=False, nogil=True)
def slide(free, slip, cosine, creepages, velocities):
    """Fill ``velocities`` (n, 6) of a wheelset at V = 1 m/s: ``free`` (`Slip`) of rolling, with ``creepages`` (n, 2) at
    the place of the ``slip``."""
    x, y, z = slip
    for k in range(len(creepages)):
        velocities[k, 0] = free.wz * y - free.wy * z + creepages[k, 0]
        velocities[k, 1] = free.vy + free.wx * z - free.wz * x + creepages[k, 1] / cosine
        velocities[k, 2] = free.vz + free.wy * x - free.wx * y
        velocities[k, 3], velocities[k, 4], velocities[k, 5] = free.wx, free.wy, free.wz


@jit(allocates=False, nogil=True)
def along_normal(wrenches, slip, cosine, sine, c, limit, forces):
    """Fill ``forces`` (n, 3), over mu N and mu N c, with creep forces and moment about the place of the ``slip`` of
    ``wrenches`` (n, 6) about the wheelset's centre."""
    x, y, z = slip
    for k in range(len(wrenches)):
        fx, fy, fz = wrenches[k, 0], wrenches[k, 1], wrenches[k, 2]
        turn_y, turn_z = wrenches[k, 4] - z * fx + x * fz, wrenches[k, 5] - x * fy + y * fx
        forces[k, 0], forces[k, 1] = fx / limit, (fy * cosine + fz * sine) / limit
        forces[k, 2] = (turn_z * cosine - turn_y * sine) / (c * limit)


@jit(allocates=False, nogil=True)
def base_forces(model, numbers, slope, yaw, creepages, factors, limit, forces):
    """Fill ``forces`` (n, 3), over mu N and mu N c, with those of the creep table at ``creepages`` (n, 2)."""
    half, radius = model.geometry.half_distance, model.geometry.rolling_radius
    for k in range(len(creepages)):
        xi, eta = creepages[k, 0], creepages[k, 1]
        slip = rolling_slip(numbers, slope, yaw, half, radius, xi, eta)
        f1, f2, m3, _, _, _ = base_force(model, numbers, slip, factors[0] * xi, factors[1] * eta, limit)
        forces[k, 0], forces[k, 1], forces[k, 2] = f1, f2, m3


@jit(allocates=False, nogil=True)
def unlike(model, modes, one, other, depth, slope, yaw, points):
    """Largest difference over mu N of the creep forces that two sets of numbers give a lobe, of a wheel that rolls, at
    creepages ``points`` (n, 2) over those of saturation."""
    half, radius = model.geometry.half_distance, model.geometry.rolling_radius
    log_a, log_b, worst = one[columns.LOG_A], one[columns.LOG_B], 0.0
    limit = model.friction * contact_modulus(model.shear_modulus, model.poisson_ratio) * depth**1.5
    limit *= math.exp(one[columns.LOG_NORMAL])
    c11, c22, _, _ = coefficients_at(log_a - log_b, model.creep.table.kalker)
    unit = 3.0 * limit / (model.shear_modulus * math.exp(log_a + log_b))
    for k in range(len(points)):
        xi, eta = unit * points[k, 0] / c11, unit * points[k, 1] / c22
        slip = rolling_slip(one, slope, yaw, half, radius, xi, eta)
        f1, f2, _, _, _ = tabulated_force(model, modes, one, slip, limit, 0.0)
        g1, g2, _, _, _ = tabulated_force(model, modes, other, slip, limit, 0.0)
        worst = max(worst, abs(f1 - g1), abs(f2 - g2))
    return worst / limit


def _modulus(contact):
    return contact_modulus(contact.shear_modulus, contact.poisson_ratio)
