"""Functions of the user (`wrcore.kernels.named_laws`) that kernels call by address.

A function compiled by numba (``@numba.njit``) becomes part of the machine code of the run. Each call of a plain Python
function takes some microseconds. The first error in such a function ends the run: each later call in this thread
returns NaN until the kernel has returned and `take_fault` is called. A model holds the digest of a function instead of
its address.
"""

import ctypes
import math
import threading
from contextvars import ContextVar
from functools import cache
from typing import Any

import numba
import numpy as np
from numba.core.errors import NumbaError

from wrcore.errors import InputError, short
from wrcore.errors.checked_calls import UNMASKED, is_masked
from wrcore.errors.messages import warn
from wrcore.kernels.aside import planned
from wrcore.kernels.handles import Kernel, call_c
from wrcore.kernels.jit import FUSED
from wrcore.kernels.named_laws import function_of, name_of, said

NOTHING = numba.types.none
"""Return type of a kernel that returns nothing."""

GUARD = 64
"""Count of guard numbers behind each array of a test call; a changed one shows that a function wrote outside."""

MOST_SAMPLES = 400_000
"""Largest number of samples of a function."""

_WATCHED = ContextVar("watched", default=False)
_NOT_FINITE: dict[tuple[int, ...], None] = {}
_NOTES: list[Any] = []  # callbacks of compiled code, kept alive
_HELD = threading.local()  # the error that a plain Python function raised in this thread


def take_fault():
    """Return and clear the error of a plain Python function in this thread: its name and the error as text.

    The text is empty if there was no error. A KeyboardInterrupt is raised again."""
    name, error = getattr(_HELD, "fault", ("", None))
    _HELD.fault = "", None
    if isinstance(error, KeyboardInterrupt):
        raise error
    return f"{name} raised {said(error)}" if name else ""


def fault_in(evaluate, *arguments):
    """Call a kernel outside a run and return the error in functions of the user as text, empty if there was none.

    The error is also printed once on standard error."""
    fault = ""
    take_fault()  # clear an error of an earlier kernel
    try:
        evaluate(*arguments)
    except Exception as error:  # raised in a compiled function
        fault = f"a law raised {said(error)}"
    fault = take_fault() or fault
    if fault:
        warn(f"{fault}; it counts as not a number")
    return fault


def tried(own, sizes, *arguments, reads=0):
    """Call a function for a test with numbers ``arguments`` and arrays of ``sizes``; return its result and the arrays.

    A size may also be a list of values. The first ``reads`` arrays are read-only. An InputError without a source is
    raised for an error in the function, and for a write outside the arrays or into read-only arrays."""
    function = own.function
    for call in (getattr(function, "py_func", function), function):  # only plain Python checks indices
        arrays, memory = [], []
        for size in sizes:
            values = np.zeros(size) if np.ndim(size) == 0 else np.array(size, float)
            memory.append(np.append(values, np.full(GUARD, np.pi)))
            arrays.append(memory[-1][: len(values)])
        before = [array.copy() for array in arrays[:reads]]
        found = called("works on a test call", call, *arguments, *arrays)
        if any(np.any(whole[-GUARD:] != np.pi) for whole in memory):
            raise InputError("", "", "expected a function that writes inside its arrays alone")
        if not all(map(np.array_equal, before, arrays)):
            raise InputError("", "", "expected a function that leaves its inputs, states and parameters as they are")
    return found, arrays


def called(what, function, *arguments):
    """Call a function of the user and return its result.

    Any error except KeyboardInterrupt becomes an InputError without a source; ``what`` is the expected behaviour."""
    try:
        return function(*arguments)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # any error, also SystemExit
        raise InputError("", "", f"expected a function that {what}: {said(error)}") from None


