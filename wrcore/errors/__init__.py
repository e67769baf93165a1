"""Errors for wrong input, and their messages about invalid numbers and unknown words."""

import re
from numbers import Real

_DIGIT = re.compile(r"\d")

_LONGEST = 2000
"""Largest number of characters of each part of a message."""


class InputError(ValueError):
    """Error in input of the user. wrcore raises this error before the computation starts.

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
        super().__init__(self.source, self.field, self.expected)  # arguments from which pickle rebuilds the error

    def __str__(self):
        return ": ".join(_cut(" ".join(part.split())) for part in self.args if part)


def _cut(part):
    """Return a part of a message; of a text that is too long, the middle is left out."""
    return part if len(part) <= _LONGEST else f"{part[: _LONGEST // 2]} ... {part[-_LONGEST // 2 :]}"


class UnknownNameError(InputError, KeyError):
    """Error for a name that a collection does not contain, for example a channel that a run does not have."""


def short(value):
    """Return a short text of a value for an error message."""
    import reprlib

    try:
        return reprlib.repr(value)
    except Exception:  # integers of thousands of digits, objects whose repr fails
        return f"a {type(value).__name__}"


def check_number(value, low, high, source, field, unit=""):
    """Return a number as float; raise an InputError unless it is a real number from ``low`` to ``high``.

    Both bounds are allowed; they are in ``unit``. NaN and text are refused. ``source`` and ``field`` are those of
    :class:`InputError`.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not low <= value <= high:
        raise InputError(source, field, f"expected {f'{low:g} to {high:g} {unit}'.strip()}, got {short(value)}")
    return float(value)


def similar(word, known):
    """Return a suggestion such as ``; did you mean 'speed'?`` for an unknown word, or an empty text.

    The suggested word is similar to ``word``, or is ``word`` with a unit. Names of a numbered series are not suggested
    for each other, for example fra_5 or fra_6 for fra_4."""
    from difflib import get_close_matches

    words = {name.lower(): name for name in map(str, known)}
    word = word.lower() if isinstance(word, str) else ""
    series = [name for name in words if _DIGIT.sub("0", name) == _DIGIT.sub("0", word)]
    if len(series) > 1 and word not in words:
        return ""
    near = get_close_matches(word, words, n=1) or [name for name in words if word.startswith(name + "_")]
    return f"; did you mean {words[near[0]]!r}?" if near else ""


def one_of(known, word):
    """Return the expectation for an unknown word: the list of known words and the most similar word."""
    known = [str(name) for name in known]
    if not known:
        return f"expected none, as there is nothing of the kind, got {short(word)}"
    return f"expected one of {', '.join(known)}, got {short(word)}{similar(word, known)}"
