"""The rolling problem of one patch of a left wheel, on Galerkin strips or, where these do not converge, on a grid.

The rigid slip is that of the wheel's over the rail's surface, strip by strip, or follows one set of creepages.
Pressure and friction act in each strip's own plane, on the wheel's material points, where the slip is taken: friction
takes from the wheelset what it dissipates.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.contact.grid.grid import GridPatch, grid_normal, grid_rolling
from wrcore.contact.normal import solve
from wrcore.contact.normal.gap import rigid_slip
from wrcore.contact.normal.gap import strip_wrenches as wrenches_of_strips
from wrcore.contact.rolling import rolling
from wrcore.contact.search import reduction
from wrcore.contact.search.strip import AHEAD, leaning, with_rail_along
from wrcore.contact.search.surfaces import ContactPlane, Motion, plane_slip, strip_planes, surface_slip
from wrcore.kernels.handles import call_address
from wrcore.kernels.jit import FUSED, jit

SLENDER = 3.0
"""Length over width from which strips get more panels along rolling."""

GRID, GRID_TOLERANCE = 32, 1e-3
"""Elements along and across the patch of the grid, and the tolerance of its tractions."""


class Solution(NamedTuple):
    """What is known of a patch beside its wrench."""

    xi: float
    eta: float
    phi: float
    """Mean creepages."""
    load: float
    """Force of the pressure, N."""
    x: float
    s: float
    """Means over the pressure, m."""
    a: float
    b: float
    """Semi-axes of the ellipse of equal moments, m."""
    p_max: float
    """Pa."""
    power: float
    """Of friction, over V, N."""


NOTHING = Solution(*[0.0] * 10)


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def mean_solution(one, other, share):
    """Mean of two solutions of which the other has a ``share``."""
    rest = 1.0 - share
    return Solution(
        rest * one.xi + share * other.xi, rest * one.eta + share * other.eta, rest * one.phi + share * other.phi,
        rest * one.load + share * other.load, rest * one.x + share * other.x, rest * one.s + share * other.s,
        rest * one.a + share * other.a, rest * one.b + share * other.b, rest * one.p_max + share * other.p_max,
        rest * one.power + share * other.power,
    )  # fmt: skip


@jit
def solve_on_grid(model, m, pose, frame, creepage, friction, row):
    """Fallback: a patch of a left wheel on a uniform grid; a kernel of its own that may allocate. Fills ``row``, about
    the frame's origin and in its plane: friction (MZ about n), NORMAL, X and Y (means over the pressure of x and s),
    semi-axes, greatest pressure, and as ANGLE the mean slope of the strips.
    """
    x = frame.x
    if len(model.geometry.over) == 0:  # the grid knows no more than the section
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
    """Number of windows, 0 where strips find no solution, and frame of the overlaps of a lifted wheel."""
    settings = model.strips
    return solve.solve_patch(
        model.geometry, pose, model.hertz, settings.values, work.rows, low, high, settings.strips, memory,
        work.normal,
    )  # fmt: skip


@jit(allocates=False, forceinline=True)
def library_of(settings, work):
    """The library whose ellipses have as many strips as the patch that is solved, and the scratch arrays with it."""
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
    """Creep force on the strips."""
    count, (library, own) = work.solved[0], library_of(model.strips, work)
    rolling.rolling_force(
        strips[solve.OWN_PLACE, :count], strips[solve.OWN_WIDTH, :count], strips[solve.HALF_LENGTH, :count],
        strips[solve.MIDDLE, :count], strips[solve.PEAK, :count], slip[0, :count], slip[1, :count], slip[2, :count],
        slip[3, :count], model.shear_modulus, friction, library, own, rolling.AUTO,
    )  # fmt: skip
    rolling.read_forces(count, own, force)


@jit(allocates=False)
def _turn_round(strips, slip, force, count):
    """Turn a patch round: x points back, and slips and forces across change their sign."""
    for i in range(count):
        strips[solve.MIDDLE, i], slip[1, i], slip[2, i] = -strips[solve.MIDDLE, i], -slip[1, i], -slip[2, i]
        force[1, i] = -force[1, i]


@jit(allocates=False, fastmath=FUSED)
def _mean_slip(strips, slip, load, x, count):
    """Creepages at the pressure's centroid: means of the rigid slip over the pressure."""
    xi = eta = phi = 0.0
    for i in range(count):
        share = strips[solve.STRIP_LOAD, i] / load
        xi += share * slip[0, i]
        eta += share * (slip[2, i] + slip[3, i] * (x - strips[solve.MIDDLE, i]))
        phi += share * slip[3, i]
    return xi, eta, phi


@jit(allocates=False, fastmath=FUSED)
def _add_wrenches(geometry, pose, frame, count, share, work):
    """Add ``share`` of what acts on the strips to ``work.wrench``; returns the power of friction over V."""
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
    """`Solution` with friction of a solution of the normal problem; adds ``share`` of it to ``work.wrench``."""
    settings, strips, slip, sums = model.strips, work.strips, work.slip, work.sums
    count = solve.publish(model.shear_modulus / (1.0 - model.poisson_ratio), work.normal, windows, strips, sums)
    load, x, s = sums[solve.LOAD], sums[solve.MEAN_X], sums[solve.MEAN_S]
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
    """As `roll_patch`, on a grid: it acts on one strip at the pressure's centroid. ``row`` is overwritten."""
    strips, slip, force = work.strips, work.slip, work.friction
    call_address(model.strips.fallback, model, m, pose, frame, creepage, friction, row)
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
    """Row of a patch about the pressure's centroid, from the wrenches of pressure and friction, in axes that ``lean``.

    The pressure's resultant is the normal; the force along it holds what friction in the strips' planes has there.
    Creepages are the means of the rigid slip, moved by the least with which the forces do on them what friction does on
    the slip. ``y``, ``z``: of the frame's origin from the wheelset's centre.
    """
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
