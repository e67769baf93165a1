"""Rolling contact of one patch of a left wheel, on Galerkin strips or, where these do not converge, on a grid.

The rigid slip is that of the wheel's surface over the rail's, in each strip, or that of one set of creepages. Pressure
and friction act in each strip's plane, on the wheel's material points at which the slip is evaluated. The power that
friction takes from the wheelset therefore equals the dissipated power.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.grid.grid import GridPatch, grid_normal, grid_rolling
from wrcore.contact.normal import solve
from wrcore.contact.normal.gap import rigid_slip
from wrcore.contact.normal.gap import strip_wrenches as wrenches_of_strips
from wrcore.contact.rail_friction import friction_factor
from wrcore.contact.rolling import rolling
from wrcore.contact.search import reduction
from wrcore.contact.search.strip import AHEAD, leaning, with_rail_along
from wrcore.contact.search.surfaces import ContactPlane, Motion, plane_slip, strip_planes, surface_slip
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import FUSED, jit

SLENDER = 3.0
"""Ratio of length to width from which strips have more panels in the rolling direction."""

GRID, GRID_TOLERANCE = 32, 1e-3
"""Number of grid elements along and across the patch, and relative tolerance of the tractions."""


class Solution(NamedTuple):
    """Results of a patch in addition to its wrench."""

    xi: float
    eta: float
    phi: float
    """Mean creepages."""
    load: float
    """Normal force of the pressure, N."""
    x: float
    s: float
    """Centroid of the pressure, m."""
    a: float
    b: float
    """Semi-axes of the ellipse of equal moments, m."""
    p_max: float
    """Maximum pressure, Pa."""
    power: float
    """Power of friction over V, N."""


NOTHING = Solution(*[0.0] * 10)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def mean_solution(one, other, share):
    """Weighted mean of two solutions; ``share`` is the weight of ``other``."""
    rest = 1.0 - share
    return Solution(
        rest * one.xi + share * other.xi, rest * one.eta + share * other.eta, rest * one.phi + share * other.phi,
        rest * one.load + share * other.load, rest * one.x + share * other.x, rest * one.s + share * other.s,
        rest * one.a + share * other.a, rest * one.b + share * other.b, rest * one.p_max + share * other.p_max,
        rest * one.power + share * other.power,
    )  # fmt: skip


@jit
def solve_on_grid(model, m, pose, frame, creepage, friction, row):
    """Solve a patch of a left wheel on a uniform grid: the fallback, a separate kernel that may allocate.

    Fills ``row``, about the frame's origin and in its plane: friction (MZ about n), NORMAL, X and Y (centroid x and s
    of the pressure), semi-axes, maximum pressure, and as ANGLE the mean slope of the strips."""
    x = frame.x
    if len(model.geometry.over) == 0:  # without `over` the grid sees a constant section
        x = with_rail_along(model.geometry, AHEAD, frame.ur, -1.0, x)
    plane = ContactPlane(x, frame.ur + model.geometry.rail_distance, frame.z, frame.cosine, frame.sine)
    modulus = model.shear_modulus / (1.0 - model.poisson_ratio)
    grid = grid_normal(model.geometry, pose, plane, modulus, GRID, GRID)
    wx, ws = np.empty(grid.gap.shape), np.empty(grid.gap.shape)
    low, tilt = strip_planes(grid.s, grid.gap, grid.height)
    if model.strips.surfaces == 0:
        plane_slip(creepage[0], creepage[1], creepage[2], grid.x, grid.s, wx, ws)
    else:
        speed = max(abs(m.vx), model.least_speed)
        surface_slip(pose, plane, Motion(m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, speed), grid.x, grid.s, low, tilt, wx, ws)
    sign, rolled = 1.0, grid
    if m.vx < 0.0:  # rolling is always towards x: the mirror image of a wheel that rolls back
        sign, x, pressure = -1.0, -grid.x[::-1].copy(), grid.pressure[::-1].copy()
        rolled = GridPatch(x, grid.s, grid.dx, grid.ds, grid.gap, grid.height, pressure)
        wx, ws = wx[::-1].copy(), -ws[::-1].copy()
    found = grid_rolling(rolled, wx, ws, friction, model.shear_modulus, model.poisson_ratio, GRID_TOLERANCE)
    load = xm = sm = xx = ss = top = rise = 0.0
    for i in range(grid.x.size):
        for j in range(grid.s.size):
            p = grid.pressure[i, j]
            load, top = load + p, max(top, p)
            xm, sm = xm + p * grid.x[i], sm + p * grid.s[j]
            xx, ss, rise = xx + p * grid.x[i] ** 2, ss + p * grid.s[j] ** 2, rise + p * tilt[j]
    load = max(load, 1e-30)
    xm, sm = xm / load, sm / load
    row[reduction.FX], row[reduction.FY], row[reduction.MZ] = found.fx, sign * found.fs, found.mn
    row[reduction.NORMAL], row[reduction.P_MAX] = load * grid.dx * grid.ds, top
    row[reduction.X], row[reduction.Y], row[reduction.ANGLE] = xm, sm, rise / load
    row[reduction.SEMI_A] = math.sqrt(5.0 * max(xx / load - xm * xm, 1e-14))
    row[reduction.SEMI_B] = math.sqrt(5.0 * max(ss / load - sm * sm, 1e-14))


@jit(allocates=False, forceinline=True)
def solve_overlaps(model, pose, low, high, memory, work):
    """Solve the normal problem of overlaps of a wheel moved by the damping displacement.

    Returns the number of windows, 0 if there is no solution on strips, and the contact frame."""
    settings = model.strips
    return solve.solve_patch(
        model.geometry, pose, model.hertz, settings.values, work.rows, low, high, settings.strips, memory,
        work.normal,
    )  # fmt: skip


@jit(allocates=False, forceinline=True)
def library_of(settings, work):
    """Return the library with the number of strips of the solved patch, and its work arrays."""
    count, slender, windows = work.solved
    if slender:
        return settings.slender, work.slender
    if windows == 1 and count == settings.wider.level.strips:
        return settings.wider, work.rolling
    if windows == 1 and count == settings.widest.level.strips:
        return settings.widest, work.rolling
    return settings.library, work.rolling


@jit(allocates=False, fastmath=FUSED)
def _roll(model, friction, strips, slip, force, work):
    """Fill ``force`` (3, n) with the creep forces on the strips. The row BOUND of ``strips`` is the maximum of the
    traction in each strip over ``friction``, Pa."""
    count, (library, own) = work.solved[0], library_of(model.strips, work)
    rolling.rolling_force(
        strips[solve.OWN_PLACE, :count], strips[solve.OWN_WIDTH, :count], strips[solve.HALF_LENGTH, :count],
        strips[solve.MIDDLE, :count], strips[solve.BOUND, :count], slip[0, :count], slip[1, :count], slip[2, :count],
        slip[3, :count], model.shear_modulus, friction, library, own, rolling.AUTO,
    )  # fmt: skip
    rolling.read_forces(count, own, force)


@jit(allocates=False)
def _fill_bounds(table, frame, strips, count):
    """Fill the row BOUND of ``strips`` with the maximum pressure in each strip times the factor of friction there."""
    angle = math.atan2(frame.sine, frame.cosine)
    for i in range(count):
        factor = 1.0
        if table.shape[0] > 0:
            factor = friction_factor(table, angle + math.atan(strips[solve.STRIP_TILT, i]))
        strips[solve.BOUND, i] = factor * strips[solve.PEAK, i]


@jit(allocates=False)
def _turn_round(strips, slip, force, count):
    """Reverse the x axis of a patch, in place: x and the lateral slips and forces change their sign."""
    for i in range(count):
        strips[solve.MIDDLE, i], slip[1, i], slip[2, i] = -strips[solve.MIDDLE, i], -slip[1, i], -slip[2, i]
        force[1, i] = -force[1, i]


@jit(allocates=False, fastmath=FUSED)
def _mean_slip(strips, slip, load, x, count):
    """Creepages at the pressure's centroid: means of the rigid slip weighted with the pressure."""
    xi = eta = phi = 0.0
    for i in range(count):
        share = strips[solve.STRIP_LOAD, i] / load
        xi += share * slip[0, i]
        eta += share * (slip[2, i] + slip[3, i] * (x - strips[solve.MIDDLE, i]))
        phi += share * slip[3, i]
    return xi, eta, phi


