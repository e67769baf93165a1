"""Data that all force laws of elements along one direction share.

A law is a kernel ``law(elements, k, stretch, speed, inner, press)`` of the k-th element along one direction. Its
arguments are the stretch (m), the rate of stretch (m/s), the internal state, and the normal force in another element
(N; 0 without such an element). It returns the force against stretch (N), the rate of the internal state, the stored
energy (J) and the dissipated power (W). Force and rate enter the equations of motion. The rate of the stored energy is
the power of the force less the dissipated power. A law is called by its address, so that only scenes with such an
element compile the law.
"""

from wrcore.kernels.jit import FUSED, jit

MARKER, REST, LENGTH, AXIS, NUMBERS = 0, 3, 6, 7, 10
"""First columns of the quantities in a row of ``Elements.directed``."""

MOST_NUMBERS = 6
"""Largest number of parameters of a law."""

ON_LINE, LAW, FIRST, LAST, INNER, PRESSING_SPRING, PRESSING = range(7)
"""Columns of ``Elements.law``."""

LAWS: list = []
"""All laws of `wrcore.forces.kinds`; the number of a law in kernels is its index in this list. Laws of the user have
negative numbers: -1 for the first row of ``Elements.own``, and so on."""


@jit(allocates=False, inline="always")
def numbers(elements, k):
    """Return the six parameters of the law of the k-th element along one direction."""
    row = elements.directed[k]
    return (
        row[NUMBERS], row[NUMBERS + 1], row[NUMBERS + 2], row[NUMBERS + 3], row[NUMBERS + 4], row[NUMBERS + 5],
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def characteristic(elements, k, x):
    """Return the value at x of the k-th element's polygon, and its integral from 0 to x.

    Beyond its ends the polygon continues with the slopes of its outer segments."""
    table, at, last = elements.table, elements.law[k, FIRST], elements.law[k, LAST]
    while at < last - 2 and x > table[at + 1, 0]:
        at += 1
    begin, value = table[at, 0], table[at, 1]
    found = value + (x - begin) * (table[at + 1, 1] - value) / (table[at + 1, 0] - begin)
    return found, table[at, 2] + 0.5 * (value + found) * (x - begin)
