"""Functions of a user's own: named as ``module:function`` or ``file.py:function``, called from kernels by address.

A function that numba compiled (``@numba.njit``) becomes part of the run's machine code. A plain Python function is
called back by every evaluation that needs it, at some microseconds each; an error in it is said once and counts as NaN.
What decides on a run is the text of the function's module, its code, and the values that it takes from around it: their
digest stands in the model, in place of an address.
"""

import ctypes
import hashlib
import importlib
import importlib.util
import inspect
import math
import sys
from collections.abc import Callable
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, NamedTuple

import numba
import numpy as np

from wrcore.errors import InputError
from wrcore.kernels.aside import planned
from wrcore.kernels.cache import warn
from wrcore.kernels.handles import Kernel, call_c
from wrcore.kernels.jit import FUSED

NOTHING = numba.types.none
"""What a kernel returns that returns nothing."""

GUARD = 64
"""Numbers behind an array of a test call that a function must leave alone."""

MOST_SAMPLES = 400_000
"""Of a function that is sampled."""

_KNOWN: dict[tuple[int, ...], Callable] = {}
_TEXTS: dict[ModuleType, str] = {}
_WATCHED = ContextVar("watched", default=False)
_NOT_FINITE: dict[tuple[int, ...], None] = {}
_NOTES: list[Any] = []  # what compiled code calls, kept alive


class Own(NamedTuple):
    """A function of a user's own."""

    name: str
    digest: tuple[int, ...]
    """Of its name, of its module's text and of `_content`, as four numbers: what models hold in its place."""

    @property
    def function(self):
        """The function itself."""
        return _KNOWN[self.digest]


def find(law, folder=Path()):
    """The `Own` function that ``law`` names; files count from ``folder``, then from the folder above. An InputError
    without a source says what was expected."""
    place, _, name = law.rpartition(":")
    if not place or not name.isidentifier():
        raise InputError("", "", f"expected module:function or file.py:function, got {law!r}")
    module = _of_file(place, folder) if place.endswith(".py") else _imported(place)
    function = getattr(module, name, None)
    if not callable(function):
        raise InputError("", "", f"expected a function {name!r} in {place}, found none")
    sha = hashlib.sha256(f"{name}\0{_text(module, function)}\0{_content(function, set())}".encode()).digest()
    digest = tuple(int(part) for part in np.frombuffer(sha, np.int64))
    _KNOWN[digest] = function
    return Own(name, digest)


def file_of(law, folder):
    """Path of the file that a law in the form ``file.py:function`` names, or None."""
    place = law.rpartition(":")[0]
    found = (base / place for base in (folder, Path(folder).parent, Path()))
    return next((path for path in found if path.is_file()), None) if place.endswith(".py") else None


def _of_file(place, folder):
    path = file_of(f"{place}:", folder)
    if path is None:
        raise InputError("", "", f"expected an existing file, got {place!r}")
    content = path.read_bytes()
    name = f"{path.stem}_{hashlib.sha256(bytes(path.resolve()) + content).hexdigest()[:12]}"
    if name not in sys.modules:
        specification = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(specification)
        sys.modules[name] = module
        try:
            _guarded(place, lambda: specification.loader.exec_module(module))
        except InputError:
            del sys.modules[name]
            raise
        _TEXTS[module] = content.decode("utf-8", "replace")
    return sys.modules[name]


def _imported(place):
    return _guarded(place, lambda: importlib.import_module(place))


def _guarded(place, load):
    try:
        return load()
    except Exception as error:  # whatever the module's own code does
        raise InputError("", "", f"expected a module that can be imported: {place}: {_said(error)}") from None


def _said(error):
    return " ".join(f"{type(error).__name__}: {error}".split())


def _text(module, function):
    """What decides on a function: the text of its module as it was first read; in a notebook its own."""
    if module not in _TEXTS:
        try:
            _TEXTS[module] = Path(module.__file__).read_text("utf-8")
        except (AttributeError, TypeError, OSError, UnicodeDecodeError):
            try:
                return inspect.getsource(getattr(function, "py_func", function))
            except (OSError, TypeError):
                return ""  # its code still counts
    return _TEXTS[module]


