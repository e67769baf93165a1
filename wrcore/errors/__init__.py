"""The one error that a user can cause, and what it says of a number or a word that cannot be."""

import re
from numbers import Real

_DIGIT = re.compile(r"\d")

_LONGEST = 2000
"""Letters of a part of a message."""


class InputError(ValueError):
    """Something a person wrote cannot be used; nothing has been started yet.

    Parameters
    ----------
    source : str
        File (or command-line option) that holds the fault.
    field : str
        Key, column or line inside the source; may be empty.
    expected : str
        What was expected there, and what was found.

    Notes
    -----
    ``str(error)`` is always one line. The command line prints it and ends with status 2.

    Examples
    --------
    >>> import wrcore as wr
    >>> try:
    ...     wr.simulate(wr.example("wheelset"), sped=30)
    ... except wr.InputError as error:
    ...     print(str(error).split(";")[0])
    changes: sped: unknown key
    """

    def __init__(self, source, field, expected):
        self.source, self.field, self.expected = str(source), str(field), str(expected)
        super().__init__(self.source, self.field, self.expected)  # what copies and other processes build it from

    def __str__(self):
        return ": ".join(_cut(" ".join(part.split())) for part in self.args if part)


def _cut(part):
    """A part of a message, without the middle of a text of thousands of letters."""
    return part if len(part) <= _LONGEST else f"{part[: _LONGEST // 2]} ... {part[-_LONGEST // 2 :]}"


class UnknownNameError(InputError, KeyError):
    """A name that something looked up by names does not hold."""


def short(value):
    """A value as an error names it."""
    import reprlib

    try:
        return reprlib.repr(value)
    except Exception:  # whole numbers of thousands of digits, objects that cannot say what they are
        return f"a {type(value).__name__}"


def check_number(value, low, high, source, field, unit=""):
    """The number, refused if it is none from ``low`` to ``high`` (both allowed, in ``unit``): NaN, text, another unit;
    ``source`` and ``field`` as for :class:`InputError`.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not low <= value <= high:
        raise InputError(source, field, f"expected {f'{low:g} to {high:g} {unit}'.strip()}, got {short(value)}")
    return float(value)


def similar(word, known):
    """``; did you mean 'speed'?`` where one of the known words is close to a word, or is it but for a unit; else
    nothing, as of another number of a series: fra_4 is neither fra_5 nor fra_6."""
    from difflib import get_close_matches

    words = {name.lower(): name for name in map(str, known)}
    word = word.lower() if isinstance(word, str) else ""
    series = [name for name in words if _DIGIT.sub("0", name) == _DIGIT.sub("0", word)]
    if len(series) > 1 and word not in words:
        return ""
    near = get_close_matches(word, words, n=1) or [name for name in words if word.startswith(name + "_")]
    return f"; did you mean {words[near[0]]!r}?" if near else ""


def one_of(known, word):
    """What to say of a word that is none of the known ones: these, and the closest."""
    known = [str(name) for name in known]
    if not known:
        return f"expected none, as there is nothing of the kind, got {short(word)}"
    return f"expected one of {', '.join(known)}, got {short(word)}{similar(word, known)}"
