"""Alignment of a measured signal with a run by cross-correlation."""

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.messages import warn
from wrcore.signals.filters import without_gaps

LEAST_OVERLAP = 0.5
"""Smallest overlap of both signals, as a share of the shorter one: a short overlap can have any correlation."""

WEAK = 0.5
"""Correlation coefficient below which a warning says that the alignment is doubtful."""

AMBIGUOUS = 0.95
"""Share of the largest coefficient at which another shift is as good, as in periodic motion."""


def offset_by_correlation(run, signal, step, channel, unit):
    """Return the number (s or m) to add to the positions of a signal so that it fits a run.

    ``run`` and ``signal`` are pairs of positions and values (n,), NaN in gaps, at the same even ``step``. The offset
    maximises their correlation coefficient; a parabola through three values refines it below the step. ``channel`` and
    ``unit`` (of the step) are for messages."""
    (x, a, known_a), (x_signal, b, known_b) = ((x, *without_gaps(values)) for x, values in (run, signal))
    if any(np.count_nonzero(known) < 4 or np.ptp(values) == 0.0 for values, known in ((a, known_a), (b, known_b))):
        raise InputError("aligned", channel, "expected a channel that varies in the run and in the signal")
    shifts, coefficients = correlation_by_shift(a, known_a, b, known_b)
    if not np.isfinite(coefficients).any():
        raise InputError("aligned", channel, "expected a channel that varies where both overlap by a half")
    k = int(np.nanargmax(coefficients))
    _warn_if_doubtful(coefficients, k, step, channel, unit)
    fine = float(shifts[k])
    if 0 < k < len(shifts) - 1 and np.isfinite(coefficients[k - 1 : k + 2]).all():
        before, peak, after = coefficients[k - 1 : k + 2]
        bend = before - 2.0 * peak + after
        fine += 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return fine * step + x[0] - x_signal[0]


def correlation_by_shift(a, known_a, b, known_b):
    """Return shifts (in samples) and the correlation coefficient of a (n,) and b (m,) for each shift of b.

    At a shift k, b[i] stands at the position of a[i + k]. The mean and the variance are those of the overlap. The
    coefficient is NaN where the overlap is below `LEAST_OVERLAP`, and values that are not known are left out."""
    from scipy.signal import fftconvolve

    a, b = a - a[known_a].mean(), b - b[known_b].mean()
    a, b = np.where(known_a, a, 0.0), np.where(known_b, b, 0.0)
    one_a, one_b = known_a.astype(float), known_b.astype(float)

    def over_shifts(p, q):
        return fftconvolve(p, q[::-1])

    n = np.round(over_shifts(one_a, one_b))
    enough = n >= max(LEAST_OVERLAP * min(one_a.sum(), one_b.sum()), 4.0)
    n = np.where(enough, n, 1.0)
    sum_a, sum_b = over_shifts(a, one_b), over_shifts(one_a, b)
    var_a = over_shifts(a * a, one_b) - sum_a**2 / n
    var_b = over_shifts(one_a, b * b) - sum_b**2 / n
    enough &= (var_a > 1e-9 * (a @ a)) & (var_b > 1e-9 * (b @ b))
    with np.errstate(invalid="ignore", divide="ignore"):
        coefficients = (over_shifts(a, b) - sum_a * sum_b / n) / np.sqrt(var_a * var_b)
    return np.arange(len(n)) - (len(b) - 1), np.where(enough, coefficients, np.nan)


def _warn_if_doubtful(coefficients, k, step, channel, unit):
    """Warn if the largest coefficient is small, or if a shift beyond its peak has nearly the same coefficient."""
    best = coefficients[k]
    if best < WEAK:
        warn(f"aligned: {channel} of run and signal have a correlation coefficient of only {best:.2f}")
        return
    low = coefficients < 0.5 * best
    before, after = np.flatnonzero(low[:k]), np.flatnonzero(low[k:])
    beyond = np.full(len(coefficients), np.nan)
    if before.size:
        beyond[: before[-1]] = coefficients[: before[-1]]
    if after.size:
        beyond[k + after[0] :] = coefficients[k + after[0] :]
    is_peak = coefficients >= np.fmax(np.roll(coefficients, 1), np.roll(coefficients, -1))
    similar = np.flatnonzero((beyond > AMBIGUOUS * best) & is_peak)
    if similar.size:
        nearest = similar[np.argmin(np.abs(similar - k))]
        text = f"a shift {abs(nearest - k) * step:.4g} {unit} away fits {channel} nearly as well"
        coefficient = f"correlation coefficient {coefficients[nearest]:.3f}, the best one {best:.3f}"
        warn(f"aligned: {text} ({coefficient}): a motion that repeats cannot be aligned safely")
