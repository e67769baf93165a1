"""Friction that varies across the rail: a factor of the coefficient of friction over the inclination of its surface.

A table has the rows (inclination in rad, factor). The inclination is the contact angle of a left wheel: 0 on the
horizontal top of the rail, positive towards the gauge face. CONTACT has the same variation (its V digit 1), with the
opposite sign of the inclination.
"""

import math

from wrcore.kernels.jit import jit


@jit(allocates=False)
def _segment(table, angle):
    """Index of the first point of the segment at an angle, and the slope of the factor there, 1/rad; 0 beyond the
    ends."""
    last = table.shape[0] - 1
    if angle <= table[0, 0]:
        return 0, 0.0
    if angle >= table[last, 0]:
        return last, 0.0
    k = 0
    while angle >= table[k + 1, 0]:
        k += 1
    return k, (table[k + 1, 1] - table[k, 1]) / (table[k + 1, 0] - table[k, 0])


@jit(allocates=False)
def friction_factor(table, angle):
    """Factor of the coefficient of friction at an inclination (rad): linear between the points of the table, constant
    beyond its ends."""
    k, slope = _segment(table, angle)
    return table[k, 1] + slope * (angle - table[k, 0])


@jit(allocates=False, forceinline=True)
def friction_at(table, friction, cosine, sine):
    """Coefficient of friction of a patch with the contact angle given by ``cosine`` and ``sine``.

    ``friction`` is the rail's coefficient; it is returned if ``table`` has no points."""
    if table.shape[0] == 0:
        return friction
    return friction * friction_factor(table, math.atan2(sine, cosine))


@jit(allocates=False, forceinline=True)
def friction_slope(table, cosine, sine):
    """Derivative of the logarithm of the factor with respect to the contact angle, 1/rad."""
    if table.shape[0] == 0:
        return 0.0
    angle = math.atan2(sine, cosine)
    return _segment(table, angle)[1] / friction_factor(table, angle)
