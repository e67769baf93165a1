"""Count of operations and bytes of one evaluation: Python runs the source of the kernels on counting numbers.

During the count, the Python functions replace their compiled kernels, and arrays of eight numbers replace the vector
registers of :mod:`wrcore.kernels.lanes`.
"""

import math
import sys
from collections import Counter
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
from numba.core.dispatcher import Dispatcher

from wrcore.bodies import joint_forces as constraints
from wrcore.equations.model import workspace
from wrcore.forces.law import LAW, LAWS
from wrcore.wheels import hertzian_force as wheel

STAGES = ("bodies", "suspension", "joints", "search", "patch", "Hertz", "creep", "rest")
"""Stages of an evaluation, in the order in which they are added up."""

QUANTITIES = ("flops", "divisions", "roots", "functions", "bytes")

WHERE = {
    ("wrcore.equations.equations_of_motion", "element_forces"): "suspension",
    ("wrcore.equations.equations_of_motion", "add_reactions"): "joints",
    ("wrcore.equations.equations_of_motion", "_add_rail_wrenches"): "rest",
    ("wrcore.wheels.force", "find_patches"): "patch",
    ("wrcore.contact.search.detection", "make_pose"): "search",
    ("wrcore.contact.search.detection", "make_window"): "search",
    ("wrcore.contact.search.detection", "near_blocks"): "search",
    ("wrcore.contact.search.detection", "scan"): "search",
    ("wrcore.wheels.hertzian_force", "creepages"): "Hertz",
    ("wrcore.wheels.hertzian_force", "normal_ellipse"): "Hertz",
    ("wrcore.wheels.hertzian_force", "creep_force_at"): "creep",
}
"""Stage of a function, by the calling module and the name there; other functions belong to the stage of the caller."""


class Tally:
    """Counts by stage and quantity, and the stack of active stages."""

    def __init__(self):
        self.counts, self.stages = Counter(), ["bodies"]

    def add(self, quantity, number=1):
        self.counts[self.stages[-1], quantity] += number

    def within(self, stage, function):
        """Return the function with its operations counted for a stage."""

        def counted(*arguments):
            """Call the function within the stage."""
            self.stages.append(stage)
            try:
                return function(*arguments)
            finally:
                self.stages.pop()

        return counted


def _binary(name, quantity):
    operation = getattr(np.float64, name)

    def apply(self, other):
        """Apply the operation to two numbers and count it."""
        if isinstance(other, np.ndarray):  # NumPy then calls the operation for each element
            return NotImplemented
        self.tally.add(quantity)
        return Number(operation(self.value, np.float64(getattr(other, "value", other))), self.tally)

    return apply


class Number:
    """A float64 that counts the operations on it."""

    __slots__ = ("value", "tally")

    def __init__(self, value, tally):
        self.value, self.tally = np.float64(value), tally

    __add__, __radd__ = _binary("__add__", "flops"), _binary("__radd__", "flops")
    __sub__, __rsub__ = _binary("__sub__", "flops"), _binary("__rsub__", "flops")
    __mul__, __rmul__ = _binary("__mul__", "flops"), _binary("__rmul__", "flops")
    __truediv__, __rtruediv__ = _binary("__truediv__", "divisions"), _binary("__rtruediv__", "divisions")
    __pow__ = _binary("__pow__", "functions")

    def __neg__(self):
        return Number(-self.value, self.tally)

    def __pos__(self):
        return self

    def __abs__(self):
        return Number(abs(self.value), self.tally)

    def __float__(self):
        return float(self.value)

    def __int__(self):
        return int(self.value)

    __trunc__ = __int__

    def __floor__(self):
        return math.floor(self.value)

    def __lt__(self, other):
        return self.value < getattr(other, "value", other)

    def __le__(self, other):
        return self.value <= getattr(other, "value", other)

    def __gt__(self, other):
        return self.value > getattr(other, "value", other)

    def __ge__(self, other):
        return self.value >= getattr(other, "value", other)

    def __eq__(self, other):
        return self.value == getattr(other, "value", other)

    __hash__ = None

    def _function(self, name, quantity="functions"):
        self.tally.add(quantity)
        return Number(getattr(np, name)(self.value), self.tally)

    def sqrt(self):
        return self._function("sqrt", "roots")

    def log(self):
        return self._function("log")

    def exp(self):
        return self._function("exp")

    def arctan(self):
        return self._function("arctan")


class Numbers(np.ndarray):
    """An array of counting numbers (`Number`) that also counts the bytes of elements read or written."""

    def __array_finalize__(self, other):
        self.tally, self.size_of_one = getattr(other, "tally", None), getattr(other, "size_of_one", 8)

    def __getitem__(self, key):
        found = super().__getitem__(key)
        if isinstance(found, Number):
            self.tally.add("bytes", self.size_of_one)
        return found

    def __setitem__(self, key, value):
        places = super().__getitem__(key)
        self.tally.add("bytes", self.size_of_one * (places.size if isinstance(places, np.ndarray) else 1))
        whole = isinstance(value, np.ndarray | Number)
        super().__setitem__(key, value if whole else Number(value, self.tally))


