"""What the wrench on a wheel changes by its pose and velocity where its patch is one lobe, looked up.

All is chain rule: over the pose by what M0 changes by (:mod:`wrcore.contact.search.moved`); along the lattice
(:mod:`wrcore.jacobian.table`); over the creepages. The creep table is differenced, and over the pose what the
damping lifts the wheel by: that changes with its approach speed, and so with all velocities.
"""

import math

import numpy as np

from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import contact_modulus
from wrcore.contact.normal.gap import group_end
from wrcore.contact.search.approach import Pressed, add_pressed, approach_of, pressed_from
from wrcore.contact.search.detection import SPATIAL
from wrcore.contact.search.moved import ACROSS, DIFFERENCE, MOVES, ROLL, UP, YAW, moved_axle, slopes_of_square
from wrcore.contact.search.scan import leaves_cells
from wrcore.contact.search.strip import changed_here, make_pose
from wrcore.creep.kalker import coefficients_at
from wrcore.jacobian.hertzian_wheel import (
    SLOPES,
    TABLE,
    add_wrench_slope,
    law_slopes,
    slip_slope,
    slope_of_falling,
)
from wrcore.jacobian.table import look_share_slopes_up, look_slopes_up, remainder_slopes, weigh_slopes
from wrcore.jacobian.wheels import UNCOUNTED
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import contact_of
from wrcore.wheels.force import falling, press_wheels
from wrcore.wheels.modes import PATCHES_ONLY
from wrcore.wheels.motion import as_left, motion_of
from wrcore.wheels.normal_damping import lift_of, lift_share
from wrcore.wheels.table.cells import AXES, FIRST, STEPS, locate
from wrcore.wheels.table.lookup import (
    ANGLE,
    APART,
    FAR,
    LOCKED,
    LOG_A,
    LOG_B,
    LOG_NORMAL,
    MODE,
    PLACE_X,
    PLACE_Y,
    PLACE_Z,
    SADDLE,
    SLOPE_ETA,
    SLOPE_XI,
    Slip,
    base_force,
    lobe_end,
    of_two,
)
from wrcore.wheels.table_force import lifted_place, place_with_depth

SMALL, SMALL_SLIP = 1e-6, 1e-8
"""Differences of velocities, where the lift's slope is wanted (m/s, rad/s), and of ln(a/b); and of velocities over V
where two ellipses are differenced."""

OFFSET, TILT, DEPTH, TURN = range(AXES)

BASE = 3 + AXES
"""Row of what remains where the base force is."""

MIRRORED = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
"""Signs of the directions of the slopes on a right wheel, the mirror image of a left one."""


@jit(allocates=False)
def slopes_of_lobes(jacobian, model, work):
    """Fill ``jacobian.slopes`` with those of lobes; wheels with others are `UNCOUNTED` in ``jacobian.counts``."""
    base = jacobian.motions
    press_wheels(model, work, PATCHES_ONLY)
    for k in range(base.shape[0]):
        for wheel in range(2):
            contact, seen = contact_of(model.contact, k, wheel), motion_of(base[k, wheel])
            rows, count, slopes = work.patches[k, wheel], work.counts[k, wheel], jacobian.slopes[k, wheel]
            slopes[:], jacobian.counts[k, wheel] = 0.0, 0
            if not lobe_slopes(contact, as_left(seen), rows, count, jacobian.law, slopes, work.strips):
                jacobian.counts[k, wheel] = UNCOUNTED
                continue
            for j in range(SLOPES if seen.side < 0.0 else 0):
                for i in range(6):
                    slopes[j, i] *= MIRRORED[j] * (-1.0 if i % 2 else 1.0)