def _content(thing, seen):
    """What a value is, or a function does, as text that another process finds, too: a function that is defined anew,
    with another text or other globals, has another one. Functions of libraries stand by their names."""
    plain = getattr(thing, "py_func", thing)
    if isinstance(plain, FunctionType):
        name = f"{plain.__module__}.{plain.__qualname__}"
        foreign = seen and plain.__module__ not in {one.__module__ for one in seen} and plain is thing
        if foreign or plain in seen or name.startswith("wrcore."):
            return name
        seen.add(plain)
        cells = [cell.cell_contents for cell in plain.__closure__ or ()]
        around = [plain.__globals__[one] for one in _names(plain.__code__) if one in plain.__globals__]
        return _content((plain.__code__, plain.__defaults__, plain.__kwdefaults__, cells, around), seen)
    if isinstance(thing, CodeType):
        return f"{thing.co_code.hex()}{thing.co_names}{_content(thing.co_consts, seen)}"
    if isinstance(thing, np.ndarray | np.generic):
        return f"{thing.dtype}{np.shape(thing)}{hashlib.sha256(thing.tobytes()).hexdigest()}"
    if isinstance(thing, tuple | list):
        return str([_content(one, seen) for one in thing])
    if isinstance(thing, dict):
        return str([(str(key), _content(value, seen)) for key, value in thing.items()])
    if isinstance(thing, set | frozenset):
        return str(sorted(_content(one, seen) for one in thing))
    known = thing is None or isinstance(thing, bool | int | float | complex | str | bytes)
    return repr(thing) if known else f"{type(thing).__name__} {getattr(thing, '__name__', '')}"


def _names(code):
    """Names that code, and the code in it, takes from its globals."""
    inner = [one for one in code.co_consts if isinstance(one, CodeType)]
    return sorted({*code.co_names, *(name for one in inner for name in _names(one))})


def text_digest(function):
    """Four numbers for the text of the module of a kernel from elsewhere."""
    return find(f"{function.__module__}:{function.__name__}").digest


def tried(own, sizes, *arguments):
    """What a function returns on a test call with arrays of these ``sizes``, one behind another, after the numbers
    ``arguments``; beside it the arrays. Values may be given in place of a size. An InputError without a source for
    an error in it, or a number written where no array is."""
    function = own.function
    for call in (getattr(function, "py_func", function), function):  # compiled code looks at no index
        arrays, memory = [], []
        for size in sizes:
            values = np.zeros(size) if np.ndim(size) == 0 else np.array(size, float)
            memory.append(np.append(values, np.full(GUARD, np.pi)))
            arrays.append(memory[-1][: len(values)])
        try:
            found = call(*arguments, *arrays)
        except Exception as error:  # whatever the function does
            raise InputError("", "", f"expected a function that works on a test call: {_said(error)}") from None
        if any(np.any(whole[-GUARD:] != np.pi) for whole in memory):
            raise InputError("", "", "expected a function that writes inside its arrays alone")
    return found, arrays


def finite(*values):
    """Raise an InputError without a source where a test call left something not finite."""
    try:
        good = all(np.isfinite(np.asarray(value, float)).all() for value in values)
    except (TypeError, ValueError):
        good = False
    if not good:
        raise InputError("", "", f"expected finite numbers from a test call, got {list(map(np.asarray, values))}")


def sample(own, s, rows):
    """Values (rows, n) of a function of arc length or speed ``s`` (n,), which may give (n,) for all rows."""
    try:
        found = np.asarray(own.function(s.copy()), float)
    except Exception as error:  # whatever the function does
        raise InputError("", "", f"expected a function that works on an array: {_said(error)}") from None
    if found.shape not in ((rows, len(s)), (len(s),)):
        raise InputError("", "", f"expected values of shape ({rows}, {len(s)}) or ({len(s)},), got {found.shape}")
    finite(found)
    return np.broadcast_to(found, (rows, len(s)))


def on_grid(spec, rows, folder, source, field, begin=0.0):
    """Abscissas (n,) from ``begin`` on over a ``length`` by a ``spacing``, keys of ``spec``, and the values (rows, n)
    of its ``law`` there; an InputError names ``source`` and ``field``."""
    count = round(spec["length"] / spec["spacing"]) + 1
    if not 2 <= count <= MOST_SAMPLES:
        raise InputError(source, f"{field}.spacing", f"expected 2 to {MOST_SAMPLES} samples, got {count}")
    s = spec.get("begin", begin) + spec["length"] / (count - 1) * np.arange(count)
    try:
        return s, sample(find(spec["law"], folder), s, rows)
    except InputError as error:
        raise InputError(source, f"{field}.law", error.expected) from None