def counting(part, tally):
    """Return a tuple of arrays, tuples and numbers with each floating-point number replaced by a `Number`."""
    if isinstance(part, tuple):
        return type(part)(*(counting(item, tally) for item in part))
    if isinstance(part, np.ndarray) and part.dtype.kind == "f":
        numbers = np.empty(part.shape, object)
        numbers[...] = np.frompyfunc(lambda value: Number(value, tally), 1, 1)(part)
        numbers = numbers.view(Numbers)
        numbers.tally, numbers.size_of_one = tally, part.dtype.itemsize
        return numbers
    return Number(part, tally) if isinstance(part, float) else part


def _mathematics(tally):
    """Return a replacement for the module ``math`` with functions that are counted."""

    def counted(name):
        """Return the function of this name for counting and for plain numbers."""
        plain, quantity = getattr(math, name), "roots" if name == "sqrt" else "functions"

        def function(x, *more):
            """Return the value of the function and count the call."""
            if not isinstance(x, Number):
                return plain(x, *map(float, more))
            tally.add(quantity)
            return Number(plain(float(x), *map(float, more)), tally)

        return function

    names = ("sqrt", "log", "exp", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "tanh")
    plain = {name: getattr(math, name) for name in ("floor", "ceil", "pi", "inf", "nan")}
    plain["isfinite"] = lambda x: math.isfinite(float(x))
    plain["copysign"] = lambda x, y: Number(math.copysign(float(x), float(y)), tally)
    return SimpleNamespace(**plain, **{name: counted(name) for name in names})


def _registers(tally):
    """Return replacements for functions of :mod:`wrcore.kernels.lanes` by name; lanes are arrays of `Number`."""

    def load(rows, start, count):
        tally.add("bytes", rows.size_of_one * count)
        return np.array(rows.view(np.ndarray)[int(start) : int(start) + count])

    def below(lanes, limit):
        return sum(1 << k for k, (one, other) in enumerate(zip(lanes, limit, strict=True)) if one < other)

    def where_below(lanes, limit, value, other):
        chosen = [v if a < b else o for a, b, v, o in zip(lanes, limit, value, other, strict=True)]
        return np.array(chosen, object)

    def total(lanes):
        return sum(lanes[1:], start=lanes[0])

    return {
        "load8": lambda rows, row, start: load(rows[int(row)], start, 8),
        "load4": lambda values, start: load(values, start, 4),
        "lanes8": lambda number: np.full(8, number, object),
        "ramp8": lambda: np.array([Number(k, tally) for k in range(8)], object),
        "lane": lambda lanes, k: lanes[int(k)],
        "total": total,
        "maximum": max,
        "below": below,
        "where_below": where_below,
        "count_bits": lambda bits: int(bits).bit_count(),
        "lowest_bit": lambda bits: (int(bits) & -int(bits)).bit_length() - 1 if bits else 64,
        "highest_bit": lambda bits: int(bits).bit_length() - 1,
    }


def _call(_, *arguments):
    """Replace calls of kernels by address: joints have four arguments, wheels with elliptic patches eight."""
    kernel = constraints.add_reactions if len(arguments) == 4 else wheel.wheel_wrenches
    kernel(*arguments)


def _by_law(elements, k, *motion):
    """Replace calls of the laws of force elements by address."""
    return LAWS[int(elements.law[k, LAW])].py_func(elements, k, *motion)


@contextmanager
def interpreted(tally):
    """Replace compiled kernels by Python functions, counted by stage, within a ``with`` block."""
    registers, mathematics, before = _registers(tally), _mathematics(tally), []
    modules = [m for name, m in sys.modules.items() if name.startswith("wrcore.")]
    for module in modules:
        for name, value in list(vars(module).items()):
            new = value
            if (module.__name__, name) == ("wrcore.forces.suspension", "_by_law"):
                new = _by_law
            elif isinstance(value, Dispatcher):
                new = value.py_func
            elif value is math:
                new = mathematics
            elif name in registers and getattr(value, "__module__", "") == "wrcore.kernels.lanes":
                new = registers[name]
            elif name == "call_address" and module.__name__ in (
                "wrcore.equations.equations_of_motion",
                "wrcore.wheels.force",
            ):
                new = _call
            elif name == "other_at":
                new = lambda whole, address: whole  # noqa: E731
            elif name == "rarely_called":
                new = lambda: None  # noqa: E731
            if (module.__name__, name) in WHERE:
                new = tally.within(WHERE[module.__name__, name], new)
            if new is not value:
                before.append((module, name, value))
                setattr(module, name, new)
    try:
        yield
    finally:
        for module, name, value in before:
            setattr(module, name, value)


def count_operations(recorded, states=20):
    """Return mean counts of operations and bytes of one evaluation over states of the run, by stage and as ``whole``.

    They are floating-point sums and products (two for a fused multiply-add), divisions, square roots, other functions,
    and bytes of floating-point numbers that are read from and written to arrays.
    """
    chosen = recorded.states[:: max(1, len(recorded.states) // states)]
    tally = Tally()
    model, work = counting(recorded.model, tally), counting(workspace(recorded.model), tally)
    with interpreted(tally), np.errstate(all="ignore"):
        from wrcore.equations import equations_of_motion as system

        for state in chosen:
            row = counting(state, tally)
            system.fill_derivatives(0.0, row, model, work, counting(np.empty_like(state), tally))
    found = {
        stage: {quantity: tally.counts[stage, quantity] / len(chosen) for quantity in QUANTITIES} for stage in STAGES
    }
    found["whole"] = {quantity: sum(part[quantity] for part in found.values()) for quantity in QUANTITIES}
    return found
