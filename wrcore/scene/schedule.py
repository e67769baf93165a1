"""Numbers of a scene that may change over time or along the track."""

import numpy as np

from wrcore.errors import InputError


def read_schedule(spec, value, abscissas, source, field):
    """A number, or a table of two lists, as points.

    Parameters
    ----------
    spec : float or dict
        ``{abscissa: [...], value: [...]}``; further keys are left to others.
    value : str
        Key of the values.
    abscissas : sequence of str
        Keys that may stand for what it is over.
    source, field : str
        Named in errors.

    Returns
    -------
    over : int
        Number of the abscissa in ``abscissas``; 0 for a number.
    points : numpy.ndarray, shape (q, 2)
        Abscissa, strictly rising, and value; one point for a number.

    Raises
    ------
    InputError
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
