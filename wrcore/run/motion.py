"""Properties of a sampled motion: zero crossings, frequency, amplitude and growth rate."""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from wrcore.errors import InputError
from wrcore.errors.checked_calls import Within, checked
from wrcore.geometry.path import tangent_path
from wrcore.geometry.track import build_track

Samples = Annotated[ArrayLike, Within(dimensions=1, size=0)]


def zero_crossings(t, y):
    """Return the times (s), in order, at which a sampled motion y crosses zero, by linear interpolation."""
    t, y = np.asarray(t), np.asarray(y)
    before = _sign_changes(y)
    return t[before] - y[before] * (t[before + 1] - t[before]) / (y[before + 1] - y[before])


def _sign_changes(y):
    """Return the indices of the samples just before a change of sign."""
    return np.flatnonzero((y[:-1] < 0) != (y[1:] < 0))


RIPPLE = 1.0 / 3.0
"""A swing smaller than this fraction of a neighbouring swing is a ripple: noise, or a second, smaller motion.
Successive swings of a motion with a damping ratio of 0.33 have this ratio."""

FADED = 0.05
"""Fraction of the largest swing below which a motion has died out: noise of 1 % of its amplitude is smaller."""

NOISE = 6.0
"""Multiple of the standard deviation of white noise below which a swing is a ripple, limited to `RIPPLE` of the largest
swing."""

DEAD = 1e-9
"""Swing below which a motion is rounding noise, m: a run at rest on the track has 1e-11 m."""


@checked
def hunting_frequency(t: Samples, y: Samples) -> float:
    """Return the frequency of a lateral motion, from the times at which it passes the middle of its swings.

    A swing goes from one turning point to the next. Ripples (smaller than a third of a neighbouring swing, or smaller
    than the noise of the samples) are part of the swing on which they lie. Swings below 5 % of the largest swing, or
    below 1 nm, are ignored: the motion has died out and only noise remains. Each swing has its middle, so that an
    offset, such as in a curve, has no influence.

    Parameters
    ----------
    t, y : array_like, shape (n,)
        Times (s) and lateral positions (m).

    Returns
    -------
    float
        Frequency, Hz; NaN with fewer than three swings.

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
    t, y = np.asarray(t, float), np.asarray(y, float)
    turns = turning_points(y)
    sizes = np.abs(np.diff(y[turns]))
    largest = sizes.max(initial=0.0)
    alive = sizes >= max(FADED * largest, 1.3 * min(_noise(y), RIPPLE * largest), DEAD)
    when = np.array([_passes(t, y, turns, k) if on else np.nan for k, on in enumerate(alive)])
    if np.isfinite(when[1:-1]).sum() > 2:
        when = when[1:-1]  # the first and the last swing may be parts
    periods = when[2:] - when[:-2]
    known = np.isfinite(periods)
    return float(1.0 / np.mean(periods[known])) if known.any() else np.nan


def turning_points(y):
    """Return the indices of the samples at which a motion turns, without ripples, with the first and the last one."""
    y = np.asarray(y, float)
    moves = np.concatenate(([0], np.flatnonzero(np.diff(y)) + 1)) if y.size else np.zeros(0, int)  # plateaus count once
    turns = moves[np.r_[True, np.diff(np.sign(np.diff(y[moves]))) != 0.0, True]] if moves.size > 2 else moves
    noise = _noise(y)
    while len(turns) > 3:
        sizes = np.abs(np.diff(y[turns]))
        inner, before, after = sizes[1:-1], sizes[:-2], sizes[2:]
        least = np.maximum(RIPPLE * np.maximum(before, after), min(noise, RIPPLE * sizes.max()))
        small = (inner < before) & (inner <= after) & (inner < least)
        if not small.any():
            break
        first = np.flatnonzero(small) + 1
        turns = np.delete(turns, np.r_[first, first + 1])
    return turns


def _noise(y):
    """Return the largest swing that white noise causes: `NOISE` standard deviations of the noise.

    The standard deviation is estimated from the median of second differences, whose variance is 6 times that of the
    noise.
    """
    return NOISE * np.median(np.abs(np.diff(y, 2))) / (0.6745 * 6.0**0.5) if y.size > 3 else 0.0


def _passes(t, y, turns, k):
    """Return the time (s) at which a motion passes the middle of its k-th swing between its ``turns``, or NaN.

    For the first and the last swing the middle of the neighbouring swing is used, unless the motion begins or ends at
    rest.
    """
    first, last = turns[k], turns[k + 1]
    part, at = y[first : last + 1], k
    steps = np.abs(np.diff(part))
    if len(turns) > 2 and k == 0 and steps[0] > 0.1 * steps.max():
        at = 1
    elif len(turns) > 2 and k == len(turns) - 2 and steps[-1] > 0.1 * steps.max():
        at = k - 1
    crossings = zero_crossings(t[first : last + 1], part - 0.5 * (y[turns[at]] + y[turns[at + 1]]))
    return 0.5 * (crossings[0] + crossings[-1]) if crossings.size else np.nan


def amplitude(y):
    """Return half of the peak-to-peak value of a motion, in the unit of ``y``; NaN without samples."""
    return 0.5 * float(np.ptp(y)) if np.size(y) else np.nan


def growth_rate(t, y):
    """Return the growth rate of an oscillation, 1/s: slope of the logarithm of its extrema (above 1 nm) over t (s); NaN
    with fewer than two extrema."""
    t, y = np.asarray(t), np.asarray(y)
    edges = _sign_changes(y) + 1
    tops = [start + int(np.argmax(np.abs(y[start:end]))) for start, end in zip(edges[:-1], edges[1:], strict=True)]
    least = max([1e-6 * abs(y[top]) for top in tops] + [DEAD])  # below it there is rounding noise
    tops = [top for top in tops if abs(y[top]) > least]
    if len(tops) < 2:
        return np.nan
    return float(np.polyfit(t[tops], np.log(np.abs(y[tops])), 1)[0])


def path_of(run):
    """Build the `PathData` of a run's track from its scene; straight if the scene does not define a path."""
    track = run.scene.get("track", {})
    if track.get("path", "tangent") == "tangent" and not track.get("gradients"):
        return tangent_path()
    return build_track({key: track[key] for key in track if key not in ("irregularity", "support")}, "run").path
