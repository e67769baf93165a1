"""Force and moment of the rails on wheelsets from patches of two half ellipses (SDEC), with a creep table over shape.

The creep table depends on a, b and the patch's shape number psi = (b_pos - b_neg)/(b_pos + b_neg). The shape number
follows from the skewness of g^2 over the overlap, where g is the overlap's depth. An overlap of two half parabolas of
widths b(1 - psi) and b(1 + psi) has, weighted by g^2 and about its mean, the second and third moments

    b^2 (1/7 + 17/448 psi^2),   b^3 psi (5/112 - 5/1792 psi^2).

Normal force, semi-axes and centroid of the load are those of the ellipse of equal moments. The table's creepages and
moment refer to the middle of the two half ellipses, which lies b psi/4 beyond the centroid.

References
----------
Piotrowski, Liu, Bruni, Vehicle System Dynamics 55 (2017) 875 (simple double ellipse).
"""

import math

from wrcore.contact.search.reduction import CURVATURE_Y, PENETRATION, PSI, U_WHEEL
from wrcore.contact.search.strip import gap_at, make_pose
from wrcore.creep.build import PSI_MAX
from wrcore.kernels.jit import FUSED, jit
from wrcore.wheels.contact_model import OUT_OF_RANGE, contact_of
from wrcore.wheels.force import detect_patches
from wrcore.wheels.hertzian_force import leaning_wrench
from wrcore.wheels.modes import FRESH
from wrcore.wheels.motion import motion_of

STEPS = 16
"""Number of integration steps over the half width of the parabolic overlap."""

_FARTHEST = 3 * STEPS


@jit(allocates=False, fastmath=FUSED)
def overlap_skewness(geometry, pose, u, step):
    """Skewness of g^2 over the overlap around ``u``: third central moment over second central moment^1.5.

    Moments are over u (m), the coordinate on the wheel's profile, positive outwards; ``step`` (m): integration step."""
    m0 = m1 = m2 = m3 = 0.0
    for direction in (-1.0, 1.0):
        for i in range(_FARTHEST):
            e = direction * (i + 0.5)
            gap = gap_at(geometry, pose, u + e * step)[0]
            if gap >= 0.0:
                break
            square = gap * gap
            m0, m1, m2, m3 = m0 + square, m1 + square * e, m2 + square * e * e, m3 + square * e * e * e
    if not m0 > 0.0:
        return 0.0
    m1, m2, m3 = m1 / m0, m2 / m0, m3 / m0
    spread = m2 - m1 * m1
    return (m3 - 3.0 * m2 * m1 + 2.0 * m1 * m1 * m1) / (spread * math.sqrt(spread)) if spread > 0.0 else 0.0


@jit(allocates=False, fastmath=FUSED)
def shape_number(skewness):
    """Shape number psi of two half parabolas with a given skewness of g^2, within ± `PSI_MAX`, by Newton's method."""
    psi = 0.0
    for _ in range(6):
        square = psi * psi
        third, spread = 5.0 / 112.0 - 5.0 / 1792.0 * square, 1.0 / 7.0 + 17.0 / 448.0 * square
        root = math.sqrt(spread)
        rate = third - 10.0 / 1792.0 * square - 51.0 / 448.0 * skewness * root * psi
        psi -= (psi * third - skewness * spread * root) / max(rate, 0.01)
        psi = min(max(psi, -PSI_MAX), PSI_MAX)
    return psi


@jit(allocates=False, fastmath=FUSED)
def shaped_wrenches(model, motions, patches, counts, bounds, wrenches, counters, work, mode=FRESH):
    """Fill the forces and moments of the rails on all wheels from patches with shape numbers (two half ellipses).

    Arguments are those of `wrcore.wheels.hertzian_force.wheel_wrenches`."""
    for i in range(motions.shape[0]):
        for wheel in range(2):
            m, wrench, rows = motion_of(motions[i, wheel]), wrenches[i, wheel], patches[i, wheel]
            contact = contact_of(model, i, wheel)
            count, bound, spatial = detect_patches(contact, m, rows)
            counts[i, wheel], bounds[i, wheel] = count, bound
            pose = make_pose(m.side, m.y, m.z, m.side * m.ex, m.side * m.ey, m.side * m.ez, spatial)
            for k in range(6):
                wrench[k] = 0.0
            for k in range(count):
                row = rows[k]
                slope = gap_at(contact.geometry, pose, row[U_WHEEL])[1]
                half = math.sqrt(row[PENETRATION] / (row[CURVATURE_Y] * (1.0 + slope * slope)))
                row[PSI] = m.side * shape_number(overlap_skewness(contact.geometry, pose, row[U_WHEEL], half / STEPS))
                gx, gy, gz, nx, ny, nz, missed = leaning_wrench(contact, m, m.bend_y, m.bend_z, row, row[PSI])
                wrench[0], wrench[1], wrench[2] = wrench[0] + gx, wrench[1] + gy, wrench[2] + gz
                wrench[3], wrench[4], wrench[5] = wrench[3] + nx, wrench[4] + ny, wrench[5] + nz
                counters[OUT_OF_RANGE] += missed
