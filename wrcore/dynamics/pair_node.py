"""A node of a `PairTable`: exact contact of a wheel at a place over its rail, reduced to some numbers."""

import math

import numpy as np

from wrcore.contact.detection import find_patches
from wrcore.contact.normal import contact_modulus
from wrcore.contact.patch import rolling, solve
from wrcore.contact.patch.gap import group_end, material_point, rigid_slip, strip_wrenches
from wrcore.contact.patch.model import NUMBERS
from wrcore.contact.patch.strips import WEIGHT, WIDENED
from wrcore.contact.patch.windows import MORE
from wrcore.contact.reduction import MOMENT, PENETRATION
from wrcore.contact.statics import height_of_zero
from wrcore.contact.strip import gap_at, make_pose
from wrcore.creep.kalker import coefficients_at
from wrcore.creep.laws import LAWS, creep_forces
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.motion import WheelMotion
from wrcore.dynamics.pair_table import PART, WIDE, depth_of, lobe_end, tabulated_force
from wrcore.dynamics.strip_wheel import library_of, roll_patch, solve_overlaps
from wrcore.kernels.jit import jit

SUMS = 12
"""Of `press_lobe`."""

SLIPS = 12
"""Of a lobe that are solved at once."""

PROBE = 0.06
"""Creepages, over those of saturation, between which the slopes at rest are taken."""

SPUN = 0.5, 0.8
"""Where spin leaves less than the first part of the table's slope, its factor is 1; where more than the second, it
makes the slope exact."""

AT_REST = PROBE * np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [0, 0]])
"""Creepages with which slopes and force at rest are found."""


REACH = 2.0 * PART
"""A lobe this far from a place on the wheel's profile may still be meant, m."""


@jit(allocates=False, nogil=True)
def lobe_at(geometry, y, z, ex, ey, ez, place, limits, rows):
    """First and end of the overlaps of the lobe nearest to a place on the wheel's profile, their depth D and their own
    place; 0, 0, 0 and the place where there is none."""
    low, high, found, at, first = 0, 0, 0.0, place, 0
    nearest, pose = REACH, make_pose(1.0, y, z, ex, ey, ez, True)
    count = find_patches(geometry, 1.0, y, z, ex, ey, ez, True, MOMENT, rows)
    while first < count:
        group = group_end(geometry, rows, count, first)
        while first < group:
            last = lobe_end(geometry, pose, rows, first, group, limits)
            depth, u = depth_of(rows, first, last)
            if abs(u - place) < nearest:
                low, high, found, at, nearest = first, last, depth, u, abs(u - place)
            first = last
    return low, high, found, at


@jit(allocates=False, nogil=True)
def least_gap(geometry, y, z, ex, ey, ez, place):
    """Smallest vertical gap about a place on the wheel's profile, m."""
    pose, least = make_pose(1.0, y, z, ex, ey, ez, True), 1.0
    for k in range(-8, 9):
        least = min(least, gap_at(geometry, pose, place + 0.125 * PART * k)[0])
    return least


def lobe_of(geometry, place, rows):
    """Pose of the wheelset (y, z, axle) at which the lobe of a place, see `solve_place`, has its depth, where it then
    lies on the wheel's profile, and whether others lie beside it; None where there is none."""
    t, slope, depth, yaw, u, limits = place
    axle = np.array([yaw, math.sqrt(1.0 - yaw * yaw - slope * slope), slope])
    y = t + geometry.rail_distance - geometry.half_distance * axle[1]
    level = geometry.rolling_radius - geometry.half_distance * axle[2]
    level -= least_gap(geometry, y, level, *axle, u) + 0.5 * depth

    def excess(z):
        found = lobe_at(geometry, y, z, *axle, u, limits, rows)[2]
        if found == 0.0 and least_gap(geometry, y, z, *axle, u) < 0.0:  # one with its neighbours
            return depth
        return found - depth

    z = height_of_zero(excess, level)
    first, last, found, at = lobe_at(geometry, y, z, *axle, u, limits, rows)
    beside = (first, last) != lobe_at(geometry, y, z, *axle, u, WIDE, rows)[:2]
    return ((y, z, axle), at, beside) if abs(found - depth) < 1e-6 * depth else None


