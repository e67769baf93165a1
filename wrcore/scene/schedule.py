"""Numbers of a scene that may change over time or along the track."""

import numpy as np

from wrcore.errors import InputError


def read_schedule(spec, value, abscissas, source, field):
    """A number, or a table of two lists, ``{abscissa: [...], value: [...]}``, as the number of its abscissa in
    ``abscissas`` (0 for a number) and points (q, 2), abscissa strictly rising, and value; one point for a number.

    ``value`` is the key of the values; further keys are left to others. An InputError names ``source`` and ``field``.
    """
    if not isinstance(spec, dict):
        return 0, np.array([[0.0, float(spec)]])
    named = [key for key in abscissas if key in spec]
    if len(named) != 1 or value not in spec:
        raise InputError(source, field, f"expected a number, or {' or '.join(abscissas)} and {value}, two lists")
    x, y = np.array(spec[named[0]], float), np.array(spec[value], float)
    if x.size != y.size:
        raise InputError(source, f"{field}.{value}", f"expected {x.size} values as in {named[0]}, got {y.size}")
    if np.any(np.diff(x) <= 0.0):
        expected = "expected strictly rising values; a step is two points close to each other"
        raise InputError(source, f"{field}.{named[0]}", expected)
    return abscissas.index(named[0]), np.column_stack([x, y])
