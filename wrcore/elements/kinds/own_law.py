"""A law of the user's own along one direction: a function that numba compiled, or plain Python, which is slow.

``law(stretch, speed, states, parameters, rates)`` gets the stretch (m) and its rate (m/s), the element's own states and
the parameters, writes the rates of the states, and returns the force against stretch (N), or force, stored energy (J)
and dissipated power (W). A force alone stores nothing: its power counts as dissipated.
"""

import numpy as np
from numba.core.types import BaseTuple

from wrcore.elements import law
from wrcore.elements.kind import AT, DIRECTION, PARAMETERS, Along, Kind, axis_of, ends_of
from wrcore.errors import InputError, short
from wrcore.kernels import own
from wrcore.kernels.handles import FOUR
from wrcore.kernels.named_laws import present_laws

TRIED = (0.0, 0.0), (1e-4, 1e-3), (-1e-4, -1e-3)
"""Stretches (m) and speeds (m/s) of the test calls."""


def wrapped(function, note):
    """The kernel of a function, whose results ``note`` looks at, called as `wrcore.dynamics.suspension` calls it."""
    returned = function.overloads[own.signature_of(2, 3)].signature.return_type
    alone = not isinstance(returned, BaseTuple)

    def call(elements, k, stretch, speed, state, rate, at):
        row, end = elements.law[k], at + int(elements.directed[k, law.NUMBERS])
        parameters = elements.parameters[row[law.FIRST] : row[law.LAST]]
        return function(stretch, speed, state[at:end], parameters, rate[at:end])

    def sum_of_states(elements, k, state, at):
        total = 0.0
        for i in range(at, at + int(elements.directed[k, law.NUMBERS])):
            total += state[i]
        return total

    def look(elements, k, stretch, speed, rate, at, states, force):
        found = force
        for i in range(at, at + int(elements.directed[k, law.NUMBERS])):
            found += rate[i]
        note(stretch + speed + states, found)

    def of_force(elements, k, stretch, speed, state, rate, at):
        states = sum_of_states(elements, k, state, at)
        force = float(call(elements, k, stretch, speed, state, rate, at))
        if sum_of_states(elements, k, state, at) != states:  # the law wrote to what it may only read
            force = np.nan
        look(elements, k, stretch, speed, rate, at, states, force)
        return force, 0.0, 0.0, force * speed

    def of_three(elements, k, stretch, speed, state, rate, at):
        states = sum_of_states(elements, k, state, at)
        force, stored, lost = call(elements, k, stretch, speed, state, rate, at)
        force = float(force)
        if sum_of_states(elements, k, state, at) != states:
            force = np.nan
        look(elements, k, stretch, speed, rate, at, states, force)
        return force, 0.0, float(stored), float(lost)

    call, look, sum_of_states = map(own.uncached, (call, look, sum_of_states))
    return of_force if alone else of_three


def address(digest, elements):
    """Address of the kernel of an own law; ``elements`` an example of the model's."""
    state = np.empty(0)
    examples = (elements, 0, 0.0, 0.0, state, state, 0)
    return own.addressed(wrapped, digest, 2, 3, tuple(map(own.Example, examples)), FOUR).address


def parts(item):
    """One part with its own states and parameters."""
    numbers, states = item.get("parameters", ()), item.get("states", 0)
    return [Along(ends_of(item), present_laws().find(item["law"]), axis_of(item), numbers, inner=states, odd=False)]


def check(item):
    """The function is there; it is not called."""
    try:
        present_laws().find(item["law"])
    except InputError as error:
        yield "law", error.expected


def try_law(item):
    """Call the function of an element for a test; an InputError without a source says what was expected of it."""
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