@jit(allocates=False, fastmath=FUSED)
def _add_wrenches(geometry, pose, frame, count, share, work):
    """Add ``share`` times the wrenches on the strips to ``work.wrench``; return the power of friction over V (N)."""
    strips, slip, force = work.strips, work.slip, work.friction
    wrenches_of_strips(
        geometry, pose, frame, strips[solve.CENTRE, :count], strips[solve.MIDDLE, :count],
        strips[solve.WHEEL_HEIGHT, :count], strips[solve.STRIP_TILT, :count], strips[solve.STRIP_LOAD, :count], force,
        share, work.wrench[0], work.wrench[1],
    )  # fmt: skip
    power = 0.0
    for i in range(count):
        power += force[0, i] * slip[0, i] + force[1, i] * slip[2, i] + force[2, i] * slip[3, i]
    return power


@jit(allocates=False, fastmath=FUSED)
def roll_patch(model, m, pose, frame, windows, depth, speed, friction, share, work):
    """Solve for friction after the normal problem; return the `Solution`, add ``share`` of the wrench to
    ``work.wrench``."""
    settings, strips, slip, sums = model.strips, work.strips, work.slip, work.sums
    count = solve.publish(model.shear_modulus / (1.0 - model.poisson_ratio), work.normal, windows, strips, sums)
    load, x, s = sums[solve.LOAD], sums[solve.MEAN_X], sums[solve.MEAN_S]
    _fill_bounds(model.friction_across, frame, strips, count)
    if settings.surfaces == 0:  # one set of creepages is the slip of a plane, where the undeformed wheel is deepest
        tilt = 0.0
        for i in range(count):
            tilt += strips[solve.STRIP_LOAD, i] / load * strips[solve.STRIP_TILT, i]
        for i in range(count):
            strips[solve.WHEEL_HEIGHT, i] = tilt * (strips[solve.CENTRE, i] - s) - depth
            strips[solve.STRIP_TILT, i] = tilt
    rigid_slip(
        model.geometry, pose, frame, (m.vx, m.vy, m.vz, m.wx, m.wy, m.wz, speed), strips[solve.CENTRE, :count],
        strips[solve.MIDDLE, :count], strips[solve.WHEEL_HEIGHT, :count], strips[solve.STRIP_TILT, :count],
        slip[:, :count],
    )  # fmt: skip
    a = math.sqrt(5.0 * max(sums[solve.MEAN_XX] - x * x, 1e-14))
    b = math.sqrt(5.0 * max(sums[solve.MEAN_SS] - s * s, 1e-14))
    xi, eta, phi = _mean_slip(strips, slip, load, x, count)
    back = m.vx < 0.0  # rolling is always towards x
    if back:
        _turn_round(strips, slip, work.friction, count)
    work.solved[0], work.solved[1], work.solved[2] = count, a > SLENDER * b, windows
    _roll(model, friction, strips, slip, work.friction, work)
    if back:
        _turn_round(strips, slip, work.friction, count)
    power = _add_wrenches(model.geometry, pose, frame, count, share, work)
    return Solution(xi, eta, phi, load, x, s, a, b, sums[solve.LARGEST], power)


