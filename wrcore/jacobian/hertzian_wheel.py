"""Derivatives of a wheel's contact force and moment with respect to its position, attitude and velocity, for ellipses.

The derivatives of the patches' rows with respect to position and attitude come from
:mod:`wrcore.contact.search.moved`, or a search. The chain rule gives all others; only derivatives of Hertz's shape
functions and of the creep law with respect to their arguments are differences. With x' the derivative of x in one
direction, d the penetration, and relative derivatives n' of N, s' of a b, l' of mu N:

    n' = 3/2 d'/d + (ln N)_A A' + (ln N)_B B' + c_d'/c_d,   s' = d'/d + (ln ab)_A A' + (ln ab)_B B' + 2/3 c_d'/c_d.

The derivative of a nondimensional creepage x = xi G a b/(mu N) is xi' G a b/(mu N) + (s' - l') x.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import damping_factor
from wrcore.contact.rail_friction import friction_at, friction_slope
from wrcore.contact.search import reduction
from wrcore.contact.search.moved import MOVES
from wrcore.contact.search.strip import changes_along
from wrcore.creep.laws import LAWS, creep_force_at
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import is_elliptic
from wrcore.wheels.force import falling
from wrcore.wheels.hertzian_force import normal_ellipse

SLOPES = MOVES + 6
"""Number of rows of derivatives (slopes): those of `MOVES`, then velocity and angular velocity."""

SMALL = 1e-6
"""Difference of arguments of shape functions and creep laws, relative to their size; of approach speeds in m/s."""

SAME = 1e-5
"""Maximum distance on the wheel's profile, m, between corresponding patches before and after a small move."""

TABLE = LAWS["table"]
"""Number of the creep law by table."""


def slope_scratch(model):
    """Allocate the scratch arrays for the derivatives of all wheels.

    They are: patches as found and after moves, their counts, derivatives of each wheel, derivatives of a creep law. A
    wheel has `SLOPES` rows and 6 columns (force and moment). A flexible track adds four rows of its rail, and two
    columns of their rates; independently rotating wheels add one of each."""
    flexible, apart = len(model.flexible_track.mass) > 0, len(model.bodies.independent) > 0
    wheelsets, size = len(model.bodies.wheelsets), (SLOPES + 4 * flexible + apart, 6 + 2 * flexible + apart)
    patches = np.zeros((1 + MOVES, wheelsets, 2, reduction.MAX_PATCHES, reduction.PATCH_COLUMNS))
    return patches, np.zeros((wheelsets, 2), np.int64), np.zeros((wheelsets, 2, *size)), np.zeros((8, 1 + MOVES))


@jit(allocates=False)
def differentiable(contact):
    """Whether `patch_slopes` applies to a contact model: ellipses without shape numbers, on unchanging rails."""
    shaped = contact.law == TABLE and contact.creep.table.axes.n_psi > 1
    return is_elliptic(contact) and not (shaped or changes_along(contact.geometry))


@jit(allocates=False, fastmath=FUSED)
def law_slopes(law, creep, log_g, g, x, table):
    """Fill ``table`` (5, 3) with Fx, Fy, Mz of a creep law, and their derivatives by ln(a/b) and the creepages ``x``.

    All are nondimensional; ``g`` is a/b and ``log_g`` its logarithm."""
    for k in range(5):
        h0, h1 = (SMALL if k == 1 else 0.0), (SMALL * (1.0 + abs(x[0])) if k == 2 else 0.0)
        h2, h3 = (SMALL * (1.0 + abs(x[1])) if k == 3 else 0.0), (SMALL * (1.0 + abs(x[2])) if k == 4 else 0.0)
        table[k, 0], table[k, 1], table[k, 2], _ = creep_force_at(
            law, creep, log_g + h0, g * (1.0 + h0), 0.0, x[0] + h1, x[1] + h2, x[2] + h3
        )
        if k > 0:
            difference = h0 + h1 + h2 + h3
            for i in range(3):
                table[k, i] = (table[k, i] - table[0, i]) / difference


@jit(allocates=False, fastmath=FUSED)
def slope_of_falling(contact, friction, xi, eta, speed):
    """Return d(ln mu) / (xi dxi + eta deta + (xi^2 + eta^2) dV/V) for friction that falls with slip velocity."""
    slip = speed * math.sqrt(xi * xi + eta * eta)
    if contact.friction_ratio == 1.0 or slip == 0.0:
        return 0.0
    less = falling(contact, friction, slip + SMALL, 0.0, 1.0) / falling(contact, friction, slip, 0.0, 1.0) - 1.0
    return less / SMALL * speed * speed / slip


