"""Numbers of a scene that may vary with time or along the track."""

import numpy as np


def read_schedule(spec, value, abscissas, reader):
    """Return the abscissa's index in ``abscissas`` and points (q, 2) of a number or a table.

    A table is two lists, ``{abscissa: [...], value: [...]}``. The columns of the points are abscissa, strictly
    increasing, and value. A number has the index 0 and one point. ``value`` is the key of the values; further keys are
    ignored.
    """
    if not isinstance(spec, dict):
        return 0, np.array([[0.0, float(spec)]])
    named = [key for key in abscissas if key in spec]
    if len(named) != 1 or value not in spec:
        raise reader.error("", f"expected a number, or {' or '.join(abscissas)} and {value}, two lists")
    x, y = np.array(spec[named[0]], float), np.array(spec[value], float)
    if x.size != y.size:
        raise reader.error(value, f"expected {x.size} values as in {named[0]}, got {y.size}")
    if np.any(np.diff(x) <= 0.0):
        expected = "expected strictly rising values; a step is two points close to each other"
        raise reader.error(named[0], expected)
    return abscissas.index(named[0]), np.column_stack([x, y])