@jit(allocates=False, fastmath=FUSED)
def lobe_slopes(model, m, rows, count, scratch, out, work):
    """Fill ``out`` (SLOPES, 6) with the slopes of a left wheel's wrench about the wheelset's centre, whose overlaps are
    the first ``count`` of ``rows``; False where its patch is not one lobe that the table has. Overwrites ``scratch``
    (8, 1 + MOVES)."""
    geometry, table = model.geometry, model.strips.table
    if model.detection != SPATIAL or changed_here(geometry):
        return False
    if count == 0:
        return True
    pose, ahead = make_pose(1.0, m.y, m.z, m.ex, m.ey, m.ez, True), -1.0 if m.vx < 0.0 else 1.0
    if group_end(geometry, rows, count, 0) < count or leaves_cells(pose):
        return False
    pressed = _pressed_nearby(geometry, pose, rows, count, scratch)
    if math.isnan(pressed.moment):
        return False
    lift = lift_of(model, m, pressed)
    if lift.share >= 1.0:
        return True
    pose, (log_depth, u) = lifted_place(m, pressed, lift)
    if lobe_end(geometry, pose, rows, 0, count, (APART, FAR, SADDLE)) < count:
        return False
    t = pose.y + geometry.half_distance * m.ey - geometry.rail_distance
    at = locate(table, u, False, t, m.ez, log_depth, ahead * m.ex, work.shares)
    if at.cell == 0:
        return False
    _lattice_rates(model, m, pressed, lift, rows, count, scratch, work)
    if at.own < 1.0:
        look_share_slopes_up(table, at, work.shares, work.spread, work.numbers[0], work.along)
    else:
        weigh_slopes(at, work.spread)
        look_slopes_up(table.cells[at.cell], work.spread, work.numbers[0], work.along)
    if log_depth - FIRST[2] < STEPS[2]:  # looked up at the least depth
        work.along[DEPTH] = 0.0
    _force_slopes(model, m, log_depth, ahead, scratch[3:, :3], out, work)
    return True


