"""Path of a track from measured curvature and superelevation: tangents, transitions and curves by least squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.checked_calls import ABOVE_ZERO, checked
from wrcore.signals.filters import without_gaps, zero_phase
from wrcore.signals.signal import Signal

STEP = 1.0
"""Step of the grid on which the path is fitted, m."""

SHORT = 2.0
"""Length, m, of the tangent or curve that precedes a path which begins within a transition."""

MOST_FITS = 4
"""Largest number of fits, after each of which nearly straight curves become tangents."""


@dataclass(frozen=True, eq=False)
class FittedPath:
    """Path of a track, as the key ``track.path`` of a scene takes it, and its errors.

    Examples
    --------
    >>> import numpy as np
    >>> import wrcore as wr
    >>> s = np.arange(0.0, 500.0)
    >>> curvature = np.interp(s, [0, 100, 160, 400, 460, 500], [0, 0, 1 / 600, 1 / 600, 0, 0])
    >>> found = wr.fit_path(wr.Signal("s_m", s, {"curvature_per_m": curvature}))
    >>> [next(iter(segment)) for segment in found.path], round(found.path[2]["radius"], 1)
    (['tangent', 'transition', 'curve', 'transition', 'tangent'], 600.0)
    """

    path: list[dict[str, Any]]
    """Segments with lengths, radii (positive to the left) and cants, m."""
    begin: float
    """Distance of the signal at which the path begins, m."""
    curvature_error: float
    """Root mean square of measured minus fitted curvature, 1/m."""
    cant_error: float
    """Root mean square of measured minus fitted superelevation, m; NaN without one."""


@checked
def fit_path(
    signal: Signal,
    curvature: str = "curvature_per_m",
    superelevation: str | None = None,
    tolerance: Annotated[float, ABOVE_ZERO] = 1e-4,
    shortest: Annotated[float, ABOVE_ZERO] = 20.0,
) -> FittedPath:
    """Fit a path of tangents, linear transitions and curves to measured curvature.

    The measured curvature is smoothed and divided where it leaves straight lines by more than the tolerance. Then
    lengths and radii are fitted to the unsmoothed values by least squares, and cants at the same ends of segments.

    Parameters
    ----------
    signal : Signal
        Over distance, such as from :func:`wrcore.read_signal` of a recording car's file.
    curvature : str
        Channel with the curvature, 1/m, positive to the left.
    superelevation : str, optional
        Channel with the height of the left rail above the right one, m. Tangents of a scene have no cant.
    tolerance : float
        Change of curvature, 1/m, below which a segment is a curve, and curvature below which it is a tangent. It should
        be twice the noise of the measurement or more.
    shortest : float
        Length, m, of the shortest segment; shorter waves are smoothed, shorter segments are merged.

    Returns
    -------
    FittedPath

    Raises
    ------
    InputError
        If the signal is not over distance or is shorter than three segments.

    Examples
    --------
    >>> import numpy as np
    >>> import wrcore as wr
    >>> s = np.arange(0.0, 300.0)
    >>> found = fit_path(wr.Signal("s_m", s, {"curvature_per_m": np.interp(s, [0, 100, 150], [0, 0, -0.002])}))
    >>> round(found.path[0]["tangent"]), round(found.path[2]["radius"])
    (100, -500)
    """
    if signal.axis != "s_m" or signal.x[-1] - signal.x[0] < 3.0 * shortest:
        raise InputError("fit_path", "signal", f"expected a signal over a distance of {3.0 * shortest:g} m or more")
    even = signal.resampled(max(STEP, signal.step))
    values = without_gaps(even[curvature])[0]
    if not np.isfinite(values).all():
        raise InputError("fit_path", curvature, "expected a channel with values")
    smooth = zero_phase(values, 1.0 / even.step, (None, min(1.0 / shortest, 0.4 / even.step)))
    knots, at_knots = _merged(even.x, values, _divided(even.x, smooth, tolerance), tolerance, shortest)
    for _ in range(MOST_FITS):
        knots, level_of_knot, levels = _with_constant_segments(knots, at_knots, tolerance)
        knots, levels = _fitted(even.x, values, knots, level_of_knot, levels, tolerance)
        at_knots = levels[level_of_knot]
        if not (np.abs(levels[1:]) < tolerance).any():
            break  # else a curve of nearly no curvature becomes a tangent in the next fit
    fitted = np.interp(even.x, knots, at_knots)
    cants, cant_error = np.zeros(len(levels)), np.nan
    if superelevation is not None:
        heights = without_gaps(even[superelevation])[0]
        cants, cant_error = _cants(even.x, heights, knots, level_of_knot, levels)
    path = _segments(knots, level_of_knot, levels, cants, superelevation is not None)
    return FittedPath(path, float(knots[0]), _rms(values - fitted), cant_error)


def _rms(values):
    return float(np.sqrt(np.mean(values**2)))


def _divided(x, values, tolerance):
    """Return ends of straight lines, such that the distance of all values from them is within the tolerance.

    This is the algorithm of Ramer, Douglas and Peucker with the distance in values."""
    chosen, stack = {0, len(x) - 1}, [(0, len(x) - 1)]
    while stack:
        low, high = stack.pop()
        if high - low < 2:
            continue
        line = np.interp(x[low : high + 1], x[[low, high]], values[[low, high]])
        distance = np.abs(values[low : high + 1] - line)
        k = int(distance.argmax())
        if distance[k] > tolerance:
            chosen.add(low + k)
            stack += [(low, low + k), (low + k, high)]
    return x[sorted(chosen)]


def _at_knots(x, values, knots):
    """Return the values (m,) at the ends of the continuous piecewise linear function that is closest to values (n,).

    Its normal equations are tridiagonal. A small diagonal term decides where a line holds no sample."""
    from scipy.linalg import solveh_banded

    count = len(knots)
    k = np.clip(np.searchsorted(knots, x, "right") - 1, 0, count - 2)
    share = (x - knots[k]) / (knots[k + 1] - knots[k])

    def sums(weights, at):
        return np.bincount(at, weights, count)

    diagonal = sums((1.0 - share) ** 2, k) + sums(share**2, k + 1) + 1e-9
    off_diagonal = sums(share * (1.0 - share), k)
    right = sums((1.0 - share) * values, k) + sums(share * values, k + 1)
    return solveh_banded(np.stack([diagonal, off_diagonal]), right, lower=True)


def _merged(x, values, knots, tolerance, shortest):
    """Return ends of straight lines, and values there, without ends that make no difference and short segments.

    Values at the ends are those of the continuous piecewise linear function that is closest to the values."""
    while True:
        found = _at_knots(x, values, knots)
        if len(knots) == 2:
            return knots, found
        lengths = np.diff(knots)
        lines = found[:-2] + (found[2:] - found[:-2]) * lengths[:-1] / (knots[2:] - knots[:-2])
        bends = np.abs(found[1:-1] - lines)
        k = int(bends.argmin())
        if bends[k] < tolerance:
            knots = np.delete(knots, k + 1)
            continue
        k = int(lengths.argmin())
        if lengths[k] >= shortest:
            return knots, found
        if k in (0, len(lengths) - 1):  # the first and the last end stay
            knots = np.delete(knots, 1 if k == 0 else k)
        else:
            knots = np.concatenate([knots[:k], [0.5 * (knots[k] + knots[k + 1])], knots[k + 2 :]])


def _with_constant_segments(knots, values, tolerance):
    """Return ends of segments, the index of each end's level, and the levels; level 0 is that of tangents.

    Both ends of a nearly constant line have one level; a constant line that continues another one joins it."""
    level_of_knot, levels = [], [0.0]

    def level(value):
        if abs(value) < tolerance:
            return 0
        levels.append(value)
        return len(levels) - 1

    level_of_knot.append(level(values[0]))
    for value in values[1:]:
        before = level_of_knot[-1]
        level_of_knot.append(before if abs(value - levels[before]) < tolerance else level(value))
    if level_of_knot[0] != level_of_knot[1]:  # the path begins with a curve or a tangent
        knots = np.insert(knots, 1, knots[0] + SHORT)
        level_of_knot.insert(0, level_of_knot[0])
    inner = [k for k in range(1, len(knots) - 1) if level_of_knot[k - 1] == level_of_knot[k] == level_of_knot[k + 1]]
    return np.delete(knots, inner), np.delete(np.array(level_of_knot), inner), np.array(levels)


def _fitted(x, values, knots, level_of_knot, levels, tolerance):
    """Return ends and levels that are closest to the values; the first and the last end and the level 0 stay."""
    from scipy.optimize import least_squares

    n_inner = len(knots) - 2

    def parts(unknown):
        inner = np.maximum.accumulate(np.clip(unknown[:n_inner], knots[0], knots[-1]))
        return np.concatenate([knots[:1], inner, knots[-1:]]), np.concatenate([[0.0], unknown[n_inner:] * tolerance])

    def residuals(unknown):
        ends, at_levels = parts(unknown)
        ends = ends + 1e-6 * np.arange(len(ends))
        return (np.interp(x, ends, at_levels[level_of_knot]) - values) / tolerance

    begin = np.concatenate([knots[1:-1], levels[1:] / tolerance])
    if not begin.size:
        return knots, levels
    return parts(least_squares(residuals, begin, x_scale="jac", diff_step=1e-6).x)


def _cants(x, heights, knots, level_of_knot, levels):
    """Return the cant (m) of each level, and the root mean square of the differences of superelevation, m."""
    basis = np.zeros((len(x), len(levels)))
    for k, level in enumerate(level_of_knot):
        basis[:, level] += np.interp(x, knots, (np.arange(len(knots)) == k).astype(float))
    basis[:, 0] = 0.0  # tangents have no cant
    found = np.linalg.lstsq(basis, heights, rcond=None)[0]
    return -np.sign(levels) * found, _rms(heights - basis @ found)


def _segments(knots, level_of_knot, levels, cants, has_cant):
    """Return the segments of the key ``track.path``."""
    path: list[dict[str, Any]] = []
    ends = list(zip(level_of_knot[:-1], level_of_knot[1:], strict=True))
    for k, (first, last) in enumerate(ends):
        length = float(knots[k + 1] - knots[k])
        if length <= 1e-3:
            continue
        described = {"radius": float(1.0 / levels[last])} if last and levels[last] else {}
        if described and has_cant:
            described["cant"] = float(cants[last])
        if first != last:
            is_before_ramp = k + 1 == len(ends) or ends[k + 1][0] != ends[k + 1][1]
            path.append({"transition": length, **(described if is_before_ramp else {})})
        else:
            path.append({"curve": length, **described} if last else {"tangent": length})
    return path