def name_of(digest):
    """File and name of the function with a digest."""
    plain = getattr(_KNOWN[tuple(map(int, digest))], "py_func", _KNOWN[tuple(map(int, digest))])
    code = getattr(plain, "__code__", None)
    return f"{Path(code.co_filename).name}:{plain.__name__}" if code else str(plain)


def not_finite_in(evaluate):
    """Names of the functions that give numbers that are not finite for finite ones while ``evaluate`` is called, which
    asks for their addresses (`addressed`) anew."""
    _NOT_FINITE.clear()
    token = _WATCHED.set(True)
    try:
        evaluate()
    finally:
        _WATCHED.reset(token)
    return [name_of(digest) for digest in _NOT_FINITE]


def _note_of(digest, watched):
    """Kernel that takes note where a function makes of ``given`` that is finite what is not; where nobody watches, one
    that does nothing."""
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
    """The `Kernel` that ``wrap`` makes of the function with a digest and of what takes note of its results, for
    ``examples`` (`Example`); plain Python is called back with so many ``scalars``, then ``arrays``."""
    if planned() is not None:  # no file keeps them
        return NotCompiled
    return _addressed(wrap, digest, _KNOWN[digest], scalars, arrays, examples, returns, _WATCHED.get())


class NotCompiled:
    """In place of a `Kernel` that is only `planned`."""

    address = 0


@cache
def _addressed(wrap, digest, function, scalars, arrays, examples, returns, watched):
    if not hasattr(function, "py_func"):
        function = _called_back(function, scalars, arrays)
    if arrays:  # by itself first: what a caller has compiled may allocate no more than the caller
        function.compile(signature_of(scalars, arrays))
    return Kernel(
        uncached(wrap(function, _note_of(digest, watched))), *(example.value for example in examples), returns=returns
    )


def signature_of(scalars, arrays):
    """Types of so many numbers and arrays."""
    return (numba.float64,) * scalars + (numba.types.Array(numba.float64, 1, "C"),) * arrays


def uncached(function):
    """A kernel around an own function, which no file keeps; it allocates nothing, see `wrcore.kernels.jit.jit`."""
    return numba.njit(
        function, error_model="numpy", fastmath=FUSED, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False
    )


class Example:
    """An example argument, known by its type."""

    def __init__(self, value):
        self.value, self._type = value, str(numba.typeof(value))

    def __eq__(self, other):
        return self._type == other._type

    def __hash__(self):
        return hash(self._type)


def _called_back(function, scalars, arrays):
    """Plain Python as a compiled function of ``scalars`` numbers and arrays that returns three numbers."""
    told: list[Any] = []
    word, number = ctypes.c_size_t, ctypes.c_double

    @ctypes.CFUNCTYPE(None, word, *[number] * scalars, *[word, ctypes.c_ssize_t] * arrays)
    def back(result, *handed):
        found = _array(result, 3)
        places = handed[scalars:]
        given = [_array(places[2 * k], places[2 * k + 1]) for k in range(arrays)]
        try:
            answer = function(*handed[:scalars], *given)
            found[:] = answer_of(answer, handed[1] if scalars > 1 else 0.0)
        except Exception as error:  # no error may pass through compiled code
            if not told:
                told.append(warn(f"{function.__name__}: {_said(error)}; it counts as not a number"))
            for array in (found, *given[-1 - (arrays > 2) :]):
                array[:] = np.nan

    if arrays == 3:  # of an element: stretch, speed; states, parameters, rates

        def call(stretch, speed, a, b, c):
            found = np.zeros(3)
            back(found.ctypes.data, stretch, speed, a.ctypes.data, a.size, b.ctypes.data, b.size, c.ctypes.data, c.size)
            return found[0], found[1], found[2]
    else:  # of a control: time; inputs, states, parameters, outputs, following

        def call(t, a, b, c, d, e):
            found = np.zeros(3)
            back(
                found.ctypes.data, t, a.ctypes.data, a.size, b.ctypes.data, b.size, c.ctypes.data, c.size,
                d.ctypes.data, d.size, e.ctypes.data, e.size,
            )  # fmt: skip

    return numba.njit(call)


def answer_of(answer, speed):
    """Force, stored energy and dissipated power of an element's answer; a force alone stores nothing."""
    if answer is None:
        return 0.0, 0.0, 0.0
    return answer if np.ndim(answer) else (answer, 0.0, answer * speed)


def _array(address, size):
    if not size:
        return np.empty(0)
    return np.ctypeslib.as_array((ctypes.c_double * size).from_address(address))
