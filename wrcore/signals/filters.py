"""Butterworth filters and resampling, the same for runs and for measured signals."""

import numpy as np

from wrcore.errors import InputError

ORDER = 4
"""Order of the filters, forwards, or forwards and backwards together: that of the low-pass of EN 14363 in wrcore."""

CUT = 20.0
"""Corner frequency of the low-pass of guiding and wheel forces by EN 14363 (20 Hz or more, see
`wrcore.analysis.assessment.assess`), Hz."""

ANTI_ALIAS = 0.8
"""Corner of the low-pass before a coarser grid, as a share of the grid's largest frequency."""

ANTI_ALIAS_ORDER = 16
"""Order of this low-pass. At 1.5 times the corner it leaves 0.4 % of the amplitude; higher frequencies would be aliased
to frequencies below the corner."""

EVEN = 1e-4
"""Largest difference of steps, relative to their median, of samples that are treated as evenly spaced."""


def low_pass(values, rate, cut=CUT):
    """Filter a signal (n,) by a Butterworth low-pass of fourth order, forwards, initially steady at the first value.

    ``rate`` and the corner frequency ``cut`` are in Hz."""
    from scipy import signal

    values = np.asarray(values, float)
    filter_ = signal.butter(ORDER, cut, fs=rate, output="sos")
    return signal.sosfilt(filter_, values, zi=signal.sosfilt_zi(filter_) * values[0])[0]


def zero_phase(values, rate, band, order=ORDER):
    """Filter values (n,) without NaN by a Butterworth filter of no phase, forwards and backwards.

    ``band`` is the lower and the upper corner, each a frequency in the unit of ``rate`` (Hz, or 1/m over distance) or
    None. Both passes together have the ``order`` and reduce the amplitude to 71 % at a corner. The ends are continued
    by their point reflection; they are inexact over about one period of the lower corner."""
    from scipy import signal

    low, high = band
    values = np.asarray(values, float)
    for corner, kind in ((high, "lowpass"), (low, "highpass")):
        if corner:
            shift = (np.sqrt(2.0) - 1.0) ** (1.0 / order)  # each of two passes of half the order has half the decibels
            warped = np.tan(np.pi * corner / rate) * (shift if kind == "highpass" else 1.0 / shift)
            sections = signal.butter(order // 2, 2.0 / np.pi * np.arctan(warped), kind, output="sos")
            pad = min(int(3.0 * rate / corner) + 3 * order, len(values) - 1)
            values = signal.sosfiltfilt(sections, values, padtype="odd", padlen=pad)
    return values


def check_band(band, rate, source, unit="Hz"):
    """Return both corners of a band (None: no filter); InputError unless 0 < lower < upper < half of the rate."""
    low, high = (None, None) if band is None else band
    corners = [corner for corner in (low, high) if corner is not None]
    if any(not 0.0 < corner < 0.5 * rate for corner in corners) or len(corners) == 2 and corners[0] >= corners[1]:
        expected = f"expected corners above 0 and below {0.5 * rate:g} {unit}, half of the rate, the lower one first"
        raise InputError(source, "band", f"{expected}, got {low} and {high}")
    return low, high


def without_gaps(values):
    """Return values (n,) with linear interpolation in gaps, and whether each is known; a signal of NaN stays NaN."""
    known = np.isfinite(values)
    if known.all() or not known.any():
        return values, known
    index = np.arange(len(values))
    return np.interp(index, index[known], values[known]), known


def usual_step(x):
    """Return the median distance of samples at increasing positions (n,)."""
    return float(np.median(np.diff(x)))


def is_even(x):
    """Whether positions (n,) are evenly spaced."""
    steps = np.diff(x)
    return bool(np.ptp(steps) <= EVEN * np.median(steps))


def on_grid(x, values, grid):
    """Return values (n,) at increasing positions x (n,) on an even ``grid``, NaN in gaps and outside of x.

    A low-pass without phase removes what a coarser grid cannot hold; then a cubic spline is evaluated."""
    from scipy.interpolate import CubicSpline

    filled, known = without_gaps(np.asarray(values, float))
    if not known.any() or len(x) < 4:
        return np.interp(grid, x, filled, left=np.nan, right=np.nan) if known.any() else np.full(len(grid), np.nan)
    step, fine = float(grid[1] - grid[0]), usual_step(x)
    at, even = x, filled
    if step > fine * (1.0 + EVEN):
        if not is_even(x):
            at = x[0] + fine * np.arange(int((x[-1] - x[0]) / fine + 1e-6) + 1)
            even = CubicSpline(x, filled)(at)
        even = zero_phase(even, 1.0 / fine, (None, ANTI_ALIAS * 0.5 / step), ANTI_ALIAS_ORDER)
    out = CubicSpline(at, even)(grid)
    missing = np.interp(grid, x, (~known).astype(float)) > 0.0
    slack = 1e-9 * max(abs(x[0]), abs(x[-1]), step)
    out[missing | (grid < x[0] - slack) | (grid > x[-1] + slack)] = np.nan
    return out
