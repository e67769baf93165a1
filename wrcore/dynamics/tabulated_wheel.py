"""Wrench of the rails on a wheel with exact contact, looked up in a `PairTable`; solved where that has no answer."""

import math

from wrcore.contact import reduction
from wrcore.contact.creepage import creepages
from wrcore.contact.normal import contact_modulus
from wrcore.contact.patch import solve
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.pair_table import EMPTY, READY, cell_of, depth_of, look_up, tabulated_force
from wrcore.dynamics.strip_wheel import NOTHING, Solution, group_wrench, lifted_overlaps
from wrcore.dynamics.wheel import OUT_OF_RANGE, SOLVED, falling
from wrcore.kernels.handles import call_c
from wrcore.kernels.jit import FUSED, jit


@jit(allocates=False, fastmath=FUSED)
def tabulated_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """As `group_wrench`, looked up."""
    pose, low, high, _, left, _, _ = lifted_overlaps(model, m, spatial, rows, first, last, out, work)
    if high == low or left <= 0.0:
        out[reduction.NORMAL] = 0.0
        return NOTHING
    depth, flange = depth_of(work.rows, low, high)
    geometry, table, ahead, branch = model.geometry, model.strips.table, 1.0, 1 if flange else 0
    if m.vx < 0.0:
        ahead = -1.0
    t, yaw = pose.y + geometry.half_distance * m.ey - geometry.rail_distance, ahead * m.ex
    i, j, k, fx, fy, fz, inside = cell_of(t, m.ez, depth, yaw)
    if inside and table.cells[branch, i, j, k] == EMPTY:
        call_c(table.fill, branch, i, j, k)
    if not inside or table.cells[branch, i, j, k] != READY:
        counters[SOLVED] += 1
        return group_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work)
    look_up(table.nodes[branch], i, j, k, fx, fy, fz, yaw, work.numbers)
    return _wrench_of_numbers(model, m, pose, depth, ahead, work.numbers, work.modes, out, wrench, counters, work.sums)


@jit(allocates=False)
def add_tabulated(model, m, spatial, rows, first, last, out, wrench, counters, memory, work):
    """`tabulated_wrench` for who calls it by its address."""
    tabulated_wrench(model, m, spatial, rows, first, last, out, wrench, counters, memory, work)


@jit(allocates=False, fastmath=FUSED)
def _wrench_of_numbers(model, m, pose, depth, ahead, numbers, modes, out, wrench, counters, extent):
    """Row and wrench of a patch from a node's numbers. A wheel that rolls back is the mirror image, along x, of one
    that rolls ahead."""
    half, radius = model.geometry.half_distance, model.geometry.rolling_radius
    modulus, angle = contact_modulus(model.shear_modulus, model.poisson_ratio), numbers[columns.ANGLE]
    normal = modulus * depth * math.sqrt(depth) * math.exp(numbers[columns.LOG_NORMAL])
    cosine, sine = math.cos(angle), math.sin(angle)
    px = numbers[columns.PLACE_X] + half * ahead * m.ex
    py, pz = numbers[columns.PLACE_Y] + half * m.ey, numbers[columns.PLACE_Z] + half * m.ez - radius
    speed, wy, wz = max(abs(m.vx), model.least_speed), ahead * m.wy, ahead * m.wz
    xi, eta, phi, _ = creepages(ahead * m.vx, m.vy, m.vz, m.wx, wy, wz, px, py, pz, cosine, sine, speed)
    limit = falling(model, m.friction, xi, eta, speed) * normal
    turning = wy * radius / speed - 1.0
    f1, f2, m3, missed = tabulated_force(model, model.strips.table.modes, numbers, xi, eta, phi, limit, turning, modes)
    counters[OUT_OF_RANGE] += missed
    gy, gz = f2 * cosine - normal * sine, f2 * sine + normal * cosine
    wrench[0] += ahead * f1
    wrench[1] += gy
    wrench[2] += gz
    wrench[3] += py * gz - pz * gy
    wrench[4] += ahead * (pz * f1 - px * gz - m3 * sine)
    wrench[5] += ahead * (px * gy - py * f1 + m3 * cosine)
    a, b, height = math.exp(numbers[columns.LOG_A]), math.exp(numbers[columns.LOG_B]), numbers[columns.HEIGHT]
    p_max, x, xi, phi = modulus * math.exp(numbers[columns.LOG_PEAK]), ahead * px, ahead * xi, ahead * phi
    out[reduction.ANGLE], out[reduction.COSINE], out[reduction.SINE] = angle, cosine, sine
    out[reduction.X], out[reduction.Y], out[reduction.Z] = x, pose.y + py + height * sine, pose.z + pz - height * cosine
    out[reduction.SEMI_A], out[reduction.SEMI_B], out[reduction.NORMAL], out[reduction.P_MAX] = a, b, normal, p_max
    out[reduction.FX], out[reduction.FY], out[reduction.MZ] = ahead * f1, f2, ahead * m3
    out[reduction.XI], out[reduction.ETA], out[reduction.PHI] = xi, eta, phi
    extent[solve.LOAD], extent[solve.MEAN_X], extent[solve.MEAN_S] = normal, 0.0, 0.0
    extent[solve.X_MIN], extent[solve.X_MAX], extent[solve.S_MIN], extent[solve.S_MAX] = -a, a, -b, b
    power = f1 * ahead * xi + f2 * eta + m3 * ahead * phi
    return Solution(xi, eta, phi, normal, 0.0, 0.0, a, b, p_max, power)