@jit(allocates=False, nogil=True)
def press_lobe(model, y, z, axle, place, limits, velocity, more, sums, work):
    """Exact solution of a left wheel's lobe near a ``place`` on its profile (m), with ``more`` strips, for a velocity
    (6,) of its wheelset, linear and angular.

    Fills ``sums`` (SUMS,): wrench of pressure about the wheelset's centre, place of the slip from there, semi-axes and
    p_max. Returns the number of windows, 0 where strips find no solution, their frame, and the weight of the solution
    with more strips.
    """
    finer, geometry, (ex, ey, ez) = work.normal.more, model.geometry, axle
    first, last, _, _ = lobe_at(geometry, y, z, ex, ey, ez, place, limits, work.rows)
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
    sums[:] = 0.0
    for i in range(work.normal.start[windows]):
        part = work.strips[solve.STRIP_LOAD, i] / found.load
        px, py, pz, _, _ = material_point(
            geometry, pose, frame, work.strips[solve.CENTRE, i], work.strips[solve.MIDDLE, i],
            work.strips[solve.WHEEL_HEIGHT, i], work.strips[solve.STRIP_TILT, i],
        )  # fmt: skip
        sums[6], sums[7], sums[8] = sums[6] + part * px, sums[7] + part * py, sums[8] + part * pz
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
    `StripWork`, for less and for more strips; ``place``: t, slope of the axle, depth D, yaw, place on the wheel's
    profile (m), and limits of `lobe_end`.
    """
    (_, _, depth, _, u, limits), geometry = place, contact.geometry
    half, radius, modulus = geometry.half_distance, geometry.rolling_radius, _modulus(contact)
    found = lobe_of(geometry, place, works[0].value.rows)
    if found is None:
        return None
    (y, z, axle), *_ = found
    at, sums, each, pressed = (y, z, tuple(axle)), np.zeros(SUMS), np.zeros(SUMS), []
    for work, more in zip(works, (1.0, MORE), strict=True):
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
    # what is added to rolling without slip in the mean, over the creepages of saturation
    turning = axle / (axle[2] * slip[1] - axle[1] * slip[2])
    drift = np.cross(turning, slip)
    free = np.array([1.0, -(drift[1] * cosine + drift[2] * sine) / cosine, 0.0, *turning])
    c, limit, spin = math.sqrt(a * b), contact.friction * normal, turning[2] * cosine - turning[1] * sine
    kalker = coefficients_at(math.log(a / b), contact.creep.table.kalker)[:2]
    unit = contact.shear_modulus * c * c / limit

    def exact_and_table(points, factors):
        """Forces (n, 3) of both, over mu N and mu N c; the table's creepages are those times factors."""
        creepages = 3.0 * points / (kalker * factors)
        velocities = np.tile(free, (len(points), 1))
        velocities[:, :2] += creepages / (unit * np.array([1.0, cosine]))
        found = forces_at(velocities)
        moment, table = found[:, 3:] - np.cross(slip, found[:, :3]), np.zeros((len(points), 3))
        across, turn = found[:, 1] * cosine + found[:, 2] * sine, moment[:, 2] * cosine - moment[:, 1] * sine
        scaled = np.column_stack([creepages * factors, np.full(len(points), spin * unit * c)])
        creep_forces(LAWS["table"], contact.creep, np.full(len(points), a / b), np.zeros(len(points)), scaled, table)
        return np.stack([found[:, 0], across, turn / c], axis=1) / limit, table

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


@jit(allocates=False, nogil=True)
def unlike(model, modes, one, other, depth, spin, points, sums):
    """Largest difference over mu N of the creep forces that two sets of numbers give a lobe at creepages ``points``
    (n, 2) over those of saturation."""
    log_a, log_b, worst = one[columns.LOG_A], one[columns.LOG_B], 0.0
    limit = model.friction * contact_modulus(model.shear_modulus, model.poisson_ratio) * depth**1.5
    limit *= math.exp(one[columns.LOG_NORMAL])
    c11, c22, _, _ = coefficients_at(log_a - log_b, model.creep.table.kalker)
    unit = 3.0 * limit / (model.shear_modulus * math.exp(log_a + log_b))
    for k in range(len(points)):
        xi, eta = unit * points[k, 0] / c11, unit * points[k, 1] / c22
        f1, f2, _, _ = tabulated_force(model, modes, one, xi, eta, spin, limit, 0.0, sums)
        g1, g2, _, _ = tabulated_force(model, modes, other, xi, eta, spin, limit, 0.0, sums)
        worst = max(worst, abs(f1 - g1), abs(f2 - g2))
    return worst / limit


def _modulus(contact):
    return contact_modulus(contact.shear_modulus, contact.poisson_ratio)
