"""What a sampled motion shows by itself: zero crossings, frequency, amplitude, growth."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from wrcore.errors import InputError
from wrcore.errors.checked_calls import Within, checked
from wrcore.geometry.path import tangent_path
from wrcore.geometry.track import build_track

Samples = Annotated[ArrayLike, Within(dimensions=1, size=0)]


def zero_crossings(t, y):
    """Times (s) in order at which a sampled motion y passes through zero, by linear interpolation."""
    t, y = np.asarray(t), np.asarray(y)
    before = _sign_changes(y)
    return t[before] - y[before] * (t[before + 1] - t[before]) / (y[before + 1] - y[before])


def _sign_changes(y):
    """Indices of the samples just before a change of sign."""
    return np.flatnonzero((y[:-1] < 0) != (y[1:] < 0))


@checked
def hunting_frequency(t: Samples, y: Samples) -> float:
    """Frequency of a lateral motion about the track's centre, from its zero crossings.

    Parameters
    ----------
    t, y : array_like, shape (n,)
        Times (s) and lateral positions (m).

    Returns
    -------
    float
        Frequency, Hz; NaN with fewer than three crossings.

    Examples
    --------
    >>> import numpy as np
    >>> import wrcore as wr
    >>> t = np.linspace(0.0, 2.0, 401)
    >>> round(wr.hunting_frequency(t, 1e-3 * np.cos(2 * np.pi * 3.0 * t)), 3)
    3.0
    """
    if np.shape(t) != np.shape(y):
        raise InputError("hunting_frequency", "y", f"expected as many as times, {np.size(t)}, got {np.size(y)}")
    when = zero_crossings(t, y)
    return float(0.5 * (when.size - 1) / (when[-1] - when[0])) if when.size > 2 else np.nan


def amplitude(y):
    """Half of the peak-to-peak value of a motion, in its unit."""
    return 0.5 * float(np.ptp(y)) if np.size(y) else np.nan


def growth_rate(t, y):
    """Growth of an oscillation, 1/s: slope of the logarithm of its extrema over t (s); NaN with fewer than two."""
    t, y = np.asarray(t), np.asarray(y)
    edges = _sign_changes(y) + 1
    tops = [start + int(np.argmax(np.abs(y[start:end]))) for start, end in zip(edges[:-1], edges[1:], strict=True)]
    tops = [top for top in tops if y[top] != 0.0]
    if len(tops) < 2:
        return np.nan
    return float(np.polyfit(t[tops], np.log(np.abs(y[tops])), 1)[0])


def path_of(run):
    """`PathData` of the track that a run is on, built anew of its scene; straight where that says nothing."""
    track = run.scene.get("track", {})
    if track.get("path", "tangent") == "tangent" and not track.get("gradients"):
        return tangent_path()
    return build_track({key: track[key] for key in track if key not in ("irregularity", "support")}, "run").path
