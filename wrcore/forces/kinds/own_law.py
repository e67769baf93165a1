"""A force law of the user along one direction: a function compiled by numba, or plain Python, which is slow.

``law(stretch, speed, states, parameters, rates)`` gets the stretch (m) and its rate (m/s), the states of the element
and its parameters, and writes the rates of the states. It returns the force against stretch (N), or a tuple of force,
stored energy (J) and dissipated power (W). If it returns only the force, all its power counts as dissipated.
"""

import numpy as np
from numba.core.types import BaseTuple

from wrcore.errors import InputError, short
from wrcore.forces import law
from wrcore.forces.kind import AT, DIRECTION, PARAMETERS, Along, Kind, axis_of, ends_of
from wrcore.kernels import own
from wrcore.kernels.handles import FOUR
from wrcore.kernels.named_laws import present_laws

TRIED = (0.0, 0.0), (1e-4, 1e-3), (-1e-4, -1e-3)
"""Stretches (m) and speeds (m/s) of the test calls."""


def wrapped(function, note):
    """Return a kernel for `wrcore.forces.suspension` that calls a function and passes its results to ``note``."""
    returned = function.overloads[own.signature_of(2, 3)].signature.return_type
    alone = not isinstance(returned, BaseTuple)

    def of_force(elements, k, stretch, speed, state, rate, at):
        states, parameters, rates = law_arrays(elements, k, state, rate, at)
        given = total(states)
        force = float(function(stretch, speed, states, parameters, rates))
        if total(states) != given:  # the law wrote into its states, which are read-only
            force = np.nan
        note(stretch + speed + given, force + total(rates))
        return force, 0.0, 0.0, force * speed

    def of_three(elements, k, stretch, speed, state, rate, at):
        states, parameters, rates = law_arrays(elements, k, state, rate, at)
        given = total(states)
        force, stored, lost = function(stretch, speed, states, parameters, rates)
        force = float(force)
        if total(states) != given:
            force = np.nan
        note(stretch + speed + given, force + total(rates))
        return force, 0.0, float(stored), float(lost)

    def law_arrays(elements, k, state, rate, at):
        row, end = elements.law[k], at + int(elements.directed[k, law.NUMBERS])
        return state[at:end], elements.parameters[row[law.FIRST] : row[law.LAST]], rate[at:end]

    def total(numbers):
        found = 0.0
        for number in numbers:
            found += number
        return found

    law_arrays, total = map(own.uncached, (law_arrays, total))
    return of_force if alone else of_three


def address(digest, elements):
    """Return the address of the kernel of a user's law; ``elements`` is an example of those of the model."""
    state = np.empty(0)
    examples = (elements, 0, 0.0, 0.0, state, state, 0)
    return own.addressed(wrapped, digest, 2, 3, tuple(map(own.Example, examples)), FOUR).address


def parts(item):
    """Return one part with the states and parameters of the law."""
    numbers, states = item.get("parameters", ()), item.get("states", 0)
    return [Along(ends_of(item), present_laws().find(item["law"]), axis_of(item), numbers, inner=states, odd=False)]


def check(item):
    """Check that the function of the law exists; it is not called."""
    try:
        present_laws().find(item["law"])
    except InputError as error:
        yield "law", error.expected


def try_law(item):
    """Call the function of an element for test values; an InputError without a source states the expectation."""
    function = present_laws().find(item["law"])
    states = item.get("states", 0)
    for pair in TRIED:
        answer, arrays = own.tried(function, [states, item.get("parameters", []), states], *pair, reads=2)
        if not own.is_force(answer):
            expected = "expected a force in N, or a tuple of force, stored energy and dissipated power from a test call"
            raise InputError("", "", f"{expected}, got {short(answer)}")
        own.finite(answer, *arrays)


KIND = Kind(
    {
        "at": AT,
        "direction": DIRECTION,
        "law": {"type": "string", "description": "a function as file.py:function"},
        "parameters": PARAMETERS,
        "states": {"type": "integer", "minimum": 0, "maximum": 20, "x-unit": "1",
                   "description": "the number of the law's own states, 0 to 20, all 0 at the start"},
    },
    ("at", "direction", "law"), {"marker": "*", "color": "#009E73"}, parts, check,
)  # fmt: skip
