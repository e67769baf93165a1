"""Lobes that are apart, looked up one by one: what they do to each other through the half-space.

The others' pressure lifts a lobe, by Boussinesq's formula, and tilts it, as it lifts the near side by more; their
friction lets it slip, by Cerruti's and the displacement's slope over x (K. L. Johnson, Contact Mechanics, 3.2, 3.6).
A lift changes a lobe's load by its mean over the pressure under a rigid punch (Betti's theorem), so that

    w_i = sum of N_j / (pi E*) times the mean of 1/r,

over Hertz's pressure on lobe j and a punch's on lobe i: along x at Gauss's points, across to second
order. A tilted lobe is one of a wheel that rolls by so much about it.
"""

import math

import numpy as np

from wrcore.contact import reduction
from wrcore.contact.normal import contact_modulus
from wrcore.contact.reduction import MAX_PATCHES
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.pair_table import CURVATURE
from wrcore.kernels.jit import FUSED, jit

NORMAL, LIFT, FORCE_X, FORCE_S, MOMENT, END, CELL, TILT, SLIP_XI, SLIP_ETA, RISE = range(11)
TURN = RISE + MAX_PATCHES
"""Columns of a lobe: its load (N), what others lift it by (m), friction on it (N) and its moment (N m), the end of its
overlaps, the number of its cell, the slope over s of what lifts it, its creepages by the others' friction; what 1 N on
each lobe lifts it by, and that slope."""

STEPS = 6
"""Steps towards balance of the lobes' loads and lifts."""

USUAL, LONG, BROAD = math.log(0.85), 0.75, 0.6
"""ln(N / (E* D^1.5)) of a lobe on the tread that is not known yet, and its semi-axes over those of its overlap."""

LOADED, LOADED_PART = np.array([-1.0, 0.0, 1.0]) * math.sqrt(3.0 / 7.0), np.array([7.0, 16.0, 7.0]) / 30.0
PUNCHED, PUNCHED_PART = np.array([-1.0, 0.0, 1.0]) * math.sqrt(0.6), np.array([5.0, 8.0, 5.0]) / 18.0
"""Places along x over the half length, and weights, of Hertz's pressure and of a punch's."""


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
def _rise(one, other):
    """Mean of 1/r between two lobes, and its slope over s of the first."""
    dx, dy = one[columns.PLACE_X] - other[columns.PLACE_X], one[columns.PLACE_Y] - other[columns.PLACE_Y]
    dz = one[columns.PLACE_Z] - other[columns.PLACE_Z]
    square, value, rate = dy * dy + dz * dz, 0.0, 0.0
    a, b, own = math.exp(other[columns.LOG_A]), math.exp(2.0 * other[columns.LOG_B]), math.exp(one[columns.LOG_A])
    own_b = math.exp(2.0 * one[columns.LOG_B])
    spread = 0.5 * (0.2 * b + own_b / 3.0)
    for m in range(3):
        for n in range(3):
            x = dx + PUNCHED[m] * own - LOADED[n] * a
            inverse2 = 1.0 / (square + x * x)
            part = PUNCHED_PART[m] * LOADED_PART[n] * math.sqrt(inverse2)
            value += part * (1.0 + spread * inverse2 * (3.0 * square * inverse2 - 1.0))
            rate += part * inverse2 * (1.0 + 0.6 * own_b * inverse2)
    return value, -rate * (dy * math.cos(one[columns.ANGLE]) + dz * math.sin(one[columns.ANGLE]))


@jit(allocates=False, fastmath=FUSED)
def balance(model, y, low, count, work):
    """Steps towards balance of the lobes' loads and of what they lift each other by; ``y``: of the axle's point over
    the tape circle, m."""
    lobes, numbers, modulus = work.lobes, work.numbers, contact_modulus(model.shear_modulus, model.poisson_ratio)
    unit = 1.0 / (math.pi * modulus)
    for i in range(count):
        for j in range(count):
            if j != i:
                value, rate = _rise(numbers[i], numbers[j])
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


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _fall(nu, one, other):
    """Mean fall over x, on the first lobe, of the displacements by friction on the other, times pi G: along x by a
    force along x, across by one across and by a moment, and either by the other force."""
    dx, dy = one[columns.PLACE_X] - other[columns.PLACE_X], one[columns.PLACE_Y] - other[columns.PLACE_Y]
    dz = one[columns.PLACE_Z] - other[columns.PLACE_Z]
    square, own, a = dy * dy + dz * dz, math.exp(one[columns.LOG_A]), math.exp(other[columns.LOG_A])
    spread = 0.2 * (math.exp(2.0 * one[columns.LOG_B]) + math.exp(2.0 * other[columns.LOG_B]))
    along = across = turned = aslant = 0.0
    for m in range(3):
        for n in range(3):
            x = dx + LOADED[m] * own - LOADED[n] * a
            inverse2 = 1.0 / (square + x * x)
            part = LOADED_PART[m] * LOADED_PART[n] * inverse2 * math.sqrt(inverse2)
            ahead = x * x * inverse2
            along += part * x * ((1.0 - nu) - nu * (2.0 - 3.0 * ahead))
            across += part * x * ((1.0 - nu) + 3.0 * nu * (1.0 - ahead))
            turned -= part * ((1.0 - nu) + 3.0 * nu * (1.0 - ahead))
            aslant -= part * nu * (1.0 - 3.0 * ahead)
    return along, across, turned, aslant * math.copysign(math.sqrt(square), dy) * (1.0 + 3.0 * spread / square)


@jit(allocates=False, forceinline=True)
def _twist(numbers):
    """Share of friction's moment on a lobe that forces across make: all of it where it is slender."""
    ratio = math.exp(2.0 * (numbers[columns.LOG_B] - numbers[columns.LOG_A]))
    return max(1.0 - ratio, 0.0) / (1.0 + ratio)


@jit(allocates=False, fastmath=FUSED)
def slip_of_others(model, i, count, work):
    """Creepages of a lobe by the friction on the others."""
    lobes, unit, xi, eta = work.lobes, 1.0 / (math.pi * model.shear_modulus), 0.0, 0.0
    for j in range(count):
        if j != i and lobes[j, NORMAL] > 0.0:
            along, across, turned, aslant = _fall(model.poisson_ratio, work.numbers[i], work.numbers[j])
            xi += unit * (along * lobes[j, FORCE_X] + aslant * lobes[j, FORCE_S])
            eta += unit * (
                across * lobes[j, FORCE_S]
                + turned * _twist(work.numbers[j]) * lobes[j, MOMENT]
                + aslant * lobes[j, FORCE_X]
            )
    return xi, eta
