"""Argument checks of public functions: the decorator `checked` refuses values that the annotations do not allow.

An annotation is a type, a union or a list of types, or ``Annotated`` with the marks below. A number of numpy is
converted to a number of Python; all other arguments are passed unchanged. Missing or unknown arguments raise the
TypeError of Python.
"""

import errno
import sys
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from functools import cache, wraps
from inspect import Parameter, signature, unwrap
from os import PathLike, fspath
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wrcore.errors import InputError, one_of, short

LARGEST, LEAST = sys.float_info.max, sys.float_info.min


class Within(NamedTuple):
    """Mark: bounds of a number or of the numbers of an array, both allowed; without bounds any finite number."""

    low: float = -LARGEST
    high: float = LARGEST
    unit: str = ""
    dimensions: int = 32
    """Largest number of dimensions of an array."""
    size: int = 1
    """Smallest number of elements of an array."""

    def __str__(self):
        low = "" if self.low == -LARGEST else "above 0" if self.low == LEAST else f"at least {self.low:g}"
        high = "" if self.high >= LARGEST else f"at most {self.high:g}"
        return f"{' and '.join(filter(None, (low, high))) or 'finite' * (self.high == LARGEST)} {self.unit}".rstrip()


class OneOf(tuple):
    """Mark: the allowed words."""


ARRAY = {*typing.get_args(ArrayLike)}
ABOVE_ZERO = Within(LEAST)
Threads = Annotated[int, Within(1, 1024)]

PLAIN = {float, int, bool, str, type(None)}
"""Types of arguments that need no check for masked values and no conversion from numpy."""

UNMASKED = "expected numbers without masked ones among them: leave these out (.compressed()) or fill them (.filled())"
"""Message for masked arrays of numpy.ma; their masked values would be used as numbers."""

UNFIT = (errno.EEXIST, errno.EISDIR, errno.ENOTDIR, errno.ENOENT, errno.ENAMETOOLONG, errno.ELOOP)
"""Error numbers of unusable paths, which become an InputError. A full disk or missing rights remain an OSError."""

Thing = typing.TypeVar("Thing", bound=Callable[..., Any])


class Kind(NamedTuple):
    """Allowed values of an argument: a test, a description for messages, and the allowed words if it is one of them."""

    fits: Callable[[Any], bool]
    text: str
    words: tuple[str, ...] = ()


def checked(thing: Thing) -> Thing:
    """Decorate a function, or the constructor of a class, with a check of its arguments.

    An argument that its annotation does not allow raises an `InputError` of one line. Annotations are evaluated at the
    first call. A decorated class remains the same class.
    """
    if isinstance(thing, type):
        setattr(thing, "__init__", checked(thing.__init__))  # noqa: B010
        return thing

    @cache
    def kinds():
        space, found = sys.modules[thing.__module__].__dict__, {}
        for name, part in signature(unwrap(thing)).parameters.items():
            text = part.annotation
            found[name] = part.kind, kind_of(eval(text, space) if isinstance(text, str) else text)
        by_name = {name: kind for name, (how, kind) in found.items() if how is not Parameter.VAR_KEYWORD}
        more = [(name, kind) for name, (how, kind) in found.items() if how is Parameter.VAR_POSITIONAL]
        return [pair for pair in by_name.items() if pair not in more], by_name, more

    @wraps(thing)
    def front(*args, **options):
        in_order, by_name, more = kinds()
        given = [(*pair, value) for pair, value in zip(in_order, args, strict=False)]
        given += [(*pair, value) for pair in more for value in args[len(in_order) :]]
        given += [(name, by_name[name], value) for name, value in options.items() if name in by_name]
        converts = False
        for name, kind, value in given:
            if type(value) not in PLAIN:
                if is_masked(value):
                    raise InputError(thing.__qualname__.removesuffix(".__init__"), name, UNMASKED)
                converts = converts or isinstance(value, np.generic)
            if not kind.fits(value):
                expected = one_of(kind.words, value) if kind.words else f"expected {kind.text}, got {short(value)}"
                raise InputError(thing.__qualname__.removesuffix(".__init__"), name, expected)
        try:
            if converts:
                args, options = map(_plain, args), {name: _plain(value) for name, value in options.items()}
            return thing(*args, **options)
        except OSError as error:
            if error.errno not in UNFIT:
                raise
            expected = f"expected a path for this, but: {error.strerror}"
            raise InputError(thing.__qualname__, short(error.filename), expected) from error

    return typing.cast(Thing, front)


def _plain(value):
    """Return a number or text of numpy as a type of Python, whose numbers have full precision and range."""
    return value.item() if isinstance(value, np.generic) else value


