"""A law of the user's own along one direction: a compiled function by its name.

`register` it in each process that runs scenes with it, in the same order where there are several.
"""

from wrcore.elements.kind import AT, DIRECTION, Along, Kind, axis_of, ends_of
from wrcore.elements.law import LAWS

FUNCTIONS: dict = {}
"""Kernels of users by name."""


def register(name, law):
    """Make a law (see `wrcore.elements.law`), compiled by `wrcore.kernels.jit.jit`, known to vehicle files."""
    FUNCTIONS[name] = law
    if law not in LAWS:
        LAWS.append(law)


def parts(item):
    """One part; its law reads at most six numbers and keeps one internal state."""
    numbers = tuple(item.get("numbers", ()))
    return [Along(ends_of(item), FUNCTIONS[item["function"]], axis_of(item), numbers, inner=True, odd=False)]


def check(item):
    """The function is there."""
    if item["function"] not in FUNCTIONS:
        known = f"one of {', '.join(sorted(FUNCTIONS))}" if FUNCTIONS else "one, there is none"
        yield "function", f"expected the name of a registered function ({known}), got {item['function']!r}"


KIND = Kind(
    {
        "at": AT,
        "direction": DIRECTION,
        "function": {"type": "string", "description": "the name under which a function is registered"},
        "numbers": {
            "type": "array", "maxItems": 6, "items": {"type": "number", "minimum": -1e15, "maximum": 1e15},
            "description": "at most six numbers that the function reads", "x-unit": "that of the function",
        },
    },
    ("at", "direction", "function"), {"marker": "*", "color": "#009E73"}, parts, check,
)  # fmt: skip
