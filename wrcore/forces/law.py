"""What the laws of elements along one direction share.

A law is a kernel ``law(elements, k, stretch, speed, inner, press)`` of the k-th element along one direction: its
stretch (m) and its rate (m/s), its internal state, and the force in the element that presses it (N; 0 without one).
It returns the force against stretch (N), the rate of the internal state, the stored energy (J) and the dissipated
power (W): the first two are those of the equations of motion, whose power less what is dissipated goes into the store.
A law is called by its address: it is compiled for scenes that have such an element, and costs others nothing.
"""

from wrcore.kernels.jit import FUSED, jit

MARKER, REST, LENGTH, AXIS, NUMBERS = 0, 3, 6, 7, 10
"""First columns of a row of ``Elements.directed``."""

MOST_NUMBERS = 6
"""Of a law."""

ON_LINE, LAW, FIRST, LAST, INNER, PRESSING_SPRING, PRESSING = range(7)
"""Columns of ``Elements.law``."""

LAWS: list = []
"""All laws of `wrcore.forces.kinds`; a law's number in kernels is its place here. Those of the user's own have
numbers below 0: -1 for the first row of ``Elements.own``, and so on."""


@jit(allocates=False, inline="always")
def numbers(elements, k):
    """The six numbers of an element along one direction that its law reads."""
    row = elements.directed[k]
    return (
        row[NUMBERS], row[NUMBERS + 1], row[NUMBERS + 2], row[NUMBERS + 3], row[NUMBERS + 4], row[NUMBERS + 5],
    )  # fmt: skip


@jit(allocates=False, fastmath=FUSED)
def characteristic(elements, k, x):
    """Value at x of an element's polygon, continued with its outer slopes, and its integral from 0 to x."""
    table, at, last = elements.table, elements.law[k, FIRST], elements.law[k, LAST]
    while at < last - 2 and x > table[at + 1, 0]:
        at += 1
    begin, value = table[at, 0], table[at, 1]
    found = value + (x - begin) * (table[at + 1, 1] - value) / (table[at + 1, 0] - begin)
    return found, table[at, 2] + 0.5 * (value + found) * (x - begin)