@jit(allocates=False, fastmath=FUSED)
def _pressed_nearby(geometry, pose, rows, count, sums):
    """`Pressed` of the overlaps in ``rows`` at a pose nearby, a moment of NaN where one of them has few nodes."""
    total = Pressed(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for patch in range(count):
        middle = slopes_of_square(geometry, pose, rows[patch], sums)
        total = add_pressed(total, pressed_from(pose, middle, sums))
    return total


@jit(allocates=False, fastmath=FUSED)
def _lattice_rates(model, m, pressed, lift, rows, count, sums, work):
    """Fill ``work.lattice`` (SLOPES, AXES) with what the wheel's place on the lattice changes by."""
    rates = work.lattice
    (_, (_, u)), depth, aside = (
        lifted_place(m, pressed, lift),
        lift.depth * lift.sine,
        lift.share * lift.depth * lift.sine,
    )
    own = pressed.across, pressed.up, pressed.about_x, pressed.about_z
    ahead, half = -1.0 if m.vx < 0.0 else 1.0, model.geometry.half_distance
    for k in range(MOVES):
        ex, ey, ez = moved_axle(m.ex, m.ey, m.ez, k, DIFFERENCE)
        across = DIFFERENCE if k == ACROSS else 0.0
        there = make_pose(1.0, m.y + across, m.z + (DIFFERENCE if k == UP else 0.0), ex, ey, ez, True)
        moved = _pressed_nearby(model.geometry, there, rows, count, sums)
        its = lift_of(model, m, moved)
        its_u = lifted_place(m, moved, its)[1][1]
        across += half * (ey - m.ey) - its.share * its.depth * its.sine + aside
        rates[k, OFFSET], rates[k, TILT] = (across - its_u + u) / DIFFERENCE, (ez - m.ez) / DIFFERENCE
        rates[k, TURN] = ahead * (ex - m.ex) / DIFFERENCE
        rates[k, DEPTH] = 0.4 * own[k] / pressed.square - (its.share - lift.share) / (DIFFERENCE * (1.0 - lift.share))
    size = math.sqrt(pressed.across * pressed.across + pressed.up * pressed.up)
    approach = approach_of(pressed, m)[3]
    faster = (lift_share(model, approach + SMALL) - lift.share) / (SMALL * size)
    left = place_with_depth(pressed, lift) / (1.0 - lift.share)
    speeds = 0.0, pressed.across, pressed.up, pressed.about_x, pressed.about_y, pressed.about_z
    for j in range(6):
        share = faster * speeds[j]
        rates[MOVES + j] = 0.0
        rates[MOVES + j, OFFSET], rates[MOVES + j, DEPTH] = left * share - share * depth, -share / (1.0 - lift.share)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _turned(m, j):
    """What the axle's direction changes by in a direction."""
    if j == ROLL:
        return 0.0, -m.ez, m.ey
    if j == YAW:
        return -m.ey, m.ex, 0.0
    return 0.0, 0.0, 0.0


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _sum_along(along, column, rates):
    """What a number changes by, from what the places on the lattice's axes do."""
    return (
        along[OFFSET, column] * rates[OFFSET] + along[TILT, column] * rates[TILT] + along[DEPTH, column] * rates[DEPTH]
        + along[TURN, column] * rates[TURN]
    )  # fmt: skip


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _sum_axes(rest, k, rates):
    """The same of the remainder, see `remainder_slopes`."""
    return (
        rest[3 + OFFSET, k] * rates[OFFSET] + rest[3 + TILT, k] * rates[TILT] + rest[3 + DEPTH, k] * rates[DEPTH]
        + rest[3 + TURN, k] * rates[TURN]
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def _difference_two(model, numbers, slip, args, own, rates, d_args, step, normal, work):
    """What two ellipses' creep force (`base_force`) changes by in a direction, by a ``step`` in it. ``own``: what the
    place on the lattice changes by; ``rates``, ``d_args``: what the ``slip`` does, and ``args``, both creepages and
    ln(mu N); ``normal``: what friction has along the normal here."""
    moved, along, base = work.numbers[1], work.along, work.rest
    for column in range(MODE):
        moved[column] = numbers[column] + step * _sum_along(along, column, own)
    there = Slip(
        slip.xi + step * rates.xi, slip.eta + step * rates.eta, slip.phi + step * rates.phi, slip.vy + step * rates.vy,
        slip.vz + step * rates.vz, slip.wx + step * rates.wx, slip.wy + step * rates.wy, slip.wz + step * rates.wz,
    )  # fmt: skip
    f1, f2, m3, _, _, fn = base_force(
        model, moved, there, args[0] + step * d_args[0], args[1] + step * d_args[1], args[2] * (1.0 + step * d_args[2])
    )
    d1, d2, d3 = (f1 - base[BASE, 0]) / step, (f2 - base[BASE, 1]) / step, (m3 - base[BASE, 2]) / step
    return d1, d2, d3, (fn - normal) / step


@jit(allocates=False, fastmath=FUSED)
def _force_slopes(model, m, log_depth, ahead, law, out, work):
    """Fill ``out`` with what the rates in ``work.lattice`` and those of the wheel's motion change of the wrench; see
    `roll_lobe` and `tabulated_force`. ``law`` (5, 3) is scratch."""
    numbers, along, rest, half = work.numbers[0], work.along, work.rest, model.geometry.half_distance
    radius, angle, log_g = model.geometry.rolling_radius, numbers[ANGLE], numbers[LOG_A] - numbers[LOG_B]
    cosine, sine, square = math.cos(angle), math.sin(angle), math.exp(numbers[LOG_A] + numbers[LOG_B])
    modulus = contact_modulus(model.shear_modulus, model.poisson_ratio)
    normal = modulus * math.exp(numbers[LOG_NORMAL] + 1.5 * log_depth)
    px = ahead * numbers[PLACE_X] + half * m.ex
    py, pz = numbers[PLACE_Y] + half * m.ey, numbers[PLACE_Z] + half * m.ez - radius
    speed = max(abs(m.vx), model.least_speed)
    slow, rolling = 1.0 / speed, (math.copysign(1.0, m.vx) if abs(m.vx) > model.least_speed else 0.0)
    xi, eta, phi, _ = creepages(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, px, py, pz, cosine, sine, speed)
    uy, uz = m.vy + m.wz * px - m.wx * pz, m.vz + m.wx * py - m.wy * px
    limit = falling(model, m.friction, xi, eta, speed) * normal
    fall = slope_of_falling(model, m.friction, xi, eta, speed)
    part = (ahead * m.wy * radius * slow - 1.0) / LOCKED
    left = max(0.0, 1.0 - part * part)
    fade, more_xi, more_eta = left * left, numbers[SLOPE_XI] - 1.0, numbers[SLOPE_ETA] - 1.0
    slip = Slip(
        ahead * xi, eta, ahead * phi, slow * uy, slow * uz, slow * m.wx, ahead * slow * m.wy, ahead * slow * m.wz
    )  # fmt: skip
    one, other = (1.0 + fade * more_xi) * slip.xi, (1.0 + fade * more_eta) * eta
    c, scale = math.sqrt(square), model.shear_modulus * square / limit
    x1, x2, x3, two = one * scale, other * scale, slip.phi * scale * c, of_two(numbers) > 0.0
    fn = dn = 0.0
    if two:
        law[0, 0], law[0, 1], law[0, 2], _, _, fn = base_force(model, numbers, slip, one, other, limit)
    else:
        law_slopes(TABLE, model.creep, log_g, math.exp(log_g), (x1, x2, x3), law)
    c11, c22, _, _ = coefficients_at(log_g, model.creep.table.kalker)
    c11_more, c22_more, _, _ = coefficients_at(log_g + SMALL, model.creep.table.kalker)
    remainder_slopes(model.strips.table.modes, numbers, along, x1 * c11 / 3.0, x2 * c22 / 3.0, rest)
    for k in range(3):
        rest[BASE, k] = law[0, k]
    fx, fy, mz = law[0, 0] + fade * rest[0, 0], law[0, 1] + fade * rest[0, 1], law[0, 2] + fade * rest[0, 2]
    bound = 1.0 / max(math.sqrt(fx * fx + fy * fy), 1.0)
    fx, fy = bound * fx, bound * fy
    f1, f2, m3 = ahead * limit * fx, limit * fy, ahead * limit * c * mz
    for j in range(SLOPES):
        own, (ex, ey, ez) = work.lattice[j], _turned(m, j)
        dp = (
            ahead * _sum_along(along, PLACE_X, own) + half * ex, _sum_along(along, PLACE_Y, own) + half * ey,
            _sum_along(along, PLACE_Z, own) + half * ez,
        )  # fmt: skip
        turned = _sum_along(along, ANGLE, own)
        d = slip_slope(
            m, j, (px, py, pz), dp, (cosine, sine), (-sine * turned, cosine * turned), (xi, eta, phi, uy, uz), slow,
            rolling,
        )  # fmt: skip
        da, db = _sum_along(along, LOG_A, own), _sum_along(along, LOG_B, own)
        wider, rounder = da + db, da - db
        harder = _sum_along(along, LOG_NORMAL, own) + 1.5 * own[DEPTH]
        d_limit = harder + fall * (slow * (xi * xi + eta * eta) * d.speed + xi * d.xi + eta * d.eta)
        locked = ahead * radius * slow * ((1.0 if j == MOVES + 4 else 0.0) - m.wy * slow * d.speed) / LOCKED
        faded = -4.0 * left * part * locked
        d_one = (1.0 + fade * more_xi) * ahead * d.xi
        d_one += slip.xi * (faded * more_xi + fade * _sum_along(along, SLOPE_XI, own))
        d_other = (1.0 + fade * more_eta) * d.eta + eta * (faded * more_eta + fade * _sum_along(along, SLOPE_ETA, own))
        dx1, dx2 = d_one * scale + x1 * (wider - d_limit), d_other * scale + x2 * (wider - d_limit)
        if two:
            rates = Slip(
                ahead * d.xi, d.eta, ahead * d.phi,
                slow * (d.uy - slip.vy * d.speed), slow * (d.uz - slip.vz * d.speed),
                slow * ((1.0 if j == MOVES + 3 else 0.0) - slip.wx * d.speed),
                slow * (ahead * (1.0 if j == MOVES + 4 else 0.0) - slip.wy * d.speed),
                slow * (ahead * (1.0 if j == MOVES + 5 else 0.0) - slip.wz * d.speed),
            )  # fmt: skip
            d1, d2, d3, dn = _difference_two(
                model, numbers, slip, (one, other, limit), own, rates, (d_one, d_other, d_limit),
                DIFFERENCE if j < MOVES else SMALL_SLIP * speed, fn, work,
            )  # fmt: skip
        else:
            dx3 = ahead * d.phi * scale * c + x3 * (1.5 * wider - d_limit)
            d1 = law[1, 0] * rounder + law[2, 0] * dx1 + law[3, 0] * dx2 + law[4, 0] * dx3
            d2 = law[1, 1] * rounder + law[2, 1] * dx1 + law[3, 1] * dx2 + law[4, 1] * dx3
            d3 = law[1, 2] * rounder + law[2, 2] * dx1 + law[3, 2] * dx2 + law[4, 2] * dx3
        dx = (dx1 * c11 + x1 * rounder * (c11_more - c11) / SMALL) / 3.0
        dy = (dx2 * c22 + x2 * rounder * (c22_more - c22) / SMALL) / 3.0
        d1 += faded * rest[0, 0] + fade * (rest[1, 0] * dx + rest[2, 0] * dy + _sum_axes(rest, 0, own))
        d2 += faded * rest[0, 1] + fade * (rest[1, 1] * dx + rest[2, 1] * dy + _sum_axes(rest, 1, own))
        d3 += faded * rest[0, 2] + fade * (rest[1, 2] * dx + rest[2, 2] * dy + _sum_axes(rest, 2, own))
        if bound < 1.0:
            across = fx * d1 + fy * d2
            d1, d2 = bound * (d1 - across * fx), bound * (d2 - across * fy)
        add_wrench_slope(
            (px, py, pz), dp, (cosine, sine), (-sine * turned, cosine * turned),
            (f1, f2, normal + bound * limit * fn, m3),
            (
                ahead * limit * (d1 + fx * d_limit), limit * (d2 + fy * d_limit),
                normal * harder + bound * limit * (dn + fn * d_limit),
                ahead * limit * c * (d3 + mz * (d_limit + 0.5 * wider)),
            ), out[j],
        )  # fmt: skip