def is_masked(value, depth=4):
    """Whether an array, or an array in nested lists up to ``depth`` levels, has masked values."""
    if isinstance(value, list | tuple):
        inner = [item for item in value if isinstance(item, np.ma.MaskedArray | list | tuple)] if depth else []
        return any(is_masked(item, depth - 1) for item in inner)
    return isinstance(value, np.ma.MaskedArray) and bool(np.ma.is_masked(value))


def same_shape(source, **arrays):
    """Return arrays broadcast to one shape; an InputError names the arguments if this is impossible."""
    try:
        return np.broadcast_arrays(*arrays.values())
    except ValueError:
        shapes = ", ".join(f"{name} {np.shape(array)}" for name, array in arrays.items() if np.ndim(array))
        raise InputError(source, " ".join(arrays), f"expected arrays of one shape, got {shapes}") from None


def kind_of(annotation, *marks):
    """Return the `Kind` of an annotation; a text among the marks of ``Annotated`` is the description for messages."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Annotated:
        return kind_of(inner[0], *inner[1:], *marks)
    said = next((mark for mark in marks if type(mark) is str), None)
    kind = _kind(annotation, origin, inner, [mark for mark in marks if mark is not said])
    return kind if said is None else kind._replace(text=said)


def _kind(annotation, origin, inner, marks):
    words = inner if origin is typing.Literal else next((mark for mark in marks if isinstance(mark, OneOf)), ())
    bounds = next((mark for mark in marks if isinstance(mark, Within)), Within())
    if origin in (typing.Union, types.UnionType):
        arrays = ARRAY <= {*inner}
        kinds = [kind_of(one, *marks) for one in inner if not (arrays and one in ARRAY)]
        if arrays:
            kinds.append(Kind(lambda value: _are_numbers(value, bounds), f"a number or an array of numbers, {bounds}"))
        tests, texts = [kind.fits for kind in kinds], [kind.text for kind in kinds if kind.text != "None"]
        return Kind(lambda value: any([fits(value) for fits in tests]), " or ".join(texts))
    if words and annotation in (str, typing.Any) or origin is typing.Literal:
        text = f"one of {', '.join(map(str, words))}"
        return Kind(lambda value: isinstance(value, str | bool) and value in words, text, tuple(map(str, words)))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        fits = kind_of(inner[1], *marks).fits
        return Kind(
            lambda value: isinstance(value, origin) and all(isinstance(k, str) and fits(v) for k, v in value.items()),
            "a mapping by names",
        )
    if isinstance(origin, type) and issubclass(origin, Iterable):
        one, least = kind_of(inner[0], *marks), bounds.size if bounds in marks else 0
        return Kind(lambda value: _all_fit(value, one.fits, origin is Iterable, least), f"a list, each {one.text}")
    return _plain_kind(origin or annotation, bounds)


def _plain_kind(kind, bounds):
    low, high = bounds[:2]
    if kind in (float, int):
        numbers = (int, np.integer) if kind is int else (float, int, np.floating, np.integer)

        def fits(v):  # a float32 would be compared with bounds rounded to float32
            v = float(v) if isinstance(v, np.floating) else v
            return isinstance(v, numbers) and v is not True and v is not False and low <= v <= high

        return Kind(fits, f"a {'whole ' * (kind is int)}number, {bounds}")
    if kind in (None, type(None)):
        return Kind(lambda value: value is None, "None")
    if kind is Callable:
        return Kind(callable, "a function")
    if kind in (str, PathLike):
        return Kind(lambda value: isinstance(value, kind) and _is_text(value), "text" if kind is str else "a path")
    if kind is bool:
        return Kind(lambda value: isinstance(value, bool | np.bool_), "True or False")
    if not isinstance(kind, type) or kind in (object, Any, Parameter.empty):
        return Kind(lambda value: True, "anything")
    return Kind(lambda value: isinstance(value, kind), f"{'an' if kind.__name__[0] in 'aA' else 'a'} {kind.__name__}")


def _is_text(value):
    """Whether a text or path has only characters that files and file names can hold."""
    text = fspath(value)
    return isinstance(text, str) and not any(c == "\0" or "\ud800" <= c <= "\udfff" for c in text)


def _all_fit(value, fits, one_shot, least):
    """Whether all items of a list fit; an iterator, which can be read only once, is not checked."""
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        return False
    if hasattr(value, "__next__"):
        return one_shot
    try:
        return len(value) >= least and all(fits(item) for item in value)
    except TypeError:  # an array without dimensions
        return False


def _are_numbers(value, bounds):
    if type(value) is float:
        return bounds.low <= value <= bounds.high
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        return False
    if array.dtype.kind not in "iuf" or array.size < bounds.size or array.ndim > bounds.dimensions:
        return False
    array = array.astype(float, copy=False)  # a float32 would be compared with bounds rounded to float32
    return bool(((array >= bounds.low) & (array <= bounds.high)).all())
