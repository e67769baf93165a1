"""Lobes that are apart, looked up one by one: what they do to each other through the half-space.

The others' pressure lifts a lobe and tilts it, and their friction lets it slip, as
:mod:`wrcore.contact.half_space_coupling` has it. A tilted lobe is one of a wheel that rolls by so much about it.
"""

import math

from wrcore.contact.half_space_coupling import Ellipse, rise_by_pressure, slip_by_friction
from wrcore.contact.hertz import contact_modulus
from wrcore.contact.search import reduction
from wrcore.contact.search.reduction import MAX_PATCHES
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.table import lookup as columns
from wrcore.wheels.table.lookup import CURVATURE

NORMAL, LIFT, FORCE_X, FORCE_S, MOMENT, END, CELL, TILT, SLIP_XI, SLIP_ETA, RISE = range(11)
TURN = RISE + MAX_PATCHES
"""Columns of a lobe: its load (N), what others lift it by (m), friction on it (N) and its moment (N m), the end of its
overlaps, the number of its cell, the slope over s of what lifts it, its creepages by the others' friction; what 1 N on
each lobe lifts it by, and that slope."""

STEPS = 6
"""Steps towards balance of the lobes' loads and lifts."""

USUAL, LONG, BROAD = math.log(0.85), 0.75, 0.6
"""ln(N / (E* D^1.5)) of a lobe on the tread that is not known yet, and its semi-axes over those of its overlap."""


@jit(allocates=False, forceinline=True)
def load_of(modulus, numbers, depth):
    """Load of a lobe of a ``depth`` D, N."""
    return modulus * depth * math.sqrt(depth) * math.exp(numbers[columns.LOG_NORMAL])


@jit(allocates=False, forceinline=True)
def depth_left(rows, first, last, lobe, y):
    """D of a lobe that is lifted, and tilted about ``y``, and its place on the wheel's profile, m."""
    total = moment = 0.0
    for k in range(first, last):
        row, b, tilt = rows[k], rows[k, reduction.CURVATURE_Y], lobe[TILT]
        beside = (row[reduction.Y] - y) / row[reduction.COSINE]
        left = max(row[reduction.PENETRATION] - lobe[LIFT] - tilt * beside + 0.25 * tilt * tilt / b, 0.0)
        square = left * left * math.sqrt(left / b) / row[reduction.COSINE]
        u = row[reduction.U_WHEEL] - 0.5 * tilt / b * row[reduction.COSINE]
        total, moment = total + square, moment + square * u
    return (math.sqrt(CURVATURE) * total) ** 0.4, moment / max(total, 1e-30)


@jit(allocates=False, forceinline=True)
def tilt_back(numbers, tilt, radius):
    """From numbers of a lobe whose wheel was tilted to those where its surface is, by half of that."""
    y = numbers[columns.PLACE_Y]
    numbers[columns.PLACE_Y] = y - tilt * (radius - numbers[columns.PLACE_Z])
    numbers[columns.PLACE_Z] -= tilt * y
    numbers[columns.ANGLE] -= 0.5 * tilt


@jit(allocates=False, fastmath=FUSED)
def guess_lobes(model, pose, axle_y, axle_z, low, count, work):
    """First guess of the numbers of lobes, and their balance, before any is looked up; ``axle_y``, ``axle_z``: of the
    axle's point over the tape circle from the wheelset's centre, m."""
    modulus, first = contact_modulus(model.shear_modulus, model.poisson_ratio), low
    for q in range(count):
        last, numbers, row = int(work.lobes[q, END]), work.numbers[q], work.rows[first]
        numbers[:] = 0.0
        deep = row[reduction.PENETRATION]
        numbers[columns.LOG_NORMAL] = USUAL + 0.6 * math.log(row[reduction.COSINE])
        numbers[columns.ANGLE] = row[reduction.ANGLE]
        numbers[columns.LOG_A] = math.log(LONG * math.sqrt(deep / row[reduction.CURVATURE_X]))
        numbers[columns.LOG_B] = math.log(BROAD * math.sqrt(deep / row[reduction.CURVATURE_Y]))
        numbers[columns.PLACE_Y] = row[reduction.Y] - pose.y - axle_y
        numbers[columns.PLACE_Z] = row[reduction.Z] - pose.z - axle_z + model.geometry.rolling_radius
        depth, _ = depth_left(work.rows, first, last, work.lobes[q], row[reduction.Y])
        work.lobes[q, NORMAL] = load_of(modulus, numbers, depth)
        first = last
    balance(model, pose.y + axle_y, low, count, work)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _ellipse(numbers):
    """The `Ellipse` of a lobe."""
    angle = numbers[columns.ANGLE]
    return Ellipse(
        numbers[columns.PLACE_X], numbers[columns.PLACE_Y], numbers[columns.PLACE_Z], math.exp(numbers[columns.LOG_A]),
        math.exp(numbers[columns.LOG_B]), math.cos(angle), math.sin(angle),
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def balance(model, y, low, count, work):
    """Steps towards balance of the lobes' loads and of what they lift each other by; ``y``: of the axle's point over
    the tape circle, m."""
    lobes, numbers, modulus = work.lobes, work.numbers, contact_modulus(model.shear_modulus, model.poisson_ratio)
    unit = 1.0 / (math.pi * modulus)
    for i in range(count):
        for j in range(count):
            if j != i:
                value, rate = rise_by_pressure(_ellipse(numbers[i]), _ellipse(numbers[j]))
                lobes[i, RISE + j], lobes[i, TURN + j] = unit * value, unit * rate
    for _ in range(STEPS):
        for i in range(count):
            lobes[i, LIFT] = lobes[i, TILT] = 0.0
            for j in range(count):
                if j != i:
                    lobes[i, LIFT] += lobes[i, RISE + j] * lobes[j, NORMAL]
                    lobes[i, TILT] += lobes[i, TURN + j] * lobes[j, NORMAL]
        first = low
        for i in range(count):
            last = int(lobes[i, END])
            depth, _ = depth_left(work.rows, first, last, lobes[i], y + numbers[i, columns.PLACE_Y])
            lobes[i, NORMAL] = load_of(modulus, numbers[i], depth)
            first = last


@jit(allocates=False, fastmath=FUSED)
def slip_of_others(model, i, count, work):
    """Creepages of a lobe by the friction on the others."""
    lobes, unit, xi, eta = work.lobes, 1.0 / (math.pi * model.shear_modulus), 0.0, 0.0
    for j in range(count):
        if j != i and lobes[j, NORMAL] > 0.0:
            x, y = slip_by_friction(
                model.poisson_ratio, _ellipse(work.numbers[i]), _ellipse(work.numbers[j]), lobes[j, FORCE_X],
                lobes[j, FORCE_S], lobes[j, MOMENT],
            )  # fmt: skip
            xi, eta = xi + unit * x, eta + unit * y
    return xi, eta