class SlipSlope(NamedTuple):
    """Derivatives of a patch's slip with respect to motion in one direction."""

    speed: float
    """Derivative of the speed V by which creepages are divided."""
    uy: float
    uz: float
    """Derivatives of the velocity of the wheel's material point."""
    xi: float
    eta: float
    phi: float
    """Derivatives of creepages and spin."""


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def slip_slope(m, j, p, dp, angle, d_angle, slip, slow, rolling):
    """Return the `SlipSlope` of a patch in direction ``j``.

    The patch is at ``p`` (m) relative to the wheelset's centre, with derivative ``dp``; ``angle`` is (cosine, sine) of
    its contact angle, with derivatives ``d_angle``. ``slip``: xi, eta, phi, and the material point's velocity along y
    and z. ``slow`` is 1/V, ``rolling`` the derivative of V with respect to vx."""
    (px, py, pz), (dpx, dpy, dpz), (cosine, sine), (dcosine, dsine), (xi, eta, phi, uy, uz) = (
        p,
        dp,
        angle,
        d_angle,
        slip,
    )
    dvx, dvy, dvz = (1.0 if j == 4 else 0.0), (1.0 if j == 5 else 0.0), (1.0 if j == 6 else 0.0)
    dwx, dwy, dwz = (1.0 if j == 7 else 0.0), (1.0 if j == 8 else 0.0), (1.0 if j == 9 else 0.0)
    dspeed = rolling * dvx
    dux = dvx + dwy * pz + m.wy * dpz - dwz * py - m.wz * dpy
    duy = dvy + dwz * px + m.wz * dpx - dwx * pz - m.wx * dpz
    duz = dvz + dwx * py + m.wx * dpy - dwy * px - m.wy * dpx
    dxi = (dux - xi * dspeed) * slow
    deta = (duy * cosine + uy * dcosine + duz * sine + uz * dsine - eta * dspeed) * slow
    dphi = (dwz * cosine + m.wz * dcosine - dwy * sine - m.wy * dsine - phi * dspeed) * slow
    return SlipSlope(dspeed, duy, duz, dxi, deta, dphi)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def add_wrench_slope(p, dp, angle, d_angle, force, d_force, out):
    """Add the derivatives of a patch's force and moment about the wheelset's centre to ``out`` (6,).

    ``force`` contains longitudinal, lateral and normal force and the moment about the normal; ``d_force`` their
    derivatives. Other arguments are those of `slip_slope`."""
    (px, py, pz), (dpx, dpy, dpz), (cosine, sine), (dcosine, dsine) = p, dp, angle, d_angle
    (fx, fy, normal, mz), (dfx, dfy, dn, dmz) = force, d_force
    gy, gz = fy * cosine - normal * sine, fy * sine + normal * cosine
    dgy = dfy * cosine + fy * dcosine - dn * sine - normal * dsine
    dgz = dfy * sine + fy * dsine + dn * cosine + normal * dcosine
    out[0] += dfx
    out[1] += dgy
    out[2] += dgz
    out[3] += dpy * gz + py * dgz - dpz * gy - pz * dgy
    out[4] += dpz * fx + pz * dfx - dpx * gz - px * dgz - dmz * sine - mz * dsine
    out[5] += dpx * gy + px * dgy - dpy * fx - py * dfx + dmz * cosine + mz * dcosine


@jit(allocates=False, fastmath=FUSED)
def _shape_slopes(contact, penetration, A, B, approach, table):
    """Fill ``table`` (3, 4) with values and derivatives of a loaded ellipse.

    Row 0: N, a b, ln(a/b) and a/b. Rows 1 and 2: derivatives of ln N, ln(a b) and ln(a/b) with respect to the
    curvatures A and B."""
    for k in range(3):
        h = SMALL * (A if k == 1 else B)
        normal, a, b, ratio, log_ratio = normal_ellipse(
            contact, penetration, A + (h if k == 1 else 0.0), B + (h if k == 2 else 0.0), approach
        )
        if k == 0:
            table[0, 0], table[0, 1], table[0, 2], table[0, 3] = normal, a * b, log_ratio, ratio
        else:
            table[k, 0], table[k, 1] = (normal / table[0, 0] - 1.0) / h, (a * b / table[0, 1] - 1.0) / h
            table[k, 2] = (log_ratio - table[0, 2]) / h