def is_number(value):
    """Whether a value is a real number, not an array and not a boolean."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def is_force(answer):
    """Whether a value is a valid result of a law of an element: a number, or a tuple of three numbers."""
    return is_number(answer) or (isinstance(answer, tuple) and len(answer) == 3 and all(map(is_number, answer)))


def finite(*values):
    """Raise an InputError without a source if results of a test call are not finite numbers."""
    try:
        good = all(np.isfinite(np.asarray(value, float)).all() for value in values)
    except (TypeError, ValueError):
        good = False
    if not good:
        raise InputError("", "", f"expected finite numbers from a test call, got {short(values)}")


def sample(own, s, rows):
    """Return the values (rows, n) of a function of arc length or speed ``s`` (n,).

    If the function returns an array (n,), this array is used for all rows."""
    found = called("works on an array", own.function, s.copy())
    if is_masked(found):
        raise InputError("", "", UNMASKED)
    found = called("returns numbers", np.asarray, found)
    if found.dtype.kind not in "fiu":
        raise InputError("", "", f"expected real numbers, got values of type {found.dtype}")
    if found.shape not in ((rows, len(s)), (len(s),)):
        raise InputError("", "", f"expected values of shape ({rows}, {len(s)}) or ({len(s)},), got {found.shape}")
    found = found.astype(float)
    finite(found)
    return np.broadcast_to(found, (rows, len(s)))


def on_grid(spec, rows, laws, source, field, call=True):
    """Return abscissas (n,) of a grid and the values (rows, n) of a law at these points; None unless ``call``.

    The keys of ``spec`` are ``begin`` (default 0), ``length`` and ``spacing`` of the grid, and ``law``, a name that
    ``laws`` finds. An InputError names ``source`` and ``field``."""
    count = round(spec["length"] / spec["spacing"]) + 1
    if not 2 <= count <= MOST_SAMPLES:
        raise InputError(source, f"{field}.spacing", f"expected 2 to {MOST_SAMPLES} samples, got {count}")
    s = spec.get("begin", 0.0) + spec["length"] / (count - 1) * np.arange(count)
    try:
        found = laws.find(spec["law"])
        if not call:
            return s, None
        laws.allow()
        return s, sample(found, s, rows)
    except InputError as error:
        raise InputError(source, f"{field}.law", error.expected) from None


def not_finite_in(evaluate):
    """Return the names of users' functions that return non-finite numbers for finite arguments during ``evaluate``.

    ``evaluate`` must request the addresses of the functions again (`addressed`)."""
    _NOT_FINITE.clear()
    token = _WATCHED.set(True)
    try:
        evaluate()
    finally:
        _WATCHED.reset(token)
    return [name_of(digest) for digest in _NOT_FINITE]


def _note_of(digest, watched):
    """Return a kernel that records a function with finite ``given`` and non-finite ``found``.

    Unless ``watched``, the kernel does nothing."""
    if not watched:
        return uncached(lambda given, found: None)
    back = ctypes.CFUNCTYPE(None, ctypes.c_int64)(lambda _: _NOT_FINITE.update({digest: None}))
    address = ctypes.cast(back, ctypes.c_void_p).value
    _NOTES.append(back)

    def note(given, found):
        if math.isfinite(given) and not math.isfinite(found):
            call_c(address, 0)

    return uncached(note)


def addressed(wrap, digest, scalars, arrays, examples, returns):
    """Return the `Kernel` that ``wrap`` makes of the function with a digest, for ``examples`` (`Example`).

    ``wrap`` also gets the kernel that records non-finite results. The function has ``scalars`` numbers and ``arrays``
    arrays as arguments."""
    if planned() is not None:  # these kernels are not stored in the cache
        return NotCompiled
    return _addressed(wrap, digest, function_of(digest), scalars, arrays, examples, returns, _WATCHED.get())


class NotCompiled:
    """Substitute for a `Kernel` whose compilation is only `planned`."""

    address = 0


@cache
def _addressed(wrap, digest, function, scalars, arrays, examples, returns, watched):
    if not hasattr(function, "py_func"):
        function = _called_back(function, name_of(digest), scalars, arrays)
    try:
        if arrays:  # else its caller compiles it, without allocation
            function.compile(signature_of(scalars, arrays))
        kernel = uncached(wrap(function, _note_of(digest, watched)))
        return Kernel(kernel, *(example.value for example in examples), returns=returns)
    except (NumbaError, TypeError, RuntimeError) as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip() and "nopython" not in line]
        text = f"expected a function that numba compiles to numbers as the page on own physics says: {lines[:1]}"
        raise InputError(name_of(digest), "", text) from None


def signature_of(scalars, arrays):
    """Return the types of ``scalars`` numbers and ``arrays`` arrays."""
    return (numba.float64,) * scalars + (numba.types.Array(numba.float64, 1, "C"),) * arrays


def uncached(function):
    """Compile a kernel without cache and without allocation (see `wrcore.kernels.jit.jit`), for users' functions."""
    return numba.njit(
        function, error_model="numpy", fastmath=FUSED, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False
    )


class Example:
    """An example argument; examples of one type are equal."""

    def __init__(self, value):
        self.value, self._type = value, str(numba.typeof(value))

    def __eq__(self, other):
        return self._type == other._type

    def __hash__(self):
        return hash(self._type)


def _called_back(function, name, scalars, arrays):
    """Return a compiled function that calls plain Python with numbers and arrays and returns three numbers.

    The function may write into the last array (element) or the last two arrays (control law)."""
    word, number, reads = ctypes.c_size_t, ctypes.c_double, arrays - 1 if arrays == 3 else arrays - 2

    @ctypes.CFUNCTYPE(None, word, *[number] * scalars, *[word, ctypes.c_ssize_t] * arrays)
    def back(result, *handed):
        found, places = _array(result, 3), handed[scalars:]
        given = [_array(places[2 * k], places[2 * k + 1]) for k in range(arrays)]
        for array in given[:reads]:
            array.flags.writeable = False
        try:
            if not getattr(_HELD, "fault", ("", None))[0]:
                found[:] = _answer_of(function(*handed[:scalars], *given), handed, arrays == 3)
                return
        except BaseException as error:  # no error may pass through compiled code
            _HELD.fault = name, error
        for array in (found, *given[reads:]):
            array[:] = np.nan

    if arrays == 3:  # law of an element: stretch, speed; states, parameters, rates

        def call(stretch, speed, a, b, c):
            found = np.zeros(3)
            back(found.ctypes.data, stretch, speed, a.ctypes.data, a.size, b.ctypes.data, b.size, c.ctypes.data, c.size)
            return found[0], found[1], found[2]
    else:  # control law: time; inputs, states, parameters, outputs, following

        def call(t, a, b, c, d, e):
            found = np.zeros(3)
            back(
                found.ctypes.data, t, a.ctypes.data, a.size, b.ctypes.data, b.size, c.ctypes.data, c.size,
                d.ctypes.data, d.size, e.ctypes.data, e.size,
            )  # fmt: skip

    return numba.njit(call)


def _answer_of(answer, handed, of_element):
    """Return force, stored energy and dissipated power from the result of a law; a force alone stores no energy."""
    if not of_element:
        if answer is not None:
            raise TypeError(f"expected a function that returns nothing, got {short(answer)}")
        return 0.0, 0.0, 0.0
    if not is_force(answer):
        raise TypeError(f"expected a force, or a tuple of force, energy and power, got {short(answer)}")
    return answer if isinstance(answer, tuple) else (answer, 0.0, answer * handed[1])


def _array(address, size):
    if not size:
        return np.empty(0)
    return np.ctypeslib.as_array((ctypes.c_double * size).from_address(address))