@jit(allocates=False, fastmath=FUSED)
def roll_on_grid(model, m, pose, frame, depth, creepage, friction, row, work):
    """Solve a patch on a grid; return the `Solution`, add the wrench to ``work.wrench``.

    The forces act on one strip at the pressure's centroid. ``row`` is overwritten."""
    strips, slip, force = work.strips, work.slip, work.friction
    call_address(model.strips.grid_kernel, model, m, pose, frame, creepage, friction, row)
    (xi, eta, phi), x, s, load = creepage, row[reduction.X], row[reduction.Y], row[reduction.NORMAL]
    strips[solve.CENTRE, 0], strips[solve.MIDDLE, 0], strips[solve.WHEEL_HEIGHT, 0] = s, x, -depth
    strips[solve.STRIP_TILT, 0], strips[solve.STRIP_LOAD, 0] = row[reduction.ANGLE], load
    force[0, 0], force[1, 0] = row[reduction.FX], row[reduction.FY]
    force[2, 0] = row[reduction.MZ] - x * row[reduction.FY] + s * row[reduction.FX]
    xi, eta = xi - phi * s, eta + phi * x
    slip[0, 0], slip[2, 0], slip[3, 0] = xi, eta, phi
    power = _add_wrenches(model.geometry, pose, frame, 1, 1.0, work)
    a, b, p_max = row[reduction.SEMI_A], row[reduction.SEMI_B], row[reduction.P_MAX]
    return Solution(xi, eta, phi, load, x, s, a, b, p_max, power)


@jit(allocates=False, fastmath=FUSED)
def fill_row(geometry, lean, frame, y, z, found, wrenches, out):
    """Fill the row ``out`` of a patch about the pressure's centroid, from the wrenches of pressure and friction.

    Axes are rotated by ``lean``. The resultant of the pressure defines the normal; the normal force includes the
    component of friction along it. Creepages are the means of the rigid slip with the minimum correction that makes the
    power of the forces equal to that of friction on the slip. ``y``, ``z``: frame's origin from the wheelset's centre
    (m)."""
    pressure, friction, a, b = wrenches[0], wrenches[1], found.a, found.b
    normal = math.sqrt(pressure[1] * pressure[1] + pressure[2] * pressure[2])
    cosine, sine = pressure[2] / normal, -pressure[1] / normal
    px, py, pz = frame.x + found.x, y + found.s * frame.cosine, z + found.s * frame.sine
    out[reduction.X], out[reduction.Y], out[reduction.Z] = px, py, pz
    px, pz = leaning(geometry, lean, px, pz)
    fx, fy, fz = friction[0], friction[1], friction[2]
    fs = fy * cosine + fz * sine
    turn_y, turn_z = friction[4] - pz * fx + px * fz, friction[5] - px * fy + py * fx
    mn = turn_z * cosine - turn_y * sine
    out[reduction.ANGLE], out[reduction.COSINE], out[reduction.SINE] = math.atan2(sine, cosine), cosine, sine
    out[reduction.SEMI_A], out[reduction.SEMI_B], out[reduction.P_MAX], out[reduction.CELL] = a, b, found.p_max, 0.0
    out[reduction.NORMAL] = normal + fz * cosine - fy * sine
    out[reduction.FX], out[reduction.FY], out[reduction.MZ] = fx, fs, mn
    size = fx * fx + fs * fs + mn * mn / (a * b)
    rest = (found.power - fx * found.xi - fs * found.eta - mn * found.phi) / size if size > 0.0 else 0.0
    out[reduction.XI], out[reduction.ETA] = found.xi + rest * fx, found.eta + rest * fs
    out[reduction.PHI] = found.phi + rest * mn / (a * b)