@jit(allocates=False, fastmath=FUSED)
def patch_slopes(contact, m, row, moved, patch, difference, scratch, out):
    """Add the derivatives of one patch's force and moment about the wheelset's centre to ``out`` (SLOPES, 6).

    ``row`` is the patch as found, ``moved[1 + k, patch]`` the patch after a ``difference`` (m, rad) in the k-th
    direction of `MOVES`; ``scratch`` has shape (8, 4 or more).
    """
    px, py, pz = row[reduction.X], row[reduction.Y] - m.y, row[reduction.Z] - m.z
    cosine, sine, depth = row[reduction.COSINE], row[reduction.SINE], row[reduction.PENETRATION]
    speed = max(abs(m.vx), contact.least_speed)
    slow, rolling = 1.0 / speed, (math.copysign(1.0, m.vx) if abs(m.vx) > contact.least_speed else 0.0)
    xi, eta, phi, approach = creepages(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, px, py, pz, cosine, sine, speed)
    uy, uz = m.vy + m.wz * px - m.wx * pz, m.vz + m.wx * py - m.wy * px
    A = row[reduction.CURVATURE_X] + 0.5 * (m.bend_y * sine - m.bend_z * cosine)
    shape, law = scratch[:3], scratch[3:, :3]
    _shape_slopes(contact, depth, A, row[reduction.CURVATURE_Y], approach, shape)
    normal, square = shape[0, 0], shape[0, 1]
    factor = damping_factor(approach, contact.damping, contact.damping_speed)
    damped = (damping_factor(approach + SMALL, contact.damping, contact.damping_speed) / factor - 1.0) / SMALL
    at_angle = friction_at(contact.friction_across, m.friction, cosine, m.side * sine)
    steep = m.side * friction_slope(contact.friction_across, cosine, m.side * sine)
    friction, fall = falling(contact, at_angle, xi, eta, speed), slope_of_falling(contact, at_angle, xi, eta, speed)
    forward = 1.0 if m.vx >= speed else m.vx / speed
    limit, c = friction * normal, math.sqrt(square)
    scale = contact.shear_modulus * square / limit
    x1, x2, x3 = xi * scale, eta * scale, forward * phi * scale * c
    law_slopes(contact.law, contact.creep, shape[0, 2], shape[0, 3], (x1, x2, x3), law)
    f1, f2, f3 = law[0, 0], law[0, 1], law[0, 2]
    fx, fy, mz = limit * f1, limit * f2, forward * limit * c * f3
    for j in range(SLOPES):
        dpx = dpy = dpz = dcosine = dsine = ddepth = dA = dB = 0.0
        if j < MOVES:
            new, inverse = moved[1 + j, patch], 1.0 / difference
            dpx = (new[reduction.X] - row[reduction.X]) * inverse
            dpy = (new[reduction.Y] - row[reduction.Y]) * inverse - (1.0 if j == 0 else 0.0)
            dpz = (new[reduction.Z] - row[reduction.Z]) * inverse - (1.0 if j == 1 else 0.0)
            dcosine = (new[reduction.COSINE] - cosine) * inverse
            dsine = (new[reduction.SINE] - sine) * inverse
            ddepth = (new[reduction.PENETRATION] - depth) * inverse
            dA = (new[reduction.CURVATURE_X] - row[reduction.CURVATURE_X]) * inverse
            dA += 0.5 * (m.bend_y * dsine - m.bend_z * dcosine)
            dB = (new[reduction.CURVATURE_Y] - row[reduction.CURVATURE_Y]) * inverse
        d = slip_slope(
            m, j, (px, py, pz), (dpx, dpy, dpz), (cosine, sine), (dcosine, dsine), (xi, eta, phi, uy, uz), slow, rolling
        )
        dforward = slow if rolling == 0.0 and j == MOVES else 0.0
        damping = damped * (d.uy * sine + uy * dsine - d.uz * cosine - uz * dcosine)
        deeper = ddepth / depth
        dnormal = 1.5 * deeper + shape[1, 0] * dA + shape[2, 0] * dB + damping
        dsquare = deeper + shape[1, 1] * dA + shape[2, 1] * dB + 2.0 / 3.0 * damping
        dratio = shape[1, 2] * dA + shape[2, 2] * dB
        dlimit = dnormal + fall * (slow * (xi * xi + eta * eta) * d.speed + xi * d.xi + eta * d.eta)
        dlimit += steep * (cosine * dsine - sine * dcosine)
        dscale = dsquare - dlimit
        dx1, dx2 = d.xi * scale + x1 * dscale, d.eta * scale + x2 * dscale
        dx3 = (forward * d.phi + dforward * phi) * scale * c + x3 * (dscale + 0.5 * dsquare)
        df1 = law[1, 0] * dratio + law[2, 0] * dx1 + law[3, 0] * dx2 + law[4, 0] * dx3
        df2 = law[1, 1] * dratio + law[2, 1] * dx1 + law[3, 1] * dx2 + law[4, 1] * dx3
        df3 = law[1, 2] * dratio + law[2, 2] * dx1 + law[3, 2] * dx2 + law[4, 2] * dx3
        dfx, dfy, dn = limit * (df1 + f1 * dlimit), limit * (df2 + f2 * dlimit), normal * dnormal
        dmz = limit * c * (forward * (df3 + f3 * (dlimit + 0.5 * dsquare)) + dforward * f3)
        add_wrench_slope(
            (px, py, pz), (dpx, dpy, dpz), (cosine, sine), (dcosine, dsine), (fx, fy, normal, mz), (dfx, dfy, dn, dmz),
            out[j],
        )  # fmt: skip
